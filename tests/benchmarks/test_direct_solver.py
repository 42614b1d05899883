"""Time and memory of one gear's factorization: pytest tests/benchmarks/test_direct_solver.py -m measured -n 0 -s.

The solid is that of `flank_compliance`, with the whole section meshed. Each solver runs in a process of its own, on one
thread; the time is that of the processor, and a solver that needs the assembled matrix assembles it.
CHOLMOD is compared where scikit-sparse is installed, which needs the headers of SuiteSparse.
"""

import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from helical_gears import helical
from paper_gears import paper_gear
from threadpoolctl import threadpool_limits
from whole_section import linear_system, solid_prism

import fem
from fem import Density
from fem.linalg import direct_solver, multifrontal

pytestmark = [
    pytest.mark.measured,
    pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="reads memory as Linux shows it"),
]
GEARS = {"spur": paper_gear, "helical": lambda: helical(1)}
ROUNDS = 2
System = tuple[Any, np.ndarray, np.ndarray]


def system_of(gear: fem.Gear) -> System:
    """Matrix, numbers of the unknowns that are loaded or read, and right-hand sides of the solid of a whole section."""
    density = Density().with_teeth(2, behind=1)
    prism = solid_prism(gear, density, "any" if gear.beta else "equal")
    matrix, forces = linear_system(prism, density.paired(), hats=density.flank // 2)
    return matrix, np.unique(sp.hstack(forces).tocoo().row), forces[0].toarray()


def by_multifrontal(matrix, accessed: np.ndarray) -> Callable:
    return multifrontal.factorize(matrix, accessed)


def by_superlu(matrix, accessed: np.ndarray) -> Callable:
    return direct_solver.superlu(matrix.matrix)


def by_cholmod(matrix, accessed: np.ndarray) -> Callable:
    from sksparse.cholmod import cholesky

    return cholesky(sp.csc_matrix(matrix.matrix), mode="supernodal")


def resident_memory(kind: str) -> float:
    """Memory of this process [MB], now (VmRSS) or at its peak (VmHWM)."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(kind))
    return int(line.split()[1]) / 1024


def measured(solver: Callable, system: System) -> tuple[float, float, np.ndarray]:
    """Processor time [s] and peak memory [MB] of factorization and solution, and the solution where it is read."""
    matrix, accessed, b = system
    before = resident_memory("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    with threadpool_limits(1):
        start = time.process_time()
        x = solver(matrix, accessed)(b)
        spent = time.process_time() - start
    return spent, resident_memory("VmHWM") - before, x[accessed]


def in_a_process_of_its_own(solver: Callable, system: System) -> tuple[float, float, np.ndarray]:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        return executor.submit(measured, solver, system).result()


@pytest.mark.parametrize("kind", GEARS)
def test_multifrontal_takes_the_least_time_and_memory(kind):
    solvers = [by_multifrontal, by_superlu, *([by_cholmod] if find_spec("sksparse") else [])]
    system = system_of(GEARS[kind]())
    rounds = [[in_a_process_of_its_own(solver, system) for solver in solvers] for _ in range(ROUNDS)]
    expected = rounds[0][0][2]
    best = {}
    for solver, runs in zip(solvers, zip(*rounds, strict=True), strict=True):
        time_spent, memory = (min(run[i] for run in runs) for i in (0, 1))
        best[solver] = time_spent, memory
        print(f"{kind:8} {solver.__name__:16} {time_spent:6.2f} s {memory:6.0f} MB")
        for *_, x in runs:
            assert x == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max())
    assert best[by_multifrontal] == tuple(min(values) for values in zip(*best.values(), strict=True))
