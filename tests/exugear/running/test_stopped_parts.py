"""Runs in parts that cannot be finished: refused, stopped at the end of the map, killed, interrupted."""

import os
import signal
import warnings
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

import exudyn.itemInterface as eii
import numpy as np
import pytest
from executors import RUN, Inline
from scenes import smooth_box, smooth_map

import exugear
from exugear.running import joined_parts, part_integration


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
    monkeypatch.setattr(joined_parts, "integrate", killed)
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

    monkeypatch.setattr(joined_parts, "integrate", interrupted)
    with pytest.raises(KeyboardInterrupt) as stop:
        exugear.run_up(exugear.build(smooth_box()), **RUN, executor=Inline())
    assert stop.value.run.data.attrs["stopped"] == "interrupted"
