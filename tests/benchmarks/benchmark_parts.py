"""Time of one run-up in parts on 1 to 64 processes: measured on 1 and 2, beyond them by a model checked against those.

    PYTHONPATH=examples python tests/benchmarks/benchmark_parts.py

The model schedules the parts as `exugear.run_up` does: in order, each as soon as a process is free, early from static
equilibrium as long as an earlier part is integrated. All times are of the processor, which other load hardly changes.
"""

import heapq
import os
import pickle
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from statistics import median

import exudyn as exu
import numpy as np
from benchmark_points import timed
from benchmark_run_up import LONG, TORQUE, on_bearings, paper_gearbox
from korta_pair import TOP_SPEED

import exugear
from exugear.multibody.solver_settings import scheme_of
from exugear.multibody.time_integration import Solver
from exugear.operation.conditions import run_up_conditions
from exugear.running.joined_parts import division_of

PROCESSES, PAIRS = (1, 2, 4, 8, 16, 32, 64), 2
#: Number of segments that are integrated again at half the step, side by side.
CHECKS = 3


class Inline(Executor):
    """Integrates parts where they are submitted, as one of some processes; keeps processor time and steps of each."""

    def __init__(self, processes: int):
        self._max_workers, self.seconds = processes, []

    def submit(self, function, /, *arguments) -> Future:
        content, seconds = timed(lambda: pickle.dumps(function(*arguments)))
        bounds = getattr(arguments[1], "bounds", (0, 0))
        self.seconds.append((seconds, bounds[-1] - bounds[0]))
        future: Future = Future()
        future.set_result(pickle.loads(content))
        return future


@dataclass(frozen=True)
class Costs:
    """Seconds of a step, of all segments that are integrated again, and of the calling process."""

    step: float
    checks: float
    caller: float


def seconds_of(model: exugear.Model, duration: float, executor: Executor | None = None) -> float:
    """Processor time of the whole run-up in this process."""
    conditions = {"speed": (0, TOP_SPEED), "duration": duration, "load": TORQUE, "progress": False}
    return timed(lambda: exugear.run_up(model, **conditions, executor=executor, checks=CHECKS))[1]


def costs_of(model: exugear.Model, duration: float) -> Costs:
    """Costs of the run-up in parts that a single process integrates."""
    executor = Inline(8)
    total, (seconds, steps) = seconds_of(model, duration, executor), np.array(executor.seconds).T
    parts, checks = seconds[steps > 0].sum(), seconds[steps == 0].sum()
    return Costs(parts / steps.sum(), checks, total - parts - checks)


def modelled(model: exugear.Model, duration: float, costs: Costs, processes: int) -> float:
    """Time of the run-up where no part is integrated again [s]."""
    conditions = run_up_conditions(model.gearbox, (0, TOP_SPEED), TORQUE, duration)
    scheme = scheme_of(model, conditions, tolerance=1e-3, step=None, sample=4e-5, sensor_period=None)
    parts = division_of(Solver(model, conditions, scheme), Inline(processes))
    free, last = [0.0] * processes, 0.0
    for i in range(parts.number):
        start = heapq.heappop(free)
        first = max(parts.ends[i] - parts.early * (start < last), 0)
        steps = parts.bounds[parts.ends[i + 1]] - parts.bounds[first]
        heapq.heappush(free, start + steps * costs.step)
        last = max(last, *free)
    return last + costs.checks / min(processes, CHECKS) + costs.caller


def measured(model: exugear.Model, duration: float, pairs: int) -> list[float]:
    """Times on one process, and on two of the caller and the busier one [s]: medians of alternated runs."""
    times = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        seconds_of(model, duration, pool)
        for _ in range(pairs):
            single, before = seconds_of(model, duration), busy(pool)
            times.append((single, seconds_of(model, duration, pool) + float((busy(pool) - before).max())))
    return [median(column) for column in zip(*times, strict=True)]


def busy(pool: ProcessPoolExecutor) -> np.ndarray:
    """(n_process,) processor time of each process of a pool, as Linux shows it [s]."""
    ticks = [Path(f"/proc/{number}/stat").read_text().split()[13:15] for number in pool._processes]
    return np.array(ticks, float).sum(axis=1) / os.sysconf("SC_CLK_TCK")


def parts(box: exugear.Gearbox, quick: bool = False) -> dict[str, dict[str, list[float]]]:
    """Rows of the benchmark by scene: number of processes, times by the model and measured [s]."""
    rows, scenes = {}, {"spinning": box} | ({} if quick else {"planar": on_bearings(box)})
    for name, scene in scenes.items():
        model, (duration, pairs) = exugear.build(scene), (7.0, 1) if quick else (LONG, PAIRS)
        seconds_of(model, duration)  # compiles the contact
        costs, times = costs_of(model, duration), measured(model, duration, pairs)
        model_times = [modelled(model, duration, costs, n) for n in PROCESSES]
        print(f"{name}: {costs}\n model: {np.round(model_times, 2)}, measured: {np.round(times, 2)}")
        rows[name] = {"processes": list(PROCESSES), "model": model_times, "measured": times}
    return rows


if __name__ == "__main__":
    exu.config.printToConsole = False
    parts(paper_gearbox())
