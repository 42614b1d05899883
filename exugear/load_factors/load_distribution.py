"""Load over the faces of all gears of a gearbox whose shafts, bearings, housing and teeth are elastic, in statics.

With a constant stiffness of the meshes per face width the equilibrium is solved at once (`elastic_statics`). With the
tooth contact of the finite elements the shafts displace the flanks by a gap over the face, under which
`fem.load_distribution` tells the line loads. The springs of the meshes then stand for this contact: their gaps are
corrected until springs and finite elements carry the same line load under the same approach of the gears, averaged over
the mesh cycle. An error e of a gap shrinks by 1 - (1 + c_FE S)/(1 + c S), with the compliance S of shafts and bearings:
always where c > c_FE / 2. The approach tells how planets share the load.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.bearing_law import potential
from exugear.gearbox.constant_loads import given_loads, words_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.housing import PER_SEAT, seat_label
from exugear.gearbox.shaft_sections import bounds_of
from exugear.load_factors.elastic_statics import ElasticTrain, FaceMesh, elastic_train, face_of, solve
from exugear.mesh_force.ring_pair import RingPair
from exugear.multibody.model import Model
from fem.contact.resolution import Resolution
from fem.gear.gear import Gear
from fem.microgeometry.deviation import Grid, PitchDeviation
from fem.microgeometry.flank import Flank, removed
from fem.pair.iso6336 import face_load_stiffness
from fem.pair.mirror_image import mirror_image
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.stress.load_distribution import load_distribution as distribution_by_contact
from fem.support.arguments import Finite, checked
from fem.support.progress import shown
from fem.support.validation import require, require_kind
from fem.units import mm, um

__all__ = ["deflected_pair", "load_distribution"]

#: Parts of the face, phases of the mesh cycle for the contact, and points of a shaft in the data.
PARTS, PHASES, POINTS = 20, 8, 101
#: Corrections of the springs' gaps, and the difference of the line loads over the largest one at which they end.
CORRECTIONS, SAME_LOAD = 30, 2e-4
#: Values of lead modifications are those at this number of roll lengths from root form to tip, their mean.
ROLLS = 21
DIRECTIONS = "x", "y", "z"
COMPONENTS = *DIRECTIONS, "tilt_x", "tilt_y"


@dataclass(frozen=True, eq=False)
class Solution:
    """Equilibrium of a train: coordinates (n,), and by mesh line loads [N/m] and gaps [m] (n_part,), stiffnesses."""

    train: ElasticTrain
    q: np.ndarray
    line_loads: list[np.ndarray]
    gaps: list[np.ndarray]
    stiffness: list[float]

    @property
    def forces(self) -> list[float]:
        """Mesh forces [N]; 0 of meshes that carry nothing but rounding by the torques."""
        pairs = zip(self.train.meshes, self.line_loads, strict=True)
        return [float(load.sum()) * mesh.part if mesh.force > 0 else 0.0 for mesh, load in pairs]


@checked
def load_distribution(
    gearbox: Gearbox | Model,
    load: Finite | None = None,
    *,
    loads: Mapping[str, float] | None = None,
    mesh_stiffness: Finite | Mapping[str, float] | None = None,
    parts: int = PARTS,
    phases: int = PHASES,
    resolution: Resolution | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Static load over the faces of all gears, deflection of shafts and bearing forces, with everything elastic.

    gearbox         `exugear.Gearbox` of stages and planetary sets, or a model of it
    load            torque against the motion of the driven shaft [N m]; < 0 loads the back flanks
    loads           instead of load: torques against the motion of several shafts, by their names; the driving shaft,
                    whose end is held, takes the rest
    mesh_stiffness  of the meshes per face width [N/m^2], one value or by label of the stage. By default the teeth are
                    those of the finite elements: `fem.load_distribution` over a mesh cycle
    parts           number of equal parts of the face width common to both gears
    phases          number of phases of the mesh cycle over which the contact is averaged
    resolution      of the contact, as for a map

    Shafts with sections bend, twist and stretch (Timoshenko), those without are rigid; those without bearings only
    turn and twist. Bearings act by their laws, with clearance, tables and Hertzian contacts. Mesh forces act along the
    line of action at the pitch point of each section, so that helical gears tilt their shafts. Flank modifications,
    displaced shafts (`Placement`) and misalignment take part, and so do external forces on shafts (`ExternalForce`) and
    their weight (`Shaft(gravity=)`). An `Unbalance` turns with its shaft and has no part in statics. Friction is left
    out.

    Planetary sets stand in their reference configuration. Planets move on their pins, which follow the carrier rigidly
    from its axis on: its sections bend and twist up to the middle of a pin. With `Planetary(carrier_stiffness=)` pins
    and bearings of the carrier are displaced and tilted against it by its whole stiffness. Errors of pins, also those
    by which they lean, teeth of unlike thickness, and displaced members share the load among the planets. A floating
    sun is one on soft bearings.

    Returns a Dataset over `mesh` and `face` (parts of the face from -1/2 to 1/2 of the common width, along z), `shaft`
    and `point` (from one end of the shaft to the other), `bearing`, `direction`:

    line_load       mesh force per face width (mesh, face) [N/m], mean over the mesh cycle
    K_H_beta        largest over mean line load. With a constant stiffness the largest is extrapolated to the ends of
                    the face; with the finite elements it is that of the parts, as in `fem.load_factors`
    K_H_beta_B      the same with the constant stiffness c_gamma_beta of ISO 6336-1 (or mesh_stiffness) throughout:
                    method B of the standard
    K_H_beta_C      closed form of the standard for a misalignment alone, 1 + F c/(2 q) or sqrt(2 F c/q), with the
                    effective misalignment F = F_beta_y and the mean line load q
    F_beta_y        effective misalignment (mesh) [m]: change of the gap by shafts, bearings, displacements and lead
                    modifications from end to end of the face, by its regression line; > 0 opens along z
    gap             that gap (mesh, face) [m] without the deflection of the teeth, 0 where it is least
    deflection_gap  its part by displaced and deflected shafts, which `exugear.deflected_pair` puts on the flanks
    mesh_force      [N] of each mesh; axial_position (mesh, face) [m] on the shaft of the pinion
    K_gamma         of each mesh of a planet: its force over the mean of all planets with the same sun or ring; NaN of
                    other meshes
    deflection      of the axes (shaft, direction, point) [m] at the positions axial (shaft, point) [m], without the
                    static displacement of a `Placement`
    tilt, twist     (shaft, axis, point) and (shaft, point) [rad]; twist from the end that is held on
    bearing_force   on the shaft (bearing, direction) [N]; bearing_moment (bearing, axis) [N m];
    bearing_displacement, bearing_tilt   of the shaft against its seat [m, rad]; with a housing seat_displacement of
                    the seats (seat, direction) [m] and seat_tilt (seat, axis) [rad]; of seats on a carrier against its
                    shaft
    energy          (part) [J]: shafts, bearings and springs of the meshes; NaN of the teeth of finite elements

    Raises ValueError for bad input, loads that bearings do not carry (`NotCarried`), and planets whose back flanks
    would touch; RuntimeError where the contact does not converge.

    Source: ISO 6336-1:2019, 7 and annex E (method B); Timoshenko beams as in `Shaft(sections=)`.
    """
    box = gearbox.gearbox if isinstance(gearbox, Model) else gearbox
    resolution = Resolution() if resolution is None else resolution
    require_kind("resolution", resolution, Resolution)
    require(4 <= parts <= 200, f"parts must lie in [4, 200], got {parts}; 20 are usual")
    require(2 <= phases <= 200, f"phases must lie in [2, 200], got {phases}; 8 are usual")
    torques = given_loads(box, load, loads)
    train = elastic_train(box, torques, parts)
    stiffness = given_stiffness(box, train, mesh_stiffness)
    springs = by_springs(train, stiffness)
    solution = springs
    check_backs(springs)
    if mesh_stiffness is None:
        with shown(progress):
            solution = by_contact(springs, phases, resolution)
    data = _dataset(box, springs, solution, constant=mesh_stiffness is not None)
    how = "constant stiffness" if mesh_stiffness is not None else f"finite elements, {phases} phases"
    return data.assign_attrs({"title": "load distribution", "load": words_of(box, torques), "mesh_model": how})


def given_stiffness(box: Gearbox, train: ElasticTrain, given: float | Mapping[str, float] | None) -> list[float]:
    """Stiffness of each mesh per face width [N/m^2]: as given, by default c_gamma_beta of ISO 6336-1."""
    if given is None:
        return [_stiffness_of_standard(mesh) for mesh in train.meshes]
    by_label = dict(given) if isinstance(given, Mapping) else dict.fromkeys(box.labels, given)
    unlike = set(by_label) ^ set(box.labels)
    require(not unlike, f"mesh_stiffness must name the stages {[*box.labels]}, got {[*by_label]}")
    for label, value in by_label.items():
        units = f"mesh_stiffness of {label} must lie in (1e7, 1e12) N/m^2, got {value:g}; 20 N/(mm um) are 20e9"
        require(1e7 < value < 1e12, units)
    return [float(by_label[label]) for label in box.labels]


def _stiffness_of_standard(mesh: FaceMesh) -> float:
    pair = mesh.pair
    if isinstance(pair, RingPair):
        name = mesh.stage.name
        remedy = "pass mesh_stiffness= [N/m^2], or a fem.GearPair with the ring as a fem.Gear"
        raise ValueError(f"stage {name!r} has a RingPair, whose ring has no body; {remedy}")
    at_reference = mesh.force * pair.pinion.r_b / pair.pinion.r / mesh.width
    return face_load_stiffness(pair, at_reference) if at_reference > 0 else face_load_stiffness(pair)


def by_springs(train: ElasticTrain, stiffness: Sequence[float]) -> Solution:
    """Equilibrium with constant stiffnesses of the meshes [N/m^2]."""
    gaps = [static_gap(mesh) for mesh in train.meshes]
    q = solve(train, stiffness, gaps)
    return _solution(train, q, stiffness, gaps)


def _solution(train: ElasticTrain, q: np.ndarray, stiffness: Sequence[float], gaps: Sequence[np.ndarray]) -> Solution:
    """The line loads of springs with gaps, and the gaps of the flanks as displaced."""
    parts = zip(train.meshes, stiffness, gaps, strict=True)
    line_loads = [c * np.maximum(mesh.rows @ q - gap, 0.0) for mesh, c, gap in parts]
    return Solution(train, q, line_loads, [displaced_gap(mesh, q) for mesh in train.meshes], [*stiffness])


def line_gaps(solution: Solution) -> list[np.ndarray]:
    """By mesh (n_part,) gap [m] of the flanks as displaced; < 0 where they press."""
    return [static_gap(mesh) - mesh.rows @ solution.q for mesh in solution.train.meshes]


def displaced_gap(mesh: FaceMesh, q: np.ndarray) -> np.ndarray:
    """(n_part,) gap of the flanks [m] by lead modifications, and by displaced and deflected shafts, its least 0."""
    gap = static_gap(mesh) - mesh.rows @ q
    return gap - gap.min()


def static_gap(mesh: FaceMesh) -> np.ndarray:
    """(n_part,) gap [m] of the unloaded flanks over the face: lead modifications and static displacements."""
    gap = mesh.gap + mesh.misalignment * mesh.axial
    if isinstance(mesh.pair, GearPair):
        pair, z = loaded_pair(mesh), axis_of_pair(mesh)
        gap = gap + _lead(pair.pinion, z * mesh.axial) + _lead(pair.wheel, z * (mesh.axial - mesh.offset))
    return gap


def _lead(gear: Gear, axial: np.ndarray) -> np.ndarray:
    """Material removed [m] at axial positions from the middle of a gear from all teeth, mean over the profile."""
    flank: Flank = tuple(
        part for part in gear.drive_flank if not (isinstance(part, PitchDeviation) or getattr(part, "differs", False))
    )
    rolls = np.linspace(gear.roll_form, gear.roll_tip, ROLLS)
    return removed(flank, gear.face, rolls[:, None], axial).mean(axis=0)


def axis_of_pair(mesh: FaceMesh) -> int:
    """1 where the axial positions of the pair count along z, -1 where they count against it."""
    return mesh.side * mesh.direction


def loaded_pair(mesh: FaceMesh) -> GearPair:
    """The pair of a mesh with its loaded flanks as left ones."""
    pair: Any = mesh.pair
    return pair if mesh.side > 0 else mirror_image(pair)


def by_contact(start: Solution, phases: int, resolution: Resolution) -> Solution:
    """Equilibrium with the teeth of the finite elements, from that with constant stiffnesses."""
    train, corrections = start.train, [np.zeros(mesh.axial.size) for mesh in start.train.meshes]
    solution = start
    for _ in range(CORRECTIONS):
        errors = [
            gap_error(mesh, solution.q, line_load, c, phases, resolution) if force > 0 else np.zeros(mesh.axial.size)
            for mesh, line_load, force, c in zip(
                train.meshes, solution.line_loads, solution.forces, start.stiffness, strict=True
            )
        ]
        largest = [c * np.abs(error).max() for c, error in zip(start.stiffness, errors, strict=True)]
        apart = max(x / load.max() for x, load in zip(largest, solution.line_loads, strict=True) if load.any())
        if apart < SAME_LOAD:
            check_backs(solution)
            return solution
        for correction, error in zip(corrections, errors, strict=True):
            correction += error
        gaps = [static_gap(mesh) + x for mesh, x in zip(train.meshes, corrections, strict=True)]
        solution = _solution(train, solve(train, start.stiffness, gaps), start.stiffness, gaps)
    raise RuntimeError(
        f"shafts and teeth did not agree on the line loads within {SAME_LOAD:g}, they differ by {apart:.2g}; "
        "take more phases or a finer resolution"
    )


def gap_error(
    mesh: FaceMesh, q: np.ndarray, line_load: np.ndarray, c: float, phases: int, resolution: Resolution
) -> np.ndarray:
    """(n_part,) by which the gap of springs of stiffness c [N/m^2] is too small [m] beside the finite elements.

    Both at coordinates q, under the force of the springs with their line load [N/m], mean over the mesh cycle. Tip
    edges in contact have shorter levers than the line of action: their sum is scaled to the mesh force.
    """
    force = float(line_load.sum()) * mesh.part
    gap = mesh.gap + mesh.misalignment * mesh.axial - mesh.rows @ q
    under = pair_under(replace(mesh, force=force), gap)
    options: dict[str, Any] = {
        "offsets": under.offsets,
        "ring_angle": mesh.ring_angle,
        "resolution": resolution,
        "stations": mesh.axial.size,
        "progress": False,
    }
    data = distribution_by_contact(under.pair, under.torque, phases, **options)
    by_teeth = data["line_load"].sum("pair").mean("phase").values[0][:: axis_of_pair(mesh)]
    by_teeth *= force / (by_teeth.sum() * mesh.part)
    needed = float(data["te"].mean()) + float(to_the_ends(gap).min())
    return needed + (line_load - by_teeth) / c


def check_backs(solution: Solution) -> None:
    """ValueError where the back flanks of a planet's open mesh would touch."""
    for mesh, force, gap in zip(solution.train.meshes, solution.forces, line_gaps(solution), strict=True):
        if mesh.stage.carrier is None or force > 0:
            continue
        jams = f"mesh {mesh.stage.name!r} is open by {gap.min() / um:.3g} um, its back flanks touch"
        remedy = "raise the load, or make errors of pins and teeth smaller"
        require(bool(gap.max() < mesh.stage.force.backlash), f"{jams}; {remedy}")


@checked
@dataclass(frozen=True)
class DeflectedPair:
    """A pair whose flanks lie as its shafts hold them under a load.

    pair      its loaded flanks as left ones, the gap by the shafts as a `fem.Grid` on the pinion
    torque    on the pinion [N m]
    offsets   `fem.Offsets` of the displaced shafts, whose misalignment is in the gap
    """

    pair: GearPair
    torque: Finite
    offsets: Offsets


def pair_under(mesh: FaceMesh, gap: np.ndarray) -> DeflectedPair:
    """The pair of a mesh under a gap over its face [m]."""
    pair, z = loaded_pair(mesh), axis_of_pair(mesh)
    grid = gap_as_grid(pair.pinion, (z * mesh.axial)[::z], gap[::z])
    pinion = replace(pair.pinion, flank=(*pair.pinion.drive_flank, grid))
    wheel = replace(pair.wheel, flank=pair.wheel.drive_flank)
    offsets = Offsets(a=mesh.a, axial=z * mesh.offset)
    return DeflectedPair(GearPair(pinion, wheel, a=pair.a), mesh.force * pair.pinion.r_b, offsets)


@checked
def deflected_pair(gearbox: Gearbox | Model, data: xr.Dataset, mesh: str | None = None) -> DeflectedPair:
    """The pair of a mesh as its shafts hold it under a load: for its contact pattern, root stress, load factors.

    gearbox   of which the data are
    data      as `exugear.load_distribution` returns it
    mesh      label of the stage, by default the first

    `fem.load_distribution(pair, torque, offsets=offsets)` and `fem.root_stress` likewise take what is returned. Axial
    positions count along z of the pair. Raises ValueError for other data, meshes that the gearbox lacks, and meshes
    without load.
    """
    box = gearbox.gearbox if isinstance(gearbox, Model) else gearbox
    require("deflection_gap" in data, "data must have deflection_gap; pass what exugear.load_distribution returns")
    require(
        [*data["mesh"].values] == [*box.labels], f"gearbox must be that of the data, with the meshes {[*box.labels]}"
    )
    label = box.labels[0] if mesh is None else mesh
    require(label in box.labels, f"mesh must be one of {[*box.labels]}, got {label!r}")
    stage, of_mesh = box.stages[box.labels.index(label)], data.sel(mesh=label)
    require(isinstance(stage.pair, GearPair), f"stage {label!r} has a RingPair, whose ring has no body")
    force = float(of_mesh["mesh_force"])
    require(force > 0, f"mesh {label!r} carries no load; choose another one")
    face = replace(face_of(box, stage, int(of_mesh["side"]), data.sizes["face"]), force=force)
    return pair_under(face, of_mesh["deflection_gap"].values)


def gap_as_grid(pinion: Gear, axial: np.ndarray, gap: np.ndarray) -> Grid:
    """A gap over the face as material removed from the pinion, extrapolated to the ends of the face."""
    half, values = (axial[1] - axial[0]) / 2, to_the_ends(gap)
    values = values - values.min()
    at = np.concatenate([[axial[0] - half], axial, [axial[-1] + half]])
    rolls = (pinion.roll_form, pinion.roll_tip)
    return Grid(rolls, tuple(at.tolist()), tuple(map(tuple, np.tile(values, (2, 1)).tolist())))


def to_the_ends(gap: np.ndarray) -> np.ndarray:
    """(n_part + 2,) a gap over the parts of the face, extrapolated to its ends."""
    low, high = ((1.5 * gap[i] - 0.5 * gap[j]) for i, j in ((0, 1), (-1, -2)))
    return np.concatenate([[low], gap, [high]])


def face_load_factor(line_load: np.ndarray, *, at_ends: bool) -> float:
    """Largest over mean line load (n_part,); at_ends: of those extrapolated to the ends of the face, too."""
    largest = [line_load.max()]
    if at_ends:
        largest += [(15 * x[0] - 10 * x[1] + 3 * x[2]) / 8 for x in (line_load, line_load[::-1])]
    return float(max(largest) / line_load.mean()) if line_load.any() else np.nan


def mesh_load_factors(box: Gearbox, forces: Sequence[float]) -> np.ndarray:
    """(n_mesh,) force of each mesh of a planet over the mean of those with the same sun or ring; NaN of others."""
    members = members_of_planets(box)
    factors = np.full(len(members), np.nan)
    for member in {name for name in members if name}:
        chosen = np.array([name == member for name in members])
        of_member = np.array(forces)[chosen]
        factors[chosen] = of_member / of_member.mean() if of_member.any() else np.nan
    return factors


def members_of_planets(box: Gearbox) -> list[str]:
    """By mesh the name of the sun or ring with which a planet meshes, and its axial position; empty of others."""
    names = []
    for stage in box.stages:
        ends = [(name, axial) for name, axial in stage.ends if stage.carrier and name not in box.planets]
        names.append(f"{ends[0][0]} at {ends[0][1] / mm:g} mm" if ends else "")
    return names


def effective_misalignment(mesh: FaceMesh, gap: np.ndarray) -> float:
    """Change of a gap from end to end of the face by its regression line [m]."""
    return float(np.polyfit(mesh.axial, gap, 1)[0]) * mesh.width


def closed_form(F: float, c: float, q: float) -> float:
    """K_Hbeta by a misalignment F [m] over the face, stiffness c [N/m^2] and mean line load q [N/m]."""
    if q == 0:
        return np.nan
    ratio = abs(F) * c / q
    return 1 + ratio / 2 if ratio <= 2 else float(np.sqrt(2 * ratio))


def _dataset(box: Gearbox, springs: Solution, solution: Solution, *, constant: bool) -> xr.Dataset:
    """The labelled variables of `load_distribution`."""
    train, q, meshes = solution.train, solution.q, solution.train.meshes
    parts = meshes[0].axial.size
    variables: dict[str, Any] = {}

    def add(name: str, dims: Sequence[str], values: Any, units: str, long_name: str) -> None:
        variables[name] = (tuple(dims), np.asarray(values, float), {"units": units, "long_name": long_name})

    slopes = [effective_misalignment(mesh, gap) for mesh, gap in zip(meshes, solution.gaps, strict=True)]
    forces = solution.forces
    means = [force / mesh.width for force, mesh in zip(forces, meshes, strict=True)]
    columns = zip(slopes, solution.stiffness, means, strict=True)
    ours = [face_load_factor(x, at_ends=constant) for x in solution.line_loads]
    add(
        "line_load", ("mesh", "face"), solution.line_loads, "N/m", "mesh force per face width, mean over the mesh cycle"
    )
    add("K_H_beta", ("mesh",), ours, "1", "face load factor: largest over mean line load")
    of_springs = [face_load_factor(x, at_ends=True) for x in springs.line_loads]
    add("K_H_beta_B", ("mesh",), of_springs, "1", "face load factor with a constant mesh stiffness (method B)")
    by_standard = [closed_form(*values) for values in columns]
    add("K_H_beta_C", ("mesh",), by_standard, "1", "face load factor of the effective misalignment in closed form")
    add("F_beta_y", ("mesh",), slopes, "m", "effective misalignment over the face")
    add("gap", ("mesh", "face"), solution.gaps, "m", "gap over the face without the deflection of the teeth")
    of_shafts = [mesh.misalignment * mesh.axial - mesh.rows @ q for mesh in meshes]
    lowered = [gap - gap.min() for gap in of_shafts]
    add("deflection_gap", ("mesh", "face"), lowered, "m", "the gap by displaced and deflected shafts alone")
    sides = [mesh.side for mesh in meshes]
    add("side", ("mesh",), sides, "1", "1 where the driving flanks carry, -1 where the back flanks do")
    add("mesh_force", ("mesh",), forces, "N", "mesh force in the transverse section")
    factors = mesh_load_factors(box, forces)
    add("K_gamma", ("mesh",), factors, "1", "mesh force over the mean of the planets' meshes with the same gear")
    add("width", ("mesh",), [mesh.width for mesh in meshes], "m", "face width common to both gears")
    at = [mesh.stage.axial_positions[0] + mesh.axial for mesh in meshes]
    add("axial_position", ("mesh", "face"), at, "m", "axial position on the shaft of the pinion")
    add("mesh_stiffness", ("mesh",), solution.stiffness, "N/m^2", "stiffness per face width of method B")
    _add_shafts(add, box, train, q)
    _add_bearings(add, train, q)
    if train.seats:
        at_seats = np.array([q[first : first + PER_SEAT] for first in train.seats.values()])
        add("seat_displacement", ("seat", "direction"), at_seats[:, :3], "m", "displacement of the seats")
        add("seat_tilt", ("seat", "axis"), at_seats[:, 3:5], "rad", "slope of the seats, about x and y")
    shafts, bearings = train.energies(q)
    loads = zip(solution.line_loads, meshes, solution.stiffness, strict=True)
    teeth = sum(float((load**2).sum()) * mesh.part / (2 * c) for load, mesh, c in loads) if constant else np.nan
    add("energy", ("part",), [shafts, sum(bearings), teeth], "J", "strain energy")
    coordinates: dict[str, Any] = {
        "mesh": [*box.labels],
        "face": (
            "face",
            (np.arange(parts) + 0.5) / parts - 0.5,
            {"units": "1", "long_name": "part of the face along z"},
        ),
        "shaft": [shaft.name for shaft in box.shafts],
        "direction": [*DIRECTIONS],
        "axis": [*DIRECTIONS[:2]],
        "bearing": np.array([support.label for support in train.supports], str),
        "bearing_shaft": ("bearing", np.array([support.shaft.name for support in train.supports], str)),
        "bearing_axial": (
            "bearing",
            np.array([support.axial for support in train.supports], float),
            {"units": "m", "long_name": "axial position on the shaft"},
        ),
        "part": ["shafts", "bearings", "meshes"],
    }
    if train.seats:
        coordinates["seat"] = [seat_label(seat) for seat in train.seats]
    return xr.Dataset(variables, coordinates)


def _add_shafts(add: Any, box: Gearbox, train: ElasticTrain, q: np.ndarray) -> None:
    """Deflection, tilt and twist of the shafts at equidistant points between their ends."""
    positions, motions = [], []
    for shaft in box.shafts:
        static, at_nodes = train.shafts[shaft.name], train.motion_of(shaft.name, q)
        ends = bounds_of(shaft.cylinders)[[0, -1]] if shaft.sections else static.nodes[[0, -1]]
        points = np.linspace(float(ends[0]), float(ends[1]), POINTS)
        positions.append(points)
        motions.append([np.interp(points, static.nodes, at_nodes[:, i]) for i in range(6)])
    motion = np.array(motions)
    add("axial", ("shaft", "point"), positions, "m", "axial position on the shaft")
    add("deflection", ("shaft", "direction", "point"), motion[:, :3], "m", "displacement of the axis")
    add("tilt", ("shaft", "axis", "point"), motion[:, 3:5], "rad", "slope of the axis, about x and y")
    add("twist", ("shaft", "point"), motion[:, 5], "rad", "angle about z from the held end of the driving shaft on")


def _add_bearings(add: Any, train: ElasticTrain, q: np.ndarray) -> None:
    """Forces, moments and displacements of the bearings."""
    at = np.array([support.rows @ q for support in train.supports]).reshape(-1, 5)
    along = [-potential(x.bearing, 0.0, row)[1] for x, row in zip(train.supports, at, strict=True)]
    forces, at = (
        np.array([row @ x.axes for x, row in zip(train.supports, rows, strict=True)]).reshape(-1, 5)
        for rows in (along, at)
    )
    add("bearing_force", ("bearing", "direction"), forces[:, :3], "N", "force of the bearing on its shaft")
    add("bearing_moment", ("bearing", "axis"), forces[:, 3:], "N m", "moment of the bearing on its shaft")
    add("bearing_displacement", ("bearing", "direction"), at[:, :3], "m", "displacement of the shaft in the bearing")
    add("bearing_tilt", ("bearing", "axis"), at[:, 3:], "rad", "tilt of the shaft in the bearing")
