"""Relative position of two gears from body coordinates, and its exact derivatives by virtual work.

The measures are those of two axes z_1, z_2 in space: L runs from the pinion's centre to the wheel's axis in the
pinion's mid-plane, the pitch point lies on it. They do not change when the pair moves as a rigid body, so that action
equals reaction, and their derivatives are exact, so that a potential of them conserves energy. Exact for involutes
whose axes stay parallel, at any centre distance and position of the centres, also when they orbit each other; first
order in the angle between the axes.

A ring gear has a negative base radius and centre distance (ISO 21771), so that e_r points away from its axis. For
direction +1 the deflection is positive where the pinion leads counter-clockwise. With side = direction on the
driving and -direction on the back flank, the line of action is n = side cos(alpha) e_t + sin(alpha) e_r -
side tan(beta_b) z_1, with e_t = z_1 x e_r.

Offsets as in `fem.Offsets`: the centre distance is that in the pinion's mid-plane, the misalignment the angle of the
axes in the plane of action by which the gap opens along side z_1, the axial offset that of the wheel.
"""

from math import atan2, cos, floor, pi, sin, sqrt
from typing import NamedTuple

from exugear.contact.vectors import cross, dot, scaled, total
from fem.support.numba_cache import compiled

#: Difference of the advance of two equal states, over the base pitch.
SAME_STATE = 1e-3
Vector = tuple[float, float, float]
Row = tuple[float, float, float, float, float, float]


class Pose(NamedTuple):
    """Body of a gear: axes x, y, z of the body without its spin, vector from its pole to the gear's centre [m]."""

    x: Vector
    y: Vector
    z: Vector
    arm: Vector
    centre: Vector


class Flank(NamedTuple):
    """The flank nearest to contact: +1 driving or -1 back flank, its deflection [m] and its phase."""

    side: float
    deflection: float
    phase: float


class Position(NamedTuple):
    """Relative position of two gears, with the poses of their bodies.

    advance          by which the pinion is ahead, along the line of action [m]
    opening          gap of either flank by a larger centre distance [m]
    flank            nearest to contact
    phase            of the driving flank
    line             L, from the pinion's centre to the wheel's axis in the pinion's mid-plane [m]
    distance         centre distance [m]; < 0 for rings
    e_r, e_t         unit vectors along and across L
    shift            position on the wheel's axis of the end of L, from the wheel's centre [m]
    lean             z_1 . z_2, e_r . z_2, e_t . z_2
    raised           height of the pinion's mid-plane over the wheel's at the pitch point [m]
    sine, cosine     of the working pressure angle
    offsets          a [m], misalignment [rad], axial [m] as the map counts them
    """

    advance: float
    opening: float
    flank: Flank
    phase: float
    line: Vector
    distance: float
    e_r: Vector
    e_t: Vector
    shift: float
    lean: Vector
    raised: float
    sine: float
    cosine: float
    offsets: Vector
    pinion: Pose
    wheel: Pose


class Slopes(NamedTuple):
    """Derivatives of a function of the relative position by its measures.

    Angles of pinion and wheel about their axes against L, height, centre distance, e_r . z_2, e_t . z_2, axial offset
    along z_1.
    """

    pinion_angle: float
    wheel_angle: float
    raised: float
    distance: float
    lean_r: float
    lean_t: float
    axial: float


@compiled
def pose_of(gear, q):
    """Pose of a gear's body with displacements q (6)."""
    reference = gear.reference
    a, b = reference[3] + q[3], reference[4] + q[4]
    sin_a, cos_a, sin_b, cos_b = sin(a), cos(a), sin(b), cos(b)
    x, y, z = (cos_b, sin_a * sin_b, -cos_a * sin_b), (0.0, cos_a, sin_a), (sin_b, -sin_a * cos_b, cos_a * cos_b)
    arm = scaled(gear.axial, z)
    centre = reference[0] + q[0] + arm[0], reference[1] + q[1] + arm[1], reference[2] + q[2] + arm[2]
    return Pose(x, y, z, arm, centre)


@compiled
def line_of_centres(frame, pinion, wheel):
    """(L, centre distance, shift) of two poses."""
    between = total(wheel.centre, scaled(-1.0, pinion.centre))
    shift = -dot(pinion.z, between) / dot(pinion.z, wheel.z)
    line = total(between, scaled(shift, wheel.z))
    length = sqrt(dot(line, line))
    return line, length if frame.wheel.r_b > 0.0 else -length, shift


@compiled
def pitch_share(frame):
    """Share of L from the pinion's centre to the pitch point."""
    return frame.pinion.r_b / (frame.pinion.r_b + frame.wheel.r_b)


@compiled
def height(frame, pinion, wheel, line, shift):
    """Height of the pinion's mid-plane over the wheel's at the pitch point, along z_1 [m]."""
    return (shift - (1.0 - pitch_share(frame)) * dot(wheel.z, line)) / dot(pinion.z, wheel.z)


@compiled
def angles_of_line(frame, pinion, wheel, e_r):
    """Angles [rad] of e_r about the axes of pinion and wheel, from its direction in the reference configuration."""
    x_1, y_1, x_2, y_2 = dot(e_r, pinion.x), dot(e_r, pinion.y), dot(e_r, wheel.x), dot(e_r, wheel.y)
    angle = atan2(frame.e_x * y_1 - frame.e_y * x_1, frame.e_x * x_1 + frame.e_y * y_1)
    return angle, angle + atan2(x_1 * y_2 - y_1 * x_2, x_1 * x_2 + y_1 * y_2) - frame.wheel_angle


@compiled
def whole_turns(frame, spin_1, spin_2):
    """Whole turns [rad] of the line of centres, for which |advance| is far below that of a whole turn."""
    r_1, r_2 = frame.pinion.r_b, frame.wheel.r_b
    return 2.0 * pi * floor((r_1 * spin_1 + r_2 * spin_2) / (2.0 * pi * (r_1 + r_2)) + 0.5)


@compiled
def flank_of(table, advance, opening, phase):
    """The flank nearest to contact, by the advance of the pinion [m], the opening [m] and the driving flank's phase."""
    if advance >= -0.5 * table.backlash:
        return Flank(1.0, advance - opening, phase)
    return Flank(-1.0, -(advance + table.backlash) - opening, table.back_phase - phase)


@compiled
def remembered_advance(table, pitch, advance, before):
    """Advance [m] where it is known up to whole base pitches [m].

    Teeth with a back flank cannot pass each other: the advance is that of the teeth which are nearest to contact.
    Others may have separated by any number of pitches: then it is the one nearest to that of the call before [m], and
    the one nearest to contact in the first call.

    before   advance in the call before [m], and whether this call begins a solve: another state than that at the end
             of the solve before is then a new start
    """
    last, begins = before
    near = advance - pitch * floor((advance - last) / pitch + 0.5)
    if table.backlash < pitch:
        return advance - pitch * floor((advance + 0.5 * table.backlash) / pitch + 0.5)
    if begins > 0.0 and abs(near - last) > SAME_STATE * pitch:
        return advance - pitch * floor(advance / pitch + 0.5)
    return near


@compiled(forceinline=True)
def position_of(table, frame, q_1, q_2, before=(0.0, 1.0)):
    """`Position` of two Rxyz bodies; ValueError(distance, least distance) where no involutes can meet.

    before   as for `remembered_advance`
    """
    d, r_1, r_2 = frame.direction, frame.pinion.r_b, frame.wheel.r_b
    pinion, wheel = pose_of(frame.pinion, q_1), pose_of(frame.wheel, q_2)
    line, distance, shift = line_of_centres(frame, pinion, wheel)
    cosine = (r_1 + r_2) / distance
    if not cosine < 1.0:
        raise ValueError(abs(distance), abs(r_1 + r_2))
    sine = sqrt(1.0 - cosine * cosine)
    e_r = scaled(1.0 / distance, line)
    e_t = cross(pinion.z, e_r)
    angle_1, angle_2 = angles_of_line(frame, pinion, wheel, e_r)
    turns = whole_turns(frame, q_1[5] - angle_1, q_2[5] - angle_2)
    spin_1, spin_2 = q_1[5] - angle_1 - turns, q_2[5] - angle_2 - turns
    raised = height(frame, pinion, wheel, line, shift)
    advance = d * (r_1 * spin_1 + r_2 * spin_2 - frame.tan_beta_b * (raised - frame.height)) - frame.gap
    if frame.base_pitch != 0.0:
        advance = remembered_advance(table, frame.base_pitch, advance, before)
    # the involute of the working pressure angle: its tangent is known, and takes 10 ns to compute
    opening = (r_1 + r_2) * (sine / cosine - atan2(sine, cosine) - frame.inv_alpha_wt)
    phase = d * frame.pitches_per_radian * spin_1 + frame.phase
    flank = flank_of(table, advance, opening, phase)
    lean = dot(pinion.z, wheel.z), dot(e_r, wheel.z), dot(e_t, wheel.z)
    side = flank.side * d
    offsets = distance, cosine * lean[2] + side * sine * lean[1], -side * shift * lean[0]
    to_line = line, distance, e_r, e_t, shift
    return Position(advance, opening, flank, phase, *to_line, lean, raised, sine, cosine, offsets, pinion, wheel)


@compiled
def normal_of(frame, position):
    """Direction n of the line of action of the flank, with the transverse length 1."""
    side = position.flank.side * frame.direction
    transverse = total(scaled(side * position.cosine, position.e_t), scaled(position.sine, position.e_r))
    return total(transverse, scaled(-side * frame.tan_beta_b, position.pinion.z))


@compiled
def deflection_slopes(frame, position, force, phase_moment, by_offsets):
    """`Slopes` of a potential, from its derivatives by deflection, phase and offsets (3)."""
    side, sine, cosine = position.flank.side * frame.direction, position.sine, position.cosine
    by_a, by_misalignment, by_axial = by_offsets
    turn = cosine / (position.distance * sine)
    rotated = side * cosine * position.lean[1] - sine * position.lean[2]
    return Slopes(
        side * (force * frame.pinion.r_b + phase_moment * frame.pitches_per_radian),
        side * force * frame.wheel.r_b,
        -side * force * frame.tan_beta_b,
        by_a - force * sine + by_misalignment * rotated * turn,
        by_misalignment * side * sine,
        by_misalignment * cosine,
        by_axial * side,
    )


@compiled(forceinline=True)
def gradient(frame, p, s):
    """Derivatives (6), (6) of a function of the relative position p by the coordinates of pinion and wheel.

    s   its `Slopes` by the measures of the relative position
    """
    z_1, z_2, line, (parallel, lean_r, lean_t) = p.pinion.z, p.wheel.z, p.line, p.lean
    d, along = p.distance, p.distance * lean_r
    across = d * d - along * along
    turn_1, turn_2 = s.pinion_angle / (d * d), s.wheel_angle / across
    tilting = s.lean_r / d - s.raised * (1.0 - pitch_share(frame)) / parallel
    radial = (s.distance - (s.lean_r * lean_r + s.lean_t * lean_t) / d) / d
    by_line = total(
        total(scaled(-turn_1, cross(z_1, line)), scaled(-turn_2, cross(z_2, line))),
        total(total(scaled(radial, line), scaled(tilting, z_2)), scaled(s.lean_t / d, cross(z_2, z_1))),
    )
    by_parallel = -(s.raised * p.raised / parallel + s.axial * p.shift)
    push = (s.raised / parallel - s.axial * parallel + dot(by_line, z_2)) / parallel
    by_centre = total(by_line, scaled(-push, z_1))
    by_z_1 = total(total(scaled(s.lean_t / d, cross(line, z_2)), scaled(by_parallel, z_2)), scaled(-push, line))
    by_z_2 = total(
        total(scaled(tilting, line), scaled(s.lean_t / d, cross(z_1, line))),
        total(scaled(by_parallel - push * p.shift, z_1), scaled(p.shift, by_line)),
    )
    moment_1 = total(scaled(s.pinion_angle, z_1), cross(z_1, by_z_1))
    spin_2 = total(scaled(turn_2 * d * d, z_2), scaled(-turn_2 * along, line))
    moment_2 = total(spin_2, cross(z_2, by_z_2))
    return row_of(p.pinion, scaled(-1.0, by_centre), moment_1), row_of(p.wheel, by_centre, moment_2)


@compiled
def row_of(body, force, moment):
    """Row (6) of an Rxyz body for a force in the gear's centre and a moment (3), by virtual work."""
    m = total(moment, cross(body.arm, force))
    return force[0], force[1], force[2], m[0], dot(body.y, m), dot(body.z, m)
