"""Cost of runs whose teeth differ, over that of the same runs on a map of teeth that are alike.

    PYTHONPATH=examples python tests/benchmarks/benchmark_unlike_teeth.py

Spur pair 23/47 with run-out and random pitch deviations of both gears: its law over 1,081 pitches is composed of single
tooth pairs. Runs on either law alternate, and each ratio is that of two runs beside each other, which scatters by a
tenth.
"""

from dataclasses import replace
from statistics import median

import numpy as np
from benchmark_points import timed
from benchmark_run_up import bearings

import exugear
import fem
from exugear import MeshForce
from fem.units import mm, rpm, um

TORQUE, LOAD, SPEED, STEP, DAMPING, ROUNDS = 300.0, 200.0, 600 * rpm, 2e-5, 2e3, 15


def alike() -> fem.GearPair:
    """The pair without deviations."""
    return fem.GearPair(*(fem.Gear(z=z, m_n=3 * mm, b=20 * mm, d_bore=25 * mm) for z in (23, 47)))


def deviating(gear: fem.Gear, seed: int) -> fem.Gear:
    """The gear with a run-out of 10 um and random pitch deviations within 6 um."""
    random = np.random.default_rng(seed).uniform(-6 * um, 6 * um, gear.z)
    return replace(gear, flank=fem.PitchDeviation(random + 10 * um * np.cos(2 * np.pi * np.arange(gear.z) / gear.z)))


def laws(quick: bool = False) -> dict[str, MeshForce]:
    """The law of the map, and that of unlike teeth; quick: in slices, at few phases."""
    pair = alike()
    unlike = fem.GearPair(deviating(pair.pinion, 1), deviating(pair.wheel, 2), a=pair.a)
    torques = TORQUE * np.array([0, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0])
    of_map = {"resolution": fem.Slices() if quick else fem.Resolution(), "progress": False}
    ste = fem.static_transmission_error(pair, torques, 12 if quick else 32, **of_map)
    options = {"damping": DAMPING, "backlash": 0.1 * mm}
    composed = MeshForce.from_tooth_pairs(fem.tooth_pair_map(unlike, TORQUE, checks=0, **of_map), **options)
    return {"alike": MeshForce.from_ste(ste, **options), "unlike": composed}


def model_of(law: MeshForce, parts: dict) -> exugear.Model:
    """Both gears on shafts that only spin, or on bearings."""
    pair = alike()
    gears = ("pinion", pair.pinion), ("wheel", pair.wheel)
    shafts = [exugear.Shaft(name, {0.0: gear} | parts) for name, gear in gears]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)]))


def unlike_teeth(quick: bool = False) -> dict[str, float]:
    """Processor time of a run whose teeth differ over that of alike teeth, by scene: the median of ratios."""
    duration, rounds, by_law = (0.1, 1, laws(quick)) if quick else (20.0, ROUNDS, laws())
    conditions = {"drives": {"pinion": SPEED}, "loads": {"wheel": LOAD}, "step": STEP, "checks": 0, "progress": False}
    ratios = {}
    for scene, parts in {"spinning": {}, "on bearings": bearings()}.items():
        models = {name: model_of(law, parts) for name, law in by_law.items()}
        for model in models.values():
            exugear.run(model, duration=0.01, **conditions)  # compiles
        rows = [
            {name: timed(lambda x=x: exugear.run(x, duration=duration, **conditions))[1] for name, x in models.items()}
            for _ in range(rounds)
        ]
        ratios[scene] = median(row["unlike"] / row["alike"] for row in rows)
        times = {name: round(median(row[name] for row in rows), 2) for name in by_law}
        print(f"{scene}: {duration:g} s take {times} s; ratio {ratios[scene]:.2f}", flush=True)
    return ratios


if __name__ == "__main__":
    unlike_teeth()
