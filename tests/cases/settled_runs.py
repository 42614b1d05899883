"""Settled runs of gearboxes beside their steady states."""

import numpy as np
import pytest

import exugear
from fem.units import rpm

TOP, LOAD = 3500 * rpm, 150.0


def swept(model: exugear.Model, before: float, speeds, load: float, step: float) -> list[np.ndarray]:
    """DTE over 20 mesh cycles at each of the speeds, of a run in steps [s] that ramps from one before to each."""
    box, hold, parts, last = model.gearbox, 0.2, [], None
    for speed in speeds:
        ramp, kept = 0.08, 20 / (model.mesh_cycles[0] * speed)
        times = np.array([0.0, ramp, ramp + hold + kept])
        drives = {box.driving.name: exugear.Speed((times, np.array([before, speed, speed])))}
        options = {"duration": times[-1], "step": step, "sample": step, "progress": False, "checks": 0}
        last = exugear.run(model, drives=drives, loads={box.driven.name: load}, initial=last, **options)
        time, before = last.data["time"].values, speed
        parts.append(last.data["dte"].values[0, time >= time[-1] - kept])
    return parts


def picked(data, number: int) -> np.ndarray:
    """Stable points away from folds, by rising speed."""
    frequency, folds = data["mesh_frequency"].values, data["mesh_frequency"].values[data["bifurcation"] == "fold"]
    near = (np.abs(frequency[:, None] / folds - 1) < 0.04).any(axis=1)
    stable = np.flatnonzero(data["stable"].values & ~near & (data["speed"].values > 300 * rpm))
    chosen = stable[np.linspace(0, stable.size, number + 2).astype(int)[1:-1]]
    return chosen[np.argsort(frequency[chosen])]


def compare(model: exugear.Model, data, load: float, number: int, step: float) -> None:
    """Compare orbits with a run that sweeps up through their speeds, or else with one that sweeps down."""
    orbits = [data.isel(point=point) for point in picked(data, number)]
    speeds = [float(orbit["speed"]) for orbit in orbits]
    runs = swept(model, 200 * rpm, speeds, load, step)
    missed = [dte.std() != pytest.approx(float(x["rms"]), rel=1e-3) for x, dte in zip(orbits, runs, strict=True)]
    if any(missed):
        lowest = missed.index(True)
        down = swept(model, TOP, speeds[lowest:][::-1], load, step)[::-1]
        pairs = zip(runs[lowest:], down, missed[lowest:], strict=True)
        runs[lowest:] = [new if is_missed else dte for dte, new, is_missed in pairs]
    for orbit, dte in zip(orbits, runs, strict=True):
        rms, mean, peak_to_peak = (float(orbit[name]) for name in ("rms", "mean", "peak_to_peak"))
        assert dte.std() == pytest.approx(rms, rel=1e-3), float(orbit["mesh_frequency"])
        assert np.ptp(dte) == pytest.approx(peak_to_peak, rel=1e-3)
        assert dte.mean() == pytest.approx(mean, abs=1e-3 * peak_to_peak)


def settled_dte(model: exugear.Model, orbit, load: float, step: float, cycles: int, duration=0.3) -> np.ndarray:
    """(n_stage, n_time) DTE over mesh cycles of the first stage at the end of a run at the speed of an orbit."""
    options = {"duration": duration, "step": step, "sample": step, "progress": False, "checks": 0}
    data = exugear.run_up(model, speed=float(orbit["speed"]), load=load, **options).data
    kept = cycles / (model.mesh_cycles[0] * float(orbit["speed"]))
    return data["dte"].values[:, data["time"].values >= data["time"].values[-1] - kept]


def agree(orbit, dte: np.ndarray) -> None:
    """The orbit of every stage is that of a run, within 1e-3."""
    assert dte.std(axis=1) == pytest.approx(orbit["rms"].values, rel=1e-3)
    assert np.ptp(dte, axis=1) == pytest.approx(orbit["peak_to_peak"].values, rel=1e-3)
    assert dte.mean(axis=1) == pytest.approx(orbit["mean"].values, rel=1e-3)
