"""Mass of a ring over the harmonics of the displacement of its rim.

The inside follows the outside of the rim as in statics (Guyan, AIAA J. 3, 1965), in plane strain and the same across
the face width: for the mass the shape of the displacement matters alone. One pitch stands for the ring, as in
`rim_harmonics`. Rigid motions of the rim move the ring as a rigid body, so that its mass and its inertia about its axis
are those of the finite elements.
"""

from math import cos, pi, sin

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fem.elasticity import extruded_elasticity, section_mesh
from fem.elasticity.mesh_density import Density
from fem.elasticity.pitch_condensation import pitch_section, radial_line
from fem.elasticity.rim_harmonics import in_real_waves, number_of_harmonics
from fem.gear.gear import Gear
from fem.support.blas_threads import one_thread


@one_thread()
def rim_mass(gear: Gear, density: Density) -> np.ndarray:
    """(2, 2 N + 1, 2, 2 N + 1) mass [kg] over component and 1, cos n angle, sin n angle, as in `rim_harmonics`.

    Components of the displacement of the rim are along the circumference and radially outwards.
    """
    section, z, highest = pitch_section(gear, density), abs(gear.z), number_of_harmonics(gear)
    in_plane = sp.csc_matrix(extruded_elasticity.uniform_stiffness(section, gear.material).matrix)
    of_component = _mass(section, gear)
    rim = np.flatnonzero(section_mesh.on_hub(gear, section))
    inside = np.ones(section.N, bool)
    inside[rim] = False
    lines = [radial_line(gear, section, inside, angle) for angle in (-pi / gear.z, pi / gear.z)]
    kept = np.concatenate([*lines, rim])
    boundary = np.concatenate([kept, section.N + kept])
    stiffness, mass = _condensed(in_plane, sp.csc_matrix(sp.block_diag([of_component] * 2)), boundary)
    turned = _axes_of_lines(gear, [line.size for line in lines], rim.size)
    stiffness, mass = turned.T @ stiffness @ turned, turned.T @ mass @ turned
    x, y = section.doflocs[:, rim]
    psi = np.angle((x + 1j * y) / (1j * gear.sign))
    directions = np.array([[-np.cos(psi), -np.sin(psi)], gear.sign * np.array([-np.sin(psi), np.cos(psi)])])
    order, n_line = np.arange(-highest, highest + 1), 2 * lines[0].size
    of_ring, both = np.zeros((2, order.size, 2, order.size), complex), np.arange(2)
    first, second, of_rim = slice(0, n_line), slice(n_line, 2 * n_line), slice(2 * n_line, None)
    for q in range(z):
        rows, turn = np.flatnonzero((order - q) % z == 0), np.exp(2j * pi * q / z)
        waves = np.exp(1j * gear.sign * psi * order[rows, None])
        fields = np.einsum("cki,ni->cnki", directions, waves).reshape(2 * rows.size, -1).T
        of_line = stiffness[first, first] + stiffness[second, second]
        of_line = of_line + turn * stiffness[first, second] + np.conj(turn) * stiffness[second, first]
        pull = (stiffness[first, of_rim] + np.conj(turn) * stiffness[second, of_rim]) @ fields
        moved = -np.linalg.solve(of_line, pull)
        u = np.vstack([moved, turn * moved, fields])
        of_ring[np.ix_(both, rows, both, rows)] = (z * u.conj().T @ mass @ u).reshape(2, rows.size, 2, rows.size)
    return in_real_waves(of_ring, highest)


def _mass(section, gear: Gear) -> sp.csr_matrix:
    """Mass of a component of the displacement [kg], over the dofs of the section."""
    value = extruded_elasticity.VALUE
    indices, entries = extruded_elasticity.section_products(section, [(value, value)])
    return sp.csr_matrix((gear.material.density * gear.b * entries[:, 0], tuple(indices)), (section.N,) * 2)


def _condensed(stiffness, mass, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass over the kept unknowns, which all others follow as in statics."""
    rest = np.setdiff1d(np.arange(stiffness.shape[0]), kept)
    coupling = stiffness[rest][:, kept].toarray()
    follow = -splu(sp.csc_matrix(stiffness[rest][:, rest])).solve(coupling)
    reduced = stiffness[kept][:, kept].toarray() + coupling.T @ follow
    of_rest = mass[rest][:, kept].toarray() + mass[rest][:, rest] @ follow
    of_kept = mass[kept][:, kept].toarray() + mass[kept][:, rest] @ follow
    return reduced, of_kept + follow.T @ of_rest


def _axes_of_lines(gear: Gear, lines: list[int], rim: int) -> np.ndarray:
    """(n, n) displacements along x and y from those of both lines, along axes that turn with them, and of the rim.

    Rows hold all along x, then all along y; columns the lines one after the other, then the rim, each likewise.
    """
    sizes, angles = [*lines, rim], (-pi / gear.z, pi / gear.z, 0.0)
    n, starts = sum(sizes), np.cumsum([0, *sizes])
    axes = np.zeros((2 * n, 2 * n))
    for start, size, angle in zip(starts, sizes, angles, strict=False):
        turn = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
        rows, columns = start + np.arange(size), 2 * start + np.arange(size)
        for i in range(2):
            for j in range(2):
                axes[i * n + rows, columns + j * size] = turn[i, j]
    return axes
