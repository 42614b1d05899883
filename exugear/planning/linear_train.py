"""A gearbox as linear equations: its matrices without meshes, and the rows by which meshes couple the coordinates.

From them follow the frequencies that a step must resolve, the resonances of the meshes, the decay of the vibrations
that they excite, and how the coordinates yield to a mesh force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, pi, sqrt
from typing import NamedTuple

import numpy as np

from exugear.planning.eigenmodes import damped_modes, undamped_modes

#: Share of a mode's strain energy in the meshes above which the step must resolve the mode.
STRAIN_SHARE = 0.02
#: The same beside elastic shafts, whose modes keep their frequencies in steps (`exugear.gearbox.modes_in_steps`).
STRAIN_SHARE_BESIDE_SHAFTS = 0.2
#: Difference of two states, over the rms of each coordinate and velocity, up to which they count as equal.
SEAM_TOLERANCE = 1e-6
#: Share of the strain energy of a mode in the meshes above which meshes excite it.
EXCITED = 1e-9
#: Rate of decay over the angular frequency of a mode that is rounding.
UNDAMPED = 1e-8
#: Eigenvalue over the largest one that is the rounding of a rigid motion, as of a train that turns freely.
RIGID = 1e-6
#: Time of the linear decay times this: teeth that part are not damped.
MARGIN = 1.5


class FreeSystem(NamedTuple):
    """Matrices of the coordinates that neither joints nor an imposed speed hold, and the indices of these."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    free: np.ndarray


@dataclass(frozen=True, eq=False)
class LinearTrain:
    """Equations M q'' + C q' + K q = -rows^T f of n coordinates under mesh forces f.

    mass, stiffness, damping   (n, n) without meshes; nonlinear bearings at their steepest slope, undamped
    rows                       (n_stage, n) deflections of the meshes = rows q
    mean, largest              (n_stage,) stiffness of each mesh [N/m]: mean at the largest torque of its map, largest
    mesh_damping               (n_stage,) of each mesh [N s/m]
    joints                     indices of the coordinates that ideal joints hold

    In all methods held are the indices of the coordinates whose motion is imposed.
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    rows: np.ndarray
    mean: np.ndarray
    largest: np.ndarray
    mesh_damping: np.ndarray
    joints: np.ndarray

    def free(self, held: Sequence[int]) -> np.ndarray:
        """Indices of the coordinates that neither ideal joints nor an imposed motion hold."""
        return np.setdiff1d(np.arange(len(self.mass)), np.array([*self.joints, *held], int))

    def frequency_bounds(self, held: Sequence[int] = (), share: float = STRAIN_SHARE) -> tuple[float, float]:
        """Upper bounds of all eigenfrequencies, and of those of the modes in which meshes deform [rad/s].

        Each mesh has its largest stiffness; without held the driving shaft is free to turn. share: of the strain energy
        of a mode in the meshes, above which they deform.
        """
        squares, strain = self._modes(self.largest, held)
        shares = strain.sum(axis=0) / np.maximum(squares, 1.0)
        resolved = shares > min(share, 0.5 * float(shares.max()))
        return sqrt(squares[-1]), sqrt(squares[resolved][-1])

    def mesh_resonances(self, held: Sequence[int], sets: Sequence[Sequence[int]] = ()) -> np.ndarray:
        """(n_stage,) frequency [Hz] of the mode that strains each mesh most, the meshes at their mean stiffness.

        sets   numbers of the stages of each planetary set, all of which get the mode that strains them most together:
               equal planets have modes of equal strain, of which each mesh alone would name another one
        """
        squares, strain = self._modes(self.mean, held)
        share = strain / np.maximum(squares, 1.0)
        for stages in sets:
            share[list(stages)] = share[list(stages)].sum(axis=0)
        return np.sqrt(squares)[share.argmax(axis=1)] / (2 * pi)

    def _modes(self, mesh_stiffness: np.ndarray, held: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """(n_mode,) squared frequencies, rising, and twice the strain energies (n_stage, n_mode) of the meshes."""
        part, rows = np.ix_(self.free(held), self.free(held)), self._stiff_rows(mesh_stiffness)[:, self.free(held)]
        stiffness = self.stiffness[part] + rows.T @ rows
        squares, modes = undamped_modes(self.mass[part], stiffness)
        return squares, (rows @ modes) ** 2

    def _stiff_rows(self, coefficients: np.ndarray) -> np.ndarray:
        """(n_stage, n) rows times the roots of coefficients (n_stage,)."""
        return np.sqrt(coefficients)[:, None] * self.rows

    def decay(self, held: Sequence[int]) -> tuple[float, float]:
        """`slowest_decay` of the modes that the meshes excite; ignores the damping of nonlinear bearings."""
        free, rows, damped_rows = self.free(held), self._stiff_rows(self.mean), self._stiff_rows(self.mesh_damping)
        part = np.ix_(free, free)
        stiffness, damping = self.stiffness + rows.T @ rows, self.damping + damped_rows.T @ damped_rows
        return slowest_decay(self.mass[part], stiffness[part], damping[part], rows[:, free])

    def acceleration_by_force(self, mesh: int, held: Sequence[int]) -> np.ndarray:
        """(n,) accelerations by a unit force of a mesh [1/kg, 1/(kg m)]."""
        free, accelerations = self.free(held), np.zeros(len(self.mass))
        accelerations[free] = np.linalg.solve(self.mass[np.ix_(free, free)], self.rows[mesh, free])
        return accelerations

    def around(self, mesh: int, held: Sequence[int]) -> FreeSystem:
        """The system in which a mesh is a spring; the other meshes have their mean stiffness."""
        free, others = self.free(held), np.arange(len(self.rows)) != mesh
        rows, part = self.rows[others], np.ix_(free, free)
        stiffness = self.stiffness + rows.T @ (self.mean[others, None] * rows)
        damping = self.damping + rows.T @ (self.mesh_damping[others, None] * rows)
        return FreeSystem(self.mass[part], stiffness[part], damping[part], free)


def slowest_decay(
    mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, rows: np.ndarray
) -> tuple[float, float]:
    """Least rate of decay [1/s] and least damping ratio of the modes that the meshes excite; 0 where one is undamped.

    mass, stiffness, damping   (n, n) with the meshes
    rows                       (n_stage, n) of the meshes, times the roots of their stiffnesses
    """
    values, vectors = damped_modes(mass, stiffness, damping)
    modes = vectors[: len(mass)]
    strain = np.einsum("im,ij,jm->m", modes.conj(), stiffness, modes).real
    excited = (np.abs(rows @ modes) ** 2).sum(axis=0) > EXCITED * np.maximum(strain, np.finfo(float).tiny)
    excited &= np.abs(values) > RIGID * np.abs(values).max()
    ratio = float((-values.real / np.maximum(np.abs(values), 1.0))[excited].min(initial=1.0))
    return (float(-values.real[excited].max(initial=-np.inf)), ratio) if ratio > UNDAMPED else (0.0, 0.0)


def settling_time(decay: float, share: float) -> float:
    """Time [s] in which vibrations of a rate of decay > 0 [1/s] fall to a share."""
    return MARGIN * log(1 / share) / decay
