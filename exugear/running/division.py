"""Division of a run into parts: their number follows from the processes, their early starts from the decay."""

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from math import ceil, inf
from typing import Any

import numpy as np

from exugear.multibody.time_integration import RunState, Solver
from exugear.planning.vibration_decay import SEAM_TOLERANCE, settling_time
from exugear.running.segments import Part

#: Most parts for each process: where a part is repeated, the other processes have further ones to integrate.
PARTS_PER_PROCESS = 4
#: Length of a part over that of its early start: wanted, and at least.
WANTED_LENGTH, LEAST_LENGTH = 16, 2


@dataclass(frozen=True)
class Division:
    """How a run is divided into parts.

    bounds       steps at which the segments of the run end
    ends         indices of the bounds at which the parts begin and end
    early        number of segments by which a part starts early
    processes    number of processes
    """

    bounds: Sequence[int]
    ends: Sequence[int]
    early: int
    processes: int

    @property
    def number(self) -> int:
        """Number of parts."""
        return len(self.ends) - 1

    def part(self, i: int, state: RunState | None = None, expected: Any = None) -> Part:
        """The part with a number: from the state that arrives, or early from static equilibrium."""
        begin = self.ends[i] if state else max(self.ends[i] - self.early, 0)
        return Part(self.bounds[begin : self.ends[i + 1] + 1], self.bounds[self.ends[i]], state, expected or {})


def division_of(solver: Solver, executor: Executor) -> Division:
    """The parts of a run: a single one where vibrations do not decay, for a single process and for a short run.

    A part starts one segment earlier than vibrations need to settle: in that segment Newton's iteration, whose matrix
    is that at the beginning of the segment, becomes the same.
    """
    bounds, processes, decay = solver.bounds, number_of_processes(executor), solver.model.plan.decay
    segments = len(bounds) - 1
    settling = settling_time(decay, SEAM_TOLERANCE) / solver.conditions.duration if decay > 0 else inf
    early = ceil(min(settling, 1.0) * segments) + 1
    wanted = processes * min(max(segments // (processes * WANTED_LENGTH * early), 1), PARTS_PER_PROCESS)
    parts = max(1, min(wanted, segments // (LEAST_LENGTH * early))) if processes > 1 else 1
    return Division(bounds, np.linspace(0, segments, parts + 1).astype(int).tolist(), early, processes)


def number_of_processes(executor: Executor) -> int:
    """Number of processes of an executor: of a process pool, of Dask or of MPI; else that of the processors."""
    client = getattr(executor, "_client", None)
    if client is not None:
        return len(client.ncores())
    number = getattr(executor, "_max_workers", None) or getattr(executor, "num_workers", None)
    return int(number or os.cpu_count() or 1)
