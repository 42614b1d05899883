"""Run time against error of the STE of the paper's pair: slices, resolved contact, eight-node hexahedra.

    PYTHONPATH=examples python tests/benchmarks/benchmark_ste.py

Slices converge to within half a per cent, because they leave out how the pressure spreads along the face. Eight-node
hexahedra, as in the paper, converge slowly.
"""

import numpy as np
from benchmark_points import Points, cold, timed
from korta_pair import paper_pair
from skfem import ElementHex1

import fem
from fem import nonlinear

TORQUE = 150.0


def ste_points(quick: bool) -> Points:
    """STE of the paper's pair over a cycle: error of its rms about the finest curve, time of 30 phases."""
    pair, points, n = paper_pair(), Points(), 10 if quick else 30
    phases, best = np.arange(n) / n, fem.Resolution().scaled(1.25 if quick else 2.0)

    def curve(resolution):
        options = {"resolution": resolution, "progress": False}
        ste, seconds = cold(lambda: fem.static_transmission_error(pair, TORQUE, phases, **options))
        return ste["te"].values.squeeze(), seconds * 30 / n

    finest, seconds = curve(best)
    error = lambda te, at=slice(None): 100 * float(np.sqrt(np.mean((te - finest[at]) ** 2)) / finest.mean())  # noqa: E731
    for name, mode in (("slices", fem.Slices()), ("resolved", fem.Resolution())):
        for scale in (0.5, 0.75, 1.0) if quick else (0.4, 0.6, 0.8, 1.0, 1.3):
            te, seconds = curve(mode.scaled(scale))
            points.add(name, f"mesh x {scale:g}", error(te), seconds)
    every = slice(None, None, 5)
    for flank, width in ((10, 2),) if quick else ((16, 3), (30, 4)):
        density = fem.Density(flank=flank, width=width)
        solve = lambda d=density: nonlinear.static_transmission_error(  # noqa: E731
            pair, TORQUE, phases[every], density=d, element=ElementHex1(), progress=False
        )
        ste, seconds = timed(solve)
        count = phases[every].size
        te = ste["te"].values.squeeze()
        points.add("nonlinear, 8-node hexahedra", f"flank {density.flank}", error(te, every), seconds * 30 / count)
    return points


if __name__ == "__main__":
    ste_points(quick=False)
