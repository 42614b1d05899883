"""The paper's Figures 5 and 6: transmission error of time-integrated against static finite elements, with their cost.

The load is viscous: while the transmission error changes, the wheel's hub turns faster or slower and feels another load
than the nominal one, by 0.6 % at most. The statics stand under that load of the moment; what then remains is ringing
where a pair of teeth comes or goes, below 0.1 % at 10 rpm.

python examples/korta_static_dynamic.py results
"""

import argparse
import time
from pathlib import Path

import numpy as np
import xarray as xr
from korta_run_up import paper_pair
from skfem import ElementQuad1

from exugear import plots
from fem import GearPair, dynamic, nonlinear
from fem.elasticity.mesh_density import Density
from fem.units import um

TORQUE = 150.0
DENSITY = Density(flank=30).refined(2)
RUN = dynamic.RunUp()


def run_up(pair: GearPair) -> tuple[xr.Dataset, float]:
    """Run-up to 10 rpm and one pitch at that speed; wall time [s]."""
    start = time.perf_counter()
    ran = dynamic.transmission_error(pair, TORQUE, RUN, density=DENSITY)
    return ran, time.perf_counter() - start


def statics(pair: GearPair, ran: xr.Dataset) -> tuple[np.ndarray, float]:
    """Static transmission error (n,) [m] on the same mesh under the load of the moment; wall time [s]."""
    start = time.perf_counter()
    meshing = nonlinear.assembled(pair, DENSITY, ElementQuad1(), lag=1.0)
    force = ran["torque"].values / pair.pinion.r_b
    te = [nonlinear.equilibrium(meshing, *state).te for state in zip(ran["phase"].values, force, strict=True)]
    return np.array(te), time.perf_counter() - start


def last_pitch(ran: xr.Dataset, n: int = 30) -> xr.Dataset:
    """n equidistant time steps over the last pitch."""
    phase = ran["phase"].values
    return ran.isel(time=np.searchsorted(phase, phase[-1] - 1 + (np.arange(n) + 1) / n - 1e-9))


def draw(path: Path, ran: xr.Dataset, phases: np.ndarray, te: np.ndarray, seconds: tuple[float, float]) -> None:
    """Figure 5: the run-up from rest; Figure 6: its last pitch beside the statics."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    left.plot(ran["time"], ran["te"] / um, color=plots.EDGE)
    left.set(xlabel="time [s]", ylabel="transmission error [µm]", title="run-up from rest to 10 rpm")
    right.plot(ran["phase"], ran["te"] / um, color=plots.EDGE, label=f"time integration, {seconds[0]:.0f} s")
    right.plot(phases, te / um, "o", color=plots.MARK, label=f"static, {seconds[1]:.0f} s")
    right.set(
        xlabel="phase of the mesh cycle [pitches]",
        xlim=(phases[0], phases[-1]),
        ylim=(0.8 * te.min() / um, 1.1 * te.max() / um),
    )
    right.legend(frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure")
    folder, pair = parser.parse_args().folder, paper_pair()
    folder.mkdir(parents=True, exist_ok=True)
    ran, running = run_up(pair)
    cycle = last_pitch(ran)
    phases, moving = cycle["phase"].values, cycle["te"].values
    te, standing = statics(pair, cycle)
    for name, curve, seconds in (("time integration", moving, running), ("static", te, standing)):
        mean, peak_to_peak = curve.mean() / um, np.ptp(curve) / um
        print(f"{name:18s} mean {mean:7.3f} um   peak to peak {peak_to_peak:6.3f} um {seconds:8.1f} s")
    draw(folder / "korta_static_dynamic.png", ran, phases, te, (running, standing))


if __name__ == "__main__":
    main()
