"""Flank compliance of one gear by one factorization, with all that is local to a load split off.

A load on the flank of tooth 0 is a sum of hats along the profile times hats across the width. The 3D solution sits on a
coarse mesh of quadratic elements; twins of its section under uniform line loads (plane strain, or what that is along
a helix), on the same mesh and on refined ones, tell what it misses near the load and further inside. What remains
beside a half-space under the same load is smooth both ways and is tabulated here. The half-space itself is closed form
(`half_space`), so that the contact may be as fine as it likes in both directions.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import copysign, cos, inf, sin

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementLineP2, ElementQuad2, LinearForm, MeshLine

from fem.elasticity import extruded_elasticity, extrusion, section_mesh
from fem.elasticity.half_space import half_space
from fem.elasticity.hat_functions import hat, hats, lines, overlap, spread, values_of_means
from fem.elasticity.mesh_density import Density
from fem.elasticity.section_mesh import BORE
from fem.gear.gear import Gear
from fem.linalg.direct_solver import factorize
from fem.support.cache import Arrays, cached
from fem.support.progress import announced
from fem.support.representation import exact
from fem.support.source_stamp import source_stamp

#: Elements that deform far from the load too, and how much finer they are in the twin that misses only the rest.
INSIDE, FINER_INSIDE = ("tooth", "fillet", "rim", "body"), 2
NEAR, WHOLE = "near field", "whole"


@dataclass(frozen=True)
class Compliance:
    """Flank compliance of one gear beside the half-space; displacements and forces are normal to the flank.

    arcs        (n_hat,) arc lengths of the hats' tops along the flank [m]
    axial       (n_axial,) places of the hats' tops across the width [m], from mid-plane or from end face to end face
    end         distance from mid-plane to the gear's end faces [m]
    blocks      (teeth + 1, n_axial, n_hat, n_axial, n_hat) displacement into tooth d per force on tooth 0 [m/N]; from
                mid-plane on: the same forces act on both halves of the width
    slide       (behind + 1 + teeth, ...) likewise the displacement along the profile towards the tip, from -behind on
    pitches     how far apart teeth may be to move one another
    """

    arcs: np.ndarray
    axial: np.ndarray
    end: float
    blocks: np.ndarray
    slide: np.ndarray
    pitches: float = inf

    @property
    def share(self) -> float:
        """Share of the face width, and of the load, that lies on the slices."""
        return 0.5 if self.axial[0] == 0 else 1.0

    @cached_property
    def hats_of_lines(self) -> tuple[np.ndarray, np.ndarray]:
        """(n_axial, n_axial) and (n_hat, n_hat) the hats across and along, as sums of `hat_functions.lines`."""
        across, along = (np.linalg.inv(lines(tops, tops)) for tops in (self.axial, self.arcs))
        return across, along

    def ahead(self, teeth: int) -> np.ndarray:
        """(n_axial n_hat, n_axial n_hat) displacement into a tooth so many teeth ahead of the loaded one [m/N]."""
        block = self.blocks[abs(teeth)].reshape(self.axial.size * self.arcs.size, -1)
        return block if teeth >= 0 else block.T

    def slide_ahead(self, teeth: int) -> np.ndarray:
        """Likewise along the profile; as far behind as was computed, there it hardly depends on the tooth."""
        found = self.slide[max(0, teeth + len(self.slide) - len(self.blocks))]
        return found.reshape(self.axial.size * self.arcs.size, -1)


def flank_compliance(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> Compliance:
    """Compliance of the gear clamped at its bore, from the cache where it was computed before.

    loaded      width of the part of the face that can carry load, in its middle [m]
    whole       from end face to end face, for loads that differ on the two halves; helical gears always are
    """
    body, names = bare(gear), solutions(gear, density, loaded, whole=whole)
    arcs, line = section_mesh.flank_hats(gear, density), extrusion.half_width(gear.b, loaded, density.width)
    axial = np.sort(line.p[0])[: density.width + 1]
    section = replace(density, width=1)
    near = partial(cached, names[NEAR], lambda: missed_by_section(body, arcs, section))

    def solved(kind: str) -> np.ndarray:
        def compute() -> Arrays:
            with announced(f"compliance of the gear of {gear.z} teeth, kept for later"):
                return {"blocks": corrected(body, arcs, axial, line, density, near(), kind)}

        return cached(names[kind], compute)["blocks"]

    places = np.concatenate([-axial[:0:-1], axial]) if whole or gear.beta else axial
    if gear.beta:
        means = solved(WHOLE)[:, :: int(copysign(1, gear.beta)), :, :: int(copysign(1, gear.beta))]
    else:
        means = both_halves(solved("even"), solved("odd")) if whole else solved("even")
    own = means[:1] - half_space(gear, arcs, places)
    across, along = values_of_means(places), values_of_means(arcs)
    blocks = np.concatenate([own, means[1:]])
    values = np.einsum("yi,hj,dijkl,zk,ml->dyhzm", across, along, blocks, across, along, optimize=True)
    return Compliance(arcs, places, gear.b / 2, values[: density.teeth + 1], values[density.teeth + 1 :])


def bare(gear: Gear) -> Gear:
    """The gear whose finite elements stand for this one: right-hand, its flanks unmodified."""
    return replace(gear, flank=(), beta=abs(gear.beta))


def solutions(gear: Gear, density: Density, loaded: float, *, whole: bool = False) -> dict[str, str]:
    """Names in the cache of what `flank_compliance` takes, by kind: the near field and each solid."""
    body, section = exact(bare(gear)), exact(replace(density, width=1))
    stamp = source_stamp(__name__)
    kinds = (WHOLE,) if gear.beta else ("even", "odd") if whole else ("even",)
    solids = {kind: f"solid {stamp} {body} {exact(density)} {loaded} {kind}" for kind in kinds}
    return {NEAR: f"near field {stamp} {body} {section}"} | solids


def missed_by_section(gear: Gear, arcs: np.ndarray, density: Density) -> Arrays:
    """(n_reading, n_hat, n_hat) what uniform line loads on refined sections add to that on the coarse one [m^2/N].

    "far" adds what elements inside tooth, root, rim and body miss, which is felt along the width half as far as tooth
    and rim layer are deep; "near" the rest, under the load.
    """
    pairs = density.paired()
    deeper = replace(pairs, **{name: FINER_INSIDE * getattr(pairs, name) for name in INSIDE})
    coarse, inside, fine = (along_helix(gear, arcs, one) for one in (pairs, deeper, density.refined(2)))
    return {"near": fine - inside, "far": inside - coarse}


def corrected(gear: Gear, arcs, axial, half: MeshLine, density: Density, missed: Arrays, kind: str) -> np.ndarray:
    """`Compliance.blocks` and `slide`, one after the other, of a gear with beta >= 0, as means over the hats.

    missed      by the coarse section, from `missed_by_section`
    kind        "whole" width, or half of it with loads on the other half that are alike, "even", or opposite, "odd"
    """
    if kind == "whole":
        half = extrusion.both_sides(half)
        axial = np.concatenate([-axial[:0:-1], axial])
    across = Basis(half, ElementLineP2())
    found = solid(gear, arcs, axial, across, density, kind)
    along = {
        "near": overlap(axial),
        "far": spread(axial, (gear.r_a - section_mesh.rim_radius(gear)) / 2, odd=kind == "odd"),
    }
    return found + sum(np.einsum("yz,dhk->dyhzk", along[part], missed[part]) for part in along)


def both_halves(even: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """Blocks over the whole width from those under loads alike and opposite on the two halves."""
    same, other = (even + odd) / 2, (even - odd) / 2
    back = slice(None, None, -1)
    upper = np.concatenate([same[:, back, :, back], other[:, back]], axis=3)
    lower = np.concatenate([other[:, :, :, back], same], axis=3)
    halves = np.concatenate([upper, lower], axis=1)
    n = even.shape[1]
    joined = np.zeros((2 * n - 1, 2 * n))
    joined[np.arange(n), np.arange(n)] = joined[np.arange(n) + n - 1, np.arange(n) + n] = 1.0
    joined[n - 1] /= 2
    return np.einsum("yi,dihjk,zj->dyhzk", joined, halves, joined, optimize=True)


def flank_loads(gear: Gear, basis: Basis, arcs: np.ndarray, tooth: int) -> np.ndarray:
    """(3, n_dofs, n_hat) unit forces normal to the flank of a tooth, spread as hats: along x and y, and their size."""
    mesh, facets = basis.mesh, section_mesh.flank_facets(gear, basis.mesh, tooth)
    points, weights = np.polynomial.legendre.leggauss(4)
    share = (points + 1) / 2
    ends = mesh.p[:, mesh.facets[:, facets]]
    at = ends[:, 0, :, None] * (1 - share) + ends[:, 1, :, None] * share
    density = hats(arcs, (at[0] ** 2 + at[1] ** 2 - gear.r_b**2) / (2 * gear.r_b))
    edge = ends[:, 1] - ends[:, 0]
    outward_run = np.sign(edge[0] * at[0].mean(axis=1) + edge[1] * at[1].mean(axis=1))
    force = np.stack([edge[1] * outward_run, -edge[0] * outward_run, np.hypot(*edge)])
    loads = np.zeros((3, basis.N, arcs.size))
    for dofs, shape in _facet_shapes(basis, facets, share):
        loads += _scattered(dofs, np.einsum("hfg,g,cf->cfh", density * shape, weights / 2, force), basis.N)
    return loads / np.einsum("hfg,g,f->h", density, weights / 2, force[2])


def _scattered(dofs: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """(3, n, n_hat) sums of values (3, n_facet, n_hat) that belong to the same dof."""
    summing = sp.csr_matrix((np.ones(dofs.size), (dofs, np.arange(dofs.size))), shape=(n, dofs.size))
    return np.stack([summing @ component for component in values])


def _facet_shapes(basis: Basis, facets: np.ndarray, share: np.ndarray):
    """Pairs of dofs (n_facet,) and values (n_point,) of the shape functions that live on straight facets."""
    one, other = basis.dofs.nodal_dofs[0][basis.mesh.facets[:, facets]]
    if not basis.elem.facet_dofs:
        return [(one, 1 - share), (other, share)]
    quadratic = [(1 - share) * (1 - 2 * share), share * (2 * share - 1), 4 * share * (1 - share)]
    return list(zip((one, other, basis.dofs.facet_dofs[0][facets]), quadratic, strict=True))


def readings(gear: Gear, basis: Basis, arcs: np.ndarray, density: Density) -> list[np.ndarray]:
    """(3, n_dofs, n_hat) forces whose work is what is read: normal to teeth from 0 on, along teeth from -behind on.

    The first of them is the load.
    """
    normal, pushes = np.array([cos(gear.beta_b), cos(gear.beta_b), sin(gear.beta_b)])[:, None, None], {}
    for tooth in range(-density.behind, density.teeth + 1):
        pushes[tooth] = flank_loads(gear, basis, arcs, tooth)
    along = [np.stack([-push[1], push[0], np.zeros_like(push[0])]) for push in pushes.values()]
    return [normal * pushes[tooth] for tooth in range(density.teeth + 1)] + along


def along_helix(gear: Gear, arcs: np.ndarray, density: Density) -> np.ndarray:
    """(n_reading, n_hat, n_hat) displacements that `readings` say per uniform line load on tooth 0 [m^2/N].

    In plane strain, and what this is along a helix.
    """
    basis = Basis(section_mesh.section(gear, density), ElementQuad2())
    matrix = extruded_elasticity.uniform_stiffness(basis, gear.material, gear.twist).matrix
    clamped = np.zeros((matrix.shape[0] // basis.N, basis.N), bool)
    clamped[:, basis.get_dofs(BORE).all()] = True
    free = np.flatnonzero(~clamped)
    loads = [load.reshape(3 * basis.N, -1)[free] for load in readings(gear, basis, arcs, density)]
    moved = factorize(matrix[free][:, free])(loads[0])
    return np.stack([load.T @ moved for load in loads])


def solid(gear: Gear, arcs, axial, across: Basis, density: Density, kind: str) -> np.ndarray:
    """(n_reading, n_axial, n_hat, n_axial, n_hat) displacements that `readings` say per force on tooth 0 [m/N]."""
    basis = Basis(section_mesh.section(gear, density.paired()), ElementQuad2())
    free = ~_clamped(basis, across, kind)
    matrix = extruded_elasticity.stiffness(basis, across, gear.material, gear.twist).part(free)
    spread = _axial_loads(across, axial)
    loads = []
    for pressed in readings(gear, basis, arcs, density):
        full = np.einsum("cnh,ms->cnmsh", pressed, spread).reshape(-1, axial.size * arcs.size)
        loads.append(sp.csr_matrix(full[free]))
    pressed = np.unique(sp.hstack(loads).tocoo().row)
    moved = factorize(matrix, accessed=pressed)(loads[0].toarray())
    shape = (axial.size, arcs.size)
    return np.stack([(load.T @ moved).reshape(shape + shape) for load in loads])


def _clamped(basis: Basis, across: Basis, kind: str) -> np.ndarray:
    """(n,) dofs held by the bore and by the symmetry about mid-plane."""
    clamped = np.zeros((3, basis.N, across.N), bool)
    clamped[:, basis.get_dofs(BORE).all()] = True
    middle = np.abs(across.doflocs[0]) < 1e-9 * np.ptp(across.doflocs[0])
    for component in {"whole": (), "even": (2,), "odd": (0, 1)}[kind]:
        clamped[component, :, middle] = True
    return clamped.ravel()


def _axial_loads(across: Basis, axial: np.ndarray) -> np.ndarray:
    """(n_dofs, n_axial) unit forces spread as hats across the width."""
    forms = [LinearForm(lambda v, w, row=row: hat(w.x[0], axial, row) * v) for row in np.eye(axial.size)]
    loads = np.stack([form.assemble(across) for form in forms], axis=1)
    return loads / loads.sum(axis=0)
