"""Damping by its ratio, and runs without damping."""

from dataclasses import replace

import numpy as np
import pytest
import scipy
from paper_gears import paper_gear, paper_pair
from scenes import INERTIA, K, linear_law, smooth_box, smooth_law, smooth_map

import exugear
from fem.units import mm, rpm

R_B = paper_pair().pinion.r_b
#: Of the two shafts of `stage` on the line of action [kg].
REDUCED_MASS = 1 / (R_B**2 / INERTIA + R_B**2 / (3 * INERTIA))


def shaft(name: str, inertia: float = INERTIA, *parts) -> exugear.Shaft:
    return exugear.Shaft(name, {30 * mm: [paper_gear(), *parts]}, inertia=inertia)


def stage(law=None, **changes) -> exugear.Stage:
    given = {"pair": paper_pair()} | changes
    return exugear.Stage(shaft("fast"), shaft("slow", 3 * INERTIA), law or linear_law(), **given)


@pytest.mark.parametrize("ratio", [0.02, 0.06])
def test_free_vibrations_decay_with_the_ratio(ratio):
    """Two shafts free to spin on a linear mesh: the coupling of the fast shaft is very soft."""
    soft = exugear.Coupling(200.0, inertia=1.0)
    fast, slow = shaft("fast", INERTIA, soft), shaft("slow", 3 * INERTIA)
    given = {"pair": paper_pair(), "damping_ratio": ratio}
    model = exugear.build(exugear.Gearbox([exugear.Stage(fast, slow, linear_law(), **given)]))
    load = lambda t: 150.0 if t < 1e-5 else 140.0  # noqa: E731
    data = exugear.run_up(model, speed=0.0, load=load, duration=2e-3, sample=1e-6, tolerance=1e-6, progress=False).data
    dte = data["dte"].values[0]
    turns = np.sort(np.r_[scipy.signal.find_peaks(dte)[0], scipy.signal.find_peaks(-dte)[0]])[1:10]
    swings = np.abs(np.diff(dte[turns]))
    decrement = -np.polyfit(np.arange(swings.size), np.log(swings), 1)[0] / np.pi
    assert decrement / np.sqrt(1 + decrement**2) == pytest.approx(ratio, rel=0.01)


def test_ratio_is_that_of_the_reduced_mass():
    assert stage(damping_ratio=0.06).force.damping == pytest.approx(0.12 * np.sqrt(K * REDUCED_MASS), rel=1e-9)


def test_stiffness_of_a_map_is_the_slope_at_its_largest_torque():
    """By the damping for a ratio, 2 ratio sqrt(k m), against differences of the deflection under two torques."""
    law = smooth_law()
    top, phases = 4000 / R_B, np.arange(24) / 24
    spans = [law.deflection_at(x, top) - law.deflection_at(x, 0.999 * top) for x in phases]
    stiffness = (stage(law, damping_ratio=0.5).force.damping) ** 2 / REDUCED_MASS
    assert stiffness == pytest.approx(np.mean(1e-3 * top / np.array(spans)), rel=2e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"damping_ratio": 6.0}, r"damping_ratio must lie in \(0, 1\).*0.06"),
        ({"damping_ratio": 0.0}, r"damping_ratio must lie in \(0, 1\)"),
        ({"damping_ratio": np.nan}, r"damping_ratio must lie in \(0, 1\)"),
        ({"law": smooth_map(), "damping": 2700.0, "damping_ratio": 0.06}, "leave one out"),
        ({"law": smooth_map(), "damping": 0.0, "damping_ratio": 0.06}, "leave one out"),
        ({"law": replace(linear_law(), damping=2700.0), "damping_ratio": 0.06}, "leave one out"),
        ({"law": smooth_map(), "damping": 0.06}, "meant as ratio.*pass damping_ratio=0.06"),
        ({"law": replace(linear_law(), damping=0.06)}, "meant as ratio.*pass damping_ratio=0.06"),
        ({"law": smooth_map(), "damping": 2.7e6}, "stuck together"),
    ],
)
def test_implausible_dampings_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        stage(**changes)


def test_damping_of_watch_gears_may_be_small():
    """0.06 N s/m is 6 % of the critical damping of such gears."""
    light = [exugear.Shaft(name, {0.0: paper_gear()}, inertia=1e-12) for name in ("fast", "slow")]
    assert exugear.Stage(*light, linear_law([1e6] * 3), pair=paper_pair(), damping_ratio=0.06).force.damping < 1


def test_missing_damping_is_reported():
    """In its plan, and where it leaves the map at resonance: the remedy is damping, not a larger map."""
    law = exugear.MeshForce.from_ste(smooth_map((0, 50, 150, 350)))
    model = exugear.build(exugear.Gearbox([stage(law)]))
    assert "damping: none" in str(model.plan) and "damping: none" in str(exugear.plan(model.gearbox))
    with pytest.raises(RuntimeError, match=r"beyond the map.*damping: none.*damping_ratio=0.06"):
        exugear.run_up(model, speed=1950 * rpm, load=300.0, duration=0.3, progress=False)


@pytest.mark.parametrize("damped", [True, False])
@pytest.mark.parametrize(
    "part_of",
    [
        lambda damped: exugear.Bearing(1e9, 1e9, 1e6, damping_time=1e-6 * damped),
        lambda damped: exugear.Coupling(1e4, damping=2.0 * damped, inertia=0.1),
    ],
    ids=["bearing", "coupling"],
)
def test_damping_of_any_part_counts(part_of, damped):
    assert ("damping: none" in str(exugear.plan(smooth_box(part_of(damped), damping=0.0)))) == (not damped)
