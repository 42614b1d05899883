"""Tolerances by ISO 1328-1 against tables of the standard, deviations drawn within them, measured ones from tables."""

from dataclasses import astuple

import numpy as np
import pytest

import fem
from fem.units import deg, mm, um


def gear(**changes) -> fem.Gear:
    return fem.Gear(**{"z": 18, "m_n": 21 * mm, "b": 550 * mm, "d_bore": 200 * mm} | changes)


@pytest.mark.parametrize(
    ("d", "f_pt", "F_p", "F_alpha", "F_beta", "F_r"),
    [(378, 18, 54, 27, 29, 43), (756, 19, 67, 30, 30, 53), (1953, 22, 97, 35, 32, 78)],
)
def test_class_6_of_1995_has_the_tolerances_of_the_tables(d, f_pt, F_p, F_alpha, F_beta, F_r):
    """m_n 21 mm, b 550 mm."""
    found = fem.iso1328(gear(z=round(d / 21)), 6, edition=1995)
    listed = [found.f_pt, found.F_p, found.F_alpha, found.F_beta, found.F_r]
    assert np.array(listed) / um == pytest.approx([f_pt, F_p, F_alpha, F_beta, F_r])


def test_a_class_is_a_factor_of_the_square_root_of_two():
    coarse, fine = (np.array(astuple(fem.iso1328(gear(z=50, m_n=6 * mm, b=100 * mm), n))) for n in (10, 6))
    assert coarse / fine == pytest.approx(4, rel=0.03)


@pytest.mark.parametrize(
    ("size", "expected"),
    [
        ((100, 2, 25, 5), {"f_pt": 5.9, "F_p": 19.1, "f_H_alpha": 4.9, "f_f_alpha": 6.1, "F_alpha": 7.824}),
        ((100, 2, 25, 5), {"f_H_beta": 6.25, "f_f_beta": 6.95, "F_beta": 9.347, "F_r": 17.19}),
        ((400, 10, 100, 7), {"f_pt": 18.8, "F_p": 61.6, "f_H_alpha": 16.8, "f_f_alpha": 21.0, "F_alpha": 26.893}),
        ((400, 10, 100, 7), {"f_H_beta": 17.0, "f_f_beta": 19.8, "F_beta": 26.097, "F_r": 55.44}),
    ],
)
def test_the_edition_of_2013_takes_sizes_as_they_are(size, expected):
    """Formulas (5) to (12) by hand, rounded as in 5.2.3; totals before their parts are rounded, F_r = 0.9 F_p."""
    d, m_n, b, accuracy_class = size
    given = fem.iso1328(gear(z=round(d / m_n), m_n=m_n * mm, b=b * mm, d_bore=20 * mm), accuracy_class)
    for name, value in expected.items():
        step = 1 if value > 10 else 0.5 if value >= 5 else 0.1
        assert getattr(given, name) / um == pytest.approx(np.floor(value / step + 0.5) * step), name


def test_half_steps_are_rounded_up():
    """f_pt = 0.7 + 2.8 + 5 = 8.5; times 2 it is 17, times 1/2 4.25, which is 4.3, not the even 4.2."""
    assert fem.iso1328(gear(z=100, m_n=7 * mm, b=50 * mm), 3).f_pt == pytest.approx(4.3 * um)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"accuracy_class": 13, "edition": 1995}, "accuracy_class of ISO 1328-1:1995 must be .* 0 to 12, got 13"),
        ({"accuracy_class": 0}, "accuracy_class of ISO 1328-1:2013 must be .* 1 to 11, got 0"),
        ({"accuracy_class": 6, "edition": 2020}, "edition must be 1995 or 2013, got 2020"),
    ],
)
def test_what_the_standard_does_not_know_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        fem.iso1328(gear(), **arguments)


def test_sizes_beyond_the_standard_are_refused():
    many = gear(z=1001, m_n=3 * mm, b=20 * mm)
    with pytest.raises(ValueError, match="z must have 5 to 1000 teeth of ISO 1328-1:2013, got 1001; take edition=1995"):
        fem.iso1328(many, 6)
    with pytest.raises(ValueError, match=r"b must lie in \[4, 1000\] mm of ISO 1328-1:1995, got 1100 mm"):
        fem.iso1328(gear(b=1100 * mm), 6, edition=1995)


@pytest.mark.parametrize("seed", range(5))
def test_drawn_deviations_keep_their_tolerances_and_come_again(seed):
    given, limits = gear(z=35), fem.iso1328(gear(z=35), 6)
    drawn = fem.drawn_deviations(given, limits, seed, leads=True)
    index = np.array(next(part for part in drawn.flank if isinstance(part, fem.PitchDeviation)).values)
    pitch = np.abs(index - np.roll(index, 1)).max()
    assert pitch <= limits.f_pt and np.ptp(index) <= limits.F_p
    assert max(pitch / limits.f_pt, np.ptp(index) / limits.F_p) >= 0.5
    assert drawn == fem.drawn_deviations(given, limits, seed, leads=True)
    assert drawn != fem.drawn_deviations(given, limits, seed + 1, leads=True)


@pytest.mark.parametrize("seed", range(5))
def test_drawn_profiles_keep_their_total_deviation(seed):
    """The slope and the form of a profile add up to F_alpha at most."""
    limits = fem.iso1328(gear(z=35), 6)
    drawn = fem.drawn_deviations(gear(z=35), limits, seed)
    roll = np.linspace(0, 1, 101)
    profiles = [part.flank for part in drawn.flank if isinstance(part, fem.OnTooth)]
    totals = [np.ptp(slope.C_a * roll + form.C_alpha * (2 * roll - 1) ** 2) for slope, form in profiles]
    assert len(totals) == 35 and max(totals) <= limits.F_alpha * (1 + 1e-9)


def test_drawn_deviations_of_left_flanks_leave_the_right_ones():
    left, right = (fem.TipRelief(30 * um, 5 * mm),), (fem.TipRelief(60 * um, 5 * mm),)
    limits = fem.iso1328(gear(), 6)
    drawn = fem.drawn_deviations(gear(flank=fem.Sides(left, right)), limits, 1)
    alike = fem.drawn_deviations(gear(flank=left), limits, 1)
    assert drawn.coast_flank == right and drawn.drive_flank == alike.drive_flank


def test_a_wobbling_gear_has_a_helix_slope_that_returns_once_per_turn():
    parts = fem.wobble(gear(), 20 * um, 90 * deg)
    slopes = [part.flank[0].C_Hbeta for part in parts]
    assert slopes == pytest.approx(20 * um * np.cos(2 * np.pi * np.arange(18) / 18 - np.pi / 2), abs=1e-18)


def written(path, text: str):
    path.write_text(text, encoding="utf-8")
    return path


def test_pitch_charts_hold_what_is_removed_or_single_pitches(tmp_path):
    removed = np.random.default_rng(0).uniform(-5, 5, 18)
    removed -= removed.mean()
    single = -np.diff(removed, prepend=removed[-1])
    rows = "\n".join(f"{i + 1}, {value:.12g}" for i, value in enumerate(removed))
    pitches = "\n".join(f"{i}; {value:.12g}" for i, value in enumerate(single))
    chart = fem.pitch_chart(written(tmp_path / "a.csv", f"tooth [1], removed [um]\n{rows}"), gear())
    assert np.array(chart.values) / um == pytest.approx(removed)
    chart = fem.pitch_chart(written(tmp_path / "b.csv", f"# left\ntooth [-]; single_pitch [um]\n{pitches}"), gear())
    assert np.array(chart.values) / um == pytest.approx(removed)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tooth [1], removed [deg]\n0, 1", "line 1 of .* gives removed in .deg., which must be one of .*convert it"),
        ("tooth [1], removed\n0, 1", "line 1 of .* gives 'removed' no unit"),
        ("tooth [1], removed [um]\n0, 1\n2, 1\n", "lacks tooth 1, 3, 4, 5, 6 of the 18 teeth from 0 to 17; add a line"),
        ("tooth [1], removed [um]\n0, 1\n1, nan", "line 3 of .* holds nan for removed, which must be finite"),
        ("tooth [1], removed [um]\n0, 1\ntooth [1], removed [um]\n1, 1", "line 3 of .* is a second header"),
        ("tooth [1], removed [um]\n0, 1\n0, 1", "lines 2 and 3 of .* give the same point"),
        ("tooth [1]\n0", r"must hold one of the columns removed \[um\] and single_pitch \[um\], got \[\]"),
        ("tooth [1], removed [mm]\n0, 0\n1, 3", "line 3 of .* holds 3 mm for removed, .* within 1 mm; correct .* unit"),
    ],
)
def test_charts_with_mistakes_are_refused_with_line_and_remedy(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        fem.pitch_chart(written(tmp_path / "chart.csv", text), gear())


def test_single_pitches_that_do_not_close_are_refused(tmp_path):
    rows = "\n".join(f"{i}, 1" for i in range(18))
    with pytest.raises(ValueError, match="must add up to 0 around the gear, got 18 um"):
        fem.pitch_chart(written(tmp_path / "c.csv", f"tooth [1], single_pitch [um]\n{rows}"), gear())


def test_traces_and_topographies_become_deviations_of_their_teeth(tmp_path):
    given = gear()
    low, high = (1e3 * x for x in (given.roll_form, given.roll_tip))
    profile = f"tooth [1], roll [mm], removed [um]\n3, {low}, 0\n3, {high}, 8\n7, {low}, 0\n7, {high}, 4\n"
    parts = fem.flank_traces(written(tmp_path / "p.csv", profile), given, first=0)
    assert [part.tooth for part in parts] == [3, 7]
    tip = parts[0].removed(given.face._replace(tooth=3), np.array(given.roll_tip), np.array([-0.2, 0.2]))
    assert tip == pytest.approx([8 * um, 8 * um])
    assert parts[0].removed(given.face._replace(tooth=4), np.array(given.roll_tip), np.array(0.0)) == 0
    helix = "tooth [1], axial [mm], removed [um]\n0, -200, -2\n0, 200, 2\n"
    (part,) = fem.flank_traces(written(tmp_path / "h.csv", helix), given)
    assert part.removed(given.face, np.array(given.roll_form), np.array(0.1)) == pytest.approx(1 * um)
    from_one = f"tooth [1], roll [mm], removed [um]\n18, {low}, 0\n18, {high}, 8\n"
    assert [part.tooth for part in fem.flank_traces(written(tmp_path / "l.csv", from_one), given)] == [17]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tooth [1], removed [um]\n0, 1", "must hold the column tooth, and roll or axial"),
        ("tooth [1], axial [mm], removed [um]\n3, -9, 0\n3, 9, 1", "neither tooth 0 nor tooth 18.*; pass first=0"),
        ("tooth [1], axial [mm], removed [um]\n0, -9, 0\n0, 9, 1\n18, -9, 0\n18, 9, 1", "from 0 to 17, of 18 teeth"),
        ("tooth [1], axial [mm], removed [um]\n0, 3, 0", r"two points or more of a trace, got one value of .'axial'"),
        ("tooth [1], axial [mm], removed [mm]\n0, -9, 0\n0, 9, 4", "line 3 .* 4 mm for removed, .* within 1 mm"),
        ("tooth [1]; axial [mm]; removed [um]\n0; -9; 0,5", "line 2 .* holds '0,5' for removed; .* decimal point"),
    ],
)
def test_traces_with_mistakes_are_refused_with_line_and_remedy(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        fem.flank_traces(written(tmp_path / "x.csv", text), gear())
