"""Whether Exudyn may call compiled kernels without Python: tried once in a process of its own, kept in the cache folder.

EXUGEAR_PORTABLE=1 in the environment says no.
"""

import os
import platform
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

import exudyn as exu
import numpy as np

from exugear import trampoline
from fem.cache import cached

PATIENCE = 120
PACKAGES = "exudyn", "numba", "llvmlite", "numpy"


def native(portable, kernel, addresses: tuple[int, ...], n: int):
    """A user function as one that Exudyn calls without Python; itself where that has not been seen to work.

    portable            (mbs, t, item, q, q_t) -> forces of n coordinates; raises RuntimeError
    kernel, addresses   the compiled kernel(*addresses, t, *q, *q_t) that it calls, and the addresses
    """
    if os.environ.get("EXUGEAR_PORTABLE", "") not in ("", "0") or not _works():
        return portable
    return trampoline.forged(portable, kernel, addresses, n)


@cache
def _works() -> bool:
    if (sys.platform, platform.machine(), platform.python_implementation()) != ("linux", "x86_64", "CPython"):
        return False
    if "python" not in Path(sys.executable).name:
        return False
    try:
        return bool(cached(_circumstances(), lambda: {"works": np.array(_tried())})["works"])
    except (OSError, subprocess.TimeoutExpired):
        return False


def _circumstances() -> str:
    """All that the answer may depend on."""
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    source = Path(trampoline.__file__).read_text(encoding="utf-8")
    return "\n".join(["native", sys.version, exu.Help.__module__, *platform.libc_ver(), *packages, source])


def _tried() -> bool:
    """Whether `trampoline` as a script ends well."""
    fast = exu.Help.__module__.endswith("fast")
    script = f"import runpy, sys; sys.exudynFast = {fast}; runpy.run_path({trampoline.__file__!r}, run_name='__main__')"
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "PYTHONWARNINGS": "ignore"}
    command = [sys.executable, "-P", "-c", script]
    return not subprocess.run(command, env=surroundings, capture_output=True, timeout=PATIENCE).returncode
