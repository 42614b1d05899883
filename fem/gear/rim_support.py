"""Support of the rim of an internal gear: bolts, pins or splines at angles, and a bush all around.

Angles count from the middle of tooth 0 in the direction in which the teeth count, clockwise seen from +z. A support
acts at the outer diameter of the rim, over the whole face width; between bolts the rim is free.
"""

import json
from collections.abc import Iterable
from dataclasses import InitVar, asdict, dataclass, replace
from math import pi

import numpy as np

from fem.support.arguments import DERIVED
from fem.support.representation import short
from fem.support.validation import as_floats, increases, number, numbers, require, set_fields, text_of
from fem.units import mm

#: Angles that count as equal [rad].
ROUNDING = 1e-9
#: Stiffness of a support against its softest rigid motion, over that against the stiffest, below which it holds none.
LEAST_STIFFNESS = 1e-9


def _check_stiffness(support, unit: str) -> None:
    for name in ("radial", "tangential"):
        value = getattr(support, name)
        require(0 <= value < np.inf, f"{name} must be a stiffness >= 0 {unit}, got {value}; leave out what is not held")
    none = f"radial or tangential must be > 0 {unit}, got 0 for both; leave the support out"
    require(support.radial > 0 or support.tangential > 0, none)


@short(width="mm", first="deg", angles="rad")
@dataclass(frozen=True, kw_only=True)
class Bolts:
    """Bolts, pins or splines that hold the rim of an internal gear at angles; between them it is free.

    number      of equidistant ones
    first       angle of the first of them [rad]
    angles      of all of them [rad], instead of a number: increasing, over less than a turn
    radial      stiffness of each in the radial direction [N/m]; 0: free, as a pin in a radial slot
    tangential  stiffness of each along the circumference [N/m]; 0: free
    width       length of the circumference that each holds [m]

    Angles count from the middle of tooth 0 in the direction in which the teeth of the ring count.
    Raises ValueError for values out of range.
    """

    number: InitVar[int | None] = None
    first: InitVar[float] = 0.0
    angles: tuple[float, ...] = DERIVED
    radial: float
    tangential: float
    width: float

    def __post_init__(self, number_: int | None, first: float):
        as_floats(self)
        require((number_ is None) != (self.angles is None), "give the number of bolts or their angles, one of them")
        at, turn = number("first", first), f"first must lie in [-2 pi, 2 pi] (pass radians: 20*deg), got {first}"
        require(-2 * pi <= at <= 2 * pi, turn)
        require(at == 0 or self.angles is None, f"first belongs to a number of bolts, got {first} beside angles")
        if number_ is not None:
            count = number("number", number_)
            require(1 <= count <= 10_000 and count % 1 == 0, f"number must be a whole number of bolts, got {number_}")
            angles = at + 2 * pi * np.arange(int(count)) / int(count)
        else:
            angles = np.atleast_1d(numbers("angles", self.angles))
            within = bool(angles.ndim == 1 and angles.size > 0 and np.abs(angles).max() <= 4 * pi)
            require(within, f"angles must be angles of bolts [rad] within two turns, got {text_of(self.angles)}")
            turn = f"angles must increase over less than a turn (pass radians: 20*deg), got {text_of(self.angles)}"
            require(increases(angles) and angles[-1] - angles[0] < 2 * pi - ROUNDING, turn)
        set_fields(self, angles=tuple(angles.tolist()))
        _check_stiffness(self, "N/m")
        require(0 < self.width < np.inf, f"width must be > 0 m, got {self.width}")


@short()
@dataclass(frozen=True, kw_only=True)
class Bush:
    """An elastic bush, or another even support, around the rim of an internal gear.

    radial      stiffness in the radial direction per length of the circumference [N/m^2]
    tangential  the same along the circumference [N/m^2]

    Raises ValueError for values out of range.
    """

    radial: float
    tangential: float

    def __post_init__(self):
        as_floats(self)
        _check_stiffness(self, "N/m per metre of circumference")


Support = Bolts | Bush
KINDS = {"Bolts": Bolts, "Bush": Bush}


def supports_of(support) -> tuple[Support, ...]:
    """One or several supports as a tuple; ValueError for an object that is none."""
    parts = tuple(support) if isinstance(support, Iterable) else (support,)
    if not all(isinstance(part, Support) for part in parts):
        raise ValueError(f"support must hold fem.Bolts or fem.Bush, got {text_of(support)}")
    return parts


def mirrored(support: Support, about: float) -> Support:
    """The support of the mirror image of a ring, with bolts at an angle `about` minus theirs [rad]."""
    if isinstance(support, Bush):
        return support
    return replace(support, angles=tuple(about - angle for angle in reversed(support.angles)))


def check_supports(supports: tuple[Support, ...], radius: float) -> None:
    """ValueError unless the supports fit on a rim of this radius [m] and hold it against all rigid motions."""
    for bolts in supports:
        if isinstance(bolts, Bolts):
            apart = radius * float(np.diff(bolts.angles, append=bolts.angles[0] + 2 * pi).min())
            overlap = f"width of bolts must be at most their distance {apart / mm:.6g} mm along the outside of the rim"
            require(bolts.width <= apart * (1 + ROUNDING), f"{overlap}, got {bolts.width / mm:.6g} mm")
    stiffness = rigid_stiffness(supports, radius)
    against_rotation = "give it a tangential stiffness; the torque on the ring must go somewhere"
    require(stiffness[2, 2] > 0, f"support must hold the ring against rotation, got {supports}; {against_rotation}")
    least, *_, largest = np.linalg.eigvalsh(stiffness)
    held = "support must hold the ring against displacement and rotation"
    at_least = "take three bolts with a tangential stiffness, two with both stiffnesses, or a fem.Bush"
    require(bool(least > LEAST_STIFFNESS * largest), f"{held}, got {supports}; {at_least}")


def rigid_stiffness(supports: tuple[Support, ...], radius: float) -> np.ndarray:
    """(3, 3) stiffness against displacements along two axes and against rotation times the radius [N/m]."""
    total = np.zeros((3, 3))
    for support in supports:
        if isinstance(support, Bolts):
            sine, cosine = np.sin(support.angles), np.cos(support.angles)
            share = 1.0
        else:
            sine, cosine = np.sin(2 * pi * np.arange(8) / 8), np.cos(2 * pi * np.arange(8) / 8)
            share = 2 * pi * radius / 8
        radial = np.stack([cosine, sine, 0 * sine])
        tangential = np.stack([-sine, cosine, 1 + 0 * sine])
        total += share * (support.radial * radial @ radial.T + support.tangential * tangential @ tangential.T)
    return total


def period(supports: tuple[Support, ...]) -> float | None:
    """Least turn [rad] that leaves the supports as they are; None where any turn does, as of a bush."""
    bolts = [support for support in supports if isinstance(support, Bolts)]
    if not bolts:
        return None
    fewest = min(len(support.angles) for support in bolts)
    for parts in range(fewest, 0, -1):
        if all(_turned_into_itself(support.angles, parts) for support in bolts):
            return 2 * pi / parts
    return 2 * pi


def _turned_into_itself(angles: tuple[float, ...], parts: int) -> bool:
    """Whether angles that are turned by a part of a turn are the same angles."""
    if len(angles) % parts:
        return False
    step = len(angles) // parts
    unrolled = np.append(angles, np.array(angles) + 2 * pi)
    return bool(np.abs(unrolled[step : step + len(angles)] - angles - 2 * pi / parts).max() < ROUNDING)


def to_text(supports: tuple[Support, ...]) -> str:
    """The supports as JSON, for the attributes of a file; `from_text` reads them back."""
    return json.dumps([{"kind": type(support).__name__} | asdict(support) for support in supports])


def from_text(text: str) -> tuple[Support, ...]:
    """The supports that `to_text` wrote; ValueError for an unknown kind."""
    parts = json.loads(text)
    unknown = [part["kind"] for part in parts if part["kind"] not in KINDS]
    require(not unknown, f"unknown supports {unknown}; known are {list(KINDS)}")
    return tuple(KINDS[part["kind"]](**{k: v for k, v in part.items() if k != "kind"}) for part in parts)
