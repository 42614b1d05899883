"""Flank compliance of one gear by finite elements; the half-space under the load is split off in closed form.

A load on the flank of tooth 0 is a sum of hat functions along the profile times hat functions across the face width.
The solid has a coarse mesh of quadratic hexahedra. Its section under uniform line loads (plane strain, or along a helix
a state in which all sections deform alike) is solved on the same mesh and on refined ones: the difference corrects the
solid near the load and in the bending of tooth and rim. From the sum the half-space under the same load is subtracted.
The remainder is smooth in both directions and is tabulated here; the half-space has a closed form
(`half_space`), so that the contact may be discretized as finely as it needs in both directions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from math import copysign, cos, inf, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np
from skfem import Basis, ElementLineP1, ElementLineP2, LinearForm, MeshLine

from fem.elasticity import extrusion, section_mesh
from fem.elasticity.face_symmetry import Face, HalfFace, WholeFace
from fem.elasticity.half_space import half_space
from fem.elasticity.hat_functions import hat, hats, overlap, spread, values_of_means
from fem.elasticity.mesh_density import Density
from fem.elasticity.pitch_condensation import Prism, flank_displacements
from fem.elasticity.rim_bending import RimBending, rim_bending
from fem.elasticity.rim_harmonics import rim_harmonics
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.support.blas_threads import one_thread, side_by_side
from fem.support.cache import Arrays, cached, folder, known, source_stamp
from fem.support.progress import announced, bar
from fem.support.representation import exact

#: Parts of the section that bend, and how much finer they are in the section from which the bending is corrected.
BENDING_PARTS, FINER = ("tooth", "fillet", "rim", "body"), 2
#: Kinds of solutions in the cache: of the section, of the solid from end face to end face, of a rim that bends.
NEAR, WHOLE, RIM = "near field", WholeFace.name, "rim"
#: Loads on the whole width of a spur gear are sums of equal and of opposite ones on its halves.
HALVES = HalfFace(), HalfFace(antisymmetric=True)
#: Order that the quadrature of flank loads integrates exactly: quadratic shape functions times hats and their slope.
FLANK_ORDER = 7
#: Number of compliances that a process remembers: of pinion and wheel, over half of the face and over the whole.
REMEMBERED = 4


@dataclass(frozen=True)
class Compliance:
    """Flank compliance of one gear without the half-space; displacements and forces are normal to the flank.

    arcs        (n_hat,) arc lengths of the tops of the hat functions along the flank [m]
    axial       (n_axial,) axial positions of their tops across the width [m]
    end         distance from mid-plane to the gear's end faces [m]
    blocks      (teeth + 1, n_axial, n_hat, n_axial, n_hat) displacement of tooth d per force on tooth 0 [m/N]
    slide       (behind + 1 + teeth, ...) the same for the displacement along the profile towards the tip, from tooth
                -behind on
    face        modelled part of the face width; if it is half of it, the same forces act on the other half
    pitches     largest distance in pitches at which a loaded tooth deflects another tooth
    rim         what the bending of a supported rim adds to that of the clamped gear; None where it is clamped
    """

    arcs: np.ndarray
    axial: np.ndarray
    end: float
    blocks: np.ndarray
    slide: np.ndarray
    face: Face
    pitches: float = inf
    rim: RimBending | None = None


class Computation(NamedTuple):
    """A solution: its name in the cache, and how it is computed."""

    name: str
    compute: Callable[[], Arrays]


def flank_compliance(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> Compliance:
    """Compliance of the gear clamped at its bore or outer rim, or with its rim on supports; kept in the cache.

    loaded      width of the part of the face that can carry load, in its middle [m]
    whole       whether to model the whole face, for loads that differ on its halves; always done for helical gears
    """
    return flank_compliances([(gear, density, loaded)], whole=whole)[0]


def flank_compliances(bodies: Sequence[tuple[Gear, Density, float]], *, whole: bool = False) -> list[Compliance]:
    """`flank_compliance` of gears, each with its density and loaded width; what is not in the cache is solved at once.

    The solutions are spread over threads as `side_by_side` says.
    """
    needed = [_computations(*body, whole) for body in bodies]
    by_name = {name: compute for computations in needed for name, compute in computations.values()}
    largest_first = sorted(by_name.items(), key=lambda named: named[0].startswith(NEAR))
    missing = [partial(cached, name, compute) for name, compute in largest_first if not known(name)]
    if missing:
        teeth = " and ".join(dict.fromkeys(str(gear.z) for gear, *_ in bodies))
        with announced(f"compliance of the gear of {teeth} teeth, kept for later"):
            list(bar(side_by_side(missing), "finite elements", np.ones(len(missing))))
    store = folder()
    return [_assembled(replace(gear, flank=()), density, loaded, whole, store) for gear, density, loaded in bodies]


def _computations(gear: Gear, density: Density, loaded: float, whole: bool) -> dict[str, Computation]:
    """The `solutions` by their kinds."""
    names, body = solutions(gear, density, loaded, whole=whole), bare(gear)
    computations = {NEAR: Computation(names[NEAR], partial(section_corrections, body, replace(density, width=1)))}
    for face in _solved(gear, whole):
        computations[face.name] = Computation(names[face.name], partial(solid, body, density, loaded, face))
    if gear.support:
        computations[RIM] = Computation(names[RIM], partial(free_ring, body, density, loaded))
    return computations


@lru_cache(maxsize=REMEMBERED)
def _assembled(gear: Gear, density: Density, loaded: float, whole: bool, store: Path) -> Compliance:
    """Compliance of a gear without modifications from the `solutions` in a cache folder, for all its flanks."""
    solved = {kind: cached(*named) for kind, named in _computations(gear, density, loaded, whole).items()}
    face = WholeFace() if whole or gear.beta else HalfFace()
    arcs, (upper, _) = section_mesh.flank_hats(gear, density), lines_across(gear, density, loaded)
    axial, means = face.positions(upper), mean_compliance(gear, upper, whole, solved)
    blocks = np.concatenate([means[:1] - half_space(gear, arcs, axial, face), means[1:]])
    across, along = values_of_means(axial), values_of_means(arcs)
    with one_thread():
        values = np.einsum("yi,hj,dijkl,zk,ml->dyhzm", across, along, blocks, across, along, optimize=True, order="C")
    normal, tangential = values[: density.teeth + 1], values[density.teeth + 1 :]
    rim = supported_rim(gear, upper, across, along, face, solved[RIM]) if gear.support else None
    return Compliance(arcs, axial, gear.b / 2, normal, tangential, face, rim=rim)


def supported_rim(
    gear: Gear, upper: np.ndarray, across: np.ndarray, along: np.ndarray, face: Face, harmonics: Arrays
) -> RimBending:
    """Bending of the rim of a ring over the face whose hats have values at their tops by across and along."""
    flank = harmonics["flank"].reshape(-1, 2, 2, harmonics["flank"].shape[2] // (2 * along.shape[1]), along.shape[1])
    if flank.shape[3] < len(across):
        flank = np.concatenate([flank[:, :, :, :0:-1], flank], axis=3)
    flank = flank[:, :, :, :: int(copysign(1, gear.beta))]
    values = np.einsum("yi,ncvij,hj->ncvyh", across, flank, along, optimize=True)
    return rim_bending(harmonics, values, gear.support, abs(gear.r_clamp), face.share, abs(gear.z))


def lines_across(gear: Gear, density: Density, loaded: float) -> tuple[np.ndarray, MeshLine]:
    """Axial positions (n,) of the tops of the hat functions from mid-plane on [m]; mesh of that half of the width."""
    line = extrusion.half_face(gear.b, loaded, density.width)
    return np.sort(line.p[0])[: density.width + 1], line


def mean_compliance(gear: Gear, upper: np.ndarray, whole: bool, solved: dict[str, Arrays]) -> np.ndarray:
    """(n_virtual, n_axial, n_hat, n_axial, n_hat) mean displacements over hats per force on tooth 0 [m/N]."""
    solids = {half.name: solved[half.name]["blocks"] for half in _solved(gear, whole)}
    if gear.support:
        solids[_solved(gear, whole)[0].name] = solids[_solved(gear, whole)[0].name] + solved[RIM]["free"]
    means = [corrected(gear, upper, solids[half.name], solved[NEAR], half) for half in _solved(gear, whole)]
    if gear.beta:
        hand = int(copysign(1, gear.beta))
        return means[0][:, ::hand, :, ::hand]
    return both_halves(*means) if whole else means[0]


def bare(gear: Gear) -> Gear:
    """The gear whose finite elements stand for this one: right-hand, its flanks unmodified, without supports."""
    return replace(gear, flank=(), beta=abs(gear.beta), support=())


def solutions(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> dict[str, str]:
    """Cache names of the solutions that `flank_compliance` needs: section, solid for each modelled face, free ring."""
    body, section, stamp = exact(bare(gear)), exact(replace(density, width=1)), _stamp()
    solids = {face.name: f"solid {stamp} {body} {exact(density)} {loaded} {face.name}" for face in _solved(gear, whole)}
    rim = {RIM: f"free ring {stamp} {body} {exact(density)} {loaded}"} if gear.support else {}
    return {NEAR: f"near field {stamp} {body} {section}"} | solids | rim


@cache
def _stamp() -> int:
    """Checksum of the source of the finite elements when they were first used: later changes are not imported."""
    return source_stamp(__name__)


def _solved(gear: Gear, whole: bool) -> tuple[Face, ...]:
    """Parts of the face width whose solids are solved."""
    if gear.beta:
        return (WholeFace(),)
    return HALVES if whole else HALVES[:1]


def section_corrections(gear: Gear, density: Density) -> Arrays:
    """(n_virtual, n_hat, n_hat) displacement on refined sections minus the coarse one, per uniform line load [m^2/N].

    "bending" comes from finer elements inside tooth, root, rim and body; it decays along the width over half the depth
    of tooth and rim layer. "local" is the rest, under the load.
    """
    coarse, arcs = density.paired(), section_mesh.flank_hats(gear, density)
    inside = replace(coarse, **{name: FINER * getattr(coarse, name) for name in BENDING_PARTS})
    u_coarse, u_inside, u_fine = (
        uniform_load_compliance(gear, arcs, mesh) for mesh in (coarse, inside, density.refined(2))
    )
    return {"local": u_fine - u_inside, "bending": u_inside - u_coarse}


def corrected(gear: Gear, upper: np.ndarray, blocks: np.ndarray, corrections: Arrays, face: Face) -> np.ndarray:
    """Compliance of a `solid` with beta >= 0 plus `section_corrections`, spread along its width."""
    axial, reach = face.positions(upper), (gear.r_a - section_mesh.rim_radius(gear)) / 2
    along = {"local": overlap(axial), "bending": spread(axial, reach, odd=face.antisymmetric)}
    return blocks + sum(np.einsum("yz,dhk->dyhzk", along[part], corrections[part]) for part in along)


def both_halves(equal: np.ndarray, opposite: np.ndarray) -> np.ndarray:
    """Blocks over the whole width, superposed from those under equal and under opposite loads on its halves."""
    same_half, across_mid_plane = (equal + opposite) / 2, (equal - opposite) / 2
    back = slice(None, None, -1)
    upper = np.concatenate([same_half[:, back, :, back], across_mid_plane[:, back]], axis=3)
    lower = np.concatenate([across_mid_plane[:, :, :, back], same_half], axis=3)
    halves = np.concatenate([upper, lower], axis=1)
    n = equal.shape[1]
    joined = np.zeros((2 * n - 1, 2 * n))
    joined[np.arange(n), np.arange(n)] = joined[np.arange(n) + n - 1, np.arange(n) + n] = 1.0
    joined[n - 1] /= 2
    return np.einsum("yi,dihjk,zj->dyhzk", joined, halves, joined, optimize=True)


def flank_line(gear: Gear, section: Basis, tooth: int) -> tuple[Basis, np.ndarray, np.ndarray]:
    """The flank of a tooth as a line of elements: its basis over the length, vertices (2, n) [m], dofs of the section.

    scikit-fem's FacetBasis finds points on facets by Newton's method, which fails for small elements far from the axis.
    """
    mesh, facets = section.mesh, section_mesh.flank_facets(gear, section.mesh, tooth)
    facets = facets[np.argsort(tooth_profile.polar(gear, mesh.p[:, mesh.facets[:, facets]].mean(axis=1)).r)]
    vertices = np.unique(mesh.facets[:, facets])
    vertices = vertices[np.argsort(tooth_profile.polar(gear, mesh.p[:, vertices]).r)]
    points, quadratic = mesh.p[:, vertices], bool(section.elem.facet_dofs)
    length = np.append(0.0, np.cumsum(np.hypot(*np.diff(points))))
    line = Basis(MeshLine(length), ElementLineP2() if quadratic else ElementLineP1(), intorder=FLANK_ORDER)
    dofs = np.empty(line.N, int)
    dofs[line.nodal_dofs[0]] = section.nodal_dofs[0][vertices]
    if quadratic:
        dofs[line.interior_dofs[0]] = section.facet_dofs[0][facets]
    return line, points, dofs


@LinearForm
def spread_force(v, w):
    """Work of a force per length."""
    return w.force * v


def flank_loads(gear: Gear, basis: Basis, arcs: np.ndarray, tooth: int) -> np.ndarray:
    """(3, n_dofs, n_hat) unit forces into the flank of a tooth, spread as hats: along x and y, and their size."""
    line, points, dofs = flank_line(gear, basis, tooth)
    length = np.asarray(line.global_coordinates())[0]
    x, y = (np.interp(length, line.mesh.p[0], coordinate) for coordinate in points)
    hat_values = hats(arcs, (x**2 + y**2 - gear.r_b**2) / (2 * gear.r_b))
    tangent_x, tangent_y = np.diff(points) / np.diff(line.mesh.p[0])
    direction = np.stack([tangent_y, -tangent_x, np.ones_like(tangent_x)])[..., None]
    loads = np.zeros((3, basis.N, arcs.size))
    for i, component in enumerate(direction):
        forces = [spread_force.assemble(line, force=component * values) for values in hat_values]
        loads[i, dofs] = np.transpose(forces)
    return loads / loads[2].sum(axis=0)


def flank_forces(basis: Basis, gear: Gear, arcs: np.ndarray, tooth: int = 0) -> np.ndarray:
    """(2, 3, n_dofs, n_hat) unit forces on a tooth: normal to its flank, and along its profile towards the tip."""
    x, y, size = flank_loads(gear, basis, arcs, tooth)
    normal = np.stack([cos(gear.beta_b) * x, cos(gear.beta_b) * y, gear.sign * sin(gear.beta_b) * size])
    return np.stack([normal, np.stack([-y, x, np.zeros_like(x)])])


def uniform_load_compliance(gear: Gear, arcs: np.ndarray, density: Density) -> np.ndarray:
    """(n_virtual, n_hat, n_hat) displacements as in `solid` per uniform line load on tooth 0 [m^2/N].

    In plane strain, or along a helix, where all sections deform alike.
    """
    prism = Prism(gear, None, np.ones((1, 1)), WholeFace())
    return flank_displacements(prism, density, partial(flank_forces, gear=gear, arcs=arcs))


def solid(gear: Gear, density: Density, loaded: float, face: Face) -> Arrays:
    """ "blocks" (n_virtual, n_axial, n_hat, n_axial, n_hat): mean displacements per force on tooth 0 [m/N].

    Normal to the flanks of teeth from 0 on, then along the profiles of teeth from -behind on.
    """
    arcs, (prism, axial) = section_mesh.flank_hats(gear, density), _prism(gear, density, loaded, face)
    u = flank_displacements(prism, density.paired(), partial(flank_forces, gear=gear, arcs=arcs))
    return {"blocks": u.reshape(len(u), axial.size, arcs.size, axial.size, arcs.size)}


def free_ring(gear: Gear, density: Density, loaded: float) -> Arrays:
    """`rim_harmonics` of the solid, "free" over the same axes as "blocks" of `solid`."""
    arcs, face = section_mesh.flank_hats(gear, density), _solved(gear, whole=False)[0]
    prism, axial = _prism(gear, density, loaded, face)
    free = replace(prism, clamped=False)
    arrays = rim_harmonics(free, density.paired(), partial(flank_forces, gear=gear, arcs=arcs))
    return arrays | {"free": arrays["free"].reshape(-1, axial.size, arcs.size, axial.size, arcs.size)}


def _prism(gear: Gear, density: Density, loaded: float, face: Face) -> tuple[Prism, np.ndarray]:
    """The solid of a face, clamped, and the axial positions of the tops of its hats [m]."""
    upper, line = lines_across(gear, density, loaded)
    axial, across = face.positions(upper), Basis(MeshLine(face.positions(np.sort(line.p[0]))), ElementLineP2())
    return Prism(gear, across, axial_loads(across, axial), face), axial


def axial_loads(across: Basis, axial: np.ndarray) -> np.ndarray:
    """(n_dofs, n_axial) unit forces spread as hats across the width."""
    forms = [LinearForm(lambda v, w, row=row: hat(w.x[0], axial, row) * v) for row in np.eye(axial.size)]
    loads = np.stack([form.assemble(across) for form in forms], axis=1)
    return loads / loads.sum(axis=0)
