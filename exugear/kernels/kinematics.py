"""Kinematics of an involute mesh: its deflection from body coordinates, generalized forces by the same rows.

Shafts run along z. e_r points from the pinion's to the wheel's axis in the pinion's mid-plane, e_t = z x e_r. A ring
gear has a negative base radius and a negative centre distance (ISO 21771), so that e_r points away from its axis.
For direction +1 the deflection is positive where the pinion leads counter-clockwise. With side = direction on
the driving and -direction on the back flank, the line of action is n = side cos(alpha) e_t + sin(alpha) e_r -
side tan(beta_b) e_z. F n pushes the wheel and -F n the pinion, in the pitch point at the force centroid. F is the
transverse force, which balances a torque F r_b1. Generalized forces are -F row, the rate is row . velocity (virtual
work). The force law counts z along side e_z, `exugear.kernels.recorder.Recorder` along e_z.

Offsets as in `fem.Offsets`: the centre distance is that in the pinion's mid-plane, the misalignment the angle of the
axes in the plane of action by which the gap opens along side e_z, the axial offset that of the wheel.
Exact for involutes whose axes stay parallel, at any centre distance and position of the centres, also when they orbit
each other; first order in the tilts.
"""

from math import acos, atan2, cos, floor, pi, sin, sqrt
from typing import NamedTuple

from exugear.force_table.force_kernels import NO_CONTACT, corrected_rate, damping, spinning_force, static_force
from fem.gear.involute import involute
from fem.support.numba_cache import compiled

compiled_involute = compiled(involute)
#: Time over which the derivative of the static force is taken by a difference [s].
INSTANT = 1e-9
#: Displacements of a body in its reference configuration.
AT_REFERENCE = (0.0,) * 6
Vector = tuple[float, float, float]
Row = tuple[float, float, float, float, float, float]


class Pose(NamedTuple):
    """Body of a gear: absolute position of its pole [m], tilts [rad], direction of the axis, centre of the gear [m]."""

    pole: Vector
    a: float
    b: float
    axis: Vector
    centre: Vector


class Line(NamedTuple):
    """Line of centres: e_r, centre distance in the pinion's mid-plane [m] (< 0 for rings), axial offset [m]."""

    e_r: tuple[float, float]
    distance: float
    axial: float


class Flank(NamedTuple):
    """The flank nearest to contact: +1 driving or -1 back flank, its deflection [m] and its phase."""

    side: float
    deflection: float
    phase: float


class Position(NamedTuple):
    """Relative position of two gears, with the poses of their bodies.

    lead      by which the pinion is ahead, along the line of action [m]
    opening   gap of either flank by a larger centre distance [m]
    flank     nearest to contact
    line      of centres
    r_w       working pitch radius of the pinion [m]
    normal    direction n of the line of action
    offsets   a [m], misalignment [rad], axial [m] as the map counts them
    """

    lead: float
    opening: float
    flank: Flank
    line: Line
    r_w: float
    normal: Vector
    offsets: Vector
    pinion: Pose
    wheel: Pose


class MeshForces(NamedTuple):
    """Deflection [m], mesh force [N], generalized forces; offsets and force centroid [m] signed as in `Recorder`.

    position       of the gears
    static_force   of the flank in contact, without damping [N]
    """

    deflection: float
    force: float
    pinion: Row
    wheel: Row
    offsets: Vector
    centroid: float
    position: Position
    static_force: float


class SpinForces(NamedTuple):
    """Deflection [m], mesh force [N], torques (2) [N m]; phase of the flank in contact and its static force [N]."""

    deflection: float
    force: float
    torques: tuple[float, float]
    phase: float
    static_force: float


@compiled
def spin_axis(a, b):
    """Rx(a) Ry(b) e_z: the body's z axis."""
    return sin(b), -sin(a) * cos(b), cos(a) * cos(b)


@compiled
def cross(a, b):
    """a x b of tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def row_of(body, point, n):
    """Row (6) of an Rxyz body for a unit force n in a point: [n, G^T ((point - pole) x n)]."""
    pole, a, z = body.pole, body.a, body.axis
    m = cross((point[0] - pole[0], point[1] - pole[1], point[2] - pole[2]), n)
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
def added(a, b):
    """Sum of two rows (6)."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@compiled
def flank_of(table, lead, opening, phase):
    """The flank nearest to contact, from the lead of the pinion [m], the opening [m] and the driving flank's phase."""
    if lead >= -0.5 * table.backlash:
        return Flank(1.0, lead - opening, phase)
    return Flank(-1.0, -(lead + table.backlash) - opening, table.back_phase - phase)


@compiled
def rotational_mesh(table, frame, state, q_1, q_2, v_1, v_2):
    """`SpinForces` of two rotational coordinates."""
    d, r_1, r_2, turns = frame.direction, frame.pinion.r_b, frame.wheel.r_b, frame.pitches_per_radian
    lead = d * (r_1 * q_1 + r_2 * q_2)
    if state.engaged == 0.0:
        return SpinForces(lead, 0.0, (0.0, 0.0), 0.0, 0.0)
    flank = flank_of(table, lead, 0.0, d * turns * q_1 + frame.phase)
    side, phase, deflection = flank.side, flank.phase, flank.deflection
    rate, phase_rate = side * d * (r_1 * v_1 + r_2 * v_2), side * d * turns * v_1
    static = spinning_force(table, phase, deflection)
    force, c = static.force, damping(table, static.penetration)
    if c > 0.0:
        if state.lag != 0.0:
            later = spinning_force(table, phase + INSTANT * phase_rate, deflection + INSTANT * rate)
            rise, excess = (later.force - force) / INSTANT, force - side * state.holding_force
            rate = corrected_rate(rate, state.lag, state.mobility, rise, excess, c)
        force += c * rate
    force, moment = side * force, side * d * static.phase_moment
    torques = -d * r_1 * force - turns * moment, -d * r_2 * force
    return SpinForces(lead, force, torques, phase, static.force)


@compiled
def pose_of(gear, q):
    """Pose of a gear's body with displacements q (6)."""
    x = gear.reference
    pole = (x[0] + q[0], x[1] + q[1], x[2] + q[2])
    a, b = x[3] + q[3], x[4] + q[4]
    z = spin_axis(a, b)
    return Pose(pole, a, b, z, (pole[0] + gear.axial * z[0], pole[1] + gear.axial * z[1], pole[2] + gear.axial * z[2]))


@compiled
def line_of_centres(frame, pinion, wheel):
    """From the pinion's centre to the wheel's axis in the pinion's mid-plane."""
    along = (pinion.centre[2] - wheel.centre[2]) / wheel.axis[2]
    x = wheel.centre[0] + along * wheel.axis[0] - pinion.centre[0]
    y = wheel.centre[1] + along * wheel.axis[1] - pinion.centre[1]
    distance = sqrt(x * x + y * y) if frame.wheel.r_b > 0.0 else -sqrt(x * x + y * y)
    return Line((x / distance, y / distance), distance, wheel.centre[2] - pinion.centre[2])


@compiled
def height(pinion, wheel, e_r, r_w):
    """z of the pinion's mid-plane minus z of the wheel's, at the pitch point [m]."""
    x, y = pinion.centre[0] + r_w * e_r[0], pinion.centre[1] + r_w * e_r[1]
    return mid_plane(pinion, x, y) - mid_plane(wheel, x, y)


@compiled
def mid_plane(body, x, y):
    """z of a gear's mid-plane at x, y [m]."""
    z, centre = body.axis, body.centre
    return centre[2] - (z[0] * (x - centre[0]) + z[1] * (y - centre[1])) / z[2]


@compiled
def rotation_of_line(frame, q_1, q_2, e_r):
    """Angle by which e_r has rotated [rad], with the whole turns for which |lead| is far below that of a whole turn."""
    r_1, r_2 = frame.pinion.r_b, frame.wheel.r_b
    angle = atan2(frame.e_x * e_r[1] - frame.e_y * e_r[0], frame.e_x * e_r[0] + frame.e_y * e_r[1])
    whole = 2.0 * pi * (r_1 + r_2)
    return angle + 2.0 * pi * floor((r_1 * (q_1[5] - angle) + r_2 * (q_2[5] - angle)) / whole + 0.5)


@compiled
def nearest_lead(table, pitch, lead):
    """Lead [m] of the teeth nearest to each other, for bodies whose whole turns are unknown; pitch: base pitch [m]."""
    middle = -0.5 * table.backlash if table.backlash < pitch else 0.0
    return lead - pitch * floor((lead - middle) / pitch + 0.5)


@compiled(forceinline=True)
def position_of(table, frame, q_1, q_2):
    """`Position` of two Rxyz bodies; ValueError(distance, least distance) where no involutes can meet."""
    d, r_1, r_2, tan_b = frame.direction, frame.pinion.r_b, frame.wheel.r_b, frame.tan_beta_b
    pinion, wheel = pose_of(frame.pinion, q_1), pose_of(frame.wheel, q_2)
    line = line_of_centres(frame, pinion, wheel)
    (x, y), distance = line.e_r, line.distance
    if not (r_1 + r_2) / distance < 1.0:
        raise ValueError(abs(distance), abs(r_1 + r_2))
    rotation = rotation_of_line(frame, q_1, q_2, line.e_r)
    alpha = acos((r_1 + r_2) / distance)
    r_w = r_1 / cos(alpha)
    opening = (r_1 + r_2) * (compiled_involute(alpha) - frame.inv_alpha_wt)
    raised = height(pinion, wheel, line.e_r, r_w) - frame.height
    lead = d * (r_1 * (q_1[5] - rotation) + r_2 * (q_2[5] - rotation) - tan_b * raised)
    if frame.base_pitch != 0.0:
        lead = nearest_lead(table, frame.base_pitch, lead)
    flank = flank_of(table, lead, opening, d * frame.pitches_per_radian * (q_1[5] - rotation) + frame.phase)
    side_d = flank.side * d
    n = (-side_d * cos(alpha) * y + sin(alpha) * x, side_d * cos(alpha) * x + sin(alpha) * y, -side_d * tan_b)
    misalignment = side_d * (n[0] * (wheel.axis[0] - pinion.axis[0]) + n[1] * (wheel.axis[1] - pinion.axis[1]))
    offsets = (distance, misalignment, side_d * line.axial)
    return Position(lead, opening, flank, line, r_w, n, offsets, pinion, wheel)


@compiled
def damped_force(table, state, position, static, phase_rate, rate, displacement_force):
    """Force [N] of a flank with its damping.

    phase_rate           time derivative of the phase [1/s]
    rate                 of the deflection [m/s]
    displacement_force   mesh force that the displaced bearings balance [N], times the lag [m/N]
    """
    force, c, flank = static.force, damping(table, static.penetration), position.flank
    if c <= 0.0:
        return force
    if state.lag != 0.0:
        phase, deflection = flank.phase + INSTANT * phase_rate, flank.deflection + INSTANT * rate
        later = static_force(table, phase, deflection, *position.offsets)
        excess = force + flank.side * (displacement_force / state.lag - state.holding_force)
        mobility = state.mobility if flank.side > 0.0 else 0.0
        rate = corrected_rate(rate, state.lag, mobility, (later.force - force) / INSTANT, excess, c)
    return force + c * rate


@compiled(forceinline=True)
def spatial_mesh(table, frame, state, q_1, q_2, v_1, v_2):
    """`MeshForces` of two Rxyz bodies."""
    position = position_of(table, frame, q_1, q_2)
    pinion, wheel, flank, (x, y) = position.pinion, position.wheel, position.flank, position.line.e_r
    side_d, static = flank.side * frame.direction, NO_CONTACT
    if state.engaged != 0.0:
        static = static_force(table, flank.phase, flank.deflection, *position.offsets)
    r_w, z = position.r_w, side_d * static.centroid
    point = (pinion.centre[0] + r_w * x, pinion.centre[1] + r_w * y, pinion.centre[2] + z)
    row_1, row_2 = row_of(pinion, point, position.normal), row_of(wheel, point, position.normal)
    lag = dot(state.pinion_lag, v_1) + dot(state.wheel_lag, v_2)
    rate, phase_rate = dot(row_1, v_1) - dot(row_2, v_2) + flank.side * lag, side_d * frame.pitches_per_radian * v_1[5]
    displacement_force = dot(state.pinion_lag, q_1) + dot(state.wheel_lag, q_2)
    force = damped_force(table, state, position, static, phase_rate, rate, displacement_force)
    forces_1, forces_2 = scaled(row_1, -force), scaled(row_2, force)
    if static.phase_moment != 0.0:
        torque = side_d * frame.pitches_per_radian * static.phase_moment
        moment_1, moment_2 = phase_torques(position, torque)
        forces_1, forces_2 = added(forces_1, moment_1), added(forces_2, moment_2)
    along_z = position.line.distance, side_d * position.offsets[1], side_d * position.offsets[2]
    deflection = position.lead - position.opening
    return MeshForces(deflection, flank.side * force, forces_1, forces_2, along_z, z, position, static.force)


@compiled
def phase_torques(position, torque):
    """Generalized forces (6), (6) of a conserving law's torque [N m] between the pinion and the line of centres."""
    pinion, wheel, (x, y), distance = position.pinion, position.wheel, position.line.e_r, position.line.distance
    opposite = (pinion.centre[0] + distance * x, pinion.centre[1] + distance * y, pinion.centre[2])
    e_t, push = (-y, x, 0.0), torque / distance
    on_pinion = scaled(row_of(pinion, pinion.centre, e_t), -push)
    spin = (0.0, 0.0, 0.0, 0.0, -sin(pinion.a) * torque, -pinion.axis[2] * torque)
    return added(on_pinion, spin), scaled(row_of(wheel, opposite, e_t), push)
