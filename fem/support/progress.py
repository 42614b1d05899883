"""Progress of long work on request: bars with the time left on a terminal, lines in a log.

A log, which a batch system keeps, has a line where a stage begins, every so often while it lasts, and where it ends;
stages of less than a second have none.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Event, Thread
from time import monotonic
from typing import Any

import numpy as np
from tqdm import tqdm

#: Whether progress is shown; None: not requested either way.
_WANTED: ContextVar[bool | None] = ContextVar("wanted", default=None)
#: Work that takes less time than this shows no bar and no line [s].
DELAY = 1.0
#: Interval at which the time of a line on a terminal is updated [s].
TICK = 0.5
#: Times from the begin of a stage at which a log gets a line [s]; from the last one on as often as that.
LINES = 10.0, 30.0, 60.0
#: Text of a time [s].
interval = tqdm.format_interval
STYLE = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"


@contextmanager
def shown(wanted: bool) -> Iterator[None]:
    """Context in which bars and lines are shown, or not."""
    before = _WANTED.set(wanted)
    try:
        yield
    finally:
        _WANTED.reset(before)


def on_terminal() -> bool:
    """Whether lines on stderr can be overwritten: on a terminal, or in a notebook."""
    return "ipykernel" in sys.modules or bool(getattr(sys.stderr, "isatty", lambda: False)())


class LogLines:
    """Lines of a stage in a log; `update(n)` counts its steps, out of `total` if that is known.

    before      time already spent on the stage [s]
    """

    def __init__(self, what: str, total: float = 0.0, before: float = 0.0):
        self.what, self.total, self.count = what, total, 0.0
        self.began, self.ended, self.said = monotonic() - before, Event(), False
        self.thread = Thread(target=self._say, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, failure, *_):
        self.ended.set()
        self.thread.join()
        if self.said:
            self._print(f"{'ended early' if failure else 'done'} after {self._elapsed()}")

    def update(self, steps: float) -> None:
        """Count some steps."""
        self.count += steps

    def _elapsed(self) -> str:
        return interval(monotonic() - self.began)

    def _print(self, text: str) -> None:
        sys.stderr.write(f"{self.what}: {text}\n")  # in one piece: stages may overlap
        sys.stderr.flush()

    def _say(self) -> None:
        """Say that the stage has begun, once it lasts, and from time to time how far it is."""
        waited, number = DELAY, 0
        if self.ended.wait(waited):
            return
        self.said = True
        self._print("begun")
        while not self.ended.wait(LINES[min(number, len(LINES) - 1)] - (waited if number < len(LINES) else 0.0)):
            waited, number = LINES[min(number, len(LINES) - 1)], number + 1
            self._print(self._share() + self._elapsed())

    def _share(self) -> str:
        """Share of the steps, with the time that the others will take."""
        if not self.total or not self.count:
            return ""
        left = interval((monotonic() - self.began) * (self.total / self.count - 1))
        return f"{self.count / self.total:.0%}, {left} left, after "


def moving(total: float, what: str, *, visible: bool, **style) -> Any:
    """Context of a bar on a terminal, of lines in a log, that `update(n)` moves; style: of tqdm."""
    if visible and not on_terminal():
        return LogLines(what, total)
    return tqdm(total=total, desc=what, leave=False, disable=not visible, **style)


def bar(steps, what: str, costs=None) -> Iterator:
    """Iterate over steps, with a bar that moves by their costs (n_step,) if they take more than a second."""
    costs = np.ones(len(steps)) if costs is None else np.asarray(costs)
    with moving(costs.sum(), what, visible=bool(_WANTED.get()), bar_format=STYLE, delay=DELAY) as moved:
        for step, cost in zip(steps, costs, strict=True):
            yield step
            moved.update(cost)


@contextmanager
def share_done(what: str) -> Iterator[Callable[[float], None]]:
    """Context with a bar over work whose steps are not known beforehand: yields a function of the share done."""
    shown_share = 0.0
    with moving(1.0, what, visible=bool(_WANTED.get()), bar_format=STYLE, delay=DELAY) as moved:

        def show(share: float) -> None:
            nonlocal shown_share
            further = max(0.0, min(share, 1.0) - shown_share)
            shown_share += further
            moved.update(further)

        yield show


@contextmanager
def announced(what: str, *, before: float = 0.0, once: bool = False) -> Iterator[None]:
    """Context that shows a line with the task and its elapsed time after a second, and removes it at the end.

    before      time already spent on the task [s]
    once        whether the task is needed once after an installation: shown unless progress was switched off
    """
    hidden = _WANTED.get() is False if once else not _WANTED.get()
    style = {"bar_format": "{desc}: {elapsed}", "delay": DELAY, "leave": False, "disable": hidden}
    what = f"{what}, once after an installation" if once else what
    if not hidden and not on_terminal():
        with LogLines(what, before=before):
            yield
        return
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
