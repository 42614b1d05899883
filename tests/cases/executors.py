"""Executors that work in this process, and a run to divide."""

import pickle
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from shutil import rmtree

from fem.units import rpm

RUN = {"speed": (900 * rpm, 1400 * rpm), "duration": 1.0, "load": 150.0, "progress": False}


class Inline(ThreadPoolExecutor):
    """Integrates each part where it is submitted, as one of two processes."""

    def __init__(self):
        super().__init__(2)

    def submit(self, function, *arguments) -> Future:
        future: Future = Future()
        try:
            future.set_result(function(*arguments))
        except BaseException as error:
            future.set_exception(error)
        return future


class Pickled(Executor):
    """Maps in this process, with functions, arguments and results as another process would receive them."""

    def map(self, function, *iterables, timeout=None, chunksize=1):
        received = pickle.loads(pickle.dumps(function))
        return [
            pickle.loads(pickle.dumps(received(*pickle.loads(pickle.dumps(x))))) for x in zip(*iterables, strict=True)
        ]


class OnAnotherMachine(Inline):
    """The same without the folder of the calling machine."""

    def submit(self, function, *arguments) -> Future:
        rmtree(arguments[0].folder, ignore_errors=True)
        return super().submit(function, *arguments)
