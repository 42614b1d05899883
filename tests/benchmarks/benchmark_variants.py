"""Time of 1,000 variants of the flanks of the paper's pair, each a map of 30 phases and 3 torques, on two processes.

    PYTHONPATH=examples python tests/benchmarks/benchmark_variants.py

Tip relief and lead crowning of each variant are random. Finite elements are solved once: flanks are gaps, which
leave the compliances as they are.
"""

import resource
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
from benchmark_states import pair_of_kind

import fem
from fem.units import mm, um

VARIANTS, QUICK, PROCESSES = 1000, 4, 2
PHASES, TORQUES = 30, [50.0, 150.0, 350.0]


def peak_to_peak(number: int) -> float:
    """Peak to peak of the transmission error at the largest torque [m] of the variant with a number."""
    random = np.random.default_rng(number)
    relief = fem.TipRelief(random.uniform(5, 25) * um, random.uniform(1, 3) * mm)
    pair = pair_of_kind(0.0, (relief, fem.LeadCrowning(random.uniform(2, 10) * um)))
    ste = fem.static_transmission_error(pair, TORQUES, PHASES, progress=False)
    return float(np.ptp(ste["te"].sel(torque=TORQUES[-1]).values))


def processor_time() -> float:
    """Processor time of the processes that have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def variants(quick: bool = False) -> dict[str, float]:
    """Wall time and processor time of all variants [s], pools included, and the least peak to peak [um]."""
    number, processes = (QUICK, 1) if quick else (VARIANTS, PROCESSES)
    peak_to_peak(0)  # compiles, and fills the cache with the compliances
    wall, processor = time.perf_counter(), processor_time()
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        values = list(pool.map(peak_to_peak, range(number), chunksize=10))
    seconds = {"wall": time.perf_counter() - wall, "processor": processor_time() - processor}
    print(
        f"{number} variants x {PHASES} phases x {len(TORQUES)} torques:", {k: round(v, 1) for k, v in seconds.items()}
    )
    return {"variants": number, **seconds, "least peak to peak [um]": min(values) / um}


if __name__ == "__main__":
    print(variants())
