"""Gearboxes whose shafts are given by their sections."""

from collections.abc import Sequence
from itertools import pairwise

from paper_gears import paper_gear, paper_pair
from scenes import smooth_law, smooth_stage

import exugear
from fem.units import mm

LAW = smooth_law(damping=2700.0)


def elastic_shaft(
    name: str,
    gears: Sequence[float] = (50 * mm,),
    length: float = 120 * mm,
    d: float = 50 * mm,
    radial: float = 1e9,
    **bearing,
) -> exugear.Shaft:
    """A shaft of one section with the paper's gears at axial positions [m], on a bearing at each end."""
    supports = {0.0: exugear.Bearing(radial, 1e8, damping_time=5e-6, **bearing)}
    supports[length] = exugear.Bearing(radial, damping_time=5e-6, **bearing)
    return exugear.Shaft(name, dict.fromkeys(gears, paper_gear()) | supports, sections=[(d, length)])


def elastic_box(**options) -> exugear.Gearbox:
    """The paper's pair on two equal shafts; options as those of `elastic_shaft`."""
    shafts = [elastic_shaft(name, **options) for name in ("fast", "slow")]
    return exugear.Gearbox([exugear.Stage(*shafts, LAW, pair=paper_pair())])


def elastic_train(*, bearings: bool = True) -> exugear.Gearbox:
    """Two stages, the middle shaft with two gears; without bearings the shafts only spin."""
    places = {"input": (60 * mm,), "middle": (60 * mm, 140 * mm), "output": (140 * mm,)}
    shafts = [elastic_shaft(name, gears, 200 * mm) for name, gears in places.items()]
    if not bearings:
        shafts = [exugear.Shaft(shaft.name, shaft.gears, sections=shaft.sections) for shaft in shafts]
    return exugear.Gearbox([smooth_stage(*ends, damping=2700.0) for ends in pairwise(shafts)])
