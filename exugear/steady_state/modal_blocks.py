"""The linear part of a gearbox in modal blocks: its motion, and how a mesh force acts on it.

M p'' + C p' + K p = -row force has the eigenvalues of its first-order form. Two conjugate eigenvalues, or two real
ones, are a block of two real states. States are scaled as contributions to the deflection row . p of the mesh, so that
all of them are in metres.
"""

from dataclasses import dataclass

import numpy as np
import scipy

#: Share of an eigenvalue in the compliance and in the mobility of the mesh below which it is left out.
LEAST_SHARE = 1e-6
#: Imaginary part of an eigenvalue over its magnitude below which it is real.
REAL = 1e-9


@dataclass(frozen=True, eq=False)
class ModalBlocks:
    """A linear system with a mesh force as its input and the deflection of the mesh as its output.

    first, second   (n,) eigenvalues [1/s] of the blocks: of oscillating ones real and imaginary part
    oscillating     (n,) whether the eigenvalues of a block are conjugate complex
    by_impulse      (n, 2) change of the states by a unit impulse of the mesh force [m/(N s)]
    """

    first: np.ndarray
    second: np.ndarray
    oscillating: np.ndarray
    by_impulse: np.ndarray

    @property
    def deflection_row(self) -> np.ndarray:
        """(n, 2) deflection = row . states."""
        return np.column_stack([np.ones(self.first.size), np.where(self.oscillating, 0.0, 1.0)])

    @property
    def rate_row(self) -> np.ndarray:
        """(n, 2) rate of the deflection [m/s] = row . states."""
        return np.column_stack([self.first, np.where(self.oscillating, -self.second, self.second)])

    @property
    def mobility(self) -> float:
        """Change of the rate of the deflection per impulse against it [1/kg]."""
        return -float(np.sum(self.rate_row * self.by_impulse))

    @property
    def frequencies(self) -> np.ndarray:
        """(n,) angular eigenfrequencies of the blocks [rad/s], 0 of those that do not oscillate."""
        return np.where(self.oscillating, np.hypot(self.first, self.second), 0.0)

    @property
    def shares(self) -> np.ndarray:
        """(n,) shares of the blocks in the change of the rate of the deflection by an impulse."""
        return np.abs(np.sum(self.rate_row * self.by_impulse, axis=1)) / self.mobility


def modal_blocks(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, row: np.ndarray) -> ModalBlocks:
    """Blocks of the system with these matrices (n, n) and the row (n,) of the mesh.

    Motions without strain and modes that the mesh does not excite are left out.
    """
    mass, stiffness, damping, row = _without_rigid_motion(mass, stiffness, damping, row)
    n, inverse = len(mass), np.linalg.inv(mass)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    values, vectors = np.linalg.eig(matrix)
    by_impulse = np.linalg.solve(vectors, np.concatenate([np.zeros(n), -inverse @ row]).astype(complex))
    residues = by_impulse * (row @ vectors[:n])
    mobility, compliance = np.abs(residues * values), np.abs(residues / values)
    excited = (mobility > LEAST_SHARE * mobility.max()) | (compliance > LEAST_SHARE * compliance.max())
    return _paired(values[excited], residues[excited])


def _without_rigid_motion(mass, stiffness, damping, row):
    """The matrices in the coordinates of the undamped modes, without those that are neither strained nor damped."""
    squares, modes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    modes = modes[:, squares > 1e-12 * squares[-1]]
    return np.eye(modes.shape[1]), modes.T @ stiffness @ modes, modes.T @ damping @ modes, row @ modes


def _paired(values: np.ndarray, residues: np.ndarray) -> ModalBlocks:
    """Blocks of eigenvalues [1/s] with their residues, by which the deflection answers an impulse [m/(N s)]."""
    oscillating = values.imag > REAL * np.abs(values)
    real = np.abs(values.imag) <= REAL * np.abs(values)
    pairs, doubled = values[oscillating], 2 * residues[oscillating]
    decays, answers = values[real].real, residues[real].real
    if decays.size % 2:
        decays, answers = np.append(decays, decays.min()), np.append(answers, 0.0)
    return ModalBlocks(
        np.concatenate([pairs.real, decays[0::2]]),
        np.concatenate([pairs.imag, decays[1::2]]),
        np.concatenate([np.ones(pairs.size, bool), np.zeros(decays.size // 2, bool)]),
        np.concatenate([np.column_stack([doubled.real, doubled.imag]), np.column_stack([answers[0::2], answers[1::2]])]),
    )
