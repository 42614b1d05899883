"""Bars with the time left, shown while the caller wants them."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np
from tqdm import tqdm

_WANTED: ContextVar[bool] = ContextVar("wanted", default=False)
#: Shorter work shows no bar [s].
DELAY = 1.0
STYLE = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"


@contextmanager
def shown(wanted: bool) -> Iterator[None]:
    """Context in which bars are shown, or not."""
    before = _WANTED.set(wanted)
    try:
        yield
    finally:
        _WANTED.reset(before)


def bar(steps, what: str, costs=None) -> Iterator:
    """Steps one by one; where they take more than a second, beside a bar that moves by their costs (n_step,)."""
    costs = np.ones(len(steps)) if costs is None else np.asarray(costs)
    style = {"bar_format": STYLE, "delay": DELAY, "leave": False, "disable": not _WANTED.get()}
    with tqdm(total=costs.sum(), desc=what, **style) as moving:
        for step, cost in zip(steps, costs, strict=True):
            yield step
            moving.update(cost)
