"""Designed flank modifications: material removed [m] over roll length and axial position (ISO 21771).

Amounts are measured along the flank's normal in the transverse section; positive values remove material. Each
modification is a small frozen object; `fem.microgeometry.flank` adds them up.

Each formula is a function of numbers or arrays that numpy and compiled code share (`fem.microgeometry.compiled_flank`);
`numbers` of a modification are its first arguments.

To add a modification, write a frozen dataclass with the method `removed` and, where they apply, the further methods of
`Modification`, and list it in `DESIGNED`. Contacts call `removed` back from compiled code, which costs a few
microseconds a call; with a formula in `fem.microgeometry.compiled_flank.FORMULAS` they do not.
"""

from dataclasses import dataclass
from math import atan, copysign, hypot, inf, pi, sqrt, tan
from typing import NamedTuple, Protocol

import numpy as np

from fem.support.representation import short
from fem.support.validation import as_floats
from fem.units import mm

#: Largest amount of material that a modification or deviation adds or removes [m].
LARGEST_AMOUNT = 1 * mm


class FlankExtent(NamedTuple):
    """Extent of the flank of a tooth; of an internal gear with the signs of `fem.gear.gear`.

    roll_form, roll_tip     roll lengths at root form and tip circle [m]
    width                   face width [m]; axial positions count from its middle
    r_b                     base radius [m]
    z                       number of teeth
    tooth                   number of this tooth, counter-clockwise from tooth 0
    land                    transverse tooth thickness at the tip circle [m]
    slope                   tangent of the base helix angle
    """

    roll_form: float
    roll_tip: float
    width: float
    r_b: float = 0.0
    z: int = 1
    tooth: int | np.ndarray = 0
    land: float = inf
    slope: float = 0.0

    def roll_at(self, d: float, name: str = "d") -> float:
        """Roll length on the circle of diameter d [m], called name in the ValueError where it misses the flank."""
        low, high = (copysign(2 * hypot(roll, self.r_b), self.z) for roll in (self.roll_form, self.roll_tip))
        signed, rounding = -abs(d) if self.z < 0 else d, 1e-9 * abs(high)
        if not low - rounding <= signed <= high + rounding:
            limits = f"[{low / mm:.6g}, {high / mm:.6g}] mm, from root form to tip circle"
            raise ValueError(f"{name}, where a relief begins, must lie in {limits}, got {d / mm:g} mm")
        return copysign(sqrt(max(d * d / 4 - self.r_b**2, 0.0)), self.z)


class Modification(Protocol):
    """Interface of flank modifications; the following methods are optional.

    check(face)         raises ValueError where the modification does not suit the flank
    edges(face)         roll lengths where the slope along the profile jumps, or rises steeply [m]
    edges_across(face)  axial positions where the slope across the face width jumps, or rises steeply [m]
    lines_across(face)  axial grid lines between which the material is linear [m], if there are many
    rounding(face)      roll length where a rounded tip edge begins [m], and its radius [m]
    """

    def removed(self, face: FlankExtent, roll: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Material removed [m] at roll lengths and axial positions [m], broadcast."""
        ...


def check_within(name: str, value: float, low: float, high: float, unit: str) -> None:
    """ValueError unless low <= value <= high."""
    if not low <= value <= high:
        raise ValueError(f"{name} must lie in [{low:g}, {high:g}] {unit}, got {value}")


def check_amount(name: str, value: float) -> None:
    """ValueError unless an amount of material lies within 1 mm."""
    check_within(name, value, -LARGEST_AMOUNT, LARGEST_AMOUNT, "m (pass metres: 15*um)")


def _check_relief(name: str, amount: float, length: float, power: float) -> None:
    check_amount(name, amount)
    check_within("length", length, 1e-6, 1.0, "m (pass metres: 2.5*mm)")
    check_within("power", power, 1.0, 4.0, "(1: linear, 2: parabolic)")


def _check_profile_relief(name: str, amount: float, length: float | None, power: float, d: float | None) -> None:
    name_d = f"d_{name.replace('_', '')}"
    if (length is None) == (d is None):
        got = f"got length {length} and {name_d} {d}"
        raise ValueError(f"a relief begins at a roll length or at a diameter; give length or {name_d}, {got}")
    if d is not None:
        check_within(name_d, abs(d), 1e-6, 100.0, "m (pass metres: 150*mm)")
    _check_relief(name, amount, 1.0 if length is None else length, power)


def _check_on_flank(length: float, face: FlankExtent, name_d: str, d: float | None) -> None:
    if d is not None and length < 1e-6:
        apart = f"{name_d}, where a relief begins, must lie away from the circle where it ends"
        raise ValueError(f"{apart}, got {d / mm:g} mm; such a relief has no length")
    check_within("length", length, 1e-6, (face.roll_tip - face.roll_form) * (1 + 1e-9), "m, the roll of the flank")


def relief(amount, begin, length, power, at):
    """Material removed [m] at a roll length or axial position by a relief that begins at another one.

    Where its length is negative it grows in the other direction. Lines and parabolas need no logarithm.
    """
    share = np.maximum((at - begin) / length, 0.0)
    if power == 1.0:
        return amount * share
    return amount * (share * share if power == 2.0 else share**power)


def rounded_edge(begin, radius, r_b, roll):
    """Material removed [m] by the rounding of a tip edge."""
    arc = np.minimum(np.maximum((roll * roll - begin * begin) / (2 * r_b), 0.0), radius)
    return arc * arc / (radius + np.sqrt(radius * radius - arc * arc))


def profile_crowning(amount, middle, half, roll):
    """Material removed [m] by a parabola over the roll length."""
    return amount * ((roll - middle) / half) ** 2


def lead_crowning(amount, width, axial):
    """Material removed [m] by a parabola over the face width."""
    return amount * (2 * axial / width) ** 2


def helix_slope(amount, width, axial):
    """Material removed [m] by a straight line over the face width."""
    return amount * axial / width


def _edge(begin: float, power: float) -> tuple[float, ...]:
    """Where a relief begins, if its slope jumps there: a parabolic one leaves the flank tangentially."""
    return (begin,) if power < 2 else ()


@short(C_a="um", length="mm", d_Ca="mm")
@dataclass(frozen=True)
class TipRelief:
    """Tip relief C_a [m] at the tip circle; it begins a roll length before the tip or at the diameter d_Ca.

    C_a         amount at the tip circle [m]
    length      roll length from the beginning to the tip [m]; give it or d_Ca
    power       1: linear, 2: parabolic; the parabola differs from a circular arc that leaves the flank tangentially by
                (C_a / length)^2 / 4 of C_a, which is 1e-5 for 15 um over 2.5 mm
    d_Ca        diameter where the relief begins [m]

    Raises ValueError for values out of range, and unless exactly one of length and d_Ca is given.
    """

    C_a: float
    length: float | None = None
    power: float = 1.0
    d_Ca: float | None = None

    def __post_init__(self):
        as_floats(self)
        _check_profile_relief("C_a", self.C_a, self.length, self.power, self.d_Ca)

    def reach(self, face: FlankExtent) -> float:
        """Roll length from the beginning of the relief to the tip [m]."""
        return self.length if self.d_Ca is None else face.roll_tip - face.roll_at(self.d_Ca, "d_Ca")  # type: ignore[return-value]

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the relief begins on the flank."""
        _check_on_flank(self.reach(face), face, "d_Ca", self.d_Ca)

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return _edge(face.roll_tip - self.reach(face), self.power)

    def numbers(self, face: FlankExtent) -> tuple[float, float, float, float]:
        length = self.reach(face)
        return self.C_a, face.roll_tip - length, length, self.power

    def removed(self, face: FlankExtent, roll, axial):
        return relief(*self.numbers(face), roll) + 0 * axial


@short(radius="mm")
@dataclass(frozen=True)
class EdgeBreak:
    """Rounding of the tip edge with a radius [m] in the transverse section, tangent to the flank and the tip circle.

    It shortens the involute by radius tan(45 deg - alpha_a / 2) of the profile, with alpha_a the pressure angle at the
    tip; `GearPair.eps_alpha` stays that of the tip circle. Contact beyond the path of contact is on the rounding.
    Errors of the peak pressure there by strips, slices and finite elements, of its largest value over the mesh cycle: <
    3 % of spur gears, < 3.5 % of helical gears with 20 slices; < 5 % at any phase.

    Raises ValueError for a radius out of range.
    """

    radius: float

    def __post_init__(self):
        as_floats(self)
        check_within("radius", self.radius, 1e-6, 0.1, "m (pass metres: 0.2*mm)")

    def length(self, face: FlankExtent) -> float:
        """Length of the profile from where the rounding begins to the tip circle [m]."""
        return self.radius * tan(pi / 4 - atan(face.roll_tip / face.r_b) / 2)

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the roundings of both flanks fit on the tip and leave half of the profile."""
        largest = min(face.land, (face.roll_tip**2 - face.roll_form**2) / (2 * face.r_b)) / 2
        largest *= self.radius / self.length(face)
        check_within("radius", self.radius, 1e-6, largest, "m (half the tip, half the profile)")

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return (self.rounding(face)[0],)

    def rounding(self, face: FlankExtent) -> tuple[float, float]:
        return copysign(sqrt(face.roll_tip**2 - 2 * face.r_b * self.length(face)), face.r_b), self.radius

    def numbers(self, face: FlankExtent) -> tuple[float, float, float]:
        return *self.rounding(face), face.r_b

    def removed(self, face: FlankExtent, roll, axial):
        return rounded_edge(*self.numbers(face), roll) + 0 * axial


@short(C_f="um", length="mm", d_Cf="mm")
@dataclass(frozen=True)
class RootRelief:
    """Root relief C_f [m] at the root form circle; it ends a roll length after it or at the diameter d_Cf.

    C_f         amount at the root form circle [m]
    length      roll length from the root form circle to the end of the relief [m]; give it or d_Cf
    power       1: linear, 2: parabolic, as in `TipRelief`
    d_Cf        diameter where the relief ends [m]

    Raises ValueError for values out of range, and unless exactly one of length and d_Cf is given.
    """

    C_f: float
    length: float | None = None
    power: float = 1.0
    d_Cf: float | None = None

    def __post_init__(self):
        as_floats(self)
        _check_profile_relief("C_f", self.C_f, self.length, self.power, self.d_Cf)

    def reach(self, face: FlankExtent) -> float:
        """Roll length from the root form circle to the end of the relief [m]."""
        return self.length if self.d_Cf is None else face.roll_at(self.d_Cf, "d_Cf") - face.roll_form  # type: ignore[return-value]

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the relief ends on the flank."""
        _check_on_flank(self.reach(face), face, "d_Cf", self.d_Cf)

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return _edge(face.roll_form + self.reach(face), self.power)

    def numbers(self, face: FlankExtent) -> tuple[float, float, float, float]:
        length = self.reach(face)
        return self.C_f, face.roll_form + length, -length, self.power

    def removed(self, face: FlankExtent, roll, axial):
        return relief(*self.numbers(face), roll) + 0 * axial


@short(C_alpha="um")
@dataclass(frozen=True)
class ProfileCrowning:
    """Profile crowning C_alpha [m] at tip and root form circle, parabolic over the roll length, 0 in its middle."""

    C_alpha: float

    def __post_init__(self):
        as_floats(self)
        check_amount("C_alpha", self.C_alpha)

    def numbers(self, face: FlankExtent) -> tuple[float, float, float]:
        return self.C_alpha, (face.roll_tip + face.roll_form) / 2, (face.roll_tip - face.roll_form) / 2

    def removed(self, face: FlankExtent, roll, axial):
        return profile_crowning(*self.numbers(face), roll) + 0 * axial


@short(C_beta="um")
@dataclass(frozen=True)
class LeadCrowning:
    """Lead crowning C_beta [m] at both end faces, parabolic across the face width, 0 in its middle."""

    C_beta: float

    def __post_init__(self):
        as_floats(self)
        check_amount("C_beta", self.C_beta)

    def numbers(self, face: FlankExtent) -> tuple[float, float]:
        return self.C_beta, face.width

    def removed(self, face: FlankExtent, roll, axial):
        return lead_crowning(*self.numbers(face), axial) + 0 * roll


@short(C_Hbeta="um")
@dataclass(frozen=True)
class HelixSlope:
    """Helix slope C_Hbeta [m] from end face to end face, 0 in the middle; > 0 removes material towards positive z."""

    C_Hbeta: float

    def __post_init__(self):
        as_floats(self)
        check_amount("C_Hbeta", self.C_Hbeta)

    def numbers(self, face: FlankExtent) -> tuple[float, float]:
        return self.C_Hbeta, face.width

    def removed(self, face: FlankExtent, roll, axial):
        return helix_slope(*self.numbers(face), axial) + 0 * roll


@short(C_e="um", length="mm")
@dataclass(frozen=True)
class EndRelief:
    """End relief C_e [m] at both end faces, over a length of the face width [m] each; power as in `TipRelief`.

    Raises ValueError for values out of range.
    """

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
        begin = _edge(face.width / 2 - self.length, self.power)
        return (*begin, *(-edge for edge in begin))

    def numbers(self, face: FlankExtent) -> tuple[float, float, float, float]:
        return self.C_e, face.width / 2 - self.length, self.length, self.power

    def removed(self, face: FlankExtent, roll, axial):
        return relief(*self.numbers(face), np.abs(axial)) + 0 * roll


DESIGNED = (TipRelief, RootRelief, ProfileCrowning, LeadCrowning, HelixSlope, EndRelief, EdgeBreak)
