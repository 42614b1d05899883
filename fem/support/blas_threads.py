"""Dense algebra on one thread: more cost more than they give on matrices of this size, most of all side by side."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock

from threadpoolctl import ThreadpoolController


class _Limit:
    """One thread in what the whole process shares while anyone asks for it: the first sets it, the last lifts it."""

    def __init__(self):
        self.lock, self.inside = Lock(), 0

    def __enter__(self):
        with self.lock:
            if not self.inside:
                self.before = [pool.num_threads for pool in _shared()]
                _set([1] * len(self.before))
            self.inside += 1

    def __exit__(self, *error):
        with self.lock:
            self.inside -= 1
            if not self.inside:
                _set(self.before)


_LIMIT = _Limit()


@contextmanager
def one_thread() -> Iterator[None]:
    """Context in which matrix products and factorizations take one thread; those of several threads may overlap."""
    with _LIMIT, _threads().limit(limits=1, user_api="openmp"):
        yield


@cache
def _threads() -> ThreadpoolController:
    """The thread pools of this process, which take long to find."""
    return ThreadpoolController()


def _shared() -> list:
    """Pools of algebra that all threads share; with OpenMP each has its own."""
    pools = _threads().select(user_api="blas").lib_controllers
    return [pool for pool in pools if getattr(pool, "threading_layer", None) != "openmp"]


def _set(numbers: list[int]) -> None:
    """Numbers of threads of the shared pools."""
    for pool, number in zip(_shared(), numbers, strict=True):
        _disown(pool)
        pool.set_num_threads(number)
        _disown(pool)


def _disown(pool) -> None:
    """Any thread may set the pool's threads: threadpoolctl lets its first caller alone do so, from 3.8 on."""
    if hasattr(pool, "clear_controlling_thread"):
        pool.clear_controlling_thread(force=True)
