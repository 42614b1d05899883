"""Load factors: the line of springs in closed form, equilibrium, misalignment, crowning and relief."""

from dataclasses import replace

import numpy as np
import pytest
from helical_gears import helical
from loaded_gears import ROUGH
from paper_gears import paper_pair
from scipy.optimize import brentq

import fem
from fem.stress.load_factors import face_load_factor
from fem.units import mm, um

TORQUE = 150.0


def factors(pair: fem.GearPair, torque=TORQUE, phases=6, **options):
    return fem.load_factors(pair, torque, phases, progress=False, **{"resolution": ROUGH} | options)


def misaligned(gap: float):
    """The paper's pair with a gap that opens by gap over the face width."""
    pair = paper_pair()
    return factors(pair, offsets=fem.Offsets(misalignment=gap / pair.b), resolution=replace(ROUGH, slices=12))


def crowned(pair: fem.GearPair, *flank) -> fem.GearPair:
    return fem.GearPair(replace(pair.pinion, flank=flank), pair.wheel, a=pair.a)


@pytest.mark.parametrize(("gap", "published"), [(5 * um, 1.534), (10 * um, 2.067)])
def test_misaligned_line_of_springs_has_the_factor_of_the_closed_form(gap, published, measured):
    """20 N/(mm um) over 23 mm at 150 N m; at 10 um the face carries on a part of its width only."""
    pair, c = paper_pair(), 20e9
    axial = (np.arange(20000) + 0.5) / 20000 - 0.5
    line_load = lambda deflection: c * np.maximum(deflection - gap * axial, 0.0)  # noqa: E731
    load = TORQUE / pair.pinion.r_b / pair.b
    deflection = brentq(lambda x: line_load(x).mean() - load, 0.0, 1e-3, xtol=1e-15)
    factor = face_load_factor(line_load(deflection))
    measured("K_Hβ of a misaligned line of springs, 5 and 10 µm", abs(factor - published), 5e-4)


def test_line_load_balances_the_mesh_force():
    for pair in (paper_pair(), fem.GearPair(helical(1), helical(-1), a=150 * mm)):
        data = factors(pair, [50.0, TORQUE])
        expected = np.array([50.0, TORQUE]) / pair.pinion.r_b / pair.b
        assert data["line_load"].mean("axial_position").values == pytest.approx(expected, rel=1e-9)


def test_accurate_spur_gears_have_an_even_load():
    data = factors(paper_pair())
    assert data["K_H_alpha"].values == pytest.approx(1, abs=1e-12)
    assert data["largest_share"].values == pytest.approx(1)
    assert 1 <= float(data["K_H_beta"][0]) <= float(data["K_H_beta_max"][0]) < 1.05
    assert fem.pair_of(data) == paper_pair()


def test_misalignment_loads_the_end_where_the_gap_is_closed():
    aligned, small, large, opposite = (misaligned(gap * um) for gap in (0, 4, 8, -8))
    rise = [float(data["K_H_beta"][0] - aligned["K_H_beta"][0]) for data in (small, large)]
    assert 0.3 < rise[0] < rise[1]
    assert rise[1] == pytest.approx(2 * rise[0], rel=0.1)
    line_load = large["line_load"].values[0]
    assert line_load[0] == line_load.max()
    assert opposite["line_load"].values[0] == pytest.approx(line_load[::-1], rel=1e-3)


def test_force_centroid_of_the_line_load_is_that_of_the_map():
    pair, offsets = paper_pair(), fem.Offsets(misalignment=8 * um / (23 * mm))
    options = {"offsets": offsets, "resolution": replace(ROUGH, slices=12), "progress": False}
    line_load = fem.load_factors(pair, TORQUE, 6, **options)["line_load"][0]
    centroid = float((line_load * line_load["axial_position"]).sum() / line_load.sum())
    ste = fem.static_transmission_error(pair, [TORQUE], 6, **options)
    assert centroid == pytest.approx(float(ste["centroid"].mean()), abs=0.05 * mm)


def test_crowning_raises_the_face_load_factor_and_load_lowers_it():
    even = fem.GearPair(helical(1), helical(-1), a=150 * mm)
    options = {"torque": [50.0, TORQUE], "phases": 16, "resolution": replace(ROUGH, slices=20)}
    plain, curved = (factors(pair, **options) for pair in (even, crowned(even, fem.LeadCrowning(10 * um))))
    assert (curved["K_H_beta"] > plain["K_H_beta"] + 0.2).all()
    assert curved["K_H_beta"][0] > curved["K_H_beta"][1] + 0.2
    assert plain["K_H_beta"].values == pytest.approx(1, abs=0.1)
    assert (plain["K_H_beta_max"] > plain["K_H_beta"] + 0.1).all()  # inclined lines of contact


def test_tip_relief_of_helical_gears_raises_the_transverse_load_factor():
    even = fem.GearPair(helical(1), helical(-1), a=150 * mm)
    relieved = factors(crowned(even, fem.TipRelief(20 * um, 3 * mm)))
    assert factors(even)["K_H_alpha"].values == pytest.approx(1, abs=1e-12)
    assert float(relieved["K_H_alpha"][0]) > 1.1
    ratio = relieved["largest_share"] / factors(even)["largest_share"]
    assert relieved["K_H_alpha"].values == pytest.approx(ratio.values, rel=1e-9)


def test_load_factors_without_load_are_refused():
    with pytest.raises(ValueError, match="torque must be > 0"):
        factors(paper_pair(), [0.0, TORQUE])
