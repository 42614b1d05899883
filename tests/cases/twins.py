"""A gear as its transverse section in plane strain, for the contact of `fem.contact.tooth_contact`."""

from functools import partial

import numpy as np
from contacts import contact_of
from line_contact import modulus
from whole_section import FACES

import fem
from fem import Density
from fem.elasticity.flank_compliance import Compliance, flank_forces, uniform_load_compliance
from fem.elasticity.half_space import along_line, half_plane
from fem.elasticity.hat_functions import values_of_means
from fem.elasticity.pitch_condensation import Prism
from fem.elasticity.rim_bending import RimBending, rim_bending
from fem.elasticity.rim_harmonics import rim_harmonics
from fem.elasticity.section_mesh import flank_hats
from fem.units import mm


def section_compliance(gear: fem.Gear, hats: Density, density: Density) -> np.ndarray:
    """(n_tooth, n_hat, n_hat) displacements in plane strain per line load on the hats of a density [m^2/N]."""
    return uniform_load_compliance(gear, flank_hats(gear, hats), density)


def line_flattening(material: fem.Material, end: float, depth: float) -> float:
    """Displacement [m/N] of a half-space at a depth [m] by an even line of force that ends at the faces, +-end [m]."""
    return 1 / (np.pi * modulus(material)) * along_line(np.array([0.0, end]), end, depth, FACES["equal"])[0, 0]


def plane_twin(gear: fem.Gear, density: Density, refined: int) -> Compliance:
    """Compliance of the refined section in plane strain."""
    arcs, half, depth = flank_hats(gear, density), gear.b / 2, 1 * mm
    blocks = section_compliance(gear, density, density.refined(refined))
    blocks[0] -= half_plane(gear, arcs, depth)
    values = values_of_means(arcs)
    blocks = np.einsum("hi,dij,kj->dhk", values, blocks, values)[:, None, :, None, :] / half * np.ones((1, 2, 1, 2, 1))
    blocks[0] -= line_flattening(gear.material, half, depth)
    normal, along, rim = blocks[: density.teeth + 1], blocks[density.teeth + 1 :], plane_rim(gear, density, refined)
    return Compliance(arcs, np.array([0.0, half]), half, normal, along, FACES["equal"], rim=rim)


def plane_rim(gear: fem.Gear, density: Density, refined: int) -> RimBending | None:
    """What the bending of a supported rim adds in plane strain."""
    if not gear.support:
        return None
    prism, arcs = Prism(gear, None, np.ones((1, 1)), FACES["any"], clamped=False), flank_hats(gear, density)
    harmonics = rim_harmonics(prism, density.refined(refined), partial(flank_forces, gear=gear, arcs=arcs))
    flank = harmonics["flank"].reshape(-1, 2, 2, 1, arcs.size) @ values_of_means(arcs).T * np.ones((2, 1))
    of_width = {"stiffness": harmonics["stiffness"] * gear.b}
    return rim_bending(of_width, flank, gear.support, abs(gear.r_clamp), FACES["equal"].share, abs(gear.z))


def twin_te(pair: fem.GearPair, twin: Compliance, phase: float, force: float) -> float:
    """Transmission error [m] of a pair of equal gears."""
    return contact_of(pair, (twin, twin), phase, 1).state(force).te
