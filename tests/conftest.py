"""The paper's gear pair and a cache of its own for every test session."""

import os

# Workers share the cores: one thread of BLAS for each.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import matplotlib
import pytest

import fem
from fem.units import deg, mm

matplotlib.use("Agg")


@pytest.fixture(scope="session", autouse=True)
def cache_of_this_session(tmp_path_factory):
    """Its workers, which have folders side by side, share it."""
    folder = tmp_path_factory.getbasetemp()
    shared = folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EXUGEAR_CACHE", str(shared / "cache"))
        yield


def paper_gear(**changes) -> fem.Gear:
    """Gear of the paper's Table I with some changes."""
    data = {"z": 57, "m_n": 2.6 * mm, "b": 23 * mm, "alpha_n": 20 * deg, "d_bore": 60 * mm}
    return fem.Gear(**data | {"d_a": 154.5 * mm, "d_f": 141.7 * mm, "s_n": 3.78 * mm} | changes)


def few_teeth(**changes) -> fem.Gear:
    """Spur gear without undercut, root from the rack unless a fillet is given."""
    return fem.Gear(**{"z": 20, "m_n": 2 * mm, "b": 20 * mm, "d_bore": 20 * mm, "x": 0.3} | changes)


def paper_pair() -> fem.GearPair:
    return fem.GearPair(paper_gear(), paper_gear(), a=150 * mm)


@pytest.fixture(scope="session", name="paper_pair")
def paper_pair_fixture() -> fem.GearPair:
    return paper_pair()
