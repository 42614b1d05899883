"""Checks of input: ValueError with argument, value and remedy; numbers of any library become Python's."""

from collections.abc import Iterator
from dataclasses import fields
from numbers import Real

import numpy as np


def require(condition: bool, message: str) -> None:
    """Raise ValueError(message) unless condition holds; NaN never holds."""
    if not condition:
        raise ValueError(message)


def require_within(name: str, value: float, low: float, high: float, *, unit: float = 1.0, remedy: str) -> None:
    """Require low < value < high; bounds and value are shown in multiples of unit."""
    low_, high_, value_ = low / unit, high / unit, value / unit
    require(low < value < high, f"{name} must lie in ({low_:g}, {high_:g}) {remedy}, got {value_:g}")


def require_kind(name: str, value, kind: type) -> None:
    """ValueError unless the value is an instance of that class."""
    require(isinstance(value, kind), f"{name} must be a {kind.__module__}.{kind.__name__}, got {value!r}")


def number(name: str, value) -> float:
    """The value as a Python float; ValueError unless it is one real number."""
    one = value.item() if getattr(value, "shape", None) == () else value
    require(isinstance(one, Real), f"{name} must be one real number in SI units, got {value!r}")
    return float(one)


def numbers(name: str, values) -> np.ndarray:
    """The values as an array of floats; ValueError where they are no numbers, or rows of unlike lengths."""
    given = list(values) if isinstance(values, Iterator) else values
    try:
        found = np.asarray(given)
    except ValueError:
        found = np.empty(0, object)
    one = f"{name} must hold real numbers, in rows of equal length if there are several"
    require(found.dtype.kind in "fiu", f"{one}, got {values!r}")
    return found.astype(float)


def as_floats(instance) -> None:
    """Make the number fields of a frozen dataclass Python floats; None stays where it is the default."""
    for part in fields(instance):
        value = getattr(instance, part.name)
        absent = value is None and part.default is None
        if part.type in (float, float | None) and not absent:
            object.__setattr__(instance, part.name, number(part.name, value))
