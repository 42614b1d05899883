"""Weighted gaps between the flanks of two deformable gears (mortar method).

The slave flank carries the hat functions phi_i of its nodes, the master flank is searched for closest points. With the
gap g from a point of the slave along the normal of the master, plus the material that modifications remove,

    g_i = int phi_i g dA / int phi_i dA,        g_i >= 0,  f_i >= 0,  g_i f_i = 0

for the contact forces f_i (Puso and Laursen, A mortar segment-to-segment contact method for large deformation solid
mechanics, 2004; Wriggers, Computational Contact Mechanics, 2006). Vectors are (2, ...), in transverse planes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from fem.elasticity.hat_functions import hats
from fem.elasticity.section_mesh import rotated
from fem.pair.mesh_position import MeshPosition
from fem.pair.pair import GearPair
from fem.pair.placement import Placement, placements
from fem.reference.deformable_gear import DeformableGear
from fem.reference.deformed_flank import Flank, WidthQuadrature, closest_points, quarter_turn

#: A node is a contact candidate where its gap at rest exceeds the smallest by less than this [modules], or by te.
CANDIDATE_GAP = 1 / 25
#: A point in the middle of the path of contact belongs to the pinion's half, within this share of a pitch.
ROUNDING = 1e-9
#: Step of the difference quotient for the slope of the removed material [modules].
SLOPE_STEP = 1e-3

#: Displacements (n_dofs, dim) of two gears [m].
Displacements = Sequence[np.ndarray]


class FlankQuadrature(NamedTuple):
    """Quadrature along the profile of a slave flank.

    arcs        (n,) arc lengths of the points [m]
    shapes      (n, n_node) shape functions of all nodes
    hats        (n, n_hat) hat functions of some nodes times quadrature weights [m]
    nodes       (n_hat,) numbers of these nodes along the profile
    """

    arcs: np.ndarray
    shapes: np.ndarray
    hats: np.ndarray
    nodes: np.ndarray


def profile_quadrature(flank: Flank, nodes: np.ndarray) -> FlankQuadrature:
    """Four Gauss points in each interval between nodes that a hat function of the given nodes covers."""
    points, weights = np.polynomial.legendre.leggauss(4)
    left = np.unique(np.concatenate([nodes - 1, nodes]))
    left = left[(left >= 0) & (left < flank.arcs.size - 1)]
    start, size = flank.arcs[left, None], np.diff(flank.arcs)[left, None]
    arcs = (start + size * (points + 1) / 2).ravel()
    weighted_hats = hats(flank.arcs, arcs)[nodes].T * (size * weights / 2).reshape(-1, 1)
    return FlankQuadrature(arcs, flank.shapes(arcs), weighted_hats, nodes)


@dataclass(frozen=True)
class ContactCandidate:
    """Two teeth that may touch.

    slave       gear that carries the hat functions: 0 the pinion, 1 the wheel
    teeth       numbers of the teeth on pinion and wheel
    quadrature  quadrature along the slave's profile
    mask        (n_hat, n_across) nodes along the profile and across the width that may touch
    """

    slave: int
    teeth: tuple[int, int]
    quadrature: FlankQuadrature
    mask: np.ndarray

    def mean_operator(self, width: WidthQuadrature) -> tuple[np.ndarray, np.ndarray]:
        """Areas (n,) [m^2] of the hat functions, and (n, n_point * n_station) weights of the means over them."""
        along, across = np.nonzero(self.mask)
        axial_hats = (width.hats.T * width.weights)[across]
        weights = np.einsum("hq,hz->hqz", self.quadrature.hats.T[along], axial_hats)
        area = weights.sum(axis=(1, 2))
        return area, weights.reshape(area.size, -1) / area[:, None]


class MeanGaps(NamedTuple):
    """Gaps of a contact candidate.

    gap, area           (n,) mean gap under each hat function [m] and its area [m^2]
    closing             (n,) decrease of the gap per transmission error
    slave_gradient      (n, n_node, n_across, 2) derivative by the displacements of the nodes in transverse planes
    master_gradient     the same for the nodes of the master flank
    """

    gap: np.ndarray
    area: np.ndarray
    closing: np.ndarray
    slave_gradient: np.ndarray
    master_gradient: np.ndarray


def dot(v: np.ndarray, w: np.ndarray) -> np.ndarray:
    return v[0] * w[0] + v[1] * w[1]


def cross(v: np.ndarray, w: np.ndarray) -> np.ndarray:
    return v[0] * w[1] - v[1] * w[0]


def mean_gaps(
    candidate: ContactCandidate, flanks: tuple[Flank, Flank], placed: tuple[Placement, Placement], u: Displacements
) -> MeanGaps:
    """Gaps between two flanks; flanks, placements and displacements (n_dofs, dim) of the slave and of the master."""
    (slave, master), (slave_gear, master_gear), quadrature = flanks, placed, candidate.quadrature
    angle = slave_gear.rotation - master_gear.rotation + slave.station_angles - master.station_angles
    lever = rotated(slave_points(slave, quadrature, u[0]), angle)
    distance = (slave_gear.centre - master_gear.centre)[:2, None]
    points = lever + rotated(distance, -(master_gear.rotation + master.station_angles))[:, None]
    contact = contact_points(master, points, u[1])
    closing = master_gear.turn_per_te * cross(contact.foot, contact.push)
    closing = closing - slave_gear.turn_per_te * cross(lever, contact.push)
    gap = contact.gap + slave.removed(quadrature.arcs[:, None])
    by_slave = np.einsum("cqz,qa,zk->qzakc", rotated(contact.push, -angle), quadrature.shapes, slave.width.shapes)
    by_master = np.einsum("cqz,qza,zk->qzakc", -contact.push, master.smooth_shapes(contact.arc), master.width.shapes)
    area, weights = candidate.mean_operator(slave.width)

    def mean(values: np.ndarray) -> np.ndarray:
        return (weights @ values.reshape(weights.shape[1], -1)).reshape(area.size, *values.shape[2:])

    return MeanGaps(mean(gap), area, mean(closing), mean(by_slave), mean(by_master))


def slave_points(flank: Flank, quadrature: FlankQuadrature, u: np.ndarray) -> np.ndarray:
    """(2, n, n_station) quadrature points of a deformed flank in the frame of its gear."""
    displacement = np.einsum("qa,caz->cqz", quadrature.shapes, flank.displacement_at_stations(u))
    return flank.involute(quadrature.arcs[:, None]) + displacement


class ContactPoints(NamedTuple):
    """Points of the master flank that are closest to given points, in the frame of the master.

    arc         (n, n_station) arc lengths [m]
    foot        (2, n, n_station) points [m]
    gap         (n, n_station) distance along the normal and material removed from the master [m]
    push        (2, n, n_station) change of the gap per displacement of the given points: direction of the force
    """

    arc: np.ndarray
    foot: np.ndarray
    gap: np.ndarray
    push: np.ndarray


def contact_points(master: Flank, points: np.ndarray, u: np.ndarray) -> ContactPoints:
    """Closest points to points (2, n, n_station) in the frame of the master, which is displaced by u (n_dofs, dim)."""
    arc, (foot, tangent, curvature) = closest_points(master, points, master.displacement_at_stations(u))
    normal = quarter_turn(tangent) / np.sqrt(dot(tangent, tangent))
    distance = dot(normal, points - foot)
    step = SLOPE_STEP * master.gear.m_n
    slope = (master.removed(arc + step) - master.removed(arc - step)) / (2 * step)
    # The gap grows along the flank where the master is relieved: the force is normal to the relieved flank.
    tilt = slope / (dot(tangent, tangent) - distance * dot(normal, curvature))
    return ContactPoints(arc, foot, distance + master.removed(arc), normal + tilt * tangent)


@dataclass(frozen=True)
class MatingGears:
    """Deformable pinion and wheel of a pair; wheel_share of the transmission error turns the wheel back.

    The pinion turns ahead by the rest.
    """

    pair: GearPair
    gears: tuple[DeformableGear, DeformableGear]
    wheel_share: float = 0.5

    def placements(self, phase: float, te: float) -> tuple[Placement, Placement]:
        """Placements of pinion and wheel; tooth pair k touches k pitches ahead of pair 0."""
        return placements(MeshPosition(self.pair, self.pair.a, 0.0, phase), te, lag=self.wheel_share)

    def mean_gaps(self, candidate: ContactCandidate, placed: tuple[Placement, Placement], u: Displacements) -> MeanGaps:
        """Gaps of a candidate; placements and displacements of pinion and wheel."""
        pinion, wheel = (gear.flanks[tooth] for gear, tooth in zip(self.gears, candidate.teeth, strict=True))
        if candidate.slave == 0:
            return mean_gaps(candidate, (pinion, wheel), placed, u)
        return mean_gaps(candidate, (wheel, pinion), placed[::-1], u[::-1])

    def candidates(self, phase: float, te: float = 0.0) -> list[ContactCandidate]:
        """Nodes of all teeth whose gap at rest is within CANDIDATE_GAP, or te, of the smallest one.

        The slave is the gear that touches nearer to its tip.
        """
        rest = [gear.undeformed() for gear in self.gears]
        possible = [candidate for candidate in self._all_candidates(phase) if candidate.mask.any()]
        gaps = [self.mean_gaps(candidate, self.placements(phase, 0.0), rest).gap for candidate in possible]
        limit = min(gap.min() for gap in gaps) + max(CANDIDATE_GAP * self.pair.pinion.m_n, te)
        near = []
        for candidate, gap in zip(possible, gaps, strict=True):
            mask = candidate.mask.copy()
            mask[mask] = gap < limit
            nodes = np.flatnonzero(mask.any(axis=1))
            if nodes.size:
                flank = self.gears[candidate.slave].flanks[candidate.teeth[candidate.slave]]
                near.append(replace(candidate, quadrature=profile_quadrature(flank, nodes), mask=mask[nodes]))
        return near

    def _all_candidates(self, phase: float) -> Iterator[ContactCandidate]:
        """All nodes of all teeth: the pinion is the slave from the middle of the path of contact on."""
        pair = self.pair
        middle = (pair.roll_start + pair.roll_end) / 2 - pair.roll_pitch - ROUNDING * pair.p_bt
        for k, slave in product(self.gears[0].flanks, (0, 1)):
            flank = self.gears[slave].flanks[(k, -k)[slave]]
            in_pinion_half = (phase + k) * pair.p_bt + flank.width.nodes * np.tan(pair.beta_b) >= middle
            mask = np.tile(in_pinion_half if slave == 0 else ~in_pinion_half, (flank.arcs.size, 1))
            yield ContactCandidate(slave, (k, -k), profile_quadrature(flank, np.arange(flank.arcs.size)), mask)


@dataclass(frozen=True)
class PairGaps:
    """Gaps of all candidates: gap [m], area [m^2] and closing (n,) as in `MeanGaps`.

    gradients   of pinion and wheel, (n, n_columns) over the rows of `DeformableGear.flank_operator`
    """

    gap: np.ndarray
    area: np.ndarray
    closing: np.ndarray
    gradients: tuple[np.ndarray, np.ndarray]


def pair_gaps(
    mating: MatingGears, candidates: list[ContactCandidate], phase: float, te: float, u: Displacements
) -> PairGaps:
    """Gaps of all candidates in the present placements and displacements of the gears."""
    placed = mating.placements(phase, te)
    parts = [mating.mean_gaps(candidate, placed, u) for candidate in candidates]
    gap, area, closing = (np.concatenate([part[i] for part in parts]) for i in range(3))
    gradients = tuple(np.zeros((gap.size, gear.flank_operator.shape[0])) for gear in mating.gears)
    first = 0
    for candidate, part in zip(candidates, parts, strict=True):
        last = first + part.gap.size
        for side, gear in enumerate(mating.gears):
            gradient = part.slave_gradient if side == candidate.slave else part.master_gradient
            columns = gradient.reshape(part.gap.size, -1)
            start = list(gear.flanks).index(candidate.teeth[side]) * columns.shape[1]
            gradients[side][first:last, start : start + columns.shape[1]] = columns
        first = last
    return PairGaps(gap, area, closing, (gradients[0], gradients[1]))
