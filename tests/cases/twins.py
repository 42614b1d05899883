"""A gear as its transverse section in plane strain, for `fem.contact.tooth_contact`, and its rim in space."""

from dataclasses import replace
from functools import partial

import numpy as np
from contacts import contact_of
from line_contact import modulus
from whole_section import FACES, solid_prism

import fem
from fem import Density
from fem.elasticity.flank_compliance import Compliance, flank_forces, lines_across, uniform_load_compliance
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
    arcs = flank_hats(gear, density)
    harmonics = harmonics_of(Prism(gear, None, np.ones((1, 1)), FACES["any"]), density.refined(refined), arcs)
    flank = harmonics["flank"].reshape(-1, 2, 2, 1, arcs.size) @ values_of_means(arcs).T * np.ones((2, 1))
    of_width = {"stiffness": harmonics["stiffness"] * gear.b}
    return bending_of(gear, of_width, flank, FACES["equal"].share)


def harmonics_of(prism: Prism, density: Density, arcs: np.ndarray) -> dict[str, np.ndarray]:
    """Harmonics of the rim of a gear that nothing holds, under forces on the hats of its flanks."""
    forces = partial(flank_forces, gear=prism.gear, arcs=arcs)
    return rim_harmonics(replace(prism, clamped=False), density, forces)


def bending_of(gear: fem.Gear, harmonics: dict[str, np.ndarray], flank: np.ndarray, share: float) -> RimBending:
    """Bending of the rim between the supports of a gear; share: of the face width that is modelled."""
    return rim_bending(harmonics, flank, gear.support, abs(gear.r_clamp), share, abs(gear.z))


def yield_by_bending(gear: fem.Gear, density: Density) -> float:
    """What supports add to the displacement of the flank under its even load [m/N], as in a map, on the same mesh."""
    prism, arcs = solid_prism(gear, density, "any"), flank_hats(gear, density)
    harmonics = harmonics_of(prism, density, arcs)
    flank = harmonics["flank"].reshape(-1, 2, 2, prism.spread.shape[1], arcs.size)
    rim = bending_of(gear, harmonics, flank, prism.face.share)
    axial = prism.face.positions(lines_across(gear, density, gear.b)[0])
    of_hats = [np.trapezoid(np.eye(x.size), x, axis=1) / np.ptp(x) for x in (axial, arcs)]
    load = np.multiply.outer(*of_hats).ravel()
    modes = rim.modes(0.0, range(1)).normal.reshape(-1, load.size) @ load
    return float(modes @ modes + load @ harmonics["free"][0] @ load)


def twin_te(pair: fem.GearPair, twin: Compliance, phase: float, force: float) -> float:
    """Transmission error [m] of a pair of equal gears."""
    return contact_of(pair, (twin, twin), phase, 1).state(force).te
