"""The gear pair of Korta et al. (Table I), its gearbox, and its resonances beside Table II: what the examples share.

Korta, Palermo, Mundo, Shweiki: Combining Finite Element and Multibody Modeling Techniques for Time-Efficient
Simulation of Nonlinear Gear Dynamics. The paper gives no bore, inertia or damping; they are chosen here.
"""

from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial

import numpy as np

import exugear
import fem
from exugear import spectrum
from fem.units import deg, mm, rpm

TORQUES = (150.0, 350.0)
MAP_TORQUES = (0, 1, 5, 20, 50, 100, 150, 250, 350, 500, 750, 1000, 1500)
MAP_PHASES = 60
TOP_SPEED, DURATION = 3500 * rpm, 70.0
#: Of the mesh (`exugear.Stage`), chosen: all four peaks of Table II show at both loads, and teeth part as in the paper.
DAMPING_RATIO = 0.1
#: Finer than the default, at which the steps fold the 12th to 14th harmonic of the mesh onto the main resonance.
TOLERANCE = 1e-4
#: Resonances [Hz] by load [N m]. The first is no simple fraction of the main one and is left out.
TABLE_II = {150.0: (116, 438, 597, 907, 1804), 350.0: (122, 479, 650, 980, 1958)}


def paper_pair(d_bore: float = 60 * mm) -> fem.GearPair:
    """Table I; the contact ratio 1.45 fixes the centre distance."""
    sizes = {"m_n": 2.6 * mm, "b": 23 * mm, "d_a": 154.5 * mm, "d_f": 141.7 * mm, "s_n": 3.78 * mm, "d_bore": d_bore}
    gear = fem.Gear(z=57, alpha_n=20 * deg, **sizes)
    return fem.GearPair(gear, gear, a=150 * mm)


def mean_stiffness(ste, torque: float) -> float:
    """Mean of the secant stiffness F / STE over the mesh cycle [N/m]."""
    force = torque / fem.pair_of(ste).pinion.r_b
    return float((force / ste["te"].sel(torque=torque)).mean())


def gearbox(
    ste, damping_ratio: float = DAMPING_RATIO, *, inertia: float | None = None, law_of=exugear.MeshForce.from_ste
):
    """Two shafts that only spin, each with a gear of Table I; law_of(ste, damping=...) makes the force law.

    All laws have the damping [N s/m] that the damping ratio gives with the law of the map.
    """
    pair = fem.pair_of(ste)
    shafts = [exugear.Shaft(name, {0.0: pair.pinion}, inertia=inertia) for name in ("driving", "driven")]
    damping = exugear.Stage(*shafts, ste, damping_ratio=damping_ratio).force.damping
    return exugear.Gearbox([exugear.Stage(*shafts, law_of(ste, damping=damping), pair=pair)])


def plan_of(box: exugear.Gearbox) -> str:
    """The plan of the gearbox, and the cost of a run-up."""
    model = exugear.build(box)
    step = model.plan.step(TOLERANCE, float(model.mesh_cycles.max()) * TOP_SPEED)
    return f"{model.plan}\nrun-up, tolerance {TOLERANCE:g}: {model.plan.cost(DURATION, step)}"


def run(box: exugear.Gearbox, load: float, duration: float = DURATION, executor: Executor | None = None) -> exugear.Run:
    """Linear run-up: the driving gear's speed is imposed, the load torque acts on the driven gear."""
    conditions = {"speed": (0, TOP_SPEED), "duration": duration, "load": load, "tolerance": TOLERANCE}
    return exugear.run_up(exugear.build(box), **conditions, executor=executor)


def run_ups(box: exugear.Gearbox, duration: float = DURATION) -> dict[float, exugear.Run]:
    """All torques side by side, each in a process of its own."""
    with ProcessPoolExecutor(len(TORQUES)) as pool:
        return dict(zip(TORQUES, pool.map(partial(run, box, duration=duration), TORQUES), strict=True))


def envelope_peaks(result: exugear.Run) -> spectrum.Peaks:
    """Peaks of the envelope of the DTE over mesh frequency, those of superharmonics too."""
    return exugear.dte_envelope(result).peaks(prominence=0.004)


def resonance_table(runs: dict[str, dict[float, exugear.Run]]) -> str:
    """Resonances of runs by name and load beside Table II, and by how much the main one rises with the load."""
    lines = ["DTE resonances [Hz]             1/4      1/3      1/2     main   rise of the main one"]
    tables = {
        name: {load: spectrum.superharmonics(envelope_peaks(result)) for load, result in by_load.items()}
        for name, by_load in runs.items()
    }
    tables["paper, Table II"] = {load: np.array(peaks[1:]) for load, peaks in TABLE_II.items()}
    for name, by_load in tables.items():
        rise = 100 * (by_load[350.0][-1] / by_load[150.0][-1] - 1)
        for load, peaks in by_load.items():
            row = "".join(f"{peak:9.0f}" for peak in peaks).replace("nan", "  -")
            lines.append(f"{name:18s}{load:4.0f} N m{row}" + (f"{rise:12.2f} %" if load == 350.0 else ""))
    return "\n".join(lines)
