"""Fingerprints of functions and values by their content: equal in every process, different after any change.

A function counts with its byte code, its defaults, what it encloses, and the functions, values and modules of the user
that it names, in turn. What belongs to Python or to an installed package counts by its name, `fem` and `exugear` by the
text of their modules.
"""

import hashlib
import pickle
import sys
from dataclasses import fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np
import xarray as xr

from fem.support import version

#: Folders of `exugear` and `fem`, whose modules count as a whole.
HOMES = Path(__file__).parents[1], Path(version.__file__).parents[1]


def fingerprint(value: Any) -> str:
    """32 digits that belong to the content of a value or a function.

    Raises TypeError for objects whose content cannot be told.
    """
    digest = hashlib.sha256()
    _Digest(digest.update).add(value)
    return digest.hexdigest()[:32]


@cache
def program_stamp() -> str:
    """Fingerprint of Python's version and of all modules of `fem` and `exugear`."""
    digest = hashlib.sha256(f"{version.__version__} {sys.version_info[:2]}".encode())
    for home in HOMES:
        for path in sorted(home.rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:32]


class _Digest:
    """Adds values to a digest, each function and module once."""

    def __init__(self, update):
        self.update, self.seen = update, set()

    def text(self, *words: str) -> None:
        self.update("\0".join(("", *words)).encode())

    def add(self, value: Any) -> None:
        """Add a value by its content."""
        kind = type(value)
        if value is None or isinstance(value, bool | int | float | complex | str | bytes):
            self.text(kind.__name__, repr(value))
        elif isinstance(value, np.generic):
            self.add(value.item())
        elif isinstance(value, np.ndarray):
            self._array(value)
        elif isinstance(value, xr.Dataset | xr.DataArray):
            self.add(value.to_dict(data="array"))
        elif isinstance(value, dict):
            self.text("dict", str(len(value)))
            for name in sorted(value, key=repr):
                self.add(name)
                self.add(value[name])
        elif isinstance(value, tuple | list):
            self._sequence(kind.__name__, value)
        elif isinstance(value, set | frozenset):
            self._sequence(kind.__name__, sorted(value, key=repr))
        elif isinstance(value, partial):
            self._sequence("partial", [value.func, value.args, value.keywords])
        elif isinstance(value, type | ModuleType | BuiltinFunctionType | np.ufunc):
            self._named(value)
        elif isinstance(value, MethodType):
            self._sequence("method", [value.__self__, value.__func__])
        elif isinstance(value, FunctionType):
            self._function(value)
        elif isinstance(value, CodeType):
            self._sequence("code", [value.co_code, value.co_consts, value.co_names, value.co_varnames])
        elif callable(getattr(value, "__wrapped__", None)):
            self.add(value.__wrapped__)
        else:
            self._instance(value)

    def _sequence(self, word: str, values) -> None:
        self.text(word, str(len(values)))
        for each in values:
            self.add(each)

    def _array(self, value: np.ndarray) -> None:
        if value.dtype.hasobject:
            self._sequence(f"array {value.shape}", value.ravel().tolist())
        else:
            self.text("array", value.dtype.str, str(value.shape))
            self.update(np.ascontiguousarray(value).tobytes())

    def _instance(self, value: Any) -> None:
        """An object by its class and its fields; one of no Python class by what it is pickled to."""
        kind = type(value)
        self._named(kind)
        if callable(value) and isinstance(kind.__call__, FunctionType):
            self.add(kind.__call__)
        if is_dataclass(value):
            self._sequence("fields", [getattr(value, part.name, None) for part in fields(value) if part.init])
        elif hasattr(value, "dist") and hasattr(value, "kwds"):  # a distribution of scipy.stats
            self._sequence("distribution", [value.dist.name, value.args, value.kwds])
        else:
            try:
                self.update(pickle.dumps(value))
            except Exception as error:
                raise TypeError(f"the content of a {kind.__name__} cannot be told ({error})") from None

    def _named(self, value: Any) -> None:
        """A class, module or built-in function by its name; one of the user with the text of its module."""
        home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None) or ""
        file = getattr(sys.modules.get(home), "__file__", None)
        of_user = bool(file) and not installed(Path(str(file)))
        self.text("" if of_user else home, getattr(value, "__qualname__", getattr(value, "__name__", "")))
        if of_user and file not in self.seen:
            self.seen.add(file)
            self.update(Path(str(file)).read_bytes())

    def _function(self, function: FunctionType) -> None:
        file = Path(function.__code__.co_filename)
        if installed(file):
            self.text("function", str(function.__module__), function.__qualname__)
            return
        self.text("function", function.__qualname__)  # of a script or of its module alike
        if id(function) in self.seen:
            return
        self.seen.add(id(function))
        enclosed = [cell.cell_contents for cell in function.__closure__ or ()]
        self._sequence("parts", [function.__code__, function.__defaults__, function.__kwdefaults__, enclosed])
        for known in sorted(_names(function.__code__) & function.__globals__.keys()):
            self.text(known)
            self.add(function.__globals__[known])


def _names(code: CodeType) -> set[str]:
    """Names that a code uses, and the codes inside it."""
    inside = [_names(part) for part in code.co_consts if isinstance(part, CodeType)]
    return set(code.co_names).union(*inside)


@cache
def installed(file: Path) -> bool:
    """Whether a file belongs to Python, to an installed package, or to `fem` and `exugear`."""
    homes = [*HOMES, Path(np.__file__).parents[1], Path(hashlib.__file__).parent]
    return any(file.is_relative_to(home) for home in homes) or str(file).startswith("<frozen")
