"""Torques < 0 load the right flanks: against the pair mirrored by hand, symmetric pairs, both sides in one map."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from helical_gears import helical
from paper_gears import few_teeth, paper_gear, paper_pair

import fem
from fem.units import deg, mm, um

RELIEF = fem.TipRelief(20 * um, 3 * mm)
SLICES = fem.Slices(COARSE.density, 8)
TORQUES, PHASES = [-350, -150, 0, 150, 350], 8
SPUR = fem.GearPair(paper_gear(flank=fem.Sides((), (RELIEF,))), paper_gear(), a=150 * mm)
HELICAL = fem.GearPair(helical(1, flank=(fem.HelixSlope(12 * um),)), helical(-1), a=150 * mm)
TILTED = fem.Offsets(misalignment=(-1e-4, 2e-4), f_sigma_beta=1e-4)


def by_hand(pair: fem.GearPair) -> fem.GearPair:
    """The pair in a mirror in the plane of its axes."""

    def mirrored(gear: fem.Gear) -> fem.Gear:
        return replace(gear, beta=-gear.beta, flank=fem.Sides(gear.coast_flank, gear.drive_flank))

    return fem.GearPair(mirrored(pair.pinion), mirrored(pair.wheel), a=pair.a)


def ste_of(pair, torque=TORQUES, phases=PHASES, **options):
    return fem.static_transmission_error(pair, torque, phases, resolution=SLICES, progress=False, **options)


@pytest.mark.parametrize(("pair", "offsets"), [(SPUR, None), (HELICAL, None), (HELICAL, TILTED)])
def test_right_flanks_are_the_left_ones_of_the_pair_mirrored_by_hand(pair, offsets):
    both = ste_of(pair, offsets=offsets)
    order = np.argsort(phase := (pair.back_phase - both["phase"].values) % 1.0)
    if offsets:
        offsets = replace(offsets, f_sigma_beta=-offsets.f_sigma_beta)
    mirror = ste_of(by_hand(pair), [0, 150, 350], phase[order], offsets=offsets)
    for torque in (150, 350):
        right, left = both.sel(torque=-torque).isel(phase=order), mirror.sel(torque=torque)
        assert -right["te"].values == pytest.approx(left["te"].values, rel=1e-9)
        for name in ("stiffness", "centroid", "line_load", "peak_pressure", "contact_ratio"):
            assert right[name].values == pytest.approx(left[name].values, rel=1e-9), name
        shares = [np.sort(side["load_share"].values)[:, -2:] for side in (right, left)]
        assert shares[0] == pytest.approx(shares[1], abs=1e-9)
    unloaded = both["te_unloaded_right"].isel(phase=order).values
    assert -unloaded == pytest.approx(mirror["te"].sel(torque=0).values, abs=1e-15)
    assert np.abs(both["te"].sel(torque=-350) + both["te"].sel(torque=350)).max() > 0.5 * um


@pytest.mark.parametrize("offsets", [None, fem.Offsets(misalignment=(-1e-4, 0, 1e-4), axial=(-mm, 0, mm))])
def test_states_of_a_symmetric_pair_are_solved_once_where_its_phases_coincide(offsets):
    """Without backlash and profile shift left flanks touch half a pitch after right ones: at another phase of eight."""
    gears = (
        few_teeth(x=0, z=27, b=10 * mm, beta=hand * 20 * deg, flank=(fem.LeadCrowning(5 * um),)) for hand in (1, -1)
    )
    pair = fem.GearPair(*gears)
    cost, of_left = (fem.map_cost(pair, torque, PHASES, offsets=offsets) for torque in ([-50, 0, 50], [0, 50]))
    assert cost.states == of_left.states
    both = ste_of(pair, [-50, 0, 50], offsets=offsets)
    assert both.attrs["right_flanks"] == "mirror image of the left flanks"
    mirror = ste_of(by_hand(pair), [0, 50], offsets=offsets).sel(torque=50)
    right = both.sel(torque=-50).roll(phase=-4).isel(phase=slice(None, None, -1)).roll(phase=1)
    for name, sign in (("te", -1), ("stiffness", 1), ("centroid", 1)):
        assert sign * right[name].values == pytest.approx(mirror[name].values, rel=1e-9, abs=1e-12), name


def test_both_sides_are_saved_and_have_harmonics(tmp_path):
    both = ste_of(SPUR)
    assert fem.load(fem.save(both, tmp_path / "both.nc")).identical(both)
    right, left = fem.te_harmonics(both, 3)["amplitude"].sel(torque=[-350, 350]).values.T[-1]
    assert right > 1.5 * left > 0


@pytest.mark.slow
def test_errors_are_estimated_on_both_sides():
    both = fem.static_transmission_error(SPUR, [-350, 0, 350], 12, accuracy=0.05, progress=False)
    for name in ("error_mesh", "error_phase", "error_p2p"):
        assert (both[name].sel(torque=[-350, 350]) > 0).all()
        assert len(set(both[name].values)) == 3, name


def test_other_results_refuse_torques_below_0_in_words():
    for call in (fem.load_distribution, fem.root_stress, fem.load_factors):
        with pytest.raises(ValueError, match=r"fem\.mirror_image\(pair\)"):
            call(paper_pair(), -150, 8, progress=False)
