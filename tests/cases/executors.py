"""Executors that work in this process, a run to divide, and the comparison of its parts with the whole."""

import pickle
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from shutil import rmtree

import numpy as np
import pytest
import xarray as xr
from scenes import rms

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


def assert_equal(serial: xr.Dataset, parts: xr.Dataset, tolerance: float = 1e-5) -> None:
    """All variables are there and equal, over the range of each."""
    assert set(parts.variables) - set(serial.variables) == {"seam_error", "seam"}
    assert set(serial.variables) <= set(parts.variables)
    assert parts["seam_error"].size >= 1
    assert (parts["seam_error"] <= 1e-6).all()
    for name, values in serial.data_vars.items():
        assert values.dims == parts[name].dims, name
        scale = 1.0 if name == "step_error" else max(float(np.abs(values).max()), 1e-30)
        assert float(np.abs(values - parts[name]).max()) <= tolerance * scale, name
    assert rms(parts) == pytest.approx(rms(serial), rel=1e-5)
