"""Cracks in the roots of teeth by the share of the tooth's stiffness that they take."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from fem.contact.contact_slices import ContactSlices
from fem.contact.line_contact import DEPTH, compliance_at
from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import ToothContact
from fem.gear.gear import Gear
from fem.microgeometry.deviation import Crack, lever_of
from fem.pair.mesh_position import MeshPosition
from fem.pair.pair import GearPair
from fem.ste.map_solver import compliances_of
from fem.support.arguments import Finite, checked
from fem.support.validation import require

#: Offsets of the gear like itself, all 0.
OFFSETS = "axial", "misalignment", "f_sigma_delta", "f_sigma_beta"
#: Number of centre distances that are tried.
MOST_STEPS = 30


@checked
def crack(gear: Gear, lost: Finite) -> Crack:
    """The crack by which a tooth of the gear loses a share of its stiffness, in (0, 1).

    The stiffness is that of the tooth of the gear's own finite elements, body and root included, under a line load over
    its face at the working pitch circle of the gear with a gear like itself, without the flattening within m_n / 5 of
    the load. The crack is a hinge at the root circle on the centre line of the tooth: it adds most under loads at the
    tip.

        fem.Gear(..., flank=(fem.OnTooth(5, fem.crack(gear, lost=0.1)),))

    Raises ValueError for a share out of range, and for internal gears.
    """
    require(0 < lost < 1, f"lost must lie in (0, 1), a share of the tooth's stiffness, got {lost}")
    require(gear.z > 0, f"gear must be external, got z = {gear.z}: teeth of a ring bend with its rim")
    pair = _with_a_gear_like_itself(replace(gear, flank=()))
    offsets = {"a": np.array([pair.a])} | dict.fromkeys(OFFSETS, np.zeros(1))
    bodies, slices = compliances_of(pair, offsets, Resolution())
    position = MeshPosition(pair, pair.a, 0.0, 0.0, candidates=range(1))
    contact = ToothContact(position, *bodies, slices)
    whole = contact.slicing.whole
    of_slices = ContactSlices(position, whole.number, whole.low, whole.high, mesh=contact.slicing.mesh)
    closest = np.zeros((whole.number.size, 1))
    compliance = compliance_at(of_slices, DEPTH * gear.m_n, closest, contact.bodies, contact.face)
    share = whole.width / whole.width.sum()
    of_tooth = float(share @ compliance @ share) * contact.face.share / 2
    lever = float(lever_of(gear.r_f, gear.psi_b, gear.r_b, position.path.pitch)) * float(np.cos(gear.beta_b))
    return Crack(of_tooth / lever**2 * lost / (1 - lost), gear.r_f, gear.psi_b)


def _with_a_gear_like_itself(gear: Gear) -> GearPair:
    """The gear and its mirror image, at the least centre distance at which their tips are free (steps of m_n / 10)."""
    mate = replace(gear, beta=-gear.beta)
    for step in range(MOST_STEPS):
        with suppress(ValueError):
            return GearPair(gear, mate, a=2 * gear.r + step * gear.m_n / 10)
    raise ValueError("gear does not run with a gear like itself, by which its stiffness is found; reduce d_a")
