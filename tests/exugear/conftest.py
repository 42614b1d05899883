"""Fixtures of built gearboxes, made once a module."""

import pytest
from scenes import smooth_box, two_stages

import exugear


@pytest.fixture(scope="module")
def spinning() -> exugear.Model:
    """The paper's pair, free to spin."""
    return exugear.build(smooth_box())


@pytest.fixture(scope="module")
def spinning_stages() -> exugear.Model:
    """Two stages of the paper's pair, free to spin."""
    return exugear.build(two_stages())
