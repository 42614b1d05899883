"""Axes of a map that a scene needs: those along which its gears move; the others are fixed at their static values.

Where a map lacks such an axis, the plan estimates how far the gears move under a load, and advises the offsets to map.
"""

from collections.abc import Mapping, Sequence
from math import acos, ceil, floor, isfinite, isnan, log10, pi

import numpy as np

from exugear.contact.reference_configuration import offsets_at, spatial_frame, spatial_row
from exugear.gearbox.constant_loads import mesh_forces, words_of
from exugear.gearbox.elastic_shaft import ElasticShaft
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.shaft_dynamics import elastic_displacement, static_displacement
from exugear.gearbox.stage import Stage
from exugear.gearbox.static_offsets import displacements_in_housing, stage_offsets
from exugear.mesh_force.force import MeshForce
from exugear.planning.coordinates import Coordinates, pose
from exugear.rolling_bearings.statics import NotCarried
from fem.gear.involute import involute
from fem.ste.map_sides import SIDES_DIFFER, TEETH_DIFFER
from fem.support.validation import require
from fem.units import mm, um

#: Offset -> coordinates of shafts whose motion changes it.
MOVED_BY = {
    "a": (Coordinates.PLANAR, Coordinates.BEARINGS),
    "misalignment": (Coordinates.BEARINGS,),
    "axial": (Coordinates.BEARINGS,),
}
#: Largest changes of offsets that a map without the axis may ignore: gap by misalignment at the ends of the face width
#: [m], centre distance [m], axial offset as share of the face width.
IGNORED = {"misalignment": 0.01 * um, "a": 1 * um, "axial": 2e-3}
AXIS_NAMES = {"a": "centre distance", "misalignment": "misalignment", "axial": "axial offset"}
#: Units of the axes of a map.
UNITS = {"a": "m", "misalignment": "rad", "axial": "m"}
#: Offsets to map, in multiples of the displacement under the load.
MULTIPLES = {"a": (-1, 0, 1, 2), "misalignment": (-2, -1, 0, 1, 2), "axial": (-2, 0, 2)}
#: Deflection by which the pinion leads, so that its driving flank is the closer one [m].
LEAD = 1e-3
#: Number of angles of a carrier at which misalignments by tilted axes are evaluated: they vary once in its turn.
ANGLES = 8
#: Share of a tilt below which a misalignment is rounding.
ROUNDING = 1e-9
#: Displacement [m, rad] up to which a map can be made: `fem.Offsets` end at 0.01 rad.
LARGEST = 0.005


def static_offsets(gearbox: Gearbox, stage: Stage, side: int = 1, turned: float = 0.0) -> dict[str, float]:
    """Static offsets of a stage with the signs of its map, on the driving flank (side 1) or on the back flank (-1).

    The z axis of the map points along z where the mesh force turns the pinion clockwise, else against it.

    turned   angle of its carrier from the reference configuration [rad]
    """
    z = side * gearbox.direction_of(stage)
    offsets = stage_offsets(stage, gearbox.shaft_positions, z, turned)
    return {"a": offsets["a"], "misalignment": z * offsets["misalignment"], "axial": z * offsets["axial"]}


def stage_law(gearbox: Gearbox, stage: Stage, shafts: Mapping[str, Coordinates]) -> tuple[MeshForce, str]:
    """Force law with the axes that the scene needs, and the reasons; ValueError where the map lacks such an axis."""
    kinds = {shafts[stage.fast.name], shafts[stage.slow.name]}
    static, law = static_offsets(gearbox, stage), stage.force
    beside, tilt = displacement_in_housing(gearbox, stage)
    turning = {"a": beside, "misalignment": tilt}
    moving = [name for name, movers in MOVED_BY.items() if kinds & set(movers) or turning.get(name)]
    if tilt:
        _check_tilted(gearbox, stage, static, tilt)
    _check_axes_exist(stage, static if not beside else static | {"a": stage.pair.a})
    for a in (static["a"], stage.pair.a + beside, stage.pair.a - beside)[: 3 if beside else 1]:
        _check_axis_ranges(stage, static | {"a": a})
        _check_backlash(stage, a)
    on_back_flank = static_offsets(gearbox, stage, -1) if isfinite(law.backlash) else static
    alike = [name for name in law.offsets if is_slight(stage, name, static[name] - on_back_flank[name])]
    fixed = {name: static[name] for name in alike if name not in moving}
    reduced = law.at(**fixed)
    pitches = f" of {law.pitches} pitches ({reduced.table.nbytes / 1e6:.3g} MB)" if law.pitches > 1 else ""
    pitches += composed_words(law)
    lines = ["map over " + ", ".join([f"phase{pitches}", "force", *(AXIS_NAMES[name] for name in reduced.offsets)])]
    lines += [f"{AXIS_NAMES[name]} dropped: stays at {value:.6g}" for name, value in fixed.items()]
    lines += [f"{AXIS_NAMES[name]} kept: it differs between the flanks" for name in law.offsets if name not in alike]
    if beside:
        lines.append(
            f"its axis lies {beside / um:.4g} um beside the carrier's: distance and shares vary once in its turn"
        )
    if tilt:
        lines.append(
            f"its axis is tilted by {tilt:.4g} rad against the carrier's: misalignment varies once in its turn"
        )
    lines += [f"{AXIS_NAMES[name]} moves, but the map has no such axis" for name in moving if name not in law.offsets]
    return reduced, "; ".join(lines)


def composed_words(law: MeshForce) -> str:
    """How a law over a long period is composed, and its error; "" where its table holds all pitches."""
    if law.teeth is None:
        return ""
    teeth, errors = law.teeth, "error not checked"
    if isfinite(teeth.error_rms):
        added = f" where deviations add {teeth.added_rms / um:.2g} um" if teeth.added_rms > 0 else ""
        added = " (the map lacks what deviations add: of an earlier version)" if isnan(teeth.added_rms) else added
        states = f"at most {teeth.error / um:.2g} um in states solved whole"
        errors = f"error {teeth.error_rms / um:.2g} um rms{added}, {states}"
    tabulated = 1.6e6 * law.pitches * (2 if law.table.head.has_centroid else 1)
    return f" composed of single tooth pairs, {errors} (a table of all pitches would have {tabulated / 1e6:.4g} MB)"


def displacement_in_housing(gearbox: Gearbox, stage: Stage) -> tuple[float, float]:
    """Distance [m] and angle [rad] between the axes of a sun or ring and of its carrier.

    They are the amplitudes of centre distance and misalignment over a turn of the carrier.
    """
    x, y, a, b = displacements_in_housing(stage, gearbox.shaft_positions, stage.axial_positions).T
    return float(np.hypot(x, y).max()), float(np.hypot(a, b).max())


def _misalignments_over_turn(gearbox: Gearbox, stage: Stage, side: int = 1) -> tuple[float, float]:
    """Least and largest misalignment [rad] of a stage over a turn of its carrier, with the sign of its map."""
    angles = np.arange(ANGLES) * 2 * pi / ANGLES
    values = [static_offsets(gearbox, stage, side, turned=angle)["misalignment"] for angle in angles.tolist()]
    first = np.fft.rfft(values) / ANGLES
    return float(first[0].real - 2 * abs(first[1])), float(first[0].real + 2 * abs(first[1]))


def why_coast_differs(stage: Stage, law: MeshForce, shafts: Mapping[str, Coordinates]) -> str:
    """Why the coast flank of a stage is not the mirror image that its law takes; "" where it is, or never touches.

    Spur gears with the same flanks on both sides differ in their force centroid alone, which turns no ideal shaft.
    """
    tilts = Coordinates.BEARINGS in (shafts[stage.fast.name], shafts[stage.slow.name])
    unlike = tilts or stage.pair.beta_b or law.coast_unlike in (SIDES_DIFFER, TEETH_DIFFER)
    exact = not isfinite(law.backlash) or not unlike
    return "" if exact else law.coast_unlike


def is_slight(stage: Stage, name: str, difference: float) -> bool:
    """Whether a map without the axis may ignore a change of the offset."""
    scale = {"misalignment": stage.pair.b / 2, "a": 1.0, "axial": 1 / stage.pair.b}
    return abs(difference) * scale[name] <= IGNORED[name]


def _check_axes_exist(stage: Stage, static: Mapping[str, float]) -> None:
    """Require map axes for the offsets by which the shafts are displaced statically."""
    nominal = {"misalignment": 0.0, "a": stage.pair.a, "axial": 0.0, **stage.force.fixed_offsets}
    remedies = {name: f"map it with fem.Offsets({name}=(...))" for name in nominal}
    offset, (pinion, wheel) = static["axial"], (axial / mm for axial in stage.axial_positions)
    remedies["axial"] = (
        f"pinion at {pinion:g} mm, wheel at {wheel:g} mm: map it with fem.Offsets(axial={offset:.6g}), or with "
        f"fem.Offsets(axial=(...)) from {-abs(offset):.6g} to {abs(offset):.6g}, where the coast flank carries too"
    )
    for name, value in nominal.items():
        missing = f"the shafts of stage {stage.name!r} give {name} = {static[name]:.6g}, but its map is for {value:.6g}"
        ignored = is_slight(stage, name, static[name] - value)
        require(name in stage.force.offsets or ignored, f"{missing}; {remedies[name]}")


def _check_axis_ranges(stage: Stage, static: Mapping[str, float]) -> None:
    """Require map axes that contain the static offsets."""
    for name, axis in stage.force.offsets.items():
        beyond = f"the shafts of stage {stage.name!r} give {name} = {static[name]:.6g}, beyond the map's axis"
        ends = f"from {axis[0]:.6g} to {axis[-1]:.6g}"
        require(axis[0] <= static[name] <= axis[-1], f"{beyond} {ends}; extend the axis fem.Offsets({name}=...)")


def _check_tilted(gearbox: Gearbox, stage: Stage, static: Mapping[str, float], tilt: float) -> None:
    """Require a misalignment axis that holds those over a turn of the carrier, against which an axis is tilted."""
    low, high = _misalignments_over_turn(gearbox, stage)
    cause = f"an axis of stage {stage.name!r} is tilted by {tilt:.4g} rad against its carrier's, its misalignment turns"
    middle = (low + high) / 2 if abs(low + high) > ROUNDING * tilt else 0.0
    remedy = f"map it with fem.Offsets(misalignment=({low:.4g}, {middle:.4g}, {high:.4g}))"
    needed = "misalignment" in stage.force.offsets or is_slight(stage, "misalignment", tilt)
    require(needed, f"{cause} from {low:.4g} to {high:.4g} rad; {remedy}")
    for misalignment in (low, high) if "misalignment" in stage.force.offsets else ():
        _check_axis_ranges(stage, {**static, "misalignment": misalignment})


def _check_backlash(stage: Stage, a: float) -> None:
    """Require backlash at the static centre distance, since the law has a single flank in contact at a time."""
    pair = stage.pair
    r_b = pair.pinion.r_b + pair.wheel.r_b
    backlash = stage.force.backlash + 2 * r_b * (involute(acos(r_b / a)) - involute(pair.alpha_wt))
    jam = f"shafts of stage {stage.name!r} stand {(pair.a - a) / um:.4g} um too close for its backlash"
    ends = f"of {stage.force.backlash / um:.4g} um: {-backlash / um:.4g} um are missing"
    require(backlash >= -IGNORED["a"], f"{jam} {ends}; give more backlash or make the offsets smaller")


def missing_axes(
    gearbox: Gearbox,
    shafts: Mapping[str, Coordinates],
    loads: Mapping[str, float],
    elastic: Mapping[str, ElasticShaft],
) -> list[str]:
    """Advice for each stage: the offsets to map where its gears move along axes that its map lacks; else empty.

    The offsets are estimated from the static displacement of the shafts under loads by their names [N m].
    """
    missing = [(stage, _missing(stage, shafts)) for stage in gearbox.stages]
    moved = _displacements(gearbox, shafts, loads, elastic) if any(axes for _, axes in missing) else {}
    return [_advice(gearbox, stage, axes, words_of(gearbox, loads), moved) if axes else "" for stage, axes in missing]


def largest_load(gearbox: Gearbox) -> dict[str, float]:
    """The largest load on the driven shaft that all maps carry [N m], by its name."""
    shares = np.abs(gearbox.static_forces(1.0))
    tops = np.array([float(np.min(stage.force.force_table[..., -1])) for stage in gearbox.stages])
    return {gearbox.driven.name: float((tops / np.maximum(shares, 1e-9)).min())}


def _missing(stage: Stage, shafts: Mapping[str, Coordinates]) -> list[str]:
    """Axes along which the gears of a stage move, but which its map lacks."""
    kinds = {shafts[stage.fast.name], shafts[stage.slow.name]}
    return [name for name, by in MOVED_BY.items() if kinds & set(by) and name not in stage.force.offsets]


def mesh_frame(gearbox: Gearbox, stage: Stage) -> np.record:
    """Contact frame of a stage at phase 0, its shafts statically displaced."""
    ends = list(zip((stage.fast, stage.slow), stage.axial_positions, strict=True))
    axial = [position - shaft.centre for shaft, position in ends]
    poses = [pose(gearbox, shaft) for shaft, _ in ends]
    return spatial_frame(stage.pair, 0.0, gearbox.direction_of(stage), axial, poses)


def _displacements(
    gearbox: Gearbox,
    shafts: Mapping[str, Coordinates],
    loads: Mapping[str, float],
    elastic: Mapping[str, ElasticShaft],
) -> dict[tuple[str, float], np.ndarray]:
    """(6,) static displacement [m, rad] of each shaft as its gear sees it, by name and axial position."""
    push = _push_on_gears(gearbox, loads)
    displaced: dict[tuple[str, float], np.ndarray] = {}
    for shaft in gearbox.shafts:
        pushed = {axial: forces for (name, axial), forces in push.items() if name == shaft.name}
        if shaft.name in elastic and elastic[shaft.name].spatial:
            forces = np.zeros(elastic[shaft.name].size)
            forces[: 6 * len(shaft.stations)] = np.concatenate([pushed[axial] for axial in shaft.stations])
            moved = _elastic_displacement(elastic[shaft.name], forces)
            displaced |= {(shaft.name, x): moved[6 * i : 6 * i + 6] for i, x in enumerate(shaft.stations)}
        else:
            total, free = sum(pushed.values(), np.zeros(6)), shafts[shaft.name].components[:-1]
            displaced |= dict.fromkeys(
                [(shaft.name, x) for x in pushed], static_displacement_or_inf(shaft, total, free)
            )
    return displaced


def _elastic_displacement(elastic: ElasticShaft, forces: np.ndarray) -> np.ndarray:
    """(size,) static coordinates of an elastic shaft; inf where its rolling bearings do not carry the load."""
    try:
        return elastic_displacement(elastic, forces)[0]
    except NotCarried:
        return np.full(elastic.size, np.inf)


def _push_on_gears(gearbox: Gearbox, loads: Mapping[str, float]) -> dict[tuple[str, float], np.ndarray]:
    """(6,) forces and moments [N, N m] of the meshes on the centre of mass of a shaft, by its name and its gear."""
    push = {end: np.zeros(6) for stage in gearbox.stages for end in stage.ends}
    for stage, force in zip(gearbox.stages, mesh_forces(gearbox, loads), strict=True):
        for end, row in zip(stage.ends, np.split(spatial_row(mesh_frame(gearbox, stage)), 2), strict=True):
            push[end] -= force * row
    return push


def push_on_shafts(gearbox: Gearbox, loads: Mapping[str, float]) -> dict[str, np.ndarray]:
    """(6,) forces and moments [N, N m] of the meshes on the centre of mass of each shaft."""
    push = {shaft.name: np.zeros(6) for shaft in gearbox.shafts}
    for (name, _), forces in _push_on_gears(gearbox, loads).items():
        push[name] += forces
    return push


def static_displacement_or_inf(shaft: Shaft, push: np.ndarray, free: Sequence[int]) -> np.ndarray:
    """(6,) static displacement of a shaft [m, rad]; inf where its rolling bearings do not carry the load."""
    try:
        return static_displacement(shaft, push, free)[0]
    except NotCarried:
        return np.full(6, np.inf)


def _advice(
    gearbox: Gearbox, stage: Stage, missing: list[str], load: str, moved: Mapping[tuple[str, float], np.ndarray]
) -> str:
    """Advice on the axes that the map of a stage lacks, with the `fem.Offsets` to paste."""
    if max(np.abs(np.delete(moved[end], 5)).max() for end in stage.ends) > LARGEST:
        yielding = f"under {load} the bearings yield too far for the gears to mesh"
        return f"{yielding}: use stiffer bearings (in N/m) or less load"
    static, reached = static_offsets(gearbox, stage), _reached(gearbox, stage, moved)
    far = [name for name in missing if not is_slight(stage, name, reached[name] - static[name])]
    if not far:
        return f"under {load} the gears move too little to matter"
    offsets = ", ".join(f"{name} = {reached[name]:.6g} {UNITS[name]}" for name in far)
    axes = dict(stage.force.offsets) | {name: _axis(name, static[name], reached[name]) for name in far}
    written = ", ".join(f"{name}=({', '.join(f'{x:.9g}' for x in axes[name])})" for name in AXIS_NAMES if name in axes)
    return f"under {load} {offsets}: map with offsets=fem.Offsets({written})"


def _reached(gearbox: Gearbox, stage: Stage, moved: Mapping[tuple[str, float], np.ndarray]) -> dict[str, float]:
    """Offsets [m, rad] of a stage whose shafts are displaced."""
    frame = mesh_frame(gearbox, stage)
    q_1, q_2 = (moved[end].copy() for end in stage.ends)
    q_2[5] = 0.0
    q_1[5] = gearbox.direction_of(stage) * LEAD / frame.pinion.r_b
    return dict(zip(AXIS_NAMES, offsets_at(stage.force.table.head, frame, tuple(q_1), tuple(q_2)), strict=True))


def _axis(name: str, static: float, reached: float) -> list[float]:
    """Offsets [m, rad] to map around the static one, their distance rounded up to two digits."""
    span = abs(reached - static)
    unit = 10.0 ** (floor(log10(span)) - 1)
    return [static + step * ceil(span / unit) * unit for step in MULTIPLES[name]]
