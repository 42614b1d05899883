"""The linear part of a gearbox in modal blocks: its motion, and how meshes measure and change it.

M p'' + C p' + K p = -sum R^T f has the eigenvalues of its first-order form; the rows R p are the measures of a mesh, the
deflection the first of them. Two conjugate eigenvalues, or two real ones, are a block of two real states. States are
scaled as contributions to the deflection of the mesh that they move most, so that all of them are in metres.
"""

from dataclasses import dataclass

import numpy as np
import scipy

#: Share of an eigenvalue in the compliance and in the mobility of every mesh below which it is left out.
LEAST_SHARE = 1e-6
#: Imaginary part of an eigenvalue over its magnitude below which it is real.
REAL = 1e-9
#: Square of a frequency over the largest one below which the motion is rigid.
RIGID = 1e-12


@dataclass(frozen=True, eq=False)
class ModalBlocks:
    """A linear system of n blocks with the measures of m meshes as outputs, and the forces on them as inputs.

    first, second   (n,) eigenvalues [1/s] of the blocks: of oscillating ones real and imaginary part
    oscillating     (n,) whether the eigenvalues of a block are conjugate complex
    measures        (m, k, n, 2) measures = rows . states
    by_impulses     (m, k, n, 2) changes of the states by unit impulses of the forces on the measures
    """

    first: np.ndarray
    second: np.ndarray
    oscillating: np.ndarray
    measures: np.ndarray
    by_impulses: np.ndarray

    @property
    def rate_rows(self) -> np.ndarray:
        """(m, n, 2) rates of the deflections [m/s] = rows . states."""
        of_deflection, crossed = self.measures[:, 0], self.oscillating * self.second
        upper = self.first * of_deflection[..., 0] + crossed * of_deflection[..., 1]
        in_second = np.where(self.oscillating, self.first, self.second)
        return np.stack([upper, in_second * of_deflection[..., 1] - crossed * of_deflection[..., 0]], axis=-1)

    @property
    def mobilities(self) -> np.ndarray:
        """(m,) changes of the rate of each deflection per impulse of the mesh force against it [1/kg]."""
        return -self._by_block().sum(axis=1)

    @property
    def frequencies(self) -> np.ndarray:
        """(n,) angular eigenfrequencies of the blocks [rad/s], 0 of those that do not oscillate."""
        return np.where(self.oscillating, np.hypot(self.first, self.second), 0.0)

    @property
    def shares(self) -> np.ndarray:
        """(m, n) shares of the blocks in the mobilities."""
        return np.abs(self._by_block()) / self.mobilities[:, None]

    def _by_block(self) -> np.ndarray:
        """(m, n) changes of the rates per impulse of the mesh force [1/kg]."""
        return np.sum(self.rate_rows * self.by_impulses[:, 0], axis=-1)


def modal_blocks(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, rows: np.ndarray) -> ModalBlocks:
    """Blocks of the system with these matrices (n, n) and the rows (m, k, n) of the measures, the deflections first.

    Rigid motions and modes that no mesh force excites are left out.
    """
    squares, modes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    modes = modes[:, squares > RIGID * squares[-1]]
    n, rows = modes.shape[1], rows @ modes
    by_state = -np.hstack([modes.T @ stiffness @ modes, modes.T @ damping @ modes])
    values, vectors = np.linalg.eig(np.vstack([np.eye(n, 2 * n, n), by_state]))
    forces = np.hstack([np.zeros_like(rows.reshape(-1, n)), -rows.reshape(-1, n)])
    inputs = np.linalg.solve(vectors, forces.T.astype(complex)).T.reshape(*rows.shape[:2], -1)
    outputs = rows @ vectors[:n]
    residues = outputs[:, 0] * inputs[:, 0]
    excited = _shares(residues * values) | _shares(residues / values)
    values, inputs, outputs = values[excited], inputs[..., excited], outputs[..., excited]
    deflections = outputs[:, 0]
    largest = np.take_along_axis(deflections, np.abs(deflections).argmax(axis=0)[None], axis=0)[0]
    return _paired(values, outputs / largest, inputs * largest)


def _shares(terms: np.ndarray) -> np.ndarray:
    """(n,) whether the terms (m, n) of eigenvalues have a share in those of any mesh."""
    sizes = np.abs(terms)
    return (sizes > LEAST_SHARE * sizes.max(axis=1, keepdims=True)).any(axis=0)


def _paired(values: np.ndarray, outputs: np.ndarray, inputs: np.ndarray) -> ModalBlocks:
    """Blocks of eigenvalues [1/s] with outputs and inputs (m, k, number of values)."""
    oscillating = values.imag > REAL * np.abs(values)
    real = np.flatnonzero(np.abs(values.imag) <= REAL * np.abs(values))
    first, second = real[0::2], real[1::2]
    alone = first.size - second.size
    second = np.append(second, first[first.size - alone :])
    answered = np.append(np.ones(second.size - alone), np.zeros(alone))
    pairs, couples = outputs[..., oscillating], 2 * inputs[..., oscillating]
    decaying, answers = outputs.real, inputs.real
    outputs_of_reals = np.stack([decaying[..., first], decaying[..., second]], axis=-1)
    inputs_of_reals = np.stack([answers[..., first], answered * answers[..., second]], axis=-1)
    return ModalBlocks(
        np.concatenate([values[oscillating].real, values[first].real]),
        np.concatenate([values[oscillating].imag, values[second].real]),
        np.concatenate([np.ones(pairs.shape[-1], bool), np.zeros(first.size, bool)]),
        np.concatenate([np.stack([pairs.real, -pairs.imag], axis=-1), outputs_of_reals], axis=-2),
        np.concatenate([np.stack([couples.real, couples.imag], axis=-1), inputs_of_reals], axis=-2),
    )
