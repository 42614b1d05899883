"""Kinematics of one involute mesh: body coordinates -> deflection, and the same rows back to generalized forces.

Shafts run along z. e_r points from the pinion's to the wheel's centre, e_t = z x e_r. For direction +1 the deflection
is positive where the pinion leads counter-clockwise; its line of action is n = cos(alpha) e_t + sin(alpha) e_r, the
other flank's -cos(alpha) e_t + sin(alpha) e_r. The force F pushes the wheel by F n and the pinion by -F n in one common
point, the current pitch point in mid-plane; generalized forces are -F row, the rate is row . velocity (virtual work).
Exact for involutes whose axes stay parallel, at any centre distance and place of the centres; tilts enter the wrenches.
"""

from math import acos, atan2, cos, floor, hypot, pi, sin, sqrt, tan

import numpy as np

from exugear.force import BACK_PHASE, BACKLASH, compiled, flank_force
from fem.gear import GearPair, involute

R_B1, R_B2, TURNS, PHASE, DIRECTION, INV_0, AXIAL_1, AXIAL_2, E_X, E_Y, REFERENCE_1, REFERENCE_2 = *range(11), 16
FRAME = 22


def rotational_frame(pair: GearPair, phase: float, direction: int) -> np.ndarray:
    """The numbers that the kernels read, for two rotational coordinates."""
    frame = np.zeros(FRAME)
    frame[R_B1], frame[R_B2], frame[TURNS] = pair.pinion.r_b, pair.wheel.r_b, pair.pinion.z / (2 * pi)
    frame[PHASE], frame[DIRECTION], frame[INV_0] = phase, direction, involute(pair.alpha_wt)
    return frame


def spatial_frame(pair: GearPair, phase: float, direction: int, axial, reference) -> np.ndarray:
    """The same for two Rxyz nodes: axial (2,) places of the gears on their bodies [m], reference (2, 6) coordinates."""
    frame = rotational_frame(pair, phase, direction)
    frame[[AXIAL_1, AXIAL_2]] = axial
    frame[REFERENCE_1:REFERENCE_2], frame[REFERENCE_2:] = reference
    line = reference_line(axial, reference)
    frame[[E_X, E_Y]] = line[:2] / hypot(line[0], line[1])
    return frame


def reference_line(axial, reference) -> np.ndarray:
    """Vector (3,) from the pinion's to the wheel's centre in the reference configuration [m]."""
    centres = [np.array(x[:3]) + s * np.array(spin_axis(x[3], x[4])) for s, x in zip(axial, reference, strict=True)]
    return centres[1] - centres[0]


@compiled
def spin_axis(a, b):
    """Rx(a) Ry(b) e_z: the body's z axis."""
    return sin(b), -sin(a) * cos(b), cos(a) * cos(b)


@compiled
def cross(a, b):
    """a x b of tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def row_of(pole, contact, n, a, b):
    """Row (6) of one Rxyz body for a unit force n in contact: [n, G^T ((contact - pole) x n)]."""
    m = cross((contact[0] - pole[0], contact[1] - pole[1], contact[2] - pole[2]), n)
    z = spin_axis(a, b)
    return n[0], n[1], n[2], m[0], cos(a) * m[1] + sin(a) * m[2], z[0] * m[0] + z[1] * m[1] + z[2] * m[2]


@compiled
def dot(row, v):
    """Row (6) times velocity (6)."""
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2] + row[3] * v[3] + row[4] * v[4] + row[5] * v[5]


@compiled
def flank_of(law, lead, opening, phase):
    """(side, penetration's deflection, phase) of the flank nearest to contact; lead: what the pinion is ahead [m]."""
    if lead >= -0.5 * law[BACKLASH]:
        return 1.0, lead - opening, phase
    return -1.0, -(lead + law[BACKLASH]) - opening, law[BACK_PHASE] - phase


@compiled
def rotational_mesh(law, frame, q_1, q_2, v_1, v_2):
    """(deflection [m], force [N], torques (2) [N m]) of two rotational coordinates."""
    d, r_1, r_2 = frame[DIRECTION], frame[R_B1], frame[R_B2]
    lead = d * (r_1 * q_1 + r_2 * q_2)
    side, deflection, phase = flank_of(law, lead, 0.0, d * frame[TURNS] * q_1 + frame[PHASE])
    force = side * flank_force(law, phase, deflection, side * d * (r_1 * v_1 + r_2 * v_2))
    return lead, force, (-d * r_1 * force, -d * r_2 * force)


@compiled
def placed(frame, reference, axial, q):
    """Absolute pole (3), tilts and gear centre (3) of one body with displacements q (6)."""
    pole = (frame[reference] + q[0], frame[reference + 1] + q[1], frame[reference + 2] + q[2])
    a, b = frame[reference + 3] + q[3], frame[reference + 4] + q[4]
    z = spin_axis(a, b)
    return pole, a, b, (pole[0] + axial * z[0], pole[1] + axial * z[1], pole[2] + axial * z[2])


@compiled
def spatial_mesh(law, frame, q_1, q_2, v_1, v_2):
    """(deflection [m], force [N], generalized forces (6), (6)) of two Rxyz bodies."""
    d, r_1, r_2 = frame[DIRECTION], frame[R_B1], frame[R_B2]
    pole_1, a_1, b_1, centre_1 = placed(frame, REFERENCE_1, frame[AXIAL_1], q_1)
    pole_2, a_2, b_2, centre_2 = placed(frame, REFERENCE_2, frame[AXIAL_2], q_2)
    x, y = centre_2[0] - centre_1[0], centre_2[1] - centre_1[1]
    distance = sqrt(x * x + y * y)
    if not distance > r_1 + r_2:
        raise ValueError(distance, r_1 + r_2)
    x, y = x / distance, y / distance
    turned = atan2(frame[E_X] * y - frame[E_Y] * x, frame[E_X] * x + frame[E_Y] * y)
    alpha = acos((r_1 + r_2) / distance)
    opening = (r_1 + r_2) * (tan(alpha) - alpha - frame[INV_0])
    lead = d * (r_1 * (q_1[5] - turned) + r_2 * (q_2[5] - turned))
    pitch = d * frame[TURNS] * (q_1[5] - turned) + frame[PHASE]
    side, deflection, phase = flank_of(law, lead, opening, pitch)
    c, s, r_w = side * d * cos(alpha), sin(alpha), r_1 / cos(alpha)
    n = (-c * y + s * x, c * x + s * y, 0.0)
    contact = (centre_1[0] + r_w * x, centre_1[1] + r_w * y, 0.5 * (centre_1[2] + centre_2[2]))
    row_1, row_2 = row_of(pole_1, contact, n, a_1, b_1), row_of(pole_2, contact, n, a_2, b_2)
    force = flank_force(law, phase, deflection, dot(row_1, v_1) - dot(row_2, v_2))
    return lead - opening, side * force, scaled(row_1, -force), scaled(row_2, force)


@compiled
def scaled(row, f):
    """f row (6)."""
    return f * row[0], f * row[1], f * row[2], f * row[3], f * row[4], f * row[5]


def phase_of(frame: np.ndarray, spin: float) -> float:
    """Phase in [0, 1) where the pinion has turned by spin [rad] and the centres rest."""
    turned = frame[DIRECTION] * frame[TURNS] * spin + frame[PHASE]
    return turned - floor(turned)


def rotational_row(frame: np.ndarray) -> np.ndarray:
    """Row (2): deflection = row . coordinates."""
    return frame[DIRECTION] * frame[[R_B1, R_B2]]


def spatial_row(frame: np.ndarray) -> np.ndarray:
    """Row (12) of the driving flank in the reference configuration."""
    one, other = frame[REFERENCE_1:REFERENCE_2], frame[REFERENCE_2:]
    none = np.zeros(6)
    pole_1, a_1, b_1, centre_1 = placed(frame, REFERENCE_1, frame[AXIAL_1], none)
    pole_2, a_2, b_2, centre_2 = placed(frame, REFERENCE_2, frame[AXIAL_2], none)
    line = reference_line(frame[[AXIAL_1, AXIAL_2]], (one, other))
    alpha = acos((frame[R_B1] + frame[R_B2]) / hypot(line[0], line[1]))
    x, y, c, s = frame[E_X], frame[E_Y], frame[DIRECTION] * cos(alpha), sin(alpha)
    n = (-c * y + s * x, c * x + s * y, 0.0)
    r_w = frame[R_B1] / cos(alpha)
    contact = (centre_1[0] + r_w * x, centre_1[1] + r_w * y, (centre_1[2] + centre_2[2]) / 2)
    return np.r_[row_of(pole_1, contact, n, a_1, b_1), -np.array(row_of(pole_2, contact, n, a_2, b_2))]
