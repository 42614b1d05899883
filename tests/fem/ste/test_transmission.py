"""STE of the paper's pair against independent finite elements; symmetry, balance, limits."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest
from coarse_maps import COARSE, ROUGH
from compliance_products import elastic_body
from contacts import contact_of, position_of, strips_in_contact
from helical_gears import helical
from line_contact import modulus
from paper_gears import paper_gear

import fem
from fem import Density
from fem.contact.strip_bounds import strips_of
from fem.units import mm, um


def mean_and_peak_to_peak(ste, torque):
    te = ste["te"].sel(torque=torque).values
    return te.mean(), np.ptp(te)


@pytest.mark.parametrize(
    ("d_bore", "at_150", "at_350"),
    [(60 * mm, (7.617, 2.733), (16.98, 6.02)), (100 * mm, (6.395, 2.722), (14.132, 6.004))],
)
def test_reference_of_independent_finite_elements(d_bore, at_150, at_350, measured):
    gear = paper_gear(d_bore=d_bore)
    ste = fem.static_transmission_error(fem.GearPair(gear, gear, a=150 * mm), [150, 350], 30, progress=False)
    for torque, (mean, peak_to_peak) in ((150, at_150), (350, at_350)):
        got = mean_and_peak_to_peak(ste, torque)
        numbers = f"{got[0] / um:.3f} / {got[1] / um:.3f}"
        measured.cells(f"paper's pair, bore {d_bore / mm:.0f} mm, {torque} N m", numbers)
        assert got[0] == pytest.approx(mean * um, rel=0.005)
        assert got[1] == pytest.approx(peak_to_peak * um, rel=0.01)


@pytest.fixture(scope="module")
def unequal():
    data = {"m_n": 3 * mm, "d_bore": 30 * mm}
    pinion, wheel = fem.Gear(z=23, x=0.3, b=30 * mm, **data), fem.Gear(z=61, x=-0.1, b=25 * mm, **data)
    return fem.GearPair(pinion, wheel, a=fem.GearPair(pinion, wheel).a + 0.1 * mm)


@pytest.fixture(scope="module")
def bodies(paper_pair):
    body = elastic_body(paper_pair.pinion, Density())
    return body, body


def test_swapping_pinion_and_wheel_mirrors_the_phase(unequal):
    swapped = fem.GearPair(unequal.wheel, unequal.pinion, a=unequal.a)
    force = 1500.0
    te = fem.static_transmission_error(unequal, force * unequal.pinion.r_b, 12, progress=False)["te"].values[0]
    mirrored = fem.static_transmission_error(swapped, force * unequal.wheel.r_b, 12, progress=False)["te"].values[0]
    assert te == pytest.approx(np.roll(mirrored[::-1], 1), rel=2e-3)


def slices_of(contact, numbers):
    """Slices over the whole face of some tooth pairs."""
    slicing = contact.slicing
    return slicing.over(np.array([slicing.ends if k in numbers else (np.nan, np.nan) for k in slicing.numbers]))


def test_te_does_not_depend_on_which_tooth_is_number_0(paper_pair, bodies):
    te, renumbered = (contact_of(paper_pair, bodies, phase, 3).state(2000.0).te for phase in (0.3, 1.3))
    assert renumbered == pytest.approx(te, rel=1e-9)


def test_identical_gears_give_a_symmetric_curve(paper_pair):
    te = fem.static_transmission_error(paper_pair, 150, 12, progress=False)["te"].values[0]
    assert te[1:] == pytest.approx(te[:0:-1], rel=2e-3)


def test_contact_balances_the_load_and_never_pulls_nor_penetrates(paper_pair, bodies):
    contact = contact_of(paper_pair, bodies, 0.45, 3)
    slices = slices_of(contact, (-1, 0))
    half_width = slices.half_width(np.full(slices.low.size, 90e3))
    strips = strips_of(slices, half_width)
    strip_contact = strips_in_contact(contact, slices, strips)
    delta, _, f = strip_contact.solve(1000.0, strips.expected > 0)
    slack = strip_contact.displacement(f) + strip_contact.gap - strip_contact.approach * delta
    assert (strip_contact.approach * f).sum() == pytest.approx(1000.0, rel=1e-12)
    assert f.min() >= 0
    assert slack.min() > -2e-14
    assert np.abs(f * slack).max() < 1e-9 * um
    assert (f.reshape(2, -1, f.shape[-1]).sum(axis=(1, 2)) > 0).all()
    compliance = [strip_contact.displacement(unit.reshape(f.shape)).ravel() for unit in np.eye(f.size)]
    assert compliance == pytest.approx(np.transpose(compliance), rel=1e-9)
    assert np.linalg.eigvalsh(compliance).min() > 0


def test_light_load_follows_line_contact(paper_pair, bodies):
    """One pair alone: compliance te/F falls by 2 (1 - nu^2) / (pi E b) per unit of ln F (Hertz)."""
    force = np.array([0.01, 0.1, 1.0, 10.0])
    compliance = [contact_of(paper_pair, bodies, 0.0, 3).state(f).te / f for f in force]
    slope = -np.diff(compliance) / np.diff(np.log(force))
    assert slope == pytest.approx(1 / (np.pi * modulus() * paper_pair.b), rel=0.02)


def test_peak_pressure_is_that_of_hertz(paper_pair, bodies):
    contact = contact_of(paper_pair, bodies, 0.0, 3)
    state = contact.state(2000.0)
    line_load = state.force / state.slices.length
    hertz = 2 * line_load / (np.pi * state.slices.half_width(line_load))
    assert state.pressure == pytest.approx(hertz, rel=0.01)
    assert state.quantities.hertz_pressure[0] == pytest.approx(hertz.max(), rel=1e-12)


def test_line_loads_flattened_by_hertz_agree_with_strips_away_from_the_tips(paper_pair, bodies):
    contact = contact_of(paper_pair, bodies, 0.0, 3)
    resolved, sliced = contact.state(2000.0), contact.slice_states(np.array([2000.0]), np.zeros(1))[0]
    assert sliced.te == pytest.approx(resolved.te, rel=2e-3)
    assert sliced.pressure[sliced.force > 0] == pytest.approx(resolved.pressure, rel=0.01)


def test_more_torque_deflects_more_at_falling_rate(paper_pair):
    ste = fem.static_transmission_error(paper_pair, [0, 1, 20, 150, 350, 500], 6, progress=False)
    te, torque = ste["te"].values, ste["torque"].values
    assert np.abs(te[0]).max() < 1e-3 * um
    assert (np.diff(te, axis=0) > 0).all()
    assert (np.diff(te[1:] / torque[1:, None], axis=0) < 0).all()


def test_unloaded_error_beyond_the_path_of_contact_is_a_gap(paper_pair, bodies):
    separation = np.sort(contact_of(paper_pair, bodies, 0.0, 3).slicing.stations.first_touch(0.0))
    assert separation[0] == pytest.approx(0, abs=1e-15)
    assert separation[-1] > 1 * um


@pytest.mark.parametrize(("torque", "alone"), [(150, 0.313), (350, 0.200)])
def test_share_of_the_cycle_with_one_pair_alone(paper_pair, torque, alone, measured):
    """Independent finite elements: nominally 0.544; loaded tip contact takes the rest."""
    ste = fem.static_transmission_error(paper_pair, torque, 240, progress=False)
    share = float((ste["pairs_in_contact"] == 1).mean())
    measured("share of the cycle with a single pair, 150 and 350 N m", abs(share - alone), 0.01)
    assert ste["load_share"].sum("pair").values == pytest.approx(1)
    assert ste["load_share"].values.min() >= 0
    assert (ste["centroid"] == 0).all()


def test_misaligned_force_moves_to_the_closed_side(paper_pair):
    ste = fem.static_transmission_error(
        paper_pair, [50, 350], 4, offsets=fem.Offsets(misalignment=0.5e-3), progress=False
    )
    light, heavy = ste["centroid"].values
    assert (light < heavy).all()
    assert (heavy < 0).all()
    assert light.min() > -paper_pair.b / 2


def test_pressure_grows_with_the_root_of_the_load(paper_pair, bodies):
    light, heavy = (
        contact_of(paper_pair, bodies, 0.0, 3).state(f).quantities.peak_pressure[0] for f in (500.0, 2000.0)
    )
    assert heavy == pytest.approx(2 * light, rel=0.01)


def test_executor_gives_the_same_map(paper_pair):
    alone = fem.static_transmission_error(paper_pair, [0, 150], 6, progress=False)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        spread = fem.static_transmission_error(paper_pair, [0, 150], 6, executor=executor, progress=False)
    rounding = np.finfo(float).eps * paper_pair.a
    assert np.abs(spread["te"] - alone["te"]).max() < rounding


def test_map_is_read_back_from_the_file(paper_pair, tmp_path):
    ste = fem.static_transmission_error(paper_pair, [0, 150], 6, progress=False)
    path = fem.save(ste, tmp_path / "pair.nc")
    again = fem.load(path)
    assert again.identical(ste)
    assert again["te"].attrs["units"] == "m"
    assert fem.pair_of(again) == paper_pair
    assert [p.name for p in tmp_path.iterdir()] == ["pair.nc"]


@pytest.fixture(scope="module")
def helical_pair():
    return fem.GearPair(helical(1), helical(-1), a=150 * mm)


def test_helical_reference_by_its_own_model(helical_pair, measured):
    """Independent finite elements, which couple adjacent teeth only."""
    next_teeth_only = fem.Resolution(Density(flank=24, width=4), neighbours=1)
    ste = fem.static_transmission_error(helical_pair, [150, 350], 30, resolution=next_teeth_only, progress=False)
    stated = [mean_and_peak_to_peak(ste, torque) for torque in (150, 350)]
    row = "adjacent teeth only, finer: `Resolution(Density(flank=24, width=4), neighbours=1)`"
    measured.cells(row, *(f"{mean / um:.3f} / {swing / um:.3f}" for mean, swing in stated))
    for torque, mean, off, peak_to_peak in ((150, 8.59 * um, 0.006, 0.671 * um), (350, 19.34 * um, 0.003, 1.17 * um)):
        expected = pytest.approx(mean, rel=off), pytest.approx(peak_to_peak, rel=0.01)
        assert mean_and_peak_to_peak(ste, torque) == expected


def test_helical_mean_with_all_teeth_coupled(helical_pair, measured):
    """The mean is that of the reference; the peak to peak is larger, 0.72 and 1.35 um, as in `test_helical_twin`."""
    ste = fem.static_transmission_error(helical_pair, [150, 350], 30, progress=False)
    stated = [mean_and_peak_to_peak(ste, torque) for torque in (150, 350)]
    measured.cells("all teeth coupled", *(f"{mean / um:.3f} / {swing / um:.3f}" for mean, swing in stated))
    assert mean_and_peak_to_peak(ste, 150)[0] == pytest.approx(8.59 * um, rel=0.003)
    assert mean_and_peak_to_peak(ste, 350)[0] == pytest.approx(19.34 * um, rel=0.006)


def test_coupling_of_adjacent_teeth_adds_to_the_deflection(helical_pair):
    """Adjacent teeth contribute a tenth of the deflection, those two pitches apart a few thousandths."""
    uncoupled, adjacent, two_apart, coupled = (
        fem.static_transmission_error(helical_pair, 150, 5, resolution=resolution, progress=False)["te"]
        for resolution in (replace(COARSE, neighbours=pitches) for pitches in (0, 1, 2, None))
    )
    assert float((adjacent - uncoupled).mean()) > 0.05 * float(coupled.mean())
    assert 0.001 < float((two_apart - adjacent).mean() / coupled.mean()) < 0.01
    assert coupled.values == pytest.approx(two_apart.values, rel=1e-12)


def test_mirrored_hands_mirror_the_centroid(helical_pair):
    mirrored = fem.GearPair(helical_pair.wheel, helical_pair.pinion, a=150 * mm)
    right, left = (fem.static_transmission_error(p, 150, 8, progress=False) for p in (helical_pair, mirrored))
    assert left["te"].values == pytest.approx(right["te"].values, rel=1e-6)
    assert left["centroid"].values == pytest.approx(-right["centroid"].values, abs=1e-6 * mm)
    assert np.ptp(right["centroid"].values) > 0.5 * mm


def test_force_of_a_helical_pair_shuttles_with_the_lines_of_contact(helical_pair):
    """Under light load every line of contact carries nearly the same everywhere."""
    for phase in (0.1, 0.4):
        lines = position_of(helical_pair, phase).lines()
        lengths = {k: high - low for k, (low, high) in lines.items()}
        centroid = sum(lengths[k] * sum(lines[k]) / 2 for k in lines) / sum(lengths.values())
        ste = fem.static_transmission_error(helical_pair, 20, [phase], progress=False)
        assert float(ste["centroid"][0, 0]) == pytest.approx(centroid, abs=2 * mm)


def test_offsets_become_axes_of_the_map_only_when_asked(paper_pair):
    rough = fem.Slices(Density(flank=6, fillet=1, tooth=2, rim=1, body=2, width=1), 6)
    offsets = fem.Offsets(a=(150 * mm, 150.2 * mm), misalignment=(-4e-4, 0, 4e-4), axial=1 * mm)
    ste = fem.static_transmission_error(paper_pair, [0, 150], 4, offsets=offsets, resolution=rough, progress=False)
    assert ste["te"].dims == ("torque", "a", "misalignment", "phase")
    assert ste.attrs["axial"] == 1 * mm
    plain = fem.static_transmission_error(paper_pair, [0, 150], 4, resolution=rough, progress=False)
    assert plain["te"].dims == ("torque", "phase")
    assert (ste["te"].sel(torque=150, a=150.2 * mm) > ste["te"].sel(torque=150, a=150 * mm)).all()


def test_parallelism_errors_act_in_the_plane_of_action(paper_pair):
    rough = fem.Slices(Density(flank=6, fillet=1, tooth=2, rim=1, body=2, width=1), 6)
    parallelism = fem.Offsets(f_sigma_delta=(0, 3e-4), f_sigma_beta=(0, 2e-4))
    ste = fem.static_transmission_error(paper_pair, 150, 4, offsets=parallelism, resolution=rough, progress=False)
    angle = 3e-4 * np.sin(paper_pair.alpha_wt) + 2e-4 * np.cos(paper_pair.alpha_wt)
    misaligned = fem.Offsets(misalignment=angle)
    equal = fem.static_transmission_error(paper_pair, 150, 4, offsets=misaligned, resolution=rough, progress=False)
    assert ste["te"].values[0, 1, 1] == pytest.approx(equal["te"].values[0], rel=1e-9)


def test_only_the_driving_flanks_count():
    relief = fem.TipRelief(15 * um, 2.5 * mm)
    gears = paper_gear(), paper_gear(flank=fem.Sides(right=relief)), paper_gear(flank=fem.Sides(left=relief))
    pairs = [fem.GearPair(gear, gear, a=150 * mm) for gear in gears]
    maps = [
        fem.static_transmission_error(pair, 150, 4, resolution=COARSE, progress=False)["te"].values for pair in pairs
    ]
    assert (maps[1] == maps[0]).all()
    assert (maps[2] != maps[0]).any()


def test_a_contact_that_is_not_solved_says_where(monkeypatch):
    monkeypatch.setattr("fem.contact.tooth_contact.WIDENINGS", 0)
    pair = fem.GearPair(paper_gear(), paper_gear(), a=150 * mm)
    offsets = fem.Offsets(misalignment=(0.0, 1e-4))
    at = r"\(at phase 0.25, 150 N m, a = 150 mm, misalignment 0 rad\)"
    with pytest.raises(RuntimeError, match=rf"wider than by Hertz; reduce the load .* {at}"):
        fem.static_transmission_error(pair, [0, 150], [0.25], offsets=offsets, resolution=COARSE, progress=False)


@pytest.mark.parametrize("mode", [fem.Slices.like(ROUGH), ROUGH])
def test_the_deflection_grows_from_the_least_torque_on(mode):
    """Where flanks first touch in a point; far below it, contacts do not converge."""
    flank = (fem.TipRelief(20 * um, 2 * mm), fem.LeadCrowning(10 * um))
    pinion, wheel = (fem.Gear(z=27, m_n=2 * mm, b=20 * mm, beta=s * 0.26, d_bore=20 * mm, flank=flank) for s in (1, -1))
    pair = fem.GearPair(pinion, wheel)
    least = 1e-13 * fem.STEEL.E * pair.b * pair.pinion.r_b
    torque = [0, *(least * 4.0 ** np.arange(5))]
    ste = fem.static_transmission_error(
        pair, torque, 8, offsets=fem.Offsets(misalignment=2e-4), resolution=mode, progress=False
    )
    assert (np.diff(ste["te"].values, axis=0) > 0).all()
    assert (ste["stiffness"].values[1:] > 0).all()
