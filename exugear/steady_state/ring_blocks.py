"""Elastic rings in a steady state: their modes as blocks beside the linear system, which the planets pass.

A mode displaces the flank of the ring by g(phase) per amplitude a, g running around the ring with the mesh. Its row on
the amplitudes changes over the common period, so that ring and meshes are coupled by the impulses of the meshes alone:
modes move freely between these, each an oscillating block of two states, which count from the ring without load. The
common period is then a turn of the planets around the ring.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from exugear.gearbox.elastic_ring import ElasticRing
from exugear.mesh_force.kernel_records import record_of, record_type, start_of_field
from exugear.mesh_force.pchip import hermite, hermite_slope
from exugear.multibody.elastic_rings import RingInMesh
from exugear.steady_state.ring_kernels import STEADY_RING
from fem.support.validation import require


@dataclass(frozen=True, eq=False)
class RingBlocks:
    """The modes of all elastic rings of a gearbox, m blocks.

    damping_rate, frequency   (m,) real part, < 0 [1/s], and imaginary part [rad/s] of the eigenvalues
    masses                    (m,) of scaled amplitudes [kg]: the displacements of the flank where it moves most
    stiffness                 (m,) likewise [N/m]
    indices                   (m,) of the amplitudes among the coordinates of the gearbox
    scale                     (m,) scaled amplitudes over amplitudes
    """

    damping_rate: np.ndarray
    frequency: np.ndarray
    masses: np.ndarray
    stiffness: np.ndarray
    indices: np.ndarray
    scale: np.ndarray

    @property
    def number(self) -> int:
        """Number of modes."""
        return self.frequency.size

    @cached_property
    def by_impulses(self) -> np.ndarray:
        """(m,) changes of the second state of each block per impulse on its scaled amplitude [m/(N s)]."""
        return -1 / (self.masses * self.frequency)

    def coordinates(self, size: int) -> np.ndarray:
        """(size, 2 m) coordinates of the gearbox = matrix . states."""
        matrix = np.zeros((size, 2 * self.number))
        matrix[self.indices, 2 * np.arange(self.number)] = 1 / self.scale
        return matrix


def ring_blocks(rings: Iterable[tuple[ElasticRing, np.ndarray]]) -> RingBlocks:
    """Blocks of the modes of rings with the indices (m,) of their amplitudes.

    Raises ValueError for modes that do not oscillate.
    """
    parts = [_blocks_of(elastic, indices) for elastic, indices in rings]
    none = (*[np.zeros(0)] * 4, np.zeros(0, int), np.zeros(0))
    damping_rate, frequency, masses, stiffness, indices, scale = map(np.concatenate, zip(none, *parts, strict=True))
    return RingBlocks(damping_rate, frequency, masses, stiffness, indices, scale)


def _blocks_of(elastic: ElasticRing, indices: np.ndarray) -> tuple[np.ndarray, ...]:
    """Columns of `RingBlocks` of a ring."""
    ratio = elastic.damping_ratio
    slow = f"ring_damping_ratio of {elastic.name!r} must lie below 1, so that its modes oscillate, got {ratio:g}"
    require(ratio < 1, f"{slow}; take a smaller one, or exugear.run_up over a slow ramp")
    omega = np.sqrt(elastic.stiffness / elastic.masses)
    scale = np.max([np.abs(flank.values).max(axis=0) for flank in elastic.flanks], axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    masses, stiffness = elastic.masses / scale**2, elastic.stiffness / scale**2
    return -ratio * omega, omega * np.sqrt(1 - ratio**2), masses, stiffness, indices, scale


class PassedRing(NamedTuple):
    """The ring of a mesh by its record: the head, `STEADY_RING`, and the arrays behind it."""

    record: np.record

    @property
    def head(self) -> np.record:
        """`STEADY_RING`."""
        return self.record.head

    @property
    def table(self) -> np.ndarray:
        """(2, points, m, 2) scaled shapes of driving and coast flank with their slopes per spacing."""
        return self.record["table"]

    def shape_at(self, side: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """(m,) shapes of the modes of a flank at the phase of the driving flank, and their slopes per pitch."""
        table, at = self.table[0 if side > 0 else 1], self.head.start + self.head.pitch * phase
        i = int(np.floor(at)) % len(table)
        before, after = table[i], table[(i + 1) % len(table)]
        cubic = at % 1.0, before[:, 0], before[:, 1], after[:, 0], after[:, 1]
        return hermite.py_func(*cubic), self.head.pitch * hermite_slope.py_func(*cubic)


def passed_ring(ring: RingInMesh, blocks: RingBlocks, indices: np.ndarray, first: int) -> PassedRing:
    """The ring that a mesh passes.

    indices   (m,) of its amplitudes among the coordinates of the gearbox
    first     number of blocks of the linear system, behind which those of the rings stand
    """
    of_ring = np.flatnonzero(np.isin(blocks.indices, indices))
    flanks = np.array([np.stack([flank.values, flank.slopes], axis=-1) for flank in ring.flanks])
    m = of_ring.size
    arrays = {
        "table": flanks / blocks.scale[of_ring][:, None],
        "damping_rate": blocks.damping_rate[of_ring],
        "frequency": blocks.frequency[of_ring],
        "by_impulses": blocks.by_impulses[of_ring],
        "along": np.zeros((2, m)),
    }
    kind = record_type(("head", STEADY_RING), *((name, "f8", array.shape) for name, array in arrays.items()))
    starts = {f"{name}_start": start_of_field(kind, name) for name in arrays}
    sizes = {"modes": m, "points": flanks.shape[1], "first": 2 * (first + int(of_ring[0]))}
    at = {"start": float(ring.record.start), "pitch": float(ring.record.pitch)}
    return PassedRing(record_of(kind, head=record_of(STEADY_RING, **sizes, **starts, **at), **arrays))


def largest_mobilities(rings: Sequence[PassedRing | None], blocks: RingBlocks, first: int) -> np.ndarray:
    """(n_mesh, m) largest mobility of each mode in each mesh, around the ring [1/kg]."""
    mobilities = np.zeros((len(rings), blocks.number))
    for row, ring in zip(mobilities, rings, strict=True):
        if ring is not None:
            begin = int(ring.head.first) // 2 - first
            part = slice(begin, begin + int(ring.head.modes))
            row[part] = np.abs(ring.table[..., 0]).max(axis=(0, 1)) ** 2 / blocks.masses[part]
    return mobilities
