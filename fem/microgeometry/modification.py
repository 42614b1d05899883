"""Designed flank modifications: metres of material removed over roll length and axial place (ISO 21771).

Amounts count along the flank's normal in the transverse section; positive values remove material. Each modification
is a small frozen object; `fem.microgeometry.flank` adds them up.
"""

from dataclasses import dataclass
from math import atan, inf, pi, sqrt, tan
from typing import NamedTuple, Protocol

import numpy as np

from fem.support.representation import short
from fem.support.validation import as_floats

MM = 1e-3


class FlankExtent(NamedTuple):
    """One flank of a gear.

    roll_form, roll_tip     roll lengths of root form and tip [m]
    width                   face width [m]; axial places count from its middle
    r_b                     base radius [m]
    z, tooth                number of teeth and of this tooth, counter-clockwise from tooth 0
    land                    length of the tip circle on a tooth in the transverse section [m]
    """

    roll_form: float
    roll_tip: float
    width: float
    r_b: float = 0.0
    z: int = 1
    tooth: int | np.ndarray = 0
    land: float = inf

    def roll_at(self, d: float, name: str = "d") -> float:
        """Roll length on the circle of diameter d [m]; ValueError, with its name, unless it crosses the flank."""
        low, high = (2 * sqrt(roll**2 + self.r_b**2) for roll in (self.roll_form, self.roll_tip))
        if not low * (1 - 1e-9) <= d <= high * (1 + 1e-9):
            limits = f"[{low / MM:.6g}, {high / MM:.6g}] mm, from root form to tip circle"
            raise ValueError(f"{name}, where a relief begins, must lie in {limits}, got {d / MM:g} mm")
        return sqrt(max(d * d / 4 - self.r_b**2, 0.0))


class Modification(Protocol):
    """What a flank may carry; some have more methods.

    check(face)     raises ValueError where the modification does not suit the face
    edges(face)     roll lengths where the slope along the profile jumps, or rises steeply [m]
    edges_across(face)  likewise axial places [m]
    lines_across(face)  axial places between which it is straight across the width [m], if there are many
    rounding(face)  roll length where a rounded edge begins [m], and its radius [m]
    """

    def removed(self, face: FlankExtent, roll: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Material removed [m] at roll lengths and axial places [m], broadcast."""
        ...


def check_within(name: str, value: float, low: float, high: float, unit: str) -> None:
    """ValueError unless low <= value <= high."""
    if not low <= value <= high:
        raise ValueError(f"{name} must lie in [{low:g}, {high:g}] {unit}, got {value}")


def check_amount(name: str, value: float) -> None:
    """ValueError unless value is a plausible amount of material."""
    check_within(name, value, -1 * MM, 1 * MM, "m (pass metres: 15*um)")


def _check_relief(name: str, amount: float, length: float, power: float) -> None:
    check_amount(name, amount)
    check_within("length", length, 1e-6, 1.0, "m (pass metres: 2.5*mm)")
    check_within("power", power, 1.0, 4.0, "(1: linear, 2: parabolic)")


def _check_profile_relief(name: str, amount: float, length: float | None, power: float, d: float | None) -> None:
    name_d = f"d_{name.replace('_', '')}"
    if (length is None) == (d is None):
        raise ValueError(f"a relief begins at a roll length or at a diameter: got length {length} and {name_d} {d}")
    if d is not None:
        check_within(name_d, d, 1e-6, 100.0, "m (pass metres: 150*mm)")
    _check_relief(name, amount, 1.0 if length is None else length, power)


def _check_on_flank(length: float, face: FlankExtent, name_d: str, d: float | None) -> None:
    if d is not None and length < 1e-6:
        ends = f"{name_d}, where a relief begins, must lie away from the circle where it ends"
        raise ValueError(f"{ends}, got {d / MM:g} mm; that is a relief of no length")
    check_within("length", length, 1e-6, (face.roll_tip - face.roll_form) * (1 + 1e-9), "m, the roll of the flank")


def _share(inside, length: float, power: float) -> np.ndarray:
    """0 up to where the relief begins, 1 at its end; inside counts from the beginning [m]."""
    return np.maximum(inside / length, 0.0) ** power


def _if_sharp(edge: float, power: float) -> tuple[float, ...]:
    """The edge where a relief begins, unless it leaves the flank as smoothly as a parabola."""
    return (edge,) if power < 2 else ()


@short(C_a="um", length="mm", d_Ca="mm")
@dataclass(frozen=True)
class TipRelief:
    """C_a [m] at the tip, over the last length of roll [m] or outside the diameter d_Ca [m].

    power 1: linear, 2: parabolic, which is also the circular arc that leaves the flank tangentially: they differ by
    (C_a / length)^2 / 4 of C_a, 1e-5 for 15 um over 2.5 mm.
    """

    C_a: float
    length: float | None = None
    power: float = 1.0
    d_Ca: float | None = None

    def __post_init__(self):
        as_floats(self)
        _check_profile_relief("C_a", self.C_a, self.length, self.power, self.d_Ca)

    def reach(self, face: FlankExtent) -> float:
        """Roll length from the relief's beginning to the tip [m]."""
        return self.length if self.d_Ca is None else face.roll_tip - face.roll_at(self.d_Ca, "d_Ca")  # type: ignore[return-value]

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the relief begins on the flank."""
        _check_on_flank(self.reach(face), face, "d_Ca", self.d_Ca)

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return _if_sharp(face.roll_tip - self.reach(face), self.power)

    def removed(self, face: FlankExtent, roll, axial):
        length = self.reach(face)
        return self.C_a * _share(roll - (face.roll_tip - length), length, self.power) + 0 * axial


@short(radius="mm")
@dataclass(frozen=True)
class EdgeBreak:
    """Tip edge rounded with a radius [m] in the transverse section, tangent to the flank and to the tip circle.

    It takes the radius times tan(45 deg - alpha_a / 2) of the profile, alpha_a the pressure angle at the tip;
    `GearPair.eps_alpha` stays that of the tip circle. What touches beyond the path of contact is the rounding, with a
    peak pressure that finer strips, slices and finite elements change by less than 3 % of its largest value over the
    cycle; in helical gears of 20 slices by less than 3.5 %, and any one phase by 5 %.
    """

    radius: float

    def __post_init__(self):
        as_floats(self)
        check_within("radius", self.radius, 1e-6, 0.1, "m (pass metres: 0.2*mm)")

    def length(self, face: FlankExtent) -> float:
        """Length of the profile from where the rounding begins to the tip circle [m]."""
        return self.radius * tan(pi / 4 - atan(face.roll_tip / face.r_b) / 2)

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the roundings of both flanks fit on the tip, and the flank keeps half of its profile."""
        largest = min(face.land, (face.roll_tip**2 - face.roll_form**2) / (2 * face.r_b)) / 2
        largest *= self.radius / self.length(face)
        check_within("radius", self.radius, 1e-6, largest, "m (half the tip, half the profile)")

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return (self.rounding(face)[0],)

    def rounding(self, face: FlankExtent) -> tuple[float, float]:
        return sqrt(face.roll_tip**2 - 2 * face.r_b * self.length(face)), self.radius

    def removed(self, face: FlankExtent, roll, axial):
        begin, radius = self.rounding(face)
        along = np.clip((roll**2 - begin**2) / (2 * face.r_b), 0.0, radius)
        return along**2 / (radius + np.sqrt(radius**2 - along**2)) + 0 * axial


@short(C_f="um", length="mm", d_Cf="mm")
@dataclass(frozen=True)
class RootRelief:
    """C_f [m] at the root form circle, over the first length of roll [m] or inside the diameter d_Cf [m].

    power as in TipRelief.
    """

    C_f: float
    length: float | None = None
    power: float = 1.0
    d_Cf: float | None = None

    def __post_init__(self):
        as_floats(self)
        _check_profile_relief("C_f", self.C_f, self.length, self.power, self.d_Cf)

    def reach(self, face: FlankExtent) -> float:
        """Roll length from the root form circle to the relief's end [m]."""
        return self.length if self.d_Cf is None else face.roll_at(self.d_Cf, "d_Cf") - face.roll_form  # type: ignore[return-value]

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the relief ends on the flank."""
        _check_on_flank(self.reach(face), face, "d_Cf", self.d_Cf)

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return _if_sharp(face.roll_form + self.reach(face), self.power)

    def removed(self, face: FlankExtent, roll, axial):
        length = self.reach(face)
        return self.C_f * _share(face.roll_form + length - roll, length, self.power) + 0 * axial


@short(C_alpha="um")
@dataclass(frozen=True)
class ProfileCrowning:
    """C_alpha [m] at tip and root form, 0 in the middle of the roll between them."""

    C_alpha: float

    def __post_init__(self):
        as_floats(self)
        check_amount("C_alpha", self.C_alpha)

    def removed(self, face: FlankExtent, roll, axial):
        middle, half = (face.roll_tip + face.roll_form) / 2, (face.roll_tip - face.roll_form) / 2
        return self.C_alpha * ((roll - middle) / half) ** 2 + 0 * axial


@short(C_beta="um")
@dataclass(frozen=True)
class LeadCrowning:
    """C_beta [m] at both end faces, 0 in the middle."""

    C_beta: float

    def __post_init__(self):
        as_floats(self)
        check_amount("C_beta", self.C_beta)

    def removed(self, face: FlankExtent, roll, axial):
        return self.C_beta * (2 * axial / face.width) ** 2 + 0 * roll


@short(C_Hbeta="um")
@dataclass(frozen=True)
class HelixSlope:
    """C_Hbeta [m] from end face to end face, 0 in the middle; > 0 removes material on the side of positive z."""

    C_Hbeta: float

    def __post_init__(self):
        as_floats(self)
        check_amount("C_Hbeta", self.C_Hbeta)

    def removed(self, face: FlankExtent, roll, axial):
        return self.C_Hbeta * axial / face.width + 0 * roll


@short(C_e="um", length="mm")
@dataclass(frozen=True)
class EndRelief:
    """C_e [m] at both end faces, over the outer length of face width [m]; power as in TipRelief."""

    C_e: float
    length: float
    power: float = 1.0

    def __post_init__(self):
        as_floats(self)
        _check_relief("C_e", self.C_e, self.length, self.power)

    def check(self, face: FlankExtent) -> None:
        """ValueError unless both ends fit on the face."""
        check_within("length", self.length, 1e-6, face.width / 2 * (1 + 1e-9), "m (up to half the face width)")

    def edges_across(self, face: FlankExtent) -> tuple[float, ...]:
        inside = _if_sharp(face.width / 2 - self.length, self.power)
        return (*inside, *(-edge for edge in inside))

    def removed(self, face: FlankExtent, roll, axial):
        inside = np.abs(axial) - (face.width / 2 - self.length)
        return self.C_e * _share(inside, self.length, self.power) + 0 * roll
