"""Dense algebra on one thread: more threads slow down matrices of this size, above all in parallel processes."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock

from threadpoolctl import ThreadpoolController


class _Limit:
    """Limit of the thread pools that the process shares: the first context sets it, the last one lifts it."""

    def __init__(self):
        self.lock, self.contexts = Lock(), 0

    def __enter__(self):
        with self.lock:
            if not self.contexts:
                self.before = [pool.num_threads for pool in _shared()]
                _set_threads([1] * len(self.before))
            self.contexts += 1

    def __exit__(self, *error):
        with self.lock:
            self.contexts -= 1
            if not self.contexts:
                _set_threads(self.before)


_LIMIT = _Limit()


@contextmanager
def one_thread() -> Iterator[None]:
    """Context in which matrix products and factorizations take one thread; contexts of several threads may overlap."""
    with _LIMIT, _threads().limit(limits=1, user_api="openmp"):
        yield


@cache
def _threads() -> ThreadpoolController:
    """The thread pools of this process; searching for them takes long."""
    return ThreadpoolController()


def _shared() -> list:
    """BLAS pools that all threads share; with OpenMP every thread has a separate pool."""
    pools = _threads().select(user_api="blas").lib_controllers
    return [pool for pool in pools if getattr(pool, "threading_layer", None) != "openmp"]


def _set_threads(numbers: list[int]) -> None:
    """Set the numbers of threads of the shared pools."""
    for pool, number in zip(_shared(), numbers, strict=True):
        _release(pool)
        pool.set_num_threads(number)
        _release(pool)


def _release(pool) -> None:
    """Let any thread set the pool's threads: from 3.8 on threadpoolctl lets only its first caller do so."""
    if hasattr(pool, "clear_controlling_thread"):
        pool.clear_controlling_thread(force=True)
