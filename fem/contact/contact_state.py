"""State of the contact of all tooth pairs at one mesh position under a load: the result of a contact solve."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fem.contact.contact_slices import ContactSlices
from fem.contact.flank_gap import arc_of_mate, sections_of
from fem.contact.strip_bounds import Strips
from fem.elasticity.face_symmetry import Face
from fem.pair import hertz
from fem.support.numba_cache import kept_unchecked, unchecked

TINY = np.finfo(float).tiny
half_width_of, pressure_of = unchecked(hertz.half_width), unchecked(hertz.pressure)


class LoadQuantities(NamedTuple):
    """What follows from the loads on the slices of m states; each (m,).

    centroid         axial position of the resultant force [m]; 0 without load
    line_load        largest force per length of contact line [N/m]
    hertz_pressure   largest pressure of the line loads by Hertz, on the curvature of the involutes [Pa]
    peak_pressure    largest contact pressure [Pa]
    tip_contact      share of the load on slices whose contact reaches a tip edge; 0 without load
    load_share       (m, n_pair) share of the load on each tooth pair of the position; 0 without load
    """

    centroid: np.ndarray
    line_load: np.ndarray
    hertz_pressure: np.ndarray
    peak_pressure: np.ndarray
    tip_contact: np.ndarray
    load_share: np.ndarray


@dataclass(frozen=True)
class State:
    """Contact of all tooth pairs under one load.

    te          static transmission error in mid-plane [m]
    slices      slices of tooth pairs that may carry load, on the modelled part of the face
    force       (n,) normal forces on the slices [N]
    pressure    (n,) largest contact pressure in each slice [Pa]; None: that of Hertz
    face        modelled part of the face width
    stiffness   tangent stiffness of the mesh: change of the mesh force per transmission error [N/m]; 0 without load
    strips      strips of the slices; None where slices have line loads
    strip_force (n, m) normal forces on the strips [N], or None
    """

    te: float
    slices: ContactSlices
    force: np.ndarray
    pressure: np.ndarray
    face: Face
    stiffness: float = 0.0
    strips: Strips | None = None
    strip_force: np.ndarray | None = None

    @cached_property
    def quantities(self) -> LoadQuantities:
        """Force centroid, line load, pressures, tip contact and load shares of this state, m = 1."""
        return load_quantities(self.slices, self.force[None], self.pressure[None], self.face)


def hertz_pressure(slices: ContactSlices, force: np.ndarray) -> np.ndarray:
    """(..., n) largest pressures [Pa] under forces (..., n) [N] by Hertz, on the curvature of the involutes."""
    half_width = slices.half_width(np.maximum(force, TINY) / slices.width)
    return hertz.pressure(force / slices.length, half_width)


def load_quantities(
    slices: ContactSlices,
    force: np.ndarray,
    pressure: np.ndarray,
    face: Face,
    moment: np.ndarray | None = None,
    largest: np.ndarray | None = None,
) -> LoadQuantities:
    """Quantities of m states under forces and pressures (m, n) on slices.

    moment      (m, n) moments of the forces about the middles of the slices, over half of their widths [N]; None: 0
    largest     (m, n) largest line loads across the slices times their lengths [N]; None: the forces
    """
    numbers, mirrored = slices.position.numbers(), face.share < 1
    at = (slices.number, slices.low, slices.high), slices.closest, numbers.start, len(numbers)
    moment = np.zeros(force.shape) if moment is None else moment
    loads = force, moment, force if largest is None else largest
    return quantities_of(slices.mesh.geometry, *at, mirrored, loads, pressure)


@kept_unchecked
def quantities_of(mesh, slices, closest, first, pairs, mirrored, loads, pressure):
    """`load_quantities` of slices of tooth pairs from the first one on; mirrored: whether half the face is modelled."""
    (number, low, high), (force, moment, largest) = slices, loads
    sections, m = sections_of(mesh, number, low, high, np.zeros(number.size)), len(force)
    centroid, line_load, by_hertz, peak, at_tip = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    load_share = np.zeros((m, pairs))
    for k in range(m):
        total = TINY
        for i in range(number.size):
            total += force[k, i]
        for i in range(number.size):
            at, share, load = sections[i], force[k, i] / total, largest[k, i]
            length = at.width / mesh.position.inclined
            half_width = half_width_of(max(load, TINY) / at.width, closest.radius[i], mesh.position.flattening)
            centroid[k] += 0.0 if mirrored else share * at.axial + moment[k, i] / total * at.width / 2
            line_load[k] = max(line_load[k], load / length)
            by_hertz[k] = max(by_hertz[k], pressure_of(load / length, half_width))
            peak[k] = max(peak[k], pressure[k, i])
            at_tip[k] += share if _at_tip(mesh, at, closest.foot[i], half_width) else 0.0
            load_share[k, number[i] - first] += share
    return LoadQuantities(centroid, line_load, by_hertz, peak, at_tip, load_share)


@unchecked
def _at_tip(mesh, at, foot, half_width):
    """Whether a contact reaches the mate's tip edge."""
    return arc_of_mate(at, foot) + half_width >= mesh.gears[1 - at.host].edge ** 2 / (2 * at.r_mate)
