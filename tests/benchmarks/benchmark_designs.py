"""Cost of many designs: 1,000 tolerance cases, and the tip relief of the paper's pair that is best at 350 N m.

    PYTHONPATH=examples python tests/benchmarks/benchmark_designs.py

Both on two processes. Beside the processor time of a design stands that of the map of the unmodified pair with as many
states, in alternation; beside the optimum the best of a grid of 20 x 20 designs.
"""

import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from statistics import median

import numpy as np
import tip_relief
from benchmark_points import timed
from benchmark_variants import processor_time
from class_6_gears import TOLERANCES, TORQUES, measures
from korta_pair import paper_pair

import exugear
import fem
from fem.units import um

CASES, QUICK, CHECKED, PROCESSES = 1000, 6, 5, 2


def on_processes(call: Callable, number: int = PROCESSES):
    """(result of a call with an executor of some processes, wall time, processor time of the processes) [s]."""
    wall, processor = time.perf_counter(), processor_time()
    with ProcessPoolExecutor(number, mp_context=get_context("spawn")) as pool:
        result = call(pool)
    return result, time.perf_counter() - wall, processor_time() - processor


def tolerances(quick: bool = False) -> dict[str, float]:
    """Times of tolerance cases of 30 phases and 3 torques, their ratio to unmodified pairs, error of the sweep."""
    number, processes, seed = (QUICK, 1, 6) if quick else (CASES, PROCESSES, 6)
    drawn = exugear.monte_carlo(lambda **_: 0.0, TOLERANCES, number=CHECKED, seed=seed, progress=False)
    cases = [{name: float(drawn[name][case]) for name in TOLERANCES} for case in range(CHECKED)]
    options = {"resolution": fem.Slices(), "progress": False}
    single = [measures(**case)["peak_to_peak"].values for case in cases]  # fills the cache, too
    ratios = [
        timed(lambda case=case: measures(**case))[1]
        / timed(lambda: fem.flank_measures(paper_pair(), TORQUES, ("peak_to_peak", "hertz_pressure"), **options))[1]
        for case in cases
    ]
    swept, wall, processor = on_processes(
        lambda pool: exugear.monte_carlo(measures, TOLERANCES, number=number, seed=seed, executor=pool, progress=False),
        processes,
    )
    error = float(np.abs(swept["peak_to_peak"].values[:CHECKED] / np.array(single) - 1).max())
    row = {"cases": number, "wall": wall, "processor": processor, "over unmodified": median(ratios), "error": error}
    print("tolerances:", {name: float(f"{value:.3g}") for name, value in row.items()}, flush=True)
    return row


def relief(quick: bool = False) -> dict[str, float]:
    """Times of the search, and peak to peak [um] of its optimum, unmodified, and of the best design of a grid."""
    goal, variables = tip_relief.GOALS["best at 350 N m"], tip_relief.VARIABLES
    given = {"method": "Nelder-Mead", "starts": 1, "resolution": fem.Slices(), "phases": 8} if quick else {}
    processes, points = (1, 3) if quick else (PROCESSES, 20)
    best, wall, processor = on_processes(
        lambda pool: exugear.optimize_flanks(
            tip_relief.relieved, variables, goal, executor=pool, progress=False, **given
        ),
        processes,
    )
    grid, grid_wall, _ = on_processes(lambda pool: best.landscape(points=points, executor=pool), processes)
    row = {"designs": best.evaluated.sizes["case"], "wall": wall, "processor": processor, "wall of the grid": grid_wall}
    row |= {"peak to peak": best.goals[goal.label] / um, "unmodified": best.unmodified[goal.label] / um}
    row |= {"of the grid": float(grid.min())}
    print("tip relief:", {name: float(f"{value:.4g}") for name, value in row.items()}, flush=True)
    return row


def designs(quick: bool = False) -> dict[str, dict[str, float]]:
    """`tolerances` and `relief`."""
    return {"tolerances": tolerances(quick), "tip relief": relief(quick)}


if __name__ == "__main__":
    designs()
