"""A housing by finite elements, reduced to the seats of bearings: static shapes and fixed-interface modes.

Seats are rigid rings: the displacements on each are those of a rigid body, 6 coordinates s. The others follow as

    u = Psi s + Phi a,   K Psi = -K_s,   K Phi = M Phi diag(omega^2)

with the static shapes Psi under unit motions of the seats and modes Phi while the seats stand (Craig & Bampton, AIAA
J. 6, 1968). The static stiffness between the seats is exact for the mesh. Elements are quadratic, as linear ones lock.
"""

from collections.abc import Callable, Sequence
from math import pi
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem import Basis, ElementHex2, ElementTetP2, FacetBasis, MeshHex, MeshTet
from skfem.io.meshio import from_meshio
from skfem.models.elasticity import lame_parameters

from fem.gear.material import STEEL, Material
from fem.housing.reduced_housing import PER_SEAT, ReducedHousing
from fem.linalg.direct_solver import factorize
from fem.support.arguments import checked
from fem.support.blas_threads import one_thread
from fem.support.validation import require, text_of

__all__ = ["reduce_housing"]

#: Number of natural frequencies by which the error is told.
COMPARED = 6
#: Size beyond which a mesh is taken to be in millimetres [m].
LARGEST = 20.0
#: Elements whose matrices are computed at once.
BATCH = 500
#: Element for each kind of mesh.
ELEMENTS = {MeshTet: ElementTetP2, MeshHex: ElementHex2}

#: Points (3, n) [m] -> whether each belongs to a seat or to the mounts.
Region = Callable[[np.ndarray], np.ndarray]


@checked
def reduce_housing(
    mesh: Any, seats: Sequence[Region], fixed: Region, *, material: Material = STEEL, modes: int = 20
) -> ReducedHousing:
    """Reduce the mesh of a housing to the seats of bearings by finite elements.

    mesh      file that meshio reads, or a `meshio.Mesh`, of tetrahedra or hexahedra, in metres
    seats     for each bearing a function of points (3, n) [m] that tells which of them lie on its seat: facets of the
              surface all of whose corners do become a rigid ring
    fixed     the same of the mounts, which stand
    material  `fem.Material`
    modes     number of modes while the seats stand, beside the static shapes

    Raises ValueError for meshes of other cells, in millimetres, and for seats or mounts without facets, or in common.
    """
    grid = _mesh_of(mesh)
    require(1 <= modes <= 500, f"modes must lie in [1, 500], got {modes}")
    listed = isinstance(seats, Sequence) and len(seats) > 0 and all(callable(x) for x in seats)
    require(listed, f"seats must be a list of functions of points (3, n), got {text_of(seats)}")
    require(callable(fixed), f"fixed must be a function of points (3, n), got {text_of(fixed)}")
    kind = next(kind for kind in ELEMENTS if isinstance(grid, kind))
    basis = Basis(grid, ELEMENTS[kind]())
    stiffness, mass = _matrices(basis, material)
    of_seats = [_dofs(basis, region, f"seat {number}") for number, region in enumerate(seats)]
    standing = _dofs(basis, fixed, "fixed")
    groups = [*of_seats, standing]
    shared = sum(len(x) for x in groups) - len(np.unique(np.concatenate(groups)))
    require(shared == 0, f"seats and mounts must not touch each other, they share {shared} points")
    points = np.setdiff1d(np.arange(basis.N), np.concatenate(groups))
    require(modes < points.size, f"modes must be below the number {points.size} of free points, got {modes}")
    centres = np.array([_centre(basis, dofs) for dofs in of_seats])
    to_all = _expansion(basis, points, of_seats, centres)
    k, m = ((to_all.T @ matrix @ to_all).tocsr() for matrix in (stiffness, mass))
    with one_thread():
        return _reduced(basis, to_all, k, m, points.size, centres, modes)


def _matrices(basis: Basis, material: Material) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Stiffness and mass (3 N, 3 N) over the displacements x, y, z of each point.

    Products of the gradients of the scalar functions, in batches of elements: forms of vector elements take thousands
    of calls from Python.
    """
    lam, mu = lame_parameters(material.E, material.nu)
    numbers, n = basis.element_dofs.T, basis.Nbfun
    values = np.array([np.broadcast_to(basis.basis[a][0], basis.dx.shape) for a in range(n)])
    gradients = np.array([basis.basis[a][0].grad for a in range(n)])
    of_element = 3 * numbers[:, :, None] + np.arange(3)
    rows, columns, stiff, heavy = [], [], [], []
    for first in range(0, len(numbers), BATCH):
        batch = slice(first, first + BATCH)
        g, w, v = gradients[:, :, batch], basis.dx[batch], values[:, batch]
        products = np.einsum("aieq,bjeq,eq->eaibj", g, g, w, optimize=True)
        laplace = np.einsum("eaibi->eab", products)
        k = lam * products + mu * products.transpose(0, 1, 4, 3, 2)
        mass = np.zeros_like(k)
        each = np.einsum("aeq,beq,eq->eab", v, v, w, optimize=True)
        for i in range(3):
            k[:, :, i, :, i] += mu * laplace
            mass[:, :, i, :, i] = material.density * each
        at = of_element[batch].reshape(len(k), 3 * n)
        rows.append(np.repeat(at, 3 * n, axis=1).ravel())
        columns.append(np.tile(at, (1, 3 * n)).ravel())
        stiff.append(k.ravel())
        heavy.append(mass.ravel())
    at_all, size = (np.concatenate(rows), np.concatenate(columns)), (3 * basis.N, 3 * basis.N)
    stiffness, mass = (sp.csr_matrix((np.concatenate(x), at_all), size) for x in (stiff, heavy))
    return stiffness, mass


def _mesh_of(mesh: Any) -> MeshTet | MeshHex:
    """The mesh for scikit-fem; ValueError for other cells or units."""
    if isinstance(mesh, str | Path):
        require(Path(mesh).is_file(), f"mesh must be a file or a meshio.Mesh, there is no file {text_of(mesh)}")
        mesh = meshio.read(mesh)
    require(isinstance(mesh, meshio.Mesh), f"mesh must be a file or a meshio.Mesh, got {text_of(mesh)}")
    kinds = sorted({block.type for block in mesh.cells})
    solid = [block for block in mesh.cells if block.type.startswith(("tetra", "hexahedron"))]
    require(len({block.type for block in solid}) == 1, f"mesh must have tetrahedra or hexahedra alone, got {kinds}")
    grid = from_meshio(meshio.Mesh(mesh.points, solid))
    require(any(isinstance(grid, kind) for kind in ELEMENTS), f"mesh must have tetrahedra or hexahedra, got {kinds}")
    size = float(np.ptp(grid.p, axis=1).max())
    require(size < LARGEST, f"mesh must be in metres, it is {size:g} long; divide its points by 1000")
    return grid


def _dofs(basis: Basis, region: Region, name: str) -> np.ndarray:
    """Numbers of the points on the facets of the surface all of whose corners lie in a region."""
    grid = basis.mesh
    inside = np.asarray(region(grid.p))
    boolean = inside.shape == (grid.p.shape[1],) and inside.dtype == bool
    require(boolean, f"{name} must return (n,) booleans for points (3, n), got {inside.dtype} of shape {inside.shape}")
    surface = grid.boundary_facets()
    facets = surface[inside[grid.facets[:, surface]].all(axis=0)]
    require(facets.size > 0, f"{name} has no facet of the surface; widen its tolerance, the mesh is in metres")
    return np.sort(basis.get_dofs(facets=facets).flatten())


def _centre(basis: Basis, dofs: np.ndarray) -> np.ndarray:
    """(3,) middle of some points [m]."""
    points = np.unique(basis.doflocs[:, dofs], axis=1)
    return (points.min(axis=1) + points.max(axis=1)) / 2


def _expansion(basis: Basis, points: np.ndarray, of_seats: Sequence[np.ndarray], centres: np.ndarray) -> sp.csr_matrix:
    """(3 N, 3 n + 6 n_seat) all displacements by those of free points (n,) and by the motions of rigid seats."""
    free = np.ravel(3 * points[:, None] + np.arange(3))
    rows, columns, values = [free], [np.arange(free.size)], [np.ones(free.size)]
    for number, (dofs, centre) in enumerate(zip(of_seats, centres, strict=True)):
        arms, first = (basis.doflocs[:, dofs] - centre[:, None]).T, free.size + PER_SEAT * number
        for axis in range(3):
            turned = np.cross(np.eye(3)[axis], arms)
            for column, moved in ((axis, np.tile(np.eye(3)[axis], (dofs.size, 1))), (3 + axis, turned)):
                rows.append(np.ravel(3 * dofs[:, None] + np.arange(3)))
                columns.append(np.full(3 * dofs.size, first + column))
                values.append(moved.ravel())
    shape = 3 * basis.N, free.size + PER_SEAT * len(of_seats)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sp.csr_matrix(entries, shape=shape)


def _reduced(
    basis: Basis,
    to_all: sp.csr_matrix,
    k: sp.csr_matrix,
    m: sp.csr_matrix,
    points: int,
    centres: np.ndarray,
    modes: int,
) -> ReducedHousing:
    """The reduced model from matrices over the displacements of free points and the motions of the seats."""
    n = 3 * points
    blocks = np.arange(k.shape[0]) // 3
    solve = _one_by_one(factorize(k[:n, :n], blocks[:n]))
    static = np.vstack([-solve(k[:n, n:].toarray()), np.eye(k.shape[0] - n)])
    inverse = LinearOperator((n, n), matvec=solve, dtype=float)
    squares, shapes = eigsh(k[:n, :n], modes, m[:n, :n], sigma=0.0, OPinv=inverse)
    vibrating = np.vstack([shapes, np.zeros((k.shape[0] - n, modes))])
    shown = np.hstack([static, vibrating])
    stiffness, mass = shown.T @ (k @ shown), shown.T @ (m @ shown)
    seats = k.shape[0] - n
    stiffness[:seats, seats:] = stiffness[seats:, :seats] = 0.0
    stiffness[seats:, seats:] = np.diag(squares)
    whole = _lowest(k, m, blocks, min(COMPARED, modes))
    reduced = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
    errors = np.sort(reduced)[: whole.size] / whole - 1
    areas, normal = _surface(basis)
    velocities = normal @ (to_all @ shown)
    return ReducedHousing(
        (stiffness + stiffness.T) / 2, (mass + mass.T) / 2, centres, whole / (2 * pi), errors, areas, velocities
    )


def _one_by_one(solve: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """A solver of matrices (n, k) that also takes vectors (n,)."""
    return lambda right: solve(right[:, None])[:, 0] if right.ndim == 1 else solve(right)


def _lowest(k: sp.csr_matrix, m: sp.csr_matrix, blocks: np.ndarray, number: int) -> np.ndarray:
    """(number,) lowest natural angular frequencies [rad/s] of the finite elements, their seats free."""
    inverse = LinearOperator(k.shape, matvec=_one_by_one(factorize(k, blocks)), dtype=float)
    return np.sqrt(np.sort(eigsh(k, number, m, sigma=0.0, OPinv=inverse, return_eigenvectors=False)))


def _surface(basis: Basis) -> tuple[np.ndarray, sp.csr_matrix]:
    """Areas (n_facet,) of the surface, and its mean normal displacements by all displacements (n_facet, 3 N)."""
    facets = FacetBasis(basis.mesh, basis.elem)
    areas, normals = facets.dx.sum(axis=1), np.asarray(facets.normals)
    rows, columns, values = [], [], []
    for a in range(facets.Nbfun):
        weighted = np.broadcast_to(facets.basis[a][0], facets.dx.shape) * facets.dx
        for i in range(3):
            rows.append(np.arange(areas.size))
            columns.append(3 * facets.element_dofs[a] + i)
            values.append((weighted * normals[i]).sum(axis=1) / areas)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return areas, sp.csr_matrix(entries, shape=(areas.size, 3 * basis.N))
