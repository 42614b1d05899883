"""Half-spaces under forces along a line: closed forms, energy, and Hertz's elliptical contact of crowned flanks."""

import numpy as np
import pytest
from contacts import resolved_contacts
from hypothesis import given
from hypothesis import strategies as st
from line_contact import modulus
from measured_rows import deviation
from paper_gears import paper_gear
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from whole_section import FACES

import fem
from fem import Density, Resolution
from fem.elasticity.half_space import along_line
from fem.units import mm, um

FAR = 30.0
HALF, WHOLE = FACES["equal"], FACES["any"]
CROWNED = fem.GearPair(paper_gear(flank=(fem.LeadCrowning(10 * um),)), paper_gear(), a=150 * mm)


def test_a_line_of_force_displaces_itself_by_the_logarithm_of_its_length():
    """Mean of 1/distance at depth d over a line of length L, on both sides: 2 / L (ln(2 L / d) - 1) for d << L."""
    length, depth = 3 * mm, 1e-3 * mm
    displacement = along_line(np.array([0, length]), FAR, depth, WHOLE)[0, 0]
    assert displacement == pytest.approx((np.log(2 * length / depth) - 1) / length, rel=1e-3)


def test_distant_segments_displace_one_another_by_the_inverse_of_their_distance():
    edges = np.array([0, 0.1, 10, 10.1]) * mm
    between = along_line(edges, FAR, 1e-2 * mm, WHOLE)
    assert between[0, 2] == pytest.approx(1 / (2 * 10 * mm), rel=1e-3)
    assert between == pytest.approx(between.T)


@given(st.lists(st.floats(0.05, 3), min_size=2, max_size=12), st.floats(1e-4, 2e-3))
def test_displacement_of_a_line_does_not_depend_on_a_small_depth(lengths, depth):
    """Half-planes clamped at twice the depth are displaced more, and the line beside them less by the same amount."""
    edges = np.append(0, np.cumsum(lengths))
    deep, deeper = (along_line(edges, 1e3, d, WHOLE) for d in (depth, 2 * depth))
    uniform = np.diff(edges)
    loss = (deep - deeper) @ uniform
    assert loss[1:-1] == pytest.approx(np.log(2), rel=0.02)
    assert loss == pytest.approx(np.log(2), rel=0.15)


def test_end_faces_mirror_the_forces_that_reach_them():
    """A uniform force moves the ends as it moves the middle, except for the part of the force that is further away."""
    edges = np.linspace(-1, 1, 41)
    open_ends, closed = (along_line(edges, end, 0.01, WHOLE).sum(axis=1) for end in (1e3, 1.0))
    assert np.ptp(open_ends) > 10 * np.ptp(closed)
    upper = along_line(edges[20:], 1.0, 0.01, HALF)
    whole = along_line(edges, 1.0, 0.01, WHOLE)
    assert upper == pytest.approx((whole + whole[::-1])[20:, 20:])


def elliptical_contact(force: float, radius_along: float, radius_across: float) -> tuple[float, float]:
    """Approach [m] and largest pressure [Pa] of two steel bodies in a point (Johnson, Contact Mechanics, 4.2)."""
    along, across = 1 / (2 * radius_along), 1 / (2 * radius_across)

    def excess(ratio: float) -> float:
        first, second = ellipk(1 - ratio**2), ellipe(1 - ratio**2)
        return (second / ratio**2 - first) / (first - second) - across / along

    ratio = brentq(excess, 1e-4, 0.9)
    first, second, squared = ellipk(1 - ratio**2), ellipe(1 - ratio**2), 1 - ratio**2
    a = np.cbrt(1.5 * force / np.pi * (first - second) / (modulus() * squared * along))
    pressure = 1.5 * force / (np.pi * ratio * a**2)
    return pressure / modulus() * ratio * a * first, pressure


def test_crowned_flanks_approach_as_hertz_says_of_point_contacts(measured):
    """Pitch point, patches of 0.4 to 1.8 mm of 23; the rest of the teeth deflects in proportion to the force."""
    density = Density(flank=10, fillet=2, tooth=3, rim=3, body=4)
    (contact,) = resolved_contacts(CROWNED, Resolution(density), [0.0], slices=40)
    radii, force = ((CROWNED.b / 2) ** 2 / (2 * 10 * um), CROWNED.roll_pitch / 2), np.array([0.03, 0.1, 0.3, 1.0])
    states = [contact.state(f) for f in force]
    approach, pressure = np.transpose([elliptical_contact(f, *radii) for f in force])
    deflection = np.array([state.te for state in states]) - contact.first_touch(0.0)
    beside = (deflection - approach) / force
    error = deviation([state.quantities.peak_pressure[0] for state in states], pressure)
    measured("crowned flanks at the pitch point, 0.03 to 1 N: largest pressure", error, 0.01)
    assert (np.abs(beside - beside[-1]) * force < 0.005 * approach).all()


def test_slices_of_narrow_gears_may_be_shorter_than_the_contact_is_wide():
    """1.2 mm wide, misaligned: slices shorter than the contact is wide."""
    narrow = paper_gear(b=1.2 * mm)
    pair, options = fem.GearPair(narrow, narrow, a=150 * mm), {"offsets": fem.Offsets(misalignment=2e-3)}
    few, many = (
        fem.static_transmission_error(pair, [8, 20], 8, resolution=Resolution(slices=n), progress=False, **options)
        for n in (10, 60)
    )
    assert few["te"].values == pytest.approx(many["te"].values, rel=1e-3)


def test_elements_across_the_width_need_not_resolve_short_patches():
    """Deflection under a thousandth of the load, on patches a fourth as long as the widest element."""
    few, many = (_deflection(Resolution(Density(width=n))) for n in (2, 5))
    assert few == pytest.approx(many, rel=0.015)


def test_elements_of_the_section_need_not_resolve_bending_far_from_short_patches():
    """Contact over a fourth of the face: coarse elements of rim and body err beside the load too."""
    flank = (fem.LeadCrowning(30 * um),)
    pair, torque = fem.GearPair(paper_gear(flank=flank), paper_gear(flank=flank), a=150 * mm), [0, 5, 15, 60]
    coarse, fine = Density(width=5), Density(flank=22, fillet=5, tooth=6, rim=8, body=12, width=5)
    few, many = (
        fem.static_transmission_error(pair, torque, 6, resolution=Resolution(density), progress=False)["te"].values
        for density in (coarse, fine)
    )
    assert (few - few[0])[1:].mean(axis=1) == pytest.approx((many - many[0])[1:].mean(axis=1), rel=0.003)


def _deflection(resolution: Resolution) -> np.ndarray:
    torque = [0, 0.02, 0.1]
    te = fem.static_transmission_error(CROWNED, torque, 4, resolution=resolution, progress=False)["te"].values
    return te[1:] - te[0]
