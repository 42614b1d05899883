"""Run-ups of the paper's pair under 350 N m."""

from scenes import smooth_box

import exugear
from fem.units import rpm

LOAD = 350.0


def run(model, **changes) -> exugear.Run:
    options = {"speed": (0, 175 * rpm), "duration": 1.0, "load": LOAD, "progress": False} | changes
    return exugear.run_up(model, **options)


def with_bearings() -> exugear.Model:
    return exugear.build(smooth_box(exugear.Bearing(radial=1e9, axial=1e9, tilt=1e6, damping_time=1e-5)))
