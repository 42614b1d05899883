"""Exact slopes of a contact of gears that spin: against differences away from kinks, by side at the kink."""

import numpy as np
import pytest
from scenes import smooth_box

import exugear
from exugear.contact.contact_tangent import tangent_of_spins
from exugear.modal.mesh_tangents import contact_of


@pytest.fixture(scope="module")
def contact():
    model = exugear.build(smooth_box())
    return contact_of(model.mbs, model.meshes[0].contact)


def tangent_at(contact, *state):
    return tangent_of_spins(contact.records[0].head, contact.records[1], *state)


def state_at(contact, advance: float, phase: float, speeds=(0.0, 0.0)) -> np.ndarray:
    """Angles and speeds at an advance [m] and a phase."""
    _, frame, *_ = contact.records
    pinion = phase / frame.pitches_per_radian
    wheel = (frame.direction * advance - frame.pinion.r_b * pinion) / frame.wheel.r_b
    return np.array([pinion, wheel, *speeds])


def differences(function, state: np.ndarray, steps) -> np.ndarray:
    """Slopes of a function of the state, of fourth order in the steps."""
    columns = []
    for step, unit in zip(steps, np.eye(state.size), strict=True):
        values = [np.array(function(*(state + k * step * unit))) for k in (-2, -1, 1, 2)]
        columns.append((values[0] - values[3] + 8 * (values[2] - values[1])) / (12 * step))
    return np.array(columns).T


@pytest.mark.parametrize("advance", [2e-5, 8e-6, -1.87e-3])
@pytest.mark.parametrize("phase", [0.11, 0.48, 0.83])
def test_slopes_are_those_of_differences_away_from_kinks(contact, advance, phase):
    state = state_at(contact, advance, phase, speeds=(0.2, -0.1))
    tangent = tangent_at(contact, *state)
    by_state = -differences(contact.forces, state, (2e-8, 2e-8, 1e-2, 1e-2))
    assert tangent.by_angles == pytest.approx(by_state[:, :2], abs=1e-8 * np.abs(by_state[:, :2]).max())
    assert tangent.by_speeds == pytest.approx(by_state[:, 2:], abs=1e-8 * np.abs(by_state[:, 2:]).max())


def test_a_conservative_contact_has_a_symmetric_tangent(contact):
    stiffness = tangent_at(contact, *state_at(contact, 1e-5, 0.3)).by_angles
    assert stiffness == pytest.approx(stiffness.T, rel=1e-12)
    assert stiffness[0, 0] != pytest.approx(stiffness[1, 1], rel=1e-6)


def test_where_contact_ends_the_slopes_are_those_of_the_side(contact):
    """A difference across the kink would give half the stiffness."""
    touching, apart = (tangent_at(contact, *state_at(contact, x, 0.0)) for x in (1e-12, -1e-12))
    nearby = tangent_at(contact, *state_at(contact, 1e-9, 0.0))
    assert apart.force == 0.0
    assert not apart.by_angles.any()
    assert touching.force < 1e-2
    assert touching.by_angles == pytest.approx(nearby.by_angles, rel=0.2)
