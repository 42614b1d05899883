"""Checks of the arguments of public functions and classes against their type hints, at each call."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import InitVar
from functools import cache, wraps
from inspect import Parameter, signature
from io import IOBase
from os import PathLike
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from fem.support.user_warning import warn_renamed
from fem.support.validation import finite, kind_name, number, numbers, text_of, whole_number

Checked = TypeVar("Checked", bound=Callable)
#: Hints of arguments that take real numbers in arrays of any shape, a finite number, or the name of a file.
Numbers = Annotated[Any, numbers]
Finite = Annotated[float, finite]
FilePath = str | PathLike[str]
#: Default of an argument that must be given although it follows others with defaults, as in Exudyn's Create functions.
REQUIRED: Any = None
#: Default of a field that follows from the others unless it is given.
DERIVED: Any = None
#: Checks of the hints, which raise ValueError, and the words for the hints in messages.
CHECKS: dict[Any, Callable] = {float: number, int: whole_number, np.ndarray: numbers}
WORDS = {
    float: "a real number",
    finite: "a finite number",
    numbers: "real numbers",
    int: "a whole number",
    np.ndarray: "real numbers",
    bool: "True or False",
    str: "a string",
    PathLike: "a path",
    Callable: "a function",
    type(None): "None",
}


def checked(function: Checked) -> Checked:
    """Decorator of a function or class: its arguments must match their type hints.

    A hint Annotated[Any, check] calls check(name, value). Arguments without a hint, and defaults, are not checked.
    Raises ValueError with the argument, what it must be, and its value.
    """
    if isinstance(function, type):
        constructor = "__new__" if issubclass(function, tuple) else "__init__"
        setattr(function, constructor, checked(getattr(function, constructor)))
        return function

    @wraps(function)
    def checking(*args, **kwargs):
        args, kwargs = tuple(map(_repeatable, args)), {name: _repeatable(value) for name, value in kwargs.items()}
        hints, further = _hints(function)
        for name, value in (*zip(hints, args, strict=False), *kwargs.items()):
            hint, default = hints.get(name, further)
            if value is not default and (type(value) is not hint or hint is int):
                check_kind(name, value, hint)
        return function(*args, **kwargs)

    return cast(Checked, checking)


def keywords_after_first(*names: str) -> Callable[[Checked], Checked]:
    """Decorator of a function whose arguments after the first one are keywords.

    names   of arguments that an earlier version took by position, in its order; they still may be, with a
            DeprecationWarning that names them

    Further positional arguments raise TypeError in words.
    """

    def decorated(function: Checked) -> Checked:
        keywords = [name for name, x in signature(function).parameters.items() if x.kind is Parameter.KEYWORD_ONLY]

        @wraps(function)
        def calling(*args, **kwargs):
            further = args[1:]
            if not further:
                return function(*args, **kwargs)
            written = ", ".join(f"{name}=..." for name in names[: len(further)] or keywords[:2])
            remedy = f"{function.__name__} takes all arguments after the first one by their names: write {written}"
            twice = [name for name in names[: len(further)] if name in kwargs]
            if len(further) > len(names) or twice:
                raise TypeError(f"{remedy}; got {len(further)} by position{f', {twice} twice' if twice else ''}")
            warnings.warn(remedy, DeprecationWarning, stacklevel=2)
            return function(args[0], **dict(zip(names, further, strict=False)), **kwargs)

        return cast(Checked, calling)

    return decorated


def renamed(**names: str) -> Callable[[Checked], Checked]:
    """Decorator of a function or class: keywords of an earlier version still work, with a DeprecationWarning.

    names   earlier name -> name
    """

    def decorated(function: Checked) -> Checked:
        if isinstance(function, type):
            constructor = "__new__" if issubclass(function, tuple) else "__init__"
            setattr(function, constructor, decorated(getattr(function, constructor)))
            return function

        @wraps(function)
        def calling(*args, **kwargs):
            for earlier in names.keys() & kwargs.keys():
                twice = f"{names[earlier]} must be given once, got {earlier} too, its earlier name"
                if names[earlier] in kwargs:
                    raise TypeError(twice)
                warn_renamed(f"{earlier}=", f"{names[earlier]}=")
                kwargs[names[earlier]] = kwargs.pop(earlier)
            return function(*args, **kwargs)

        return cast(Checked, calling)

    return decorated


def _repeatable(value):
    """A generator or an iterator over a list as a list: checks read it before the function does."""
    return list(value) if isinstance(value, Iterator) and not isinstance(value, IOBase) else value


@cache
def _hints(function: Callable) -> tuple[dict[str, tuple[Any, Any]], tuple[Any, Any]]:
    """Hint and default of each named argument of a function, and of its further keyword arguments (**kwargs)."""
    hints, named, further = get_type_hints(function, include_extras=True), {}, (Any, None)
    for name, parameter in signature(function).parameters.items():
        hint = hints.get(name, Any)
        hint_and_default = (hint.type if isinstance(hint, InitVar) else hint), parameter.default
        if parameter.kind is Parameter.VAR_KEYWORD:
            further = hint_and_default
        else:
            named[name] = hint_and_default
    return named, further


def check_kind(name: str, value, hint) -> None:
    """ValueError unless the value matches a type hint, with the message of the hint's check if it has a check."""
    if _matches(value, hint):
        return
    annotated = [part for part in get_args(hint) if get_origin(part) is Annotated]
    for check in filter(None, map(_check_of, [hint, *annotated])):
        check(name, value)
    raise ValueError(f"{name} must be {_words(hint)}, got {text_of(value)}")


def _check_of(hint) -> Callable | None:
    return hint.__metadata__[0] if get_origin(hint) is Annotated else CHECKS.get(hint)


@cache
def _parts_of(hint) -> tuple[Callable | None, Any, tuple]:
    """Check, origin and arguments of a hint."""
    return _check_of(hint), get_origin(hint), get_args(hint)


def _matches(value, hint) -> bool:
    check, origin, parts = _parts_of(hint)
    if check is not None:
        try:
            check("", value)
        except ValueError:
            return False
        return True
    if hint is Any or isinstance(hint, TypeVar):
        return True
    if origin in (Union, UnionType):
        return any(_matches(value, part) for part in parts)
    if origin is None or origin in (Callable, PathLike):
        kind = (bool, np.bool_) if hint is bool else origin or hint
        return isinstance(value, kind)
    if issubclass(origin, Mapping):
        pairs = value.items() if isinstance(value, Mapping) else ()
        return isinstance(value, Mapping) and all(
            _matches(x, part) for pair in pairs for x, part in zip(pair, parts, strict=True)
        )
    return _matches_sequence(value, parts)


def _matches_sequence(value, parts: tuple) -> bool:
    """Whether a value is a sequence that matches the parts of a hint; equal parts match sequences of any length."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        return False
    if isinstance(value, Iterator):
        return True
    if len(set(parts) - {...}) > 1:
        return isinstance(value, tuple | list) and len(value) == len(parts) and all(map(_matches, value, parts))
    return _matches(value, Numbers) if parts[0] is float else all(_matches(x, parts[0]) for x in value)


def _words(hint) -> str:
    """Words for a hint in a message."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        *first, last = [_words(part) for part in parts]
        return f"{', '.join(first)} or {last}"
    if origin is Annotated:
        return WORDS.get(hint.__metadata__[0]) or _words(parts[0])
    if hint in WORDS or origin in WORDS:
        return WORDS.get(hint) or WORDS[origin]
    if origin is None:
        return kind_name(hint)
    if issubclass(origin, Mapping):
        return f"a mapping of {_words(parts[0])} to {_words(parts[1])}"
    return f"a list, each {_words(parts[0])}"
