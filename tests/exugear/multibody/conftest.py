"""Fixtures of contacts in Exudyn: a system, a law, and both ways in which Exudyn calls a kernel."""

import exudyn as exu
import pytest
from scenes import smooth_law

import exugear


@pytest.fixture(scope="module")
def law() -> exugear.MeshForce:
    return smooth_law(damping=1000.0)


@pytest.fixture(params=["", "1"], ids=["native", "portable"])
def way(request, monkeypatch):
    monkeypatch.setenv("EXUGEAR_PORTABLE", request.param)


@pytest.fixture
def mbs():
    container = exu.SystemContainer()
    system = container.AddSystem()
    system.variables["container"] = container
    return system
