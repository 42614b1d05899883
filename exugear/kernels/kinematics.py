"""Kinematics of one involute mesh: body coordinates -> deflection, and the same rows back to generalized forces.

Shafts run along z. e_r points from the pinion's to the wheel's axis in the pinion's mid-plane, e_t = z x e_r. A ring
gear has a negative base radius and a negative centre distance (ISO 21771), so that e_r points away from its axis.
For direction +1 the deflection is positive where the pinion leads counter-clockwise; 0 takes the gears out of mesh. On
the flank side = direction the line of action is n = side cos(alpha) e_t + sin(alpha) e_r - side tan(beta_b) e_z; F n
pushes the wheel and -F n the pinion in one common point, the pitch point at the centroid. F, the transverse force, is
what a torque F r_b1 needs, and generalized forces are -F row, the rate is row . velocity (virtual work). The law
counts z along side z, records along z (`exugear.kernels.recorder.Recorder`).

Offsets as in `fem.Offsets`: the centre distance is that in the pinion's mid-plane, the misalignment the angle of the
axes in the plane of action by which the gap opens along side z, the axial offset that of the wheel.
Exact for involutes whose axes stay parallel, at any centre distance and place of the centres, orbiting ones as well;
first order in the tilts.
"""

from math import acos, atan2, cos, floor, pi, sin, sqrt, tan

import numpy as np

from exugear.mesh_force.force_kernels import BACK_PHASE, BACKLASH, caught_up, damping, spinning_force, static_force
from fem.gear.involute import involute
from fem.support.numba_cache import compiled, kept

R_B1, R_B2, TURNS, PHASE, DIRECTION, INV_0, AXIAL_1, AXIAL_2, E_X, E_Y, TAN_BETA_B, HEIGHT = range(12)
#: What velocities of the integrator lack, as `force_kernels.caught_up` takes it; the same by bearings, per velocity.
LAG, LAG_1, LAG_2 = 12, 13, 19
#: Acceleration per mesh force [1/kg]; mesh force that holds the load while the bearings are at rest [N].
MOBILITY, HELD = 25, 26
REFERENCE_1, REFERENCE_2 = 27, 33
#: 0 where coordinates count the turns of both bodies, else the base pitch [m], which the lead is known within.
BASE_PITCH = 39
#: Where the contact frame is not the global one (`contact_frame`): its axes (9), numbers of both bodies (15).
CONTACT_AXES, BODY_1, BODY_2 = 40, 49, 64
FRAME = 79
compiled_involute = compiled(involute)
#: Over which the static force's rise is taken [s].
INSTANT = 1e-9


def rotational_frame(pair, phase: float, direction: int) -> np.ndarray:
    """The numbers that the kernels read, for rotational coordinates of a `fem.GearPair` or `RingPair`."""
    frame = np.zeros(FRAME)
    frame[R_B1], frame[R_B2], frame[TURNS] = pair.pinion.r_b, pair.wheel.r_b, pair.pinion.z / (2 * pi)
    frame[PHASE], frame[DIRECTION], frame[INV_0] = phase, direction, compiled_involute(pair.alpha_wt)
    frame[TAN_BETA_B] = tan(pair.beta_b)
    return frame


def spatial_frame(pair, phase: float, direction: int, axial, reference) -> np.ndarray:
    """The same for two Rxyz nodes: axial (2,) places of the gears on their bodies [m], reference (2, 6) coordinates."""
    frame = rotational_frame(pair, phase, direction)
    frame[[AXIAL_1, AXIAL_2]] = axial
    frame[REFERENCE_1:REFERENCE_2], frame[REFERENCE_2:BASE_PITCH] = reference
    none = (0.0,) * 6
    x, y, *_ = line_of_centres(frame, none, none)
    frame[[E_X, E_Y]] = np.array([x, y]) * np.sign(pair.a)
    frame[HEIGHT] = height(frame, none, none, tuple(frame[[E_X, E_Y]]), frame[R_B1] / cos(pair.alpha_wt))
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


@kept
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
def scaled(row, f):
    """f row (6)."""
    return f * row[0], f * row[1], f * row[2], f * row[3], f * row[4], f * row[5]


@compiled
def added(one, other):
    """Sum of two rows (6)."""
    return (
        one[0] + other[0],
        one[1] + other[1],
        one[2] + other[2],
        one[3] + other[3],
        one[4] + other[4],
        one[5] + other[5],
    )


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
    rate, passing = side * d * (r_1 * v_1 + r_2 * v_2), side * d * frame[TURNS] * v_1
    penetration, force, turning = spinning_force(law, phase, deflection)
    c = damping(law, penetration)
    if c > 0.0:
        if frame[LAG] != 0.0:
            _, later, _ = spinning_force(law, phase + INSTANT * passing, deflection + INSTANT * rate)
            rise, excess = (later - force) / INSTANT, force - side * frame[HELD]
            rate = caught_up(rate, frame[LAG], frame[MOBILITY], rise, excess, c)
        force += c * rate
    force, turning = side * force, side * d * turning
    return lead, force, (-d * r_1 * force - frame[TURNS] * turning, -d * r_2 * force)


@kept
def placed(frame, reference, axial, q):
    """Absolute pole (3), tilts, z axis (3) and gear centre (3) of one body with displacements q (6)."""
    pole = (frame[reference] + q[0], frame[reference + 1] + q[1], frame[reference + 2] + q[2])
    a, b = frame[reference + 3] + q[3], frame[reference + 4] + q[4]
    z = spin_axis(a, b)
    return pole, a, b, z, (pole[0] + axial * z[0], pole[1] + axial * z[1], pole[2] + axial * z[2])


@kept
def line_of_centres(frame, q_1, q_2):
    """Unit vector from the pinion's centre to the wheel's axis in the pinion's mid-plane, its length, axial offset."""
    _, _, _, _, centre_1 = placed(frame, REFERENCE_1, frame[AXIAL_1], q_1)
    _, _, _, z_2, centre_2 = placed(frame, REFERENCE_2, frame[AXIAL_2], q_2)
    along = (centre_1[2] - centre_2[2]) / z_2[2]
    x, y = centre_2[0] + along * z_2[0] - centre_1[0], centre_2[1] + along * z_2[1] - centre_1[1]
    distance = sqrt(x * x + y * y)
    return x / distance, y / distance, distance, centre_2[2] - centre_1[2]


@kept
def height(frame, q_1, q_2, e_r, r_w):
    """How much higher the pinion's mid-plane is at the pitch point than the wheel's [m]."""
    _, _, _, z_1, centre_1 = placed(frame, REFERENCE_1, frame[AXIAL_1], q_1)
    _, _, _, z_2, centre_2 = placed(frame, REFERENCE_2, frame[AXIAL_2], q_2)
    x, y = centre_1[0] + r_w * e_r[0], centre_1[1] + r_w * e_r[1]
    one = -(z_1[0] * (x - centre_1[0]) + z_1[1] * (y - centre_1[1])) / z_1[2]
    other = -(z_2[0] * (x - centre_2[0]) + z_2[1] * (y - centre_2[1])) / z_2[2]
    return centre_1[2] + one - centre_2[2] - other


@compiled
def unwound(d, r_1, r_2, q_1, q_2, turned):
    """The turn of e_r next to which the gears mesh: |lead| stays far below that of a whole turn."""
    whole = 2.0 * pi * (r_1 + r_2)
    return turned + 2.0 * pi * floor((r_1 * (q_1 - turned) + r_2 * (q_2 - turned)) / whole + 0.5)


@compiled
def nearest_teeth(law, pitch, lead):
    """The lead [m] of the teeth that lie nearest to each other, of bodies whose whole turns are unknown."""
    middle = -0.5 * law[BACKLASH] if law[BACKLASH] < pitch else 0.0
    return lead - pitch * floor((lead - middle) / pitch + 0.5)


@compiled(forceinline=True)
def meeting(law, frame, q_1, q_2):
    """The flank of two Rxyz bodies that is nearest to contact, and where it lies.

    (lead, opening) [m], (side, deflection [m], phase), (e_r (2), a, r_w1 [m]), n (3), offsets (3), both bodies as
    `placed`.
    """
    d, r_1, r_2, tan_b = frame[DIRECTION], frame[R_B1], frame[R_B2], frame[TAN_BETA_B]
    x, y, distance, axial = line_of_centres(frame, q_1, q_2)
    if r_2 < 0.0:
        x, y, distance = -x, -y, -distance
    if not (r_1 + r_2) / distance < 1.0:
        raise ValueError(abs(distance), abs(r_1 + r_2))
    turned = atan2(frame[E_X] * y - frame[E_Y] * x, frame[E_X] * x + frame[E_Y] * y)
    turned = unwound(d, r_1, r_2, q_1[5], q_2[5], turned)
    alpha = acos((r_1 + r_2) / distance)
    r_w = r_1 / cos(alpha)
    opening = (r_1 + r_2) * (compiled_involute(alpha) - frame[INV_0])
    raised = height(frame, q_1, q_2, (x, y), r_w) - frame[HEIGHT]
    lead = d * (r_1 * (q_1[5] - turned) + r_2 * (q_2[5] - turned) - tan_b * raised)
    if frame[BASE_PITCH] != 0.0:
        lead = nearest_teeth(law, frame[BASE_PITCH], lead)
    pitch = d * frame[TURNS] * (q_1[5] - turned) + frame[PHASE]
    side, deflection, phase = flank_of(law, lead, opening, pitch)
    side_d = side * d
    n = (-side_d * cos(alpha) * y + sin(alpha) * x, side_d * cos(alpha) * x + sin(alpha) * y, -side_d * tan_b)
    one, other = placed(frame, REFERENCE_1, frame[AXIAL_1], q_1), placed(frame, REFERENCE_2, frame[AXIAL_2], q_2)
    misalignment = side_d * (n[0] * (other[3][0] - one[3][0]) + n[1] * (other[3][1] - one[3][1]))
    offsets = (distance, misalignment, side_d * axial)
    return (lead, opening), (side, deflection, phase), (x, y, distance, r_w), n, offsets, (one, other)


@kept
def at_rest(law, frame):
    """Deflection [m], opening of either flank [m] and phase of the driving one in the reference configuration."""
    none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    leads, flank, _, _, _, _ = meeting(law, frame, none, none)
    (lead, opening), (side, _, phase) = leads, flank
    return lead - opening, opening, phase if side > 0.0 else law[BACK_PHASE] - phase


@kept
def offsets_at(law, frame, q_1, q_2):
    """Offsets (3) as the map counts them of two Rxyz bodies with displacements q (6)."""
    _, _, _, _, offsets, _ = meeting(law, frame, q_1, q_2)
    return offsets


@compiled
def spatial_mesh(law, frame, q_1, q_2, v_1, v_2):
    """(deflection [m], force [N], generalized forces (6), (6), offsets (3), centroid [m]) of two Rxyz bodies.

    Offsets and centroid as `Recorder` says, along z.
    """
    leads, (side, deflection, phase), (x, y, distance, r_w), n, offsets, bodies = meeting(law, frame, q_1, q_2)
    (pole_1, a_1, b_1, z_1, centre_1), (pole_2, a_2, b_2, _, _) = bodies
    side_d = side * frame[DIRECTION]
    penetration = force = centroid = turning = 0.0
    if side_d != 0.0:
        penetration, force, centroid, turning = static_force(law, phase, deflection, *offsets)
    contact = (centre_1[0] + r_w * x, centre_1[1] + r_w * y, centre_1[2] + side_d * centroid)
    row_1, row_2 = row_of(pole_1, contact, n, a_1, b_1), row_of(pole_2, contact, n, a_2, b_2)
    held_back = dot(frame[LAG_1:LAG_2], v_1) + dot(frame[LAG_2:MOBILITY], v_2)
    rate, passing = dot(row_1, v_1) - dot(row_2, v_2) + side * held_back, side_d * frame[TURNS] * v_1[5]
    c = damping(law, penetration)
    if c > 0.0:
        if frame[LAG] != 0.0:
            _, later, _, _ = static_force(law, phase + INSTANT * passing, deflection + INSTANT * rate, *offsets)
            seated = (dot(frame[LAG_1:LAG_2], q_1) + dot(frame[LAG_2:MOBILITY], q_2)) / frame[LAG]
            rise, excess = (later - force) / INSTANT, force + side * (seated - frame[HELD])
            mobility = frame[MOBILITY] if side > 0.0 else 0.0
            rate = caught_up(rate, frame[LAG], mobility, rise, excess, c)
        force += c * rate
    one, other = scaled(row_1, -force), scaled(row_2, force)
    if turning != 0.0:
        torque, far = (
            side_d * frame[TURNS] * turning,
            (centre_1[0] + distance * x, centre_1[1] + distance * y, centre_1[2]),
        )
        e_t = (-y, x, 0.0)
        one = added(one, scaled(row_of(pole_1, centre_1, e_t, a_1, b_1), -torque / distance))
        one = added(one, (0.0, 0.0, 0.0, 0.0, -sin(a_1) * torque, -z_1[2] * torque))
        other = added(other, scaled(row_of(pole_2, far, e_t, a_2, b_2), torque / distance))
    along_z = offsets[0], side_d * offsets[1], side_d * offsets[2]
    return leads[0] - leads[1], side * force, one, other, along_z, side_d * centroid


def phase_of(frame: np.ndarray, spin: float) -> float:
    """Phase in [0, 1) where the pinion has turned by spin [rad] and the centres rest."""
    turned = frame[DIRECTION] * frame[TURNS] * spin + frame[PHASE]
    return turned - floor(turned)


def rotational_row(frame: np.ndarray) -> np.ndarray:
    """Row (2): deflection = row . coordinates."""
    return frame[DIRECTION] * frame[[R_B1, R_B2]]


def spatial_row(frame: np.ndarray) -> np.ndarray:
    """Row (12) of the driving flank in the reference configuration, at mid-plane."""
    none = (0.0,) * 6
    x, y, distance, _ = line_of_centres(frame, none, none)
    x, y, distance = (-x, -y, -distance) if frame[R_B2] < 0 else (x, y, distance)
    pole_1, a_1, b_1, _, centre_1 = placed(frame, REFERENCE_1, frame[AXIAL_1], none)
    pole_2, a_2, b_2, _, _ = placed(frame, REFERENCE_2, frame[AXIAL_2], none)
    alpha, d = acos((frame[R_B1] + frame[R_B2]) / distance), frame[DIRECTION]
    c, s, r_w = d * cos(alpha), sin(alpha), frame[R_B1] / cos(alpha)
    n = (-c * y + s * x, c * x + s * y, -d * frame[TAN_BETA_B])
    contact = (centre_1[0] + r_w * x, centre_1[1] + r_w * y, centre_1[2])
    return np.r_[row_of(pole_1, contact, n, a_1, b_1), -np.array(row_of(pole_2, contact, n, a_2, b_2))]
