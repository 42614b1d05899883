"""Maps of gears that are wide for their diameter, or beside a mate of another width."""

from dataclasses import replace

import numpy as np
import pytest
from paper_gears import few_teeth
from raw_twin import line_from_mid_plane

import fem
from fem import Density
from fem.units import deg, mm, um

ROUGH = Density(flank=6, fillet=1, tooth=2, rim=1, body=1, width=1)


def wide_pair(z: int, beta: float, b: float, **changes) -> fem.GearPair:
    """Two equal gears of opposite hands."""
    sizes = {"z": z, "m_n": 2 * mm, "b": b, "d_bore": 0.6 * z * mm} | changes
    return fem.GearPair(fem.Gear(beta=beta, **sizes), fem.Gear(beta=-beta, **sizes))


@pytest.mark.parametrize(
    "pair",
    [wide_pair(20, 30 * deg, 120 * mm), wide_pair(6, 40 * deg, 60 * mm, x=0.5, d_bore=4 * mm)],
    ids=["overlap of 9.5", "overlap beyond the number of teeth"],
)
@pytest.mark.parametrize("resolution", [fem.Resolution(ROUGH, 20), fem.Slices(ROUGH, 20)], ids=repr)
def test_slices_that_have_turned_away_do_not_touch(pair, resolution):
    """The helix turns slices at the ends of the face by more than a quarter of a turn from the contact."""
    assert pair.b * np.tan(pair.pinion.beta) / pair.pinion.r_b > np.pi / 2
    te = fem.static_transmission_error(pair, [0, 5, 10], 4, resolution=resolution, progress=False)["te"].values
    assert te[0] == pytest.approx(0, abs=1e-9 * um)
    assert (0.02 * um < te[1]).all() and (te[1] < te[2]).all() and (te[2] < 20 * um).all()


def test_a_rounded_helix_angle_of_one_gear_changes_nothing():
    spur = fem.GearPair(few_teeth(), few_teeth())
    options = {"resolution": fem.Slices(ROUGH), "progress": False}
    expected = fem.static_transmission_error(spur, 50, 4, **options)["te"].values
    for pinion, wheel in ((0.0, -1e-12), (1e-12, 0.0)):
        pair = replace(spur, pinion=few_teeth(beta=pinion), wheel=few_teeth(beta=wheel))
        te = fem.static_transmission_error(pair, 50, 4, **options)["te"].values
        assert te == pytest.approx(expected, rel=2e-3)


def test_few_elements_are_added_where_a_wide_face_is_not_loaded():
    """Their number grows with the logarithm of the width; the loaded part is the same."""
    narrow, wide, widest = (np.sort(line_from_mid_plane(b * mm, 4, 5 * mm).p[0]) for b in (5, 50, 500))
    assert wide[:5] == pytest.approx(narrow) and wide[-1] == 25 * mm
    assert len(wide) - 5 <= 8 and len(widest) - len(wide) <= 6
    grown = np.diff(wide[4:])
    assert grown[1:] / grown[:-1] == pytest.approx(1.5) and grown[0] == pytest.approx(narrow[1], rel=0.25)


def test_a_wide_mate_is_stiffer_by_what_its_free_width_adds(monkeypatch):
    """Growing elements against equal ones, and the cost of either."""
    pair = fem.GearPair(few_teeth(b=5 * mm), few_teeth(b=20 * mm))
    options = {"resolution": fem.Slices(Density(flank=8, fillet=2, tooth=3, rim=2, body=2, width=2)), "progress": False}
    grown, cost = fem.static_transmission_error(pair, 20, 4, **options)["te"].values, fem.map_cost(pair, 20, 4)
    equal = fem.GearPair(few_teeth(b=5 * mm), few_teeth(b=5 * mm))
    narrow = fem.static_transmission_error(equal, 20, 4, **options)["te"].values
    monkeypatch.setattr("fem.elasticity.extrusion.GROWTH", 1 + 1e-9)
    monkeypatch.setattr("fem.elasticity.flank_compliance._stamp", lambda: "equal elements")
    fine = fem.static_transmission_error(pair, 20, 4, **options)["te"].values
    assert grown == pytest.approx(fine, rel=1e-3) and (grown < 0.95 * narrow).all()
    assert fem.map_cost(pair, 20, 4).compliances > cost.compliances > fem.map_cost(equal, 20, 4).compliances


def test_the_contact_ratio_without_load_is_that_of_the_common_face():
    pair = fem.GearPair(few_teeth(beta=25 * deg), few_teeth(beta=-25 * deg))
    axial = (0.0, 4 * mm, 8 * mm)
    ste = fem.static_transmission_error(
        pair, [0, 20], 4, offsets=fem.Offsets(axial=axial), resolution=fem.Slices(ROUGH, 12), progress=False
    )
    expected = [pair.eps_alpha + pair.eps_beta * (1 - shift / pair.b) for shift in axial]
    assert ste["contact_ratio"].sel(torque=0).values == pytest.approx(expected)
