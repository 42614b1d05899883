"""Runs at extreme steps, damping, backlash and loads; rattle, contact loss, long and fast runs."""

import numpy as np
import pytest
from numba import njit
from scenes import INERTIA, paper_gear, paper_pair, ran, rms, smooth_box, smooth_law, smooth_map
from scipy.integrate import quad
from scipy.optimize import brentq

import exugear
from exugear.mesh_force.force_kernels import spinning_force
from fem.units import rpm, um

R_B, TEETH = paper_pair().wheel.r_b, 57
MASS = INERTIA / R_B**2
BACKLASHES = [0.0, 1e-9, 50 * um]
LIVELY = {"speed": (800 * rpm, 1200 * rpm), "duration": 1.0}


def pair_of(law: exugear.MeshForce) -> exugear.Model:
    """Two spinning shafts of known inertia under a law."""
    shafts = [exugear.Shaft(name, {0.0: paper_gear()}, inertia=INERTIA) for name in ("fast", "slow")]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law, pair=paper_pair())]))


def loose(backlash: float, damping: float = 0.0) -> exugear.MeshForce:
    return smooth_law(damping=damping, backlash=backlash)


@pytest.fixture(scope="module")
def finest(spinning) -> np.ndarray:
    return rms(ran(spinning, **LIVELY, step=spinning.plan.step() / 8))


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0, 3.5])
def test_steps_err_by_their_fourth_power(spinning, finest, share):
    error = np.abs(rms(ran(spinning, **LIVELY, step=share * spinning.plan.step())) / finest - 1)
    assert np.median(error) < 3e-4 * share**4 + 1e-4


def test_four_times_the_step_is_refused_with_the_limit(spinning):
    with pytest.raises(ValueError, match=r"step must be below 0.0001\d+ s .*stability"):
        ran(spinning, **LIVELY, step=4 * spinning.plan.step())


@pytest.mark.parametrize("backlash", BACKLASHES)
@pytest.mark.parametrize(("before", "after"), [(50.0, 150.0), (350.0, 20.0), (150.0, 0.0), (150.0, -150.0)])
def test_torque_step_without_damping_conserves_energy(before, after, backlash):
    """Within contact, into free flight and back, through the backlash onto the back flank and back."""
    law, step = loose(backlash), 2e-6
    dte = ran(pair_of(law), speed=0.0, load=lambda t: after if t > 0 else before, step=step, sample=step, duration=0.03)
    start = law.deflection_at(0.0, before / R_B)
    edges = [x for x in (0.0, -backlash) if abs(x - start) > 0]

    def gained(y: float) -> float:
        """Energy [J] that force and load take up from the start to y."""
        return quad(lambda x: float(law(0.0, x)) - after / R_B, start, y, points=edges, epsrel=1e-9, limit=200)[0]

    way = 1 if after > before else -1
    still = law.deflection_at(0.0, after / R_B) if after > 0 else -backlash - 1e-12
    end = brentq(gained, still, start + way * 60 * um - (backlash if way < 0 else 0.0), xtol=1e-12)
    y = dte["dte"].values[0]
    for part in np.array_split(y, 3):
        assert (part * way).max() == pytest.approx(end * way, abs=2e-3 * abs(end - start))
        assert (part * way).min() == pytest.approx(start * way, abs=2e-3 * abs(end - start))


def test_without_back_flank_a_reversed_load_accelerates_the_wheel_freely():
    data = ran(pair_of(loose(np.inf)), load=lambda t: 150.0 if t < 0.01 else -150.0, duration=0.02, sample=1e-5)
    time, y = data["time"].values, data["dte"].values[0]
    fall = np.polyfit(time[time > 0.015], y[time > 0.015], 2)[0]
    assert fall == pytest.approx(-150 / R_B / MASS / 2, rel=1e-6)


def test_impact_after_a_huge_backlash_is_reported_beyond_the_map():
    with pytest.raises(RuntimeError, match=r"at t = .* rpm\): deflection .* beyond the map.* larger torque"):
        ran(pair_of(loose(9.9e-3, damping=2700.0)), load=lambda t: 150.0 if t < 0.01 else -150.0)


@njit
def rk4_rattle(head, law, swing, load, y, steps, step):
    """Deflection [m] of a pair whose pinion turns at 100 + swing sin(100 pi t) [rad/s], at each of the steps.

    law   (backlash, back phase, damping, ramp of the damping)
    """
    backlash, back_phase, damping, ramp = law
    substeps, pulse, v, t, deflections = 20, 100 * np.pi, 0.0, 0.0, np.empty(steps + 1)
    h, deflections[0] = step / substeps, y
    for i in range(substeps * steps):
        dy = dv = a = v_stage = 0.0
        for stage in range(4):
            ahead = h * ((stage + 1) // 2) / 2
            time, y_stage, v_stage = t + ahead, y + ahead * v_stage if stage else y, v + ahead * a
            phase = TEETH * (100 * time + swing / pulse * (1 - np.cos(pulse * time))) / (2 * np.pi)
            side = -1.0 if y_stage < -backlash / 2 else 1.0
            depth = y_stage if side > 0 else -y_stage - backlash
            force = 0.0
            if depth > 0:
                share = min(depth / ramp, 1.0)
                force = spinning_force(head, phase if side > 0 else back_phase - phase, depth).force
                force += damping * share**2 * (3 - 2 * share) * side * v_stage
            a = R_B * swing * pulse * np.cos(pulse * time) - (side * force - load / R_B) / MASS
            weight = h / 3 if stage in (1, 2) else h / 6
            dy, dv = dy + weight * v_stage, dv + weight * a
        y, v, t = y + dy, v + dv, t + h
        if (i + 1) % substeps == 0:
            deflections[(i + 1) // substeps] = y
    return deflections


@pytest.mark.parametrize("load", [0.0, 5.0])
@pytest.mark.parametrize("backlash", BACKLASHES)
def test_rattle_obeys_newton(backlash, load):
    """Speed that varies at 50 Hz: the equation of motion by Runge-Kutta steps of half a microsecond, without Exudyn."""
    pulse, swing = 2 * np.pi * 50, 50.0
    law = loose(backlash, damping=2700.0)
    speed = lambda t: 100 + swing * np.sin(pulse * t)  # noqa: E731
    data = ran(pair_of(law), speed=speed, load=load, step=1e-5, sample=1e-5, tolerance=1e-7, duration=0.06)
    (y,), (force,) = data["dte"].values, data["mesh_force"].values
    assert np.ptp([law.unloaded(phase)[0] for phase in (0.0, 0.3, 0.8)]) == 0
    numbers = backlash, law.back_phase, law.damping, 1 * um
    expected = rk4_rattle(law.table.head, numbers, swing, load, y[0], y.size - 1, 1e-5)
    assert y == pytest.approx(expected, abs=0.02 * um)
    assert force.min() < -100 < 100 < force.max()
    assert np.mean(force == 0) > 0.2 or backlash < 1 * um


@pytest.mark.parametrize("backlash", BACKLASHES)
def test_unloaded_gears_at_constant_speed_do_not_vibrate(backlash):
    """But for the rounding of their angles."""
    law = loose(backlash, damping=2700.0)
    data = ran(pair_of(law), load=0.0)
    rounding = np.finfo(float).eps * float(data["speed"].integrate("time")) * R_B
    assert np.abs(data["dte"].values).max() < 1000 * rounding < 1e-12
    assert np.abs(data["mesh_force"].values).max() < 1000 * rounding * law.stiffness_max


def test_resonance_with_contact_loss_in_every_cycle_transmits_the_mean_load(spinning):
    """Sweep down onto the upper branch, then constant speed; whole cycles."""
    top, held = 2100 * rpm, 1700 * rpm
    speed = np.r_[np.linspace(0, 0.5, 51), 1.5], np.r_[np.linspace(top, held, 51), held]
    model = exugear.build(smooth_box(damping=1500.0))
    data = ran(model, speed=speed, duration=1.5)
    cycle = 2 * np.pi / TEETH / held
    time, force = data["time"].values, data["mesh_force"].values[0]
    last = time > time[-1] - 300 * cycle
    cycles = np.floor((time[last] - time[last][0]) / cycle).astype(int)
    lost = np.bincount(cycles, force[last] == 0) / np.bincount(cycles)
    assert lost[:-1].min() > 0.2
    assert force[last].mean() == pytest.approx(150 / R_B, rel=2e-3)


@pytest.mark.parametrize("turning", [0.1, 1.0, 10.0])
def test_dte_at_low_speed_follows_the_map(turning, spinning):
    """One pitch; the damping lags by 0.0005 um/rpm where the map is steepest."""
    pitch = 2 * np.pi / TEETH / (turning * rpm)
    data = ran(spinning, speed=turning * rpm, duration=pitch, sample=pitch / 500)
    law = spinning.meshes[0].stage.force
    phase = data["time"].values[::50] / pitch
    static = [law.deflection_at(p, 150 / R_B) for p in phase]
    assert data["dte"].values[0, ::50] == pytest.approx(static, abs=(5e-4 * turning + 1e-4) * um)


@pytest.mark.parametrize("turning", [6e3, 20e3, 60e3])
def test_far_above_resonance_the_gears_turn_steadily(turning, spinning):
    """The mean force balances the load; the vibration falls with the square of the speed."""
    data = ran(spinning, speed=turning * rpm, duration=0.1, sample=1 / (16 * TEETH * turning / 60))
    y, law = data["dte"].values[0], spinning.meshes[0].stage.force
    late = y[y.size // 2 :]
    phase = (np.arange(1000) + 0.5) / 1000
    resting = brentq(lambda y: law(phase, y).mean() - 150 / R_B, 0, 20 * um)
    share = (2000 / turning) ** 2
    assert late.mean() == pytest.approx(resting, rel=0.1 * share + 1e-4)
    assert np.ptp(late) < 2 * share * np.ptp(smooth_map()["te"].sel(torque=150).values)


@pytest.mark.slow
def test_two_thousand_revolutions_stay_periodic(spinning):
    """In a single run, whose 16 samples of every pitch stay at the same phases: the step sums up exactly."""
    step = 2.0**-16 * 7 / 8
    turn = TEETH * 16 * step
    data = ran(spinning, speed=2 * np.pi / turn, duration=2000 * turn, step=step, sample=step)
    turns = data["dte"].values[0, :-1].reshape(2000, -1)
    assert np.sqrt(np.mean((turns[-1] - turns[50]) ** 2)) < 1e-5 * np.ptp(turns[50])


def test_a_run_that_misses_samples_is_refused(monkeypatch, spinning):
    monkeypatch.setattr("exugear.multibody.time_integration.Solver._solve_dynamic", lambda *_: None)
    with pytest.raises(RuntimeError, match="samples are lost; try step="):
        ran(spinning, load=10.0, speed=1.0)
