"""Flank and root of a tooth on the boundary of a meshed section, and means of shape functions over strips of a flank.

The position of the gear is that of `fem.elasticity.section_mesh`: tooth 0 along y, its left flank is loaded.
"""

import numpy as np
from skfem import Basis, ElementLineP1, ElementLineP2, Mesh

from fem.elasticity.section_mesh import rotated
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.gear.tooth_profile import polar
from fem.support.validation import require
from fem.units import deg

#: Root facets less inclined to the tooth's centre line are left out: their stress comes from the contact beside them.
LEAST_INCLINATION = 20 * deg


def flank_ends(gear: Gear) -> np.ndarray:
    """(2,) arc lengths of root form and tip [m]."""
    return tooth_profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))


def inward_normal(gear: Gear, tooth: int, arcs: np.ndarray) -> np.ndarray:
    """(3, ...) unit normals into the flank at arc lengths (...)."""
    tangent = tooth_profile.tangent_angle(gear, arcs, tooth)
    transverse = np.cos(gear.beta_b)
    axial = gear.sign * np.sin(gear.beta_b) + 0 * tangent
    return np.stack([transverse * np.sin(tangent), -transverse * np.cos(tangent), axial])


def outline(gear: Gear, mesh: Mesh, tooth: int) -> tuple[np.ndarray, np.ndarray]:
    """Boundary facets of a section on the loaded side of a tooth: on its flank, and on the root below it."""
    facets = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, facets]]
    radius, psi = polar(gear, ends).r, polar(gear, ends.mean(axis=1)).psi
    angle = gear.sign * ((psi - 2 * np.pi * tooth / gear.z + np.pi) % (2 * np.pi) - np.pi)
    steep = np.ptp(radius, axis=0) > 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]))
    loaded_side = (angle > 0) & (angle < np.pi / abs(gear.z))
    above_root = radius.min(axis=0) > gear.r_form - 1e-9 * abs(gear.r_form)
    below_flank = radius.max(axis=0) < gear.r_form + 1e-9 * abs(gear.r_form)
    below_flank &= radius.min(axis=0) > gear.r_f - 1e-4 * abs(gear.r_f)
    order = np.argsort(-angle)
    return facets[order][(loaded_side & above_root & steep)[order]], facets[order][(loaded_side & below_flank)[order]]


def inclination(gear: Gear, mesh: Mesh, tooth: int) -> np.ndarray:
    """(n,) angles of the root's facets to the tooth's centre line [rad]; negative where an undercut tooth widens."""
    facets = outline(gear, mesh, tooth)[1]
    start, end = mesh.p[:, mesh.facets[:, facets]].transpose(1, 0, 2)
    x, y = rotated(end - start, -2 * np.pi * tooth / gear.z)
    return np.arctan2(x * np.sign(y), np.abs(y))


def bent_root(gear: Gear, mesh: Mesh, tooth: int) -> np.ndarray:
    """Facets of the root whose stress comes from bending rather than from the contact beside it."""
    return outline(gear, mesh, tooth)[1][inclination(gear, mesh, tooth) >= LEAST_INCLINATION]


def flank_shares(gear: Gear, section: Basis, tooth: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_dofs, n_strip) means of the shape functions of a section over strips low to high of a tooth's flank."""
    mesh, (facets, _) = section.mesh, outline(gear, section.mesh, tooth)
    require(facets.size > 0, f"tooth {tooth} is not on the mesh; raise the density's teeth")
    nodes = mesh.facets[:, facets]
    dofs = [*section.dofs.nodal_dofs[0][nodes]]
    if section.elem.facet_dofs:
        dofs.append(section.dofs.facet_dofs[0][facets])
    return strip_means(tooth_profile.arc_at(gear, mesh.p[:, nodes]), np.stack(dofs), section.N, low, high)


def strip_means(ends: np.ndarray, dofs: np.ndarray, n: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n, n_strip) means over strips low to high of the shape functions of line elements.

    ends        (2, n_element) ends of the elements
    dofs        (2 or 3, n_element) their dofs, of n in total: those at both ends, and the middle one of quadratic ones
    """
    points, weights = np.polynomial.legendre.leggauss(3)
    low = np.maximum(ends.min(axis=0)[:, None], low)
    high = np.maximum(np.minimum(ends.max(axis=0)[:, None], high), low)
    positions = (low + high)[..., None] / 2 + (high - low)[..., None] / 2 * points
    local = (positions - ends[0][:, None, None]) / (ends[1] - ends[0])[:, None, None]
    covered = (high - low).sum(axis=0)
    share = np.divide(high - low, covered, out=np.zeros_like(high), where=covered > 0)
    element, means = ElementLineP2() if len(dofs) == 3 else ElementLineP1(), np.zeros((n, share.shape[1]))
    for shape, dof in enumerate(dofs):
        np.add.at(means, dof, element.lbasis(local[None], shape)[0] @ (weights / 2) * share)
    return means
