"""Operating conditions of a run: what acts on each shaft, resolved for a gearbox, and the speeds to expect."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.operation.shaft_ends import MotorCurve, Speed, Torque, recorded, recorded_torque
from exugear.operation.stop_conditions import SpeedReached, StopCondition, check_stop
from exugear.operation.time_functions import TimeFunction, check_time_function, speed_function
from exugear.operation.torque_tables import ANGLE, TorqueTable, torque_of_speed, torque_table
from exugear.operation.train_motion import HIGHEST_SPEED, drag_torques, expected_speeds, reduced_inertia
from fem.support.validation import require, require_finite, require_within, text_of
from fem.units import rpm

#: Number of instants at which the speed of a run is evaluated for its range.
INSTANTS = 1001
#: Longest duration of a run [s].
LONGEST = 1e5
#: Range of speeds over the expected one for which a torque over the speed is tabulated, and the least range [rad/s].
SPEED_MARGIN, LEAST_RANGE = 2.0, 1.0


@dataclass(frozen=True, eq=False)
class ShaftEnd:
    """A torque on the end of a shaft, or on a rotor behind it.

    name      of the shaft or rotor, as the user gave it
    shaft     its name, or that of the shaft of the rotor
    body      name of the body on which the torque acts: of a shaft, `Shaft.end`
    sense     +1: acts with the motion at positive speed (drive), -1: against it (load)
    torque    what the user gave, for messages and attributes, or its table
    role      name of the argument that holds the end, for messages
    """

    name: str
    shaft: str
    body: str
    sense: int
    torque: Torque | TorqueTable
    role: str = ""


def end_of(gearbox: Gearbox, name: str, sense: int, torque: Torque, role: str = "") -> ShaftEnd:
    """A torque on a shaft or rotor by its name."""
    shaft = gearbox.ends[name]
    return ShaftEnd(name, shaft.name, shaft.end if name == shaft.name else name, sense, torque, role)


@dataclass(frozen=True, eq=False)
class Conditions:
    """Operating conditions of a run.

    gearbox       whose shafts turn
    duration      [s]
    held          name of the shaft whose speed is imposed, None where all shafts are free
    speed         imposed on it, in its sense of motion; None without
    held_sense    +1 where the imposed speed is that of a drive, -1 where it is that of a load
    ends          torques on the ends of shafts
    start_speed   of the driving shaft where all shafts are free [rad/s]
    start_angle   of the held shaft, in its sense of motion [rad]
    start_time    at which the integration starts [s]; later than 0 for a part of a run under an imposed speed
    stop          conditions that end the run
    run_up        speed and load as given to `exugear.run_up`, for the attributes of the run
    power         whether the run records where its power goes
    displacement  whether its data hold the displacements of the shafts at their bearings

    Raises ValueError for a duration out of range, and for speeds and torques that are not finite.
    """

    gearbox: Gearbox
    duration: float
    held: str | None
    speed: Any
    ends: tuple[ShaftEnd, ...]
    start_speed: float = 0.0
    start_angle: float = 0.0
    start_time: float = 0.0
    stop: tuple[StopCondition, ...] = ()
    held_sense: int = 1
    run_up: tuple[TimeFunction, TimeFunction] | None = None
    power: bool = False
    displacement: bool = False

    def __post_init__(self):
        require_within("duration", self.duration, 0, LONGEST, remedy="s")
        top = self.highest_speed
        require(top < HIGHEST_SPEED, f"speed must stay below 1e5 rad/s, got {top:g}; pass 3500*rpm")
        for shaft, torque in zip(self.gearbox.shafts, self.initial_torques, strict=True):
            require_finite(f"torque on shaft {shaft.name!r} at the start", torque, "check drives and loads")

    @property
    def anchor(self) -> str:
        """Name of the shaft whose angle is 0 in the equilibrium at the start: the held one, else the driving one."""
        return self.held or self.gearbox.driving.name

    @cached_property
    def speed_of(self) -> Any:
        """Imposed speed of the held shaft in its sense of motion, as a `Line` or `PiecewiseCubic`; None without."""
        return None if self.held is None else speed_function(self.speed, self.duration)

    def driving_speed(self, t):
        """Imposed speed of the driving shaft [rad/s] at times [s]."""
        return self.speed_of(t) / self._ratio(self.held)

    def driving_angle(self, t: float) -> float:
        """Angle of the driving shaft that the imposed speed gives [rad] at a time [s]."""
        return (self.start_angle + self.speed_of.integral(t)) / self._ratio(self.held)

    def driving_acceleration(self, t):
        """Imposed acceleration of the driving shaft [rad/s^2] at times [s]."""
        return self.speed_of.slope(t) / self._ratio(self.held)

    @cached_property
    def tables(self) -> dict[str, TorqueTable]:
        """Table of the torque of each end by its name."""
        top = SPEED_MARGIN * self.highest_speed
        of_speed = [end for end in self.ends if end.torque.of_speed is not None]
        ranges = {end: top * self._ratio(end.shaft) + LEAST_RANGE for end in of_speed}
        return self._tables_without_speed | {
            end.name: torque_table(end.torque, end.role, self.duration, highest) for end, highest in ranges.items()
        }

    def tabulated(self) -> "Conditions":
        """The conditions with tables in place of functions, which travel to other processes."""
        ends = tuple(replace(end, torque=self.tables[end.name]) for end in self.ends)
        return replace(self, speed=self.speed_of, ends=ends, run_up=None)

    @cached_property
    def _tables_without_speed(self) -> dict[str, TorqueTable]:
        """Tables of the torques over time and angle, which do not need to know the range of speeds."""
        ends = [end for end in self.ends if end.torque.of_speed is None]
        return {end.name: torque_table(end.torque, end.role, self.duration, 0.0) for end in ends}

    @property
    def initial_speed(self) -> float:
        """Speed of the driving shaft at the start [rad/s]."""
        return float(self.driving_speed(self.start_time)) if self.held else self.start_speed

    @property
    def initial_angle(self) -> float:
        """Angle of the driving shaft in the equilibrium at the start [rad], but for static deflections."""
        return self.driving_angle(self.start_time) if self.held else 0.0

    @property
    def initial_acceleration(self) -> float:
        """Acceleration of the driving shaft at the start [rad/s^2]: the imposed one, or that of the free train."""
        if self.held:
            return float(self.driving_acceleration(self.start_time))
        torques = self.initial_torques + self.initial_drags
        return float(torques @ self._signed_ratios) / reduced_inertia(self.gearbox)

    @property
    def initial_drags(self) -> np.ndarray:
        """(n_shaft,) torque about z of the drags of each shaft at the start [N m]."""
        return drag_torques(self.gearbox, self.initial_speed)

    @cached_property
    def initial_torques(self) -> np.ndarray:
        """(n_shaft,) torque about z on each shaft at the start [N m], in the order of `Gearbox.shafts`."""
        names = [shaft.name for shaft in self.gearbox.shafts]
        torques = np.zeros(len(names))
        for end in self.ends:
            torques[names.index(end.shaft)] += self.initial_torque(end)
        return torques

    def initial_torque(self, end: ShaftEnd) -> float:
        """Torque about z of an end at the start [N m]."""
        ratio, motion = self._ratio(end.shaft), (self.initial_speed, self.initial_angle)
        value = float(self.tables[end.name](self.start_time, *(ratio * x for x in motion)))
        return end.sense * self.gearbox.directions[end.shaft] * value

    @property
    def _signed_ratios(self) -> list[float]:
        """Speed of each shaft about z over that of the driving shaft."""
        return [self.gearbox.ratios[shaft.name] for shaft in self.gearbox.shafts]

    def _ratio(self, name: Any) -> float:
        """Speed of a shaft over that of the driving shaft, both in their senses of motion; 0 of a shaft that stands."""
        return abs(self.gearbox.ratios[name])

    @cached_property
    def _speeds(self) -> np.ndarray:
        """(n,) expected magnitudes of the speed of the driving shaft over the run [rad/s]."""
        times = np.linspace(0, self.duration, INSTANTS)
        if self.held:
            return np.abs(self.driving_speed(times))
        stops = [stop.speed / self._ratio(stop.shaft) for stop in self.stop if isinstance(stop, SpeedReached)]
        means, of_speed = self._mean_torques(times), self._torque_of_speed()
        return np.abs(expected_speeds(self.gearbox, means, of_speed, self.start_speed, times, stops))

    def _mean_torques(self, times: np.ndarray) -> np.ndarray:
        """(n - 1,) torques over time and angle, reduced to the driving shaft, their means between times (n,)."""
        total = np.zeros(times.size - 1)
        for end in self.ends:
            table = self._tables_without_speed.get(end.name)
            if table:
                x = np.array([0.0, 2 * pi]) if table.variable == ANGLE else times
                mean = np.diff(table.cubic.integral(x)) / np.diff(x)
                total += end.sense * self._ratio(end.shaft) * mean
        return total

    def _torque_of_speed(self) -> Callable[[float], float]:
        """Torques over the speed and drags, reduced to the driving shaft, as a function of its speed."""
        ends = [
            (end.sense * self._ratio(end.shaft), self._ratio(end.shaft), torque_of_speed(end.torque, end.role))
            for end in self.ends
            if isinstance(end.torque, Torque) and end.torque.of_speed is not None
        ]

        def total(speed: float) -> float:
            drag = float(drag_torques(self.gearbox, speed) @ self._signed_ratios)
            return drag + sum(factor * torque(ratio * speed) for factor, ratio, torque in ends)

        return total

    @property
    def highest_speed(self) -> float:
        """Largest magnitude of the expected speed of the driving shaft [rad/s]."""
        return float(self._speeds.max())

    @property
    def constant_speed(self) -> bool:
        """Whether the magnitude of an imposed speed does not change, but for rounding."""
        return self.held is not None and bool(np.ptp(self._speeds) <= 1e-9 * self._speeds.max())

    def attributes(self) -> dict[str, str | float | np.ndarray]:
        """Title, speeds and torques for the attributes of a run: numbers, arrays, or the names of functions.

        Of a run-up speed and load; of any run by the name of the shaft, as in motor_speed and brake_torque, beside
        drives and loads in words.
        """
        if self.run_up:
            speed, load = self.run_up
            return {"title": "run-up"} | recorded("speed", speed) | recorded("load", load)
        drives = {end.name: repr(end.torque) for end in self.ends if end.sense > 0}
        loads = {end.name: repr(end.torque) for end in self.ends if end.sense < 0}
        imposed = {self.held: repr(Speed(self.speed))} if self.held else {}
        drives, loads = (drives | imposed, loads) if self.held_sense > 0 else (drives, loads | imposed)
        given: dict[str, str | float | np.ndarray] = {"title": "run", "drives": str(drives), "loads": str(loads)}
        for end in self.ends:
            given |= recorded_torque(f"{end.name}_torque", end.torque) if isinstance(end.torque, Torque) else {}
        return given | (
            recorded(f"{self.held}_speed", self.speed) if self.held else {"start_speed": float(self.start_speed)}
        )


def run_up_conditions(gearbox: Gearbox, speed: TimeFunction, load: TimeFunction, duration: float) -> Conditions:
    """Imposed speed of the driving shaft and load on the driven one."""
    require_within("duration", duration, 0, LONGEST, remedy="s")
    check_time_function("load", load)
    if not callable(load) and np.size(load) <= 2:
        load = float(np.ravel(load)[0]) if np.size(load) == 1 else tuple(np.ravel(load).tolist())
    end = end_of(gearbox, gearbox.driven.name, -1, Torque(load), "load")
    return Conditions(gearbox, duration, gearbox.driving.name, speed, (end,), run_up=(speed, load))


def conditions_at_rest(gearbox: Gearbox, loads: Mapping[str, float]) -> Conditions:
    """Conditions of a gearbox whose driving shaft is held at rest, under constant loads by names of shafts [N m]."""
    ends = tuple(end_of(gearbox, name, -1, Torque(torque), f"loads[{name!r}]") for name, torque in loads.items())
    return Conditions(gearbox, 1.0, gearbox.driving.name, 0.0, ends)


def conditions_of(
    gearbox: Gearbox,
    drives: Mapping[str, Any],
    loads: Mapping[str, Any],
    *,
    duration: float,
    start_speed: float | None,
    stop: Sequence[StopCondition],
    initial: xr.Dataset | None,
) -> Conditions:
    """The conditions of `exugear.run`; ValueError for shafts that do not exist, and for ends that contradict.

    initial   data of the run that goes on, which give the speed at the start
    """
    check_ends(gearbox, drives, loads)
    turning = [shaft.name for shaft in gearbox.shafts if gearbox.ratios[shaft.name]]
    check_stop(stop, turning, gearbox.labels)
    twice = sorted(drives.keys() & loads.keys())
    require(not twice, f"drives and loads: shafts {twice} stand in both; keep each in one of them")
    roles = {name: f"drives[{name!r}]" for name in drives} | {name: f"loads[{name!r}]" for name in loads}
    ends = {name: _end(roles[name], value, Speed) for name, value in drives.items()}
    ends |= {name: _end(roles[name], value, Torque) for name, value in loads.items()}
    speeds = {name: end for name, end in ends.items() if isinstance(end, Speed)}
    _check_speeds(gearbox, speeds, start_speed)
    torques = {name: end for name, end in ends.items() if isinstance(end, Torque)}
    senses = {name: 1 if name in drives else -1 for name in ends}
    acting = tuple(end_of(gearbox, name, senses[name], end, roles[name]) for name, end in torques.items())
    name, speed = next(((name, end.value) for name, end in speeds.items()), (None, None))
    held, sense = (None, -1) if name is None else (gearbox.ends[name].name, senses[name])
    require(initial is None or start_speed is None, f"start_speed {start_speed} stands beside initial; leave one out")
    start_speed = start_speed if initial is None else float(initial["speed"][-1])
    return Conditions(gearbox, duration, held, speed, acting, start_speed or 0.0, stop=tuple(stop), held_sense=sense)


def check_ends(gearbox: Gearbox, drives: Mapping[str, Any], loads: Mapping[str, Any]) -> None:
    """ValueError for shafts and rotors that the gearbox lacks, and for two torques on a body."""
    bodies = gearbox.ends
    for argument, given in {"drives": drives, "loads": loads}.items():
        unknown = [name for name in given if name not in bodies]
        require(not unknown, f"{argument}: no shafts {unknown}; the shafts are {[*bodies]}")
        held = [name for name in given if bodies[name].name in gearbox.held]
        takes = f"{argument}: shafts {held} are held by the gearbox and take the reaction torque"
        require(not held, f"{takes}; leave them out, or build Gearbox(..., held=...) with another member")
    names = [*drives, *(name for name in loads if name not in drives)]
    acted_on = {name: bodies[name].end if name == bodies[name].name else name for name in names}
    twice = [name for name, body in acted_on.items() if [*acted_on.values()].count(body) > 1]
    require(not twice, f"drives and loads: {twice} are the same body, the end of its shaft; keep one of them")


def _end(where: str, value, shorthand: type) -> Speed | Torque:
    """What acts on an end; numbers, ramps, functions of time and arrays become the shorthand of the argument."""
    if isinstance(value, MotorCurve):
        return value.as_torque
    if isinstance(value, Speed | Torque):
        return value
    try:
        return shorthand(value)
    except ValueError as error:
        kinds = "a Speed, a Torque, a MotorCurve, a number, (from, to), a function of time or arrays"
        raise ValueError(f"{where} must be {kinds}, got {text_of(value)}: {error}") from None


def _check_speeds(gearbox: Gearbox, speeds: Mapping[str, Speed], start_speed: float | None) -> None:
    """ValueError for more than one imposed speed, on a rotor inside, and for a start speed beside an imposed one."""
    for name in speeds:
        shaft = gearbox.ends[name]
        stands = f"shaft {shaft.name!r} stands while the train turns, so that its speed determines no other"
        require(gearbox.ratios[shaft.name] != 0, f"drives and loads: {stands}; impose that of another shaft")
        inside = f"a speed is imposed on {name!r}, the end of shaft {shaft.name!r} is {shaft.end!r}"
        require(name in (shaft.name, shaft.end), f"drives and loads: {inside}; impose it there, or give a Torque")
    if len(speeds) > 1:
        ratios = ", ".join(f"{name!r} {abs(gearbox.ratios[gearbox.ends[name].name]):.6g}" for name in speeds)
        imposed = f"speeds are imposed on {list(speeds)}, whose ratios to the driving shaft are {ratios}"
        remedy = "the torque between them is then unknown: impose one, give the others a Torque"
        raise ValueError(f"drives and loads: {imposed}; {remedy}")
    if speeds:
        beside = f"start_speed {start_speed} stands beside the imposed speed of {next(iter(speeds))!r}; leave it out"
        require(start_speed is None, beside)
    elif start_speed is not None:
        require_within("start_speed", start_speed, -HIGHEST_SPEED, HIGHEST_SPEED, unit=rpm, remedy="rpm (pass rad/s)")
