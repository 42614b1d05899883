"""Fixtures of runs: a pair on a mesh of constant stiffness, and tests that interrupt a run."""

import gc
import signal

import pytest
from driven_trains import box, shaft

import exugear


@pytest.fixture(scope="module")
def pair() -> exugear.Model:
    """Two equal gears on a mesh of constant stiffness, free to spin."""
    return exugear.build(box(shaft("fast"), shaft("slow")))


@pytest.fixture
def listening_to_ctrl_c():
    """Python's own handler: a shell that starts the tests in the background has SIGINT ignored.

    The garbage collector rests: Python drops an interrupt that arrives in one of its callbacks, such as hypothesis's.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    gc.disable()
    yield
    gc.enable()
    signal.signal(signal.SIGINT, before)
