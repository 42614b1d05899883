"""What acts on the end of a shaft: an imposed speed, a torque, or a motor with its curve."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from exugear.operation.time_functions import check_time_function
from fem.support.arguments import FilePath, Numbers, checked
from fem.support.tables import read_table
from fem.support.validation import increasing, numbers, require, require_finite, set_fields

#: Number of values that an attribute of a netCDF file holds with certainty: HDF5 ends at 64 kB.
LONGEST_ATTRIBUTE = 4096


def check_function_or_arrays(name: str, value) -> None:
    """ValueError unless the value is a function or two arrays, of which the first increases."""
    if callable(value):
        return
    kinds = f"{name} must be a function or arrays (x, torque)"
    try:
        rows = numbers(name, value)
    except ValueError as error:
        raise ValueError(f"{kinds}: {error}") from None
    require(rows.ndim == 2 and len(rows) == 2 and rows.shape[1] > 1, f"{kinds}, got {value}")
    require_finite(name, rows)
    increasing(f"the first array of {name}", rows[0], least=2)


@checked
@dataclass(frozen=True, eq=False)
class Speed:
    """An imposed speed of a shaft: its drive is so strong that nothing changes the speed.

    value   [rad/s], > 0 in the sense in which the shaft turns when the driving shaft turns about +z: a number,
            (from, to) over the run, a function of time [s], or arrays (t, speed) that cover the run, interpolated by a
            monotone cubic

    A function is sampled before the run, within 1e-6 of its largest value; what lasts less than 2 ms may be missed.

    Raises ValueError for other values and for values that are not finite.
    """

    value: Annotated[Any, check_time_function]

    def __repr__(self) -> str:
        return f"Speed({name_of(self.value)})"


@checked
@dataclass(frozen=True, eq=False)
class Torque:
    """A torque on a shaft [N m]: a drive's acts with, a load's against the motion at positive speed.

    value      a number, (from, to) over the run, a function of time [s], or arrays (t, torque)
    of_speed   instead: function of the speed of this shaft [rad/s], or arrays (speed, torque), constant beyond them
    of_angle   instead: function of the angle of this shaft [rad] with the period of a revolution, or arrays
               (angle, torque) from 0 to 2 pi

    A function is tabulated before the run, within 1e-6 of its largest value; what lasts less than 0.2 ms, or a 300th of
    a turn, may be missed. Arrays are interpolated by a monotone cubic.

    Raises ValueError unless exactly one of them is given, and for values that are not finite.
    """

    value: Annotated[Any, check_time_function] | None = None
    of_speed: Annotated[Any, check_function_or_arrays] | None = None
    of_angle: Annotated[Any, check_function_or_arrays] | None = None

    def __post_init__(self):
        given = sum(x is not None for x in (self.value, self.of_speed, self.of_angle))
        require(given == 1, f"a Torque needs one of value, of_speed, of_angle, got {given} of them; add torques first")

    def __repr__(self) -> str:
        given = {"": self.value, "of_speed=": self.of_speed, "of_angle=": self.of_angle}
        return f"Torque({', '.join(name + name_of(x) for name, x in given.items() if x is not None)})"


@checked
@dataclass(frozen=True, eq=False)
class MotorCurve:
    """The characteristic of a motor, or of a brake as a load.

    speed    (n,) of the shaft [rad/s], rising, > 0 in its sense of rotation at positive speed
    torque   (n,) [N m], interpolated by a monotone cubic and constant beyond the ends

    Raises ValueError for arrays of unequal lengths, speeds that do not rise, and torques that are not finite.
    """

    speed: Numbers
    torque: Numbers

    def __post_init__(self):
        speed, torque = increasing("speed", self.speed, least=2), numbers("torque", self.torque)
        sizes = f"got {torque.size} torques and {speed.size} speeds"
        require(torque.shape == speed.shape, f"torque must have a value for each speed, {sizes}")
        require_finite("speed", speed)
        require_finite("torque", torque)
        set_fields(self, speed=speed, torque=torque)

    def __repr__(self) -> str:
        return f"MotorCurve({len(self.speed)} speeds up to {self.speed[-1]:g} rad/s)"

    @classmethod
    @checked
    def from_table(cls, path: FilePath) -> "MotorCurve":
        """A characteristic by a table: text file (CSV, or separated by blanks) under speed [rpm], torque [N m].

        Lines stand in any order; other units are converted. Raises FileNotFoundError, and ValueError for a unit that is
        missing or unknown, NaN, a missing column, a second header and speeds given twice, with the line of the file.
        """
        table = read_table(path, {"speed": "rad/s", "torque": "N m"}, key=["speed"])
        order = np.argsort(table["speed"])
        return cls(table["speed"][order], table["torque"][order])

    @property
    def as_torque(self) -> Torque:
        """The curve as a torque that depends on the speed."""
        return Torque(of_speed=(self.speed, self.torque))


def name_of(value) -> str:
    """A number or ramp as text, the name of a function, the number of points of arrays."""
    if callable(value):
        return getattr(value, "__name__", type(value).__name__)
    return f"{np.shape(value)[1]} points" if np.ndim(value) == 2 else str(value)


def recorded(name: str, value, over: str = "time") -> dict[str, float | str | np.ndarray]:
    """What acts on an end as attributes of a run: a number, (from, to) as an array (2,), or the name of a function.

    Arrays (x, values) become two attributes: the values, and x under the name and over, such as load_time. Longer ones
    than an attribute holds are named by their number of points; the run records speeds and torques over time.
    """
    if callable(value):
        return {name: name_of(value)}
    values = np.asarray(value, float)
    if values.ndim == 2 and values.shape[1] > LONGEST_ATTRIBUTE:
        return {name: name_of(value)}
    if values.ndim == 2:
        return {name: values[1], f"{name}_{over}": values[0]}
    return {name: values if values.size == 2 else float(values.item())}


def recorded_torque(name: str, torque: Torque) -> dict[str, float | str | np.ndarray]:
    """A torque as attributes of a run, as `recorded`; that of a function of speed or angle has these in its name."""
    if torque.value is not None:
        return recorded(name, torque.value)
    over, given = ("speed", torque.of_speed) if torque.of_speed is not None else ("angle", torque.of_angle)
    return recorded(f"{name}_of_{over}" if callable(given) else name, given, over)


def numbers_of_text(text: str) -> float | str | np.ndarray:
    """A number, or an array (2,) for (from, to), that version 0.1.0 wrote as text; other texts as they are."""
    try:
        values = np.array([float(part) for part in text.strip("()[]").replace(",", " ").split()])
    except ValueError:
        return text
    if values.size == 1:
        return float(values[0])
    return values if values.size == 2 else text
