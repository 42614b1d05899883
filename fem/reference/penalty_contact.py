"""Penalty contact of two flanks with Coulomb friction in compiled loops, for linear elements in plane strain.

With the weighted gaps g_i and the area A_i of hat function i as in `fem.reference.mortar`,

    pressure p_i = penalty max(-g_i, 0),    friction |q_i| <= mu p_i,  dq_i/dt = penalty (slip rate) while it sticks;

and slides where it would exceed mu p_i (return mapping: Wriggers, Computational Contact Mechanics, 2006).
Vectors are pairs of numbers in the frame of the master gear, unless they belong to the nodes of the slave.
"""

from typing import NamedTuple

import numpy as np

from fem.gear.tooth_profile import tangent_angle
from fem.reference.deformable_gear import DeformableGear
from fem.reference.deformed_flank import FlankCurve, closest_arc, cubic, curve_point, interval_of, involute_point
from fem.reference.mortar import MatingGears
from fem.support.numba_cache import compiled, fast

#: Positions in [0, 1] and weights of the Gauss points in an interval between nodes.
GAUSS = tuple((float(p + 1) / 2, float(w) / 2) for p, w in zip(*np.polynomial.legendre.leggauss(4), strict=True))
#: Intervals of the table of removed material.
RELIEF_INTERVALS = 2000
#: Contact stiffness on a node is at most this times penalty times its area, as a slave or under a master's spline.
STIFFNESS_BOUND = 3.0

#: A point of the slave and the closest point of the master: interval between nodes of the slave's profile and share of
#: that interval, area [m^2], gap [m], arc length on the master [m], directions of push and slide, levers about the
#: centres of both gears [m].
CONTACT_POINT = np.dtype(
    [
        ("interval", np.int64),
        *((name, np.float64) for name in ("share", "area", "gap", "arc")),
        *((f"{name}_{axis}", np.float64) for name in ("push", "slide", "slave_arm", "master_arm") for axis in "xy"),
    ]
)


class FlankArrays(NamedTuple):
    """Flanks of a gear as arrays.

    r_b, b          base radius and face width [m]
    start_angles    (n_tooth,) angles of the tangents where the involutes begin [rad]
    arcs            (n,) arc lengths of the nodes [m]
    nodes           (n_tooth, n) numbers of the nodes
    polynomials     (n, n - 1, 4) coefficients of `Flank.polynomials`
    relief          (m,) material removed at equidistant arc lengths [m]
    """

    r_b: float
    b: float
    start_angles: np.ndarray
    arcs: np.ndarray
    nodes: np.ndarray
    polynomials: np.ndarray
    relief: np.ndarray


class MovingGear(NamedTuple):
    """Flanks, displacements and velocities (n_dofs, 2) in the hub's frame, forces to add to, spin [rad/s]."""

    flanks: FlankArrays
    u: np.ndarray
    v: np.ndarray
    force: np.ndarray
    spin: float


class ToothPair(NamedTuple):
    """Slave gear (0: pinion), positions of both teeth among the flanks, first and last hat function that may touch."""

    slave: int
    slave_tooth: int
    master_tooth: int
    first_hat: int
    last_hat: int


class RelativePose(NamedTuple):
    """Centre (x, y) [m] and angle [rad] of the slave in the frame of the master."""

    x: float
    y: float
    angle: float


class ContactLaw(NamedTuple):
    """Penalty [Pa/m], coefficient of friction, time step [s]."""

    penalty: float
    friction: float
    step: float


def flank_arrays(gear: DeformableGear) -> FlankArrays:
    """Flanks of a gear of linear elements, whose teeth are all equal."""
    flank = gear.flanks[0]
    arcs, macro = flank.arcs, flank.gear
    start_angles = np.array([tangent_angle(macro, 0.0, tooth) for tooth in gear.flanks])
    nodes = np.stack([flank.nodes[:, 0] for flank in gear.flanks.values()])
    relief = flank.removed(np.linspace(arcs[0], arcs[-1], RELIEF_INTERVALS + 1)[:, None])[:, 0]
    return FlankArrays(macro.r_b, macro.b, start_angles, arcs, nodes, flank.polynomials, relief)


def contact_stiffness_bound(gear: DeformableGear, penalty: float) -> np.ndarray:
    """(n_dofs,) largest stiffness that contact may have on each node [N/m]."""
    bound = np.zeros(len(gear.solid.positions))
    for flank in gear.flanks.values():
        size = np.diff(flank.arcs)
        area = flank.gear.b * (np.append(size, 0) + np.append(0, size)) / 2
        bound[flank.nodes[:, 0]] += STIFFNESS_BOUND * penalty * area
    return bound


def tooth_pair_table(mating: MatingGears, phase: float, te: float = 0.0) -> np.ndarray:
    """(n, 5) fields of a `ToothPair` for each contact candidate."""
    table = []
    for candidate in mating.candidates(phase, te):
        slave, nodes = candidate.slave, candidate.quadrature.nodes
        teeth = [list(mating.gears[side].flanks).index(candidate.teeth[side]) for side in (slave, 1 - slave)]
        table.append((slave, *teeth, nodes[0], nodes[-1]))
    return np.array(table, dtype=np.int64).reshape(-1, 5)


@compiled(fastmath=True)
def _polynomials(flanks, tooth, values):
    """(n - 1, 2, 4) cubics of nodal values (n_dofs, 2) along a flank."""
    n = flanks.arcs.size
    coefficients = np.zeros((n - 1, 2, 4))
    for a in range(n):
        x, y = values[flanks.nodes[tooth, a], 0], values[flanks.nodes[tooth, a], 1]
        for i in range(n - 1):
            for k in range(4):
                coefficients[i, 0, k] += flanks.polynomials[a, i, k] * x
                coefficients[i, 1, k] += flanks.polynomials[a, i, k] * y
    return coefficients


@compiled(fastmath=True)
def _relief(flanks, arc):
    """Material removed and its slope, linear in the table."""
    step = (flanks.arcs[-1] - flanks.arcs[0]) / (flanks.relief.size - 1)
    position = (arc - flanks.arcs[0]) / step
    i = min(max(int(position), 0), flanks.relief.size - 2)
    change = flanks.relief[i + 1] - flanks.relief[i]
    return flanks.relief[i] + (position - i) * change, change / step


@compiled(fastmath=True)
def _fill_contact(flanks, curve, x, y, point):
    """Fill gap, arc, directions and the master's arm of a contact point at (x, y)."""
    point.arc = closest_arc(curve, x, y)
    foot_x, foot_y, tx, ty, sx, sy = curve_point(curve, point.arc)
    size = np.hypot(tx, ty)
    nx, ny = -ty / size, tx / size
    distance = nx * (x - foot_x) + ny * (y - foot_y)
    removed, slope = _relief(flanks, point.arc)
    along = slope / (size * size - distance * (nx * sx + ny * sy))
    point.gap = distance + removed
    point.push_x, point.push_y = nx + along * tx, ny + along * ty
    point.slide_x, point.slide_y = tx / size, ty / size
    point.master_arm_x, point.master_arm_y = foot_x, foot_y


@compiled(fastmath=True)
def _contact_points(slave, master, tooth_pair, pose):
    """(n,) CONTACT_POINTs, four in each interval of the slave's profile that a hat function covers."""
    flanks, tooth = slave.flanks, tooth_pair.slave_tooth
    c, s, nodes, start_angle = np.cos(pose.angle), np.sin(pose.angle), flanks.nodes[tooth], flanks.start_angles[tooth]
    displacement = _polynomials(master.flanks, tooth_pair.master_tooth, master.u)
    master_angle = master.flanks.start_angles[tooth_pair.master_tooth]
    curve = FlankCurve(master.flanks.r_b, master_angle, master.flanks.arcs, displacement)
    left, right = max(tooth_pair.first_hat - 1, 0), min(tooth_pair.last_hat + 1, flanks.arcs.size - 1)
    points = np.zeros(4 * (right - left), CONTACT_POINT)
    for row in range(len(points)):
        i, point = left + row // 4, points[row]
        share, weight = GAUSS[row % 4]
        size = flanks.arcs[i + 1] - flanks.arcs[i]
        arc = flanks.arcs[i] + share * size
        x, y, _, _, _ = involute_point(flanks.r_b, start_angle, arc)
        x += (1 - share) * slave.u[nodes[i], 0] + share * slave.u[nodes[i + 1], 0]
        y += (1 - share) * slave.u[nodes[i], 1] + share * slave.u[nodes[i + 1], 1]
        point.slave_arm_x, point.slave_arm_y = c * x - s * y, s * x + c * y
        point.interval, point.share, point.area = i, share, weight * size * flanks.b
        _fill_contact(master.flanks, curve, point.slave_arm_x + pose.x, point.slave_arm_y + pose.y, point)
        point.gap += _relief(flanks, arc)[0]
    return points


@compiled(fastmath=True)
def _slip_rates(slave, master, tooth_pair, angle, points):
    """(n,) velocities of the slave's points along the master's flank, relative to the master [m/s]."""
    rates, c, s = np.zeros(len(points)), np.cos(angle), np.sin(angle)
    nodes = slave.flanks.nodes[tooth_pair.slave_tooth]
    velocity = _polynomials(master.flanks, tooth_pair.master_tooth, master.v)
    for row in range(len(points)):
        point = points[row]
        share, v_left, v_right = point.share, slave.v[nodes[point.interval]], slave.v[nodes[point.interval + 1]]
        vx, vy = (1 - share) * v_left[0] + share * v_right[0], (1 - share) * v_left[1] + share * v_right[1]
        j = interval_of(master.flanks.arcs, point.arc)
        t = point.arc - master.flanks.arcs[j]
        wx, wy = cubic(velocity[j, 0], t)[0], cubic(velocity[j, 1], t)[0]
        relative_x = c * vx - s * vy - wx - slave.spin * point.slave_arm_y + master.spin * point.master_arm_y
        relative_y = s * vx + c * vy - wy + slave.spin * point.slave_arm_x - master.spin * point.master_arm_x
        rates[row] = relative_x * point.slide_x + relative_y * point.slide_y
    return rates


@compiled(fastmath=True)
def _means(tooth_pair, points, values, n):
    """(n,) means of values at the points over the hat functions, and areas of these."""
    mean, area = np.zeros(n), np.zeros(n)
    for row in range(len(points)):
        point = points[row]
        for k in range(2):
            hat = point.interval + k
            if tooth_pair.first_hat <= hat <= tooth_pair.last_hat:
                part = point.area * (point.share if k else 1 - point.share)
                mean[hat] += part * values[row]
                area[hat] += part
    return mean / np.maximum(area, 1e-300), area


@fast
def add_contact_forces(slave, master, tooth_pair, pose, law, friction):
    """Add the contact forces of two teeth to `force` of slave and master (`MovingGear`).

    friction    (n_hat,) friction of the step before [Pa], overwritten by the present one

    Returns torques on slave and master [N m], stored energy [J], power lost by slip [W].
    """
    n = slave.flanks.arcs.size
    points = _contact_points(slave, master, tooth_pair, pose)
    gap, area = _means(tooth_pair, points, points.gap, n)
    pressure = law.penalty * np.maximum(-gap, 0.0)
    energy, lost_power = (area * pressure**2).sum() / (2 * law.penalty), 0.0
    if law.friction > 0:
        rates = _slip_rates(slave, master, tooth_pair, pose.angle, points)
        slip, area = _means(tooth_pair, points, rates, n)
        limit = law.friction * pressure
        friction[:] = np.minimum(np.maximum(friction + law.penalty * law.step * slip, -limit), limit)
        lost_power = (area * friction * slip).sum()
    if pressure.max() == 0:
        return 0.0, 0.0, energy, lost_power
    slave_torque, master_torque = _add_tractions(slave, master, tooth_pair, pose.angle, points, (pressure, friction))
    return slave_torque, master_torque, energy, lost_power


@compiled(fastmath=True)
def _add_tractions(slave, master, tooth_pair, angle, points, tractions):
    """Add forces of pressure and friction (n_hat,) to the nodes of both gears; torques on both."""
    c, s, nodes = np.cos(angle), np.sin(angle), slave.flanks.nodes[tooth_pair.slave_tooth]
    (pressure, friction), slave_torque, master_torque = tractions, 0.0, 0.0
    moments = np.zeros((2, master.flanks.arcs.size - 1, 4))
    for row in range(len(points)):
        point = points[row]
        i, share = point.interval, point.share
        p = point.area * ((1 - share) * pressure[i] + share * pressure[i + 1])
        q = point.area * ((1 - share) * friction[i] + share * friction[i + 1])
        fx, fy = p * point.push_x - q * point.slide_x, p * point.push_y - q * point.slide_y
        slave_torque += point.slave_arm_x * fy - point.slave_arm_y * fx
        master_torque -= point.master_arm_x * fy - point.master_arm_y * fx
        for k, part in enumerate((1 - share, share)):
            slave.force[nodes[i + k], 0] += part * (c * fx + s * fy)
            slave.force[nodes[i + k], 1] += part * (c * fy - s * fx)
        _add_moments(master.flanks.arcs, point.arc, fx, fy, moments)
    for a in range(master.flanks.arcs.size):
        node = master.flanks.nodes[tooth_pair.master_tooth, a]
        master.force[node, 0] -= (master.flanks.polynomials[a] * moments[0]).sum()
        master.force[node, 1] -= (master.flanks.polynomials[a] * moments[1]).sum()
    return slave_torque, master_torque


@compiled(fastmath=True)
def _add_moments(arcs, arc, fx, fy, moments):
    """Add the force at an arc length times powers of the distance from the interval's start to (2, n - 1, 4)."""
    j = interval_of(arcs, arc)
    power = 1.0
    for k in range(3, -1, -1):
        moments[0, j, k] += power * fx
        moments[1, j, k] += power * fy
        power *= arc - arcs[j]
