"""A system that Exudyn linearizes: out of mesh, and with other motions, which are restored afterwards."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager

import numpy as np

from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.gear_contact import state_of
from exugear.multibody.integrator_steps import OUT_OF_MESH


@contextmanager
def disengaged(mbs, contacts: Collection[int]) -> Iterator[None]:
    """Take the gears of contacts, by their object numbers, out of mesh."""
    states = [state_of(mbs, contact) for contact in contacts]
    engaged = [float(state.engaged) for state in states]
    try:
        for state in states:
            state.engaged = OUT_OF_MESH
        yield
    finally:
        for state, value in zip(states, engaged, strict=True):
            state.engaged = value


@contextmanager
def set_velocities(mbs, velocities: np.ndarray) -> Iterator[None]:
    """Give the initial state of a system these velocities (n_coordinates,); those before are restored afterwards."""
    with set_motion(mbs, mbs.systemData.GetODE2Coordinates(INITIAL), velocities):
        yield


@contextmanager
def set_motion(mbs, coordinates: np.ndarray, velocities: np.ndarray) -> Iterator[None]:
    """Give the initial state of a system coordinates and velocities (n_coordinates,); restored afterwards."""
    system = mbs.systemData
    before = system.GetODE2Coordinates(INITIAL), system.GetODE2Coordinates_t(INITIAL)
    try:
        system.SetODE2Coordinates(coordinates, INITIAL)
        system.SetODE2Coordinates_t(velocities, INITIAL)
        yield
    finally:
        system.SetODE2Coordinates(before[0], INITIAL)
        system.SetODE2Coordinates_t(before[1], INITIAL)
