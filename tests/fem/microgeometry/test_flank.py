"""Flank modifications and deviations: reliefs by diameter, arcs, pitch deviations, grids, both sides, their sums."""

from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from involutes import involute_flank
from modified_pairs import ALL_KINDS
from paper_gears import paper_gear
from strategies import gears, modifications

import fem
from fem.microgeometry import flank
from fem.units import mm, um

FACE = paper_gear().face._replace(roll_form=18 * mm, roll_tip=33 * mm, r_b=69.6 * mm, land=np.inf)
ROLL, AXIAL = np.linspace(18, 33, 39) * mm, np.linspace(-11.5, 11.5, 9)[:, None] * mm
SEVERAL = settings(max_examples=100)


def stored(pair: fem.GearPair, path) -> fem.GearPair:
    data = fem.ste_map(pair, [0, 1], [0, 0.5], np.zeros((2, 2)))
    return fem.pair_of(fem.load(fem.save(data, path)))


@given(modifications(z=57))
@SEVERAL
def test_sums_do_not_depend_on_the_order(parts):
    sums = [flank.removed(order, FACE, ROLL, AXIAL, tooth=3) for order in permutations(parts)]
    assert sums[0].shape == (9, 39)
    assert np.ptp(sums, axis=0).max() < 1e-12 * um
    alone = sum((flank.removed((part,), FACE, ROLL, AXIAL, tooth=3) for part in parts), np.zeros((9, 39)))
    assert sums[0] == pytest.approx(alone, abs=1e-12 * um)


@given(modifications(z=57), st.floats(18e-3, 33e-3), st.floats(-11e-3, 11e-3))
@SEVERAL
def test_modifications_are_continuous(parts, roll, axial):
    """A nanometre along the flank changes the material by no more than the steepest slope allows."""
    near = flank.removed(parts, FACE, roll + np.array([0, 1e-9]), axial + np.array([[0], [1e-9]]))
    assert np.ptp(near) < 2e-9 * 20


@given(modifications(z=57))
@SEVERAL
def test_modifications_are_read_back_from_their_text(parts):
    for modified in (parts, fem.Sides(parts), fem.Sides((), parts)):
        assert flank.from_text(flank.to_text(modified)) == modified


@given(gears(), st.floats(0.01, 0.99))
@SEVERAL
def test_relief_by_diameter_is_relief_by_roll_length(gear, share):
    """d = 2 sqrt(r_b^2 + roll^2), by the involute."""
    roll = gear.roll_form + share * (gear.roll_tip - gear.roll_form)
    d = 2 * float(involute_flank(gear, roll)[0])
    at = np.linspace(gear.roll_form, gear.roll_tip, 21)
    for by_diameter, by_length in (
        (fem.TipRelief(9 * um, d_Ca=d), fem.TipRelief(9 * um, gear.roll_tip - roll)),
        (fem.RootRelief(9 * um, d_Cf=d, power=2), fem.RootRelief(9 * um, roll - gear.roll_form, power=2)),
    ):
        relieved = replace(gear, flank=[by_diameter])
        assert flank.removed(relieved.drive_flank, relieved.face, at, 0) == pytest.approx(
            flank.removed((by_length,), gear.face, at, 0), abs=1e-6 * um
        )
        assert flank.removed(relieved.drive_flank, relieved.face, [roll], 0) == pytest.approx(0, abs=1e-6 * um)


@pytest.mark.parametrize("amount", [15 * um, 50 * um])
def test_arc_is_parabolic(amount):
    """A circle that leaves the flank tangentially and removes C_a at the end of 2.5 mm."""
    length = 2.5 * mm
    radius = (length**2 + amount**2) / (2 * amount)
    way = np.linspace(0, length, 101)
    arc = radius - np.sqrt(radius**2 - way**2)
    relief = fem.TipRelief(amount, length, power=2).removed(FACE, FACE.roll_tip - length + way, 0.0)
    assert np.abs(arc - relief).max() == pytest.approx(amount * (amount / length) ** 2 / 4, rel=1e-2)


def test_pitch_deviation_displaces_its_tooth_alone():
    values = np.zeros(57)
    values[[0, 1, 56]] = 3 * um, -2 * um, 7 * um
    parts = (fem.PitchDeviation(values), fem.LeadCrowning(5 * um))
    plain = flank.removed(parts[1:], FACE, ROLL, AXIAL)
    for tooth, value in ((0, 3), (1, -2), (2, 0), (-1, 7), (56, 7), (58, -2)):
        assert flank.removed(parts, FACE, ROLL, AXIAL, tooth=tooth) - plain == pytest.approx(value * um, abs=1e-12 * um)
    assert flank.removed(parts, FACE, ROLL, AXIAL) == pytest.approx(plain + 3 * um)


def test_left_and_right_flanks_may_have_different_modifications():
    left, right = fem.TipRelief(15 * um, 2.5 * mm), fem.LeadCrowning(4 * um)
    gear = paper_gear(flank=fem.Sides([left], [right]))
    assert (gear.drive_flank, gear.coast_flank) == ((left,), (right,))
    same = paper_gear(flank=[left, right])
    assert same.drive_flank == same.coast_flank == (left, right)
    assert gear != same
    one_sided = flank.removed(gear.drive_flank, gear.face, ROLL, AXIAL)
    assert one_sided == pytest.approx(flank.removed((left,), gear.face, ROLL, AXIAL))


def test_grid_reproduces_bilinear_fields_and_continues_constant():
    roll, axial = np.array([18, 20, 25, 33]) * mm, np.array([-10, -2, 10]) * mm

    def field(s, z):
        return 2e-4 * s - 1e-4 * z + 0.03 * s * z

    grid = fem.Grid(roll, axial, field(roll[:, None], axial))
    inside = flank.removed((grid,), FACE, np.linspace(18, 33, 31) * mm, np.linspace(-10, 10, 21)[:, None] * mm)
    exact = field(np.linspace(18, 33, 31) * mm, np.linspace(-10, 10, 21)[:, None] * mm)
    assert inside == pytest.approx(exact, abs=1e-15)
    outside = flank.removed((grid,), FACE, np.array([10, 40]) * mm, np.array([[-12], [12]]) * mm)
    corners = field(np.array([18, 33]) * mm, np.array([[-10], [10]]) * mm)
    assert outside == pytest.approx(corners, abs=1e-15)


def test_grid_of_a_smooth_flank_converges_with_the_square_of_its_spacing():
    part, errors = fem.ProfileCrowning(8 * um), []
    fine = np.linspace(18, 33, 1001) * mm
    for n in (11, 21, 41):
        lines = np.linspace(18, 33, n) * mm
        values = np.repeat(part.removed(FACE, lines, 0.0)[:, None], 2, axis=1)
        grid = fem.Grid(lines, [-11 * mm, 11 * mm], values)
        errors.append(np.abs(flank.removed((grid,), FACE, fine, 0) - part.removed(FACE, fine, 0.0)).max())
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx(4, rel=0.02)


def with_ridge(lines, axial: float) -> fem.GearPair:
    """Pair with a pinion on which a grid line at an axial position is raised by 6 um."""
    data = {"m_n": 3 * mm, "b": 20 * mm}
    values = np.where(np.isclose(lines, axial), -6 * um, 0.0)
    grid = fem.Grid([1 * mm, 40 * mm], lines, np.stack([values, values]))
    return fem.GearPair(fem.Gear(z=25, d_bore=30 * mm, flank=grid, **data), fem.Gear(z=40, d_bore=50 * mm, **data))


@pytest.mark.parametrize("half", [0.2 * mm, 0.45 * mm])
def test_a_narrow_ridge_carries_the_first_load(half):
    """Without load it touches alone; with load te grows as with slices that are narrower than the ridge."""
    pair = with_ridge([-10 * mm, 3.5 * mm - half, 3.5 * mm, 3.5 * mm + half, 10 * mm], 3.5 * mm)
    coarse, fine = (
        fem.static_transmission_error(
            pair, [0, 0.5, 5, 20, 200], [0.1, 0.6], resolution=fem.Resolution(slices=slices), progress=False
        )["te"].values
        for slices in (20, 80)
    )
    assert coarse[0] == pytest.approx(-6 * um, abs=1e-9 * um)
    assert (np.diff(coarse, axis=0) > 0.5 * um).all()
    assert coarse - coarse[0] == pytest.approx(fine - fine[0], rel=0.05)


@pytest.mark.parametrize("axial", [-3.6 * mm, 0.4 * mm, 9.2 * mm])
def test_any_line_of_an_even_grid_may_touch_first(axial):
    pair = with_ridge(np.linspace(-10, 10, 51) * mm, axial)
    te = fem.static_transmission_error(pair, [0], [0.1, 0.6], resolution=fem.Resolution(), progress=False)["te"].values
    assert te == pytest.approx(-6 * um, abs=1e-9 * um)


@pytest.mark.parametrize(("lines", "edges"), [(range(9), ()), ((0, 6, 6.5, 7, 14), (6, 6.5, 7)), ((0, 1), ())])
def test_edges_of_a_grid_are_the_lines_of_local_refinements(lines, edges):
    grid = fem.Grid([18 * mm, 33 * mm], np.array(lines) * mm, np.zeros((2, len(lines))))
    assert flank.edges_across((grid,), FACE) == pytest.approx(np.array(edges) * mm)


def test_pairs_are_read_back_from_files(tmp_path):
    rng = np.random.default_rng(1)
    grid = fem.Grid(
        np.linspace(18, 33, 60) * mm, np.linspace(-11, 11, 120) * mm, 5 * um * rng.standard_normal((60, 120))
    )
    pitch = fem.PitchDeviation(5 * um * rng.standard_normal(57))
    pinion = paper_gear(flank=fem.Sides([grid, pitch], [fem.TipRelief(9 * um, d_Ca=152 * mm)]), fillet=0.9 * mm)
    wheel = paper_gear(z=58, d_a=157 * mm, d_f=None, h_fP=1.3 * 2.6 * mm, material=fem.Material(E=3e9, nu=0.4))
    pair = fem.GearPair(pinion, wheel, a=151.5 * mm)
    assert stored(pair, tmp_path / "pair.nc") == pair


def test_modifications_that_users_write_are_added_to_the_others():
    class Wave:
        def removed(self, face, roll, axial):
            return 1 * um * np.sin(roll / mm) + 0 * axial

    gear = paper_gear(flank=[Wave(), fem.HelixSlope(2 * um)])
    total = flank.removed(gear.flank, gear.face, ROLL, AXIAL)
    assert total == pytest.approx(1 * um * np.sin(ROLL / mm) + 2 * um * AXIAL / (23 * mm), abs=1e-18)


@dataclass(frozen=True)
class Unfinished:
    """A modification of a user without a value at one end face."""

    def removed(self, face, roll, axial):
        return np.where(axial > 0.49 * face.width, np.nan, 0.0) + 0 * roll


class NoDataclass:
    def removed(self, face, roll, axial):
        return 0 * roll * axial


def test_modifications_of_users_have_values_and_can_be_stored():
    with pytest.raises(ValueError, match=r"Unfinished\(\) removes material that is not finite"):
        paper_gear(flank=Unfinished())
    pair = fem.GearPair(paper_gear(flank=NoDataclass()), paper_gear(), a=150 * mm)
    with pytest.raises(ValueError, match=r"flank cannot be stored with a map .*dataclasses of numbers"):
        fem.static_transmission_error(pair, 50, 4, progress=False)


def test_pitch_deviations_become_python_floats():
    values = np.linspace(0, 5, 57).astype(np.float32) * np.float32(um)
    part = fem.PitchDeviation(values)
    assert part == fem.PitchDeviation(float(value) for value in values) == fem.PitchDeviation(values.tolist())
    assert flank.from_text(flank.to_text((part,))) == (part,)


def with_flank(*parts) -> fem.Gear:
    return paper_gear(flank=parts)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fem.TipRelief(15 * um), "begins at a roll length or at a diameter"),
        (lambda: fem.TipRelief(15 * um, 2 * mm, d_Ca=150 * mm), "begins at a roll length or at a diameter"),
        (lambda: fem.RootRelief(15 * um, d_Cf=150), "d_Cf must lie .*150\\*mm"),
        (lambda: with_flank(fem.TipRelief(15 * um, d_Ca=155 * mm)), "d_Ca, .*from root form to tip circle, got 155 mm"),
        (
            lambda: with_flank(fem.RootRelief(15 * um, d_Cf=130 * mm)),
            "d_Cf, .*from root form to tip circle, got 130 mm",
        ),
        (lambda: with_flank(fem.TipRelief(15 * um, d_Ca=154.5 * mm)), "d_Ca, .*got 154.5 mm; .*no length"),
        (lambda: with_flank(fem.RootRelief(15 * um, d_Cf=2 * paper_gear().r_form)), "d_Cf, .*no length"),
        (lambda: with_flank(fem.TipRelief(15 * um, 30 * mm)), "length must lie"),
        (lambda: with_flank(fem.EndRelief(15 * um, 12 * mm)), "up to half the face width"),
        (lambda: with_flank(fem.PitchDeviation(np.zeros(56))), "one pitch deviation a tooth, z = 57, got 56"),
        (lambda: fem.PitchDeviation([np.nan]), "values must lie"),
        (lambda: fem.PitchDeviation(5 * um), "values must be one pitch deviation"),
        (lambda: fem.PitchDeviation(np.zeros((57, 2))), "values must be one pitch deviation"),
        (lambda: fem.PitchDeviation(["5"]), "values must hold real numbers"),
        (lambda: fem.PitchDeviation([5]), "values must lie .*15\\*um"),
        (lambda: fem.Grid([18, 33], [-10 * mm, 10 * mm], np.zeros((2, 2))), "roll must lie .*pass metres"),
        (lambda: fem.Grid([0, 0.1], [0.1, 0.0], np.zeros((2, 2))), "axial must increase; sort it"),
        (lambda: fem.Grid([0, 0.1], [0, np.nan], np.zeros((2, 2))), r"axial must be finite, got nan at \[1\]"),
        (lambda: fem.Grid([0, 0.1, 0.2], [0, 0.1], np.zeros((2, 3))), "shape .* = \\(3, 2\\), got \\(2, 3\\)"),
        (lambda: fem.Grid([0, 0.1], [0, 0.1], [[0, np.nan], [0, 0]]), r"values must be finite, got nan at \[0, 1\]"),
        (lambda: fem.Grid([0, 0.1], [0, 0.1], [[0, 5], [0, 0]]), "values must lie .*15\\*um"),
        (lambda: with_flank(fem.Grid([0, 0.001], [-0.01, 0.01], np.zeros((2, 2)))), "roll misses the flank"),
        (lambda: with_flank(fem.Grid([0, 0.1], [0.02, 0.03], np.zeros((2, 2)))), "axial misses the flank"),
        (lambda: fem.Grid([0, 0.1], [0, 0.1], [[0, 0], [0]]), "values must hold .*rows of equal length"),
        (lambda: fem.Grid([0, [0.1]], [0, 0.1], np.zeros((2, 2))), "roll must hold .*rows of equal length"),
        (lambda: paper_gear(flank=[fem.TipRelief]), "flank must hold modifications such as fem.TipRelief\\(15"),
        (lambda: fem.Sides(15 * um), "flank must hold modifications"),
        (lambda: paper_gear(flank=15 * um), "flank must hold modifications"),
    ],
)
def test_impossible_flanks_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_modifications_at_their_ends():
    roll, axial = np.array([FACE.roll_form, FACE.roll_tip]), np.array([[-11.5 * mm], [0], [11.5 * mm]])
    tip, root, profile, lead, slope, end = (part.removed(FACE, roll, axial) / um for part in ALL_KINDS)
    assert tip == pytest.approx(np.tile([0, 15.0], (3, 1)))
    assert root == pytest.approx(np.tile([8.0, 0], (3, 1)))
    assert profile == pytest.approx(4.0)
    assert lead[:, 0] == pytest.approx([10, 0, 10])
    assert slope[:, 0] == pytest.approx([-3, 0, 3])
    assert end[:, 0] == pytest.approx([12, 0, 12])
    together = flank.removed(ALL_KINDS, FACE, roll, axial) / um
    assert together == pytest.approx(tip + root + profile + lead + slope + end)


def test_added_material_must_not_be_steep_where_the_profile_is_short():
    """At the base circle a roll length of 0.2 mm is 2 um of profile."""
    fem.Gear(z=25, m_n=1 * mm, b=8 * mm, d_bore=5 * mm, flank=fem.RootRelief(8 * um, 0.2 * mm))
    with pytest.raises(ValueError, match=r"adds .* m per metre of profile"):
        fem.Gear(z=25, m_n=1 * mm, b=8 * mm, d_bore=5 * mm, x=-0.5, flank=fem.RootRelief(-8 * um, 0.2 * mm))


def test_modifications_are_read_back_from_the_file():
    edges = (fem.EdgeBreak(0.2 * mm),)
    assert flank.from_text(flank.to_text(ALL_KINDS)) == ALL_KINDS and flank.from_text(flank.to_text(edges)) == edges
    pair = fem.GearPair(with_flank(*ALL_KINDS), paper_gear(), a=150 * mm)
    assert fem.pair_of(fem.ste_map(pair, [0, 1], [0, 0.5], np.zeros((2, 2)))) == pair
    with pytest.raises(ValueError, match="unknown flank modifications"):
        flank.from_text('[{"kind": "os.system"}]')


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fem.TipRelief(15, 2.5 * mm), "C_a must lie .*15\\*um"),
        (lambda: fem.TipRelief(15 * um, 2.5), "length must lie .*2.5\\*mm"),
        (lambda: fem.TipRelief(15 * um, 2.5 * mm, power=0.5), "power must lie"),
        (lambda: fem.TipRelief(15 * um, 2.5 * mm, power="arc"), "power must be one real number .*got 'arc'"),
        (lambda: fem.TipRelief(None, 2.5 * mm), "C_a must be one real number .*got None"),
        (lambda: fem.LeadCrowning([5 * um]), "C_beta must be one real number"),
        (lambda: fem.LeadCrowning(np.nan), "C_beta must lie"),
        (lambda: fem.EndRelief(1 * um, -1 * mm), "length must lie"),
        (lambda: with_flank(15 * um), "flank must hold modifications"),
        (lambda: fem.Offsets(misalignment=0.5), "misalignment must lie within 0.01 rad"),
        (lambda: fem.Offsets(misalignment=np.nan), "misalignment must be finite"),
    ],
)
def test_modifications_out_of_range_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_numbers_of_any_library_are_kept_in_the_file():
    length = np.float32(2 * mm)
    parts = (
        fem.TipRelief(np.float32(15e-6), length, power=np.int64(2)),
        fem.RootRelief(np.float64(8 * um), d_Cf=np.array(145 * mm)),
        fem.LeadCrowning(np.array(5e-6)),
        fem.EndRelief(np.float32(12 * um), length),
    )
    assert parts[0] == fem.TipRelief(float(np.float32(15e-6)), float(length), 2.0)
    assert flank.from_text(flank.to_text(parts)) == parts


def test_modifications_end_with_the_flank():
    """Below its root form and above its tip there is nothing to remove or add."""
    gear = paper_gear()
    parts = (fem.RootRelief(-8 * um, 0.1 * mm, 2.9), fem.TipRelief(5 * um, 0.2 * mm, 2.0))
    ends = np.array([gear.roll_form, gear.roll_tip])
    beyond = flank.removed(parts, gear.face, ends + np.array([-3, 3]) * mm, 0.0)
    assert beyond == pytest.approx(flank.removed(parts, gear.face, ends, 0.0))
    assert np.abs(beyond).max() < 10 * um


def test_a_single_tooth_has_its_modifications_alone():
    spall = fem.Spall(d=69 * mm, height=2 * mm, width=8 * mm, axial=2 * mm)
    given = fem.Gear(
        z=23, m_n=3 * mm, b=20 * mm, d_bore=20 * mm, flank=(fem.TipRelief(10 * um, 2 * mm), fem.OnTooth(5, spall))
    )
    roll, axial = np.array(given.face.roll_at(69 * mm)), np.array([2 * mm, -8 * mm])
    for tooth in (5, -18, 28):
        assert flank.removed(given.drive_flank, given.face, roll, axial, tooth=tooth) == pytest.approx([100 * um, 0])
    assert flank.removed(given.drive_flank, given.face, roll, axial, tooth=4) == pytest.approx([0, 0])
    assert flank.from_text(flank.to_text(given.flank)) == given.flank
