"""Hypothesis strategies: gearboxes of one to three stages with maps by formula, and invalid data."""

from dataclasses import dataclass, replace
from math import inf, pi, sqrt

import numpy as np
from hypothesis import strategies as st
from strategies import floats, pairs

import exugear
import fem
from fem import ste_map
from fem.units import GPa, MPa, um

#: Stiffness [N/m] and tilting stiffness [N m/rad] below which a bearing is refused.
SOFT, SOFT_TILT = 1e4, 1.0
#: Mesh stiffness per width of steel gears, line load per module up to which the maps go.
STIFFNESS, LARGEST = 14 * GPa, 300 * MPa
LEVELS = np.array([0, 1e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0])
PHASES = np.arange(12) / 12


def stiffness(pair: fem.GearPair) -> float:
    """Mesh stiffness [N/m] by rule of thumb."""
    softest = min(gear.material.E for gear in (pair.pinion, pair.wheel))
    return STIFFNESS * pair.b * softest / fem.STEEL.E


def top_force(pair: fem.GearPair) -> float:
    """Largest mesh force of the maps [N]."""
    return LARGEST * pair.pinion.m_n * stiffness(pair) / STIFFNESS


def formula_map(pair: fem.GearPair, axes=()):
    """Springs that vary with the load and over the mesh cycle, stiffest at small centre distance and aligned axes."""
    force = LEVELS * top_force(pair)
    values = {
        "a": pair.a + np.array([-0.02, 0.02]) * pair.pinion.m_n,
        "axial": np.array([-0.1, 0.1]) * pair.b,
        "misalignment": np.array([-3e-3, 0, 3e-3]),
    }
    offsets = {name: values[name] for name in values if name in axes}
    softer = np.ones([x.size for x in offsets.values()])
    for i, (name, at) in enumerate(offsets.items()):
        size = 0.2 * np.abs(at - at.mean()) / np.abs(at - at.mean()).max()
        softer = softer * (1 + size * (name != "a")).reshape([-1 if i == j else 1 for j in range(softer.ndim)])
    cycle = 1 + 0.05 * np.sin(2 * pi * PHASES)
    hertz = np.where(force > 0, force * (1 - 0.03 * np.log(np.maximum(LEVELS, 1e-9))), 0)
    te = hertz.reshape(-1, *[1] * (softer.ndim + 1)) / stiffness(pair) * softer[..., None] * cycle
    return ste_map(pair, force * pair.pinion.r_b, PHASES, te, offsets)


@dataclass(frozen=True)
class Scene:
    """Data of a gearbox and of a run of it.

    shafts   arguments of each
    stages   names of fast and slow shaft, arguments
    axes     of the maps beside torque and phase
    share    of the maps' range that the most loaded mesh carries
    speed    of the first mesh in pitches per period of the highest frequency that meshes take part in
    """

    shafts: list[dict]
    stages: list[tuple[tuple[str, str], dict]]
    axes: tuple[str, ...]
    share: float
    speed: float

    def box(self) -> exugear.Gearbox:
        """The gearbox; ValueError where these data do not make a gearbox."""
        shafts = {given["name"]: exugear.Shaft(**given) for given in self.shafts}
        return exugear.Gearbox(
            [
                exugear.Stage(*(shafts[name] for name in ends), formula_map(given["pair"], self.axes), **given)
                for ends, given in self.stages
            ]
        )

    def load(self, box: exugear.Gearbox) -> float:
        """Load torque on the driven shaft [N m]."""
        forces = np.abs(box.static_forces(1.0))
        return self.share / max(force / top_force(stage.pair) for force, stage in zip(forces, box.stages, strict=True))


@st.composite
def bearings(draw, k: float) -> exugear.Bearing:
    """Bearings of every kind with stiffnesses around k [N/m] that support a shaft, alone or as a pair."""
    radial = max(k * 10 ** draw(floats(-1, 1.5)), SOFT)
    play = draw(floats(0, 30)) * um
    rest = {"axial": max(radial * draw(floats(0.05, 1)), SOFT), "damping_time": draw(st.just(0.0) | floats(1e-7, 1e-4))}
    rest["tilt"] = max(radial * draw(floats(1e-4, 1e-2)), SOFT_TILT)
    r = np.array([0, play, play + 5e-3]) if play > 0.1 * um else np.array([0, 20 * um, 5e-3])
    table = r, np.array([0, 0.3 * radial * r[1] * draw(st.booleans()), radial * r[2]])
    coupled = exugear.Bearing(radial, rest["axial"], rest["tilt"]).at(draw(floats(-0.05, 0.05)))
    return draw(
        st.sampled_from(
            [
                exugear.Bearing(radial, **rest),
                exugear.Bearing(radial, **rest, clearance=play),
                exugear.Bearing(**rest, table=table),
                exugear.Bearing(matrix=coupled, damping_time=rest["damping_time"]),
            ]
        )
    )


@st.composite
def shafts(draw, name: str, gears: dict[float, fem.Gear], k: float) -> dict:
    """Data of a shaft with gears and further parts of any kind; k [N/m] is the mesh stiffness of the gears."""
    parts: dict[float, list] = {axial: [gear] for axial, gear in gears.items()}
    length = 2 * max(gear.b for gear in gears.values()) + max(gears)
    blank = [exugear.gearbox.shaft.blank(gear) for gear in gears.values()]
    inertia = sum(disc.inertia for disc in blank)
    if draw(st.booleans()):
        for axial in draw(st.sampled_from([(0.0,), (-0.4, 1.0), (-0.4, 1.3)])):
            parts.setdefault(axial * length, []).append(draw(bearings(k)))
    if draw(st.integers(0, 3)) == 0:
        disc = exugear.Disc.cylinder(0.1 * length, 2 * max(gear.r_f for gear in gears.values()))
        parts.setdefault(draw(floats(-1, 1)) * length, []).append(disc)
    if draw(st.integers(0, 3)) == 0:
        torsion = k * min(gear.r_b for gear in gears.values()) ** 2 * 10 ** draw(floats(-2, 1))
        damping = draw(floats(0, 0.1)) * sqrt(torsion * inertia)
        rotor = exugear.Coupling(torsion, damping, inertia=inertia * 10 ** draw(floats(-1, 2)))
        parts.setdefault(draw(floats(-1, 1)) * length, []).append(rotor)
    return {"name": name, "parts": parts}


@st.composite
def placements(draw, gears: dict[float, fem.Gear]) -> exugear.Placement:
    """Displacements of a shaft within the maps' axes, mostly 0."""
    if draw(st.integers(0, 2)):
        return exugear.Placement()
    shift, tilt = 5e-3 * min(gear.m_n for gear in gears.values()), floats(-3e-4, 3e-4)
    x, y = draw(floats(-1, 1)) * shift, draw(floats(-1, 1)) * shift
    face = min(0.4, min(gear.b for gear in gears.values()))  # so that z stays within a placement's 10 mm
    z = draw(floats(-0.02, 0.02)) * face
    return exugear.Placement(x, y, draw(tilt), draw(tilt), z, pivot=draw(st.sampled_from(list(gears))))


@dataclass(frozen=True)
class Mesh:
    """A mesh to build: names of the shafts of pinion and wheel, axial position [m], pair."""

    ends: tuple[str, str]
    axial: float
    pair: fem.GearPair


@st.composite
def even_pairs(draw) -> fem.GearPair:
    """Pairs whose pitches are all alike, as maps of a single pitch require."""
    pair = draw(pairs())
    gears = [
        replace(gear, flank=[part for part in gear.drive_flank if not isinstance(part, fem.PitchDeviation)])
        for gear in (pair.pinion, pair.wheel)
    ]
    return fem.GearPair(*gears, a=pair.a)


@st.composite
def trains(draw) -> list[Mesh]:
    """Chains, branches, idlers and twins of one to three meshes, the last of which is driven by the first shaft."""
    meshes = [Mesh(("a", "b"), 0.0, draw(even_pairs()))]
    for name in "cd"[: draw(st.integers(0, 2))]:
        last = meshes[-1]
        kind = draw(st.sampled_from(["compound", "idler", "twin", "branch", "reverse"]))
        axial = last.axial + 1.5 * last.pair.b
        onward = last.ends[1]
        if kind == "idler":
            swapped = fem.GearPair(last.pair.wheel, last.pair.pinion, a=last.pair.a)
            meshes.append(Mesh((onward, name), last.axial, swapped))
        elif kind == "twin":
            narrow = [replace(gear, b=0.8 * gear.b, flank=()) for gear in (last.pair.pinion, last.pair.wheel)]
            meshes.append(Mesh(last.ends, axial, fem.GearPair(*narrow, a=last.pair.a)))
        elif kind == "reverse":
            meshes.append(Mesh((name, onward), last.axial, last.pair))
            break
        else:
            start = onward if kind == "compound" else last.ends[0]
            meshes.append(Mesh((start, name), axial + 1.5 * last.pair.b, draw(even_pairs())))
    return meshes


@st.composite
def scenes(draw) -> Scene:
    """Gearboxes of every kind that can be built, and a few that cannot; loads within the maps and a few beyond."""
    meshes = draw(trains())
    k = max(stiffness(mesh.pair) for mesh in meshes)
    gears: dict[str, dict[float, fem.Gear]] = {}
    for mesh in meshes:
        for name, gear in zip(mesh.ends, (mesh.pair.pinion, mesh.pair.wheel), strict=True):
            gears.setdefault(name, {})[mesh.axial] = gear
    axes = draw(st.sampled_from([(), (), (), (), ("misalignment",), ("a", "misalignment", "axial")]))
    built = [draw(shafts(name, carried, k)) for name, carried in gears.items()]
    if len(axes) == 3 or draw(st.integers(0, 29)) == 0:
        built = [given | {"offset": draw(placements(gears[given["name"]]))} for given in built]
    angle, stages = draw(floats(-3, 3)), []
    for mesh in meshes:
        twin = [listed.ends for listed in meshes].count(mesh.ends) > 1
        inertia = exugear.gearbox.shaft.blank(mesh.pair.pinion).inertia / mesh.pair.pinion.r_b**2
        damping = 2 * draw(floats(0, 0.2)) * sqrt(stiffness(mesh.pair) * inertia)
        room = [0.2 * mesh.pair.pinion.m_n, inf]  # displaced shafts may close a smaller one
        backlash = draw(st.sampled_from(room if "offset" in built[0] else [None, None, None, 0.0, 20 * um, inf]))
        given = {"damping": damping, "backlash": backlash, "angle": angle if twin else draw(floats(-3, 3))}
        stages.append((mesh.ends, given | {"pair": mesh.pair}))
    usual, both_ways, beyond = floats(0.03, 0.3), floats(-0.3, 0.3), floats(0.9, 2)
    share = draw(st.one_of(usual, usual, usual, usual, usual, usual, both_ways, both_ways, st.just(0.0), beyond))
    return Scene(built, stages, axes, share, draw(st.just(0.0) | floats(-0.2, 0.2)))
