"""Compilation by numba: `compiled` functions are called by kernels; `kept` functions, by Python, are cached on disk.

Compiled code lies in the cache folder, where $NUMBA_CACHE_DIR does not say otherwise: also of an installation that
cannot be written. What shortens the compilation relies on private parts of numba (`fem.support.numba_private`); with a
version that is not `TESTED` both decorators are those of numba.
"""

import gc
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from errno import EACCES
from functools import partial
from time import perf_counter
from types import ModuleType
from typing import Any

from numba import config, njit, version_info
from numba.core import event
from numba.extending import register_jitable

from fem.support.cache import folder, source_stamp, warn_not_kept
from fem.support.progress import announced

if getattr(config, "DISABLE_JIT", False):
    raise RuntimeError("NUMBA_DISABLE_JIT is set, but exugear runs compiled code only; unset it")

#: First version of numba with which its private parts were tested, and first one with which they were not.
TESTED = (0, 68), (0, 69)
private: ModuleType | None = None
if TESTED[0] <= version_info.short < TESTED[1]:
    from fem.support import numba_private as private

#: Decorator of functions that compiled code calls.
compiled: Any = private.callee if private else partial(njit, forceinline=False)
#: `compiled` for code that is long or rarely run, and is not inlined. Beside it, what runs in each call of a contact is
#: inlined wholly (`forceinline=True`): a contact takes .7 (spin) and .87 (on bearings) of the time so.
apart: Any = partial(compiled, apart=True) if private else compiled
#: Decorator of functions that both Python and compiled code call.
compiled_or_not: Any = register_jitable
#: Numba's settings.
NUMBA: Any = config
#: Functions that `kept` has compiled, or will compile.
KEPT: set[Callable] = set()


class Compilation(event.Listener):
    """Announces and speeds up the compilation of `kept` functions.

    Meanwhile Python collects no garbage, which would take a fifth of the time.
    """

    def __init__(self):
        self.depth, self.spent, self.began, self.scope = 0, 0.0, 0.0, ExitStack()

    def on_start(self, event) -> None:
        if event.data["dispatcher"].py_func in KEPT:
            self.depth += 1
            if self.depth == 1:
                self.began = perf_counter()
                self.scope.enter_context(announced("compiling the contact", before=self.spent, once=True))
                self.scope.enter_context(_without_collection())
                if private:
                    self.scope.enter_context(private.whole_call_tree())
                    self.scope.enter_context(private.types_inferred_once())
                    self.scope.enter_context(private.without_idle_work())

    def on_end(self, event) -> None:
        if event.data["dispatcher"].py_func in KEPT:
            self.depth -= 1
            if self.depth == 0:
                self.scope.close()
                self.spent += perf_counter() - self.began


@contextmanager
def _without_collection() -> Iterator[None]:
    """Context in which Python collects no garbage."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


event.register("numba:compile", Compilation())


def kept(function, **options):
    """The compiled function, cached on disk until its source or that of a callee changes.

    Numba's cache checks the file of a function, but not the files of the functions that it calls. Without the private
    parts of numba each state of all these files has a folder of its own.

    Numba names machine code and files by the name of the function and by the number of functions that the process has
    compiled before. Those of two processes would be mixed up: functions that differ by whole numbers which they enclose
    have these numbers in their names.
    """
    KEPT.add(function)
    function.__qualname__ += _enclosed_numbers(function)
    try:
        stamp = source_stamp(function.__module__)
        with _folder_of_compiled_code("" if private else f"{stamp:08x}"):
            dispatcher = njit(function, cache=True, **options)
        if private:
            private.stamped_cache(dispatcher, stamp)
    except OSError as error:
        warn_not_kept(error)
    except RuntimeError:  # numba finds no folder for its cache
        pass
    else:
        return dispatcher
    return njit(function, **options)


@contextmanager
def _folder_of_compiled_code(name: str) -> Iterator[None]:
    """Context in which numba keeps code in a folder of that name in the cache; OSError where it cannot be written."""
    before = NUMBA.CACHE_DIR
    try:
        path = folder() / "compiled" / name
        if not before:
            path.mkdir(parents=True, exist_ok=True)
            if not os.access(path, os.W_OK):
                raise PermissionError(EACCES, os.strerror(EACCES))
        NUMBA.CACHE_DIR = os.path.join(before, name) if before else str(path)
        yield
    finally:
        NUMBA.CACHE_DIR = before


def _enclosed_numbers(function: Callable) -> str:
    """The whole numbers that a function encloses, as part of its name; TypeError where it encloses anything else."""
    enclosed = {
        name: cell.cell_contents
        for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    }
    for name, value in enclosed.items():
        if not isinstance(value, int):
            tells = "may enclose whole numbers only, by which its compiled code is told apart"
            raise TypeError(f"{function.__qualname__} {tells}, got {name} = {value!r}")
    return "".join(f"_{int(value)}" for value in enclosed.values())


#: `kept` with sums in any order.
fast = partial(kept, fastmath=True)
#: `compiled` with products added in one operation, which rounds once: mesh forces take .9 to .95 of the time.
fused: Any = partial(compiled, fastmath={"contract"})
#: `compiled`, `apart` and `kept` where a division by 0 gives infinity, as in numpy: the checks would double the code.
unchecked: Any = partial(compiled, error_model="numpy")
unchecked_apart: Any = partial(apart, error_model="numpy")
fused_unchecked: Any = partial(fused, error_model="numpy")
kept_unchecked: Any = partial(kept, error_model="numpy")
