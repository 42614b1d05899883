"""Contact of two flanks where they are now: mean gaps over hats on one, closest points on the other (mortar method).

A flank is the exact involute plus the displacement of the elements beneath, so that straight edges do not touch. `own`
carries the hats, which end at its tip corner; `mate` is looked up. Both are cut by transverse planes; where a helical
tooth moves along its axis, a plane cuts another section of it. Each gear has a frame of its own, in which its hub rests
and which turns with the sections along a helix; vectors are (2, ...).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.microgeometry.flank import removed


class Width(NamedTuple):
    """Nodes across the width (n_across,) [m]; stations: places, widths (n,) [m], nodes' hats, shapes (n, n_across)."""

    nodes: np.ndarray
    places: np.ndarray
    widths: np.ndarray
    hats: np.ndarray
    shapes: np.ndarray


@dataclass(frozen=True)
class Flank:
    """Counter-clockwise flank of a tooth with a number; nodes (n, n_across) at arc lengths (n,) [m]."""

    gear: Gear
    tooth: int
    arcs: np.ndarray
    nodes: np.ndarray
    width: Width
    degree: int

    @property
    def turn(self) -> float:
        """Angle of the tooth's centre line from that of tooth 0 [rad]."""
        return 2 * np.pi * self.tooth / self.gear.z

    @property
    def turns(self) -> np.ndarray:
        """(n_station,) angles of the sections at the stations from mid-plane's [rad]."""
        return self.gear.twist * self.width.places

    @property
    def base(self) -> float:
        """Angle where the involute of tooth 0 begins [rad]."""
        return np.pi / 2 + float(tooth_profile.flank(self.gear, [0.0]).psi[0])

    @cached_property
    def shapes(self) -> PPoly:
        """Values (..., n) of the nodes' shape functions at arc lengths (...), as in the elements beneath."""
        return shape_functions(self.arcs, self.degree)

    @cached_property
    def smooth(self) -> PPoly:
        """`shapes` without kinks, for a mate: a spline through the nodes of linear elements."""
        return CubicSpline(self.arcs, np.eye(self.arcs.size)) if self.degree == 1 else self.shapes

    def involute(self, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points [m], unit tangents towards the tip and second derivatives [1/m] over arc length."""
        roll = tooth_profile.roll_at(self.gear, arc)
        tangent = direction(self.base + self.turn - roll / self.gear.r_b)
        normal, radius = quarter_turn(tangent), np.maximum(roll, tooth_profile.LEAST_ROLL * self.gear.roll_tip)
        return self.gear.r_b * tangent + roll * normal, tangent, -normal / radius

    @cached_property
    def transverse(self) -> np.ndarray:
        """(n, n_across, 2, dim) displacement in the transverse plane per displacement of the nodes.

        A helical flank that moves along the axis is cut elsewhere, where it is turned.
        """
        turn, around = self.gear.twist * self.width.nodes, quarter_turn(self.involute(self.arcs)[0])
        found = np.zeros((*self.nodes.shape, 2, 3))
        found[:, :, 0, :2] = direction(turn).T
        found[:, :, 1, :2] = quarter_turn(direction(turn)).T
        found[:, :, :, 2] = -self.gear.twist * around.T[:, None]
        return found

    def at_stations(self, u: np.ndarray) -> np.ndarray:
        """(2, n, n_station) displacement in the transverse plane of the nodes' lines at the stations."""
        moved = np.einsum("akci,aki->cak", self.transverse[..., : u.shape[1]], u[self.nodes])
        return moved @ self.width.shapes.T

    def removed(self, arc: np.ndarray) -> np.ndarray:
        """Material removed at arcs (n, 1 or n_station) [m]."""
        roll = tooth_profile.roll_at(self.gear, np.maximum(arc, 0.0))
        return removed(self.gear.drive_flank, self.gear.face, roll, self.width.places, tooth=self.tooth)


def shape_functions(nodes: np.ndarray, degree: int) -> PPoly:
    """Values (..., n) at places (...) of the shape functions of a line of elements with nodes (n,)."""
    linear, parabolas = [(-1, 1), (1, 0)], [(2, -3, 1), (-4, 4, 0), (2, -1, 0)]
    ends = nodes[::degree]
    first = degree * np.arange(ends.size - 1)
    coefficients = np.zeros((degree + 1, first.size, nodes.size))
    scale = np.diff(ends) ** np.arange(degree, -1, -1)[:, None]
    for node, polynomial in enumerate(linear if degree == 1 else parabolas):
        coefficients[:, np.arange(first.size), first + node] = np.array(polynomial)[:, None] / scale
    return PPoly(coefficients, ends)


def direction(angle) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)])


def quarter_turn(v: np.ndarray) -> np.ndarray:
    return np.stack([-v[1], v[0]])


def dot(v: np.ndarray, w: np.ndarray) -> np.ndarray:
    return v[0] * w[0] + v[1] * w[1]


def cross(v: np.ndarray, w: np.ndarray) -> np.ndarray:
    return v[0] * w[1] - v[1] * w[0]


def turned(v: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """v turned counter-clockwise."""
    return np.cos(angle) * v + np.sin(angle) * quarter_turn(v)


class Placement(NamedTuple):
    """Where a gear stands: centre (2,) [m], angle [rad], its turn per transmission error [rad/m]."""

    centre: np.ndarray
    angle: float
    per_error: float


class Sampling(NamedTuple):
    """Quadrature of own's flank: arcs (n,), shapes there (n, n_node), weighted hats (n, n_hat), and their numbers."""

    arcs: np.ndarray
    shapes: np.ndarray
    hats: np.ndarray
    chosen: np.ndarray


def sampling(flank: Flank, chosen: np.ndarray) -> Sampling:
    """Four Gauss points in each interval between nodes that a chosen hat (numbers of nodes) covers."""
    points, weights = np.polynomial.legendre.leggauss(4)
    left = np.unique(np.concatenate([chosen - 1, chosen]))
    left = left[(left >= 0) & (left < flank.arcs.size - 1)]
    low, long = flank.arcs[left, None], np.diff(flank.arcs)[left, None]
    arcs = (low + long * (points + 1) / 2).ravel()
    hats = np.stack([np.interp(arcs, flank.arcs, one) for one in np.eye(flank.arcs.size)[chosen]], axis=1)
    return Sampling(arcs, flank.shapes(arcs), hats * (long * weights / 2).reshape(-1, 1), chosen)


@dataclass(frozen=True)
class Touch:
    """Two teeth that may touch, numbered on pinion and wheel; own is the gear (0: pinion, 1: wheel) with the hats.

    near        (n_chosen, n_across) which of the hats along the profile may touch where across the width
    """

    own: int
    teeth: tuple[int, int]
    sample: Sampling
    near: np.ndarray


class Gaps(NamedTuple):
    """Mean gaps under the hats (n,) [m], their area [m^2], closing per transmission error, and their derivatives.

    by_own, by_mate     (n, n_node, n_across, 2) derivatives by the nodes' displacements in the transverse plane
    """

    gap: np.ndarray
    area: np.ndarray
    closing: np.ndarray
    by_own: np.ndarray
    by_mate: np.ndarray


def position(flank: Flank, arc: np.ndarray, moved: np.ndarray) -> list[np.ndarray]:
    """Points and two derivatives over arc lengths (n, n_station), under moved (2, n_node, n_station)."""
    undeformed = flank.involute(arc)
    return [p + np.einsum("qza,caz->cqz", flank.smooth(arc, k), moved) for k, p in enumerate(undeformed)]


def closest(mate: Flank, x: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Arc lengths of the mate's points closest to x (2, n, n_station) in the mate's frame."""
    low, high = mate.arcs[[0, -1]]
    arc = np.clip((dot(x, x) / mate.gear.r_b - mate.gear.r_b) / 2, low, high)
    for _ in range(3):
        y, tangent, second = position(mate, arc, moved)
        away = dot(second, x - y) - dot(tangent, tangent)
        arc = np.clip(arc - dot(tangent, x - y) / away, low, high)
    return arc


def gaps(own: Flank, mate: Flank, places: tuple[Placement, Placement], u: tuple, touch: Touch) -> Gaps:
    """Gaps between own and mate, placed at places and displaced by u = (own's, mate's) (n_dofs, dim)."""
    sample = touch.sample
    at_own, at_mate = own.at_stations(u[0]), mate.at_stations(u[1])
    inside = own.involute(sample.arcs[:, None])[0] + np.einsum("qa,caz->cqz", sample.shapes, at_own)
    there, here = places
    ahead, angle = there.angle - here.angle + own.turns - mate.turns, here.angle + mate.turns
    arm = turned(inside, ahead)
    x = arm + turned((there.centre - here.centre)[:, None], -angle)[:, None]
    arc = closest(mate, x, at_mate)
    y, tangent, second = position(mate, arc, at_mate)
    normal = quarter_turn(tangent) / np.sqrt(dot(tangent, tangent))
    distance = dot(normal, x - y)
    step = 1e-3 * mate.gear.m_n
    slope = (mate.removed(arc + step) - mate.removed(arc - step)) / (2 * step)
    # The gap grows along the flank where the mate is relieved: the force is normal to the relieved flank.
    along = slope / (dot(tangent, tangent) - distance * dot(normal, second))
    push = normal + along * tangent
    closing = here.per_error * cross(y, push) - there.per_error * cross(arm, push)
    values = distance + own.removed(sample.arcs[:, None]) + mate.removed(arc)
    area, mean = averages(touch, own.width)
    by_own = np.einsum("cqz,qa,zk->qzakc", turned(push, -ahead), sample.shapes, own.width.shapes)
    by_mate = np.einsum("cqz,qza,zk->qzakc", -push, mate.smooth(arc), mate.width.shapes)
    return Gaps(mean(values), area, mean(closing), mean(by_own), mean(by_mate))


def averages(touch: Touch, width: Width):
    """Areas under the hats (n,) [m^2]; function that turns values (n_point, n_station, ...) into means (n, ...)."""
    along, across = np.nonzero(touch.near)
    weights = np.einsum("hq,hz->hqz", touch.sample.hats.T[along], (width.hats.T * width.widths)[across])
    area = weights.sum(axis=(1, 2))
    weights = weights.reshape(area.size, -1) / area[:, None]

    def mean(values: np.ndarray) -> np.ndarray:
        shape = values.shape[2:]
        return (weights @ values.reshape(weights.shape[1], -1)).reshape(area.size, *shape)

    return area, mean
