"""Force laws that jump over phase: detected, reported, and resolved by the steps of a run."""

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import K, Oscillator, linear_law, rectangular_law, smooth_box, smooth_law

import exugear
import fem
from exugear import MeshForce
from fem.units import deg, mm, um

F, PERIODS, KEPT = 10e3, 420, 40


@pytest.fixture(scope="module")
def oscillator() -> Oscillator:
    return Oscillator(rectangular_law(), zeta=0.02)


def steady_run(oscillator: Oscillator, w: float, **options) -> exugear.Run:
    speed, duration = w * oscillator.omega / oscillator.teeth, PERIODS * 2 * np.pi / oscillator.omega
    conditions = {"speed": speed, "duration": duration, "load": F * oscillator.r}
    return exugear.run_up(oscillator.model, **conditions | {"sample": 1e-9, "progress": False, "checks": 0} | options)


def end_of(run: exugear.Run, oscillator: Oscillator, w: float) -> np.ndarray:
    """DTE K / F in the last mesh cycles."""
    time = run.data["time"].values
    return run.data["dte"].values[0, time > time[-1] - KEPT / w * 2 * np.pi / oscillator.omega] * K / F


@pytest.mark.parametrize("w", [1.5, 0.5])
def test_a_jump_excites_no_subharmonics_at_the_default_step(oscillator, w):
    """Against 500 steps in a mesh period; steps that miss the jumps err by 6 % of the rms at W = 1.5."""
    runs = steady_run(oscillator, w), steady_run(oscillator, w, step=2 * np.pi / oscillator.omega / w / 500)
    rough, fine = (end_of(run, oscillator, w) for run in runs)
    assert rough.std() == pytest.approx(fine.std(), rel=1.2e-3)
    assert np.ptp(rough) == pytest.approx(np.ptp(fine), rel=2e-3)


def test_number_of_steps_in_a_mesh_period_follows_the_tolerance(oscillator):
    period = 2 * np.pi / oscillator.omega / 1.5
    for tolerance, fewest in ((1e-2, 32), (1e-3, 100), (1e-4, 317)):
        steps = period / steady_run(oscillator, 1.5, tolerance=tolerance, duration=20 * period).step
        assert steps == pytest.approx(round(steps), abs=1e-6)
        assert fewest <= round(steps) <= 2 * fewest


def test_jumps_of_known_laws_are_detected():
    assert rectangular_law().jumps == pytest.approx([0.45, 1.0], abs=1e-3)
    assert linear_law((1e8, 1e8, 3e8, 3e8), (0.0, 0.4999, 0.5, 0.9999)).jumps == pytest.approx([0.5, 1.0], abs=1e-3)
    steps = linear_law((1e8, 1e8, 2e8, 2e8, 3e8, 3e8), (0.0, 0.2999, 0.3, 0.6999, 0.7, 0.9999))
    assert steps.jumps == pytest.approx([0.3, 0.7, 1.0], abs=1e-3)
    late = np.where(np.arange(1000) < 250, -40 * um, -35 * um)[:, None]
    deflection, table = late + np.array([0.0, 30 * um]), np.outer(np.ones(1000), [0.0, 1e4])
    pitch = MeshForce(np.arange(1000) / 1000, deflection, table, backlash=1e-3)
    assert pitch.jumps == pytest.approx([0.25, 1.0], abs=1e-3)


SLICES, COARSE = fem.Slices(slices=8), fem.Slices(fem.Density().scaled(0.5), slices=8)
SLOW = pytest.mark.slow  # its finite elements take seconds
GEARS = {
    "plain": ({}, {}),
    "helical": ({"beta": 15 * deg}, {"beta": -15 * deg}),
    "crowned": ({"flank": [fem.LeadCrowning(10 * um)]},) * 2,
    "relieved": ({"flank": [fem.TipRelief(30 * um, 1 * mm)]},) * 2,
}


@pytest.mark.parametrize("torque", [(0, 5, 50, 350), (0, 0.1, 0.5, 3)])
@pytest.mark.parametrize("gears", [pytest.param(name, marks=SLOW if name == "helical" else ()) for name in GEARS])
def test_maps_do_not_jump(gears, torque):
    """Also at light load, where the second tooth pair takes over within 1/60 of a pitch."""
    pinion, wheel = (paper_gear(**changes) for changes in GEARS[gears])
    pair = fem.GearPair(pinion, wheel, a=paper_pair().a if gears != "helical" else None)
    resolution = COARSE if gears == "helical" else SLICES
    ste = fem.static_transmission_error(pair, torque, 60, resolution=resolution, progress=False)
    assert MeshForce.from_ste(ste).jumps.size == 0


def test_smooth_and_constant_laws_do_not_jump():
    assert smooth_law().jumps.size == linear_law().jumps.size == 0
    ramp = np.interp(np.arange(100) / 100, [0.4, 0.42, 0.9, 0.92], [1e8, 3e8, 3e8, 1e8])
    assert linear_law(ramp, np.arange(100) / 100).jumps.size == 0


def test_a_run_at_changing_speed_warns_that_its_steps_miss_the_jumps(oscillator):
    assert "fast-slow: its force jumps at phase 0.450, 1.000" in str(oscillator.model.plan)
    ramp = {"speed": (10.0, 100.0), "load": 300.0, "duration": 0.02, "progress": False}
    with pytest.warns(
        UserWarning, match=r"jumps: .*while the speed changes .* smooth the table over 0.02 of a pitch"
    ) as warned:
        run = exugear.run_up(oscillator.model, **ramp)
    assert warned[0].filename == __file__  # the line of the user
    assert "smooth the table" in run.data.attrs["jumps"]
    fine = exugear.run_up(oscillator.model, **ramp, step=run.step / 3)
    assert "smooth the table" in fine.data.attrs["jumps"]
    assert "jumps" not in exugear.run_up(exugear.build(smooth_box()), **ramp).data.attrs
