"""Functions of time and their kernels: torques, speeds and imposed motions; conditions that end a run."""

from math import exp

import numpy as np
import pytest
from numba import njit
from scenes import smooth_box
from scipy.interpolate import PchipInterpolator

import exugear
from exugear import Apart, MotorCurve, Speed, SpeedReached, Torque
from exugear.multibody.addresses import address_of
from exugear.multibody.imposed_motion import spin_of
from exugear.multibody.polynomial_pieces import pieces_record
from exugear.multibody.recorder import BodyRecorder
from exugear.multibody.torque_kernels import torque_kernel, torque_record, torque_slopes
from exugear.operation.piecewise_cubics import tabulated
from exugear.operation.stop_conditions import first_end
from exugear.operation.time_functions import curve_through_function, curve_through_points, speed_function
from exugear.operation.torque_tables import torque_table
from exugear.operation.train_motion import expected_speeds, force_per_torque, reduced_inertia

TURN = np.linspace(0, 2 * np.pi, 721)
#: Imposed speeds.
SPEEDS = {
    "line": speed_function((50.0, 56.0), 2.0),
    "function": curve_through_function(lambda t: 50 + 4 * np.sin(3 * t), 2.0),
    "points": curve_through_points(np.array([[0, 0.3, 1, 2.5], [50, 55, 52, 60]]), 2.0),
}
#: Angle, speed and acceleration of a motion at an address, or of a shaft at 0.1 rad and 0.2 rad/s without one.
imposed = njit(lambda address, t: spin_of(address, t, 0.1, 0.2))


def table(torque: Torque):
    return torque_table(torque, "loads", 1.0, 200.0)


def test_a_tabulated_function_is_kept_within_a_millionth(monkeypatch):
    function = lambda x: np.exp(np.sin(9 * x)) + abs(x - 0.3)  # noqa: E731
    cubic, x = tabulated("f", function, np.linspace(0, 1, 17), 30), np.linspace(0, 1, 10_001)
    assert np.abs(cubic(x) - function(x)).max() < 2e-6 * np.e
    jump = tabulated("f", lambda x: float(x > 0.3), np.linspace(0, 1, 17), 30)
    assert jump(x[x != 0.3]) == pytest.approx((x[x != 0.3] > 0.3).astype(float), abs=1e-9)
    monkeypatch.setattr("exugear.operation.piecewise_cubics.MOST_PIECES", 2**12)
    with pytest.raises(ValueError, match="f is too rough"):
        noise = np.random.default_rng(0)
        tabulated("f", lambda x: noise.random(), np.linspace(0, 1, 17), 30)


@pytest.mark.parametrize(
    ("torque", "state", "expected"),
    [
        (Torque(50.0), (0.5, 0.0, 0.0), 50.0),
        (Torque((10.0, 30.0)), (0.25, 0.0, 0.0), 15.0),
        (Torque(([0.0, 0.5, 2.0], [0.0, 5.0, 20.0])), (0.4, 0.0, 0.0), 4.0),
        (Torque(of_speed=lambda speed: 0.01 * speed * abs(speed)), (0.0, -30.0, 0.0), -9.0),
        (Torque(of_speed=([0.0, 100.0], [0.0, 50.0])), (0.0, 150.0, 0.0), 50.0),
        (MotorCurve([0.0, 100.0, 200.0], [60.0, 60.0, 0.0]).as_torque, (0.0, -10.0, 0.0), 60.0),
        (Torque(of_angle=np.sin), (0.0, 0.0, 20 * np.pi + 0.5), np.sin(0.5)),
        (Torque(of_angle=(TURN, np.cos(TURN))), (0.0, 0.0, -1.0), np.cos(1)),
    ],
)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("sense", [1, -1])
def test_the_kernel_gives_the_torque_of_the_table_about_z(torque, state, expected, direction, sense):
    time, speed, angle = state
    record, _arrays = torque_record(table(torque), direction, sense, [], [])
    values, recorder = table(torque)(time, speed, angle), BodyRecorder(("angle", "speed", "torque"))
    about_z = torque_kernel(6)(
        address_of(record), address_of(recorder.header), time, *np.zeros(5), direction * angle, *np.zeros(5),
        direction * speed,
    )  # fmt: skip
    assert values == pytest.approx(expected, abs=1e-4)
    assert about_z == pytest.approx((0, 0, 0, 0, 0, direction * sense * float(values)))


def test_slopes_of_a_torque_over_the_speed():
    record, _arrays = torque_record(table(Torque(of_speed=lambda speed: 2 + 0.5 * speed)), -1, -1, [], [])
    assert torque_slopes(address_of(record), 0.0, 0.0, 30.0) == pytest.approx((0.0, -0.5))


def test_speeds_from_arrays_have_their_exact_integral():
    curve = speed_function(([0.0, 1.0, 2.0], [0.0, 10.0, 20.0]), 2.0)
    assert [curve(t) for t in (0.5, 1.7)] == pytest.approx([5.0, 17.0])
    assert curve.integral(2.0) == pytest.approx(20.0)
    assert float(curve.slope(0.3)) == pytest.approx(10.0)
    with pytest.raises(ValueError, match="speed: t must reach from 0 to 3 s"):
        speed_function(([0.0, 1.0, 2.0], [0.0, 10.0, 20.0]), 3.0)


def test_measured_speeds_may_begin_before_the_run():
    t = np.array([-1.0, -0.2, 0.3, 1.1, 2.0])
    curve, monotone = speed_function((t, t**3 + 5.0), 1.5), PchipInterpolator(t, t**3 + 5.0)
    times = np.linspace(0.0, 1.5, 31)
    assert curve(times) == pytest.approx(monotone(times), rel=1e-12)
    assert [curve(x) for x in times.tolist()] == pytest.approx(monotone(times), rel=1e-12)
    assert [curve.integral(x) for x in times] == pytest.approx(
        [float(monotone.integrate(0.0, x)) for x in times], abs=1e-12
    )
    assert curve.angle_pieces[0][0] == 0.0


@pytest.mark.parametrize("frequency", [3000.0, 5120.0, 6000.0, 10_240.0])
def test_a_ripple_is_kept_though_it_vanishes_at_evenly_spaced_times(frequency):
    """512 and 1024 intervals of the duration, 1/3 and 1/6 ms: a sine of such a period is 0 at all of them."""
    times, omega = np.linspace(0, 0.1, 4001), 2 * np.pi * frequency
    ripple = lambda t: 150 + 10 * np.sin(omega * t)  # noqa: E731
    speed, torque = speed_function(ripple, 0.1), torque_table(Torque(ripple), "loads", 0.1, 200.0)
    assert np.abs(speed(times) - ripple(times)).max() < 1e-3
    assert np.abs(torque(times, 0.0, 0.0) - ripple(times)).max() < 1e-3
    assert speed.integral(0.03) == pytest.approx(4.5 + 10 * (1 - np.cos(0.03 * omega)) / omega, abs=1e-6)


@pytest.mark.parametrize("order", [192, 384])
def test_a_ripple_over_the_angle_is_kept(order):
    angles = np.linspace(0, 2 * np.pi, 40_001)
    torque = table(Torque(of_angle=lambda angle: 150 + 10 * np.sin(order * angle)))
    assert np.abs(torque(0.0, 0.0, angles) - 150 - 10 * np.sin(order * angles)).max() < 1e-3


def test_a_short_dip_is_kept():
    dip = lambda t: 100 - 20 * exp(-(((t - 28) / 15e-3) ** 2))  # noqa: E731
    assert speed_function(dip, 70.0)(np.linspace(27.9, 28.1, 10_001)).min() == pytest.approx(80, abs=0.1)


def test_a_dip_that_is_too_short_to_be_sampled_is_refused():
    with pytest.raises(ValueError, match=r"speed.t. is too rough: .* leave .* of its largest value; .* pass arrays"):
        speed_function(lambda t: 100 - 20 * max(0.0, 1 - abs(t - 28) / 1e-3), 70.0)


def test_a_ramp_of_two_points_is_no_constant_speed():
    ramp, level = ([0.0, 1.0], [10.0, 20.0]), ([0.0, 1.0], [10.0, 10.0])
    assert not speed_function(ramp, 1.0).constant
    assert speed_function(level, 1.0).constant


def test_the_free_train_moves_as_one_inertia():
    box, times, none = smooth_box(), np.linspace(0.0, 1.0, 11), (np.zeros((0, 11)), np.zeros((0, 11)))
    inertia = float(reduced_inertia(box, box.motions)[0, 0])
    assert inertia == pytest.approx(2 * box.driving.inertia)

    def speeds_under(torque, of_speed, start, ends=()):
        """Speeds of the driving shaft, a torque on it and one that depends on its speed."""
        torques, only = np.zeros((2, 10)), np.array([1.0, 0.0])
        torques[0] = torque
        of_speeds = lambda speeds: only * of_speed(speeds)  # noqa: E731
        return expected_speeds(box, [], none, torques, of_speeds, [start], times, ends)[0]

    speeds = speeds_under(0.0, lambda speeds: -0.02 * speeds, 100.0)
    assert speeds == pytest.approx(100.0 * np.exp(-0.02 / inertia * times), rel=1e-6)
    steep = speeds_under(5.0, lambda speeds: -50.0 * (speeds - 80.0), 0.0)
    assert steep[1:] == pytest.approx(80.1)
    stopped = speeds_under(inertia * 100.0, lambda speeds: 0.0 * speeds, 0.0, [("fast", 35.0)])
    assert stopped == pytest.approx([0.0, 10.0, 20.0, 30.0, 40.0])


def test_a_free_train_takes_half_of_the_torque_to_each_of_two_equal_shafts():
    r_b = smooth_box().stages[0].pair.pinion.r_b
    assert force_per_torque(smooth_box(), ["fast"]) == pytest.approx(np.array([[0.0, 1 / r_b]]))
    assert force_per_torque(smooth_box(), []) == pytest.approx(np.array([[0.5 / r_b, 0.5 / r_b]]))


def test_the_condition_that_holds_first_ends_the_run():
    speeds = {"fast": np.array([0.0, 1.0, 2.0, 3.0, 2.0])}
    forces = {"a-b": np.array([5.0, 0.0, 0.0, 0.0, 5.0])}
    ends = [
        (SpeedReached("fast", 2.5), 3), (SpeedReached("fast", 2.0), 2), (SpeedReached("fast", 4.0), None),
        (Apart(0.2), 3), (Apart(0.1, "a-b"), 2), (Apart(0.3), None),
    ]  # fmt: skip
    for condition, sample in ends:
        end = first_end([condition], speeds, forces, 0.1)
        assert (end and end.sample) == sample
    earlier = SpeedReached("fast", 0.5)
    assert first_end([Apart(0.2), earlier], speeds, forces, 0.1).condition == earlier


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Torque(), "a Torque needs one of value, of_speed, of_angle, got 0"),
        (lambda: Torque(1.0, of_speed=np.sin), "got 2 of them"),
        (lambda: Speed((1.0, 2.0, 3.0)), "value must be a number, .from, to., a function of time or arrays"),
        (lambda: Torque(([0.0, 0.0], [1.0, 2.0])), "the times of value must increase"),
        (lambda: MotorCurve([0.0, 1.0], [1.0]), "torque must have a value for each speed"),
        (lambda: table(Torque(of_angle=([0.0, 3.0], [1.0, 1.0]))), "angles must reach from 0 to 2 pi"),
        (lambda: Apart(0.0), "duration must lie in"),
    ],
)
def test_ends_that_cannot_be_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_ends_are_short_in_print():
    assert repr(Torque(of_speed=np.sin)) == "Torque(of_speed=sin)"
    assert repr(Speed((0.0, 5.0))) == "Speed((0.0, 5.0))"
    assert repr(Speed((np.arange(3000.0), np.ones(3000)))) == "Speed(3000 points)"
    assert repr(exugear.MotorCurve([0, 100], [5, 0])) == "MotorCurve(2 speeds up to 100 rad/s)"


def test_angle_is_the_integral_of_the_speed():
    curve = curve_through_function(lambda t: 100 + 20 * np.sin(30 * t), 2.0)
    times = np.linspace(0, 2, 101)
    exact = 100 * times + 20 / 30 * (1 - np.cos(30 * times))
    assert [curve.integral(t) for t in times] == pytest.approx(exact, abs=1e-6)
    assert speed_function((0, 10), 5.0).integral(5.0) == pytest.approx(25)


def test_curves_know_their_slope():
    curve = curve_through_function(lambda t: 3 + 2 * np.sin(5 * t), 1.0)
    assert float(curve.slope(0.0)) == pytest.approx(10, rel=1e-6) and not curve.constant
    assert curve_through_function(lambda t: 3.0, 1.0).constant
    assert speed_function(3.0, 1.0).constant and not speed_function((3.0, 4.0), 1.0).constant


@pytest.mark.parametrize("name", SPEEDS)
def test_motion_is_that_of_the_function_in_any_order_of_times(name):
    speed_of, times = SPEEDS[name], np.random.default_rng(1).uniform(0, 2, 200)
    motion, _arrays = pieces_record(*speed_of.angle_pieces)
    for t in [*times.tolist(), 0.0, 2.0]:
        expected = speed_of.integral(t), float(speed_of(t)), float(speed_of.slope(t))
        assert imposed(address_of(motion), t) == pytest.approx(expected, rel=1e-12, abs=1e-10)


def test_without_a_motion_the_coordinates_count():
    assert imposed(0, 1.0) == (0.1, 0.2, 0.0)
