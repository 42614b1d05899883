"""A ring whose rim is not clamped: its stiffness over harmonics of the displacement of the rim, from one pitch.

The outside of the rim is displaced along the circumference and radially, by a sum of exp(i n angle) with |n| <= N. All
pitches are alike: under the harmonics n = q + k |z| the second radial line of a pitch is displaced as its first one,
times exp(2 pi i q / |z|), so that one pitch stands for the ring (cyclic symmetry; Thomas, Int. J. Numer. Meth. Eng. 14,
1979). Angles count in the direction of the teeth, from the middle of tooth 0.

Across the face width these displacements are even, and a support acts on them. Further shapes, by which the rim warps
and contracts along its axis, are free of load and eliminated. A support holds the rim against tilting and along the
axis.
"""

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Legendre
from skfem import Basis

from fem.elasticity import section_mesh
from fem.elasticity.face_symmetry import clamped
from fem.elasticity.mesh_density import Density
from fem.elasticity.pitch_condensation import FlankForces, Prism, loaded_pitch, pitch_section
from fem.gear.gear import Gear
from fem.support.blas_threads import one_thread
from fem.support.cache import Arrays

#: Degrees of Legendre's polynomials across the width by which the rim warps in the section, and along the axis.
IN_SECTION, ALONG_AXIS = (2, 4), (1, 3)


class Pitch(NamedTuple):
    """Pitch of tooth 0 without its flank.

    stiffness   (n, n) over its first radial line, its second one, and the rim
    forces      (n, 2 n_load) on these instead of those on the flank, into it and along its profile
    n_line      number of unknowns of a line
    """

    stiffness: np.ndarray
    forces: np.ndarray
    n_line: int

    def under(self, rim: np.ndarray, turn: complex) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (k, k) and displacements of the flank (2 n_load, k) under displacements of the rim (n_rim, k).

        turn    displacement of the second line over that of the first one
        """
        first, second, of_rim = slice(0, self.n_line), slice(self.n_line, 2 * self.n_line), slice(2 * self.n_line, None)
        s, f = self.stiffness, self.forces
        lines = s[first, first] + s[second, second] + turn * s[first, second] + np.conj(turn) * s[second, first]
        pull = s[first, of_rim] @ rim + np.conj(turn) * (s[second, of_rim] @ rim)
        on_line = -np.linalg.solve(lines, pull)
        stiffness = rim.conj().T @ (s[of_rim, of_rim] @ rim) + pull.conj().T @ on_line
        flank = (f[first].T + turn * f[second].T) @ on_line + f[of_rim].T @ rim
        return (stiffness + stiffness.conj().T) / 2, flank


#: Highest harmonic of the displacement of the rim, over the number of teeth: its waves are shorter than a pitch. On a
#: rim of 2.25 modules te is then within 0.01 % of its limit for bolts that hold 5 modules, 0.3 % for 1.5 modules.
HARMONICS = 1.25


def number_of_harmonics(gear: Gear) -> int:
    """Highest harmonic N of the displacement of the rim."""
    return ceil(HARMONICS * abs(gear.z))


@one_thread()
def rim_harmonics(prism: Prism, density: Density, forces: FlankForces) -> Arrays:
    """The ring over the amplitudes of the displacement of its rim, along the circumference and radially outwards.

    "stiffness"     (2, 2 N + 1, 2, 2 N + 1) of the whole ring [N/m] over component and 1, cos n angle, sin n angle
    "flank"         (N + 1, 2, 2 n_load) complex displacements of the flank of tooth 0, into it and along its profile,
                    per harmonic exp(i n angle) and component
    "free"          (n_virtual, n_load, n_load) displacements as of `flank_displacements` as the rim warps [m/N]

    prism   not clamped; of a symmetric face the half under equal loads
    """
    gear, z, highest = prism.gear, abs(prism.gear.z), number_of_harmonics(prism.gear)
    stiffness, on_pitch, _ = loaded_pitch(prism, density, forces)
    shapes, n_rim = _rim_shapes(prism, pitch_section(gear, density))
    pitch, n_load = Pitch(stiffness, on_pitch, (len(stiffness) - n_rim) // 2), on_pitch.shape[1] // 2
    order = np.arange(-highest, highest + 1)
    both, of_ring = np.arange(2), np.zeros((2, order.size, 2, order.size), complex)
    flank = np.zeros((order.size, 2, 2 * n_load), complex)
    free = np.zeros((z, 2 * n_load, n_load), complex)
    for q in range(z // 2 + 1):
        rows = np.flatnonzero((order - q) % z == 0)
        held, further = shapes(order[rows])
        k, u = pitch.under(np.hstack([held, further]), np.exp(2j * np.pi * q / z))
        k, u, warped = _without_further(z / prism.face.share * k, u, held.shape[1])
        k, u, warped = k.reshape(2, rows.size, 2, -1), u.T.reshape(2, rows.size, -1), warped[:, :n_load]
        opposite = order.size - 1 - rows
        of_ring[np.ix_(both, rows, both, rows)], of_ring[np.ix_(both, opposite, both, opposite)] = k, k.conj()
        flank[rows], flank[opposite] = u.swapaxes(0, 1), u.swapaxes(0, 1).conj()
        free[q], free[-q] = warped / prism.face.share, warped.conj() / prism.face.share
    return {
        "stiffness": in_real_waves(of_ring, highest),
        "flank": flank[highest:],
        "free": _between_teeth(free, density),
    }


def _rim_shapes(prism: Prism, section: Basis):
    """Function of harmonics (k,): displacements of the rim of tooth 0 (n, 2 k) and (n, k n_shape); and their number n.

    The former by component, then by harmonic.
    """
    gear = prism.gear
    x, y = section.doflocs[:, section_mesh.on_hub(gear, section)]
    psi = np.angle((x + 1j * y) / (1j * gear.sign))
    axial = np.zeros(1) if prism.axis is None else prism.axis.doflocs[0]
    components = 2 if prism.axis is None and not gear.twist else 3
    free = ~clamped(gear, np.zeros(axial.size, bool), np.stack([0 * axial, 0 * axial, axial]), components, prism.face)
    directions = np.zeros((3, components, psi.size))
    directions[0, :2], directions[1, :2] = (
        (-np.cos(psi), -np.sin(psi)),
        (
            -gear.sign * np.sin(psi),
            gear.sign * np.cos(psi),
        ),
    )
    directions[2, 2:] = 1.0
    of_shape = [(direction, np.ones(axial.size)) for direction in directions[:2]]
    if prism.axis is not None:
        across = [(direction, degree) for direction in directions[:2] for degree in IN_SECTION]
        across += [(directions[2], degree) for degree in ALONG_AXIS]
        of_shape += [(direction, Legendre.basis(degree)(2 * axial / gear.b)) for direction, degree in across]
    angle = gear.sign * (psi[:, None] + gear.twist * axial)

    def shapes(order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        wave = np.exp(1j * order[:, None, None] * angle)
        fields = np.array([np.einsum("ci,nia,a->nica", d, wave, along) for d, along in of_shape])
        fields = fields[:, :, :, free].reshape(len(of_shape) * order.size, -1).T
        return fields[:, : 2 * order.size], fields[:, 2 * order.size :]

    return shapes, psi.size * int(free.sum())


def _without_further(stiffness: np.ndarray, flank: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness and displacements of the flank over the first n shapes; displacements per force by the other ones."""
    if n == len(stiffness):
        return stiffness, flank, np.zeros((len(flank), len(flank)), complex)
    inside = np.linalg.solve(stiffness[n:, n:], np.hstack([stiffness[n:, :n], flank[:, n:].conj().T]))
    reduced = stiffness[:n, :n] - stiffness[:n, n:] @ inside[:, :n]
    return reduced, flank[:, :n] - flank[:, n:] @ inside[:, :n], flank[:, n:] @ inside[:, n:]


def in_real_waves(matrix: np.ndarray, highest: int) -> np.ndarray:
    """(2, 2 N + 1, 2, 2 N + 1) matrix over 1, cos n angle, sin n angle from that over exp(i n angle), n from -N."""
    real = _from_real(highest)
    return np.einsum("nk,anbm,ml->akbl", real.conj(), matrix, real, optimize=True).real


def _from_real(highest: int) -> np.ndarray:
    """(2 N + 1, 2 N + 1) amplitudes of exp(i n angle), n from -N, of 1, cos n angle and sin n angle."""
    matrix, n = np.zeros((2 * highest + 1, 2 * highest + 1), complex), np.arange(1, highest + 1)
    matrix[highest, 0] = 1.0
    matrix[highest + n, n] = matrix[highest - n, n] = 1 / 2
    matrix[highest + n, highest + n], matrix[highest - n, highest + n] = -1j / 2, 1j / 2
    return matrix


def _between_teeth(free: np.ndarray, density: Density) -> np.ndarray:
    """(n_virtual, n_load, n_load) displacements of `flank_displacements` from those by q (|z|, 2 n_load, n_load)."""
    q, n = np.arange(len(free)), free.shape[2]
    ahead, behind = range(density.teeth + 1), range(-density.behind, 0)

    def displacement(tooth: int, part: slice) -> np.ndarray:
        return np.einsum("q,qij->ij", np.exp(2j * np.pi * q * tooth / q.size), free[:, part]).real

    normal = [displacement(tooth, slice(n)) for tooth in ahead]
    return np.stack(normal + [displacement(tooth, slice(n, None)) for tooth in (*behind, *ahead)])
