"""State of the contact of all tooth pairs at one mesh position under a load: the result of a contact solve."""

from dataclasses import dataclass
from functools import cached_property
from math import pi, sqrt
from typing import NamedTuple

import numpy as np

from fem.contact.contact_slices import ContactSlices
from fem.contact.flank_gap import arc_of_mate, sections_of
from fem.contact.strip_bounds import Strips
from fem.elasticity.face_symmetry import Face
from fem.support.numba_cache import kept_unchecked, unchecked

TINY = np.finfo(float).tiny


class LoadQuantities(NamedTuple):
    """Quantities of a state that follow from the loads on its slices, in the order of a row of `quantities_of`."""

    centroid: float
    line_load: float
    hertz_pressure: float
    peak_pressure: float
    tip_contact: float


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
        """Force centroid, line load, pressures and tip contact."""
        return LoadQuantities(*load_rows(self.slices, self.force[None], self.pressure[None], self.face)[0, :5].tolist())

    def share(self, number: int) -> float:
        """Share of the load that a tooth pair carries; 0 without load."""
        return float(self.force[self.slices.number == number].sum() / max(self.force.sum(), TINY))

    def tip_contact(self) -> float:
        """Share of the load on slices whose contact reaches a tip edge; 0 without load."""
        return self.quantities.tip_contact

    def line_load(self) -> float:
        """Largest force per length of contact line [N/m]."""
        return self.quantities.line_load

    def peak_pressure(self) -> float:
        """Largest contact pressure [Pa]."""
        return self.quantities.peak_pressure

    def hertz_pressure(self) -> float:
        """Largest pressure of the line loads by Hertz, on the curvature of the involutes [Pa]."""
        return self.quantities.hertz_pressure

    def centroid(self) -> float:
        """Axial position of the resultant force [m]; 0 without load."""
        return self.quantities.centroid


def hertz_pressure(slices: ContactSlices, force: np.ndarray) -> np.ndarray:
    """(..., n) largest pressures [Pa] under forces (..., n) [N] by Hertz, on the curvature of the involutes."""
    half_width = slices.half_width(np.maximum(force, TINY) / slices.width)
    return 2 * force / (pi * half_width * slices.length)


def load_rows(
    slices: ContactSlices,
    force: np.ndarray,
    pressure: np.ndarray,
    face: Face,
    moment: np.ndarray | None = None,
    largest: np.ndarray | None = None,
) -> np.ndarray:
    """(m, 5 + n_pair) `LoadQuantities`, then load shares of all tooth pairs, under forces and pressures (m, n).

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
    """`load_rows` of slices of tooth pairs from the first one on; mirrored: whether half of the face is modelled."""
    (number, low, high), (force, moment, largest) = slices, loads
    rows, sections = np.zeros((len(force), 5 + pairs)), sections_of(mesh, number, low, high, np.zeros(number.size))
    for k in range(len(force)):
        row, total = rows[k], TINY
        for i in range(number.size):
            total += force[k, i]
        for i in range(number.size):
            at, share, load = sections[i], force[k, i] / total, largest[k, i]
            length = at.width / mesh.position.inclined
            half_width = sqrt(2 * max(load, TINY) / at.width * closest.radius[i] * mesh.position.flattening)
            row[0] += 0.0 if mirrored else share * at.axial + moment[k, i] / total * at.width / 2
            row[1], row[2] = max(row[1], load / length), max(row[2], 2 * load / (pi * half_width * length))
            row[3] = max(row[3], pressure[k, i])
            row[4] += share if _at_tip(mesh, at, closest.foot[i], half_width) else 0.0
            row[5 + number[i] - first] += share
    return rows


@unchecked
def _at_tip(mesh, at, foot, half_width):
    """Whether a contact reaches the mate's tip edge."""
    return arc_of_mate(at, foot) + half_width >= mesh.gears[1 - at.host].edge ** 2 / (2 * at.r_mate)
