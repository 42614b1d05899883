"""The paper's Figures 5 and 6: transmission error of time-integrated against static finite elements, with their cost.

    python examples/korta_static_dynamic.py results      (--full: elements and time steps of half the size)

The load is viscous: while the transmission error changes, the wheel's hub turns faster or slower, so that its load
differs from the nominal load by up to 0.6 %. The statics are solved under that momentary load. What remains is ringing
where a pair of teeth enters or leaves contact, below 0.1 % at 10 rpm.
"""

import time
from pathlib import Path

import numpy as np
import xarray as xr
from command_line import command_line
from korta_pair import paper_pair
from skfem import ElementQuad1

import fem
from exugear import plots
from fem import dynamic, nonlinear
from fem.units import um

TORQUE = 150.0
#: The flanks are polygons: the transmission error ripples from element to element, on coarse meshes more.
DENSITY, FULL_DENSITY = fem.Density(flank=30), fem.Density(flank=30).refined(2)
RUN, FULL_RUN = dynamic.RunUp(steps=150), dynamic.RunUp()


def run_up(pair: fem.GearPair, density: fem.Density, motion: dynamic.RunUp) -> tuple[xr.Dataset, float]:
    """Run-up to 10 rpm and one pitch at that speed; wall time [s]."""
    start = time.perf_counter()
    moving = dynamic.transmission_error(pair, TORQUE, motion, density=density)
    return moving, time.perf_counter() - start


def statics(pair: fem.GearPair, moving: xr.Dataset, density: fem.Density) -> tuple[np.ndarray, float]:
    """Static transmission error (n,) [m] on the same mesh under the momentary load; wall time [s]."""
    start = time.perf_counter()
    problem = nonlinear.static_problem(pair, density, ElementQuad1(), wheel_share=1.0)
    force = moving["torque"].values / pair.pinion.r_b
    te = [nonlinear.equilibrium(problem, *state).te for state in zip(moving["phase"].values, force, strict=True)]
    return np.array(te), time.perf_counter() - start


def last_pitch(moving: xr.Dataset, n: int = 30) -> xr.Dataset:
    """n equidistant time steps over the last pitch."""
    phase = moving["phase"].values
    return moving.isel(time=np.searchsorted(phase, phase[-1] - 1 + (np.arange(n) + 1) / n - 1e-9))


def draw(path: Path, moving: xr.Dataset, phases: np.ndarray, te: np.ndarray, seconds: tuple[float, float]) -> None:
    """Figure 5: the run-up from rest; Figure 6: its last pitch beside the statics."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    left.plot(moving["time"], moving["te"] / um, color=plots.DISTINCT[0])
    left.set(xlabel="time [s]", ylabel="transmission error [µm]", title="run-up from rest to 10 rpm")
    right.plot(
        moving["phase"], moving["te"] / um, color=plots.DISTINCT[0], label=f"time integration, {seconds[0]:.0f} s"
    )
    right.plot(phases, te / um, "o", color=plots.DISTINCT[3], markersize=4, label=f"static, {seconds[1]:.0f} s")
    right.set(
        xlabel="phase of the mesh cycle [pitches]",
        title="last pitch",
        xlim=(phases[0], phases[-1]),
        ylim=(0.8 * te.min() / um, 1.15 * te.max() / um),
    )
    right.legend(frameon=False, loc="upper right")
    figure.savefig(path, dpi=100)


def main(folder: Path, full: bool = False) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    pair = paper_pair()
    density, motion = (FULL_DENSITY, FULL_RUN) if full else (DENSITY, RUN)
    moving, running = run_up(pair, density, motion)
    cycle = last_pitch(moving)
    te, standing = statics(pair, cycle, density)
    for name, curve, seconds in (("time integration", cycle["te"].values, running), ("static", te, standing)):
        mean, peak_to_peak = curve.mean() / um, np.ptp(curve) / um
        print(f"{name:18s} mean {mean:7.3f} um   peak to peak {peak_to_peak:6.3f} um {seconds:8.1f} s")
    draw(folder / "korta_static_dynamic.png", moving, cycle["phase"].values, te, (running, standing))


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "full").parse_args()))
