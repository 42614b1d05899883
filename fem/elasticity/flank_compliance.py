"""Flank compliance of one gear by one factorization; the half-space under the load is split off in closed form.

A load on the flank of tooth 0 is a sum of hat functions along the profile times hat functions across the face width.
The solid has a coarse mesh of quadratic hexahedra. Its section under uniform line loads (plane strain, or along a helix
a state in which all sections deform alike) is solved on the same mesh and on refined ones: the difference corrects the
solid near the load and in the bending of tooth and rim. From the sum the half-space under the same load is subtracted.
The remainder is smooth in both directions and is tabulated here; the half-space has a closed form
(`half_space`), so that the contact may be discretized as finely as it needs in both directions.
"""

from dataclasses import dataclass, replace
from math import copysign, cos, inf, sin

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementLineP1, ElementLineP2, ElementQuad2, LinearForm, MeshLine

from fem.elasticity import extruded_elasticity, extrusion, section_mesh
from fem.elasticity.face_symmetry import Face, HalfFace, WholeFace, clamped
from fem.elasticity.half_space import half_space
from fem.elasticity.hat_functions import hat, hats, overlap, spread, values_of_means
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.linalg.direct_solver import factorize
from fem.support.blas_threads import one_thread
from fem.support.cache import Arrays, cached
from fem.support.progress import announced
from fem.support.representation import exact
from fem.support.source_stamp import source_stamp

#: Parts of the section that bend, and how much finer they are in the section from which the bending is corrected.
BENDING_PARTS, FINER = ("tooth", "fillet", "rim", "body"), 2
#: Kinds of solutions in the cache: of the section, and of the solid from end face to end face.
NEAR, WHOLE = "near field", WholeFace.name
#: Loads on the whole width of a spur gear are sums of equal and of opposite ones on its halves.
HALVES = HalfFace(), HalfFace(antisymmetric=True)
#: Order that the quadrature of flank loads integrates exactly: quadratic shape functions times hats and their slope.
FLANK_ORDER = 7


@dataclass(frozen=True)
class Compliance:
    """Flank compliance of one gear beside the half-space; displacements and forces are normal to the flank.

    arcs        (n_hat,) arc lengths of the tops of the hat functions along the flank [m]
    axial       (n_axial,) axial positions of their tops across the width [m]
    end         distance from mid-plane to the gear's end faces [m]
    blocks      (teeth + 1, n_axial, n_hat, n_axial, n_hat) displacement of tooth d per force on tooth 0 [m/N]
    slide       (behind + 1 + teeth, ...) the same for the displacement along the profile towards the tip, from tooth
                -behind on
    face        modelled part of the face width; if it is half of it, the same forces act on the other half
    pitches     largest distance in pitches at which a loaded tooth deflects another tooth
    """

    arcs: np.ndarray
    axial: np.ndarray
    end: float
    blocks: np.ndarray
    slide: np.ndarray
    face: Face
    pitches: float = inf


def flank_compliance(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> Compliance:
    """Compliance of the gear clamped at its bore, from the cache where it was computed before.

    loaded      width of the part of the face that can carry load, in its middle [m]
    whole       whether to model the whole face, for loads that differ on its halves; always done for helical gears
    """
    arcs, line = section_mesh.flank_hats(gear, density), extrusion.half_face(gear.b, loaded, density.width)
    upper = np.sort(line.p[0])[: density.width + 1]
    face = WholeFace() if whole or gear.beta else HalfFace()
    means, axial = mean_compliance(gear, arcs, upper, line, density, loaded, face), face.positions(upper)
    blocks = np.concatenate([means[:1] - half_space(gear, arcs, axial, face), means[1:]])
    across, along = values_of_means(axial), values_of_means(arcs)
    with one_thread():
        values = np.einsum("yi,hj,dijkl,zk,ml->dyhzm", across, along, blocks, across, along, optimize=True)
    normal, tangential = values[: density.teeth + 1], values[density.teeth + 1 :]
    return Compliance(arcs, axial, gear.b / 2, normal, tangential, face)


def mean_compliance(gear: Gear, arcs, upper, line: MeshLine, density: Density, loaded: float, face: Face) -> np.ndarray:
    """(n_virtual, n_axial, n_hat, n_axial, n_hat) mean displacements over hats per force on tooth 0 [m/N].

    upper       (n,) axial positions of the tops of the hat functions from mid-plane on [m]
    line        mesh of the upper half of the face width
    """
    body, names = bare(gear), solutions(gear, density, loaded, whole=face == WholeFace())

    def corrections() -> Arrays:
        return cached(names[NEAR], lambda: section_corrections(body, arcs, replace(density, width=1)))

    def solved(modelled: Face) -> np.ndarray:
        def compute() -> Arrays:
            with announced(f"compliance of the gear of {gear.z} teeth, kept for later"):
                return {"blocks": corrected_solid(body, arcs, upper, line, density, corrections(), modelled)}

        return cached(names[modelled.name], compute)["blocks"]

    if gear.beta:
        hand = int(copysign(1, gear.beta))
        return solved(WholeFace())[:, ::hand, :, ::hand]
    return solved(face) if face == HalfFace() else both_halves(*(solved(half) for half in HALVES))


def bare(gear: Gear) -> Gear:
    """The gear whose finite elements stand for this one: right-hand, its flanks unmodified."""
    return replace(gear, flank=(), beta=abs(gear.beta))


def solutions(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> dict[str, str]:
    """Cache names of the solutions that `flank_compliance` needs: the section, and a solid for each modelled face."""
    body, section = exact(bare(gear)), exact(replace(density, width=1))
    stamp = source_stamp(__name__)
    faces: tuple[Face, ...] = (WholeFace(),) if gear.beta else HALVES if whole else HALVES[:1]
    solids = {face.name: f"solid {stamp} {body} {exact(density)} {loaded} {face.name}" for face in faces}
    return {NEAR: f"near field {stamp} {body} {section}"} | solids


def section_corrections(gear: Gear, arcs: np.ndarray, density: Density) -> Arrays:
    """(n_virtual, n_hat, n_hat) displacement on refined sections minus the coarse one, per uniform line load [m^2/N].

    "bending" comes from finer elements inside tooth, root, rim and body; it decays along the width over half the depth
    of tooth and rim layer. "local" is the rest, under the load.
    """
    coarse = density.paired()
    inside = replace(coarse, **{name: FINER * getattr(coarse, name) for name in BENDING_PARTS})
    u_coarse, u_inside, u_fine = (
        uniform_load_compliance(gear, arcs, mesh) for mesh in (coarse, inside, density.refined(2))
    )
    return {"local": u_fine - u_inside, "bending": u_inside - u_coarse}


def corrected_solid(gear: Gear, arcs, upper, half: MeshLine, density: Density, corrections: Arrays, face: Face):
    """Compliance of a solid with beta >= 0 as in `mean_compliance`, corrected by `section_corrections`."""
    axial, across = face.positions(upper), Basis(MeshLine(face.positions(np.sort(half.p[0]))), ElementLineP2())
    reach = (gear.r_a - section_mesh.rim_radius(gear)) / 2
    along = {"local": overlap(axial), "bending": spread(axial, reach, odd=face.antisymmetric)}
    added = (np.einsum("yz,dhk->dyhzk", along[part], corrections[part]) for part in along)
    return solid(gear, arcs, axial, across, density, face) + sum(added)


def both_halves(equal: np.ndarray, opposite: np.ndarray) -> np.ndarray:
    """Blocks over the whole width, superposed from those under equal and under opposite loads on its halves."""
    same_half, across_mid_plane = (equal + opposite) / 2, (equal - opposite) / 2
    back = slice(None, None, -1)
    upper = np.concatenate([same_half[:, back, :, back], across_mid_plane[:, back]], axis=3)
    lower = np.concatenate([across_mid_plane[:, :, :, back], same_half], axis=3)
    halves = np.concatenate([upper, lower], axis=1)
    n = equal.shape[1]
    joined = np.zeros((2 * n - 1, 2 * n))
    joined[np.arange(n), np.arange(n)] = joined[np.arange(n) + n - 1, np.arange(n) + n] = 1.0
    joined[n - 1] /= 2
    return np.einsum("yi,dihjk,zj->dyhzk", joined, halves, joined, optimize=True)


def flank_line(gear: Gear, section: Basis, tooth: int) -> tuple[Basis, np.ndarray, np.ndarray]:
    """The flank of a tooth as a line of elements: its basis over the length, vertices (2, n) [m], dofs of the section.

    scikit-fem's FacetBasis finds points on facets by Newton's method, which fails for small elements far from the axis.
    """
    mesh, facets = section.mesh, section_mesh.flank_facets(gear, section.mesh, tooth)
    facets = facets[np.argsort(np.hypot(*mesh.p[:, mesh.facets[:, facets]].mean(axis=1)))]
    vertices = np.unique(mesh.facets[:, facets])
    vertices = vertices[np.argsort(np.hypot(*mesh.p[:, vertices]))]
    points, quadratic = mesh.p[:, vertices], bool(section.elem.facet_dofs)
    length = np.append(0.0, np.cumsum(np.hypot(*np.diff(points))))
    line = Basis(MeshLine(length), ElementLineP2() if quadratic else ElementLineP1(), intorder=FLANK_ORDER)
    dofs = np.empty(line.N, int)
    dofs[line.nodal_dofs[0]] = section.nodal_dofs[0][vertices]
    if quadratic:
        dofs[line.interior_dofs[0]] = section.facet_dofs[0][facets]
    return line, points, dofs


@LinearForm
def spread_force(v, w):
    """Work of a force per length."""
    return w.force * v


def flank_loads(gear: Gear, basis: Basis, arcs: np.ndarray, tooth: int) -> np.ndarray:
    """(3, n_dofs, n_hat) unit forces into the flank of a tooth, spread as hats: along x and y, and their size."""
    line, points, dofs = flank_line(gear, basis, tooth)
    length = np.asarray(line.global_coordinates())[0]
    x, y = (np.interp(length, line.mesh.p[0], coordinate) for coordinate in points)
    hat_values = hats(arcs, (x**2 + y**2 - gear.r_b**2) / (2 * gear.r_b))
    tangent_x, tangent_y = np.diff(points) / np.diff(line.mesh.p[0])
    direction = np.stack([tangent_y, -tangent_x, np.ones_like(tangent_x)])[..., None]
    loads = np.zeros((3, basis.N, arcs.size))
    for i, component in enumerate(direction):
        forces = [spread_force.assemble(line, force=component * values) for values in hat_values]
        loads[i, dofs] = np.transpose(forces)
    return loads / loads[2].sum(axis=0)


def virtual_forces(gear: Gear, basis: Basis, arcs: np.ndarray, density: Density) -> list[np.ndarray]:
    """(3, n_dofs, n_hat) unit forces whose work is the displacement that the compliance contains.

    Forces normal to the teeth from 0 on, of which the first is the load; then along the profile, from tooth -behind on.
    """
    normal, loads = np.array([cos(gear.beta_b), cos(gear.beta_b), sin(gear.beta_b)])[:, None, None], {}
    for tooth in range(-density.behind, density.teeth + 1):
        loads[tooth] = flank_loads(gear, basis, arcs, tooth)
    along = [np.stack([-load[1], load[0], np.zeros_like(load[0])]) for load in loads.values()]
    return [normal * loads[tooth] for tooth in range(density.teeth + 1)] + along


def uniform_load_compliance(gear: Gear, arcs: np.ndarray, density: Density) -> np.ndarray:
    """(n_virtual, n_hat, n_hat) displacements under `virtual_forces` per uniform line load on tooth 0 [m^2/N].

    In plane strain, or along a helix, where all sections deform alike.
    """
    basis = Basis(section_mesh.section(gear, density), ElementQuad2())
    matrix = extruded_elasticity.uniform_stiffness(basis, gear.material, gear.twist).matrix
    free = np.flatnonzero(~clamped(gear, basis.doflocs, matrix.shape[0] // basis.N, WholeFace()))
    loads = [load.reshape(3 * basis.N, -1)[free] for load in virtual_forces(gear, basis, arcs, density)]
    u = factorize(matrix[free][:, free])(loads[0])
    return np.stack([load.T @ u for load in loads])


def solid(gear: Gear, arcs, axial, across: Basis, density: Density, face: Face) -> np.ndarray:
    """(n_virtual, n_axial, n_hat, n_axial, n_hat) displacements under `virtual_forces` per force on tooth 0 [m/N]."""
    basis = Basis(section_mesh.section(gear, density.paired()), ElementQuad2())
    free = ~clamped(gear, extruded_elasticity.points(basis, across), 3, face).ravel()
    matrix = extruded_elasticity.stiffness(basis, across, gear.material, gear.twist).part(free)
    across_loads, loads = axial_loads(across, axial), []
    for force in virtual_forces(gear, basis, arcs, density):
        full = np.einsum("cnh,ms->cnmsh", force, across_loads).reshape(-1, axial.size * arcs.size)
        loads.append(sp.csr_matrix(full[free]))
    loaded_dofs = np.unique(sp.hstack(loads).tocoo().row)
    u = factorize(matrix, accessed=loaded_dofs)(loads[0].toarray())
    shape = (axial.size, arcs.size)
    return np.stack([(load.T @ u).reshape(shape + shape) for load in loads])


def axial_loads(across: Basis, axial: np.ndarray) -> np.ndarray:
    """(n_dofs, n_axial) unit forces spread as hats across the width."""
    forms = [LinearForm(lambda v, w, row=row: hat(w.x[0], axial, row) * v) for row in np.eye(axial.size)]
    loads = np.stack([form.assemble(across) for form in forms], axis=1)
    return loads / loads.sum(axis=0)
