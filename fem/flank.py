"""Flank modifications: metres of material removed, normal to the flank, over roll length and axial place.

Each is a small frozen object; a gear carries a tuple of them and they add up. Positive values remove material. Terms
and symbols of ISO 21771 and ISO 1328.
"""

import json
from dataclasses import asdict, dataclass
from typing import NamedTuple, Protocol

import numpy as np

MM = 1e-3


class Face(NamedTuple):
    """Extent of a flank: roll lengths of root form and tip [m], face width [m]; axial places count from its middle."""

    roll_form: float
    roll_tip: float
    width: float


class Modification(Protocol):
    """What a flank may carry."""

    def removed(self, face: Face, roll: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Material removed [m] at roll lengths and axial places [m], broadcast."""
        ...


def _checked(name: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise ValueError(f"{name} must lie in [{low:g}, {high:g}] {unit}, got {value}")


def _check_amount(name: str, value: float) -> None:
    _checked(name, value, -1 * MM, 1 * MM, "m (pass metres: 15*um)")


def _check_relief(name: str, amount: float, length: float, power: float) -> None:
    _check_amount(name, amount)
    _checked("length", length, 1e-6, 1.0, "m (pass metres: 2.5*mm)")
    _checked("power", power, 1.0, 4.0, "(1: linear, 2: parabolic)")


def _share(inside: np.ndarray, length: float, power: float) -> np.ndarray:
    """0 up to where the relief begins, 1 at its end; inside counts from the beginning [m]."""
    return np.clip(inside / length, 0, None) ** power


@dataclass(frozen=True)
class TipRelief:
    """C_a [m] at the tip, over the last length of roll [m]; power 1: linear, 2: parabolic (and arc)."""

    C_a: float
    length: float
    power: float = 1.0

    def __post_init__(self):
        _check_relief("C_a", self.C_a, self.length, self.power)

    def removed(self, face: Face, roll, axial):
        inside = roll - (face.roll_tip - self.length)
        return self.C_a * _share(inside, self.length, self.power) + 0 * axial


@dataclass(frozen=True)
class RootRelief:
    """C_f [m] at the root form circle, over the first length of roll [m]; power as in TipRelief."""

    C_f: float
    length: float
    power: float = 1.0

    def __post_init__(self):
        _check_relief("C_f", self.C_f, self.length, self.power)

    def removed(self, face: Face, roll, axial):
        inside = face.roll_form + self.length - roll
        return self.C_f * _share(inside, self.length, self.power) + 0 * axial


@dataclass(frozen=True)
class ProfileCrowning:
    """C_alpha [m] at tip and root form, 0 in the middle of the roll between them."""

    C_alpha: float

    def __post_init__(self):
        _check_amount("C_alpha", self.C_alpha)

    def removed(self, face: Face, roll, axial):
        middle, half = (face.roll_tip + face.roll_form) / 2, (face.roll_tip - face.roll_form) / 2
        return self.C_alpha * ((roll - middle) / half) ** 2 + 0 * axial


@dataclass(frozen=True)
class LeadCrowning:
    """C_beta [m] at both end faces, 0 in the middle."""

    C_beta: float

    def __post_init__(self):
        _check_amount("C_beta", self.C_beta)

    def removed(self, face: Face, roll, axial):
        return self.C_beta * (2 * axial / face.width) ** 2 + 0 * roll


@dataclass(frozen=True)
class HelixSlope:
    """C_Hbeta [m] from end face to end face, 0 in the middle; > 0 removes material on the side of positive z."""

    C_Hbeta: float

    def __post_init__(self):
        _check_amount("C_Hbeta", self.C_Hbeta)

    def removed(self, face: Face, roll, axial):
        return self.C_Hbeta * axial / face.width + 0 * roll


@dataclass(frozen=True)
class EndRelief:
    """C_e [m] at both end faces, over the outer length of face width [m]; power as in TipRelief."""

    C_e: float
    length: float
    power: float = 1.0

    def __post_init__(self):
        _check_relief("C_e", self.C_e, self.length, self.power)

    def removed(self, face: Face, roll, axial):
        inside = np.abs(axial) - (face.width / 2 - self.length)
        return self.C_e * _share(inside, self.length, self.power) + 0 * roll


KINDS = {kind.__name__: kind for kind in (TipRelief, RootRelief, ProfileCrowning, LeadCrowning, HelixSlope, EndRelief)}
Flank = tuple[Modification, ...]


def removed(flank: Flank, face: Face, roll, axial) -> np.ndarray:
    """Sum of all modifications [m], broadcast over roll and axial."""
    roll, axial = np.asarray(roll, float), np.asarray(axial, float)
    return sum((part.removed(face, roll, axial) for part in flank), 0 * roll + 0 * axial)


def to_text(flank: Flank) -> str:
    """The modifications as JSON, for the attributes of a file; `from_text` reads them back."""
    return json.dumps([{"kind": type(part).__name__} | asdict(part) for part in flank])  # type: ignore[call-overload]


def from_text(text: str) -> Flank:
    """The modifications that `to_text` wrote; ValueError for a kind that is none."""
    parts = json.loads(text)
    unknown = [part["kind"] for part in parts if part["kind"] not in KINDS]
    if unknown:
        raise ValueError(f"unknown flank modifications {unknown}; known are {list(KINDS)}")
    return tuple(KINDS[part.pop("kind")](**part) for part in parts)
