"""Where runs end, and how they go on from there."""

import numpy as np
import pytest
from driven_trains import box, run, shaft, speed_of
from scenes import smooth_box

import exugear
from exugear import Torque
from fem.units import mm


@pytest.mark.parametrize("free", [False, True])
def test_a_run_of_twice_the_time_is_two_runs(tmp_path, free):
    model = exugear.build(smooth_box())
    drives = {"fast": Torque(100.0)} if free else {"fast": 150.0}
    options = {"drives": drives, "loads": {"slow": 90.0}, "step": 1e-5, "sample": 4e-5, "tolerance": 1e-7}
    start = {"start_speed": 150.0} if free else {}
    whole = run(model, 0.08, **options, **start).data
    first = run(model, 0.04, **options, **start)
    first.save(tmp_path / "first.nc")
    second = run(model, 0.04, **options, initial=exugear.Run.load(tmp_path / "first.nc")).data
    half = second["time"].size - 1
    assert np.abs(second["dte"].values - whole["dte"].values[:, half:]).max() < 1e-5 * np.ptp(whole["dte"].values)
    assert second["end_state"].values[:2] == pytest.approx(whole["end_state"].values[:2], rel=1e-8)


def test_a_run_ends_at_the_first_sample_at_which_a_speed_is_reached(pair):
    stop = [exugear.SpeedReached("slow", 120.0)]
    result = run(pair, 1.0, drives={"fast": Torque(100.0)}, start_speed=100.0, stop=stop)
    speed = speed_of(result, "slow")
    assert (speed[:-1] < 120.0).all() and speed[-1] >= 120.0
    ended_at = result.data["end_state"].sel(derivative="velocities").values[pair.spins["slow"]]
    assert -ended_at == pytest.approx(speed[-1], rel=1e-9)


@pytest.mark.parametrize("with_sensor", [False, True])
def test_a_run_ends_once_teeth_have_been_apart_for_so_long(with_sensor):
    model = exugear.build(smooth_box(backlash=1 * mm))
    if with_sensor:
        exugear.CreateGearSensor(model.mbs, model.meshes[0].contact, storeInternal=True)
        model.mbs.Assemble()
    torque = Torque(lambda t: 50.0 if t < 0.01 else 0.0)
    ends = {"drives": {"fast": torque}, "loads": {"slow": torque}}
    data = run(model, 0.2, **ends, start_speed=10.0, stop=[exugear.Apart(2e-3)]).data
    interval = data["time"].values[1]
    apart = data["mesh_force"].values[0] == 0
    length = np.flatnonzero(~apart[::-1])[0]
    assert (length - 1) * interval == pytest.approx(2e-3, abs=interval)
    assert data.attrs["stopped_by"] == "teeth of a stage out of contact for 0.002 s"


def test_a_run_goes_on_only_where_it_fits(pair):
    first = run(pair, drives={"fast": 100.0}, loads={"slow": 100.0})
    with pytest.raises(ValueError, match=r"ends with shaft 'fast' at 100 rad/s, the imposed speed starts at 50"):
        run(pair, drives={"fast": 50.0}, initial=first)
    three = exugear.build(box(shaft("fast"), shaft("slow"), shaft("last")))
    with pytest.raises(ValueError, match="initial is a run of"):
        run(three, drives={"fast": 100.0}, initial=first)
    first.data.attrs["fast-slow_pinion_z"] = 23
    with pytest.raises(ValueError, match=r"initial is a run with a, z = .0.15, 23, 57. in 'fast-slow', the model has"):
        run(pair, drives={"fast": 100.0}, initial=first)
