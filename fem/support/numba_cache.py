"""Compilation by numba: `compiled` functions are called by kernels; `kept` functions, by Python, are cached on disk.

Compiled code lies in the cache folder, where $NUMBA_CACHE_DIR does not say otherwise: also of an installation that
cannot be written.
"""

import gc
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from errno import EACCES
from functools import partial
from time import perf_counter
from typing import Any

from numba import config, njit
from numba.core import event
from numba.extending import register_jitable

from fem.support.cache import folder, source_stamp, warn_not_kept
from fem.support.call_tree import callee, types_inferred_once, whole_call_tree
from fem.support.progress import announced

if getattr(config, "DISABLE_JIT", False):
    raise RuntimeError("NUMBA_DISABLE_JIT is set, but exugear runs compiled code only; unset it")

compiled = callee
#: Decorator of functions that both Python and compiled code call.
compiled_or_not: Any = register_jitable
#: Numba's settings.
NUMBA: Any = config
#: Functions that `kept` has compiled, or will compile.
KEPT: set[Callable] = set()


class Compilation(event.Listener):
    """What surrounds the compilation of `kept` functions: it is announced, as it takes long in total.

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
                self.scope.enter_context(whole_call_tree())
                self.scope.enter_context(types_inferred_once())

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

    Numba's cache checks the file of a function, but not the files of the functions that it calls. This function uses
    private attributes of numba: where they differ, or the folder is not writable, every process compiles anew.

    Numba names machine code and files by the name of the function and by the number of functions that the process has
    compiled before. Those of two processes would be mixed up: functions that differ by whole numbers which they enclose
    have these numbers in their names.
    """
    KEPT.add(function)
    function.__qualname__ += _enclosed_numbers(function)
    try:
        with _folder_of_compiled_code():
            dispatcher = njit(function, cache=True, **options)
        on_disk = dispatcher._cache
        index = type(on_disk._cache_file)
        names = {"cache_path": on_disk.cache_path, "filename_base": on_disk._impl.filename_base}
        on_disk._cache_file = index(**names, source_stamp=source_stamp(function.__module__))
        _outlive_damage(on_disk)
    except OSError as error:
        warn_not_kept(error)
    except (AttributeError, TypeError, RuntimeError):
        pass
    else:
        return dispatcher
    return njit(function, **options)


@contextmanager
def _folder_of_compiled_code() -> Iterator[None]:
    """Context in which numba keeps code in the cache folder; OSError where that cannot be written."""
    before = NUMBA.CACHE_DIR
    try:
        if not before:
            path = folder() / "compiled"
            path.mkdir(parents=True, exist_ok=True)
            if not os.access(path, os.W_OK):
                raise PermissionError(EACCES, os.strerror(EACCES))
            NUMBA.CACHE_DIR = str(path)
        yield
    finally:
        NUMBA.CACHE_DIR = before


def _outlive_damage(on_disk: Any) -> None:
    """Let numba's cache of a function compile anew where its files are damaged, and not save where no room is left."""
    load, save = on_disk.load_overload, on_disk.save_overload

    def load_overload(*arguments):
        try:
            return load(*arguments)
        except Exception:
            with suppress(Exception):
                on_disk.flush()
            return None

    def save_overload(*arguments):
        with suppress(OSError):
            save(*arguments)

    on_disk.load_overload, on_disk.save_overload = load_overload, save_overload


def _enclosed_numbers(function: Callable) -> str:
    """The whole numbers that a function encloses, as part of its name."""
    enclosed = [cell.cell_contents for cell in function.__closure__ or ()]
    return "".join(f"_{int(value)}" for value in enclosed if isinstance(value, int))


#: `kept` with sums in any order.
fast = partial(kept, fastmath=True)
#: `compiled` and `kept` where a division by 0 gives infinity, as in numpy: the checks would double the code.
unchecked: Any = partial(callee, error_model="numpy")
kept_unchecked: Any = partial(kept, error_model="numpy")
