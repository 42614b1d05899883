"""Text representations of data: short, in the units of drawings, for people; exact to the last digit for cache keys."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from math import pi
from numbers import Real
from typing import Any, TypeVar

import numpy as np

#: Units that are shown instead of SI units.
SHOWN = {"mm": 1e-3, "um": 1e-6, "deg": pi / 180, "mrad": 1e-3, "GPa": 1e9}
#: Longest sequence of which all items are listed.
LISTED = 3
#: Number of fields shown of a nested dataclass, and longest text with them; else only the first field is shown.
NESTED, LONGEST_NESTED = 2, 64
#: Longest text of a dataclass; in a longer one, nested dataclasses show only their first field.
LONGEST = 200
_UNITS: dict[type, Mapping[str, str]] = {}
Kind = TypeVar("Kind", bound=type)


def short(**units: str) -> Callable[[Kind], Kind]:
    """Decorator of a dataclass: its repr shows the fields that differ from their defaults, in these units."""

    def decorated(kind: Kind) -> Kind:
        _UNITS[kind] = units
        changed: Any = kind
        changed.__repr__ = _repr
        return kind

    return decorated


def exact(value) -> str:
    """Text with all fields to the last digit, like the repr of a dataclass: the texts of different values differ.

    Raises TypeError for values whose text is abbreviated, such as arrays.
    """
    if is_dataclass(value) and not isinstance(value, type):
        parts = (f"{part.name}={exact(getattr(value, part.name))}" for part in fields(value) if part.repr)
        return f"{type(value).__qualname__}({', '.join(parts)})"
    if isinstance(value, tuple):
        return f"({', '.join(map(exact, value))}{',' * (len(value) == 1)})"
    if value is None or isinstance(value, str | int | float):
        return repr(value)
    raise TypeError(f"no exact text of a {type(value).__name__}; pass numbers, texts, tuples and dataclasses of them")


def field_text(kind: type, name: str, value) -> str:
    """Text of a field's value of a dataclass that is `short`, in its unit."""
    return _text(value, (_units(kind) or {}).get(name, ""), 0)


def quantity(value, unit: str = "") -> str:
    """A number in its unit, rounded to six digits."""
    return f"{_number(value, unit)} {unit}".rstrip()


def _number(value, unit: str) -> str:
    mantissa, _, exponent = f"{float(value) / SHOWN.get(unit, 1.0):.6g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def _units(kind: type) -> Mapping[str, str] | None:
    """Units of a dataclass that is `short`, or derived from one."""
    return next((_UNITS[base] for base in kind.__mro__ if base in _UNITS), None)


def _repr(instance) -> str:
    return _shown(instance, 0)


def _shown(instance, depth: int) -> str:
    """Text with name and fields; nested dataclasses are abbreviated."""
    given = [part for part in fields(instance) if part.repr and part.init]
    parts = [part for part in given if _differs_from_default(part, instance)] or given
    if depth == 0:
        text = _with_fields(instance, parts, len(parts), 0)
        return text if len(text) <= LONGEST else _with_fields(instance, parts, len(parts), 1)
    text = _with_fields(instance, parts, NESTED if depth == 1 else 1, depth)
    return text if len(text) <= LONGEST_NESTED else _with_fields(instance, parts, 1, depth)


def _with_fields(instance, parts: list[Field], most: int, depth: int) -> str:
    """Name of the class with at most so many fields; dots stand for the rest."""
    units = _units(type(instance)) or {}
    texts = [f"{p.name}={_text(getattr(instance, p.name), units.get(p.name, ''), depth)}" for p in parts[:most]]
    return f"{type(instance).__name__}({', '.join(texts + ['...'] * (len(parts) > most))})"


def _differs_from_default(part: Field, instance) -> bool:
    """Whether a field differs from its default."""
    default: Any = part.default if part.default_factory is MISSING else part.default_factory()
    value = getattr(instance, part.name)
    if isinstance(value, np.ndarray):
        return np.ndim(default) > 0 or value.ndim > 0 or float(value) != default
    return type(value) is not type(default) or bool(value != default)


def _text(value, unit: str, depth: int) -> str:
    if _units(type(value)) is not None:
        return _shown(value, depth + 1)
    if isinstance(value, Real) and not isinstance(value, bool | np.bool_):
        return quantity(value, unit)
    if hasattr(value, "data_vars"):
        return f"Dataset({', '.join(f'{name}: {size}' for name, size in value.sizes.items())})"
    if isinstance(value, Mapping):
        parts = (f"{_text(key, unit, depth)}: {_text(x, '', depth)}" for key, x in value.items())
        return f"{{{', '.join(parts)}}}"
    if isinstance(value, tuple | list | np.ndarray) and np.shape(value) != (0,):
        return _sequence(value, unit, depth)
    plain = repr(value)
    return plain if len(plain) <= LONGEST_NESTED else f"{type(value).__name__}(...)"


def _sequence(values, unit: str, depth: int) -> str:
    """Text of a sequence: its items if they are few, else their number, and the range of numbers."""
    try:
        numbers = np.asarray(values, float)
    except (TypeError, ValueError):
        listed = (LISTED, 1, 0)[min(depth, 2)]
        more = [f"{len(values) - listed} {'more' if listed else 'parts'}"] * (len(values) > listed)
        return f"[{', '.join([_text(x, unit, depth) for x in values[:listed]] + more)}]"
    if numbers.ndim == 0:
        return quantity(numbers, unit)
    if numbers.ndim == 1 and numbers.size <= LISTED:
        return f"[{', '.join(_number(x, unit) for x in numbers)}] {unit}".rstrip()
    count = " x ".join(map(str, numbers.shape))
    return f"{count} values from {_number(numbers.min(), unit)} to {quantity(numbers.max(), unit)}"
