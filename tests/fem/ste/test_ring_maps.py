"""Maps of pinions in rings: balance, symmetry, limits, slices, both sides, what maps hold and what stresses follow."""

from dataclasses import replace

import numpy as np
import pytest
from ring_gears import COARSE, few_teeth, helical_ring_pair, planet, ring, ring_pair, wind_turbine_stage

import fem
from fem.units import mm, um

PHASES = 8
SLICES = fem.Slices(COARSE.density, 8)


def ste_of(pair, torque=(0, 20, 100), phases=PHASES, *, resolution=COARSE, **options):
    return fem.static_transmission_error(pair, torque, phases, resolution=resolution, progress=False, **options)


@pytest.fixture(scope="module")
def spur():
    return ste_of(ring_pair())


@pytest.mark.parametrize("pair", [ring_pair(), helical_ring_pair()])
def test_te_rises_with_the_load_and_shares_sum_to_1(pair):
    ste = ste_of(pair)
    assert (np.diff(ste["te"].values, axis=0) > 0).all()
    assert ste["te"].values[0] == pytest.approx(0, abs=1e-4 * um)
    assert ste["load_share"].sum("pair").values[1:] == pytest.approx(1)
    assert (ste["contact_ratio"].values[1:] >= ste["contact_ratio"].values[0]).all()


def test_stiffness_is_the_derivative_of_the_force(spur):
    """Exact by slices; strips move with the load, which their tangent leaves out."""
    pair = ring_pair()
    torque = np.array([99.0, 100.0, 101.0])
    strips, slices = (ste_of(pair, torque, resolution=resolution) for resolution in (COARSE, SLICES))
    errors = [
        ste["stiffness"].values[1] * (ste["te"].values[2] - ste["te"].values[0]) * pair.pinion.r_b / 2 - 1
        for ste in (strips, slices)
    ]
    assert np.sqrt((errors[0] ** 2).mean()) < 3e-3 and np.abs(errors[0]).max() < 5e-3
    assert np.abs(errors[1]).max() < 5e-5
    assert strips["te"].values[1] == pytest.approx(spur["te"].values[-1], rel=1e-9)


def test_a_pair_of_twice_the_size_deflects_as_much_under_four_times_the_force_per_length(spur):
    """By dimensions: te is a force over E times a length."""
    pair = ring_pair()
    twice = [
        replace(gear, **{name: 2 * getattr(gear, name) for name in names})
        for gear, names in (
            (pair.pinion, ("m_n", "b", "d_bore", "s_n", "d_a", "d_f", "rho_f")),
            (pair.wheel, ("m_n", "b", "d_rim", "s_n", "d_a", "d_f", "fillet")),
        )
    ]
    scaled = ste_of(fem.GearPair(*twice), np.array([0, 20, 100]) * 8)
    assert scaled["te"].values == pytest.approx(2 * spur["te"].values, rel=1e-6, abs=1e-12)


def test_right_flanks_are_those_of_the_mirror_image():
    for pair in (ring_pair(), helical_ring_pair()):
        relieved = replace(pair.wheel, flank=fem.Sides((), (fem.TipRelief(8 * um, 1 * mm),)))
        pair = fem.GearPair(pair.pinion, relieved, a=pair.a + 0.02 * mm)
        both = ste_of(pair, [-100, 0, 100])
        phase = (pair.back_phase - both["phase"].values) % 1.0
        order = np.argsort(phase)
        mirror = ste_of(fem.mirror_image(pair), [100], phase[order])["te"].values[0]
        assert -both["te"].values[0][order] == pytest.approx(mirror, rel=1e-6)
        assert np.abs(mirror - both["te"].values[2]).max() > 1 * um


def test_a_ring_of_very_many_teeth_and_an_external_wheel_of_very_many_meet_in_the_rack():
    """Clamped at the same depth below their roots."""
    z = 9000
    internal = fem.GearPair(planet(), ring(-z, height=0.9, rim=4))
    sizes = {"d_a": (z + 2.2) * 2 * mm, "d_bore": (z - 2.1 - 8) * 2 * mm, "fillet": 0.6 * mm}
    external = fem.Gear(z=z, m_n=2 * mm, x=0.2, b=20 * mm, **sizes)
    te = [ste_of(pair, [100])["te"].values[0] for pair in (internal, fem.GearPair(planet(), external))]
    assert te[0] == pytest.approx(te[1], rel=0.02)
    assert np.ptp(te[0]) > 0.1 * te[0].mean()


def test_offsets_and_misalignment_open_the_gap_as_for_external_pairs():
    """A misalignment > 0 opens the gap towards +z, so that the load moves to -z; a is accepted with either sign."""
    for pair in (ring_pair(), helical_ring_pair()):
        a = abs(pair.a) - 0.05 * mm
        offsets = fem.Offsets(a=(a - 0.02 * mm, a), misalignment=(-2e-4, 2e-4))
        ste = ste_of(pair, [50], 4, offsets=offsets)
        assert ste["a"].values == pytest.approx([-a, -a + 0.02 * mm])
        centroid = ste["centroid"].mean("phase").values[0]
        assert (centroid[:, 0] > 1 * mm).all() and (centroid[:, 1] < -1 * mm).all()
    error = np.sin(pair.alpha_wt) * 2e-4
    tilted, aligned = (
        ste_of(pair, [50], 4, offsets=o)["te"].values
        for o in (fem.Offsets(f_sigma_delta=2e-4), fem.Offsets(misalignment=error))
    )
    assert tilted == pytest.approx(aligned, rel=1e-3)


@pytest.mark.parametrize("pair", [ring_pair(), helical_ring_pair()])
def test_slices_agree_with_strips(pair):
    """Also where the tip corner of a gear ends the contact; peak to peak as the number of slices allows."""
    strips, slices = (ste_of(pair, [50, 200], 16, resolution=model)["te"].values for model in (COARSE, SLICES))
    assert slices.mean(axis=1) == pytest.approx(strips.mean(axis=1), rel=2e-3)
    assert (np.abs(slices - strips).max(axis=1) < 3e-3 * strips.mean(axis=1)).all()
    assert np.ptp(slices, axis=1) == pytest.approx(np.ptp(strips, axis=1), rel=0.015)


def test_slices_at_tip_corners_of_a_third_tooth_pair_agree_with_strips():
    """Within 0.15 % of the mean: the corner yields more than a half-plane, by a logarithm."""
    pair, phases = fem.GearPair(planet(39, 0.1), ring(-99, 0.1, height=0.9, rim=2.25)), [1 / 48, 1 / 16, 1 / 6, 5 / 16]
    strips, slices = (
        ste_of(pair, [200], phases, resolution=model)["te"].values[0] for model in (fem.Resolution(), fem.Slices())
    )
    assert (np.abs(slices - strips) < 1.5e-3 * strips.mean()).all()


def test_slices_converge_on_a_misaligned_crowned_ring_pair():
    """Full Newton steps diverge there, as few slices carry the load at first."""
    pinion = planet(36, 0.43, flank=(fem.LeadCrowning(10 * um),))
    pair, tilt = fem.GearPair(pinion, ring(-84, 0.33, height=0.73)), fem.Offsets(misalignment=2e-4)
    slices, strips = (
        ste_of(pair, [86], [1 / 3], resolution=model, offsets=tilt)["te"].item()
        for model in (fem.Slices(), fem.Resolution())
    )
    assert slices == pytest.approx(strips, rel=5e-3)


def test_modifications_and_pitch_deviations_of_a_ring_open_its_gap():
    """A relief moves te by its amount where its flank touches alone; a tooth set back leaves its load to the next."""
    crowned = replace(ring(), flank=(fem.LeadCrowning(10 * um), fem.ProfileCrowning(4 * um)))
    softer = ste_of(fem.GearPair(planet(), crowned), [0, 50])["te"].values
    plain = ste_of(ring_pair(), [0, 50])["te"].values
    assert (softer[1] > plain[1] + 0.5 * um).all()
    assert softer[0].max() < 4 * um + 1e-9
    pitch = replace(ring(), flank=fem.PitchDeviation((5 * um, *[0.0] * 70)))
    te = ste_of(fem.GearPair(planet(), pitch), [0], np.arange(288) / 4)["te"].values[0]
    assert (te >= -1e-9 * um).all() and 1 * um < te.max() <= 5 * um


def test_a_map_holds_its_ring(tmp_path):
    pair = wind_turbine_stage(flank=(fem.TipRelief(30 * um, 10 * mm),))
    ste = ste_of(pair, [0, 2e5], 4)
    assert fem.pair_of(fem.load(fem.save(ste, tmp_path / "ring.nc"))) == pair


def test_accuracy_and_cost_are_those_of_external_pairs():
    pair = ring_pair()
    ste = fem.static_transmission_error(pair, fem.UpTo(100), None, accuracy=0.05, progress=False)
    truth = fem.static_transmission_error(pair, 100, ste["phase"].size, progress=False)["te"].values[0]
    assert np.sqrt(((ste["te"].values[-1] - truth) ** 2).mean()) < 0.05 * truth.mean()
    assert fem.map_cost(pair, [0, 100]).states == 60


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pair", "torque"),
    [
        (ring_pair(), (10, 50, 150)),
        (fem.GearPair(planet(39, 0.1), ring(-99, 0.1, height=0.9, rim=2.25)), (10, 60, 200)),
        (few_teeth(), (25, 80, 250)),
        (wind_turbine_stage(), (1e5, 2e5, 4e5)),
    ],
    ids=["rim of 5 modules", "thin rim", "few teeth", "NREL"],
)
def test_slices_of_spur_rings_are_near_strips(pair, torque):
    """Mean within 0.1 %, any phase 0.25 % and peak to peak the larger of 0.15 % of the mean and 0.5 % of it."""
    strips, slices = (
        fem.static_transmission_error(pair, torque, 24, resolution=model, progress=False)["te"].values
        for model in (fem.Resolution(), fem.Slices())
    )
    mean, swing = strips.mean(axis=1), np.ptp(strips, axis=1)
    assert slices.mean(axis=1) == pytest.approx(mean, rel=1e-3)
    assert (np.abs(slices - strips).max(axis=1) < 2.5e-3 * mean).all()
    assert (np.abs(np.ptp(slices, axis=1) - swing) < np.maximum(5e-3 * swing, 1.5e-3 * mean)).all()
