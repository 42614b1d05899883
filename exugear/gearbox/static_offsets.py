"""Static offsets of a stage: relative position of its gears on displaced shafts, in the frame of the pinion."""

from collections.abc import Mapping, Sequence
from math import acos, copysign, cos, hypot, sin

import numpy as np

from exugear.gearbox.shaft import Placement, Shaft
from exugear.gearbox.stage import Stage
from fem.pair.offsets import in_plane_of_action
from fem.support.validation import require
from fem.units import mm

#: Share of the centre distance within which a shaft lies on the axis of its carrier.
CLOSED = 1e-6


def stage_offsets(
    stage: Stage, positions: Mapping[str, tuple[float, float]], direction: int, turned: float = 0.0
) -> dict[str, float]:
    """a [m], misalignment [rad] and axial [m] under the shafts' static displacement, with the signs of `fem.Offsets`.

    a < 0 of a ring, as of its pair.

    positions   x, y of the shafts [m]
    direction   sense of the pinion's rotation, +1 or -1
    turned      angle of the carrier from the reference configuration [rad], against which axes in the housing turn back

    Raises ValueError for a centre distance below the sum of the base radii, where involutes cannot meet.
    """
    placed = [
        placed_on(shaft, _carrier_of(stage, shaft, positions), axial, positions)
        for shaft, axial in zip((stage.fast, stage.slow), stage.axial_positions, strict=True)
    ]
    fixed = displacements_in_housing(stage, positions, stage.axial_positions)
    for (point, tilts), displaced in zip(placed, fixed, strict=True):
        for part, at_rest in ((point[:2], displaced[:2]), (tilts, displaced[2:])):
            part += _turned_back(at_rest, turned) - at_rest
    (pinion, wheel), axes = zip(*[(point, Placement(tilt_x=a, tilt_y=b).axis) for point, (a, b) in placed], strict=True)
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


def _turned_back(vector: np.ndarray, angle: float) -> np.ndarray:
    """A vector (2,) seen from a frame that has turned by an angle [rad]."""
    x, y = vector
    return np.array([cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x])


def _carrier_of(stage: Stage, shaft: Shaft, positions: Mapping[str, tuple[float, float]]) -> Shaft | None:
    """The carrier that displaces a shaft of a stage: that of planets alone."""
    return stage.carrier if stage.carrier and is_beside(stage, shaft.name, positions) else None


def placed_on(
    shaft: Shaft, carrier: Shaft | None, axial: float, positions: Mapping[str, tuple[float, float]]
) -> tuple[np.ndarray, np.ndarray]:
    """(3,) point of the axis of a shaft at an axial position [m], and its tilts (2) about x and y [rad].

    A planet is displaced and tilted with its carrier, too, in the reference configuration.

    carrier     of a planet, else None
    positions   x, y of the shafts [m]
    """
    point = np.array([*positions[shaft.name], 0.0]) + shaft.offset.at(axial)
    tilts = np.array([shaft.offset.tilt_x, shaft.offset.tilt_y])
    if carrier is None:
        return point, tilts
    x, y = np.subtract(positions[shaft.name], positions[carrier.name])
    of_carrier = carrier.offset
    raised = np.array([0.0, 0.0, of_carrier.tilt_x * y - of_carrier.tilt_y * x])
    return point + displacement_at(carrier, axial) + raised, tilts + np.array([of_carrier.tilt_x, of_carrier.tilt_y])


def displacement_at(shaft: Shaft, axial: float) -> np.ndarray:
    """(3,) displacement of the axis of a shaft at an axial position [m]."""
    return shaft.offset.at(axial) - np.array([0.0, 0.0, axial])


def is_beside(stage: Stage, name: str, positions: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a shaft of a stage on a carrier lies beside the axis of the carrier."""
    axis = positions[stage.carrier.name] if stage.carrier else positions[name]
    return hypot(*np.subtract(positions[name], axis)) > CLOSED * abs(stage.pair.a)


def displacements_in_housing(
    stage: Stage, positions: Mapping[str, tuple[float, float]], axial: Sequence[float]
) -> np.ndarray:
    """(2, 4) displacements (x, y) [m] and tilts about x and y [rad] of the axes of pinion and wheel from the carrier's.

    They stand in the housing while the planets turn with the carrier; 0 of planets, and without a carrier.

    axial   positions on both shafts at which displacements are meant [m]
    """
    fixed = np.zeros((2, 4))
    for row, shaft, at in zip(fixed, (stage.fast, stage.slow), axial, strict=True):
        if stage.carrier and not is_beside(stage, shaft.name, positions):
            of_shaft, of_carrier = shaft.offset, stage.carrier.offset
            row[:2] = (of_shaft.at(at) - of_carrier.at(at))[:2]
            row[2:] = of_shaft.tilt_x - of_carrier.tilt_x, of_shaft.tilt_y - of_carrier.tilt_y
    return fixed
