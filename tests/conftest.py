"""The paper's gear pair, and a separate cache for every test session."""

import os
import sys

import halved_tests
import matplotlib
import measured_rows
import pytest
from halved_tests import pytest_collection_modifyitems
from hypothesis import settings
from measured_rows import measured, pytest_terminal_summary
from paper_gears import paper_pair

import fem
from fem.support import cache

__all__ = ["measured", "pytest_collection_modifyitems", "pytest_terminal_summary"]

matplotlib.use("Agg")
# The same cases every time, however slow the machine.
settings.register_profile("everyday", derandomize=True, deadline=None)
settings.load_profile("everyday")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that write measured numbers, and that take half of the tests."""
    for options in (measured_rows, halved_tests):
        options.pytest_addoption(parser)


def pytest_configure(config) -> None:
    """Give each worker one thread of BLAS, as they share the cores: here, as they begin with numpy imported."""
    if config.getoption("numprocesses", default=None):
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session", autouse=True)
def cache_of_this_session(tmp_path_factory):
    """Set the cache of this session, which its workers share; compiled code stays where it is."""
    folder = tmp_path_factory.getbasetemp()
    shared = folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", os.environ.get("NUMBA_CACHE_DIR") or str(cache.folder() / "compiled"))
        patch.setenv("EXUGEAR_CACHE", str(shared / "cache"))
        yield


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache folder of a test of its own."""
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture(autouse=True)
def closed_figures():
    """Close the figures of a test, of which pyplot keeps those that plots make without given axes."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture(scope="session", name="paper_pair")
def paper_pair_fixture() -> fem.GearPair:
    return paper_pair()
