"""A contact in its reference configuration: frame of bodies in space, deflection, phase and rows."""

from math import acos, cos, floor, sin

import numpy as np

from exugear.force_table.kernel_records import changed, record_of
from exugear.kernels.contact_records import GEAR, rotational_frame
from exugear.kernels.kinematics import AT_REFERENCE, height, line_of_centres, pose_of, position_of, row_of, spin_axis
from fem.support.numba_cache import kept


def spatial_frame(pair, phase: float, direction: int, axial, reference, **values) -> np.record:
    """Frame of a pair on two Rxyz bodies.

    axial       (2,) axial positions of the gears on their bodies [m]
    reference   (2, 6) reference coordinates of the bodies
    values      further fields of the frame
    """
    radii = pair.pinion.r_b, pair.wheel.r_b
    pinion, wheel = (
        record_of(GEAR, r_b=r_b, axial=s, reference=x) for r_b, s, x in zip(radii, axial, reference, strict=True)
    )
    frame = changed(rotational_frame(pair, phase, direction), pinion=pinion, wheel=wheel)
    e_x, e_y, raised = reference_line_and_height(frame, pair.pinion.r_b / cos(pair.alpha_wt))
    return changed(frame, **{"e_x": e_x, "e_y": e_y, "height": raised} | values)


def reference_line(axial, reference) -> np.ndarray:
    """Vector (3,) from the pinion's to the wheel's centre in the reference configuration [m]."""
    centres = [np.array(x[:3]) + s * np.array(spin_axis(x[3], x[4])) for s, x in zip(axial, reference, strict=True)]
    return centres[1] - centres[0]


@kept
def reference_line_and_height(frame, r_w):
    """e_r (2) and `height` [m] at the working pitch radius of the pinion [m]."""
    pinion, wheel = pose_of(frame.pinion, AT_REFERENCE), pose_of(frame.wheel, AT_REFERENCE)
    line = line_of_centres(frame, pinion, wheel)
    return line.e_r[0], line.e_r[1], height(pinion, wheel, line.e_r, r_w)


@kept
def reference_state(table, frame):
    """Deflection [m], opening of either flank [m] and phase of the driving one in the reference configuration."""
    position = position_of(table, frame, AT_REFERENCE, AT_REFERENCE)
    side, phase = position.flank.side, position.flank.phase
    opening = position.opening
    return position.lead - opening, opening, phase if side > 0.0 else table.back_phase - phase


@kept
def offsets_at(table, frame, q_1, q_2):
    """Offsets (3) of two Rxyz bodies with displacements q_1, q_2 (6), with the signs of the map."""
    return position_of(table, frame, q_1, q_2).offsets


@kept
def spatial_rows(frame):
    """Rows (6), (6) of pinion and wheel for a unit force on the driving flank, in mid-plane."""
    pinion, wheel = pose_of(frame.pinion, AT_REFERENCE), pose_of(frame.wheel, AT_REFERENCE)
    line = line_of_centres(frame, pinion, wheel)
    (x, y), distance = line.e_r, line.distance
    alpha, d = acos((frame.pinion.r_b + frame.wheel.r_b) / distance), frame.direction
    c, s, r_w = d * cos(alpha), sin(alpha), frame.pinion.r_b / cos(alpha)
    n = (-c * y + s * x, c * x + s * y, -d * frame.tan_beta_b)
    point = (pinion.centre[0] + r_w * x, pinion.centre[1] + r_w * y, pinion.centre[2])
    return row_of(pinion, point, n), row_of(wheel, point, n)


def spatial_row(frame: np.record) -> np.ndarray:
    """Row (12): deflection = row . displacements of pinion and wheel, to first order."""
    row_1, row_2 = spatial_rows(frame)
    return np.r_[row_1, -np.array(row_2)]


def rotational_row(frame: np.record) -> np.ndarray:
    """Row (2): deflection = row . spins."""
    return frame.direction * np.array([frame.pinion.r_b, frame.wheel.r_b])


def phase_of(frame: np.record, spin: float) -> float:
    """Phase in [0, 1) at a spin of the pinion [rad], the centres in their reference positions."""
    phase = frame.direction * frame.pitches_per_radian * spin + frame.phase
    return phase - floor(phase)
