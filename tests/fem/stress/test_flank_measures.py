"""Measures of flanks are those of the map, load factors and root stress, over load cases and offsets."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from paper_gears import paper_pair
from unequal_teeth import ONCE_PER_TURN, map_over, pair_of_unequal_teeth

import fem
from fem.units import mm, um

QUIET = {"resolution": COARSE, "progress": False}


def tip_relieved() -> fem.GearPair:
    gear = replace(paper_pair().pinion, flank=[fem.TipRelief(8 * um, 3 * mm), fem.LeadCrowning(4 * um)])
    return fem.GearPair(gear, gear, a=150 * mm)


def test_measures_of_a_map_over_load_cases_and_offsets():
    pair, offsets = tip_relieved(), fem.Offsets(misalignment=(0.0, 2e-4))
    names = ("harmonics", "peak_to_peak", "hertz_pressure", "tip_contact", "contact_ratio", "mean")
    data = fem.flank_measures(pair, [150, 350], names, 8, offsets=offsets, harmonics=2, **QUIET)
    assert tuple(data.data_vars) == names
    assert data.sizes == {"torque": 2, "misalignment": 2, "harmonic": 2}
    ste = fem.static_transmission_error(pair, [150, 350], 8, offsets=offsets, **QUIET)
    expected = {
        "peak_to_peak": fem.peak_to_peak(ste)["peak_to_peak"],
        "harmonics": fem.te_harmonics(ste, 2)["amplitude"],
        "hertz_pressure": ste["hertz_pressure"].max("phase"),
        "mean": ste["te"].mean("phase"),
    }
    for name, values in expected.items():
        assert data[name].values == pytest.approx(values.values, rel=1e-12)
    # |2/T int f cos| <= p/2 4/pi: the harmonic of a curve between +-p/2 is at most that of a square wave.
    assert (data["peak_to_peak"] > 0.95 * np.pi / 2 * data["harmonics"].sel(harmonic=1)).all()
    assert data["peak_to_peak"].attrs["units"] == "m"
    assert fem.pair_of(data) == pair


def test_measures_of_teeth_that_differ_are_those_of_all_their_pitches():
    """A pitch deviation once per turn moves the transmission error by twice its amplitude; tooth 0 alone shows none."""
    pair, twelve = pair_of_unequal_teeth(), np.arange(12 * 8) / 8
    data = fem.flank_measures(pair, 60.0, ("peak_to_peak",), twelve, **QUIET)
    alike = fem.flank_measures(pair_of_unequal_teeth(pinion=False), 60.0, ("peak_to_peak",), 8, **QUIET)
    added = float(data["peak_to_peak"][0] - alike["peak_to_peak"][0])
    assert added == pytest.approx(2 * ONCE_PER_TURN, rel=0.15)
    first = map_over(pair, 1)
    for measure in (
        lambda: fem.flank_measures(pair, 60.0, **QUIET),
        lambda: fem.load_factors(pair, 60.0, 4, progress=False),
        lambda: fem.peak_to_peak(first),
        lambda: fem.te_harmonics(first, 2),
    ):
        with pytest.warns(UserWarning, match=r"1 of the 12 pitches .* phases=np.arange\(12 \* 12\) / 12"):
            measure()


@pytest.mark.slow
def test_load_factors_and_root_stress_at_several_offsets():
    pair, offsets = tip_relieved(), fem.Offsets(misalignment=(0.0, 2e-4))
    density = fem.Density(flank=4, fillet=3, land=1, tooth=2, rim=1, body=2, width=1)
    names = ("K_H_beta", "root_stress")
    data = fem.flank_measures(pair, [150, 350], names, 4, offsets=offsets, root_density=density, **QUIET)
    assert data["K_H_beta"].dims == ("torque", "misalignment")
    assert data["root_stress"].dims == ("torque", "misalignment", "gear")
    one = fem.Offsets(misalignment=2e-4)
    factors = fem.load_factors(pair, [150, 350], 4, offsets=one, **QUIET)
    assert data["K_H_beta"].sel(misalignment=2e-4).values == pytest.approx(factors["K_H_beta"].values, rel=1e-12)
    stress = fem.root_stress(pair, [150, 350], 4, offsets=one, density=density, **QUIET)["root_stress"].max("phase")
    expected = stress.transpose("torque", "gear").values
    assert data["root_stress"].sel(misalignment=2e-4).values == pytest.approx(expected, rel=1e-12)


def test_bad_requests_are_refused():
    with pytest.raises(ValueError, match="torque must be > 0 N m, a load case each"):
        fem.flank_measures(paper_pair(), [0.0, 150.0])
    with pytest.raises(ValueError, match="measures must hold different names among peak_to_peak"):
        fem.flank_measures(paper_pair(), 150.0, ("noise",))
    with pytest.raises(ValueError, match="measures must hold different names"):
        fem.flank_measures(paper_pair(), 150.0, ("mean", "mean"))
    with pytest.raises(ValueError, match="harmonics must lie in"):
        fem.flank_measures(paper_pair(), 150.0, ("harmonics",), 8, harmonics=9, **QUIET)
