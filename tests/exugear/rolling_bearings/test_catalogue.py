"""Inner geometry estimated from catalogues, beside that of bearings whose geometry is published."""

import pytest

from exugear import RollingBearing
from fem.units import deg, mm


@pytest.mark.parametrize(
    ("sizes", "C", "C_0", "Z", "D_w"),
    [
        ((25, 62, 17), 23.4e3, 11.6e3, 7, 11.5),
        ((25, 52, 15), 14.8e3, 7.8e3, 9, 7.94),
        ((17, 40, 12), 9.95e3, 4.75e3, 8, 6.746),
    ],
    ids=["6305", "6205", "6203"],
)
def test_known_deep_groove_bearings_are_estimated(sizes, C, C_0, Z, D_w):
    """6205 and 6203 of the test rig of Case Western Reserve University: 9 balls of 7.94 mm, 8 of 6.746 mm."""
    d, D, B = (x * mm for x in sizes)
    bearing = RollingBearing.from_catalogue("deep groove", d=d, D=D, B=B, C=C, C_0=C_0)
    row = bearing.rows[0]
    assert Z == row.Z
    assert row.D_w == pytest.approx(D_w * mm, rel=0.02)
    assert bearing.C == C
    assert f"estimated: Z {Z}" in bearing.estimate
    known = RollingBearing.deep_groove(Z=Z, D_w=D_w * mm, D_pw=(d + D) / 2)
    force = (0.1 * C, 0, 0, 0, 0)
    stiffness = bearing.under(force).stiffness[0, 0]
    assert stiffness == pytest.approx(known.under(force).stiffness[0, 0], rel=0.03)


def test_a_cylindrical_roller_bearing_is_estimated_with_its_error():
    """NU 205: 13 rollers of 7.5 mm x 9 mm."""
    sizes = {"d": 25 * mm, "D": 52 * mm, "B": 15 * mm, "C": 32.5e3, "C_0": 27e3}
    bearing = RollingBearing.from_catalogue("cylindrical roller", **sizes)
    row = bearing.rows[0]
    assert (row.Z, row.D_w / mm, row.L_we / mm) == (13, pytest.approx(7.5, rel=0.05), pytest.approx(9, rel=0.1))
    assert "changes the stiffness by up to" in bearing.estimate


def test_kinds_and_angles_that_are_not_estimated_are_refused_in_words():
    sizes = {"d": 25 * mm, "D": 52 * mm, "B": 15 * mm, "C": 15e3, "C_0": 8e3}
    with pytest.raises(ValueError, match="kind must be one of"):
        RollingBearing.from_catalogue("needle", **sizes)
    with pytest.raises(ValueError, match="alpha must be given"):
        RollingBearing.from_catalogue("deep groove", **sizes, alpha=15 * deg)


def test_capacities_that_no_bearing_has_warn():
    sizes = {"d": 25 * mm, "D": 52 * mm, "B": 15 * mm, "C": 14e3}
    RollingBearing.from_catalogue("deep groove", **sizes, C_0=7.85e3)
    with pytest.warns(UserWarning, match=r"no deep groove bearing .* its C and C_0 are \+44.* -83.* off"):
        RollingBearing.from_catalogue("deep groove", **sizes, C_0=60e3)
