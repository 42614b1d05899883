"""Flank of a loaded tooth as a plane curve, and its closest point to a given point.

With the arc length s of the undeformed flank, the displacements u_a of its nodes and their shape functions N_a,

    x(s) = involute(s) + sum_a N_a(s) u_a,      closest to p where x'(s) . (p - x(s)) = 0.

The involute is exact: contact is not on the straight edges of the elements. Each gear has a frame that is fixed to its
hub and turns along the width with the sections of a helical gear; vectors in it are (2, ...).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PPoly
from skfem import ElementLineP1, ElementLineP2

from fem.elasticity.hat_functions import hats
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.gear.tooth_profile import LEAST_ROLL
from fem.microgeometry.flank import removed
from fem.support.numba_cache import compiled, fast

#: Newton steps to the closest point, from the point of the flank at the same radius.
NEWTON_STEPS = 3


def quarter_turn(v: np.ndarray) -> np.ndarray:
    """Vectors (2, ...) turned counter-clockwise by 90 degrees."""
    return np.stack([-v[1], v[0]])


def shape_functions(nodes: np.ndarray, degree: int) -> PPoly:
    """Values (..., n) at positions (...) of the shape functions of line elements of a degree with nodes (n,)."""
    element = ElementLineP1() if degree == 1 else ElementLineP2()
    local, order = np.linspace(0, 1, degree + 1), np.argsort(element.doflocs[:, 0])
    values = np.stack([element.lbasis(local[None], shape)[0] for shape in order], axis=1)
    powers = np.linalg.solve(np.vander(local), values)
    ends = nodes[::degree]
    first = np.arange(0, nodes.size - 1, degree)
    coefficients = np.zeros((degree + 1, first.size, nodes.size))
    scale = np.diff(ends) ** np.arange(degree, -1, -1)[:, None]
    for shape in range(degree + 1):
        coefficients[:, np.arange(first.size), first + shape] = powers[:, [shape]] / scale
    return PPoly(coefficients, ends)


class WidthQuadrature(NamedTuple):
    """Quadrature across the face width; a single point in plane strain.

    nodes       (n_across,) axial positions of the nodes [m]
    axial       (n_station,) axial positions of the quadrature points [m]
    weights     (n_station,) their weights [m]
    hats        (n_station, n_across) hat functions of the nodes
    shapes      (n_station, n_across) shape functions of the nodes
    """

    nodes: np.ndarray
    axial: np.ndarray
    weights: np.ndarray
    hats: np.ndarray
    shapes: np.ndarray


def plane_strain_width(b: float) -> WidthQuadrature:
    """The quadrature for plane strain over the width b [m]."""
    return WidthQuadrature(np.zeros(1), np.zeros(1), np.array([b]), np.ones((1, 1)), np.ones((1, 1)))


def gauss_width(nodes: np.ndarray, degree: int) -> WidthQuadrature:
    """Two Gauss points in each interval between nodes (n,) of elements of a degree."""
    points, weights = np.polynomial.legendre.leggauss(2)
    size = np.diff(nodes)[:, None]
    axial = (nodes[:-1, None] + size * (points + 1) / 2).ravel()
    shapes = shape_functions(nodes, degree)(axial)
    return WidthQuadrature(nodes, axial, (size * weights / 2).ravel(), hats(nodes, axial).T, shapes)


@dataclass(frozen=True)
class Flank:
    """Left flank of a tooth on the finite elements of its gear.

    tooth       number of the tooth
    arcs        (n,) arc lengths of the nodes from root form to tip [m]
    nodes       (n, n_across) dofs of the nodes along the profile and across the width
    width       quadrature across the width
    degree      degree of the elements
    """

    gear: Gear
    tooth: int
    arcs: np.ndarray
    nodes: np.ndarray
    width: WidthQuadrature
    degree: int

    @property
    def station_angles(self) -> np.ndarray:
        """(n_station,) angles of the sections at the quadrature points, 0 in mid-plane [rad]."""
        return self.gear.twist * self.width.axial

    @cached_property
    def shapes(self) -> PPoly:
        """Shape functions (..., n) of the nodes at arc lengths (...), as in the elements."""
        return shape_functions(self.arcs, self.degree)

    @cached_property
    def smooth_shapes(self) -> PPoly:
        """`shapes` for a master flank; for linear elements the spline through the nodes, which has no kinks."""
        return CubicSpline(self.arcs, np.eye(self.arcs.size)) if self.degree == 1 else self.shapes

    @cached_property
    def polynomials(self) -> np.ndarray:
        """(n, n_interval, 4) coefficients of `smooth_shapes` as cubics, the highest power first."""
        coefficients = self.smooth_shapes.c
        padded = np.pad(coefficients, ((4 - len(coefficients), 0), (0, 0), (0, 0)))
        return np.ascontiguousarray(padded.transpose(2, 1, 0))

    def involute(self, arc: np.ndarray) -> np.ndarray:
        """(2, ...) points of the undeformed flank at arc lengths (...) [m]."""
        return tooth_profile.flank_points(self.gear, arc, self.tooth)

    @cached_property
    def section_displacement(self) -> np.ndarray:
        """(n, n_across, 2, dim) displacement in the frame's plane per displacement of a node.

        The plane cuts a helical flank that moves along the axis in another section, which is turned.
        """
        angle, around = self.gear.twist * self.width.nodes, quarter_turn(self.involute(self.arcs))
        operator = np.zeros((*self.nodes.shape, 2, 3))
        operator[:, :, 0, :2] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        operator[:, :, 1, :2] = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
        operator[:, :, :, 2] = -self.gear.twist * around.T[:, None]
        return operator

    def displacement_at_stations(self, u: np.ndarray) -> np.ndarray:
        """(2, n, n_station) displacement at the quadrature points along the lines of nodes, of u (n_dofs, dim)."""
        at_nodes = np.einsum("akci,aki->cak", self.section_displacement[..., : u.shape[1]], u[self.nodes])
        return at_nodes @ self.width.shapes.T

    def removed(self, arc: np.ndarray) -> np.ndarray:
        """Material removed by the flank modifications at arc lengths (n, 1 or n_station) [m]."""
        sign = self.gear.sign
        roll = tooth_profile.roll_at(self.gear, sign * np.maximum(sign * arc, 0.0))
        return removed(self.gear.drive_flank, self.gear.face, roll, self.width.axial, tooth=self.tooth)


class FlankCurve(NamedTuple):
    """Arrays of a deformed flank for compiled functions.

    r_b             base radius [m]
    start_angle     angle of the tangent where the involute begins [rad]
    knots           (n_interval + 1,) arc lengths between the polynomials [m]
    displacement    (n_interval, 2, 4) cubics of the displacement [m], the highest power first
    """

    r_b: float
    start_angle: float
    knots: np.ndarray
    displacement: np.ndarray


@compiled(fastmath=True)
def interval_of(knots, arc):
    """Number of the interval between knots that contains an arc length; the outer intervals are unbounded."""
    return min(max(np.searchsorted(knots, arc) - 1, 0), knots.size - 2)


@compiled(fastmath=True)
def cubic(coefficients, t):
    """Value, slope and second derivative of a cubic (4,) at t."""
    a, b, c, d = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
    return d + t * (c + t * (b + t * a)), c + t * (2 * b + 3 * t * a), 2 * b + 6 * t * a


@compiled(fastmath=True)
def involute_point(r_b, start_angle, arc):
    """Point (x, y), unit tangent (c, s) and roll length of an involute at an arc length."""
    roll = np.copysign(np.sqrt(2 * r_b * arc), r_b)
    angle = start_angle - roll / r_b
    c, s = np.cos(angle), np.sin(angle)
    return r_b * c - roll * s, r_b * s + roll * c, c, s, roll


@compiled(fastmath=True)
def curve_point(curve, arc):
    """Point, first and second derivative over the arc length: x, y, x', y', x'', y''."""
    x, y, c, s, roll = involute_point(curve.r_b, curve.start_angle, arc)
    interval = interval_of(curve.knots, arc)
    t = arc - curve.knots[interval]
    radius = np.copysign(max(abs(roll), LEAST_ROLL * np.sqrt(2 * curve.r_b * curve.knots[-1])), curve.r_b)
    u, slope_u, second_u = cubic(curve.displacement[interval, 0], t)
    v, slope_v, second_v = cubic(curve.displacement[interval, 1], t)
    return x + u, y + v, c + slope_u, s + slope_v, s / radius + second_u, -c / radius + second_v


@compiled(fastmath=True)
def closest_arc(curve, x, y):
    """Arc length of the point closest to (x, y) on the curve, which ends at root form and tip."""
    low, high = curve.knots[0], curve.knots[-1]
    arc = min(max((x * x + y * y - curve.r_b * curve.r_b) / (2 * curve.r_b), low), high)
    for _ in range(NEWTON_STEPS):
        px, py, tx, ty, sx, sy = curve_point(curve, arc)
        slope = sx * (x - px) + sy * (y - py) - tx * tx - ty * ty
        arc = min(max(arc - (tx * (x - px) + ty * (y - py)) / slope, low), high)
    return arc


@fast
def _closest_points(r_b, start_angle, knots, displacements, points):
    """`closest_points` for displacements (n_station, n_interval, 2, 4)."""
    _, n, n_station = points.shape
    arcs, curve_points = np.empty((n, n_station)), np.empty((6, n, n_station))
    for station in range(n_station):
        curve = FlankCurve(r_b, start_angle, knots, displacements[station])
        for i in range(n):
            arc = closest_arc(curve, points[0, i, station], points[1, i, station])
            arcs[i, station] = arc
            for k, value in enumerate(curve_point(curve, arc)):
                curve_points[k, i, station] = value
    return arcs, curve_points


def closest_points(flank: Flank, points: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of a deformed flank that are closest to points (2, n, n_station) in its gear's frame.

    moved       (2, n_node, n_station) displacement of the flank's nodes [m]

    Returns arc lengths (n, n_station) [m] and there (3, 2, n, n_station) the point and its two derivatives.
    """
    displacements = np.ascontiguousarray(np.einsum("aip,caz->zicp", flank.polynomials, moved, optimize=True))
    curve = flank.gear.r_b, float(tooth_profile.tangent_angle(flank.gear, 0.0, flank.tooth)), flank.smooth_shapes.x
    arcs, derivatives = _closest_points(*curve, displacements, np.ascontiguousarray(points))
    return arcs, derivatives.reshape(3, 2, *arcs.shape)
