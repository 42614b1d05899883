"""Eigenmodes of M x'' + (C + G) x' + K x = 0: gyroscopic terms G exactly, damping C to the first order.

Where the damping couples modes more than their frequencies differ, as those of equal shafts on unequal dampers, the
first order is that of all these modes together (perturbation of nearly equal eigenvalues): their amplitudes a follow
a' = (i diag(omega) - R) a with the decay rates R = U^H C U, U^H (omega^2 M + K) U = omega^2.

Motions that no elastic element resists are counted from the structure of a system and not from its frequencies. They
are the null space of all rows by which the elements measure the motion, whatever their stiffness and whatever inertia
they hold: a threshold on frequencies takes true low modes for rigid motions where a small inertia on a stiff mesh has a
very high frequency.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

#: Share of the highest squared frequency up to which a motion is rigid that no element resists: it may still turn
#: forces (geometric stiffness). Share below which squared frequencies are solved for apart, as rounding is near.
RIGID, LOW = 1e-11, 1e-6
#: Gyroscopic terms over the highest frequency that are rounding; decay rates over it that are rounding.
NOT_SPINNING, UNDAMPED = 1e-12, 1e-12
#: Share of the largest gyroscopic term that is rounding.
SPINNING = 1e-9
#: Decay rate by which two modes are coupled, over the difference of their frequencies, from which they are coupled.
COUPLED = 0.5
#: Imaginary part of real shapes that is rounding.
REAL = 1e-9
#: Share of the largest eigenvalue of an element, scaled to a unit diagonal, that is rounding: elements may be known as
#: differences of the whole stiffness. The same of a whole stiffness, which sums stiff and soft elements.
ROUNDING, ROUNDING_OF_SUMS = 1e-6, 1e-13
#: Least singular value of the normalized rows of all elements that counts as resistance.
INDEPENDENT = 1e-9


class Eigenmodes(NamedTuple):
    """Modes in rising order of their frequencies.

    omega           (n_mode,) natural frequencies without damping [rad/s]; 0 of motions as a rigid body
    damping_ratio   (n_mode,) decay rate over omega; 0 of rigid bodies
    shapes          (n, n_mode) with x^H M x = 1, complex with gyroscopic terms and where the damping couples modes; the
                    component with the most kinetic energy is real and > 0
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray


def eigenmodes(
    mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, rigid: np.ndarray | None = None
) -> Eigenmodes:
    """All modes of a system with matrices (n, n).

    mass, stiffness   symmetric
    damping           its symmetric part damps, the skew-symmetric one is gyroscopic
    rigid             (n, r) motions that no element resists, by default the null space of the stiffness
    """
    squares, modes = undamped_modes(mass, stiffness, rigid)
    omega = np.sqrt(squares)
    modal = modes.T @ damping @ modes
    gyroscopic, dissipative = (modal - modal.T) / 2, (modal + modal.T) / 2
    coordinates, at_rest, stiffness = np.eye(omega.size), modes[:, omega == 0.0], np.diag(squares)
    if np.abs(gyroscopic).max() > NOT_SPINNING * omega[-1]:
        omega, coordinates = _gyroscopic(omega, gyroscopic)
    kinetic, strain = (_forms(coordinates, x) for x in (np.eye(omega.size), stiffness))
    r = int((omega == 0.0).sum())
    unit = coordinates[:, r:] / np.sqrt(kinetic[r:] + strain[r:] / omega[r:] ** 2)
    rates, amplitudes = _decay(omega[r:], unit.conj().T @ dissipative @ unit)
    shapes = np.column_stack([at_rest[:, :r], modes @ unit @ amplitudes])
    return Eigenmodes(omega, np.r_[np.zeros(r), rates / omega[r:]], _normalized(shapes, mass))


def undamped_modes(
    mass: np.ndarray, stiffness: np.ndarray, rigid: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) squared frequencies, rising, and modes (n, n) with x^T M x = 1; arguments as those of `eigenmodes`.

    The squares are 0 of rigid motions, and of those whose stiffness is negative. Where a small inertia on a stiff
    spring gives a very high frequency, the rounding of the whole problem hides low modes: these are solved for among
    themselves, less the rigid motions.
    """
    mass, stiffness = (mass + mass.T) / 2, (stiffness + stiffness.T) / 2
    if rigid is None:
        rigid = rigid_motions([measured_rows(stiffness, ROUNDING_OF_SUMS)], np.eye(len(mass)))
    squares, modes = scipy.linalg.eigh(stiffness, mass)
    forces, turns = scipy.linalg.eigh(rigid.T @ stiffness @ rigid, rigid.T @ mass @ rigid)
    rigid = rigid @ turns[:, np.abs(forces) <= RIGID * squares[-1]]
    low, r = max(int((squares < LOW * squares[-1]).sum()), rigid.shape[1]), rigid.shape[1]
    basis = modes[:, :low]
    elastic = basis - rigid @ (rigid.T @ mass @ basis)
    elastic = elastic @ np.linalg.eigh(basis.T @ mass @ elastic)[1][:, r:]
    low_squares, shapes = scipy.linalg.eigh(elastic.T @ stiffness @ elastic, elastic.T @ mass @ elastic)
    squares = np.concatenate([np.zeros(r), np.maximum(low_squares, 0.0), squares[low:]])
    return squares, np.column_stack([rigid, elastic @ shapes, modes[:, low:]])


def _decay(omega: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Decay rates (n,) of modes and their amplitudes (n, n) in those of frequencies omega (n,); rates (n, n): R."""
    decay, amplitudes = np.diag(rates).real.copy(), np.eye(omega.size, dtype=rates.dtype)
    coupling = np.abs(rates) * (1 - np.eye(omega.size))
    coupled = coupling > np.maximum(COUPLED * np.abs(np.subtract.outer(omega, omega)), UNDAMPED * omega[-1])
    number, groups = scipy.sparse.csgraph.connected_components(coupled, directed=False)
    for group in (np.flatnonzero(groups == k) for k in range(number)):
        if group.size > 1:
            values, vectors = scipy.linalg.eig(1j * np.diag(omega[group]) - rates[np.ix_(group, group)])
            rising = np.lexsort([-values.real, values.imag])
            decay[group] = -values.real[rising]
            amplitudes = amplitudes.astype(complex)
            amplitudes[np.ix_(group, group)] = vectors[:, rising]
    return decay, amplitudes


def _gyroscopic(omega: np.ndarray, gyroscopic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (n,) and modal coordinates (n, n) of the modes; omega (n,), gyroscopic (n, n): of those at rest.

    With W = diag(omega), modal coordinates q and z = (W q, q') the equation is z' = [[0, W], [-W, -G]] z, whose matrix
    is skew-symmetric: i times it is Hermitian. Of rigid motions, gyroscopic terms between them leave pairs at rest.
    """
    n, w = omega.size, np.diag(omega)
    values, vectors = scipy.linalg.eigh(-1j * np.block([[np.zeros_like(w), w], [-w, -gyroscopic]]))
    values, rates = np.maximum(values[n:], 0.0), vectors[n:, n:]
    r = int((omega == 0).sum())
    turned = np.linalg.matrix_rank(gyroscopic[:r, :r], SPINNING * np.abs(gyroscopic).max()) if r else 0
    values[: r - int(turned) // 2] = 0.0
    return values, rates / np.where(values > 0, 1j * values, 1.0)


def _forms(vectors: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(n_vector,) real quadratic forms x^H A x of vectors (n, n_vector)."""
    return np.einsum("ij,ij->j", vectors.conj(), matrix @ vectors).real


def _normalized(shapes: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Shapes (n, n_mode) with x^H M x = 1 and the component with the most kinetic energy real and > 0."""
    momenta = mass @ shapes
    leading = np.abs(shapes * momenta).argmax(axis=0)
    turned = shapes[leading, np.arange(shapes.shape[1])]
    shapes = shapes / np.sqrt(_forms(shapes, mass)) * (turned.conj() / np.abs(turned))
    return shapes.real if np.abs(shapes.imag).max() < REAL * np.abs(shapes).max() else shapes


def tracked(mass: np.ndarray, modes: Sequence[Eigenmodes]) -> list[Eigenmodes]:
    """The modes at each speed in the order of the lines to which they belong, which rise at the first speed.

    Lines follow the modal assurance criterion with the mass matrix (n, n), |x^H M y|^2 of shapes at neighbouring
    speeds. Source: R. J. Allemang, The modal assurance criterion, Sound and Vibration (August 2003).
    """
    lines = [modes[0]]
    for candidates in modes[1:]:
        likeness = np.abs(lines[-1].shapes.conj().T @ mass @ candidates.shapes) ** 2
        _, order = scipy.optimize.linear_sum_assignment(likeness, maximize=True)
        lines.append(Eigenmodes(candidates.omega[order], candidates.damping_ratio[order], candidates.shapes[:, order]))
    return lines


def damped_modes(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(2 n,) eigenvalues [1/s] and (2 n, 2 n) vectors over coordinates and velocities, of any damping (n, n)."""
    n = len(mass)
    accelerations = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    return np.linalg.eig(np.vstack([np.eye(n, 2 * n, n), accelerations]))


def measured_rows(stiffness: np.ndarray, rounding: float = ROUNDING) -> np.ndarray:
    """(r, n) rows of unit length by which an element of symmetric stiffness (n, n) and rank r measures the motion."""
    scale = np.sqrt(np.abs(np.diag(stiffness)))
    moved = np.flatnonzero(scale > 0)
    if not moved.size:
        return np.zeros((0, len(stiffness)))
    part, scale = stiffness[np.ix_(moved, moved)], scale[moved]
    values, vectors = np.linalg.eigh(part / np.outer(scale, scale))
    elastic = np.abs(values) > rounding * np.abs(values).max()
    rows = np.zeros((int(elastic.sum()), len(stiffness)))
    rows[:, moved] = vectors[:, elastic].T * scale
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def rigid_motions(rows: Sequence[np.ndarray], motions: np.ndarray) -> np.ndarray:
    """(n_free, r) motions that rows (k, n) of elements do not measure, among `motions` (n, n_free) that are allowed."""
    measured = np.concatenate([np.zeros((0, len(motions))), *rows]) @ motions
    size = np.linalg.norm(measured, axis=1, keepdims=True)
    measured = measured[size[:, 0] > 0] / size[size > 0][:, None]
    scale = np.abs(measured).max(axis=0, initial=0.0)
    scale[scale == 0] = 1.0
    _, singular, directions = np.linalg.svd(measured / scale, full_matrices=True)
    rank = int((singular > INDEPENDENT * singular.max(initial=0.0)).sum())
    free = directions[rank:].T / scale[:, None]
    return free / np.abs(free).max(axis=0, initial=0.0)
