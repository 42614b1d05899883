"""State of the contact of all tooth pairs at one mesh position under a load: the result of a contact solve."""

from dataclasses import dataclass

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.contact.strip_bounds import Strips, at_tip_edge
from fem.elasticity.face_symmetry import Face

TINY = np.finfo(float).tiny


def hertz_pressure(slices: ContactSlices, force: np.ndarray) -> np.ndarray:
    """(..., n) largest pressures [Pa] under forces (..., n) [N] by Hertz, on the curvature of the involutes."""
    half_width = slices.half_width(np.maximum(force, TINY) / slices.width)
    return 2 * force / (np.pi * half_width * slices.length)


@dataclass(frozen=True)
class State:
    """Contact of all tooth pairs under one load.

    te          static transmission error in mid-plane [m]
    slices      slices of tooth pairs that may carry load, on the modelled part of the face
    force       (n,) normal forces on the slices [N]
    pressure    (n,) largest contact pressure in each slice [Pa]
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

    def share(self, number: int) -> float:
        """Share of the load that a tooth pair carries; 0 without load."""
        return self._share(self.slices.number == number)

    def tip_contact(self) -> float:
        """Share of the load on slices whose contact reaches a tip edge; 0 without load."""
        return self._share(at_tip_edge(self.slices, self.force))

    def _share(self, selected: np.ndarray) -> float:
        return float(self.force[selected].sum() / max(self.force.sum(), TINY))

    def line_load(self) -> float:
        """Largest force per length of contact line [N/m]."""
        return float((self.force / self.slices.length).max(initial=0.0))

    def peak_pressure(self) -> float:
        """Largest contact pressure [Pa]."""
        return float(self.pressure.max(initial=0.0))

    def hertz_pressure(self) -> float:
        """Largest pressure of the line loads by Hertz, on the curvature of the involutes [Pa]."""
        return float(hertz_pressure(self.slices, self.force).max(initial=0.0))

    def centroid(self) -> float:
        """Axial position of the resultant force [m]; 0 without load."""
        return self.face.force_centroid(float(self.force @ self.slices.middle / max(self.force.sum(), TINY)))
