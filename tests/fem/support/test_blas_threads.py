"""Dense algebra takes one thread inside the context, and as many as before after the last context ends.

Independent tasks run side by side, unless the caller is a worker itself.
"""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextvars import ContextVar
from functools import partial
from multiprocessing import get_context
from threading import Barrier, Event

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fem.support import blas_threads


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(2):
        assert threads() == {2}
        yield


def threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_limit_ends_with_the_last_of_overlapping_contexts():
    """The context that is entered first is left first, while the second is still active."""
    began, entered, left = Event(), Event(), Event()

    def first():
        with blas_threads.one_thread():
            began.set()
            assert entered.wait(10)
        left.set()

    def second():
        assert began.wait(10)
        with blas_threads.one_thread():
            entered.set()
            assert left.wait(10)
            return threads()

    with ThreadPoolExecutor(2) as executor:
        futures = executor.submit(first), executor.submit(second)
        futures[0].result()
        assert futures[1].result() == {1}
    assert threads() == {2}


def test_many_overlapping_contexts():
    barrier = Barrier(4)

    def work(_):
        barrier.wait(10)
        for _ in range(20):
            with blas_threads.one_thread(), blas_threads.one_thread():
                assert threads() == {1}

    with ThreadPoolExecutor(4) as executor:
        list(executor.map(work, range(4)))
    assert threads() == {2}


def test_limit_ends_with_an_error():
    with pytest.raises(RuntimeError), blas_threads.one_thread():
        raise RuntimeError
    assert threads() == {2}


@pytest.mark.parametrize("owned", [False, True])
def test_threads_are_set_with_and_without_owners_of_a_pool(monkeypatch, owned):
    """From threadpoolctl 3.8 on a pool is controlled by its first caller until that is released."""

    class Pool:
        num_threads, deposed = 2, 0

        def set_num_threads(self, number):
            self.num_threads = number

    class OwnedPool(Pool):
        def clear_controlling_thread(self, force):
            self.deposed += force

    pool = OwnedPool() if owned else Pool()
    monkeypatch.setattr(blas_threads, "_shared", lambda: [pool])
    with blas_threads.one_thread():
        assert pool.num_threads == 1
    assert (pool.num_threads, pool.deposed) == (2, 4 * owned)


def test_tasks_run_side_by_side_in_the_callers_context(monkeypatch):
    """Each waits until both have begun; results keep the order of the tasks."""
    monkeypatch.setattr(blas_threads, "cores", lambda: 2)
    barrier, setting = Barrier(2), ContextVar("setting", default="none")
    setting.set("caller's")

    def task(number: int) -> tuple[int, str]:
        barrier.wait(10)
        return number, setting.get()

    assert list(blas_threads.side_by_side([partial(task, 1), partial(task, 2)])) == [(1, "caller's"), (2, "caller's")]


def test_error_of_a_task_reaches_the_caller(monkeypatch):
    monkeypatch.setattr(blas_threads, "cores", lambda: 2)
    with pytest.raises(ZeroDivisionError):
        list(blas_threads.side_by_side([lambda: 1 / 0, lambda: 1]))


def test_workers_take_one_core():
    """Threads and processes of an executor, which spreads the work itself."""
    assert blas_threads.cores() >= 1
    with ThreadPoolExecutor(1) as executor:
        assert executor.submit(blas_threads.cores).result() == 1
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        assert executor.submit(blas_threads.cores).result() == 1
