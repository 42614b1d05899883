"""Checks of input: ValueError with argument, value and remedy; numbers of any library become Python floats."""

import sys
from collections.abc import Iterator
from dataclasses import fields
from numbers import Real
from types import ModuleType
from typing import SupportsIndex

import numpy as np

#: Longest text of a value in a message; of a longer one the message names the class.
LONGEST = 120


def require(condition: bool, message: str) -> None:
    """Raise ValueError(message) unless condition holds; NaN never holds."""
    if not condition:
        raise ValueError(message)


def require_within(name: str, value: float, low: float, high: float, *, unit: float = 1.0, remedy: str) -> None:
    """Require low < value < high; the message shows bounds and value in multiples of unit."""
    low_, high_, value_ = low / unit, high / unit, value / unit
    require(low < value < high, f"{name} must lie in ({low_:g}, {high_:g}) {remedy}, got {value_:g}")


def require_kind(name: str, value, kind: type) -> None:
    """ValueError unless the value is an instance of that class."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} must be {kind_name(kind)}, got {text_of(value)}")


def kind_name(kind: type) -> str:
    """Name of a class as the user imports it, with its article: a fem.GearPair."""
    name = f"{_exporting_module(kind)}.{kind.__name__}".removeprefix("builtins.")
    return f"{'an' if name[0] in 'aeioux' else 'a'} {name}"


def _exporting_module(kind: type) -> str:
    """The package or public module that exports a class, else the module that defines it."""
    top = kind.__module__.split(".")[0]
    package = sys.modules.get(top)
    public = {top: package} | {f"{top}.{name}": getattr(package, name) for name in getattr(package, "__all__", ())}
    modules = {name: value for name, value in public.items() if isinstance(value, ModuleType)}
    exporting = (name for name, module in modules.items() if getattr(module, kind.__name__, None) is kind)
    return next(exporting, kind.__module__)


def text_of(value) -> str:
    """Text of a value in an error message; the name of its class where that is long."""
    if isinstance(value, int) and value.bit_length() > 1024:
        return "a number beyond those of floats"
    text = repr(value)
    return text if len(text) <= LONGEST else kind_name(type(value))


def require_finite(name: str, values, remedy: str = "") -> None:
    """ValueError with the first of the values that is not finite, and its index in an array."""
    array = np.asarray(values, float)
    finite = np.isfinite(array)
    if not finite.all():
        index = np.argwhere(~finite)[0]
        at = f" at {index.tolist()}" if array.ndim else ""
        raise ValueError(f"{name} must be finite, got {array[tuple(index)]:g}{at}{remedy and '; '}{remedy}")


def number(name: str, value) -> float:
    """The value as a Python float; ValueError unless it is a real number within the range of floats."""
    if isinstance(value, float):
        return float(value)
    plain = value.item() if getattr(value, "shape", None) == () else value
    try:
        if isinstance(plain, Real):
            return float(plain)
    except OverflowError:
        pass
    raise ValueError(f"{name} must be one real number in SI units, got {text_of(value)}")


def finite(name: str, value) -> float:
    """The value as a Python float; ValueError unless it is a finite number."""
    require_finite(name, number(name, value))
    return float(value)


def whole_number(name: str, value) -> int:
    """The value as a Python int, also of an Exudyn item index; ValueError unless it is a whole number."""
    plain = int(value) if isinstance(value, SupportsIndex) else value
    if number(name, plain) % 1 != 0:
        raise ValueError(f"{name} must be a whole number, got {text_of(value)}")
    return int(plain)


def numbers(name: str, values) -> np.ndarray:
    """The values as an array of floats; ValueError unless they are real numbers in rows of equal length."""
    try:
        array = np.asarray(list(values) if isinstance(values, Iterator) else values)
    except (TypeError, ValueError):
        array = np.empty(0, object)
    require(not np.ma.is_masked(values), f"{name} must hold a value everywhere, got masked values; leave them out")
    if array.dtype.kind not in "fiu":
        rows = f"{name} must hold real numbers, in rows of equal length if there are several"
        raise ValueError(f"{rows}, got {text_of(values)}")
    return array.astype(float)


def increasing(name: str, values, *, least: int = 1) -> np.ndarray:
    """The values as an array of floats (n,); ValueError unless there are at least `least` and they increase."""
    axis = numbers(name, values)
    require(axis.ndim == 1, f"{name} must increase along one axis (n,), got the shape {axis.shape}")
    if np.isnan(axis).any():
        require_finite(name, axis)
    if axis.size < least:
        raise ValueError(f"{name} must increase over at least {least} values, got {text_of(values)}")
    if not increases(axis):
        raise ValueError(f"{name} must increase; sort it, got {text_of(values)}")
    return axis


def increases(values: np.ndarray) -> bool:
    """Whether values (..., n) increase along their last axis; NaN does not."""
    return not np.isnan(values).any() and bool((np.diff(values) > 0).all())


def set_fields(instance, **values) -> None:
    """Set fields of a frozen dataclass while it is made."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def as_floats(instance) -> None:
    """Convert the number fields of a frozen dataclass to Python floats; None stays where it is the default."""
    for part in fields(instance):
        value = getattr(instance, part.name)
        absent = value is None and part.default is None
        if part.type in (float, float | None) and not absent:
            set_fields(instance, **{part.name: number(part.name, value)})
