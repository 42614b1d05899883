"""STE of the paper's pair against independent finite elements; symmetry, balance, limits; bad input is refused."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from conftest import paper_gear

import fem
from fem.compliance import flank_compliance
from fem.contact import assemble, state_at, transmission_error
from fem.gap import STRIPS, WINDOW, Deviation, flanks_at
from fem.hertz import flattening, half_width
from fem.mesh import Density
from fem.units import mm, um


def mean_and_peak_to_peak(ste, torque):
    te = ste["te"].sel(torque=torque).values
    return te.mean(), np.ptp(te)


@pytest.mark.parametrize(
    ("d_bore", "at_150", "at_350"),
    [(60 * mm, (7.617, 2.733), (16.98, 6.02)), (100 * mm, (6.395, 2.722), (14.132, 6.004))],
)
def test_reference_of_independent_finite_elements(d_bore, at_150, at_350):
    gear = paper_gear(d_bore=d_bore)
    ste = fem.static_transmission_error(fem.GearPair(gear, gear, a=150 * mm), [150, 350], 30, progress=False)
    for torque, (mean, peak_to_peak) in ((150, at_150), (350, at_350)):
        got = mean_and_peak_to_peak(ste, torque)
        assert got[0] == pytest.approx(mean * um, rel=0.005)
        assert got[1] == pytest.approx(peak_to_peak * um, rel=0.01)


@pytest.fixture(scope="module")
def unequal():
    data = {"m_n": 3 * mm, "d_bore": 30 * mm}
    pinion, wheel = fem.Gear(z=23, x=0.3, b=30 * mm, **data), fem.Gear(z=61, x=-0.1, b=25 * mm, **data)
    return fem.GearPair(pinion, wheel, a=fem.GearPair(pinion, wheel).a + 0.1 * mm)


@pytest.fixture(scope="module")
def bodies(paper_pair):
    body = flank_compliance(paper_pair.pinion, Density(), paper_pair.b)
    return body, body


def test_swapping_pinion_and_wheel_mirrors_the_phase(unequal):
    swapped = fem.GearPair(unequal.wheel, unequal.pinion, a=unequal.a)
    force = 1500.0
    one = fem.static_transmission_error(unequal, force * unequal.pinion.r_b, 12, progress=False)["te"].values[0]
    other = fem.static_transmission_error(swapped, force * unequal.wheel.r_b, 12, progress=False)["te"].values[0]
    assert one == pytest.approx(np.roll(other[::-1], 1), rel=2e-3)


def test_which_tooth_is_called_0_does_not_matter(paper_pair, bodies):
    one, other = (transmission_error(paper_pair, *bodies, phase, 2000.0) for phase in (0.3, 1.3))
    assert other == pytest.approx(one, rel=1e-9)


def test_identical_gears_give_a_symmetric_curve(paper_pair):
    te = fem.static_transmission_error(paper_pair, 150, 12, progress=False)["te"].values[0]
    assert te[1:] == pytest.approx(te[:0:-1], rel=2e-3)


def test_contact_balances_the_load_and_never_pulls_nor_penetrates(paper_pair, bodies):
    flanks = flanks_at(paper_pair, 0.45, Deviation(paper_pair, 0.0, bodies[0].slices))[:2]
    materials = paper_pair.pinion.material, paper_pair.wheel.material
    contact = assemble(flanks, *bodies, [WINDOW * half_width(90e3, one.radius, *materials) for one in flanks])
    delta, f = contact.solve(1000.0)
    slack = contact.matrix @ f + contact.gap - contact.approach * delta
    assert contact.approach @ f == pytest.approx(1000.0, rel=1e-12)
    assert f.min() >= 0
    assert slack.min() > -1e-12 * um
    assert np.abs(f * slack).max() < 1e-9 * um
    assert (f.reshape(2, -1, STRIPS).sum(axis=(1, 2)) > 0).all()
    assert np.linalg.eigvalsh(contact.matrix).min() > 0


def test_light_load_follows_line_contact(paper_pair, bodies):
    """One pair alone: compliance te/F falls by (c1 + c2) / (2 b) per unit of ln F (Hertz)."""
    force = np.array([0.01, 0.1, 1.0, 10.0])
    compliance = [transmission_error(paper_pair, *bodies, 0.0, f) / f for f in force]
    slope = -np.diff(compliance) / np.diff(np.log(force))
    assert slope == pytest.approx(flattening(paper_pair.pinion.material) / paper_pair.b, rel=0.02)


def test_peak_pressure_is_that_of_hertz(paper_pair, bodies):
    flanks = flanks_at(paper_pair, 0.0, Deviation(paper_pair, 0.0, bodies[0].slices))[:1]
    force, steel = 2000.0, paper_pair.pinion.material
    line_load = force / paper_pair.b
    a = half_width(line_load, flanks[0].radius, steel, steel)
    _, f = assemble(flanks, *bodies, [WINDOW * a]).solve(force / 2)
    width = flanks[0].strips(WINDOW * a)[3]
    pressure = f.reshape(-1, STRIPS)[0].max() / width / np.diff(bodies[0].slices)[0]
    share = f.reshape(-1, STRIPS)[0].sum() / np.diff(bodies[0].slices)[0] / line_load
    assert pressure == pytest.approx(2 * line_load / (np.pi * a) * np.sqrt(share), rel=0.01)


def test_more_torque_deflects_more_at_falling_rate(paper_pair):
    ste = fem.static_transmission_error(paper_pair, [0, 1, 20, 150, 350, 500], 6, progress=False)
    te, torque = ste["te"].values, ste["torque"].values
    assert np.abs(te[0]).max() < 1e-3 * um
    assert (np.diff(te, axis=0) > 0).all()
    assert (np.diff(te[1:] / torque[1:, None], axis=0) < 0).all()


def test_unloaded_error_beyond_the_path_of_contact_is_a_gap(paper_pair, bodies):
    separations = [
        flanks.separation for flanks in flanks_at(paper_pair, 0.0, Deviation(paper_pair, 0.0, bodies[0].slices))
    ]
    assert separations[0] == pytest.approx(0, abs=1e-15)
    assert separations[-1] > 1 * um


@pytest.mark.parametrize(("torque", "alone"), [(150, 0.313), (350, 0.200)])
def test_share_of_the_cycle_with_one_pair_alone(paper_pair, torque, alone):
    """Independent finite elements: nominally 0.544; loaded tip contact takes the rest."""
    ste = fem.static_transmission_error(paper_pair, torque, 240, progress=False)
    assert float((ste["pairs_in_contact"] == 1).mean()) == pytest.approx(alone, abs=0.01)
    assert ste["load_share"].sum("pair").values == pytest.approx(1)
    assert ste["load_share"].values.min() >= 0
    assert (ste["centroid"] == 0).all()


def test_misaligned_force_moves_to_the_closed_side(paper_pair):
    ste = fem.static_transmission_error(paper_pair, [50, 350], 4, misalignment=0.5e-3, progress=False)
    light, heavy = ste["centroid"].values
    assert (light < heavy).all()
    assert (heavy < 0).all()
    assert light.min() > -paper_pair.b / 2


def test_pressure_grows_with_the_root_of_the_load(paper_pair, bodies):
    light, heavy = (state_at(paper_pair, *bodies, 0.0, force).peak_pressure() for force in (500.0, 2000.0))
    assert heavy == pytest.approx(2 * light, rel=0.01)


def test_executor_gives_the_same_map(paper_pair):
    alone = fem.static_transmission_error(paper_pair, [0, 150], 6, progress=False)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        spread = fem.static_transmission_error(paper_pair, [0, 150], 6, executor=executor, progress=False)
    assert np.abs(spread["te"] - alone["te"]).max() < 1e-12 * um


def test_map_survives_the_disk(paper_pair, tmp_path):
    ste = fem.static_transmission_error(paper_pair, [0, 150], 6, progress=False)
    path = fem.save(ste, tmp_path / "pair.nc")
    again = fem.load(path)
    assert again.identical(ste)
    assert again["te"].attrs["units"] == "m"
    assert fem.ste.pair_of(again) == paper_pair
    assert [p.name for p in tmp_path.iterdir()] == ["pair.nc"]


@pytest.mark.parametrize(
    ("torque", "phases", "message"),
    [
        (-150, 30, "torque must increase from 0"),
        ([150, 100], 30, "sort it"),
        (150e3, 30, "pass newton metres"),
        (np.nan, 30, "torque must"),
        ([], 30, "torque must"),
        (150, 2, "phases must be a whole number"),
        (150, 7.5, "phases must be a whole number"),
        (150, [0.5, 0.2], "phases must increase"),
        (150, [0.5, 1.0], "phases must increase"),
    ],
)
def test_bad_input_is_refused(paper_pair, torque, phases, message):
    with pytest.raises(ValueError, match=message):
        fem.static_transmission_error(paper_pair, torque, phases, progress=False)


def test_helical_pairs_are_refused_for_now():
    pair = fem.GearPair(paper_gear(beta=0.1, d_a=156 * mm), paper_gear(beta=-0.1, d_a=156 * mm), a=151 * mm)
    with pytest.raises(ValueError, match="only spur"):
        fem.static_transmission_error(pair, 150)
