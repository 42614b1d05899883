"""Exudyn calls the compiled contact directly, without Python in between: EXUGEAR_PORTABLE=1 switches this off.

A direct call needs a function record that pybind11 did not make (`exugear.multibody.callback`). Whether that
works depends on the platform and on the versions of Exudyn, pybind11, numba and LLVM. So it is checked first, in
a separate process that may crash (`exugear.multibody.callback_check`), and the result is cached on disk. Where the
check fails Exudyn calls the contact by way of Python: same numbers, slower. The printed plan of a model states which
call is used, and why.
"""

import os
import platform
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from zlib import crc32

import exudyn as exu
import numpy as np

from exugear.multibody import callback
from fem.support.cache import cached
from fem.support.progress import announced

#: Time limit of the check [s], which takes 3 s.
TIME_LIMIT = 60
#: The check in a new process. An empty package stands in for exugear: importing all of it would take as long again.
SCRIPT = """
import sys, types
sys.exudynFast = {fast}
sys.modules["exugear"] = types.ModuleType("exugear")
sys.modules["exugear"].__path__ = [{folder!r}]
from exugear.multibody.callback_check import check
check()
"""
#: The only platform with these records and calling conventions.
PLATFORM = "linux", "x86_64", "CPython"
#: Longest quotation of the check's error output.
LONGEST_QUOTE = 200
PACKAGES = "exudyn", "numba", "llvmlite", "numpy"


def direct_or_portable(portable, kernel, addresses: tuple[int, ...], n: int):
    """The user function that Exudyn calls directly; where that does not work, the portable function itself.

    portable            (mbs, t, item, q, q_t) -> forces of n coordinates; raises RuntimeError
    kernel, addresses   the compiled kernel(*addresses, t, *q, *q_t) that it calls, and the addresses
    """
    return portable if obstacle() else callback.native_user_function(portable, kernel, addresses, n)


def call_path() -> str:
    """How Exudyn calls contacts, for the printed plan."""
    return f"by way of Python ({obstacle()})" if obstacle() else "called without Python"


def obstacle() -> str:
    """Why Exudyn calls contacts by way of Python; empty where it calls them directly."""
    requested = os.environ.get("EXUGEAR_PORTABLE", "") not in ("", "0")
    return "EXUGEAR_PORTABLE requests it" if requested else _obstacle()


@cache
def _obstacle() -> str:
    system = sys.platform, platform.machine(), platform.python_implementation()
    if system != PLATFORM:
        return f"only {' '.join(PLATFORM)} can do without, this is {' '.join(system)}"
    if "python" not in Path(sys.executable).name:
        return f"the check needs python as a separate process, not {sys.executable}"
    try:
        return str(cached(_circumstances(), lambda: {"obstacle": np.array(_failure_of_check())})["obstacle"])
    except (AttributeError, OSError, subprocess.TimeoutExpired) as error:
        return f"the direct call could not be checked: {error}"


def _circumstances() -> str:
    """All that the result of the check may depend on: the key under which it is cached."""
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    sources = sorted(Path(callback.__file__).parent.glob("callback*.py"))
    source = str(crc32(b"".join(path.read_bytes() for path in sources)))
    system = sys.version, *platform.libc_ver(), os.environ.get("LD_PRELOAD", "")
    return "\n".join(["check of the direct call", SCRIPT, source, exu.Help.__module__, *packages, *system])


def _failure_of_check() -> str:
    """How the check failed, with the end of its error output; empty where it passed."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "PYTHONWARNINGS": "ignore"}
    fast, folder = exu.Help.__module__.endswith("fast"), str(Path(callback.__file__).parents[1])
    command = [sys.executable, "-P", "-c", SCRIPT.format(fast=fast, folder=folder)]
    with announced("checking whether Exudyn can call the compiled contact without Python", once=True):
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIME_LIMIT)
    quote = " ".join(ended.stderr.split())[-LONGEST_QUOTE:] or "no message"
    return f"its check ended with {ended.returncode}: {quote}" if ended.returncode else ""
