"""The DTE on the coast flank: the backlash grows with the centre distance."""

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import smooth_map
from strategies import involute

import exugear
from fem.units import mm


@pytest.mark.parametrize("soft", [False, True])
def test_backlash_on_the_coast_flank_is_that_of_the_centre_distance(soft):
    pair, ste = paper_pair(), smooth_map()
    ends = {0.0: exugear.Bearing(5e7, 1e8, damping_time=1e-5), 60 * mm: exugear.Bearing(5e7, damping_time=1e-5)}
    bearings = ends if soft else {}
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear(), **bearings}) for name in ("fast", "slow")]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=0.1)]))
    coast = exugear.run_up(model, speed=2.0, duration=0.06, load=-150.0, progress=False).data.isel(stage=0)
    a = coast["centre_distance"].values if soft else pair.a
    r_b = pair.pinion.r_b + pair.wheel.r_b
    growth = 2 * r_b * (involute(np.arccos(r_b / a)) - involute(pair.alpha_wt))
    te = np.interp((pair.back_phase - coast["phase"]) % 1, ste["phase"], ste["te"].sel(torque=150), period=1)
    assert coast["dte"].values == pytest.approx(-(pair.backlash + growth + te), abs=2e-7)
    assert np.max(growth) == pytest.approx(11.9e-6 if soft else 0, rel=0.01)
