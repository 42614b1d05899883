"""Run time against error of run-ups: by step, integrator and reduction of the bodies.

    PYTHONPATH=examples python tests/benchmarks/benchmark_run_up.py

Errors are against a run of much finer steps. That of the rms of the DTE falls with the fourth power of the step. Planar
and 3D bodies agree to the last digit. The trapezoidal rule and generalized-alpha are 150 to 400 times less accurate at
the same step.
"""

import numpy as np
from benchmark_points import Points, timed
from korta_pair import MAP_PHASES, MAP_TORQUES, TOP_SPEED, gearbox, paper_pair

import exugear
import fem
from fem.units import mm

TORQUE, LONG = 150.0, 70.0
#: A whole multiple of all steps, so that all windows hold the same times [s].
SAMPLE = 6e-5


def paper_gearbox() -> exugear.Gearbox:
    """The gearbox of the main job."""
    return gearbox(fem.static_transmission_error(paper_pair(), MAP_TORQUES, MAP_PHASES, progress=False))


def outline(run: exugear.Run) -> tuple[np.ndarray, exugear.spectrum.Peaks]:
    """rms of the DTE about its mean in windows of time; resonances of its envelope over the mesh frequency."""
    time, dte = run.data["time"].values, run.data["dte"].values[-1]
    wide, narrow = (np.split(dte, np.searchsorted(time, np.linspace(0, time[-1], n + 1)[1:-1])) for n in (56, 281))
    frequency = np.interp((np.arange(281) + 0.5) / 281 * time[-1], time, run.data["mesh_frequency"].values[-1])
    return np.array([x.std() for x in wide]), exugear.peaks(frequency, [np.ptp(x) / 2 for x in narrow])


def errors(run: exugear.Run, finest: tuple[np.ndarray, exugear.spectrum.Peaks]) -> dict[str, float]:
    """Median of the windows, 95th percentile, largest of the resonances' frequencies and heights [%]."""
    (rms, peaks), (true_rms, true) = outline(run), finest
    off = np.abs(rms / true_rms - 1)
    nearest = np.abs(peaks.abscissa[:, None] - true.abscissa).argmin(axis=0)
    frequencies, heights = (np.abs(a[nearest] / b - 1).max() for a, b in zip(peaks, true, strict=True))
    named = {"at_95": np.percentile(off, 95), "of_resonances": frequencies, "of_peaks": heights}
    return {"error": 100 * float(np.median(off))} | {name: 100 * float(value) for name, value in named.items()}


def bearings() -> dict:
    """Two bearings beside a gear."""
    return {-30 * mm: exugear.Bearing(5e8, 1e8, damping_time=2e-6), 30 * mm: exugear.Bearing(5e8, damping_time=2e-6)}


def on_bearings(box: exugear.Gearbox) -> exugear.Gearbox:
    """The same pair on two bearings each."""
    stage = box.stages[0]
    shafts = [exugear.Shaft(s.name, {0.0: stage.pair.pinion} | bearings()) for s in (stage.fast, stage.slow)]
    return exugear.Gearbox([exugear.Stage(*shafts, stage.force, pair=stage.pair)])


def run_up_points(box: exugear.Gearbox, quick: bool) -> Points:
    """Run-ups through all resonances: median error of windows, time of 70 s."""
    duration, points = (0.7 if quick else 14.0), Points()
    elastic = on_bearings(box)
    scenes = {
        "spinning": (box, exugear.plan(box)),
        "planar on bearings": (elastic, exugear.plan(elastic)),
        "in space on bearings": (elastic, exugear.plan(elastic).with_bodies()),
        "in space on joints": (box, exugear.plan(box).with_joints()),
    }

    def integrated(scene, step, **options):
        model = exugear.build(scene[0], plan=scene[1])
        conditions = {
            "speed": (0, TOP_SPEED),
            "duration": duration,
            "load": TORQUE,
            "sample": SAMPLE,
            "checks": 0,
            "progress": False,
        }
        return exugear.run_up(model, **(conditions | {"step": step} | options))

    def add(label, variant, name, step, **options):
        run, seconds = timed(lambda: integrated(scenes[name], step, **options))
        points.add(label, variant, seconds=seconds * LONG / duration, **errors(run, finest[name]))

    finest = {
        name: outline(integrated(scene, 5e-6, tolerance=1e-5)) for name, scene in scenes.items() if "joints" not in name
    }
    finest["in space on joints"] = finest["spinning"]
    steps = (2e-5,) if quick else (6e-5, 3e-5, 2e-5, 1.5e-5, 1e-5)
    cases = [(name, name, lambda h: h) for name in scenes]
    cases += [
        ("spinning", "trapezoidal rule", lambda h: exugear.Rule.trapezoidal(h)),
        ("spinning", "generalized-alpha 0.9", lambda h: exugear.Rule(1 / 12, h, 0.9)),
    ]
    for name, label, rule in cases:
        for h in steps if quick or label == "spinning" else steps[1:4]:
            add(label, f"{h / 1e-6:g} us", name, rule(h))
    for tolerance in (1e-2, 1e-3) if quick else (1e-2, 1e-3, 1e-4):
        add("spinning, tolerance chosen", f"{tolerance:g}", "spinning", None, tolerance=tolerance)
    for tolerance in () if quick else (1e-2, 1e-3, 1e-5):
        add("20 us, Newton's tolerance", f"{tolerance:g}", "spinning", 2e-5, tolerance=tolerance)
    return points


if __name__ == "__main__":
    run_up_points(paper_gearbox(), quick=False)
