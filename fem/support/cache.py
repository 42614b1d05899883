"""Arrays on disk, keyed by the inputs that they were computed from; a file is complete or absent.

Inputs and compiled code include a checksum of the source, so that nothing outlives the code that made it.
"""

import ast
import hashlib
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from errno import EISDIR
from functools import cache
from pathlib import Path
from threading import get_ident
from typing import BinaryIO
from zlib import crc32

import numpy as np

from fem.support.validation import require
from fem.support.version import __version__

Arrays = dict[str, np.ndarray]
#: The first definition of a module, before which its imports stand.
DEFINITION = re.compile(rb"^(?:def |class |@)", re.MULTILINE)


def folder() -> Path:
    """Cache folder: $EXUGEAR_CACHE, or exugear in the user's cache folder; OSError where the user has no home."""
    chosen, base = os.environ.get("EXUGEAR_CACHE"), os.environ.get("XDG_CACHE_HOME")
    if chosen:
        return Path(chosen)
    try:
        return Path(base or Path.home() / ".cache") / "exugear"
    except (RuntimeError, KeyError):
        raise OSError("there is no home folder") from None


def cached(inputs: str, compute: Callable[[], Arrays]) -> Arrays:
    """The arrays that compute() returns, from disk if they were computed from the same inputs before.

    Warns where they cannot be kept. Raises ValueError for arrays of Python objects, and for a file that is damaged or
    belongs to other inputs.
    """
    if known(inputs):
        return _read(_path(inputs), inputs)
    arrays = compute()
    kinds = {name: array.dtype for name, array in arrays.items() if array.dtype.hasobject}
    require(not kinds, f"cached arrays must hold numbers or text, got {kinds}; convert them")
    try:
        path = _path(inputs)
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(path, arrays | {"inputs": np.array(inputs)})
    except OSError as error:
        warn_not_kept(error)
    return arrays


def warn_not_kept(error: OSError) -> None:
    """Warn, once in a process, that the cache folder cannot be written."""
    cause = error.__cause__ or error
    reason = getattr(cause, "strerror", None) or cause
    try:
        name = f"cache folder {folder()}"
    except OSError:
        name = "cache folder"
    slow = "each process compiles and solves the compliances of gears anew, about a minute"
    warnings.warn(f"{name} cannot be written ({reason}): {slow}; set EXUGEAR_CACHE to a folder that can", stacklevel=1)


def known(inputs: str) -> bool:
    """Whether the cache has the arrays of these inputs."""
    try:
        return _path(inputs).exists()
    except OSError:
        return False


def _path(inputs: str) -> Path:
    return folder() / f"{hashlib.sha256(inputs.encode()).hexdigest()[:32]}.npz"


def _read(path: Path, inputs: str) -> Arrays:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = dict(stored)
        if str(arrays.pop("inputs")) == inputs:
            return arrays
    except Exception as error:
        raise ValueError(f"cache file {path} is damaged or foreign; remove it and run again ({error})") from None
    raise ValueError(f"cache file {path} is damaged or foreign; remove it and run again (made from other inputs)")


def _write(path: Path, arrays: Arrays) -> None:
    with complete_file(path) as file:
        np.savez(file, allow_pickle=False, **arrays)


@contextmanager
def complete_file(path: Path) -> Iterator[BinaryIO]:
    """A file to write, moved to path when it is complete; OSError that names the path where that fails."""
    if path.is_dir():
        raise IsADirectoryError(EISDIR, f"{path} is a folder; give the name of a file in it")
    part = path.with_name(f".{path.name}.{os.getpid()}.{get_ident()}.part")
    try:
        with part.open("wb") as file:
            yield file
        part.replace(path)
    except OSError as error:
        remedy = "make room or choose another folder" if path.parent.is_dir() else f"create the folder {path.parent}"
        reason = f"{path} could not be written: {error.strerror or error}; {remedy}"
        raise OSError(error.errno, reason) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


@cache
def imported(source: bytes) -> tuple[str, ...]:
    """Names of all modules that a source imports, and of what it imports from them.

    Only what stands before the first definition is parsed: to parse all would take a third of the time of imports.
    """
    try:
        tree = ast.parse(DEFINITION.split(source, maxsplit=1)[0])
    except SyntaxError:  # what seems to be a definition stands in a text
        tree = ast.parse(source)
    names: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(names)


def source_stamp(module: str) -> int:
    """Checksum of a module's source and of all that it imports, from its own package and from `fem`."""
    packages = {name.split(".")[0] for name in (__name__, module)}
    sources: dict[str, bytes] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        file = getattr(sys.modules.get(name), "__file__", None)
        if file and name not in sources and name.split(".")[0] in packages:
            sources[name] = _source(Path(file))
            waiting += imported(sources[name])
    return crc32(b"".join(sources[name] for name in sorted(sources)))


def _source(file: Path) -> bytes:
    """Source of a module; where only bytecode is installed, the version of the packages instead."""
    try:
        return file.read_bytes()
    except OSError:
        return f"'{__version__}'".encode()
