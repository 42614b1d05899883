"""The books of runs: power in less power out is what is stored and dissipated, over the run and over any window."""

import numpy as np
import pytest
from scenes import paper_gear, paper_pair, rectangular_law, smooth_box, smooth_law
from spatial_meshes import two_helical_stages

import exugear
from fem.units import mm, rpm, um

PAIR = paper_pair()
BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=2e-5)
BEARINGS = dict.fromkeys((0.0, 70 * mm), BALL)
COUPLING = exugear.Coupling(8e3, 5.0, inertia=0.02)
FRICTION = exugear.MeshFriction.of_pair(PAIR, 0.06)
LOOSE = {
    z: exugear.Bearing(2e8, 1e8, damping_time=2e-5, clearance=5 * um, drag=exugear.Drag(0.5)) for z in (0.0, 70 * mm)
}
QUIET = {"progress": False, "checks": 0, "power": True}
RUN_UP = {"speed": (50.0, 366.0), "duration": 0.5, "load": 150.0}
STEADY = {"speed": 2500 * rpm, "duration": 0.1, "load": 150.0}
#: Largest residual over the throughput, of shafts that spin and of bodies on bearings; shortest window [s].
SPIN, SPACE, SHORTEST = 1e-6, 1e-5, 5e-3


def residuals(run: exugear.Run) -> np.ndarray:
    """Relative residuals of the whole run, then of random windows."""
    end = float(run.data["time"][-1])
    windows = np.sort(np.random.default_rng(0).uniform(0, end, (60, 2)))
    balances = [run.energy_balance(*window) for window in windows if np.diff(window) > SHORTEST]
    return np.array([run.energy_balance().relative, *(balance.relative for balance in balances)])


@pytest.mark.parametrize(
    ("box", "course", "bound"),
    [
        (smooth_box(), RUN_UP, SPIN),
        (smooth_box(parts={0.0: COUPLING}), RUN_UP, SPIN),
        (smooth_box(friction=FRICTION), RUN_UP, SPIN),
        (smooth_box(), RUN_UP | {"load": 0.0}, SPIN),
        (smooth_box(parts=BEARINGS), STEADY, SPACE),
        (smooth_box(parts=BEARINGS, friction=FRICTION), STEADY, SPACE),
        (smooth_box(parts=LOOSE), STEADY, SPACE),
        (two_helical_stages(BALL, (0.4, -1.6), backlash=200 * um), STEADY | {"load": 100.0}, SPACE),
    ],
    ids=[
        "spin",
        "couplings",
        "friction",
        "no load",
        "bearings",
        "friction on bearings",
        "clearance and drag",
        "helical",
    ],
)
def test_energy_balance_closes_over_the_run_and_over_any_window(box, course, bound, measured):
    run = exugear.run_up(exugear.build(box), **course, **QUIET)
    whole, *windows = residuals(run)
    measured("energy balance of eight run-ups, whole run", whole, bound)
    measured("the same, windows of 5 ms or more", max(windows), 2 * bound)
    assert np.median(windows) < bound


def test_energy_balance_of_a_torque_reversal_closes():
    """Teeth cross the backlash and hit the other flank; the throughput passes 0."""
    load = lambda t: 150 * np.cos(2 * np.pi * 4 * t)  # noqa: E731
    run = exugear.run_up(exugear.build(smooth_box()), speed=200.0, duration=0.5, load=load, **QUIET)
    whole, *windows = residuals(run)
    assert whole < 5e-6 and np.median(windows) < 2e-6
    assert run.data["mesh_force"].min() < 0


def test_energy_balance_of_a_free_train_under_torques_closes():
    drives, loads = {"fast": exugear.Torque(150.0)}, {"slow": exugear.Torque(100.0)}
    options = {"duration": 0.3, "start_speed": 50.0} | QUIET
    run = exugear.run(exugear.build(smooth_box()), drives=drives, loads=loads, **options)
    assert residuals(run).max() < SPIN


def test_damping_of_the_mesh_is_paid_by_the_drive():
    """The former law's drive does not pay for it, as it bears no torque dU/dphase."""
    law = {c: smooth_law(damping=2700.0, conserves=c) for c in (True, False)}
    paid = {}
    for conserves, force in law.items():
        shafts = [exugear.Shaft(name, {30 * mm: paper_gear()}) for name in ("fast", "slow")]
        model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, force, pair=PAIR)]))
        balance = exugear.run_up(model, **STEADY, **QUIET).energy_balance(0.05)
        paid[conserves] = (balance.work_in - balance.work_out - balance.stored) / balance.losses["mesh_loss"]
    assert paid[True] == pytest.approx(1, rel=1e-3)
    assert abs(paid[False] - 1) > 0.1


def test_windows_and_runs_without_powers_are_refused():
    run = exugear.run_up(exugear.build(smooth_box()), speed=100.0, duration=0.01, load=150.0, progress=False)
    with pytest.raises(ValueError, match="run it with power=True"):
        run.energy_balance()
    run = exugear.run_up(exugear.build(smooth_box()), speed=100.0, duration=0.01, load=150.0, **QUIET)
    with pytest.raises(ValueError, match=r"start and end must lie within \[0, 0.01\] s"):
        run.energy_balance(0.005, 0.02)
    assert "work in" in str(run.energy_balance())


def test_a_window_may_end_at_the_duration_and_a_driving_load_has_an_efficiency_below_1():
    """The last sample lies a rounding before the duration. What enters at the load leaves at the drive."""
    model = exugear.build(smooth_box(friction=FRICTION))
    run = exugear.run_up(model, **STEADY | {"duration": 0.06, "load": -150.0}, **QUIET)
    assert 0.95 < run.energy_balance(0.03, 0.06).efficiency < 1
    with pytest.raises(ValueError, match="start and end must lie within"):
        run.energy_balance(0.03, 0.061)
    at_rest = exugear.run_up(model, **STEADY | {"speed": 0.0, "duration": 0.01}, **QUIET).energy_balance()
    assert np.isnan(at_rest.efficiency)


@pytest.mark.filterwarnings("ignore:the mesh force jumps")
@pytest.mark.parametrize("speed", [100.0, (100.0, 110.0)])
def test_power_takes_a_third_of_the_step_and_every_sample_also_where_the_mesh_force_jumps(speed):
    shafts = [exugear.Shaft(name, {0.0: paper_gear()}) for name in ("fast", "slow")]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, rectangular_law(), pair=PAIR)]))
    course = {"speed": speed, "duration": 0.05, "load": 150.0, "progress": False, "checks": 0}
    plain, balanced = (exugear.run_up(model, **course, power=power).data for power in (False, True))
    assert plain.attrs["step"] / balanced.attrs["step"] == pytest.approx(3, rel=0.05)
    assert balanced.attrs["sample"] == balanced.attrs["step"] == pytest.approx(float(np.diff(balanced["time"][:2])[0]))
    assert balanced.attrs["tolerance"] == plain.attrs["tolerance"] == 1e-3
