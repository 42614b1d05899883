"""Motion of the gears of a stage along the axes that its map lacks, and the offsets to map."""

from collections.abc import Mapping
from math import ceil, floor, log10

import numpy as np

from exugear.contact.reference_configuration import offsets_at, spatial_frame, spatial_row
from exugear.gearbox.constant_loads import mesh_forces, words_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft_dynamics import static_displacement
from exugear.gearbox.stage import Stage
from exugear.planning.coordinates import Coordinates, pose
from exugear.planning.map_axes import AXIS_NAMES, MOVED_BY, is_slight, static_offsets

#: Units of the axes of a map.
UNITS = {"a": "m", "misalignment": "rad", "axial": "m"}
#: Offsets to map, in multiples of the displacement under the load.
MULTIPLES = {"a": (-1, 0, 1, 2), "misalignment": (-2, -1, 0, 1, 2), "axial": (-2, 0, 2)}
#: Deflection by which the pinion leads, so that its driving flank is the closer one [m].
LEAD = 1e-3
#: Displacement [m, rad] up to which a map can be made: `fem.Offsets` end at 0.01 rad.
LARGEST = 0.005


def missing_axes(gearbox: Gearbox, shafts: Mapping[str, Coordinates], loads: Mapping[str, float]) -> list[str]:
    """Advice for each stage: the offsets to map where its gears move along axes that its map lacks; else empty.

    The offsets are estimated from the static displacement of the shafts under loads by their names [N m].
    """
    missing = [(stage, _missing(stage, shafts)) for stage in gearbox.stages]
    moved = _displacements(gearbox, shafts, loads) if any(axes for _, axes in missing) else {}
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


def _frame(gearbox: Gearbox, stage: Stage) -> np.record:
    ends = list(zip((stage.fast, stage.slow), stage.axial_positions, strict=True))
    axial = [position - shaft.centre for shaft, position in ends]
    poses = [pose(gearbox, shaft) for shaft, _ in ends]
    return spatial_frame(stage.pair, 0.0, gearbox.directions[stage.fast.name], axial, poses)


def _displacements(
    gearbox: Gearbox, shafts: Mapping[str, Coordinates], loads: Mapping[str, float]
) -> dict[str, np.ndarray]:
    """(6,) static displacement of each shaft on its bearings [m, rad]."""
    push = {name: np.zeros(6) for name in shafts}
    for stage, force in zip(gearbox.stages, mesh_forces(gearbox, loads), strict=True):
        for shaft, row in zip((stage.fast, stage.slow), np.split(spatial_row(_frame(gearbox, stage)), 2), strict=True):
            push[shaft.name] -= force * row
    return {s.name: static_displacement(s, push[s.name], shafts[s.name].components[:-1])[0] for s in gearbox.shafts}


def _advice(gearbox: Gearbox, stage: Stage, missing: list[str], load: str, moved: Mapping[str, np.ndarray]) -> str:
    """Advice on the axes that the map of a stage lacks, with the `fem.Offsets` to paste."""
    if max(np.abs(moved[shaft.name]).max() for shaft in (stage.fast, stage.slow)) > LARGEST:
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


def _reached(gearbox: Gearbox, stage: Stage, moved: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Offsets [m, rad] of a stage whose shafts are displaced."""
    frame = _frame(gearbox, stage)
    q_1, q_2 = (moved[shaft.name].copy() for shaft in (stage.fast, stage.slow))
    q_1[5] = gearbox.directions[stage.fast.name] * LEAD / frame.pinion.r_b
    return dict(zip(AXIS_NAMES, offsets_at(stage.force.table.head, frame, tuple(q_1), tuple(q_2)), strict=True))


def _axis(name: str, static: float, reached: float) -> list[float]:
    """Offsets [m, rad] to map around the static one, their distance rounded up to two digits."""
    span = abs(reached - static)
    unit = 10.0 ** (floor(log10(span)) - 1)
    return [static + step * ceil(span / unit) * unit for step in MULTIPLES[name]]
