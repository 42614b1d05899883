"""Static offsets of a stage: relative position of its gears on displaced shafts, in the frame of the pinion."""

from collections.abc import Mapping
from math import acos, copysign, hypot

import numpy as np

from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from fem.pair.offsets import in_plane_of_action
from fem.support.validation import require
from fem.units import mm

#: Share of the centre distance within which a shaft lies on the axis of its carrier.
CLOSED = 1e-6


def stage_offsets(stage: Stage, positions: Mapping[str, tuple[float, float]], direction: int) -> dict[str, float]:
    """a [m], misalignment [rad] and axial [m] under the shafts' static displacement, with the signs of `fem.Offsets`.

    a < 0 of a ring, as of its pair.

    positions   x, y of the shafts [m]
    direction   sense of the pinion's rotation, +1 or -1

    Raises ValueError for a centre distance below the sum of the base radii, where involutes cannot meet.
    """
    shafts, axes = (stage.fast, stage.slow), (stage.fast.offset.axis, stage.slow.offset.axis)
    pinion, wheel = (
        np.array([*positions[shaft.name], 0.0]) + shaft.offset.at(axial) + _with_carrier(stage, shaft, axial, positions)
        for shaft, axial in zip(shafts, stage.axial_positions, strict=True)
    )
    axial = (wheel - pinion) @ axes[0]
    line = wheel - pinion - axial * axes[0]
    r_b = stage.pair.pinion.r_b + stage.pair.wheel.r_b
    a = copysign(float(np.linalg.norm(line)), r_b)
    e_r = line / a
    e_t = direction * np.cross(axes[0], e_r)
    near = f"shafts of stage {stage.name!r} must stand further apart than {r_b / mm:.6g} mm, got {a / mm:.6g} mm"
    require(abs(r_b) < abs(a), f"{near}; make the offsets smaller")
    alpha = acos(r_b / a)
    misalignment = in_plane_of_action(alpha, axes[1] @ e_r, axes[1] @ e_t)
    return {"a": a, "misalignment": float(misalignment), "axial": float(axial)}


def _with_carrier(stage: Stage, shaft: Shaft, axial: float, positions: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """(3,) displacement of a planet with its carrier [m], 0 of other shafts."""
    is_planet = stage.carrier is not None and is_beside(stage, shaft.name, positions)
    return displacement_at(stage.carrier, axial) if stage.carrier and is_planet else np.zeros(3)


def displacement_at(shaft: Shaft, axial: float) -> np.ndarray:
    """(3,) displacement of the axis of a shaft at an axial position [m]."""
    return shaft.offset.at(axial) - np.array([0.0, 0.0, axial])


def is_beside(stage: Stage, name: str, positions: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a shaft of a stage on a carrier lies beside the axis of the carrier."""
    axis = positions[stage.carrier.name] if stage.carrier else positions[name]
    return hypot(*np.subtract(positions[name], axis)) > CLOSED * abs(stage.pair.a)


def displacements_in_housing(stage: Stage, positions: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """(2, 2) displacements (x, y) [m] of the axes of pinion and wheel from that of their carrier.

    They stand in the housing while the planets turn with the carrier; 0 of planets, and without a carrier.
    """
    fixed = np.zeros((2, 2))
    for row, shaft, axial in zip(fixed, (stage.fast, stage.slow), stage.axial_positions, strict=True):
        if stage.carrier and not is_beside(stage, shaft.name, positions):
            row[:] = (shaft.offset.at(axial) - stage.carrier.offset.at(axial))[:2]
    return fixed
