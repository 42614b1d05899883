"""Threads: dense algebra runs on a single thread, fastest for these matrices; independent work runs side by side."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from functools import cache
from multiprocessing import parent_process
from threading import Lock, current_thread, main_thread
from typing import Any

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


def side_by_side(tasks: Sequence[Callable[[], Any]]) -> Iterator:
    """Results of the tasks in their order, solved in as many threads as there are `cores`."""
    if cores() == 1 or len(tasks) == 1:
        yield from (task() for task in tasks)
        return
    with ThreadPoolExecutor(cores()) as executor:
        yield from executor.map(lambda context, task: context.run(task), [copy_context() for _ in tasks], tasks)


def cores() -> int:
    """Cores for threads: all that this process may use, but one in a worker, whose work is spread by its executor.

    A worker is a process that `multiprocessing` started, or a thread other than the main one.
    """
    if parent_process() is not None or current_thread() is not main_thread():
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
