"""Runs in parts side by side: equal to serial runs, also where parts meet late; refused, stopped and killed ones."""

import os
import signal
import tempfile
import warnings
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
import xarray as xr
from executors import RUN, Inline, OnAnotherMachine, assert_equal
from friction_cases import MU
from paper_gears import paper_pair
from scenes import rms, smooth_box, smooth_map, two_stages

import exugear
from exugear.running import part_integration
from fem.units import mm, rpm


def serial_and_parts(box: exugear.Gearbox, **changes) -> tuple[xr.Dataset, xr.Dataset]:
    """Data of a serial run and of the same run in parts."""
    model, options = exugear.build(box), RUN | changes
    return exugear.run_up(model, **options).data, exugear.run_up(model, **options, executor=Inline()).data


def test_parts_are_joined_in_a_system_that_has_drive_and_load_as_items():
    """The systems of the processes lack them."""
    serial, model = exugear.build(smooth_box()), exugear.build(smooth_box())
    assert int(model.load) == 0 and model.mbs.systemData.NumberOfLoads() == 1
    parts = exugear.run_up(model, **RUN, executor=Inline()).data
    assert_equal(exugear.run_up(serial, **RUN).data, parts)


BEARING = exugear.Bearing(radial=3e8, axial=1e8, tilt=1e5, damping_time=1e-4)


def planar() -> exugear.Gearbox:
    """Equal bearings on either side of the gears, which therefore move in their planes."""
    ball = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-4)
    return smooth_box(parts={0 * mm: ball, 60 * mm: ball})


def driven_through_couplings() -> exugear.Gearbox:
    """Rotors behind couplings on both shafts."""
    coupling = exugear.Coupling(torsion=2e5, damping=40.0, inertia=0.02)
    return smooth_box(parts={-20 * mm: coupling})


def lossy() -> exugear.Gearbox:
    """Friction between the teeth and drag of the shafts."""
    friction = exugear.MeshFriction.of_pair(paper_pair(), MU)
    return smooth_box(parts={0.0: exugear.Drag(0.1, 1e-3)}, friction=friction)


BOXES = smooth_box, planar, lambda: smooth_box(BEARING), driven_through_couplings, two_stages, lossy


@pytest.mark.parametrize("box", BOXES)
def test_parts_are_the_serial_run(box):
    assert_equal(*serial_and_parts(box(), displacement=True))


@pytest.mark.parametrize("executor", [Inline, OnAnotherMachine])
def test_samples_through_files_and_without_them_leave_nothing_behind(executor, monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    model = exugear.build(smooth_box(BEARING))
    parts = exugear.run_up(model, **RUN, executor=executor()).data
    assert not list(tmp_path.iterdir())
    assert_equal(exugear.run_up(model, **RUN).data, parts)


def test_components_that_planar_shafts_lack_do_not_travel(monkeypatch):
    """Of offsets along the shafts and of tilts, which are 0, a single value reaches the whole run."""
    travelled, copy_to = [], part_integration.PartSamples.copy_to

    def counted(samples, rows, begin):
        travelled.append(sum(len(row) > 1 for row in samples.rows))
        copy_to(samples, rows, begin)

    monkeypatch.setattr(part_integration.PartSamples, "copy_to", counted)
    exugear.run_up(exugear.build(planar()), **RUN, executor=Inline())
    mesh, motion = 6, 8  # DTE, force, centre distance, phase, two torques; x and y of two shafts and their rates
    assert set(travelled) == {mesh + motion}


def test_powers_and_energies_are_those_of_the_serial_run():
    serial, parts = serial_and_parts(lossy(), duration=0.3, power=True)
    assert_equal(serial, parts)
    assert {"power_in", "mesh_loss", "kinetic_energy"} <= set(parts)


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": 1000 * rpm},
        {"speed": lambda t: 100 + 20 * np.sin(5 * t)},
        {"load": (100.0, 200.0)},
        {"load": lambda t: 150 + 50 * np.sin(9 * t)},
        {"step": 2e-5, "sample": 1e-4},
    ],
)
def test_speeds_and_loads_of_all_kinds(changes):
    """Functions of time travel to other processes as tables."""
    assert_equal(*serial_and_parts(smooth_box(), **changes))


def test_torque_over_the_angle_and_the_end_of_another_run():
    model = exugear.build(smooth_box())
    ripple = exugear.Torque(of_angle=lambda angle: 150 + 20 * np.sin(angle))
    conditions = {"drives": {"fast": (100.0, 120.0)}, "loads": {"slow": ripple}, "progress": False}
    before = exugear.run(model, **conditions, duration=0.1)
    again = {**conditions, "drives": {"fast": (120.0, 130.0)}, "duration": 0.5, "initial": before}
    assert_equal(exugear.run(model, **again).data, exugear.run(model, **again, executor=Inline()).data)


def test_a_run_goes_on_from_the_end_of_parts():
    model = exugear.build(smooth_box())
    options = {"drives": {"fast": 100.0}, "loads": {"slow": 150.0}, "progress": False}
    ends = [exugear.run(model, **options, duration=0.3, executor=e) for e in (None, Inline())]
    serial, parts = (exugear.run(model, **options, duration=0.05, initial=end).data for end in ends)
    assert parts["dte"].values == pytest.approx(serial["dte"].values, rel=1e-6)


def test_a_part_on_another_branch_is_integrated_again(monkeypatch):
    """Light damping, and an early start that is too short for it and begins with other speeds."""
    original, started = part_integration.solve_initial_equilibrium, []

    def disturbed(model, conditions, rule):
        original(model, conditions, rule)
        if conditions.start_time > 0:
            started.append(conditions.start_time)
            rates = model.mbs.systemData.GetODE2Coordinates_t(part_integration.INITIAL)
            model.mbs.systemData.SetODE2Coordinates_t(rates * 1.001, part_integration.INITIAL)

    monkeypatch.setattr(part_integration, "solve_initial_equilibrium", disturbed)
    monkeypatch.setattr("exugear.running.joined_parts.settling_time", lambda decay, share: 1e-3)
    serial, parts = serial_and_parts(smooth_box(damping=200.0))
    assert_equal(serial, parts)
    assert not parts.attrs["parts"].endswith(" 0 of the run integrated again")
    assert (parts["seam"] > started[0] + 0.1).all()


def test_parts_that_never_meet_are_serial_and_say_so(monkeypatch):
    for module in ("part_integration", "joined_parts"):
        monkeypatch.setattr(f"exugear.running.{module}.seam_error", lambda *_: 1.0)
    model = exugear.build(smooth_box())
    with pytest.warns(UserWarning, match=r"of the run were integrated again") as warned:
        parts = exugear.run_up(model, **RUN | {"duration": 0.3}, executor=Inline()).data
    assert warned[0].filename == __file__  # the line of the user
    serial = exugear.run_up(model, **RUN | {"duration": 0.3}).data
    assert parts["dte"].values == pytest.approx(serial["dte"].values, rel=1e-9)


def test_without_damping_a_run_is_serial_and_says_so():
    model = exugear.build(smooth_box(damping=0.0))
    assert "a mode that the meshes excite is not damped" in str(model.plan)
    options = RUN | {"duration": 0.05}
    with pytest.warns(UserWarning, match="the run is serial, as vibrations do not decay") as warned:
        parts = exugear.run_up(model, **options, executor=Inline()).data
    assert warned[0].filename == __file__  # the line of the user
    assert parts.identical(exugear.run_up(model, **options).data)


def test_a_single_process_and_a_short_run_are_serial():
    model, serial = exugear.build(smooth_box()), ThreadPoolExecutor(1)
    assert "seam_error" not in exugear.run_up(model, **RUN | {"duration": 0.05}, executor=serial).data
    assert "seam_error" not in exugear.run_up(model, **RUN | {"duration": 0.01}, executor=Inline()).data


def test_threads_of_a_process_take_turns():
    model, options = exugear.build(smooth_box()), RUN | {"duration": 2.0, "checks": 20}
    serial = exugear.run_up(model, **options).data
    with ThreadPoolExecutor(2) as executor:
        assert_equal(serial, exugear.run_up(model, **options, executor=executor).data)


def test_the_plan_has_the_decay_of_a_damped_oscillator():
    plan = exugear.build(smooth_box()).plan
    damped = 2700 * exugear.build(smooth_box()).meshes[0].mobility / 2
    assert plan.decay == pytest.approx(damped, rel=1e-6)
    assert "early" in str(plan)
    assert exugear.build(smooth_box(damping=0.0)).plan.decay == 0.0


def test_one_bar_shows_the_progress_of_all_parts(capfd, monkeypatch):
    monkeypatch.setattr("fem.support.progress.on_terminal", lambda: True)
    exugear.run_up(exugear.build(smooth_box()), **RUN | {"progress": True}, executor=Inline())
    bars = capfd.readouterr().err
    assert "run " in bars and "1 s" in bars


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        yield executor


@pytest.mark.slow
@pytest.mark.parametrize(("part", "zeta", "duration"), [(None, 0.02, 70.0), (None, 0.08, 20.0), (BEARING, 0.08, 20.0)])
def test_a_run_up_through_the_jump_in_two_processes(part, zeta, duration, processes):
    """Where the motion leaves a branch that ends, the 1e-10 by which parts differ grow exponentially."""
    box = smooth_box(part, damping=None, damping_ratio=zeta)
    model, options = exugear.build(box), RUN | {"speed": (0, 3500 * rpm), "duration": duration}
    serial = exugear.run_up(model, **options).data
    parts = exugear.run_up(model, **options, executor=processes).data
    by_parts, expected = rms(parts, 280), rms(serial, 280)
    jump = int(np.abs(np.diff(np.log(expected))).argmax()) + np.arange(-1, 3)
    error = np.abs(by_parts / expected - 1)
    assert error[jump].max() < 5e-5
    assert np.delete(error, jump).max() < 1e-5


def test_the_solver_ends_segments_on_samples(monkeypatch):
    steps, solve = [], exu.MainSolverImplicitSecondOrder.SolveSystem

    def counted(solver, mbs, settings):
        steps.append(settings.timeIntegration.numberOfSteps)
        return solve(solver, mbs, settings)

    monkeypatch.setattr(exu.MainSolverImplicitSecondOrder, "SolveSystem", counted)
    options = RUN | {"sample": 1e-4, "step": 2e-5, "duration": 0.02, "checks": 0}
    exugear.run_up(exugear.build(smooth_box()), **options)
    assert len(steps) > 1 and sum(steps) == 1000
    assert all(number > 0 and number % 5 == 0 for number in steps[:-1])


def with_damper_of_the_user(model: exugear.Model) -> exugear.Model:
    """A damper of the user on the driven shaft."""
    node = model.mbs.GetObject(model.bodies["slow"])["nodeNumber"]
    model.mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], dampingMatrix=[[1e-3]]))
    model.mbs.Assemble()
    return model


@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        ({"drives": {"fast": exugear.Torque(150.0)}}, "speed of a free train is known only once it has run"),
        ({"drives": {"fast": 10.0}, "stop": [exugear.Apart(0.1)]}, "stop is not known before the run"),
    ],
)
def test_runs_whose_later_states_are_unknown_are_refused(conditions, message):
    model = exugear.build(smooth_box())
    with pytest.raises(ValueError, match=message):
        exugear.run(model, **conditions, loads={"slow": 150.0}, duration=0.1, executor=Inline(), progress=False)


def test_systems_with_items_of_the_user_are_refused():
    with pytest.raises(
        ValueError, match="objects, loads or sensors beside those of the gearbox, which other processes cannot build"
    ):
        exugear.run_up(with_damper_of_the_user(exugear.build(smooth_box())), **RUN, executor=Inline())


@pytest.mark.parametrize("limit", [0.2, 0.7])
def test_a_run_that_leaves_its_map_stops_where_the_serial_one_does(limit):
    shafts = smooth_box().shafts
    stage = exugear.Stage(*shafts, smooth_map((0, 1, 20, 100, 350, 400)), damping=2700.0)
    model = exugear.build(exugear.Gearbox([stage]))
    options = RUN | {"load": lambda t: 150 + 400 * t / limit / 1.5}
    stops = []
    for executor in (None, Inline()):
        with pytest.raises(exugear.RunStopped) as stop:
            exugear.run_up(model, **options, executor=executor)
        stops.append(stop.value)
    serial, parts = stops
    assert str(parts) == str(serial)
    assert parts.run.data["time"].size == serial.run.data["time"].size
    assert parts.run.data["dte"].values == pytest.approx(serial.run.data["dte"].values, rel=1e-6)


def killed(job, part):
    """A process that integrates the second part dies."""
    if part.state is None:
        os.kill(os.getpid(), signal.SIGKILL)
    return part_integration.integrate(job, part)


def test_a_killed_process_stops_the_run_in_words(monkeypatch):
    monkeypatch.setattr("exugear.running.joined_parts.integrate", killed)
    model = exugear.build(smooth_box())
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as executor, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        with pytest.raises(exugear.RunStopped, match=r"has failed or was killed .BrokenProcessPool") as stop:
            exugear.run_up(model, **RUN, executor=executor)
    assert all(np.isfinite(values).all() for values in stop.value.run.data.values())
    assert "end_state" not in stop.value.run.data
    with pytest.raises(RuntimeError, match="take a new executor"):
        exugear.run_up(model, **RUN, executor=executor)
    again = exugear.run_up(model, **RUN | {"duration": 0.05}).data
    assert np.isfinite(again["dte"]).all()


def test_a_system_that_the_user_has_changed_is_refused():
    model = exugear.build(smooth_box())
    model.mbs.SetObjectParameter(model.bodies["slow"], "inertia", 0.05)
    with pytest.raises(ValueError, match=r"mass, stiffness or damping of the system model.mbs were changed"):
        exugear.run_up(model, **RUN, executor=Inline())


class KilledAfterTheRun(Inline):
    """Its processes die once the run is integrated; then it takes no jobs, or returns errors."""

    def __init__(self, takes_jobs: bool):
        super().__init__()
        self.takes_jobs = takes_jobs

    def submit(self, function, *arguments):
        if function is not part_integration.rms_at_half_the_step:
            return super().submit(function, *arguments)
        if not self.takes_jobs:
            raise BrokenProcessPool("killed")
        future: Future = Future()
        future.set_exception(BrokenProcessPool("killed"))
        return future


@pytest.mark.parametrize("takes_jobs", [True, False])
def test_a_run_whose_error_cannot_be_estimated_is_there(takes_jobs):
    model = exugear.build(smooth_box())
    with pytest.warns(UserWarning, match="step_error is NaN; executor: a process .* was killed") as warned:
        data = exugear.run_up(model, **RUN, executor=KilledAfterTheRun(takes_jobs)).data
    assert warned[0].filename == __file__  # the line of the user
    assert np.isnan(data["step_error"]).all()
    assert "stopped" not in data.attrs
    assert np.isfinite(data["dte"]).all()


@pytest.mark.parametrize("executor", [None, Inline()])
def test_ctrl_c_while_errors_are_estimated_keeps_the_whole_run(executor, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    whole = exugear.run_up(exugear.build(smooth_box()), **RUN, checks=0).data
    monkeypatch.setattr("exugear.running.step_error.vibration_at_half_the_step", interrupted)
    monkeypatch.setattr(part_integration, "vibration_at_half_the_step", interrupted)
    with pytest.raises(KeyboardInterrupt) as stop:
        exugear.run_up(exugear.build(smooth_box()), **RUN, executor=executor)
    kept = stop.value.run.data
    assert kept["dte"].values == pytest.approx(whole["dte"].values, rel=1e-6)
    assert {"end_state", "mesh_force"} <= set(kept)
    assert "step_error" not in kept


def test_ctrl_c_keeps_what_is_joined(monkeypatch):
    def interrupted(job, part):
        if part.state is None:
            raise KeyboardInterrupt
        return part_integration.integrate(job, part)

    monkeypatch.setattr("exugear.running.joined_parts.integrate", interrupted)
    with pytest.raises(KeyboardInterrupt) as stop:
        exugear.run_up(exugear.build(smooth_box()), **RUN, executor=Inline())
    assert stop.value.run.data.attrs["stopped"] == "interrupted"
