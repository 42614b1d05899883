"""The linear part of a gearbox in modal blocks: its motion, and how meshes measure and change it.

M p'' + C p' + K p = -sum R^T f has the eigenvalues of its first-order form; the rows R p are the measures of a mesh,
the deflection the first of them. Two conjugate eigenvalues, or two real ones, are a block of two real states. States
are scaled as contributions to the deflection of the mesh that they move most, so that all of them are in metres.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from exugear.planning.eigenmodes import damped_modes, undamped_modes

#: Share of an eigenvalue in the compliance and in the mobility of every mesh below which it is left out.
LEAST_SHARE = 1e-6
#: Imaginary part of an eigenvalue over its magnitude below which it is real.
REAL = 1e-9


@dataclass(frozen=True, eq=False)
class ModalBlocks:
    """A linear system of n blocks with the measures of m meshes as outputs, and the forces on them as inputs.

    first, second   (n,) eigenvalues [1/s] of the blocks: of oscillating ones real and imaginary part
    oscillating     (n,) whether the eigenvalues of a block are conjugate complex
    measures        (m, k + 1, n, 2) measures = rows . states: k on which forces act, the DTE
    by_impulses     (m, k, n, 2) changes of the states by unit impulses of these forces
    coordinates     (q, 2 n) coordinates of the system = matrix . states
    speed           of the driving shaft [rad/s]
    by_turning      (2 n, 2 n) rates of the states by the states per rad/s by which the shafts turn faster
    by_square       (2 n, 2 n) likewise per (rad/s)^2 by which the square of the speed is larger
    by_load         (2 n,) rates of the states by centrifugal forces, per (rad/s)^2
    left_out        largest share of the modes left out in the compliance or the mobility of a mesh
    """

    first: np.ndarray
    second: np.ndarray
    oscillating: np.ndarray
    measures: np.ndarray
    by_impulses: np.ndarray
    coordinates: np.ndarray
    speed: float
    by_turning: np.ndarray
    by_square: np.ndarray
    by_load: np.ndarray
    left_out: float

    def rates_at(self, speed: float) -> np.ndarray:
        """(2 n, 2 n) rates of the states by the states at a speed of the driving shaft [rad/s]."""
        turning = (speed - self.speed) * self.by_turning + (speed**2 - self.speed**2) * self.by_square
        return _rates(self.first, self.second, self.oscillating) + turning

    def rest_at(self, speed: float) -> np.ndarray:
        """(2 n,) states in which centrifugal forces hold the system at a speed of the driving shaft [rad/s]."""
        if not self.by_load.any():
            return np.zeros_like(self.by_load)
        return np.linalg.solve(self.rates_at(speed), -(speed**2) * self.by_load)

    def at_speed(self, speed: float) -> tuple["ModalBlocks", np.ndarray]:
        """Blocks of the system at a speed of the driving shaft [rad/s]; states = matrix . their states."""
        rates = self.rates_at(speed)
        values, vectors = np.linalg.eig(rates)
        pairs = _paired(values, vectors, np.linalg.inv(vectors).T)
        matrix, inverse = (x.reshape(len(x), -1) for x in (pairs.outputs, pairs.inputs))
        measures = (self.measures.reshape(-1, len(matrix)) @ matrix).reshape(self.measures.shape)
        by_impulses = (self.by_impulses.reshape(-1, len(matrix)) @ inverse).reshape(self.by_impulses.shape)
        blocks = pairs.first, pairs.second, pairs.oscillating, measures, by_impulses
        turning = inverse.T @ self.by_turning @ matrix, inverse.T @ self.by_square @ matrix, inverse.T @ self.by_load
        return ModalBlocks(*blocks, self.coordinates @ matrix, speed, *turning, self.left_out), matrix

    @cached_property
    def gyroscopic(self) -> bool:
        """Whether the system depends on the speed."""
        return bool(self.by_turning.any() or self.by_square.any() or self.by_load.any())

    @property
    def rate_rows(self) -> np.ndarray:
        """(m, n, 2) rates of the deflections [m/s] = rows . states."""
        of_deflection = self.measures[:, 0]
        rates = of_deflection.reshape(len(of_deflection), -1) @ _rates(self.first, self.second, self.oscillating)
        return rates.reshape(of_deflection.shape)

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


class Turning(NamedTuple):
    """How a linear system depends on the speed of its driving shaft.

    speed         of its matrices [rad/s]
    gyroscopic    (n, n) damping per rad/s
    centrifugal   (n, n) stiffness per (rad/s)^2
    load          (n,) centrifugal forces per (rad/s)^2
    """

    speed: float
    gyroscopic: np.ndarray
    centrifugal: np.ndarray
    load: np.ndarray


class Pairs(NamedTuple):
    """Eigenvalues as n blocks: first, second, oscillating as in `ModalBlocks`; outputs and inputs (q, n, 2)."""

    first: np.ndarray
    second: np.ndarray
    oscillating: np.ndarray
    outputs: np.ndarray
    inputs: np.ndarray


def modal_blocks(
    mass: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    rows: np.ndarray,
    rigid: np.ndarray | None = None,
    turning: Turning | None = None,
) -> ModalBlocks:
    """Blocks of the system with these matrices (n, n) and the rows (m, k + 1, n) of the measures.

    The deflection of a mesh is its first measure, the DTE the last; on the others forces act.

    rigid     (n, r) motions that no element resists, by default the null space of the stiffness
    turning   how the system depends on the speed of the driving shaft, by default not at all

    Rigid motions and modes that no mesh force excites are left out.
    """
    squares, modes = undamped_modes(mass, stiffness, rigid)
    modes = modes[:, squares > 0]
    n, rows = modes.shape[1], rows @ modes
    values, vectors = damped_modes(np.eye(n), modes.T @ stiffness @ modes, modes.T @ damping @ modes)
    inputs = np.linalg.solve(vectors, np.vstack([np.zeros((n, n)), -np.eye(n)]).astype(complex)).T
    deflections = rows[:, 0] @ vectors[:n]
    residues = deflections * (rows[:, 0] @ inputs)
    shares = np.concatenate([_shares(residues * values), _shares(residues / values)])
    excited = (shares > LEAST_SHARE * shares.max(axis=1, keepdims=True)).any(axis=0)
    deflections = deflections[:, excited]
    scale = np.take_along_axis(deflections, np.abs(deflections).argmax(axis=0)[None], axis=0)[0]
    pairs = _paired(values[excited], vectors[:n, excited] / scale, inputs[:, excited] * scale)
    measures, by_impulses = np.tensordot(rows, pairs.outputs, 1), np.tensordot(rows[:, :-1], pairs.inputs, 1)
    turning = turning or Turning(0.0, np.zeros_like(mass), np.zeros_like(mass), np.zeros(len(mass)))
    outputs_of, inputs_of = (x.reshape(n, -1) for x in (pairs.outputs, pairs.inputs))
    rates = outputs_of @ _rates(pairs.first, pairs.second, pairs.oscillating)
    by_turning = inputs_of.T @ modes.T @ turning.gyroscopic @ modes @ rates
    by_square = inputs_of.T @ modes.T @ turning.centrifugal @ modes @ outputs_of
    by_speed = turning.speed, by_turning, by_square, -inputs_of.T @ modes.T @ turning.load
    left_out = float(shares[:, ~excited].sum(axis=1).max())
    blocks = pairs.first, pairs.second, pairs.oscillating, measures, by_impulses
    return ModalBlocks(*blocks, modes @ outputs_of, *by_speed, left_out)


def _shares(terms: np.ndarray) -> np.ndarray:
    """(m, n) shares of the terms of eigenvalues in those of each mesh."""
    return np.abs(terms) / np.abs(terms).sum(axis=1, keepdims=True)


def _rates(first: np.ndarray, second: np.ndarray, oscillating: np.ndarray) -> np.ndarray:
    """(2 n, 2 n) rates of the states of blocks by the states."""
    crossed = np.where(oscillating, second, 0.0)
    blocks = np.array([[first, -crossed], [crossed, np.where(oscillating, first, second)]])
    return scipy.linalg.block_diag(*np.moveaxis(blocks, -1, 0))


def _paired(values: np.ndarray, outputs: np.ndarray, inputs: np.ndarray) -> Pairs:
    """Blocks of eigenvalues [1/s] with outputs and inputs (q, number of values).

    A real eigenvalue without another is paired with a state that nothing moves.
    """
    oscillating = values.imag > REAL * np.abs(values)
    real = np.flatnonzero(np.abs(values.imag) <= REAL * np.abs(values))
    first_real, second_real = real[0::2], real[1::2]
    alone = first_real.size - second_real.size
    answered = np.append(np.ones(second_real.size), np.zeros(alone))
    second_real = np.append(second_real, first_real[first_real.size - alone :])
    pairs, couples = outputs[:, oscillating], 2 * inputs[:, oscillating]
    decaying, answers = outputs.real, inputs.real
    outputs_of_reals = np.stack([decaying[:, first_real], answered * decaying[:, second_real]], axis=-1)
    inputs_of_reals = np.stack([answers[:, first_real], answered * answers[:, second_real]], axis=-1)
    return Pairs(
        np.concatenate([values[oscillating].real, values[first_real].real]),
        np.concatenate([values[oscillating].imag, values[second_real].real]),
        np.concatenate([np.ones(pairs.shape[1], bool), np.zeros(first_real.size, bool)]),
        np.concatenate([np.stack([pairs.real, -pairs.imag], axis=-1), outputs_of_reals], axis=1),
        np.concatenate([np.stack([couples.real, couples.imag], axis=-1), inputs_of_reals], axis=1),
    )
