"""Runs under drives and loads on any shaft: motions, forces and torques that are known by hand."""

from dataclasses import replace

import numpy as np
import pytest
from driven_trains import R, box, law, run, shaft
from scenes import INERTIA, K, paper_pair, smooth_box
from scipy.integrate import simpson

import exugear
from exugear import MotorCurve, Speed, Torque
from fem.units import deg, um

COUPLING = exugear.Coupling(torsion=2e4, damping=5.0, inertia=0.02)
BEARING = exugear.Bearing(radial=5e8, axial=3e8, tilt=2e5, damping_time=1e-5)


@pytest.mark.parametrize(
    ("fast", "slow", "inertia"),
    [((), (), 2 * INERTIA), ((COUPLING,), (), 2 * INERTIA + 0.02), ((BEARING,), (BEARING,), 2 * INERTIA)],
    ids=["spin", "coupling", "bearings"],
)
def test_a_torque_drive_accelerates_the_inertias_from_rest(fast, slow, inertia):
    model = exugear.build(box(shaft("fast", INERTIA, *fast), shaft("slow", INERTIA, *slow)))
    data = run(model, drives={"fast": Torque(100.0)}, loads={"slow": 40.0}).data
    momentum = INERTIA * (data["shaft_speed"].sel(shaft=["fast", "slow"]).sum("shaft")).values
    if fast == (COUPLING,):
        momentum += 0.02 * data["rotor_speed"].sel(rotor="fast rotor").values
    assert momentum == pytest.approx(60.0 * data["time"].values, abs=1e-6)
    steady = (40.0 + INERTIA * 60.0 / inertia) / R
    assert data["mesh_force"].values[0] == pytest.approx(steady, rel=2e-3)
    assert data["drive_torque"].values == pytest.approx(100.0)
    assert data["load_torque"].values == pytest.approx(40.0)


def test_a_free_coast_down_under_viscous_drag_is_exponential(pair):
    data = run(pair, 0.4, loads={"slow": Torque(of_speed=lambda speed: 0.05 * speed)}, start_speed=100.0).data
    decay = 100.0 * np.exp(-0.05 / (2 * INERTIA) * data["time"].values)
    assert data["speed"].values == pytest.approx(decay, rel=1e-4)
    assert data["load_torque"].values[0] == pytest.approx(0.05 * decay, rel=1e-4)
    assert data["mesh_frequency"].values[0] == pytest.approx(57 * decay / (2 * np.pi), rel=1e-4)


def test_a_coast_down_by_constant_drag_ends_at_rest(pair):
    stop = [exugear.SpeedReached("fast", 0.0)]
    result = run(pair, 1.0, loads={"slow": 10.0}, start_speed=100.0, stop=stop)
    assert result.data["time"].values[-1] == pytest.approx(100.0 * 2 * INERTIA / 10.0, rel=1e-3)
    assert "speed 0 rad/s of shaft 'fast'" in result.data.attrs["stopped_by"]


def test_a_motor_reaches_the_speed_at_which_its_curve_meets_the_load(pair):
    motor = MotorCurve([0.0, 90.0, 110.0], [60.0, 60.0, -60.0])
    data = run(pair, 0.5, drives={"fast": motor}, loads={"slow": Torque(of_speed=([0.0, 200.0], [0.0, 60.0]))}).data
    stationary = data["speed"].values[-1]
    torque = data["drive_torque"].values[0, -1]
    assert torque == pytest.approx(0.3 * stationary, rel=1e-3)
    assert 90 < stationary < 100 and 0 < torque < 60


@pytest.mark.parametrize("end", ["drives", "loads"])
def test_a_torque_ripple_shows_in_the_dte_as_the_transfer_function_says(pair, end):
    """y'' + 2 zeta w y' + w^2 y = r / J torque, of two free inertias."""
    natural = (2 * K * R**2 / INERTIA) ** 0.5
    frequency, ripple = 0.7 * natural, 20.0
    torques = {"drives": {"fast": Torque(100.0)}, "loads": {"slow": Torque(100.0)}}
    torques[end] = dict.fromkeys(torques[end], Torque(lambda t: 100.0 + ripple * np.sin(frequency * t)))
    data = run(pair, 0.05, **torques, start_speed=100.0, tolerance=1e-4).data
    settled = data["time"].values > 0.03
    time, dte = data["time"].values[settled], data["dte"].values[0][settled]
    waves = np.stack([np.ones_like(time), np.cos(frequency * time), np.sin(frequency * time)], axis=1)
    _, cosine, sine = np.linalg.lstsq(waves, dte)[0]
    response = R / INERTIA * ripple / (natural**2 - frequency**2 + 2j * 0.05 * natural * frequency)
    assert np.hypot(cosine, sine) == pytest.approx(abs(response), rel=2e-3)


def test_two_outputs_share_the_torque_of_the_drive():
    """The middle shaft drives two shafts, each with its own load."""
    middle = shaft("middle")
    stages = [
        exugear.Stage(middle, shaft(name), law(), pair=paper_pair(), angle=angle)
        for name, angle in (("left", 180 * deg), ("right", 0.0))
    ]
    model = exugear.build(exugear.Gearbox(stages))
    data = run(model, drives={"middle": 100.0}, loads={"left": 30.0, "right": 70.0}).data
    assert data["mesh_force"].mean("time").values == pytest.approx(np.array([30.0, 70.0]) / R, rel=1e-3)
    assert float(data["drive_torque"].mean()) == pytest.approx(100.0, rel=1e-3)
    assert data["load_end"].values.tolist() == ["left", "right"]


def test_recirculating_torque_loads_the_mesh_at_zero_net_power(pair):
    """Two machines against each other: all power that the drive puts in comes out at the load, the speed stays."""
    data = run(pair, drives={"fast": Torque(200.0)}, loads={"slow": Torque(200.0)}, start_speed=150.0).data
    assert data["speed"].values == pytest.approx(150.0, rel=1e-4)
    assert data["mesh_force"].values == pytest.approx(200.0 / R, rel=1e-3)


def test_a_speed_imposed_on_the_load_end_gives_the_drive_its_torque(pair):
    """The torque-controlled motor drives a brake that holds the speed."""
    data = run(pair, drives={"fast": Torque(150.0)}, loads={"slow": Speed((100.0, 120.0))}).data
    assert data["speed"].values == pytest.approx(100.0 + 400.0 * data["time"].values, rel=1e-6)
    assert float(data["load_torque"].mean()) == pytest.approx(150.0 - 2 * INERTIA * 400.0, rel=1e-3)


def test_an_imposed_speed_takes_the_load_and_the_inertia_torques(pair):
    data = exugear.run_up(pair, speed=(0.0, 50.0), load=100.0, duration=0.05, progress=False).data
    assert data["drive_torque"].values == pytest.approx(100.0 + 2 * INERTIA * 1000.0, rel=1e-2)
    assert data["load_torque"].values == pytest.approx(100.0)
    assert (str(data["drive_end"].values), str(data["load_end"].values)) == ("fast", "slow")


def test_a_drive_turns_its_rotor_by_the_torque_of_the_coupling():
    """At constant speed the mean torque is that of the load; the rotor itself is held."""
    model = exugear.build(box(shaft("fast", INERTIA, COUPLING), shaft("slow")))
    data = exugear.run_up(model, speed=100.0, load=50.0, duration=0.1, progress=False).data
    assert float(data["drive_torque"].mean()) == pytest.approx(50.0, rel=1e-3)
    ramp = exugear.run_up(model, speed=(100.0, 200.0), load=50.0, duration=0.1, progress=False).data
    assert float(ramp["drive_torque"].mean()) == pytest.approx(50.0 + (2 * INERTIA + 0.02) * 1000.0, rel=1e-2)


def test_run_and_run_up_are_the_same(pair):
    conditions = {"duration": 0.05, "progress": False}
    short = exugear.run_up(pair, speed=(0.0, 50.0), load=(0.0, 100.0), **conditions).data
    long = exugear.run(pair, drives={"fast": (0.0, 50.0)}, loads={"slow": Torque((0.0, 100.0))}, **conditions).data
    assert np.array_equal(short["dte"], long["dte"])


def test_tables_over_time_are_the_function(pair):
    """A step of the load, called by `run_up` and tabulated by `run`."""
    load = lambda t: 50.0 if t < 0.01 else 150.0 + 30.0 * np.sin(500.0 * t)  # noqa: E731
    called = exugear.run_up(pair, speed=100.0, load=load, duration=0.03, progress=False).data
    tabulated = run(pair, 0.03, drives={"fast": 100.0}, loads={"slow": load}).data
    assert np.abs(called["dte"] - tabulated["dte"]).max() < 1e-5 * np.ptp(called["dte"].values)
    times = np.linspace(0.0, 0.03, 301)
    arrays = run(pair, 0.03, drives={"fast": (times, 100.0 + 0 * times)}, loads={"slow": (times, 100.0 + 0 * times)})
    plain = run(pair, 0.03, drives={"fast": 100.0}, loads={"slow": 100.0})
    assert arrays.data["dte"].values == pytest.approx(plain.data["dte"].values, abs=1e-12)
    ramp = (times, 50.0 + 1000.0 * times), (times, 100.0 + 500.0 * times)
    given = exugear.run_up(pair, speed=ramp[0], load=ramp[1], duration=0.03, progress=False).data
    ends = exugear.run_up(pair, speed=(50.0, 80.0), load=(100.0, 115.0), duration=0.03, progress=False).data
    assert given["dte"].values == pytest.approx(ends["dte"].values, abs=1e-12)


def test_a_torque_over_the_angle_recurs_in_each_revolution(pair):
    speed = 200.0
    ripple = Torque(of_angle=lambda angle: 100.0 + 20.0 * np.cos(3 * angle))
    data = run(pair, 0.1, drives={"fast": speed}, loads={"slow": ripple}).data
    expected = 100.0 + 20.0 * np.cos(3 * speed * data["time"].values)
    assert data["load_torque"].values[0] == pytest.approx(expected, abs=1e-2)


def test_free_trains_are_integrated_in_fourth_order():
    """The damping takes the velocities without their lag, by the forces that the torques would hold."""
    model = exugear.build(smooth_box(damping=6000.0))
    ends = {"drives": {"fast": Torque(150.0)}, "loads": {"slow": Torque(150.0)}, "start_speed": 150.0}
    steps = (1e-6, 1e-5, 2e-5)
    exact, fine, coarse = (run(model, 0.02, **ends, step=h, tolerance=1e-8).data["dte"].values for h in steps)
    assert np.std(coarse - exact) > 12 * np.std(fine - exact)


def test_the_work_of_drive_and_load_is_stored_or_dissipated():
    """Torque ripple against viscous drag: the work of both torques closes to 1e-6 of the drive's."""
    model = exugear.build(smooth_box(damping=6000.0))
    drive = Torque(lambda t: 150.0 + 50.0 * np.sin(3000.0 * t))
    ends = {"drives": {"fast": drive}, "loads": {"slow": Torque(of_speed=lambda speed: speed)}, "start_speed": 150.0}
    data = run(model, 0.03, **ends, step=5e-6, sample=5e-6, tolerance=1e-7).data
    power, speeds = model.meshes[0].recorder.power, data["shaft_speed"].values
    supplied, taken = data["drive_torque"].values[0] * speeds[0], data["load_torque"].values[0] * speeds[1]
    inertias = np.array([[shaft.inertia] for shaft in model.gearbox.shafts])
    stored = power["energy"] + (inertias * speeds**2).sum(axis=0) / 2
    work, drive_work = (simpson(x, x=data["time"].values) for x in (supplied - taken - power["dissipation"], supplied))
    assert abs(work - (stored[-1] - stored[0])) < 1e-6 * drive_work


@pytest.mark.parametrize("free", [True, False])
@pytest.mark.parametrize("parts", [(), (BEARING,), (COUPLING,)], ids=["spin", "bearings", "coupling"])
def test_drag_takes_part_in_the_equilibrium_at_the_start(parts, free):
    """Half of the drag of the slow shaft is that of its own inertia where both inertias are free."""
    model = exugear.build(box(shaft("fast"), shaft("slow", INERTIA, exugear.Drag(30.0), *parts)))
    ends = {"start_speed": 200.0} if free else {"drives": {"fast": 200.0}}
    force = run(model, 0.01, **ends).data["mesh_force"].values[0, 0]
    inertia = INERTIA / sum(each.turning_inertia for each in model.gearbox.shafts)
    assert force == pytest.approx(30.0 * (inertia if free else 1.0) / R, rel=2e-3)


def test_a_drive_that_only_drag_brakes_reaches_its_speed():
    """The speed to expect counts the drag: without it 100 N m would reach more than 1e5 rad/s in this time."""
    model = exugear.build(box(shaft("fast"), shaft("slow", INERTIA, exugear.Drag(viscous=1.0))))
    data = run(model, 20.0, drives={"fast": Torque(100.0)}, stop=[exugear.SpeedReached("fast", 99.0)]).data
    rest = -2 * INERTIA * np.log(0.01)
    assert data["time"].values[-1] == pytest.approx(rest, rel=1e-3)


def test_what_is_left_free_carries_nothing(pair):
    """Without drives and loads the train spins on at its speed, the teeth just touch."""
    data = run(pair, start_speed=100.0).data
    assert data["speed"].values == pytest.approx(100.0, rel=1e-9)
    assert np.abs(data["mesh_force"].values).max() < 1e-3


def test_a_system_is_left_as_it_was_built(pair):
    before = [pair.mbs.systemData.NumberOfObjects(), pair.mbs.systemData.NumberOfLoads()]
    run(pair, drives={"fast": Torque(lambda t: 100.0 + t)}, loads={"slow": Torque(of_speed=lambda speed: speed)})
    assert [pair.mbs.systemData.NumberOfObjects(), pair.mbs.systemData.NumberOfLoads()] == before


@pytest.mark.parametrize("held", [True, False])
def test_the_dte_after_a_hundred_thousand_revolutions_is_that_of_the_first(pair, held):
    """Angles are doubles: rounding of 6e5 rad, amplified by the mesh, moves the DTE by less than 1 nm."""
    model = exugear.build(smooth_box())
    options = {"loads": {"slow": 100.0}, "drives": {"fast": 100.0 if held else Torque(100.0)}, "step": 2e-5}
    first = run(model, **options, **({} if held else {"start_speed": 100.0}))
    shifted = first.data.copy(deep=True)
    shifted["end_state"].values[0] += 2e5 * np.pi * np.array([1, -1])
    early, late = (run(model, **options, initial=start).data for start in (first, replace(first, data=shifted)))
    assert np.abs(early["dte"] - late["dte"]).max() < 1e-3 * um


def test_the_angle_of_a_long_run_does_not_drift(pair):
    """Rounding of 3e6 steps at 1e5 revolutions turns the driving shaft by 6e-5 rad; segments take it back."""
    first = run(pair, drives={"fast": 100.0}, loads={"slow": 100.0})
    shifted = first.data.copy(deep=True)
    shifted["end_state"].values[0] += 2e5 * np.pi * np.array([1, -1])
    start = {"initial": replace(first, data=shifted), "drives": {"fast": 100.0}, "loads": {"slow": 100.0}}
    data = run(pair, 5.0, **start).data
    before, after = (x["end_state"].values[0, pair.spins["fast"]] for x in (shifted, data))
    assert after - before == pytest.approx(100.0 * data["time"].values[-1], abs=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"drives": {"motor": 1.0}}, r"drives: no shafts \['motor'\]; the shafts are \['fast', 'slow'\]"),
        ({"drives": {"fast": 1.0}, "loads": {"fast": 1.0}}, r"shafts \['fast'\] stand in both"),
        ({"drives": {"fast": 1.0}, "loads": {"slow": Speed(2.0)}}, "speeds are imposed on .* ratios .* impose one"),
        ({"drives": {"fast": 1.0}, "start_speed": 2.0}, "start_speed 2.0 stands beside the imposed speed of 'fast'"),
        ({"drives": {"fast": "quick"}}, r"drives\['fast'\] must be a Speed.*got 'quick'"),
        ({"loads": {"slow": Torque(lambda t: np.nan)}}, r"loads\['slow'\]\(t\) must be finite, got nan"),
        ({"loads": {"slow": ([0.0, 0.01], [1.0, 1.0])}}, r"loads\['slow'\]: t must reach from 0 to 0.05 s"),
        ({"loads": {"slow": Torque(of_angle=lambda angle: angle)}}, "the same at 0 and at 2 pi"),
        ({"drives": {"fast": Torque(1e6)}, "duration": 5.0}, "reaches 9.55e.05 rpm after t = .*stop at SpeedReached"),
        ({"stop": [exugear.SpeedReached("motor", 1.0)]}, "stop: no shaft 'motor'"),
        ({"stop": [exugear.Apart(0.1, "a-b")]}, "stop: no stage 'a-b'"),
    ],
)
def test_drives_and_loads_that_cannot_be_are_refused(pair, options, message):
    with pytest.raises(ValueError, match=message):
        run(pair, **{"drives": {}, "loads": {}} | options)
