"""Time of a contact state by kind of gear and by mode, beside that of the code before contacts were compiled.

    PYTHONPATH=examples python tests/benchmarks/benchmark_states.py

A state is one phase under one torque. Its time is the processor time of a whole call with the compliances in the cache,
divided by the number of states.
"""

import time
from statistics import median

import numpy as np
from korta_pair import paper_pair

import fem
from fem.units import deg, mm, um

PHASES, CALLS = 30, 5
SEVERAL, SINGLE = np.linspace(50, 400, 12), [350.0]
#: Torques [N m] and resolution by mode.
MODES = {
    "resolved, 12 torques": (SEVERAL, fem.Resolution()),
    "resolved, 1 torque": (SINGLE, fem.Resolution()),
    "slices, 12 torques": (SEVERAL, fem.Slices()),
}
RELIEF, CROWNING = fem.TipRelief(15 * um, 2.5 * mm), fem.LeadCrowning(10 * um)
#: Helix angle and modifications of each flank by kind of gear.
KINDS = {
    "spur": (0.0, ()),
    "spur, relief": (0.0, (RELIEF,)),
    "spur, crowning": (0.0, (CROWNING,)),
    "helix 15°": (15 * deg, ()),
    "helix 15°, both": (15 * deg, (RELIEF, CROWNING)),
}
#: Times [ms] of each kind by mode before contacts were compiled, measured in alternation with those of MEASURED.md.
OLD = {
    "spur": (1.87, 3.65, 0.23),
    "spur, relief": (2.28, 4.95, 0.31),
    "spur, crowning": (3.72, 6.74, 0.40),
    "helix 15°": (5.28, 9.91, 0.74),
    "helix 15°, both": (5.62, 14.12, 0.99),
}


def pair_of_kind(beta: float, flank: tuple) -> fem.GearPair:
    """The paper's pair, or its transverse section with a helix, with modified flanks."""
    inclined, sizes = np.cos(beta), {"z": 57, "b": 23 * mm, "d_a": 154.5 * mm, "d_f": 141.7 * mm, "d_bore": 60 * mm}
    sizes |= {"m_n": 2.6 * mm * inclined, "s_n": 3.78 * mm * inclined, "rho_f": 0.38 * 2.6 * mm * inclined}
    sizes |= {"alpha_n": float(np.arctan(np.tan(20 * deg) * inclined)), "flank": flank}
    return fem.GearPair(fem.Gear(beta=beta, **sizes), fem.Gear(beta=-beta, **sizes), a=paper_pair().a)


def state_time(
    pair: fem.GearPair, torque, resolution: fem.Resolution | fem.Slices, calls: int = CALLS, phases: int = PHASES
) -> float:
    """Median time of a state [ms]; a first call compiles and fills the cache."""
    times = []
    for _ in range(calls + 1):
        start = time.process_time()
        ste = fem.static_transmission_error(pair, torque, phases, resolution=resolution, progress=False)
        times.append((time.process_time() - start) / ste["te"].size * 1e3)
    return median(times[1:])


def states(quick: bool = False) -> dict[str, dict[str, tuple[float, float]]]:
    """Time of a state [ms] by kind of gear and mode, and that of the old code."""
    rows: dict[str, dict[str, tuple[float, float]]] = {}
    for kind, (beta, flank) in KINDS.items():
        pair, number = pair_of_kind(beta, flank), (1, 4) if quick else (CALLS, PHASES)
        times = [state_time(pair, *mode, *number) for mode in MODES.values()]
        rows[kind] = dict(zip(MODES, zip(times, OLD[kind], strict=True), strict=True))
        print(f"{kind:16}", *(f"{mode} {new:.2f} ms, before {old}; " for mode, (new, old) in rows[kind].items()))
    return rows


if __name__ == "__main__":
    states()
