"""Runs that stop: their data and messages; laws that are extrapolated beyond the map."""

import _thread
import os
import subprocess
import sys
from pathlib import Path

import exudyn.itemInterface as eii
import numpy as np
import pytest
from exudyn.itemInterface import LoadCoordinate
from paper_gears import paper_pair
from scenes import smooth_box, smooth_map

import exugear
from exugear import MeshForce
from fem.units import mm, rpm, um

ROOT = Path(__file__).parents[3]
SMALL = (0, 1, 20, 100, 350, 400)
R_B = paper_pair().pinion.r_b
RUN = {"speed": (0, 3000 * rpm), "duration": 1.0, "load": 350.0, "progress": False}


def box_of(mesh, **stage) -> exugear.Gearbox:
    shafts = smooth_box().shafts
    return exugear.Gearbox([exugear.Stage(*shafts, mesh, **stage)])


@pytest.fixture(scope="module")
def stopped() -> exugear.RunStopped:
    with pytest.raises(exugear.RunStopped) as caught:
        exugear.run_up(exugear.build(box_of(smooth_map(SMALL), damping=500.0)), **RUN)
    return caught.value


def test_a_run_that_leaves_its_map_keeps_its_data(stopped, tmp_path):
    data = exugear.run_up(exugear.build(box_of(smooth_map(), damping=500.0)), **RUN).data
    until = stopped.run.data
    assert 1000 < until["time"].size < data["time"].size
    assert until["dte"].values == pytest.approx(data["dte"].values[:, : until["time"].size], abs=0.05 * um)
    end = float(until["time"][-1])
    assert f"at t = {end + stopped.run.step:.5g}" in str(stopped)
    assert until.attrs["stopped"] == str(stopped)
    assert stopped.run.save(tmp_path / "run.nc").exists()


def test_the_message_names_the_torque_to_map(stopped):
    assert "the map ends at a pinion torque of 400 N m, 40" in str(stopped)
    assert "extend the map to a larger torque, 610 N m" in str(stopped)
    wide = exugear.build(box_of(smooth_map((*SMALL, 610)), damping=500.0))
    until = 1.5 * float(stopped.run.data["time"][-1])
    further = exugear.run_up(wide, **RUN | {"duration": until, "speed": (0, 3000 * rpm * until)})
    assert np.isfinite(further.data["dte"]).all()
    words = r"stage fast-slow the map ends .* of 400 N m, 500 N m are needed; .* 750 N m"
    with pytest.raises(exugear.RunStopped, match=words) as caught:
        exugear.run_up(exugear.build(box_of(smooth_map(SMALL))), **RUN | {"load": 500.0, "speed": 100 * rpm})
    assert caught.value.run.data.sizes["time"] == 0
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("top", [350.0, 123.456])
@pytest.mark.parametrize("bearing", [None, exugear.Bearing(5e8, 3e8, 2e5, 1e-6)])
def test_a_load_equal_to_the_largest_torque_of_the_map_works_at_every_door(top, bearing):
    stage = exugear.Stage(*smooth_box(bearing).shafts, smooth_map((0, 1, 20, 100, top)), damping=2700.0)
    model = exugear.build(exugear.Gearbox([stage]))
    loads = [top, 1.1 * top]
    doors = (
        lambda load: exugear.modes(model, load=load)["frequency"].values,
        lambda load: exugear.modes(model, load=load, phase=0.3)["frequency"].values,
        lambda load: exugear.eigenfrequencies(model, load=load),
        lambda load: exugear.campbell(model, speed=(0.0, 9.0), load=load)["frequency"].values,
        lambda load: exugear.run_up(model, speed=1.0, load=load, duration=1e-3, progress=False).data["dte"].values,
    )
    for door in doors:
        assert np.isfinite(door(loads[0])).all()
        with pytest.raises(ValueError, match="extend the map to a larger torque"):
            door(loads[1])


def test_the_message_names_the_offsets_to_map():
    """A line to paste: an axis 1.5 times as wide as the offset reached, with 0 and the mapped range in it."""
    force = np.broadcast_to([0.0, 1e4], (3, 3, 2))
    offsets = {"misalignment": np.array([-2e-4, 0, 2e-4])}
    law = MeshForce([0, 0.3, 0.6], [0, 30 * um], force, offsets=offsets)
    line = r"extend the axis: fem.Offsets\(misalignment=\(-0.0002, -0.0001, 0, 0.000225, 0.00045\)\)"
    with pytest.raises(ValueError, match=line):
        law(0.1, 10 * um, misalignment=3e-4)


def test_a_failing_function_of_the_user_is_named():
    model = exugear.build(smooth_box())
    node = model.mbs.GetObject(model.bodies["slow"])["nodeNumber"]

    def torque(mbs, t, item, q, q_t):
        return [0.0 if t < 0.05 else 1 / 0]

    model.mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], forceUserFunction=torque))
    model.mbs.Assemble()
    words = r"at t = 0.05\d* s .* user function .* failed, ZeroDivisionError"
    with pytest.raises(exugear.RunStopped, match=words) as caught:
        exugear.run_up(model, **RUN)
    assert caught.value.run.data["time"].values[-1] == pytest.approx(0.05, abs=1e-4)


def test_bearings_that_yield_until_the_teeth_part_stop_the_run():
    """Under a growing load, until the gears are too far apart."""
    soft = exugear.Bearing(radial=2e6, axial=1e7, tilt=1e5, damping_time=1e-4)
    model = exugear.build(smooth_box(soft, damping=27000.0))
    load = lambda t: 20 + 1500 * t  # noqa: E731
    with pytest.raises(exugear.RunStopped, match="bearings of fast-slow yield to a centre distance of 15") as caught:
        exugear.run_up(model, speed=10.0, duration=0.5, load=load, progress=False)
    a = caught.value.run.data["centre_distance"].values
    assert 150 * mm < a.max() < 160 * mm
    assert 0 < caught.value.run.data["time"].values[-1] < 0.5


@pytest.mark.usefixtures("listening_to_ctrl_c")
def test_ctrl_c_keeps_the_data():
    def load(mbs, t, load) -> float:
        if t > 0.05:
            _thread.interrupt_main()
        return load

    model = exugear.build(smooth_box())
    marker = model.end_markers[model.gearbox.driven.name]
    model.mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0, loadUserFunction=load))
    model.mbs.Assemble()
    with pytest.raises(KeyboardInterrupt) as caught:
        exugear.run_up(model, **RUN)
    data = caught.value.run.data
    assert data.attrs["stopped"] == "interrupted"
    assert data["time"].values[-1] == pytest.approx(0.05, abs=1e-4)
    assert np.isfinite(data["dte"].values).all()


SCRIPT = """
from scenes import *
stage = exugear.Stage(*smooth_box().shafts, smooth_map((0, 1, 20, 100, 350, 400)), damping=500.0)
exugear.run_up(exugear.build(exugear.Gearbox([stage])), speed=(0, 300.0), duration=1.0, load=350.0)
"""


def test_messages_of_exudyn_are_not_printed():
    paths = [str(ROOT), str(ROOT / "tests" / "cases")]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=surroundings, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, "")
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("exugear.running.run.RunStopped: at t = ") and last.endswith("N m or more")
    assert done.stderr.count("Traceback") == 1
    assert not any(word in done.stderr for word in ("USER FUNCTION", "exception", "SolveSteps(", "ModelError"))


def test_a_run_reports_how_long_and_how_far_it_was_beyond_its_map():
    """Against the same run on a larger map, whose stiffness hardly changes there."""
    law = MeshForce.from_ste(smooth_map(SMALL), extend=4.0, damping=1500.0)
    options = RUN | {"speed": (1000 * rpm, 1100 * rpm), "duration": 0.1}
    data = exugear.run_up(exugear.build(box_of(law, pair=paper_pair())), **options).data.isel(stage=0)
    whole = exugear.run_up(exugear.build(box_of(smooth_map(), damping=1500.0)), **options).data.isel(stage=0)
    force = whole["mesh_force"].values * R_B / 400
    assert data["beyond_map_force"] == pytest.approx(force.max(), rel=0.02)
    assert data["beyond_map_force"] > 1.2
    assert data["beyond_map_time"] == pytest.approx((force > 1).mean() * 0.1, rel=0.05)
    assert "beyond_map_time" not in whole


@pytest.mark.parametrize("extend", [0.5, 11, np.nan])
def test_extensions_out_of_range_are_refused(extend):
    with pytest.raises(ValueError, match="extend must lie in"):
        MeshForce.from_ste(smooth_map(), extend=extend)


@pytest.mark.parametrize("progress", [True, False])
def test_sensors_keep_all_their_samples_and_the_step_error_stands(progress):
    """By default one sample at every step, with and without progress bar."""
    model = exugear.build(smooth_box())
    sensor = model.mbs.CreateGearSensor(model.meshes[0].contact, storeInternal=True)
    model.mbs.Assemble()
    options = {"speed": (0, 300 * rpm), "duration": 0.2, "load": 350.0, "progress": progress}
    data = exugear.run_up(model, **options).data
    stored = model.mbs.GetSensorStoredData(sensor)
    assert stored[:, 0] == pytest.approx(data["time"].values, abs=1e-12)
    assert stored[:, 1] == pytest.approx(data["dte"].values[0], rel=1e-12)
    assert 1 < data["step_error"].size <= 3
    exugear.run_up(model, **options, sensor_period=2e-3)
    steps = np.diff(model.mbs.GetSensorStoredData(sensor)[:-1, 0])
    assert steps == pytest.approx(np.full(steps.size, 2e-3), rel=0.02)


def test_the_progress_bar_does_not_change_the_run():
    with_bar, without_bar = (
        exugear.run_up(exugear.build(smooth_box()), **RUN | {"progress": p}).data for p in (True, False)
    )
    assert with_bar.identical(without_bar)
