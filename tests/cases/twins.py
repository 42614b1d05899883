"""A gear as its transverse section in plane strain, for the contact of `fem.contact.tooth_contact`."""

import numpy as np
from contacts import contact_of

import fem
from fem import Density
from fem.elasticity.face_symmetry import HalfFace
from fem.elasticity.flank_compliance import Compliance, uniform_load_compliance
from fem.elasticity.half_space import along_line, half_plane
from fem.elasticity.hat_functions import values_of_means
from fem.elasticity.section_mesh import flank_hats
from fem.pair.hertz import flattening
from fem.units import mm


def plane_twin(gear: fem.Gear, density: Density, refined: int) -> Compliance:
    """Compliance of the refined section in plane strain."""
    arcs, half, depth = flank_hats(gear, density), gear.b / 2, 1 * mm
    blocks = uniform_load_compliance(gear, arcs, density.refined(refined))
    blocks[0] -= half_plane(gear, arcs, depth)
    values = values_of_means(arcs)
    blocks = np.einsum("hi,dij,kj->dhk", values, blocks, values)[:, None, :, None, :] / half * np.ones((1, 2, 1, 2, 1))
    blocks[0] -= flattening(gear.material) * along_line(np.array([0.0, half]), half, depth, HalfFace())[0, 0]
    return Compliance(
        arcs, np.array([0.0, half]), half, blocks[: density.teeth + 1], blocks[density.teeth + 1 :], HalfFace()
    )


def twin_te(pair: fem.GearPair, twin: Compliance, phase: float, force: float) -> float:
    """Transmission error [m] of a pair of equal gears."""
    return contact_of(pair, (twin, twin), phase, 1).state(force).te
