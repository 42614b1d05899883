"""A gear of finite elements, clamped at its rigid hub, in the hub's frame; the flanks that may touch."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import Basis, MeshQuad
from skfem.element import Element

from fem import mesh as meshes
from fem import profile
from fem.flank import edges
from fem.gear import Gear, GearPair
from fem.mesh import Density
from fem.solid import Solid, solid, stiffness
from fem.solver import Solve, factorize
from fem.touch import Flank, Width, shape_functions

TEETH = (-1, 0, 1)
#: Edges of the mesh keep this distance from one another and from the ends of the flank, in modules.
APART = 1 / 100


@dataclass(frozen=True)
class Body:
    """Displacements of a body are arrays (n_dofs, dim); the hub and, in space, the cut in mid-plane hold some of them.

    share       of the face width that is modelled: one half in space
    solid       the elements
    free        (n_free,) flat numbers of the displacements that nothing holds
    flanks      of the teeth TEETH
    """

    share: float
    solid: Solid
    free: np.ndarray
    flanks: dict[int, Flank]

    def rest(self) -> np.ndarray:
        return np.zeros_like(self.solid.places)

    def solver(self, mass: np.ndarray | float = 0.0) -> Solve:
        """Solution (n_dofs, dim, n) for the stiffness at rest plus a diagonal mass (n_dofs,) [N/m]."""
        dim = self.solid.places.shape[1]
        diagonal = np.repeat(mass + np.zeros(len(self.solid.places)), dim)
        matrix = (stiffness(self.solid) + sp.diags_array(diagonal)).tocsr()
        solve = factorize(matrix[self.free][:, self.free], self.columns[self.free // dim] if dim == 3 else None)

        def answer(force: np.ndarray) -> np.ndarray:
            u = np.zeros((self.solid.places.size, force[0, 0].size))
            u[self.free] = solve(np.ascontiguousarray(force.reshape(u.shape)[self.free])).reshape(self.free.size, -1)
            return u.reshape(force.shape)

        return answer

    @property
    def columns(self) -> np.ndarray:
        """(n_dofs,) number of the place in the transverse section over which each dof lies."""
        places = np.round(self.solid.places[:, :2] / (1e-6 * np.ptp(self.solid.places)))
        return np.unique(places, axis=0, return_inverse=True)[1].ravel()

    def in_plane(self, nodes: np.ndarray) -> np.ndarray:
        """Flat numbers (..., 2) of the in-plane displacements of nodes (...)."""
        return self.solid.places.shape[1] * nodes[..., None] + np.arange(2)

    @property
    def flank_dofs(self) -> np.ndarray:
        """Flat numbers of the in-plane displacements of all flanks, tooth by tooth."""
        return np.concatenate([self.in_plane(self.flanks[tooth].nodes).ravel() for tooth in TEETH])

    def reshaped(self, gear: Gear) -> "Body":
        """The same finite elements with the flank modifications of another gear."""
        return replace(self, flanks={tooth: replace(flank, gear=gear) for tooth, flank in self.flanks.items()})


def clamped_pair(pair: GearPair, density: Density, element: Element) -> tuple[Body, Body]:
    """Pinion and wheel as `clamped` makes them on the mesh of `with_edges`; like gears share their solid."""
    densities = with_edges(pair, density)
    pinion = clamped(pair.pinion, densities[0], element)
    if densities[0] == densities[1] and replace(pair.wheel, flank=()) == replace(pair.pinion, flank=()):
        return pinion, pinion.reshaped(pair.wheel)
    return pinion, clamped(pair.wheel, densities[1], element)


def with_edges(pair: GearPair, density: Density) -> tuple[Density, Density]:
    """Densities of pinion and wheel: edges, unless given, where reliefs begin, the gear's own and the mate's on it."""
    if density.edges is not None:
        return density, density
    pinion, wheel = (distinct(gear, edges(gear.drive_flank, gear.face)) for gear in (pair.pinion, pair.wheel))
    across = pair.a * np.sin(pair.alpha_wt)
    on_pinion = distinct(pair.pinion, [*pinion, *(across - roll for roll in wheel)])
    on_wheel = distinct(pair.wheel, [*wheel, *(across - roll for roll in pinion)])
    return replace(density, edges=on_pinion), replace(density, edges=on_wheel)


def distinct(gear: Gear, rolls: Iterable[float]) -> tuple[float, ...]:
    """Those roll lengths on the flank that are APART from its ends and from one another, increasing [m]."""
    found, apart = [gear.roll_form], APART * gear.m_n
    for roll in sorted(rolls):
        if found[-1] + apart < roll < gear.roll_tip - apart:
            found.append(roll)
    return tuple(found[1:])


def clamped(gear: Gear, density: Density, element: Element) -> Body:
    """Gear on quadrilaterals (plane strain) or on hexahedra from mid-plane to end face, as the element wants."""
    mesh, degree = meshes.section(gear, density), element.maxdeg // element.dim
    if element.dim == 2:
        width = Width(np.zeros(1), np.array([gear.b]), np.ones((1, 1)), np.ones((1, 1)))
        elements = solid(Basis(mesh, element, intorder=2 * degree + 1), gear.material, gear.b)
    else:
        line = meshes.half_width(gear.b, gear.b, density.width)
        width = stations(meshes.divided(np.sort(line.p[0]), degree), degree)
        elements = solid(Basis(meshes.extruded(mesh, line), element, intorder=2 * degree + 1), gear.material)
    flanks = {tooth: flank_of(gear, mesh, elements.places, tooth, width, degree) for tooth in TEETH}
    return Body(1.0 if element.dim == 2 else 0.5, elements, np.flatnonzero(~held(gear, elements.places)), flanks)


def held(gear: Gear, places: np.ndarray) -> np.ndarray:
    """(n_dofs, dim) whether the hub or the symmetry about mid-plane holds a displacement."""
    found = np.zeros(places.shape, bool)
    found[np.hypot(places[:, 0], places[:, 1]) < gear.d_bore / 2 * (1 + 1e-6)] = True
    if places.shape[1] == 3:
        found[places[:, 2] < gear.b * 1e-9, 2] = True
    return found


def stations(nodes: np.ndarray, degree: int) -> Width:
    """Two Gauss points in each interval between nodes (n,) of elements of that degree."""
    points, weights = np.polynomial.legendre.leggauss(2)
    long = np.diff(nodes)[:, None]
    places = (nodes[:-1, None] + long * (points + 1) / 2).ravel()
    hats = np.stack([np.interp(places, nodes, one) for one in np.eye(nodes.size)], axis=1)
    return Width(places, (long * weights / 2).ravel(), hats, shape_functions(nodes, degree)(places))


def flank_of(gear: Gear, section: MeshQuad, places: np.ndarray, tooth: int, width: Width, degree: int) -> Flank:
    """Flank of a tooth on the dofs at places (n_dofs, dim) of elements of that degree above the mesh of a section."""
    line = meshes.divided(meshes.flank_nodes(gear, section, tooth), degree)
    off, place = cKDTree(line.T).query(places[:, :2])
    nodes = np.flatnonzero(off < 1e-6 * gear.m_n)
    across = places[nodes, 2] if places.shape[1] == 3 else 0.0 * nodes
    order = nodes[np.lexsort((across, place[nodes]))].reshape(-1, width.hats.shape[1])
    arcs = profile.arc_length(gear, np.sqrt(np.maximum((line**2).sum(axis=0) - gear.r_b**2, 0)))
    return Flank(gear, tooth, arcs, order, width, degree)


def flexibility(body: Body, solve: Solve, block: int = 64) -> np.ndarray:
    """(n, n) displacement of the flanks' dofs per force on them under solve [m/N]."""
    dofs, columns = body.flank_dofs, []
    for start in range(0, dofs.size, block):
        some = dofs[start : start + block]
        force = np.zeros((body.solid.places.size, some.size))
        force[some, np.arange(some.size)] = 1.0
        columns.append(solve(force.reshape(*body.solid.places.shape, -1)).reshape(force.shape)[dofs])
    matrix = np.hstack(columns)
    return (matrix + matrix.T) / 2
