"""Points of run time against error, and processor times with and without the cache, for `benchmark.py`."""

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Points:
    """Errors [%], times [s] and further errors of the variants of each method."""

    rows: dict[str, list[tuple[str, float, float, dict[str, float]]]] = field(default_factory=dict)

    def add(self, method: str, variant: str, error: float, seconds: float, **beside: float) -> None:
        self.rows.setdefault(method, []).append((variant, error, seconds, beside))
        more = "".join(f"{value:10.4f} % {name.replace('_', ' ')}" for name, value in beside.items())
        print(f"{method:34s}{variant:>14s}{error:10.4f} %{seconds:10.2f} s{more}", flush=True)

    def draw(self, ax) -> None:
        for (method, variants), marker in zip(self.rows.items(), "os^Dvp<>*hX", strict=False):
            ax.plot([row[2] for row in variants], [row[1] for row in variants], marker + "-", ms=5, label=method)
        ax.set(xscale="log", yscale="log")


def timed(call: Callable):
    """Result and processor time [s] of a call, which other load on the machine hardly changes."""
    start = time.process_time()
    result = call()
    return result, time.process_time() - start


def cold(call: Callable):
    """Result and processor time [s] of a call with an empty cache."""
    before = os.environ.get("EXUGEAR_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["EXUGEAR_CACHE"] = folder
        try:
            return timed(call)
        finally:
            os.environ.pop("EXUGEAR_CACHE")
            os.environ |= {} if before is None else {"EXUGEAR_CACHE": before}
