"""A gear of finite elements, clamped at its rigid hub, in the hub's frame; the flanks that may touch."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import Basis, ElementQuad1, ElementQuad2
from skfem.element import Element

from fem.elasticity import extrusion, section_mesh
from fem.elasticity.mesh_density import Density
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.linalg.direct_solver import Solve, factorize
from fem.microgeometry.flank import edges, removed
from fem.pair.pair import GearPair
from fem.reference.mortar import Flank, Width, shape_functions
from fem.reference.st_venant_kirchhoff import Solid, solid, stiffness

#: Gears that bend meet so much earlier and later, in pitches.
EARLIER = 1 / 4
#: Edges of the mesh keep this distance from one another and from the ends of the flank, in modules.
APART = 1 / 100
#: Flanks are alike that differ by less [m].
ALIKE = 1e-9


@dataclass(frozen=True)
class Body:
    """Displacements of a body are arrays (n_dofs, dim); the hub and a cut in mid-plane hold some of them.

    share       of the face width that is modelled: in space one half where both are alike
    solid       the elements
    columns     (n_dofs,) number of the dof of the transverse section over which each lies, or along whose helix
    free        (n_free,) flat numbers of the displacements that nothing holds
    flanks      of the teeth that may touch
    """

    share: float
    solid: Solid
    columns: np.ndarray
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

    @cached_property
    def transverse(self) -> sp.csr_matrix:
        """Displacements of the flanks in transverse planes, as `Flank.transverse`, tooth by tooth, of flat ones."""
        dim = self.solid.places.shape[1]
        maps = np.concatenate([flank.transverse[..., :dim].reshape(-1, 2, dim) for flank in self.flanks.values()])
        nodes = np.concatenate([flank.nodes.ravel() for flank in self.flanks.values()])
        columns = np.broadcast_to(dim * nodes[:, None, None] + np.arange(dim), maps.shape)
        starts = np.arange(0, maps.size + 1, dim)
        return sp.csr_matrix((maps.ravel(), columns.ravel(), starts), (starts.size - 1, self.solid.places.size))

    def reshaped(self, gear: Gear) -> "Body":
        """The same finite elements with the flank modifications of another gear."""
        return replace(self, flanks={tooth: replace(flank, gear=gear) for tooth, flank in self.flanks.items()})


def clamped_pair(pair: GearPair, density: Density, element: Element) -> tuple[Body, Body]:
    """Pinion and wheel as `clamped` makes them on the mesh of `with_edges`; like gears share their solid."""
    n, whole = farthest_tooth(pair), not all(map(alike_halves, (pair.pinion, pair.wheel)))
    density = density.with_teeth(max(density.teeth, n), max(density.behind, n))
    densities, of = with_edges(pair, density), partial(clamped, element=element, teeth=range(-n, n + 1), whole=whole)
    pinion = of(pair.pinion, densities[0])
    if densities[0] == densities[1] and replace(pair.wheel, flank=()) == replace(pair.pinion, flank=()):
        return pinion, pinion.reshaped(pair.wheel)
    return pinion, of(pair.wheel, densities[1])


def farthest_tooth(pair: GearPair) -> int:
    """Number of the last tooth that may touch within half a mesh cycle from the pitch point, either way."""
    rolls = (pair.pinion.roll_tip, pair.wheel.roll_tip)
    pitch_points = (pair.roll_pitch, pair.path_of_contact.on_wheel(pair.roll_pitch))
    path = max(np.subtract(rolls, pitch_points)) + pair.b / 2 * np.tan(abs(pair.beta_b))
    return max(1, int(path / pair.p_bt + 1 / 2 + EARLIER))


def alike_halves(gear: Gear) -> bool:
    """Whether the gear is symmetric about mid-plane."""
    added = added_across(gear)
    return gear.beta == 0 and bool(np.abs(added - added[:, ::-1]).max() < ALIKE)


def added_across(gear: Gear) -> np.ndarray:
    """(9, 9) material removed of the driving flank along the profile and from end face to end face [m]."""
    roll = np.linspace(gear.roll_form, gear.roll_tip, 9)[:, None]
    return removed(gear.drive_flank, gear.face, roll, np.linspace(-gear.b / 2, gear.b / 2, 9))


def with_edges(pair: GearPair, density: Density) -> tuple[Density, Density]:
    """Densities of pinion and wheel: edges, unless given, where reliefs begin, the gear's own and the mate's on it."""
    if density.edges is not None:
        return density, density
    pinion, wheel = (distinct(gear, edges(gear.drive_flank, gear.face)) for gear in (pair.pinion, pair.wheel))
    on_mate = pair.path_of_contact.on_wheel
    on_pinion = distinct(pair.pinion, [*pinion, *map(on_mate, wheel)])
    on_wheel = distinct(pair.wheel, [*wheel, *map(on_mate, pinion)])
    return replace(density, edges=on_pinion), replace(density, edges=on_wheel)


def distinct(gear: Gear, rolls: Iterable[float]) -> tuple[float, ...]:
    """Those roll lengths on the flank that are APART from its ends and from one another, increasing [m]."""
    found, apart = [gear.roll_form], APART * gear.m_n
    for roll in sorted(rolls):
        if found[-1] + apart < roll < gear.roll_tip - apart:
            found.append(roll)
    return tuple(found[1:])


def clamped(gear: Gear, density: Density, element: Element, *, teeth=range(-1, 2), whole: bool = False) -> Body:
    """Gear on quadrilaterals (plane strain) or on hexahedra, as the element wants.

    teeth       numbers of those that may touch
    whole       hexahedra from end face to end face instead of from mid-plane on
    """
    mesh, degree = section_mesh.section(gear, density), element.maxdeg // element.dim
    section = Basis(mesh, ElementQuad1() if degree == 1 else ElementQuad2(), intorder=2 * degree + 1)
    if element.dim == 2:
        width, elements = plane(gear.b), solid(section, gear.material, gear.b)
    else:
        half = extrusion.half_width(gear.b, gear.b, density.width)
        line = extrusion.both_sides(half) if whole else half
        width = stations(section_mesh.divided(np.sort(line.p[0]), degree), degree)
        in_space = Basis(extrusion.extruded(mesh, line, gear.twist), element, intorder=2 * degree + 1)
        elements = solid(in_space, gear.material)
    columns = columns_over(section, elements.places, gear.twist)
    stacks = np.lexsort((*elements.places.T[2:], columns)).reshape(section.N, -1)
    flanks = {tooth: flank_of(gear, section, stacks, tooth, width, degree) for tooth in teeth}
    free = np.flatnonzero(~held(gear, elements.places, whole))
    return Body(1.0 if element.dim == 2 or whole else 0.5, elements, columns, free, flanks)


def columns_over(section: Basis, places: np.ndarray, twist: float) -> np.ndarray:
    """(n_dofs,) number of the dof of the section over which each of places (n_dofs, dim) lies, or along whose helix."""
    turn = -twist * places[:, 2:].sum(axis=1)
    return cKDTree(section.doflocs.T).query(section_mesh.rotated(places[:, :2].T, turn).T)[1]


def held(gear: Gear, places: np.ndarray, whole: bool) -> np.ndarray:
    """(n_dofs, dim) whether the hub or the symmetry about mid-plane holds a displacement."""
    found = np.zeros(places.shape, bool)
    found[np.hypot(places[:, 0], places[:, 1]) < gear.d_bore / 2 * (1 + 1e-6)] = True
    if places.shape[1] == 3 and not whole:
        found[places[:, 2] < gear.b * 1e-9, 2] = True
    return found


def plane(b: float) -> Width:
    """One station for the width b [m]."""
    return Width(np.zeros(1), np.zeros(1), np.array([b]), np.ones((1, 1)), np.ones((1, 1)))


def stations(nodes: np.ndarray, degree: int) -> Width:
    """Two Gauss points in each interval between nodes (n,) of elements of that degree."""
    points, weights = np.polynomial.legendre.leggauss(2)
    long = np.diff(nodes)[:, None]
    places = (nodes[:-1, None] + long * (points + 1) / 2).ravel()
    hats = np.stack([np.interp(places, nodes, one) for one in np.eye(nodes.size)], axis=1)
    return Width(nodes, places, (long * weights / 2).ravel(), hats, shape_functions(nodes, degree)(places))


def flank_of(gear: Gear, section: Basis, stacks: np.ndarray, tooth: int, width: Width, degree: int) -> Flank:
    """Flank of a tooth on dofs that stand in stacks (section.N, n_across) over those of the section."""
    line = section_mesh.divided(section_mesh.flank_nodes(gear, section.mesh, tooth), degree)
    nodes = stacks[cKDTree(section.doflocs.T).query(line.T)[1]]
    arcs = tooth_profile.arc_length(gear, np.sqrt(np.maximum((line**2).sum(axis=0) - gear.r_b**2, 0)))
    return Flank(gear, tooth, arcs, nodes, width, degree)


def flexibility(body: Body, solve: Solve, block: int = 64) -> np.ndarray:
    """(n, n) displacement of the flanks in transverse planes per force on them under solve [m/N]."""
    pressed, columns = body.transverse, []
    for start in range(0, pressed.shape[0], block):
        force = pressed[start : start + block].T.toarray()
        columns.append(pressed @ solve(force.reshape(*body.solid.places.shape, -1)).reshape(force.shape))
    matrix = np.hstack(columns)
    return (matrix + matrix.T) / 2
