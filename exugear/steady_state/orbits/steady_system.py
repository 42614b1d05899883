"""The equations of a steady state: a linear system in modal blocks, excited by the nonlinear force of a single mesh."""

from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, pi
from typing import NamedTuple

import numpy as np

from exugear.force_table.kernel_records import address_of, record_of
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.map_range import beyond_map
from exugear.steady_state.orbits.cycle_kernels import NO_SAMPLES, STEADY_MESH, advance, propagators
from exugear.steady_state.orbits.modal_blocks import ModalBlocks

#: Least number of steps in a mesh cycle, and in a period of a mode that takes part in the whole mobility of the mesh; a
#: share in the mobility needs its root of them. Measured: doubling them changes folds and rms by 3e-4 at most.
STEPS_PER_CYCLE, STEPS_PER_PERIOD = 512, 320
#: Share of a mode in the mobility of the mesh above which a sweep waits for its decay.
RESOLVED_SHARE = 0.02
#: Phases closer than this are the same.
SAME_PHASE = 1e-9
#: Relative change of the frequency for the slope of a cycle by it.
FREQUENCY_STEP = 1e-6


class CycleEnd(NamedTuple):
    """States (2 n,) at the end of mesh cycles [m], and their slopes (2 n, 2 n) by those at the beginning."""

    states: np.ndarray
    slopes: np.ndarray


class Orbit(NamedTuple):
    """Samples over the period: weight, phase in mesh cycles, deflection [m], mesh force and static force [N]."""

    weight: np.ndarray
    phase: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    static_force: np.ndarray


class MeshEquilibrium(NamedTuple):
    """A mesh in equilibrium: force [N], deflection [m], mean stiffness over the mesh cycle [N/m].

    by_phase, by_misalignment   slopes of its potential [N m per pitch, N m]
    opening                     of the flanks by the displaced bearings [m]
    side                        of the loaded flank: +1 driving, -1 back flank
    """

    force: float
    deflection: float
    stiffness: float
    by_phase: float = 0.0
    by_misalignment: float = 0.0
    opening: float = 0.0
    side: float = 1.0


@dataclass(frozen=True, eq=False)
class SteadySystem:
    """A mesh in its linear surroundings, at constant speed: its phase is a known function of time.

    law          force law without offsets
    blocks       linear system, the mesh with its mean stiffness; measures of the mesh: deflection alone, or deflection,
                 phase and misalignment
    equilibrium  in which the states are 0
    variation    of the stiffness of any other mesh over its cycle, over its mean, which the linear system contains
    """

    law: MeshForce
    blocks: ModalBlocks
    equilibrium: MeshEquilibrium
    variation: float = 0.0
    mesh: np.record = field(init=False, repr=False)
    addresses: np.ndarray = field(init=False, repr=False)
    rows: np.ndarray = field(init=False, repr=False)
    breaks: np.ndarray = field(init=False, repr=False)

    def __post_init__(self):
        mesh = record_of(STEADY_MESH, mobility=self.blocks.mobility, **self.equilibrium._asdict())
        object.__setattr__(self, "mesh", mesh)
        object.__setattr__(self, "addresses", np.array([address_of(self.law.table), address_of(mesh)]))
        blocks = self.blocks
        tables = [blocks.rate_row[None], blocks.measures, blocks.by_impulses]
        object.__setattr__(self, "rows", np.concatenate([x.reshape(len(x), -1) for x in tables]))
        object.__setattr__(self, "breaks", _phases_of_jumps(self.law))

    @property
    def size(self) -> int:
        """Number of states."""
        return self.rows.shape[1]

    @cached_property
    def resonance(self) -> float:
        """Frequency [Hz] of the mode that strains the mesh most: with the largest share in its compliance."""
        frequencies = self.blocks.frequencies
        oscillating = frequencies > 0
        compliances = self.blocks.shares[oscillating] / frequencies[oscillating] ** 2
        return float(frequencies[oscillating][compliances.argmax()] / (2 * pi))

    @cached_property
    def resolved(self) -> float:
        """Highest frequency [Hz] of the modes times the roots of their shares in the mobility of the mesh."""
        return float((self.blocks.frequencies * np.sqrt(self.blocks.shares)).max() / (2 * pi))

    @cached_property
    def static_deflection(self) -> float:
        """Mean static deflection [m] by the mean stiffness, the unit of amplitudes."""
        return abs(self.equilibrium.force) / self.equilibrium.stiffness

    @cached_property
    def decay(self) -> float:
        """Rate of decay [1/s] of the slowest mode that the mesh moves, with the mean damping of the mesh."""
        resolved = self.blocks.shares > RESOLVED_SHARE
        by_mesh = self.law.damping * self.blocks.mobility * self.blocks.shares / 2
        return float((by_mesh - self.blocks.first)[resolved].min())

    def pieces(self, frequency: float) -> np.ndarray:
        """(p, 4) pieces of a cycle between jumps of the force, as `cycle_kernels.advance`; mesh frequency [Hz]."""
        steps = max(STEPS_PER_CYCLE, STEPS_PER_PERIOD * self.resolved / frequency)
        lengths = np.diff(self.breaks)
        numbers = np.ceil(steps * lengths)
        return np.column_stack([self.breaks[:-1], lengths, numbers, lengths / numbers / frequency])

    def cycles_end(self, states: np.ndarray, frequency: float, cycles: int) -> CycleEnd:
        """The states after a number of mesh cycles, with their slopes."""
        return self._advanced(states, np.eye(self.size), self.pieces(frequency), cycles)

    def slope_by_frequency(self, states: np.ndarray, end: np.ndarray, frequency: float, cycles: int) -> np.ndarray:
        """(2 n,) slope [m/Hz] of the states after a number of cycles, which are end, by the frequency."""
        change, pieces = FREQUENCY_STEP * frequency, self.pieces(frequency)
        pieces[:, 3] /= 1 + FREQUENCY_STEP
        return (self._advanced(states, np.zeros((self.size, 0)), pieces, cycles).states - end) / change

    def settled(self, states: np.ndarray, frequency: float, cycles: int) -> np.ndarray:
        """The states after a number of cycles, without slopes."""
        return self._advanced(states, np.zeros((self.size, 0)), self.pieces(frequency), cycles).states

    def orbit(self, states: np.ndarray, frequency: float, cycles: int) -> Orbit:
        """Samples over a number of cycles."""
        pieces = self.pieces(frequency)
        numbers = pieces[:, 2].astype(int)
        moved, blocks, tables = states.copy(), self.propagators(pieces), []
        for _ in range(cycles):
            samples = np.zeros((numbers.sum(), 3))
            self._call(moved, np.zeros((self.size, 0)), pieces, blocks, samples)
            tables.append(samples)
        middles = [a + x * (np.arange(n) + 0.5) / n for (a, x), n in zip(pieces[:, :2], numbers, strict=True)]
        phase = np.concatenate(middles)
        weight = np.tile(np.repeat(pieces[:, 1] / numbers, numbers), cycles) / cycles
        phases = np.concatenate([phase + k for k in range(cycles)])
        return Orbit(weight, phases, *np.concatenate(tables).T)

    def propagators(self, pieces: np.ndarray) -> np.ndarray:
        """Matrices of the blocks over the steps of the pieces."""
        return propagators(self.blocks.first, self.blocks.second, self.blocks.oscillating, pieces)

    def _advanced(self, states: np.ndarray, matrix: np.ndarray, pieces: np.ndarray, cycles: int) -> CycleEnd:
        moved, blocks = states.copy(), self.propagators(pieces)
        for _ in range(cycles):
            self._call(moved, matrix, pieces, blocks, NO_SAMPLES)
        return CycleEnd(moved, matrix)

    def _call(self, states, matrix, pieces, blocks, samples) -> None:
        try:
            advance(self.addresses, self.rows, pieces, blocks, states, matrix, samples)
        except ValueError as error:
            raise ValueError(beyond_map(self.law.table.head, error.args)) from None


def _phases_of_jumps(law: MeshForce) -> np.ndarray:
    """Phases from 0 to 1 between which the force of either flank does not jump."""
    jumps = law.jumps
    if isfinite(law.backlash):
        jumps = np.concatenate([jumps, law.back_phase - jumps])
    inside = np.sort(jumps % 1.0)
    inside = inside[(inside > SAME_PHASE) & (inside < 1 - SAME_PHASE)]
    return np.concatenate([[0.0], inside[np.diff(inside, prepend=0.0) > SAME_PHASE], [1.0]])
