"""Maps that older versions saved: they load as they were made, with their gears and modifications."""

from pathlib import Path

import pytest

import exugear
import fem
from fem.units import deg, mm, um

#: Written by version 0.1.0, when all modules of fem lay in one folder.
OLD = Path(__file__).parents[2] / "cases" / "data" / "map_of_version_0.1.0.nc"
LEFT = (fem.TipRelief(10 * um, 1.5 * mm), fem.LeadCrowning(4 * um), fem.HelixSlope(3 * um), fem.EdgeBreak(0.1 * mm))
RIGHT = (fem.ProfileCrowning(5 * um), fem.RootRelief(8 * um, 0.8 * mm))


@pytest.fixture(scope="module")
def pair() -> fem.GearPair:
    size = {"m_n": 2 * mm, "b": 12 * mm}
    pinion = fem.Gear(z=23, beta=12 * deg, x=0.2, d_bore=20 * mm, flank=fem.Sides(left=LEFT, right=RIGHT), **size)
    wheel = fem.Gear(z=31, beta=-12 * deg, d_bore=25 * mm, flank=(fem.EndRelief(6 * um, 2 * mm),), **size)
    return fem.GearPair(pinion, wheel, a=56 * mm)


def test_an_old_map_holds_its_pair(pair):
    assert fem.pair_of(fem.load(OLD)) == pair


@pytest.mark.slow
def test_an_old_map_is_that_of_the_flanks_within_the_error_of_its_slices(pair):
    """Of six slices, which missed the first touch by 0.09 um; those of today find it."""
    old, solved = fem.load(OLD), fem.static_transmission_error
    strips = solved(pair, old["torque"].values, 4, progress=False)
    today = solved(pair, old["torque"].values, 4, resolution=fem.Slices(slices=6), progress=False)
    assert old["te"].values == pytest.approx(strips["te"].values, abs=0.3 * um)
    assert today["te"].values == pytest.approx(strips["te"].values, abs=0.15 * um)
    assert today["te"].values[0] == pytest.approx(strips["te"].values[0], abs=1e-6 * um)
    of_old, of_strips = (exugear.MeshForce.from_ste(ste).deflection for ste in (old, strips))
    assert of_old == pytest.approx(of_strips, abs=0.3 * um)


@pytest.mark.parametrize("resolved", [True, False])
def test_the_old_argument_of_a_resolution_is_refused(resolved):
    with pytest.raises(TypeError, match="unexpected keyword argument 'resolved'"):
        fem.Resolution(resolved=resolved)
