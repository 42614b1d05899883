"""Speeds of a gear train with carriers, exact in fractions.

The pitch circles of a mesh roll on each other in the frame of its carrier (Willis):
z_1 (w_1 - w_c) + z_2 (w_2 - w_c) = 0, with z_2 < 0 for a ring (ISO 21771), w_c = 0 without carrier, and w = 0 if held.
The solutions of all meshes are the null space of their rows; its dimension is the number of speeds to impose.
"""

from collections.abc import Collection, Sequence
from fractions import Fraction
from typing import NamedTuple

from fem.support.validation import require

Row = list[Fraction]


class MeshOfMembers(NamedTuple):
    """A mesh by the names of its members: pinion and wheel with their numbers of teeth, and their carrier, or None."""

    pinion: str
    wheel: str
    z_1: int
    z_2: int
    carrier: str | None = None


def null_space(rows: Sequence[Row], size: int) -> list[Row]:
    """Basis of all vectors (size,) that rows (size,) map to 0, by Gauss' elimination; exact."""
    reduced, pivots = [list(row) for row in rows], list[int]()
    for column in range(size):
        below = next((i for i in range(len(pivots), len(reduced)) if reduced[i][column]), None)
        if below is None:
            continue
        k = len(pivots)
        reduced[k], reduced[below] = reduced[below], reduced[k]
        reduced[k] = [x / reduced[k][column] for x in reduced[k]]
        for i in range(len(reduced)):
            if i != k and (factor := reduced[i][column]):
                reduced[i] = [x - factor * y for x, y in zip(reduced[i], reduced[k], strict=True)]
        pivots.append(column)
    basis = []
    for free in (column for column in range(size) if column not in pivots):
        vector = [Fraction(0)] * size
        vector[free] = Fraction(1)
        for k, pivot in enumerate(pivots):
            vector[pivot] = -reduced[k][free]
        basis.append(vector)
    return basis


def motions(meshes: Sequence[MeshOfMembers], held: Collection[str] = ()) -> tuple[list[str], list[Row]]:
    """Names of all members, and a basis of the speeds that the meshes allow while some members are held."""
    members = list(dict.fromkeys(name for mesh in meshes for name in (mesh.pinion, mesh.wheel, mesh.carrier) if name))
    rows = []
    for mesh in meshes:
        row = [Fraction(0)] * len(members)
        row[members.index(mesh.pinion)] += mesh.z_1
        row[members.index(mesh.wheel)] += mesh.z_2
        if mesh.carrier:
            row[members.index(mesh.carrier)] -= mesh.z_1 + mesh.z_2
        rows.append(row)
    for name in held:
        rows.append([Fraction(int(member == name)) for member in members])
    return members, null_space(rows, len(members))


def speeds_of_members(meshes: Sequence[MeshOfMembers], driving: str, held: Collection[str] = ()) -> dict[str, Fraction]:
    """Speed of every member over that of the driving one, exact.

    held   names of the members that the housing holds

    Raises ValueError where the meshes jam, and where no member takes the reaction, so that speeds are not determined.
    """
    members, basis = motions(meshes, held)
    unknown = [name for name in (driving, *held) if name not in members]
    require(not unknown, f"no members {unknown}; the members are {members}")
    require(driving not in held, f"{driving!r} is held and cannot drive; let another member drive, or hold another one")
    at = members.index(driving)
    if len(basis) > 1:
        reaction = _reaction_members(meshes, driving, held, len(basis))
        undetermined = f"{len(basis)} speeds are free, a drive imposes one: no member takes the reaction torque"
        hold = f"hold one of {reaction}, as in Gearbox([...], held={reaction[0]!r})"
        raise ValueError(f"{undetermined}; {hold}, or give {len(basis)} speeds, as in {_example(driving, reaction)}")
    require(bool(basis) and basis[0][at] != 0, f"the train jams: member {driving!r} cannot turn; hold fewer members")
    return {name: speed / basis[0][at] for name, speed in zip(members, basis[0], strict=True)}


def _example(driving: str, members: Sequence[str]) -> str:
    """How to give a gearbox the speeds of several members."""
    return f"Gearbox([...], speeds={{{driving!r}: 1.0, {members[0]!r}: 0.5}})"


def motions_of_members(
    meshes: Sequence[MeshOfMembers], independent: Sequence[str], held: Collection[str] = ()
) -> dict[str, dict[str, Fraction]]:
    """Speed of every member per speed of each independent one, the others of which stand; exact.

    Raises ValueError unless the speeds of the independent members determine all others, and none of them is too much.
    """
    members, free = motions(meshes, held)
    unknown = [name for name in (*independent, *held) if name not in members]
    require(not unknown, f"no members {unknown}; the members are {members}")
    number = f"speeds must hold {len(free)} members, as many as are free to choose, got {[*independent]}"
    fewer = "leave one out" if len(independent) > len(free) else "add one, or hold a member: held=..."
    require(len(independent) == len(free), f"{number}; {fewer}")
    _, undetermined = motions(meshes, [*held, *independent])
    determined = f"speeds of {[*independent]} depend on one another and leave other members free"
    require(not undetermined, f"{determined}; give those of other members")
    return {
        name: speeds_of_members(meshes, name, [*held, *(driven for driven in independent if driven != name)])
        for name in independent
    }


def _reaction_members(meshes, driving: str, held: Collection[str], free: int) -> list[str]:
    """Members that are no planets, and by whose hold a speed less is free while the driving member still turns."""
    members, _ = motions(meshes)
    candidates = []
    for name in members:
        if name != driving and name not in held:
            _, basis = motions(meshes, [*held, name])
            turns = any(vector[members.index(driving)] for vector in basis)
            candidates += [name] * (len(basis) < free and turns)
    planets = planets_of(meshes)
    return [name for name in candidates if name not in planets] or candidates


def planets_of(meshes: Sequence[MeshOfMembers]) -> set[str]:
    """Members between two others on a carrier: the wheel of a mesh on it and the pinion of another one."""
    on_carriers = [mesh for mesh in meshes if mesh.carrier]
    return {mesh.wheel for mesh in on_carriers} & {mesh.pinion for mesh in on_carriers}
