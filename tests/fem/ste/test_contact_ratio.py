"""Contact ratio under load: against counts over many phases, smooth over the load, its limits."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from helical_gears import helical
from paper_gears import few_teeth, paper_gear, paper_pair

import fem
from fem.units import deg, mm, um

SLICES = fem.Slices(COARSE.density, 12)
RELIEVED = fem.GearPair(*(paper_gear(flank=(fem.TipRelief(15 * um, 2.5 * mm),)) for _ in range(2)), a=150 * mm)
CROWNED = (fem.TipRelief(10 * um, 2 * mm), fem.LeadCrowning(6 * um))
HELICAL = fem.GearPair(helical(1, flank=CROWNED), helical(-1), a=150 * mm)
TILTED = fem.Offsets(misalignment=1e-4)


def ste_of(pair, torque, phases=30, resolution=SLICES, **options):
    return fem.static_transmission_error(pair, torque, phases, resolution=resolution, progress=False, **options)


def contact_ratio(*arguments, **options) -> np.ndarray:
    return ste_of(*arguments, **options)["contact_ratio"].values


@pytest.mark.parametrize(
    ("pair", "resolution"), [(paper_pair(), SLICES), (paper_pair(), COARSE), (RELIEVED, SLICES), (HELICAL, SLICES)]
)
def test_contact_ratio_of_30_phases_is_the_number_of_pairs_in_contact_on_average_over_600(pair, resolution):
    torque, options = [20, 100, 200, 350], {"resolution": resolution, "offsets": TILTED if pair is HELICAL else None}
    average = ste_of(pair, torque, 600, **options)["pairs_in_contact"].mean("phase").values
    for begin in (0, 0.4):
        assert contact_ratio(pair, torque, (np.arange(30) + begin) / 30, **options) == pytest.approx(average, abs=0.005)


@pytest.mark.parametrize("pair", [paper_pair(), RELIEVED, HELICAL])
def test_contact_ratio_grows_smoothly_with_the_load(pair):
    growth = np.diff(contact_ratio(pair, np.linspace(20, 400, 77)))
    assert growth.min() > 0
    assert (growth[1:] / growth[:-1]).max() < 2


@pytest.mark.parametrize("resolution", [SLICES, COARSE])
def test_contact_ratio_of_a_light_load_is_that_of_the_involutes(resolution):
    for pair in (paper_pair(), fem.GearPair(few_teeth(beta=15 * deg), few_teeth(beta=-15 * deg))):
        assert contact_ratio(pair, 0.01, resolution=resolution) == pytest.approx(pair.eps_gamma, abs=0.003)


def test_contact_ratio_does_not_depend_on_the_phases():
    """Independent finite elements: 2 - 0.200 at 350 N m."""
    uneven = np.append(np.linspace(0, 0.3, 20), np.linspace(0.31, 0.99, 25))
    for phases in (uneven, 60):
        assert contact_ratio(paper_pair(), 350, phases, fem.Resolution()) == pytest.approx(2 - 0.200, abs=0.005)
    assert contact_ratio(paper_pair(), 350, 6) == pytest.approx(contact_ratio(paper_pair(), 350), abs=0.02)
    assert np.isnan(contact_ratio(paper_pair(), 350, [0.1, 0.5]))  # a gap of more than a third of a pitch


def test_contact_ratio_of_right_flanks_is_that_of_the_mirrored_pair():
    torque, phases = [50, 300], np.arange(15) / 15
    right = contact_ratio(HELICAL, [-300, -50], phases, offsets=TILTED)[::-1]
    mirrored_phases = np.sort((HELICAL.back_phase - phases) % 1)
    mirrored = contact_ratio(fem.mirror_image(HELICAL), torque, mirrored_phases, offsets=TILTED)
    assert right == pytest.approx(mirrored, rel=1e-6)
    assert np.abs(right - contact_ratio(HELICAL, torque, phases, offsets=TILTED)).max() > 0.01


def test_contact_ratio_without_load_is_the_nominal_one_at_each_centre_distance(paper_pair):
    apart = (paper_pair.a, paper_pair.a + 0.3 * mm)
    ste = ste_of(paper_pair, [0, 150], 12, offsets=fem.Offsets(a=apart))
    nominal = [replace(paper_pair, a=a).eps_gamma for a in apart]
    assert ste["contact_ratio"].dims == ("torque", "a")
    assert ste["contact_ratio"].sel(torque=0).values == pytest.approx(nominal, rel=1e-12)
    helical = fem.GearPair(few_teeth(beta=15 * deg), few_teeth(beta=-15 * deg))
    (unloaded,) = contact_ratio(helical, 0, 6)
    assert unloaded == pytest.approx(helical.eps_alpha + helical.eps_beta)
