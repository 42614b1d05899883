"""Gearboxes on bearings."""

from scenes import paper_pair, smooth_law

import exugear
from fem.units import mm

SPUR = paper_pair()
ENDS = {0.0: exugear.Bearing(5e8, 1e8, damping_time=1e-6), 60 * mm: exugear.Bearing(5e8, damping_time=1e-6)}
NO_DISPLACEMENT = exugear.Placement()
LAW = smooth_law(damping=2700.0)


def box_of(pair=SPUR, law=LAW, fast=ENDS, slow=ENDS, offset=NO_DISPLACEMENT) -> exugear.Gearbox:
    """Two shafts, each with a gear between further parts; the slow shaft displaced by offset."""
    fast_shaft = exugear.Shaft("fast", {30 * mm: pair.pinion} | fast)
    slow_shaft = exugear.Shaft("slow", {30 * mm: pair.wheel} | slow, offset=offset)
    return exugear.Gearbox([exugear.Stage(fast_shaft, slow_shaft, law, pair=pair)])
