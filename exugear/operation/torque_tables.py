"""Torques as tables over time, speed or angle, for the compiled kernels and for arrays of times."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, pi
from typing import ClassVar

import numpy as np

from exugear.operation.piecewise_cubics import PiecewiseCubic, constant, tabulated, through_points
from exugear.operation.shaft_ends import Torque
from exugear.operation.time_functions import check_covered, line
from fem.support.validation import finite, numbers, require

#: What a torque depends on, as the kernels count it.
TIME, SPEED, ANGLE = 0, 1, 2
#: Intervals of a table before they are halved: of time [s] and at most in number, of the speed range and of a turn.
TIME_INTERVAL, MOST_TIME_INTERVALS, SPEED_INTERVALS, ANGLE_INTERVALS = 1e-3, 2**16, 64, 64
#: Halvings of an interval: a jump over time is passed within 1e-12 s, over speed within 1e-6 of the range.
TIME_HALVINGS, SPEED_HALVINGS = 30, 14
#: Difference of the torques at 0 and 2 pi over the largest that counts as rounding.
PERIODIC = 1e-6


@dataclass(frozen=True)
class TorqueTable:
    """A torque [N m] over time, over the speed or over the angle of its shaft.

    variable   TIME, SPEED or ANGLE
    cubic      its values; those over the angle cover [0, 2 pi]
    """

    variable: int
    cubic: PiecewiseCubic
    #: As of a `Torque` that needs no range of speeds to be tabulated.
    of_speed: ClassVar[None] = None

    @property
    def constant(self) -> bool:
        """Whether the torque never changes."""
        return self.cubic.constant

    @property
    def largest(self) -> float:
        """Largest magnitude of the torque at the knots [N m]."""
        return float(np.abs(self.cubic(self.cubic.knots)).max())

    def __call__(self, t, speed, angle):
        """The torque at times [s], speeds [rad/s] and angles [rad]."""
        return self.cubic((t, speed, np.mod(angle, 2 * pi))[self.variable])


NO_TORQUE = TorqueTable(TIME, constant(0.0))


def torque_of_speed(torque: Torque, where: str) -> Callable[[float], float]:
    """A torque over the speed as a function, before it is tabulated; where: name of the argument, in messages."""
    function = torque.of_speed
    if callable(function):
        return lambda speed: finite(f"{where}(speed)", function(speed))
    table = through_points(*numbers(where, function))
    return lambda speed: float(table(speed))


def torque_table(torque: Torque | TorqueTable, where: str, duration: float, highest_speed: float) -> TorqueTable:
    """The table of a torque.

    where           name of the argument, in messages
    duration        of the run [s]
    highest_speed   up to which a function of the speed is tabulated [rad/s]; beyond it is extrapolated
    """
    if isinstance(torque, TorqueTable):
        return torque
    if torque.of_speed is not None:
        return TorqueTable(SPEED, _over_speed(f"{where}(speed)", torque.of_speed, highest_speed))
    if torque.of_angle is not None:
        return TorqueTable(ANGLE, _over_angle(f"{where}(angle)", torque.of_angle))
    return TorqueTable(TIME, _over_time(where, torque.value, duration))


def _over_time(where: str, value, duration: float) -> PiecewiseCubic:
    if callable(value):
        intervals = min(max(ceil(duration / TIME_INTERVAL), 16), MOST_TIME_INTERVALS)
        return tabulated(f"{where}(t)", value, np.linspace(0.0, duration, intervals + 1), TIME_HALVINGS)
    values = numbers(where, value)
    if values.ndim == 2:
        check_covered(where, values[0], duration)
        return through_points(*values)
    return line(where, values, duration)


def _over_speed(where: str, value, highest: float) -> PiecewiseCubic:
    """Tabulated from the standstill in either sense, where drag has a corner."""
    if not callable(value):
        return through_points(*numbers(where, value))
    return tabulated(where, value, np.linspace(-highest, highest, 2 * SPEED_INTERVALS + 1), SPEED_HALVINGS)


def _over_angle(where: str, value) -> PiecewiseCubic:
    if not callable(value):
        angle, torque = numbers(where, value)
        whole = bool(np.abs(angle[[0, -1]] - [0, 2 * pi]).max() < 1e-6)
        require(whole, f"{where}: angles must reach from 0 to 2 pi, got {angle[0]:g} to {angle[-1]:g} rad")
        table = through_points(angle, torque)
    else:
        table = tabulated(where, value, np.linspace(0, 2 * pi, ANGLE_INTERVALS + 1), SPEED_HALVINGS)
    start, end = table(np.array([0.0, 2 * pi * (1 - 1e-15)]))
    largest = np.abs(table.coefficients[:, 0]).max()
    repeats = f"{where}: the torque must be the same at 0 and at 2 pi, got {start:g} and {end:g} N m"
    require(bool(abs(end - start) <= PERIODIC * largest), repeats)
    return table
