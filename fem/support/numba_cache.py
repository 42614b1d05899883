"""Compilation by numba: `compiled` functions call one another; `kept` ones are called from Python and stay on disk."""

import ast
import sys
from collections.abc import Callable
from contextlib import ExitStack
from functools import cache, partial
from pathlib import Path
from time import perf_counter
from zlib import crc32

from numba import njit
from numba.core import event

from fem.support.progress import announced

compiled = njit
#: What `kept` was given.
KEPT: set[Callable] = set()


@cache
def imported(source: bytes) -> tuple[str, ...]:
    """Names of all modules that a source may import."""
    names: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(names)


def stamp(function: Callable) -> int:
    """Of the sources that a function may call: its module and all that this imports, in its own package and in ours."""
    packages = {module.split(".")[0] for module in (__name__, function.__module__)}
    sources: dict[str, bytes] = {}
    waiting = [function.__module__]
    while waiting:
        name = waiting.pop()
        file = getattr(sys.modules.get(name), "__file__", None)
        if file and name not in sources and name.split(".")[0] in packages:
            sources[name] = Path(file).read_bytes()
            waiting += imported(sources[name])
    return crc32(b"".join(sources[name] for name in sorted(sources)))


class Announcer(event.Listener):
    """Tells of compilation, which takes long together, though each function takes a second."""

    def __init__(self):
        self.depth, self.spent, self.line = 0, 0.0, ExitStack()

    def on_start(self, event) -> None:
        if event.data["dispatcher"].py_func in KEPT:
            self.depth += 1
            if self.depth == 1:
                self.began = perf_counter()
                self.line.enter_context(announced("compiling the contact", before=self.spent, once=True))

    def on_end(self, event) -> None:
        if event.data["dispatcher"].py_func in KEPT:
            self.depth -= 1
            if self.depth == 0:
                self.spent += perf_counter() - self.began
                self.line.close()


event.register("numba:compile", Announcer())


def kept(function, **options):
    """Compiled and, where a folder can be written, kept on disk with all that it calls, until any of that changes.

    Numba's cache knows a function's own file, but not those of the functions that it calls. The names below are
    numba's private ones: where they differ, or no folder can be written, every process compiles for itself.
    """
    KEPT.add(function)
    try:
        dispatcher = njit(function, cache=True, **options)
        on_disk = dispatcher._cache
        index = type(on_disk._cache_file)
        names = {"cache_path": on_disk.cache_path, "filename_base": on_disk._impl.filename_base}
        on_disk._cache_file = index(**names, source_stamp=stamp(function))
    except (AttributeError, TypeError, RuntimeError, OSError):
        return njit(function, **options)
    return dispatcher


#: Sums in any order
fast = partial(kept, fastmath=True)
