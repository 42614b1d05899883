"""Whether Exudyn may call compiled kernels without Python: tried once in a process of its own, and kept on disk.

EXUGEAR_PORTABLE=1 in the environment says no.
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

from exugear.elements.native import callback
from fem.support.cache import cached
from fem.support.progress import announced

#: For the trial [s], which takes three.
PATIENCE = 60
SCRIPT = """
import sys, types
sys.exudynFast = {fast}
sys.modules["exugear"] = types.ModuleType("exugear")
sys.modules["exugear"].__path__ = [{folder!r}]
from exugear.trial import trial
trial()
"""
#: Where it may work, and the longest of a trial's last words.
SYSTEM, LONGEST = ("linux", "x86_64", "CPython"), 200
PACKAGES = "exudyn", "numba", "llvmlite", "numpy"


def native(portable, kernel, addresses: tuple[int, ...], n: int):
    """A user function as one that Exudyn calls without Python; itself where that has not been seen to work.

    portable            (mbs, t, item, q, q_t) -> forces of n coordinates; raises RuntimeError
    kernel, addresses   the compiled kernel(*addresses, t, *q, *q_t) that it calls, and the addresses
    """
    return portable if obstacle() else callback.forged(portable, kernel, addresses, n)


def way() -> str:
    """How Exudyn calls contacts, in words."""
    return f"by way of Python ({obstacle()})" if obstacle() else "called without Python"


def obstacle() -> str:
    """Why Exudyn calls contacts by way of Python; empty where it calls them without."""
    asked = os.environ.get("EXUGEAR_PORTABLE", "") not in ("", "0")
    return "EXUGEAR_PORTABLE asks for it" if asked else _obstacle()


@cache
def _obstacle() -> str:
    system = sys.platform, platform.machine(), platform.python_implementation()
    if system != SYSTEM:
        return f"only {' '.join(SYSTEM)} can do without, this is {' '.join(system)}"
    if "python" not in Path(sys.executable).name:
        return f"the trial needs python as a process of its own, not {sys.executable}"
    try:
        return str(cached(_circumstances(), lambda: {"obstacle": np.array(_tried())})["obstacle"])
    except (AttributeError, OSError, subprocess.TimeoutExpired) as error:
        return f"no trial of the other way: {error}"


def _circumstances() -> str:
    """All that the answer may depend on."""
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    sources = [Path(callback.__file__).with_name(name) for name in ("callback.py", "check.py")]
    source = str(crc32(b"".join(path.read_bytes() for path in sources)))
    system = sys.version, *platform.libc_ver(), os.environ.get("LD_PRELOAD", "")
    return "\n".join(["native trial", source, exu.Help.__module__, *packages, *system])


def _tried() -> str:
    """What `exugear.elements.native.check` ends with, without what exugear imports; empty where all is well."""
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "PYTHONWARNINGS": "ignore"}
    fast, folder = exu.Help.__module__.endswith("fast"), str(Path(callback.__file__).parents[2])
    command = [sys.executable, "-P", "-c", SCRIPT.format(fast=fast, folder=folder)]
    with announced("trying whether Exudyn may call the compiled contact without Python", once=True):
        ended = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=PATIENCE)
    said = " ".join(ended.stderr.split())[-LONGEST:] or "no words"
    return f"its trial ended with {ended.returncode}: {said}" if ended.returncode else ""
