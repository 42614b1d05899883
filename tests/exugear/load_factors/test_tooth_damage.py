"""Damage of teeth by load spectra: the linear sum on Woehler lines, against closed forms."""

import numpy as np
import pytest
import xarray as xr
from paper_gears import paper_pair
from scenes import smooth_box
from unequal_teeth import pair_of_unequal_teeth

import exugear
import fem

MPA = 1e6
HOURS = 1000.0
SPEED = 2 * np.pi * 1e6 / (HOURS * 3600)  # a million turns in these hours


def stresses(torques=(100.0, 400.0)) -> xr.Dataset:
    """Root stress of 2 MPa a N m at the pinion, 1.5 at the wheel; pressure of 50 MPa by the root of it."""
    phase, load = np.arange(4) / 4, np.asarray(torques)
    shape = 1 - 0.1 * np.arange(4)
    root = np.multiply.outer([2 * MPA, 1.5 * MPA], np.outer(load, shape))
    pressure = 50 * MPA * np.outer(np.sqrt(load), shape)
    grid = ("torque", "phase")
    values = {
        "root_stress": (("gear", *grid), root),
        "hertz_pressure": (grid, pressure),
        "peak_pressure": (grid, pressure),
    }
    attributes = fem.ste_map(paper_pair(), [0, 1.0], [0.0], np.zeros((2, 1))).attrs
    return xr.Dataset(values, {"gear": ["pinion", "wheel"], "torque": load, "phase": phase}, attributes)


LINE = exugear.SNCurve([1e3, 3e6, 1e10], [1000 * MPA, 400 * MPA, 340 * MPA])
SLOPE = np.log(3e6 / 1e3) / np.log(1000 / 400)


def test_a_class_on_the_line_does_the_damage_of_its_cycles():
    """At 500 MPa the line bears 3e6 (400/500)^slope cycles."""
    damage = exugear.tooth_damage(stresses(), 250.0, SPEED, HOURS, bending=LINE)
    borne = 3e6 * (400 / 500) ** SLOPE
    assert float(damage["stress"].sel(gear="pinion", failure="bending")[0]) == pytest.approx(500 * MPA)
    assert float(damage["damage"].sel(gear="pinion")[0]) == pytest.approx(1e6 / borne)
    assert float(damage["life"].sel(gear="pinion")[0]) == pytest.approx(HOURS * borne / 1e6)
    safety = (3e6 / 1e6) ** (1 / SLOPE) * 400 / 500
    assert float(damage["safety"].sel(gear="pinion")[0]) == pytest.approx(safety)
    wheel = 3e6 * (400 / 375) ** (np.log(1e10 / 3e6) / np.log(400 / 340))
    assert float(damage["damage"].sel(gear="wheel")[0]) == pytest.approx(1e6 / wheel)


def test_classes_add_up_and_the_safety_makes_the_sum_one():
    load, hours = np.array([250.0, 300.0, 220.0]), np.array([10.0, 1.0, 500.0])
    damage = exugear.tooth_damage(stresses(), load, np.full(3, 3 * SPEED), hours, bending=LINE)
    single = [exugear.tooth_damage(stresses(), t, 3 * SPEED, h, bending=LINE) for t, h in zip(load, hours, strict=True)]
    assert damage["damage"].values == pytest.approx(sum(x["damage"].values for x in single))
    assert damage["class_damage"].sum("class").values == pytest.approx(damage["damage"].values)
    safety = float(damage["safety"].sel(gear="pinion")[0])
    scaled = exugear.SNCurve(LINE.cycles, np.asarray(LINE.stress) / safety)
    again = exugear.tooth_damage(stresses(), load, np.full(3, 3 * SPEED), hours, bending=scaled)
    assert float(again["damage"].sel(gear="pinion")[0]) == pytest.approx(1.0, rel=1e-6)


def test_both_ends_of_the_line():
    """Below the last stress no damage; beyond static strength no cycle is borne."""
    light = exugear.tooth_damage(stresses(), 10.0, SPEED, HOURS, bending=LINE)
    assert light["damage"].values == pytest.approx(0.0)
    assert np.isinf(light["life"].values).all()
    assert float(light["safety"].sel(gear="pinion")[0]) > 17
    weak = exugear.SNCurve([1e3, 1e10], [300 * MPA, 100 * MPA])
    beyond = exugear.tooth_damage(stresses(), 250.0, SPEED, HOURS, bending=weak)
    assert np.isinf(beyond["damage"].values).all()
    assert beyond["life"].values == pytest.approx(0.0)
    assert float(beyond["safety"].sel(gear="pinion")[0]) < 1


@pytest.mark.parametrize("torque", [1e-4, 1.0])
def test_the_safety_of_a_light_load_is_its_distance_from_endless_life(torque):
    """2 MPa a N m against 340 MPa under 2e10 cycles, however far the stress lies below the line."""
    light = exugear.tooth_damage(stresses(), torque, SPEED, 2e4 * HOURS, bending=LINE)
    assert float(light["safety"].sel(gear="pinion")[0]) == pytest.approx(340 / (2 * torque), rel=1e-6)


def test_a_level_line_bears_the_cycles_of_its_end():
    level = exugear.SNCurve([1e3, 1e6, 1e10], [800 * MPA, 500 * MPA, 500 * MPA])
    damage = exugear.tooth_damage(stresses(), 250.0, SPEED, HOURS, bending=level)
    assert float(damage["damage"].sel(gear="pinion")[0]) == pytest.approx(1e6 / 1e10)


def test_pressure_grows_with_the_root_of_the_load_and_factors_multiply_the_load():
    line = exugear.SNCurve.pitting(700 * MPA)
    plain = exugear.tooth_damage(stresses(), 300.0, SPEED, HOURS, pitting=line)
    factored = exugear.tooth_damage(stresses(), 200.0, SPEED, HOURS, pitting=line, load_factor=1.5)
    assert float(plain["stress"].sel(gear="pinion")[0, 0]) == pytest.approx(50 * MPA * np.sqrt(300))
    assert plain["damage"].values == pytest.approx(factored["damage"].values)


def test_contacts_of_a_sun_with_three_planets_count():
    once = exugear.tooth_damage(stresses(), 300.0, SPEED, HOURS, bending=LINE)
    thrice = exugear.tooth_damage(stresses(), 300.0, SPEED, HOURS, bending=LINE, contacts=(3, 1))
    assert (thrice["damage"] / once["damage"]).values.ravel() == pytest.approx([3, 1])


def test_a_spectrum_damages_each_flank_by_its_cases():
    """The sum by hand; hours in which the back flanks carry lengthen the life."""
    box = smooth_box()
    cases = [exugear.LoadCase("drive", SPEED, 250.0, 0.25), exugear.LoadCase("coast", SPEED, -250.0, 0.75)]
    spectrum = exugear.LoadSpectrum(cases, time=4 * HOURS * 3600)
    alone = exugear.tooth_damage(stresses(), 250.0, SPEED, HOURS, bending=LINE)
    left = exugear.tooth_damage(stresses(), **spectrum.on_pinion(box), bending=LINE)
    right = exugear.tooth_damage(stresses(), **spectrum.on_pinion(box, flank="right"), bending=LINE)
    assert left["damage"].values == pytest.approx(alone["damage"].values)
    assert left["life"].values == pytest.approx(4 * alone["life"].values)
    assert right["damage"].values == pytest.approx(3 * alone["damage"].values)


@pytest.mark.parametrize(
    ("curve", "points"),
    [
        (exugear.SNCurve.pitting(1500 * MPA), [(1e5, 2400), (5e7, 1500), (1e10, 1275)]),
        (
            exugear.SNCurve.pitting(1500 * MPA, pitting_permitted=True),
            [(6e5, 2400), (1e7, 1950), (1e9, 1500), (1e10, 1275)],
        ),
        (exugear.SNCurve.pitting(1000 * MPA, "nitrided"), [(1e5, 1300), (2e6, 1000), (1e10, 850)]),
        (exugear.SNCurve.bending(860 * MPA, "through-hardened"), [(1e4, 2150), (3e6, 860), (1e10, 731)]),
        (exugear.SNCurve.bending(860 * MPA, long_life=1.0), [(1e3, 2150), (3e6, 860), (1e10, 860)]),
    ],
)
def test_lines_of_the_standard_pass_through_its_points(curve, points):
    cycles, stress = np.array(points).T
    assert np.asarray(curve.cycles) == pytest.approx(cycles)
    assert np.asarray(curve.stress) == pytest.approx(stress * MPA)


@pytest.mark.parametrize(
    ("curve", "exponent"),
    [
        (exugear.SNCurve.pitting(1500 * MPA), 2 * 6.610),
        (exugear.SNCurve.pitting(1500 * MPA, "through-hardened"), 2 * 6.610),
        (exugear.SNCurve.pitting(1000 * MPA, "nitrided"), 2 * 5.709),
        (exugear.SNCurve.pitting(1000 * MPA, "nitrocarburized"), 2 * 15.715),
        (exugear.SNCurve.bending(860 * MPA), 8.738),
        (exugear.SNCurve.bending(860 * MPA, "through-hardened"), 6.225),
        (exugear.SNCurve.bending(860 * MPA, "nitrided"), 17.035),
        (exugear.SNCurve.bending(860 * MPA, "nitrocarburized"), 84.003),
    ],
)
def test_slopes_are_the_published_exponents(curve, exponent):
    """Exponents of the torque of ISO 6336-6; pressure grows with the root of the torque."""
    cycles, stress = np.asarray(curve.cycles), np.asarray(curve.stress)
    assert np.log(cycles[1] / cycles[0]) / np.log(stress[0] / stress[1]) == pytest.approx(exponent, rel=2e-4)


def test_torques_on_several_shafts_of_a_file_are_no_load_on_a_pinion():
    torques = {"fast": 100.0, "slow": -50.0, "third": -50.0}
    case = exugear.LoadCase("split", SPEED, 100.0, torques=torques)
    with pytest.raises(ValueError, match=r"torques of 'split' act on .*'third'"):
        exugear.LoadSpectrum([case], time=3600.0).on_pinion(smooth_box())


REFUSED = {
    "pitting or bending must be given": {"bending": None},
    "stresses end at 400 N m, the spectrum reaches 500 N m": {"torque": 500.0},
    "torques < 0 load the right flanks": {"torque": -5.0},
    "speed must be": {"speed": [1.0, 2.0]},
    "hours must not all be 0": {"hours": 0.0},
    "contacts must be two numbers": {"contacts": (0, 1)},
    "load_factor must be > 0": {"load_factor": 0.0},
    "bending must be one exugear.SNCurve or those": {"bending": [LINE]},
}


@pytest.mark.parametrize("words", REFUSED)
def test_refused_with_the_remedy(words):
    arguments = {"torque": 250.0, "speed": SPEED, "hours": HOURS, "bending": LINE} | REFUSED[words]
    with pytest.raises(ValueError, match=words):
        exugear.tooth_damage(stresses(), **arguments)


def test_stresses_of_some_teeth_of_a_gear_whose_teeth_differ_warn():
    """The damage of tooth 0 is not that of the worst tooth."""
    of_first = stresses().assign_attrs(fem.ste_map(pair_of_unequal_teeth(), [0, 1.0], [0.0], np.zeros((2, 1))).attrs)
    with pytest.warns(UserWarning, match="phases reach over 1 of the 12 pitches"):
        exugear.tooth_damage(of_first, 250.0, SPEED, HOURS, bending=LINE)


def test_lines_that_rise_are_refused():
    with pytest.raises(ValueError, match="must not rise"):
        exugear.SNCurve([1e3, 1e6], [1e8, 2e8])
    with pytest.raises(ValueError, match=r"limit must lie in .* pass pascals: 860e6"):
        exugear.SNCurve.bending(860.0)
    with pytest.raises(ValueError, match=r"stress must reach .* pass pascals: 860e6"):
        exugear.SNCurve([1e3, 1e6], [800.0, 500.0])
    with pytest.raises(ValueError, match="material must be one of"):
        exugear.SNCurve.bending(1e9, "wood")
    with pytest.raises(ValueError, match="pitting_permitted has a line of its own"):
        exugear.SNCurve.pitting(1e9, "nitrided", pitting_permitted=True)
