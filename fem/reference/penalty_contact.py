"""Contact of two flanks by penalty in compiled loops: mean gaps under hats as in `mortar`, Coulomb friction.

The pressure under a hat is penalty times its mean penetration; friction is a spring of the same stiffness that slips
where it exceeds friction times the pressure. Linear elements of plane strain; vectors are pairs of numbers.
"""

from typing import NamedTuple

import numpy as np

from fem.gear.tooth_profile import LEAST_ROLL
from fem.reference.deformable_gear import Body
from fem.support.numba_cache import fast

GAUSS = tuple((float(p + 1) / 2, float(w) / 2) for p, w in zip(*np.polynomial.legendre.leggauss(4), strict=True))
RELIEF_STEPS = 2000
#: Columns of a table of points of contact.
GAP, PUSH, SLIDE, ARM, FOOT, AREA, ARC, SHARE = 0, 1, 3, 5, 7, 9, 10, 11


class Teeth(NamedTuple):
    """Flanks of a gear.

    r_b, base   base radius [m]; angle where the involute of tooth 0 begins [rad]
    b           width [m]
    arcs        (n,) arc lengths of the nodes [m]
    nodes       (3, n) their numbers, and turn (3,) the angles of the teeth [rad]
    spline      (n, n - 1, 4) polynomials of `Flank.smooth`
    relief      (m,) material removed at equidistant arc lengths [m]
    """

    r_b: float
    base: float
    b: float
    arcs: np.ndarray
    nodes: np.ndarray
    turn: np.ndarray
    spline: np.ndarray
    relief: np.ndarray


class Side(NamedTuple):
    """A gear that touches: displacements, velocities (n_dofs, 2) in the hub's frame, forces to add to, spin [rad/s]."""

    teeth: Teeth
    u: np.ndarray
    v: np.ndarray
    force: np.ndarray
    spin: float


class Law(NamedTuple):
    """Penalty [Pa/m], coefficient of friction, time step [s]."""

    penalty: float
    friction: float
    step: float


def teeth_of(body: Body) -> Teeth:
    """Flanks of linear elements as arrays."""
    flank = body.flanks[0]
    arcs, gear = flank.arcs, flank.gear
    places = np.linspace(arcs[0], arcs[-1], RELIEF_STEPS + 1)
    nodes = np.stack([flank.nodes[:, 0] for flank in body.flanks.values()])
    turn = np.array([flank.turn for flank in body.flanks.values()])
    relief = flank.removed(places[:, None])[:, 0]
    return Teeth(gear.r_b, flank.base, gear.b, arcs, nodes, turn, flank.smooth.c.T.copy(), relief)


@fast
def _involute(teeth, tooth, arc):
    """Point, tangent and roll length."""
    roll = np.sqrt(2 * teeth.r_b * arc)
    angle = teeth.base + teeth.turn[tooth] - roll / teeth.r_b
    c, s = np.cos(angle), np.sin(angle)
    return teeth.r_b * c - roll * s, teeth.r_b * s + roll * c, c, s, roll


@fast
def _bent(teeth, tooth, u):
    """(n - 1, 2, 4) polynomials of the flank's displacement."""
    n = teeth.arcs.size
    found = np.zeros((n - 1, 2, 4))
    for a in range(n):
        x, y = u[teeth.nodes[tooth, a], 0], u[teeth.nodes[tooth, a], 1]
        for i in range(n - 1):
            for k in range(4):
                found[i, 0, k] += teeth.spline[a, i, k] * x
                found[i, 1, k] += teeth.spline[a, i, k] * y
    return found


@fast
def _cubic(p, t):
    """Value, slope and second derivative of a polynomial."""
    value, slope = p[3] + t * (p[2] + t * (p[1] + t * p[0])), p[2] + t * (2 * p[1] + 3 * t * p[0])
    return value, slope, 2 * p[1] + 6 * t * p[0]


@fast
def _interval(arcs, arc):
    return min(max(np.searchsorted(arcs, arc) - 1, 0), arcs.size - 2)


@fast
def _on_flank(teeth, tooth, bent, arc):
    """Point, derivative and second derivative over the arc length of a bent flank."""
    x, y, c, s, roll = _involute(teeth, tooth, arc)
    i = _interval(teeth.arcs, arc)
    t = arc - teeth.arcs[i]
    radius = max(roll, LEAST_ROLL * np.sqrt(2 * teeth.r_b * teeth.arcs[-1]))
    dx, slope_x, second_x = _cubic(bent[i, 0], t)
    dy, slope_y, second_y = _cubic(bent[i, 1], t)
    return x + dx, y + dy, c + slope_x, s + slope_y, s / radius + second_x, -c / radius + second_y


@fast
def _relief(teeth, arc):
    """Material removed and its slope."""
    step = (teeth.arcs[-1] - teeth.arcs[0]) / (teeth.relief.size - 1)
    share = (arc - teeth.arcs[0]) / step
    i = min(max(int(share), 0), teeth.relief.size - 2)
    slope = teeth.relief[i + 1] - teeth.relief[i]
    return teeth.relief[i] + (share - i) * slope, slope / step


@fast
def _meet(mate, tooth, bent, x, y, point):
    """Fills gap, push, slide, foot and arc of a point at (x, y) in the mate's frame."""
    low, high, r_b = mate.arcs[0], mate.arcs[-1], mate.r_b
    arc = min(max(((x * x + y * y) / r_b - r_b) / 2, low), high)
    for _ in range(3):
        fx, fy, tx, ty, sx, sy = _on_flank(mate, tooth, bent, arc)
        away = sx * (x - fx) + sy * (y - fy) - tx * tx - ty * ty
        arc = min(max(arc - (tx * (x - fx) + ty * (y - fy)) / away, low), high)
    fx, fy, tx, ty, sx, sy = _on_flank(mate, tooth, bent, arc)
    size = np.hypot(tx, ty)
    nx, ny = -ty / size, tx / size
    distance = nx * (x - fx) + ny * (y - fy)
    removed, slope = _relief(mate, arc)
    along = slope / (size * size - distance * (nx * sx + ny * sy))
    point[GAP], point[ARC] = distance + removed, arc
    point[PUSH], point[PUSH + 1] = nx + along * tx, ny + along * ty
    point[SLIDE], point[SLIDE + 1] = tx / size, ty / size
    point[FOOT], point[FOOT + 1] = fx, fy


@fast
def _points(own, mate, touch, place, bent):
    """(n, 12) table of points of contact, four in each interval of own's flank that a hat covers."""
    dx, dy, turn = place
    teeth, nodes = own.teeth, own.teeth.nodes[touch[1]]
    c, s = np.cos(turn), np.sin(turn)
    left, right = max(touch[3] - 1, 0), min(touch[4] + 1, teeth.arcs.size - 1)
    points = np.zeros((4 * (right - left), 12))
    for row in range(len(points)):
        i, point = left + row // 4, points[row]
        share, weight = GAUSS[row % 4]
        long = teeth.arcs[i + 1] - teeth.arcs[i]
        arc = teeth.arcs[i] + share * long
        x, y, _, _, _ = _involute(teeth, touch[1], arc)
        x += (1 - share) * own.u[nodes[i], 0] + share * own.u[nodes[i + 1], 0]
        y += (1 - share) * own.u[nodes[i], 1] + share * own.u[nodes[i + 1], 1]
        point[ARM], point[ARM + 1] = c * x - s * y, s * x + c * y
        point[AREA], point[SHARE] = weight * long * teeth.b, share
        _meet(mate.teeth, touch[2], bent, point[ARM] + dx, point[ARM + 1] + dy, point)
        point[GAP] += _relief(teeth, arc)[0]
    return points


@fast
def _slip(own, mate, touch, turn, points, bent):
    """(n,) velocity of own's points along the mate's flank, over that of the mate's."""
    slip, c, s = np.zeros(len(points)), np.cos(turn), np.sin(turn)
    nodes, left = own.teeth.nodes[touch[1]], max(touch[3] - 1, 0)
    for row, point in enumerate(points):
        i = left + row // 4
        share, one, two = point[SHARE], own.v[nodes[i]], own.v[nodes[i + 1]]
        vx, vy = (1 - share) * one[0] + share * two[0], (1 - share) * one[1] + share * two[1]
        j = _interval(mate.teeth.arcs, point[ARC])
        t = point[ARC] - mate.teeth.arcs[j]
        wx, wy = _cubic(bent[j, 0], t)[0], _cubic(bent[j, 1], t)[0]
        wx, wy = c * vx - s * vy - wx, s * vx + c * vy - wy
        vx = wx - own.spin * point[ARM + 1] + mate.spin * point[FOOT + 1]
        vy = wy + own.spin * point[ARM] - mate.spin * point[FOOT]
        slip[row] = vx * point[SLIDE] + vy * point[SLIDE + 1]
    return slip


@fast
def _means(touch, points, values, n):
    """(n,) means of values under the hats, and their areas."""
    left = max(touch[3] - 1, 0)
    mean, area = np.zeros(n), np.zeros(n)
    for row, point in enumerate(points):
        for k in range(2):
            hat = left + row // 4 + k
            if touch[3] <= hat <= touch[4]:
                part = point[AREA] * (point[SHARE] if k else 1 - point[SHARE])
                mean[hat] += part * values[row]
                area[hat] += part
    return mean / np.maximum(area, 1e-300), area


@fast
def press(own, mate, touch, place, law, stick):
    """Adds contact forces of two teeth to those of own and mate.

    touch       numbers: own gear, its tooth and the mate's among the flanks, first and last hat
    place       own's centre and turn in the mate's frame
    stick       (n_hat,) friction of one step before [Pa], is overwritten

    Returns torques on own and mate [N m], stored energy [J], power lost by slip [W].
    """
    n, turn = own.teeth.arcs.size, place[2]
    points = _points(own, mate, touch, place, _bent(mate.teeth, touch[2], mate.u))
    gap, area = _means(touch, points, points[:, GAP], n)
    pressure = law.penalty * np.maximum(-gap, 0.0)
    energy, lost = (area * pressure**2).sum() / (2 * law.penalty), 0.0
    if law.friction > 0:
        slip = _slip(own, mate, touch, turn, points, _bent(mate.teeth, touch[2], mate.v))
        mean, area = _means(touch, points, slip, n)
        wanted = stick + law.penalty * law.step * mean
        stick[:] = np.minimum(np.maximum(wanted, -law.friction * pressure), law.friction * pressure)
        lost = (area * stick * mean).sum()
    if pressure.max() == 0:
        return 0.0, 0.0, energy, lost
    one, other = _spread(own, mate, touch, turn, points, (pressure, stick))
    return one, other, energy, lost


@fast
def _spread(own, mate, touch, turn, points, tractions):
    """Forces of pressure and friction under the hats on the nodes of both; their torques."""
    c, s, nodes, left = np.cos(turn), np.sin(turn), own.teeth.nodes[touch[1]], max(touch[3] - 1, 0)
    (pressure, friction), one, other = tractions, 0.0, 0.0
    moments = np.zeros((2, mate.teeth.arcs.size - 1, 4))
    for row, point in enumerate(points):
        i, share = left + row // 4, point[SHARE]
        p = point[AREA] * ((1 - share) * pressure[i] + share * pressure[i + 1])
        f = point[AREA] * ((1 - share) * friction[i] + share * friction[i + 1])
        fx, fy = p * point[PUSH] - f * point[SLIDE], p * point[PUSH + 1] - f * point[SLIDE + 1]
        one += point[ARM] * fy - point[ARM + 1] * fx
        other -= point[FOOT] * fy - point[FOOT + 1] * fx
        for k, part in enumerate((1 - share, share)):
            own.force[nodes[i + k], 0] += part * (c * fx + s * fy)
            own.force[nodes[i + k], 1] += part * (c * fy - s * fx)
        j = _interval(mate.teeth.arcs, point[ARC])
        power = 1.0
        for k in range(3, -1, -1):
            moments[0, j, k] += power * fx
            moments[1, j, k] += power * fy
            power *= point[ARC] - mate.teeth.arcs[j]
    for a in range(mate.teeth.arcs.size):
        node = mate.teeth.nodes[touch[2], a]
        mate.force[node, 0] -= (mate.teeth.spline[a] * moments[0]).sum()
        mate.force[node, 1] -= (mate.teeth.spline[a] * moments[1]).sum()
    return one, other
