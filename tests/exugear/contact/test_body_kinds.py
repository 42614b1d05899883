"""Kinds of bodies that carry gears: forces on their coordinates have the power of those on all components."""

import numpy as np
import pytest

from exugear.contact.rotation import KINDS, SPATIAL, code_of, coordinates_of, on_coordinates


@pytest.mark.parametrize("code", KINDS)
def test_forces_on_coordinates_have_the_power_on_all_components(code):
    """Rates of a body behind those of another one; the components that it lacks stand, and take any force."""
    random, size = np.random.default_rng(code), KINDS[code].size
    rates, forces = random.normal(size=3 + size), random.normal(size=7)
    moving = coordinates_of(tuple(rates.tolist()), 3, code)
    on_body = on_coordinates(code, tuple(forces.tolist()))[:size]
    assert rates[3:] @ on_body == pytest.approx(forces @ moving, rel=1e-12)
    assert np.count_nonzero(moving) == size


def test_a_spatial_body_is_upright_unless_its_contact_is_rotated():
    upright, turned = code_of(SPATIAL, rotated=False), code_of(SPATIAL, rotated=True)
    assert KINDS[upright].components == KINDS[turned].components == SPATIAL.components
    assert KINDS[upright].turns_about_z
    assert not KINDS[turned].turns_about_z
