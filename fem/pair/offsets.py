"""Offsets of the wheel from the pinion: centre distance, misalignment, axial offset; values, or axes of a map."""

from dataclasses import dataclass, fields
from math import cos, sin

import numpy as np

from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.representation import short
from fem.support.validation import increasing, numbers, require, require_finite, set_fields, text_of

#: Angles must be smaller [rad]: larger ones are probably degrees.
LARGEST_ANGLE = 0.01
ANGLES = ("misalignment", "f_sigma_delta", "f_sigma_beta")


@short(a="mm", axial="mm", misalignment="mrad", f_sigma_delta="mrad", f_sigma_beta="mrad")
@dataclass(frozen=True)
class Offsets:
    """Offsets of a map: a sequence of increasing values makes an axis of the map, a number does not.

    a               working centre distance [m]; by default that of the pair; of a ring with either sign
    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]
    f_sigma_delta   parallelism error in the plane of the axes, by which the axes diverge towards positive z [rad]
    f_sigma_beta    parallelism error across that plane, by which the wheel's axis inclines towards positive z in the
                    direction in which the contact drives the wheel [rad]
    axial           axial position of the wheel's mid-plane from the pinion's [m]

    The three angles add up in the plane of action (`in_plane_of_action`). Raises ValueError for angles of 0.01 rad or
    more and for values that do not increase. Source of the parallelism errors: ISO/TR 10064-3.
    """

    a: float | tuple | None = None
    misalignment: float | tuple = 0.0
    f_sigma_delta: float | tuple = 0.0
    f_sigma_beta: float | tuple = 0.0
    axial: float | tuple = 0.0

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "a" or value is not None:
                require(value is not None, f"{field.name} must be a number or increasing numbers (0: none), got None")
                self._set_checked(field.name, numbers(field.name, value))

    def _set_checked(self, name: str, values: np.ndarray) -> None:
        """Check an offset, and keep it as a number or as a tuple."""
        require_finite(name, values)
        if values.ndim:
            increasing(name, values)
        set_fields(self, **{name: tuple(values.tolist()) if values.ndim else float(values)})
        if name in ANGLES:
            largest = np.abs(values).max()
            within = f"{name} must lie within {LARGEST_ANGLE} rad, got {largest}; pass radians: 0.5e-3"
            require(bool(largest < LARGEST_ANGLE), within)

    @checked
    def values(self, pair: GearPair) -> dict[str, np.ndarray]:
        """Values of each offset of a pair, (n,); centre distances of a ring are < 0."""
        values = {field.name: np.atleast_1d(getattr(self, field.name)) for field in fields(self) if field.name != "a"}
        a = np.atleast_1d(pair.a if self.a is None else self.a)
        return {"a": np.sort(-np.abs(a)) if pair.internal else a} | values

    def axes(self) -> tuple[str, ...]:
        """Names of the offsets that are an axis of the map."""
        return tuple(field.name for field in fields(self) if isinstance(getattr(self, field.name), tuple))


def check_offsets(name: str, value) -> None:
    """ValueError unless the value is an `Offsets`."""
    example = f"{name} must be fem.Offsets, say fem.Offsets(misalignment=0.5e-3)"
    require(isinstance(value, Offsets), f"{example}, got {text_of(value)}")


def in_plane_of_action(alpha_wt: float, f_sigma_delta, f_sigma_beta):
    """Misalignment in the plane of action [rad] that parallelism errors [rad] cause (signs as in `Offsets`)."""
    return f_sigma_delta * sin(alpha_wt) + f_sigma_beta * cos(alpha_wt)
