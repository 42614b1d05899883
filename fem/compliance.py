"""Flank compliance of one gear by one factorization, with the local flattening split off.

A load on the flank of tooth 0 is a sum of hats along the profile times slices across the width. What the solid adds to
a half-plane under the same load is smooth and is tabulated here; the half-plane itself is closed form (`hertz`), so
that the contact may be as fine as it likes. The 3D solution sits on a coarse mesh; plane-strain twins of the section,
one on the same mesh and one refined, replace its error near the load.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementLineP2, ElementQuad1, ElementQuad2, MeshQuad

from fem import mesh as meshes
from fem.cache import Arrays, cached
from fem.gear import Gear, Material
from fem.hertz import flattening, log_mean
from fem.mesh import BORE, Density
from fem.solver import factorize

STRIPS_PER_INTERVAL = 12


@dataclass(frozen=True)
class Compliance:
    """Smooth part of the flank compliance of one gear.

    arcs        (n_hat,) arc lengths of the hats' tops along the flank [m]
    slices      (n_slice + 1,) edges of the slices [m], from mid-plane or from end face to end face
    blocks      (n_teeth, n_slice, n_hat, n_slice, n_hat) displacement into tooth d at a slice and hat per force on
                tooth 0 at a slice and hat [m/N]; from mid-plane on: the same forces act on both halves of the width
    """

    arcs: np.ndarray
    slices: np.ndarray
    blocks: np.ndarray

    @property
    def share(self) -> float:
        """Share of the face width, and of the load, that lies on the slices."""
        return 0.5 if self.slices[0] == 0 else 1.0

    @property
    def width(self) -> float:
        """Width that can carry load [m]."""
        return float(self.slices[-1] - self.slices[0]) / self.share


def flank_compliance(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> Compliance:
    """Compliance of the gear clamped at its bore, from the cache where it was computed before.

    loaded      width of the part of the face that can carry load, in its middle [m]
    whole       slices from end face to end face, for loads that differ on the two halves: one more factorization
    """
    arcs, line = meshes.flank_arcs(gear, density.flank), meshes.half_width(gear.b, loaded, density.width)
    edges = meshes.divided(np.sort(line.p[0])[: density.width + 1], density.slices)
    body = f"{replace(gear, flank=())} {density}"
    near = cached(f"near field 2 {body}", lambda: {"blocks": near_field(gear, arcs, density)})["blocks"]

    def halves(odd: bool) -> np.ndarray:
        def compute() -> Arrays:
            section = meshes.section(gear, density)
            return {"blocks": solid(gear, arcs, section, line, edges, density.teeth, odd=odd)}

        blocks = cached(f"solid 2 {body} {loaded} {odd}", compute)["blocks"]
        for j, width in enumerate(np.diff(edges)):
            blocks[:, j, :, j, :] += near / width
        return blocks

    even = halves(odd=False)
    if not whole:
        return Compliance(arcs, edges, even)
    return Compliance(arcs, np.concatenate([-edges[:0:-1], edges]), both_halves(even, halves(odd=True)))


def near_field(gear: Gear, arcs: np.ndarray, density: Density) -> np.ndarray:
    """(teeth + 1, n_hat, n_hat) what plane strain on the refined section adds to that on the coarse one [m^2/N].

    On the loaded tooth itself the half-plane is taken out.
    """
    coarse, finer = meshes.section(gear, density), meshes.section(gear, density.refined(2))
    fine = plane_strain(gear, arcs, finer, ElementQuad2(), density.teeth)
    fine[0] -= half_plane(gear, arcs)
    return fine - plane_strain(gear, arcs, coarse, ElementQuad1(), density.teeth)


def both_halves(even: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """Blocks over the whole width from those under loads alike and opposite on the two halves."""
    same, other = (even + odd) / 2, (even - odd) / 2
    back = slice(None, None, -1)
    upper = np.concatenate([same[:, back, :, back], other[:, back]], axis=3)
    lower = np.concatenate([other[:, :, :, back], same], axis=3)
    return np.concatenate([upper, lower], axis=1)


def half_plane(gear: Gear, arcs: np.ndarray) -> np.ndarray:
    """(n_hat, n_hat) mean displacement over hats per line load on hats if the flank bounded a half-plane [m^2/N]."""
    strips = meshes.divided(arcs, STRIPS_PER_INTERVAL)
    centres, widths = (strips[1:] + strips[:-1]) / 2, np.diff(strips)
    share = hats(arcs, centres) * widths
    share /= share.sum(axis=1, keepdims=True)
    mean = log_mean(centres[:, None] - centres, widths[:, None], widths)
    return flattening(gear.material) * share @ mean @ share.T


def hats(arcs: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n_hat, ...) values of the hat functions with tops at arcs."""
    return np.stack([np.interp(at, arcs, row) for row in np.eye(arcs.size)])


def lame_parameters(material: Material) -> tuple[float, float]:
    """Lame's parameters lambda and mu [Pa]."""
    E, nu = material.E, material.nu
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def elasticity(products: list[list[sp.csr_matrix]], lame: float, mu: float) -> sp.csr_matrix:
    """Stiffness matrix from products[a][b] = integral of d_a v d_b u; dofs numbered component by component."""
    axes = range(len(products))
    laplace = sum((products[k][k] for k in axes[1:]), products[0][0])
    rows = [[lame * products[a][b] + mu * products[b][a] + (a == b) * mu * laplace for b in axes] for a in axes]
    return sp.csr_matrix(sp.bmat(rows))


def products(basis: Basis) -> list[list[sp.csr_matrix]]:
    """Integrals of d_a v d_b u for a, b over the coordinates and, last, over no derivative."""
    parts = [lambda u, a=a: u.grad[a] for a in range(basis.mesh.dim())] + [lambda u: u]
    return [[BilinearForm(lambda u, v, w, a=a, b=b: a(v) * b(u)).assemble(basis) for b in parts] for a in parts]


def extruded_products(section: Basis, across: Basis) -> list[list[sp.csr_matrix]]:
    """Integrals of d_a v d_b u over the prism, a, b in (x, y, z): products of those over section and width."""
    plane, width = products(section), products(across)
    return [[sp.kron(plane[a][b], width[a < 2][b < 2], "csr") for b in range(3)] for a in range(3)]


def flank_loads(gear: Gear, basis: Basis, arcs: np.ndarray, tooth: int) -> np.ndarray:
    """(2 n_dofs, n_hat) unit forces into the flank of a tooth, spread as hats."""
    mesh, facets = basis.mesh, _flank_facets(gear, basis.mesh, tooth)
    points, weights = np.polynomial.legendre.leggauss(4)
    share = (points + 1) / 2
    ends = mesh.p[:, mesh.facets[:, facets]]
    at = ends[:, 0, :, None] * (1 - share) + ends[:, 1, :, None] * share
    density = hats(arcs, (at[0] ** 2 + at[1] ** 2 - gear.r_b**2) / (2 * gear.r_b))
    edge = ends[:, 1] - ends[:, 0]
    total = np.einsum("hfg,g,f->h", density, weights / 2, np.hypot(*edge))
    inward = np.stack([edge[1], -edge[0]]) * np.sign(edge[0] * at[0].mean(axis=1) + edge[1] * at[1].mean(axis=1))
    loads = np.zeros((2, basis.N, arcs.size))
    for dofs, shape in _facet_shapes(basis, facets, share):
        loads += _scattered(dofs, np.einsum("hfg,g,cf->cfh", density * shape, weights / 2, inward), basis.N)
    return (loads / total).reshape(-1, arcs.size)


def _scattered(dofs: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """(2, n, n_hat) sums of values (2, n_facet, n_hat) that belong to the same dof."""
    summing = sp.csr_matrix((np.ones(dofs.size), (dofs, np.arange(dofs.size))), shape=(n, dofs.size))
    return np.stack([summing @ component for component in values])


def _facet_shapes(basis: Basis, facets: np.ndarray, share: np.ndarray):
    """Pairs of dofs (n_facet,) and values (n_point,) of the shape functions that live on straight facets."""
    one, other = basis.dofs.nodal_dofs[0][basis.mesh.facets[:, facets]]
    if not basis.elem.facet_dofs:
        return [(one, 1 - share), (other, share)]
    quadratic = [(1 - share) * (1 - 2 * share), share * (2 * share - 1), 4 * share * (1 - share)]
    return list(zip((one, other, basis.dofs.facet_dofs[0][facets]), quadratic, strict=True))


def _flank_facets(gear: Gear, mesh: MeshQuad, tooth: int) -> np.ndarray:
    """Facets of the involute that faces counter-clockwise on the given tooth."""
    x, y = mesh.p[:, mesh.facets].mean(axis=1)
    angle = np.arctan2(-x, y) - 2 * np.pi * tooth / gear.z
    ends = np.hypot(*mesh.p)[mesh.facets]
    low, high = gear.r_form * (1 - 1e-9), gear.r_a * (1 + 1e-9)
    on_flank = (ends.min(axis=0) > low) & (ends.max(axis=0) < high) & (np.ptp(ends, axis=0) > gear.m_n * 1e-6)
    near = (angle > 0) & (angle < np.pi / gear.z)
    boundary = np.zeros(mesh.facets.shape[1], bool)
    boundary[mesh.boundary_facets()] = True
    return np.flatnonzero(on_flank & near & boundary)


def plane_strain(gear: Gear, arcs, mesh: MeshQuad, element, teeth: int) -> np.ndarray:
    """(teeth + 1, n_hat, n_hat) displacement into tooth d per line load on tooth 0 [m^2/N]."""
    basis = Basis(mesh, element)
    stiffness = elasticity([row[:2] for row in products(basis)[:2]], *lame_parameters(gear.material))
    clamped = basis.get_dofs(BORE).all()
    free = np.setdiff1d(np.arange(2 * basis.N), np.concatenate([clamped, clamped + basis.N]))
    loads = [flank_loads(gear, basis, arcs, tooth)[free] for tooth in range(teeth + 1)]
    moved = factorize(stiffness[free][:, free])(loads[0])
    return np.stack([load.T @ moved for load in loads])


def solid(gear: Gear, arcs, section: MeshQuad, line, edges, teeth: int, *, odd: bool) -> np.ndarray:
    """(teeth + 1, n_slice, n_hat, n_slice, n_hat) displacement into tooth d per force on tooth 0 [m/N].

    odd         the loads on the other half of the width are opposite rather than alike
    """
    basis, across = Basis(section, ElementQuad1()), Basis(line, ElementLineP2())
    stiffness = elasticity(extruded_products(basis, across), *lame_parameters(gear.material))
    clamped = np.zeros((3, basis.N, across.N), bool)
    clamped[:, basis.get_dofs(BORE).all()] = True
    middle = across.doflocs[0] < edges[1] * 1e-9
    for component in (0, 1) if odd else (2,):
        clamped[component, :, middle] = True
    free = np.flatnonzero(~clamped)
    slices = _slice_loads(across, edges)
    loads = []
    for tooth in range(teeth + 1):
        hat_loads = flank_loads(gear, basis, arcs, tooth)
        inplane = np.einsum("cnh,ms->cnmsh", hat_loads.reshape(2, basis.N, -1), slices)
        full = np.concatenate([inplane, np.zeros_like(inplane[:1])]).reshape(stiffness.shape[0], -1)
        loads.append(sp.csr_matrix(full[free]))
    column = (free // across.N) % basis.N
    moved = factorize(stiffness[free][:, free], column, section_graph(basis))(loads[0].toarray())
    shape = (slices.shape[1], arcs.size)
    return np.stack([(load.T @ moved).reshape(shape + shape) for load in loads])


def section_graph(basis: Basis) -> sp.csr_matrix:
    """Positive definite matrix that couples the nodes which share an element."""
    pattern = BilinearForm(lambda u, v, w: u * v).assemble(basis)
    return pattern + sp.diags_array(np.asarray(pattern.sum(axis=1)).ravel())


def _slice_loads(basis: Basis, edges: np.ndarray) -> np.ndarray:
    """(n_dofs, n_slice) unit forces spread evenly over each slice of the width."""
    points, weights = np.polynomial.legendre.leggauss(3)
    low, high = edges[:-1, None], edges[1:, None]
    at = (low + high) / 2 + (high - low) / 2 * points
    values = basis.probes(at.reshape(1, -1)).toarray().reshape(*at.shape, -1)
    return np.einsum("sgn,g->ns", values, weights / 2)
