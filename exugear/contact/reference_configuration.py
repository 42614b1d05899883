"""A contact in its reference configuration: its frame, which never changes, deflection, phase and rows."""

from math import atan2, inf, pi, tan
from typing import NamedTuple

import numpy as np

from exugear.contact.relative_position import (
    deflection_slopes,
    gradient,
    height,
    line_of_centres,
    pose_of,
    position_of,
)
from exugear.contact.rotation import by_angles
from exugear.contact.vectors import dot
from exugear.mesh_force.kernel_records import changed, record_of, record_type
from fem.gear.involute import involute
from fem.support.numba_cache import kept

#: A gear on its body: base radius and axial position [m], reference coordinates of the body as an Rxyz body of the
#: frame of the mesh (`exugear.contact.body_motion`). In a rotated frame also the rotational reference
#: coordinates of its node, the axes of the gear on the body, its angles in the contact frame in the reference
#: configuration, and the factors of the fourth and sixth coordinate that count its turns for the recorder.
GEAR = record_type(
    ("r_b", "f8"),
    ("axial", "f8"),
    ("reference", "f8", 6),
    ("rotation", "f8", 4),
    ("axes", "f8", (3, 3)),
    ("angles", "f8", 3),
    ("spin_factors", "f8", 2),
)
#: Geometry of a contact. In the reference configuration: line of centres (e_x, e_y) on the pinion's body, height as
#: `relative_position.height`, angle of the line on the wheel's body less that on the pinion's [rad];
#: base_pitch: 0 where coordinates count the turns of both bodies, else the base pitch [m], up to whole multiples of
#: which attitudes tell the advance; axes: of a rotated contact frame (columns), 0 where it is the global frame;
#: between: from the pinion's body to the wheel's [m], along the global axes; fixed: displacements (x, y) of the axes of
#: pinion and wheel from that of their carrier [m] and their tilts about x and y [rad], which stand in the housing while
#: the carrier turns, 0 of planets;
#: gap: of the driving flanks where they should touch, by a tooth that is thinner than those of other planets [m];
#: modes: number of coordinates of an elastic ring behind those of the bodies.
CONTACT_FRAME = record_type(
    ("pitches_per_radian", "f8"),
    ("phase", "f8"),
    ("direction", "f8"),
    ("inv_alpha_wt", "f8"),
    ("tan_beta_b", "f8"),
    ("e_x", "f8"),
    ("e_y", "f8"),
    ("height", "f8"),
    ("wheel_angle", "f8"),
    ("base_pitch", "f8"),
    ("axes", "f8", (3, 3)),
    ("between", "f8", 3),
    ("fixed", "f8", (2, 4)),
    ("gap", "f8"),
    ("modes", "i8"),
    ("pinion", GEAR),
    ("wheel", GEAR),
)
#: Displacements of a body in its reference configuration.
AT_REFERENCE = (0.0,) * 6


class DrivingFlank(NamedTuple):
    """What the relative position needs of a force table, for the driving flank alone."""

    backlash: float = inf
    back_phase: float = 0.0


def rotational_frame(pair, phase: float, direction: int) -> np.record:
    """Frame of a `fem.GearPair` or `RingPair` on two bodies that spin about fixed axes."""
    return record_of(
        CONTACT_FRAME,
        pitches_per_radian=pair.pinion.z / (2 * pi),
        phase=phase,
        direction=direction,
        inv_alpha_wt=involute(pair.alpha_wt),
        tan_beta_b=tan(pair.beta_b),
        pinion=record_of(GEAR, r_b=pair.pinion.r_b),
        wheel=record_of(GEAR, r_b=pair.wheel.r_b),
    )


def is_spatial(frame: np.record) -> bool:
    """Whether a frame holds the positions of its gears, as that of two bodies about fixed axes does not."""
    return bool(frame.e_x or frame.e_y)


def turns_forces(frame: np.record) -> bool:
    """Whether the generalized forces of a mesh force change with the coordinates: in space, and on an elastic ring."""
    return is_spatial(frame) or bool(frame.modes)


def is_rotated(frame: np.record) -> bool:
    """Whether a contact frame is rotated against the global one."""
    return bool(frame.axes.any())


def spatial_frame(pair, phase: float, direction: int, axial, reference, **values) -> np.record:
    """Frame of a pair on two Rxyz bodies.

    axial       (2,) axial positions of the gears on their bodies [m]
    reference   (2, 6) reference coordinates of the bodies
    values      further fields of the frame, also instead of those of the reference configuration
    """
    radii = pair.pinion.r_b, pair.wheel.r_b
    pinion, wheel = (
        record_of(GEAR, r_b=r_b, axial=s, reference=x) for r_b, s, x in zip(radii, axial, reference, strict=True)
    )
    frame = changed(rotational_frame(pair, phase, direction), pinion=pinion, wheel=wheel)
    e_x, e_y, raised, wheel_angle = reference_line_and_height(frame)
    return changed(frame, **{"e_x": e_x, "e_y": e_y, "height": raised, "wheel_angle": wheel_angle} | values)


def reference_line(axial, reference) -> np.ndarray:
    """Vector (3,) from the pinion's to the wheel's centre in the reference configuration [m]."""
    axes = [np.array(by_angles((x[3], x[4], 0.0, 0.0)))[:, 2] for x in reference]
    pinion, wheel = (np.array(x[:3]) + s * z for s, x, z in zip(axial, reference, axes, strict=True))
    return wheel - pinion


@kept
def reference_line_and_height(frame):
    """Line of centres (2) on the pinion's body, `height` [m], angle of the line on the wheel's body less that [rad]."""
    pinion, wheel = pose_of(frame.pinion, AT_REFERENCE), pose_of(frame.wheel, AT_REFERENCE)
    line, distance, shift = line_of_centres(frame, pinion, wheel)
    x_1, y_1 = dot(line, pinion.x) / distance, dot(line, pinion.y) / distance
    x_2, y_2 = dot(line, wheel.x) / distance, dot(line, wheel.y) / distance
    angle = atan2(x_1 * y_2 - y_1 * x_2, x_1 * x_2 + y_1 * y_2)
    return x_1, y_1, height(frame, pinion, wheel, line, shift), angle


@kept
def state_at_coordinates(table, frame, q_1, q_2):
    """Deflection [m], opening of either flank [m] and phase of the driving one at displacements (6) of the bodies."""
    position = position_of(table, frame, q_1, q_2)
    return position.advance - position.opening, position.opening, position.phase


@kept
def reference_state(table, frame):
    """Deflection [m], opening of either flank [m] and phase of the driving one in the reference configuration."""
    return state_at_coordinates(table, frame, AT_REFERENCE, AT_REFERENCE)


@kept
def offsets_at(table, frame, q_1, q_2):
    """Offsets (3) of two Rxyz bodies with displacements q_1, q_2 (6), with the signs of the map."""
    return position_of(table, frame, q_1, q_2).offsets


@kept
def spatial_rows(frame):
    """Rows (6), (6) of pinion and wheel: slopes of the deflection of the driving flank by their coordinates."""
    position = position_of(DrivingFlank(inf, 0.0), frame, AT_REFERENCE, AT_REFERENCE)
    return gradient(frame, position, deflection_slopes(frame, position, 1.0, 0.0, (0.0, 0.0, 0.0)))


def spatial_row(frame: np.record) -> np.ndarray:
    """Row (12): deflection = row . displacements of pinion and wheel, to first order."""
    return np.concatenate(spatial_rows(frame))


def rotational_row(frame: np.record) -> np.ndarray:
    """Row (2): deflection = row . spins."""
    return frame.direction * np.array([frame.pinion.r_b, frame.wheel.r_b])


def phase_of(frame: np.record, spin: float) -> float:
    """Phase [pitches] at a spin of the pinion [rad], the centres in their reference positions."""
    return frame.direction * frame.pitches_per_radian * spin + frame.phase
