"""The equations of a steady state: a linear system in modal blocks, excited by the nonlinear forces of meshes."""

from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.kernel_records import address_of
from exugear.mesh_force.map_range import beyond_map
from exugear.steady_state.cycle_kernels import MEASURES, NO_SAMPLES, advance, propagators
from exugear.steady_state.exciting_mesh import ExcitingMesh, times_between_jumps
from exugear.steady_state.modal_blocks import ModalBlocks
from exugear.steady_state.ring_blocks import RingBlocks, largest_mobilities
from fem.support.validation import set_fields

#: Least number of steps in a mesh cycle, and in a period of a mode that takes part in the whole mobility of the mesh; a
#: share in the mobility needs its root of them. Measured: doubling them changes folds and rms by 3e-4 at most.
STEPS_PER_CYCLE, STEPS_PER_PERIOD = 512, 320
#: Number of steps after which the dependence on the states at the beginning is looked at, and value below which it is
#: rounding. Measured: over 36 mesh cycles 22 states depend on 9 directions in the mean, at low speeds on 3.
STEPS_PER_SECTION, FORGOTTEN = 2048, 1e-12
#: Share of a mode in the mobility of the mesh above which a sweep waits for its decay.
RESOLVED_SHARE = 0.02
#: Relative change of the frequency for the slope of a period by it, and how much longer the steps for it may be.
FREQUENCY_STEP, LONGER_STEPS = 1e-6, 8


class PeriodEnd(NamedTuple):
    """States (2 n,) at the end of common periods [m], and their slopes (2 n, 2 n) by those at the beginning."""

    states: np.ndarray
    slopes: np.ndarray


class Orbit(NamedTuple):
    """Samples of a mesh over a period: weight, phase in mesh cycles, DTE [m], mesh force and static force [N]."""

    weight: np.ndarray
    phase: np.ndarray
    dte: np.ndarray
    force: np.ndarray
    static_force: np.ndarray


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """The linear system at a speed, with the modes of elastic rings behind it.

    first, second, oscillating
              (n,) eigenvalues of the blocks [1/s] as in `ModalBlocks`, those of the rings last
    rows      (m, 2 k + 2, 2 n) as `cycle_kernels.advance`
    shifts    (m, 4) likewise
    matrix    (2 n, 2 n) states of the system = matrix . states of the blocks
    inverse   of the matrix
    rest      (2 n,) states of the system about which the states move: centrifugal forces displace it

    States that are kept between speeds count from there.
    """

    first: np.ndarray
    second: np.ndarray
    oscillating: np.ndarray
    rows: np.ndarray
    shifts: np.ndarray
    matrix: np.ndarray
    inverse: np.ndarray
    rest: np.ndarray

    def propagators(self, pieces: np.ndarray) -> np.ndarray:
        """Matrices of the blocks over the steps of the pieces."""
        return propagators(self.first, self.second, self.oscillating, pieces)


def linear_motion(blocks: ModalBlocks, rings: RingBlocks, speed: float) -> LinearMotion:
    """The linear system with elastic rings at a speed of the driving shaft [rad/s]."""
    matrix, rest = np.eye(2 * blocks.first.size), blocks.rest_at(speed)
    by_measures = blocks.measures.reshape(*blocks.measures.shape[:2], -1) @ rest
    shifts = np.zeros((len(by_measures), MEASURES + 1))
    shifts[:, : by_measures.shape[1] - 1], shifts[:, MEASURES] = by_measures[:, :-1], by_measures[:, -1]
    if blocks.gyroscopic:
        blocks, matrix = blocks.at_speed(speed)
    measures, dte = blocks.measures[:, :-1], blocks.measures[:, -1:]
    tables = [blocks.rate_rows[:, None], measures, blocks.by_impulses, dte]
    rows = np.concatenate([x.reshape(*x.shape[:2], -1) for x in tables], axis=1)
    m, apart = rings.number, np.zeros((2 * blocks.first.size, 2 * rings.number))
    rows = np.concatenate([rows, np.zeros((*rows.shape[:2], 2 * m))], axis=2)
    matrix = np.block([[matrix, apart], [apart.T, np.eye(2 * m)]])
    return LinearMotion(
        np.concatenate([blocks.first, rings.damping_rate]),
        np.concatenate([blocks.second, rings.frequency]),
        np.concatenate([blocks.oscillating, np.ones(m, bool)]),
        rows,
        shifts,
        matrix,
        np.linalg.inv(matrix),
        np.append(rest, np.zeros(2 * m)),
    )


def sections_of(pieces: np.ndarray) -> list[np.ndarray]:
    """Pieces of a common period cut into sections of about `STEPS_PER_SECTION` steps, all but the last of even number.

    Their steps are those of the pieces: meshes act in reverse order in every second one.
    """
    ends = np.cumsum(pieces[:, 2])
    cuts = 2 * np.round(np.linspace(0, ends[-1], max(int(ends[-1] / STEPS_PER_SECTION), 1) + 1)[1:-1] / 2)
    bounds = np.union1d(np.append(0, ends), cuts)
    of_piece = np.searchsorted(ends, bounds[:-1], side="right")
    begin = bounds[:-1] - np.append(0, ends)[of_piece]
    number, (first, length, whole, step) = np.diff(bounds), pieces[of_piece].T
    cut = np.column_stack([first + length * begin / whole, length * number / whole, number, step])
    return np.split(cut, np.searchsorted(bounds, cuts))


def not_forgotten(columns: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As few columns (n, c) and directions (c, m) of the same product as possible, but for what is below `FORGOTTEN`.

    The directions are of length 1 and across each other.
    """
    left, values, right = np.linalg.svd(columns, full_matrices=False)
    kept = values > FORGOTTEN
    return np.ascontiguousarray(left[:, kept] * values[kept]), right[kept] @ directions


@dataclass(frozen=True, eq=False)
class SteadySystem:
    """Meshes in their linear surroundings, at constant speed: their phases are known functions of time.

    The first mesh is the reference: frequencies are its mesh frequencies, amplitudes are over its static deflection.

    meshes        that excite, with a common period
    blocks        linear system at a speed, these meshes with their mean stiffness
    mesh_cycles   of the reference mesh per radian of the driving shaft
    variation     of the stiffness of any further mesh over its cycle, over its mean, which the linear system contains
    rings         modes of elastic rings, whose states stand behind those of the blocks
    """

    meshes: tuple[ExcitingMesh, ...]
    blocks: ModalBlocks
    mesh_cycles: float
    variation: float
    rings: RingBlocks
    records: tuple[np.record, ...] = field(init=False, repr=False)
    addresses: np.ndarray = field(init=False, repr=False)
    breaks: np.ndarray = field(init=False, repr=False)
    _at: dict[float, LinearMotion] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self):
        records = tuple(mesh.record(x) for mesh, x in zip(self.meshes, self.blocks.mobilities, strict=True))
        addresses = [(address_of(x.law.table), address_of(y)) for x, y in zip(self.meshes, records, strict=True)]
        set_fields(self, records=records, addresses=np.array(addresses))
        set_fields(self, breaks=times_between_jumps(self.meshes))

    @property
    def size(self) -> int:
        """Number of states."""
        return 2 * (self.blocks.first.size + self.rings.number)

    @cached_property
    def at_start(self) -> np.ndarray:
        """(2 n,) states at the beginning of the period from which sweeps start: rings bent by the mean mesh forces."""
        first = 2 * self.blocks.first.size
        states = np.zeros(self.size)
        for mesh in self.meshes:
            if mesh.ring is not None:
                force = mesh.equilibrium.force
                shape, _ = mesh.ring.shape_at(force, mesh.phase)
                begin = int(mesh.ring.record.first)
                part = slice((begin - first) // 2, (begin - first) // 2 + shape.size)
                states[begin : begin + 2 * shape.size : 2] += force * shape / self.rings.stiffness[part]
        return states

    @property
    def cycles(self) -> int:
        """Cycles of the reference mesh in the common period."""
        return self.meshes[0].cycles

    @property
    def resonance(self) -> float:
        """Frequency [Hz] of the mode that strains the reference mesh most: with the largest share in its compliance."""
        return float(self.resonances[0])

    @cached_property
    def resonances(self) -> np.ndarray:
        """(m,) frequencies of the reference mesh [Hz] at which each mesh excites the mode that strains it most."""
        frequencies = self.blocks.frequencies
        oscillating = frequencies > 0
        compliances = self.blocks.shares[:, oscillating] / frequencies[oscillating] ** 2
        cycles = np.array([mesh.cycles for mesh in self.meshes])
        return frequencies[oscillating][compliances.argmax(axis=1)] / (2 * pi) * self.cycles / cycles

    @cached_property
    def resolved(self) -> float:
        """Highest frequency [Hz] of the modes times the roots of their shares in the mobility of any mesh."""
        of_blocks = self.blocks.frequencies * np.sqrt(self.blocks.shares.max(axis=0))
        of_rings = self.rings.frequency * np.sqrt(self._shares_of_rings)
        return float(max(of_blocks.max(), of_rings.max(initial=0.0)) / (2 * pi))

    @cached_property
    def _shares_of_rings(self) -> np.ndarray:
        """(m,) largest shares of the modes of rings in the mobility of any mesh."""
        mobilities = largest_mobilities([mesh.ring for mesh in self.meshes], self.rings, self.blocks.first.size)
        return (mobilities / (self.blocks.mobilities[:, None] + mobilities.sum(axis=1, keepdims=True))).max(axis=0)

    @cached_property
    def static_deflection(self) -> float:
        """Mean static deflection of the reference mesh [m] by its mean stiffness, the unit of amplitudes."""
        return abs(self.meshes[0].equilibrium.force) / self.meshes[0].equilibrium.stiffness

    @cached_property
    def decay(self) -> float:
        """Rate of decay [1/s] of the slowest mode that a mesh moves, with the mean damping of the meshes."""
        resolved = self.blocks.shares.max(axis=0) > RESOLVED_SHARE
        damping = np.array([mesh.law.damping for mesh in self.meshes])
        by_meshes = (damping * self.blocks.mobilities) @ self.blocks.shares / 2
        of_rings = -self.rings.damping_rate[self._shares_of_rings > RESOLVED_SHARE]
        return float(min((by_meshes - self.blocks.first)[resolved].min(), of_rings.min(initial=np.inf)))

    def sampled(self, states: np.ndarray, frequency: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (n_time, 2 n) and static forces (n_time, m) [N] at times over the common period, which rise from 0."""
        pieces, motion = self.pieces(frequency, np.union1d(self.breaks, times)), self.at(frequency)
        moved, moves = motion.inverse @ states, motion.propagators(pieces)
        no_matrix, samples = np.zeros((self.size, 0)), np.zeros((times.size, len(self.meshes), 3, 1))
        bounds = np.append(np.searchsorted(pieces[:, 0], times), len(pieces))
        at_times = np.zeros((times.size, self.size))
        for i, time in enumerate(times):
            at_rest = np.array([[time, 0.0, 1.0, 0.0]])
            self._call(motion, at_rest, motion.propagators(at_rest), moved, no_matrix, samples[i])
            at_times[i] = motion.rest + motion.matrix @ moved
            section = slice(bounds[i], bounds[i + 1])
            self._call(motion, pieces[section], moves[section], moved, no_matrix, NO_SAMPLES)
        return at_times, samples[:, :, 2, 0]

    def pieces(self, frequency: float, bounds: np.ndarray | None = None) -> np.ndarray:
        """(p, 4) pieces of the common period between bounds, by default jumps of a force, as `cycle_kernels.advance`.

        frequency   mesh frequency [Hz]
        """
        period, bounds = self.cycles / frequency, self.breaks if bounds is None else bounds
        of_meshes = STEPS_PER_CYCLE * max(mesh.cycles for mesh in self.meshes)
        lengths = np.diff(bounds)
        numbers = np.ceil(max(of_meshes, STEPS_PER_PERIOD * self.resolved * period) * lengths)
        return np.column_stack([bounds[:-1], lengths, numbers, lengths / numbers * period])

    def at(self, frequency: float) -> LinearMotion:
        """The linear motion at a mesh frequency [Hz]: gyroscopic terms grow with the speed."""
        speed = frequency / self.mesh_cycles if self.blocks.gyroscopic else self.blocks.speed
        if speed not in self._at:
            self._at.clear()
            self._at[speed] = linear_motion(self.blocks, self.rings, speed)
        return self._at[speed]

    def periods_end(self, states: np.ndarray, frequency: float, periods: int) -> PeriodEnd:
        """The states after a number of common periods, with their slopes.

        Over many cycles motion forgets how it began: directions of the states at the beginning on which the states no
        longer depend are left out on the way.
        """
        motion = self.at(frequency)
        sections = [(section, motion.propagators(section)) for section in sections_of(self.pieces(frequency))]
        moved, columns, directions = motion.inverse @ states, motion.inverse.copy(), np.eye(self.size)
        for number, (section, moves) in enumerate(sections * periods):
            if number > 0:
                columns, directions = not_forgotten(columns, directions)
            self._call(motion, section, moves, moved, columns, NO_SAMPLES)
        return PeriodEnd(motion.matrix @ moved, motion.matrix @ columns @ directions)

    def slope_by_frequency(self, states: np.ndarray, end: np.ndarray, frequency: float, periods: int) -> np.ndarray:
        """(2 n,) slope [m/Hz] of the states after a number of periods, which are end, by the frequency.

        Over a common period of several mesh cycles it is that of longer steps: tangents and Newton's iteration need it
        to some per cent, folds lie where the slopes by the states are singular.
        """
        change, pieces = FREQUENCY_STEP * frequency, self.pieces(frequency)
        if self.cycles > 1:
            numbers = np.ceil(pieces[:, 2] / LONGER_STEPS)
            pieces[:, 3] *= pieces[:, 2] / numbers
            pieces[:, 2] = numbers
            end = self._moved(states, pieces, frequency, periods)
        pieces[:, 3] /= 1 + FREQUENCY_STEP
        return (self._moved(states, pieces, frequency + change, periods) - end) / change

    def settled(self, states: np.ndarray, frequency: float, periods: int) -> np.ndarray:
        """The states after a number of common periods, without slopes."""
        return self._moved(states, self.pieces(frequency), frequency, periods)

    def orbits(self, states: np.ndarray, frequency: float, periods: int) -> list[Orbit]:
        """Samples of every mesh over a number of common periods."""
        pieces, motion = self.pieces(frequency), self.at(frequency)
        numbers = pieces[:, 2].astype(int)
        moved, moves, tables = motion.inverse @ states, motion.propagators(pieces), []
        for _ in range(periods):
            samples = np.empty((len(self.meshes), 3, numbers.sum()))
            self._call(motion, pieces, moves, moved, np.zeros((self.size, 0)), samples)
            tables.append(samples)
        middles = [a + x * (np.arange(n) + 0.5) / n for (a, x), n in zip(pieces[:, :2], numbers, strict=True)]
        weight = np.tile(np.repeat(pieces[:, 1] / numbers, numbers), periods) / periods
        times = (np.arange(periods)[:, None] + np.concatenate(middles)).ravel()
        columns = tables[0] if periods == 1 else np.concatenate(tables, axis=-1)
        return [
            Orbit(weight, x.phase + x.sense * x.cycles * times, *y) for x, y in zip(self.meshes, columns, strict=True)
        ]

    def _moved(self, states: np.ndarray, pieces: np.ndarray, frequency: float, periods: int) -> np.ndarray:
        """The states after a number of common periods of these pieces."""
        motion = self.at(frequency)
        moved, moves, no_columns = motion.inverse @ states, motion.propagators(pieces), np.zeros((self.size, 0))
        for _ in range(periods):
            self._call(motion, pieces, moves, moved, no_columns, NO_SAMPLES)
        return motion.matrix @ moved

    def _call(self, motion: LinearMotion, pieces, moves, states, matrix, samples) -> None:
        try:
            advance(self.addresses, motion.rows, motion.shifts, pieces, moves, states, matrix, samples)
        except ValueError as error:
            raise ValueError(beyond_map(self.meshes[0].law.table.head, error.args)) from None
