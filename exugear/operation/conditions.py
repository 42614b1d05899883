"""Operating conditions of a run: what acts on each shaft, resolved for a gearbox, and the speeds to expect."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.gearbox import Gearbox, anchors_of, motions_of
from exugear.operation.shaft_ends import MotorCurve, Speed, Torque, recorded, recorded_torque
from exugear.operation.stop_conditions import SpeedReached, StopCondition, check_stop
from exugear.operation.time_functions import TimeFunction, check_time_function, speed_function
from exugear.operation.torque_tables import ANGLE, TorqueTable, torque_of_speed, torque_table
from exugear.operation.train_motion import HIGHEST_SPEED, accelerations_under, drag_torques, expected_speeds
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
class ImposedSpeed:
    """A speed that is imposed on the end of a shaft.

    shaft         its name
    value         speed, in the sense of motion of the shaft, as the user gave it
    sense         +1 where it is that of a drive, -1 where it is that of a load
    start_angle   in its sense of motion [rad]
    """

    shaft: str
    value: Any
    sense: int = 1
    start_angle: float = 0.0


@dataclass(frozen=True, eq=False)
class Conditions:
    """Operating conditions of a run.

    gearbox       whose shafts turn
    duration      [s]
    imposed       speeds that are imposed; none where all shafts are free
    ends          torques on the ends of shafts
    start_speeds  about z [rad/s] of the `anchors` behind those of the imposed speeds, which are free
    start_time    at which the integration starts [s]; later than 0 for a part of a run under imposed speeds
    stop          conditions that end the run
    run_up        speed and load as given to `exugear.run_up`, for the attributes of the run
    power         whether the run records where its power goes
    displacement  whether its data hold the displacements of the shafts at their bearings

    Speeds, angles, accelerations and torques of shafts (n_shaft,) are about z, in the order of `Gearbox.shafts`.

    Raises ValueError for a duration out of range, and for speeds and torques that are not finite.
    """

    gearbox: Gearbox
    duration: float
    imposed: tuple[ImposedSpeed, ...]
    ends: tuple[ShaftEnd, ...]
    start_speeds: tuple[float, ...] = ()
    start_time: float = 0.0
    stop: tuple[StopCondition, ...] = ()
    run_up: tuple[TimeFunction, TimeFunction] | None = None
    power: bool = False
    displacement: bool = False

    def __post_init__(self):
        require_within("duration", self.duration, 0, LONGEST, remedy="s")
        top = max(self.highest_speed_of(name) for name in self.gearbox.independent)
        require(top < HIGHEST_SPEED, f"speed must stay below 1e5 rad/s, got {top:g}; pass 3500*rpm")
        for shaft, torque in zip(self.gearbox.shafts, self.initial_torques, strict=True):
            require_finite(f"torque on shaft {shaft.name!r} at the start", torque, "check drives and loads")

    @property
    def held(self) -> tuple[str, ...]:
        """Names of the shafts whose speeds are imposed."""
        return tuple(speed.shaft for speed in self.imposed)

    @cached_property
    def anchors(self) -> tuple[str, ...]:
        """Shafts whose angles determine all others: the held ones, then those that keep their angles at the start."""
        return anchors_of(self.gearbox, self.held)

    @property
    def prescribed(self) -> bool:
        """Whether the imposed speeds determine those of all shafts."""
        return len(self.imposed) == len(self.anchors)

    @cached_property
    def motions(self) -> np.ndarray:
        """(n_free, n_shaft) speed of every shaft about z per speed of each anchor about z."""
        return motions_of(self.gearbox, self.anchors)

    @cached_property
    def speeds_of(self) -> tuple[Any, ...]:
        """Imposed speeds in the senses of motion of their shafts, each a `PiecewiseCubic`."""
        return tuple(speed_function(speed.value, self.duration) for speed in self.imposed)

    def _of_imposed(self, values: Sequence[Any]) -> np.ndarray:
        """(n_imposed, ...) values in the senses of motion of the held shafts, about z."""
        signed = [self.gearbox.directions[name] * value for name, value in zip(self.held, values, strict=True)]
        return np.array(signed, float)

    def _of_shafts(self, of_imposed: np.ndarray, of_free: Any = 0.0) -> np.ndarray:
        """(n_shaft, ...) values of all shafts about z from those of the imposed speeds and of the free anchors."""
        number = len(self.imposed)
        values = np.zeros((len(self.anchors), *of_imposed.shape[1:]))
        values[:number] = of_imposed
        values[number:] = of_free
        return np.einsum("as,a...->s...", self.motions, values)

    def shaft_speeds(self, t) -> np.ndarray:
        """(n_shaft, ...) speeds at times [s] that the imposed ones prescribe."""
        return self._of_shafts(self.anchor_speeds(t))

    def shaft_angles(self, t: float) -> np.ndarray:
        """(n_shaft,) angles [rad] at a time [s] that the imposed speeds prescribe."""
        starts = [speed.start_angle for speed in self.imposed]
        turned = [speed_of.integral(t) for speed_of in self.speeds_of]
        return self._of_shafts(self._of_imposed([start + x for start, x in zip(starts, turned, strict=True)]))

    def driving_speed(self, t):
        """Prescribed speed of the driving shaft [rad/s] at times [s]."""
        motion = self.motions[:, self._number(self.gearbox.driving.name)]
        # BLAS would wake its threads, which then wait for more as they compute
        return np.einsum("a,a...->...", motion, self.anchor_speeds(t))

    def anchor_speeds(self, t) -> np.ndarray:
        """(n_free, ...) prescribed speeds of the anchors about z [rad/s] at times [s]."""
        return self._of_imposed([speed_of(t) for speed_of in self.speeds_of])

    def _number(self, name: str) -> int:
        """Number of a shaft."""
        return [shaft.name for shaft in self.gearbox.shafts].index(name)

    @cached_property
    def tables(self) -> dict[str, TorqueTable]:
        """Table of the torque of each end by its name."""
        of_speed = [end for end in self.ends if end.torque.of_speed is not None]
        ranges = {end: SPEED_MARGIN * self.highest_speed_of(end.shaft) + LEAST_RANGE for end in of_speed}
        return self._tables_without_speed | {
            end.name: torque_table(end.torque, end.role, self.duration, highest) for end, highest in ranges.items()
        }

    def tabulated(self) -> "Conditions":
        """The conditions with tables in place of functions, which travel to other processes."""
        ends = tuple(replace(end, torque=self.tables[end.name]) for end in self.ends)
        imposed = tuple(replace(x, value=speed_of) for x, speed_of in zip(self.imposed, self.speeds_of, strict=True))
        return replace(self, imposed=imposed, ends=ends, run_up=None)

    @cached_property
    def _tables_without_speed(self) -> dict[str, TorqueTable]:
        """Tables of the torques over time and angle, which do not need to know the range of speeds."""
        ends = [end for end in self.ends if end.torque.of_speed is None]
        return {end.name: torque_table(end.torque, end.role, self.duration, 0.0) for end in ends}

    @cached_property
    def initial_speeds(self) -> np.ndarray:
        """(n_shaft,) speeds at the start [rad/s]."""
        return self._speeds_at(self.start_time)

    def _speeds_at(self, t: float) -> np.ndarray:
        """(n_shaft,) imposed speeds at a time [s], and start speeds of what is free [rad/s]."""
        return self._of_shafts(self._of_imposed([speed_of(t) for speed_of in self.speeds_of]), self.start_speeds)

    @property
    def initial_speed(self) -> float:
        """Speed of the driving shaft at the start [rad/s]."""
        return float(self.initial_speeds[self._number(self.gearbox.driving.name)])

    @cached_property
    def initial_angles(self) -> np.ndarray:
        """(n_shaft,) angles in the equilibrium at the start [rad], but for static deflections; free anchors at 0."""
        return self.shaft_angles(self.start_time)

    @cached_property
    def initial_accelerations(self) -> np.ndarray:
        """(n_shaft,) accelerations at the start [rad/s^2]: as imposed, and of what is free under the torques."""
        given = self._of_imposed([speed_of.slope(self.start_time) for speed_of in self.speeds_of])
        torques = self.initial_torques + self.initial_drags
        return accelerations_under(self.gearbox, torques, self.held, given)

    @property
    def initial_drags(self) -> np.ndarray:
        """(n_shaft,) torque about z of the drags of each shaft at the start [N m]."""
        return drag_torques(self.gearbox, self.initial_speeds)

    @property
    def drags_at_zero(self) -> np.ndarray:
        """The same at t = 0, the start of the whole run of which this may be a part."""
        return drag_torques(self.gearbox, self._speeds_at(0.0))

    @cached_property
    def initial_torques(self) -> np.ndarray:
        """(n_shaft,) torque about z on each shaft at the start [N m]."""
        torques = np.zeros(len(self.gearbox.shafts))
        for end in self.ends:
            torques[self._number(end.shaft)] += self.initial_torque(end)
        return torques

    def initial_torque(self, end: ShaftEnd) -> float:
        """Torque about z of an end at the start [N m]."""
        number, direction = self._number(end.shaft), self.gearbox.directions[end.shaft]
        motion = direction * self.initial_speeds[number], direction * self.initial_angles[number]
        value = float(self.tables[end.name](self.start_time, *motion))
        return end.sense * direction * value

    @cached_property
    def _speeds(self) -> np.ndarray:
        """(n_shaft, n) expected speeds over the run [rad/s]."""
        times, directions = np.linspace(0, self.duration, INSTANTS), self.gearbox.directions
        if self.prescribed:
            return self.shaft_speeds(times)
        given = self._of_imposed([speed_of(times) for speed_of in self.speeds_of])
        slopes = self._of_imposed([speed_of.slope(times) + 0.0 * times for speed_of in self.speeds_of])
        given, slopes = (np.reshape(x, (-1, times.size)) for x in (given, slopes))
        reached = [stop for stop in self.stop if isinstance(stop, SpeedReached)]
        ends = [(stop.shaft, directions[stop.shaft] * stop.speed) for stop in reached]
        acting = self._mean_torques(times), self._torques_of_speed()
        return expected_speeds(self.gearbox, self.held, (given, slopes), *acting, self.start_speeds, times, ends)

    def _mean_torques(self, times: np.ndarray) -> np.ndarray:
        """(n_shaft, n - 1) torques over time and angle, their means between times (n,)."""
        total = np.zeros((len(self.gearbox.shafts), times.size - 1))
        for end in self.ends:
            table = self._tables_without_speed.get(end.name)
            if table:
                x = np.array([0.0, 2 * pi]) if table.variable == ANGLE else times
                mean = np.diff(table.cubic.integral(x)) / np.diff(x)
                total[self._number(end.shaft)] += end.sense * self.gearbox.directions[end.shaft] * mean
        return total

    def _torques_of_speed(self) -> Callable[[np.ndarray], np.ndarray]:
        """Torques over the speed and drags (n_shaft,), as a function of the speeds of the shafts (n_shaft,)."""
        ends = [
            (
                self._number(end.shaft),
                end.sense,
                self.gearbox.directions[end.shaft],
                torque_of_speed(end.torque, end.role),
            )
            for end in self.ends
            if isinstance(end.torque, Torque) and end.torque.of_speed is not None
        ]

        def total(speeds: np.ndarray) -> np.ndarray:
            torques = drag_torques(self.gearbox, speeds)
            for number, sense, direction, torque in ends:
                torques[number] += sense * direction * torque(direction * float(speeds[number]))
            return torques

        return total

    @property
    def highest_speed(self) -> float:
        """Largest magnitude of the expected speed of the driving shaft [rad/s]."""
        return self.highest_speed_of(self.gearbox.driving.name)

    def highest_speed_of(self, name: str) -> float:
        """Largest magnitude of the expected speed of a shaft [rad/s]."""
        return float(np.abs(self._speeds[self._number(name)]).max())

    @property
    def fastest(self) -> float:
        """Largest magnitude of the expected speeds of all shafts [rad/s]."""
        return float(np.abs(self._speeds).max())

    @cached_property
    def highest_mesh_frequencies(self) -> np.ndarray:
        """(n_stage,) largest expected mesh frequencies [Hz]."""
        return np.abs(self.gearbox.cycles @ self._speeds).max(axis=1)

    @property
    def constant_speed(self) -> bool:
        """Whether the magnitudes of imposed speeds that prescribe all others do not change, but for rounding."""
        sizes = np.abs(self._speeds)
        return self.prescribed and bool((np.ptp(sizes, axis=1) <= 1e-9 * sizes.max()).all())

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
        for imposed in self.imposed:
            (drives if imposed.sense > 0 else loads)[imposed.shaft] = repr(Speed(imposed.value))
        given: dict[str, str | float | np.ndarray] = {"title": "run", "drives": str(drives), "loads": str(loads)}
        for end in self.ends:
            given |= recorded_torque(f"{end.name}_torque", end.torque) if isinstance(end.torque, Torque) else {}
        for imposed in self.imposed:
            given |= recorded(f"{imposed.shaft}_speed", imposed.value)
        if len(self.anchors) > 1 and not self.prescribed:
            given["free_speeds"] = self.words
        return given if self.prescribed else given | {"start_speed": self.initial_speed}

    @property
    def words(self) -> str:
        """Which speeds are free, and how the torques accelerate them at the start; torques in balance do not."""
        accelerations = dict(zip([x.name for x in self.gearbox.shafts], self.initial_accelerations, strict=True))
        free = [
            f"{x!r} by {self.gearbox.directions[x] * accelerations[x]:.4g} rad/s^2"
            for x in self.anchors[len(self.imposed) :]
        ]
        imposed = f"{len(self.anchors)} speeds are free, {len(self.imposed)} of them imposed"
        return f"{imposed}: torques that are not in balance accelerate shafts, at the start {', '.join(free)}"


def run_up_conditions(
    gearbox: Gearbox,
    speed: TimeFunction,
    load: TimeFunction,
    duration: float,
    *,
    power: bool = False,
    displacement: bool = False,
) -> Conditions:
    """Imposed speed of the driving shaft and load on the driven one; all free speeds keep their nominal ratios."""
    require_within("duration", duration, 0, LONGEST, remedy="s")
    check_time_function("load", load)
    if not callable(load) and np.size(load) <= 2:
        load = float(np.ravel(load)[0]) if np.size(load) == 1 else tuple(np.ravel(load).tolist())
    end = end_of(gearbox, gearbox.driven.name, -1, Torque(load), "load")
    return Conditions(
        gearbox,
        duration,
        nominal_speeds(gearbox, speed, duration),
        (end,),
        run_up=(speed, load),
        power=power,
        displacement=displacement,
    )


def nominal_speeds(gearbox: Gearbox, speed: TimeFunction, duration: float) -> tuple[ImposedSpeed, ...]:
    """The speed of the driving shaft, and of all independent shafts in nominal operation with it."""
    if gearbox.independent == (gearbox.driving.name,):
        return (ImposedSpeed(gearbox.driving.name, speed),)
    of_driving = speed_function(speed, duration)
    return tuple(ImposedSpeed(name, of_driving.scaled(abs(gearbox.ratios[name]))) for name in gearbox.independent)


def conditions_at_rest(gearbox: Gearbox, loads: Mapping[str, float]) -> Conditions:
    """Conditions of a gearbox whose driving shafts are held at rest, under constant loads by names of shafts [N m]."""
    ends = tuple(end_of(gearbox, name, -1, Torque(torque), f"loads[{name!r}]") for name, torque in loads.items())
    return Conditions(gearbox, 1.0, tuple(ImposedSpeed(name, 0.0) for name in gearbox.independent), ends)


def conditions_of(
    gearbox: Gearbox,
    drives: Mapping[str, Any],
    loads: Mapping[str, Any],
    *,
    duration: float,
    start_speed: float | Mapping[str, float] | None,
    stop: Sequence[StopCondition],
    initial: xr.Dataset | None,
    power: bool = False,
    displacement: bool = False,
) -> Conditions:
    """The conditions of `exugear.run`; ValueError for shafts that do not exist, and for ends that contradict.

    initial   data of the run that goes on, which give the speed at the start
    """
    check_ends(gearbox, drives, loads)
    turning = [shaft.name for shaft, speeds in zip(gearbox.shafts, gearbox.motions.T, strict=True) if speeds.any()]
    check_stop(stop, turning, gearbox.labels)
    twice = sorted(drives.keys() & loads.keys())
    require(not twice, f"drives and loads: shafts {twice} stand in both; keep each in one of them")
    roles = {name: f"drives[{name!r}]" for name in drives} | {name: f"loads[{name!r}]" for name in loads}
    ends = {name: _end(roles[name], value, Speed) for name, value in drives.items()}
    ends |= {name: _end(roles[name], value, Torque) for name, value in loads.items()}
    speeds = {name: end for name, end in ends.items() if isinstance(end, Speed)}
    _check_speeds(gearbox, speeds)
    torques = {name: end for name, end in ends.items() if isinstance(end, Torque)}
    senses = {name: 1 if name in drives else -1 for name in ends}
    acting = tuple(end_of(gearbox, name, senses[name], end, roles[name]) for name, end in torques.items())
    imposed = tuple(ImposedSpeed(gearbox.ends[name].name, x.value, senses[name]) for name, x in speeds.items())
    require(initial is None or start_speed is None, f"start_speed {start_speed} stands beside initial; leave one out")
    start = _start_speeds(gearbox, imposed, duration, start_speed, initial)
    output = power, displacement
    return Conditions(gearbox, duration, imposed, acting, start, 0.0, tuple(stop), None, *output)


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


def _check_speeds(gearbox: Gearbox, speeds: Mapping[str, Speed]) -> None:
    """ValueError for more imposed speeds than are free, and for one on a rotor inside."""
    shafts, names = [shaft.name for shaft in gearbox.shafts], [gearbox.ends[name].name for name in speeds]
    motions = gearbox.motions[:, [shafts.index(name) for name in names]]
    for name, shaft, motion in zip(speeds, names, motions.T, strict=True):
        stands = f"shaft {shaft!r} stands while the train turns, so that its speed determines no other"
        require(motion.any(), f"drives and loads: {stands}; impose that of another shaft")
        end = gearbox.ends[name].end
        inside = f"a speed is imposed on {name!r}, the end of shaft {shaft!r} is {end!r}"
        require(name in (shaft, end), f"drives and loads: {inside}; impose it there, or give a Torque")
    if len(gearbox.motions) == 1 < len(speeds):
        ratios = ", ".join(
            f"{name!r} {abs(gearbox.ratios[shaft]):.6g}" for name, shaft in zip(speeds, names, strict=True)
        )
        imposed = f"speeds are imposed on {list(speeds)}, whose ratios to the driving shaft are {ratios}"
        remedy = "the torque between them is then unknown: impose one, give the others a Torque"
        raise ValueError(f"drives and loads: {imposed}; {remedy}")
    dependent = f"speeds are imposed on {list(speeds)}, of which the meshes leave {len(gearbox.motions)} free at most"
    fewer = "the torque between them is then unknown: impose fewer or those of other shafts, give the others a Torque"
    require(len(anchors_of(gearbox, names)) == len(gearbox.motions), f"drives and loads: {dependent}; {fewer}")


def _start_speeds(
    gearbox: Gearbox,
    imposed: Sequence[ImposedSpeed],
    duration: float,
    start_speed: float | Mapping[str, float] | None,
    initial: xr.Dataset | None,
) -> tuple[float, ...]:
    """Speeds about z at the start [rad/s] of the anchors whose speeds are not imposed."""
    held = [speed.shaft for speed in imposed]
    free = anchors_of(gearbox, held)[len(held) :]
    if not free:
        beside = f"start_speed {start_speed} stands beside the imposed speed of {', '.join(map(repr, held))}"
        require(start_speed is None, f"{beside}; leave it out")
        return ()
    if initial is not None:
        if len(gearbox.motions) == 1:
            return (float(initial["speed"][-1]),)
        recorded_speeds = initial["shaft_speed"][:, -1]
        return tuple(gearbox.directions[name] * float(recorded_speeds.sel(shaft=name)) for name in free)
    at_start = {speed.shaft: float(speed_function(speed.value, duration)(0.0)) for speed in imposed}
    if isinstance(start_speed, Mapping):
        return _given_start_speeds(gearbox, at_start, free, start_speed)
    if held:
        alone = f"start_speed {start_speed} is that of the driving shaft, beside the imposed speed of {held}"
        require(start_speed is None, f"{alone}; pass start_speed={{{free[0]!r}: speed}}, or leave it out")
        of_nominal = next((speed / abs(gearbox.ratios[x]) for x, speed in at_start.items() if gearbox.ratios[x]), 0.0)
    else:
        of_nominal = start_speed or 0.0
        require_within("start_speed", of_nominal, -HIGHEST_SPEED, HIGHEST_SPEED, unit=rpm, remedy="rpm (pass rad/s)")
    return tuple(gearbox.ratios[name] * of_nominal for name in free)


def _given_start_speeds(
    gearbox: Gearbox, at_start: Mapping[str, float], free: Sequence[str], given: Mapping[str, float]
) -> tuple[float, ...]:
    """Speeds about z at the start of free anchors, from those of shafts in their senses of motion.

    at_start   speeds of the held shafts, in their senses of motion
    given      of as many other shafts as there are free anchors
    """
    shafts, names = [shaft.name for shaft in gearbox.shafts], [*at_start, *given]
    unknown = [name for name in given if name not in shafts]
    require(not unknown, f"start_speed: no shafts {unknown}; the shafts are {shafts}")
    number = f"start_speed must hold {len(free)} shafts, as many as are free beside {[*at_start]}, got {[*given]}"
    require(len(given) == len(free) and not at_start.keys() & given.keys(), f"{number}; such as {free[0]!r}")
    for name, speed in given.items():
        at = f"start_speed of {name!r}"
        require_within(at, speed, -HIGHEST_SPEED, HIGHEST_SPEED, unit=rpm, remedy="rpm (pass rad/s)")
    dependent = f"start_speed of {[*given]} and the speeds of {[*at_start]} depend on one another"
    require(anchors_of(gearbox, names) == tuple(names), f"{dependent}; give that of {free[0]!r}")
    about_z = np.array([gearbox.directions[name] * speed for name, speed in {**at_start, **given}.items()])
    speeds = about_z @ motions_of(gearbox, names)
    return tuple(float(speeds[shafts.index(name)]) for name in free)
