"""Rounded tip edges: their shape, Hertz's pressure on them, no influence of strips and finite elements."""

from dataclasses import replace
from math import atan, pi, tan

import numpy as np
import pytest
from contacts import resolved_contacts
from line_contact import largest_pressure
from paper_gears import paper_gear

import fem
from fem import Density
from fem.units import deg, mm, um

COARSE = fem.Resolution(density=Density(flank=8, fillet=1, tooth=3, rim=2, body=2, width=2))
FINE = fem.Resolution(density=Density(flank=12, fillet=2, tooth=4, rim=2, body=3, width=2))
#: Before and at the end of the path of contact, and beyond; at 0.5 two tooth pairs carry equal loads.
PHASES = (0.15, 0.18, 0.21, 0.25, 0.28, 0.30, 0.5, 0.7)


def rounded_pair(radius: float) -> fem.GearPair:
    gear = paper_gear(flank=fem.EdgeBreak(radius) if radius else ())
    return fem.GearPair(gear, gear, a=150 * mm)


def states(pair: fem.GearPair, torque: float, phases=PHASES, resolution=COARSE) -> list:
    contacts = resolved_contacts(pair, resolution, phases)
    return [contact.state(torque / pair.pinion.r_b) for contact in contacts]


def map_of(pair: fem.GearPair, torque: float, phases=PHASES, resolution=COARSE):
    return fem.static_transmission_error(pair, torque, phases, resolution=resolution, progress=False)


def peaks(*scene, **options) -> np.ndarray:
    """(n_phase,) largest pressures [Pa]."""
    return map_of(*scene, **options)["peak_pressure"].values[0]


def test_rounding_is_a_circle_that_leaves_the_flank_tangentially_and_meets_the_tip():
    gear, radius = paper_gear(), 0.3 * mm
    edge = fem.EdgeBreak(radius)
    begin, _ = edge.rounding(gear.face)
    turn = pi / 2 - atan(gear.roll_tip / gear.r_b)
    length = (gear.roll_tip**2 - begin**2) / (2 * gear.r_b)
    assert length == pytest.approx(radius * tan(turn / 2))
    along = np.linspace(-0.2, 1, 7) * length
    removed = edge.removed(gear.face, np.sqrt(begin**2 + 2 * gear.r_b * along), 0.0)
    assert np.maximum(along, 0) ** 2 + (radius - removed) ** 2 == pytest.approx(radius**2)
    assert removed[-1] > 40 * um and (removed[:2] == 0).all()


def test_contact_beyond_the_path_of_contact_is_that_of_a_cylinder_of_the_edge_radius():
    """All of the contact lies on the rounding, so the pressure is that of Hertz for its radius (Johnson, ch. 4)."""
    pair = rounded_pair(0.3 * mm)
    for state in states(pair, 350, (0.17, 0.18)):
        strong = np.argmax(state.pressure)
        line_load = (state.force / state.slices.length)[strong]
        roll = state.slices.closest.roll[strong]
        radius = roll * 0.3 * mm / (roll + 0.3 * mm)
        assert state.pressure[strong] == pytest.approx(largest_pressure(line_load, radius), rel=0.03)
        assert state.pressure[strong] > 1.5 * state.quantities.hertz_pressure[0]


@pytest.mark.parametrize("radius", [0.1 * mm, 0.3 * mm])
def test_pressure_does_not_depend_on_strips(monkeypatch, radius):
    pair = rounded_pair(radius)
    usual = peaks(pair, 350)
    monkeypatch.setattr("fem.contact.strip_bounds.FINE", 81)
    fine = peaks(pair, 350)
    assert usual == pytest.approx(fine, rel=0.03)
    assert usual.max() == pytest.approx(fine.max(), rel=0.01)


def test_pressure_does_not_depend_on_finite_elements():
    pair = rounded_pair(0.2 * mm)
    coarse, fine = (peaks(pair, 350, resolution=each) for each in (COARSE, FINE))
    assert coarse == pytest.approx(fine, rel=0.03)


def test_pressure_hardly_depends_on_slices_of_helical_gears():
    """The rounding counts in the middle of a slice: averaged over 20 slices, a third of the peak was missing."""
    data = {"z": 30, "m_n": 3 * mm, "b": 25 * mm, "d_bore": 50 * mm, "flank": fem.EdgeBreak(0.2 * mm)}
    pair = fem.GearPair(*(fem.Gear(beta=beta, **data) for beta in (15 * deg, -15 * deg)))
    rough = fem.Resolution(density=Density(flank=6, fillet=1, tooth=2, rim=1, body=1, width=1))
    few, many = (peaks(pair, 400, (0.0, 0.2, 0.4, 0.6, 0.8), replace(rough, slices=slices)) for slices in (20, 80))
    assert few == pytest.approx(many, rel=0.06)
    assert few.max() == pytest.approx(many.max(), rel=0.02)


def test_sharp_edges_are_the_limit_of_small_radii():
    """The rounding shortens the path of contact in proportion to its radius."""
    sharp, *rounded = (map_of(rounded_pair(radius), 350)["te"].values[0] for radius in (0, 10 * um, 40 * um))
    small, larger = (np.abs(te - sharp).max() for te in rounded)
    assert small < 0.1 * um
    assert larger == pytest.approx(4 * small, rel=0.3)


def test_tip_contact_is_the_load_share_of_pairs_that_touch_at_a_tip_edge():
    for resolution in (fem.Resolution(density=COARSE.density), fem.Slices(density=COARSE.density)):
        ste = fem.static_transmission_error(rounded_pair(0), [0, 350], PHASES, resolution=resolution, progress=False)
        none, share = ste["tip_contact"].values
        assert (none == 0).all()
        assert share[[0, 2]] == pytest.approx(ste["load_share"].sel(torque=350, pair=-1).values[[0, 2]])
        assert share[6] == 0


def test_edge_breaks_have_a_text_and_are_checked():
    edge = fem.EdgeBreak(0.2 * mm)
    assert repr(edge) == "EdgeBreak(radius=0.2 mm)"
    assert repr(fem.RootRelief(8 * um, 2 * mm)) == "RootRelief(C_f=8 um, length=2 mm)"
    with pytest.raises(ValueError, match=r"radius must lie .*pass metres: 0.2\*mm"):
        fem.EdgeBreak(0.2)
    with pytest.raises(ValueError, match=r"radius must lie .*half the tip"):
        paper_gear(flank=fem.EdgeBreak(2 * mm))
