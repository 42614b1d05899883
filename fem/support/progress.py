"""Progress bars with the time left, and lines with the elapsed time of other long work, shown on request."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Event, Thread

import numpy as np
from tqdm import tqdm

#: Whether progress is shown; None: not requested either way.
_WANTED: ContextVar[bool | None] = ContextVar("wanted", default=None)
#: Work that takes less time than this shows no bar and no line [s].
DELAY = 1.0
#: Interval at which the time of a line is updated [s].
TICK = 0.5
STYLE = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"


@contextmanager
def shown(wanted: bool) -> Iterator[None]:
    """Context in which bars and lines are shown, or not."""
    before = _WANTED.set(wanted)
    try:
        yield
    finally:
        _WANTED.reset(before)


def bar(steps, what: str, costs=None) -> Iterator:
    """Iterate over steps, with a bar that moves by their costs (n_step,) if they take more than a second."""
    costs = np.ones(len(steps)) if costs is None else np.asarray(costs)
    style = {"bar_format": STYLE, "delay": DELAY, "leave": False, "disable": not _WANTED.get()}
    with tqdm(total=costs.sum(), desc=what, **style) as moving:
        for step, cost in zip(steps, costs, strict=True):
            yield step
            moving.update(cost)


@contextmanager
def share_done(what: str) -> Iterator[Callable[[float], None]]:
    """Context with a bar over work whose steps are not known beforehand: yields a function of the share done."""
    style = {"bar_format": STYLE, "delay": DELAY, "leave": False, "disable": not _WANTED.get()}
    with tqdm(total=1.0, desc=what, **style) as moving:
        yield lambda share: moving.update(max(0.0, min(share, 1.0) - moving.n)) and None


@contextmanager
def announced(what: str, *, before: float = 0.0, once: bool = False) -> Iterator[None]:
    """Context that shows a line with the task and its elapsed time after a second, and removes it at the end.

    before      time already spent on the task [s]
    once        whether the task is needed once after an installation: shown unless progress was switched off
    """
    hidden = _WANTED.get() is False if once else not _WANTED.get()
    style = {"bar_format": "{desc}: {elapsed}", "delay": DELAY, "leave": False, "disable": hidden}
    what = f"{what}, once after an installation" if once else what
    with tqdm(desc=what, miniters=0, mininterval=0, **style) as line:
        if line.disable:
            yield
            return
        line.start_t -= before
        done = Event()
        ticking = Thread(target=_tick, args=(line, done), daemon=True)
        ticking.start()
        try:
            yield
        finally:
            done.set()
            ticking.join()


def _tick(line: tqdm, done: Event) -> None:
    while not done.wait(TICK):
        line.update(0)
