"""Loads on the flanks: balance of a contact, corners of tips, strips that meet."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from involutes import arc_length, flank_points, turned
from loaded_gears import GEAR, ROUGH, helical_gear, loaded_contacts
from measured_rows import deviation
from paper_gears import paper_pair

import fem
from fem import Density, stress
from fem.pair.placement import placements
from fem.units import MPa, mm, um

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))


COARSE = Density(flank=8, fillet=2, tooth=2, rim=2, body=3, width=2)


@pytest.mark.parametrize("offsets", [fem.Offsets(misalignment=2e-4), fem.Offsets(a=150.2 * mm, axial=3 * mm)])
@pytest.mark.parametrize("hand", [0, 1])
def test_loads_of_a_contact_balance_the_torque(hand, offsets):
    """Torque over r_b is the transverse force; its centroid on the common face is the same for both gears."""
    pair = paper_pair() if hand == 0 else fem.GearPair(helical_gear(), helical_gear(-1), a=149.5 * mm)
    offsets = replace(offsets, a=None) if hand else offsets
    ((contact, _, on_gears),) = loaded_contacts(pair, 150, [0.3], offsets, ROUGH)
    centroids = []
    for on_teeth, shift in zip(on_gears, (0.0, contact.position.axial), strict=True):
        force = np.concatenate([load.force.sum(axis=1) for load in on_teeth])
        middle = np.concatenate([(load.low + load.high) / 2 for load in on_teeth])
        assert force.sum() * np.cos(pair.beta_b) == pytest.approx(150 / pair.pinion.r_b, rel=2e-3)
        centroids.append(force @ middle / force.sum() + shift)
    assert centroids[0] == pytest.approx(centroids[1], abs=1e-9)
    assert abs(centroids[0]) > 0.1 * mm


@pytest.mark.parametrize("phase", [0.125, 0.875])
def test_force_on_a_tips_corner_is_on_the_flank(phase):
    """The first strip of the mating flank that carries load ends at its tip."""
    gear = fem.Gear(z=30, m_n=2 * mm, x=0.5, b=10 * mm, d_bore=30 * mm)
    pair = fem.GearPair(gear, gear)
    ((_, state, on_gears),) = loaded_contacts(pair, 150, [phase])
    tip, pressed = arc_length(gear, gear.roll_tip), state.strip_force > 0
    assert tip - state.strips.arcs[:, pressed].max() < state.strips.width[pressed].max() / 2
    pinion, wheel = (sum(load.force.sum() for load in side) for side in on_gears)
    assert pinion == pytest.approx(wheel, rel=1e-12)
    assert pinion == pytest.approx(150 / gear.r_b, rel=5e-3)


@pytest.mark.parametrize("phase", [0.2, 0.8])
def test_pressure_of_a_corner_is_equal_on_both_gears(phase, measured):
    """The largest pressure of the map, of a corner on a single strip, is on both gears, in plane and in space."""
    options = {"density": COARSE, "resolution": ROUGH}
    peak = fem.static_transmission_error(paper_pair(), 350, [phase], resolution=ROUGH, progress=False)["peak_pressure"]
    for fields in (stress.plane_fields, stress.solid_fields):
        for field in fields(paper_pair(), 350.0, phase, **options):
            row = "pressure in the fields where a tip's corner touches, pinion and wheel"
            measured(row, deviation(field.pressure.max(), peak.item()), 0.005)
    assert peak > 2500 * MPa


def strip_middles(placement, on_teeth) -> np.ndarray:
    """(3, n) middles of all strips that carry load, in the position of the gear; in order of z and y."""
    points = []
    for load in on_teeth:
        axial = np.broadcast_to((load.low + load.high)[:, None] / 2, load.force.shape)
        gear, turn = placement.gear, placement.rotation + placement.gear.twist * axial
        x, y = turned(flank_points(gear, load.middle, load.tooth), turn)
        points.append(np.stack([x, y, axial])[:, load.force > 0] + placement.centre[:, None])
    x, y, z = np.hstack(points)
    return np.stack([x, y, z])[:, np.lexsort((y, np.round(z / um)))]


@pytest.mark.parametrize("hand", [0, 1, -1])
def test_strips_of_both_gears_meet_where_the_gears_stand(hand):
    """They overlap by the transmission error less the gap, which the deflection compensates."""
    pair = paper_pair() if hand == 0 else fem.GearPair(helical_gear(hand), helical_gear(-hand))
    offsets = fem.Offsets(a=pair.a + 0.1 * mm, axial=2 * mm)
    ((contact, state, on_gears),) = loaded_contacts(pair, 150, [0.3], offsets, ROUGH)
    placed = placements(contact.position, state.te)
    pinion, wheel = (strip_middles(*gear) for gear in zip(placed, on_gears, strict=True))
    overlap = np.linalg.norm(pinion - wheel, axis=0)
    strips, pressed = state.strips, state.strip_force > 0
    expected = (state.te * strips.approach - strips.gap)[pressed] / np.cos(pair.beta_b)
    assert np.sort(overlap) == pytest.approx(np.sort(expected), rel=1e-3)


def test_symmetric_halves_are_equally_loaded():
    ((_, _, ((load,), _)),) = loaded_contacts(paper_pair(), 150, [0.0], resolution=ROUGH)
    assert load.force.sum() == pytest.approx(150 / GEAR.r_b, rel=1e-3)
    assert load.low == pytest.approx(-load.high[::-1]) and load.low[0] == pytest.approx(-GEAR.b / 2)
    assert (load.force == load.force[::-1]).all() and load.low[1:] == pytest.approx(load.high[:-1])
