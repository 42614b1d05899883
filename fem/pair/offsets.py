"""How the wheel stands to the pinion: centre distance, misalignment, axial offset; one value each, or axes of a map."""

from dataclasses import dataclass, fields
from math import cos, sin

import numpy as np

from fem.pair.pair import GearPair
from fem.support.arguments import checked
from fem.support.representation import short
from fem.support.validation import increasing, numbers, require, told

LARGEST_ANGLE = 0.01
ANGLES = ("misalignment", "f_sigma_delta", "f_sigma_beta")


@short(a="mm", axial="mm", misalignment="mrad", f_sigma_delta="mrad", f_sigma_beta="mrad")
@dataclass(frozen=True)
class Offsets:
    """Values that the offsets take; a sequence of increasing values makes an axis of the map, a number does not.

    a               working centre distance [m]; by default that of the pair
    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]
    f_sigma_delta   parallelism error in the plane of the axes: the wheel's axis parts from the pinion's towards z [rad]
    f_sigma_beta    parallelism error across it: towards z the wheel's axis leans to where the contact drives it [rad]
    axial           place of the wheel's mid-plane along the pinion's axis [m]

    The three angles add up in the plane of action (`in_plane_of_action`). Raises ValueError for angles beyond 0.01 rad
    and for values that do not increase. Source of the parallelism errors: ISO/TR 10064-3.
    """

    a: float | tuple | None = None
    misalignment: float | tuple = 0.0
    f_sigma_delta: float | tuple = 0.0
    f_sigma_beta: float | tuple = 0.0
    axial: float | tuple = 0.0

    def __post_init__(self):
        for part in fields(self):
            value = getattr(self, part.name)
            if part.name != "a" or value is not None:
                require(value is not None, f"{part.name} must be a number or increasing numbers (0: none), got None")
                self._check(part.name, numbers(part.name, value))

    def _check(self, name: str, values: np.ndarray) -> None:
        given = getattr(self, name)
        require(bool(np.isfinite(values).all()), f"{name} must be a number or increasing numbers, got {given}")
        if values.ndim:
            increasing(name, values)
        object.__setattr__(self, name, tuple(values.tolist()) if values.ndim else float(values))
        if name in ANGLES:
            largest = np.abs(values).max()
            slope = f"{name} must lie within {LARGEST_ANGLE} rad, got {largest}; pass radians: 0.5e-3"
            require(bool(largest < LARGEST_ANGLE), slope)

    @checked
    def values(self, pair: GearPair) -> dict[str, np.ndarray]:
        """Values of each offset of a pair, (n,)."""
        found = {part.name: np.atleast_1d(getattr(self, part.name)) for part in fields(self) if part.name != "a"}
        return {"a": np.atleast_1d(pair.a if self.a is None else self.a)} | found

    def axes(self) -> tuple[str, ...]:
        """Names of the offsets that are an axis of the map."""
        return tuple(part.name for part in fields(self) if isinstance(getattr(self, part.name), tuple))


def check_offsets(name: str, value) -> None:
    """ValueError unless these are `Offsets`."""
    example = f"{name} must be fem.Offsets, say fem.Offsets(misalignment=0.5e-3)"
    require(isinstance(value, Offsets), f"{example}, got {told(value)}")


def in_plane_of_action(alpha_wt: float, f_sigma_delta, f_sigma_beta):
    """Misalignment [rad] by parallelism errors [rad] (signs as in `Offsets`)."""
    return f_sigma_delta * sin(alpha_wt) + f_sigma_beta * cos(alpha_wt)
