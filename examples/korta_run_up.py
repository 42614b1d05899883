"""The paper's run-up from its Table I: STE by finite elements, multibody run-up on Exudyn, resonances beside Table II.

    python examples/korta_run_up.py results

Korta, Palermo, Mundo, Shweiki: Combining Finite Element and Multibody Modeling Techniques for Time-Efficient
Simulation of Nonlinear Gear Dynamics. Not in the paper and chosen here: bore, inertia, damping (see the options).
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from math import sqrt
from pathlib import Path

import numpy as np

import exugear
import fem
from exugear import plots
from exugear.post.spectrum import Resonances
from fem import iso6336
from fem.elasticity.extrusion import hexahedra
from fem.elasticity.section_mesh import section
from fem.units import deg, mm, rpm, um

TORQUES = (150.0, 350.0)
MAP_TORQUES = (0, 1, 5, 20, 50, 100, 150, 250, 350, 500, 750, 1000, 1500)
MAP_PHASES = 60
TOP_SPEED, DURATION = 3500 * rpm, 70.0
#: Finer than the default, at which steps fold the 12th to 14th harmonic of the mesh onto the main resonance.
TOLERANCE = 1e-4
TABLE_II = {150.0: (116, 438, 597, 907, 1804), 350.0: (122, 479, 650, 980, 1958)}


def paper_pair(d_bore: float = 60 * mm) -> fem.GearPair:
    """Table I; the contact ratio 1.45 fixes the centre distance."""
    gear = fem.Gear(
        z=57, m_n=2.6 * mm, b=23 * mm, alpha_n=20 * deg, d_a=154.5 * mm, d_f=141.7 * mm, s_n=3.78 * mm, d_bore=d_bore
    )
    return fem.GearPair(gear, gear, a=150 * mm)


def gearbox(ste, damping_ratio: float, inertia: float | None = None) -> exugear.Gearbox:
    """Two shafts that only spin, each with a gear of Table I; damping as share of critical at 150 N m."""
    pair = fem.pair_of(ste)
    fast = exugear.Shaft("driving", parts={0.0: pair.pinion}, inertia=inertia)
    slow = exugear.Shaft("driven", parts={0.0: pair.wheel}, inertia=inertia)
    mass = slow.inertia / pair.wheel.r_b**2
    damping = 2 * damping_ratio * sqrt(mean_stiffness(ste, 150.0) * mass)
    return exugear.Gearbox([exugear.Stage(fast, slow, ste, damping=damping)])


def mean_stiffness(ste, torque: float) -> float:
    """Mean of F / STE over the mesh cycle [N/m]."""
    force = torque / fem.pair_of(ste).pinion.r_b
    return float((force / ste["te"].sel(torque=torque)).mean())


def run(box: exugear.Gearbox, load: float, duration: float = DURATION) -> exugear.Run:
    """Linear run-up with the driving gear's speed imposed and the load torque on the driven gear."""
    conditions = {"speed": (0, TOP_SPEED), "duration": duration, "load": load}
    return exugear.run_up(exugear.build(box), **conditions, tolerance=TOLERANCE)


def run_ups(box: exugear.Gearbox, duration: float = DURATION) -> dict[float, exugear.Run]:
    """All torques side by side, each in a process of its own."""
    with ProcessPoolExecutor(len(TORQUES)) as pool:
        return dict(zip(TORQUES, pool.map(partial(run, box, duration=duration), TORQUES), strict=True))


def resonances(result: exugear.Run) -> Resonances:
    """Peaks of the envelope of the DTE over mesh frequency."""
    outline = exugear.dte_envelope(result)
    return exugear.resonances(outline.place, outline.amplitude, prominence=0.004)


def main_resonance(found: Resonances) -> float:
    """Mesh frequency of the highest peak [Hz]."""
    return float(found.place[np.argmax(found.height)])


def superharmonics(found: Resonances) -> list[float]:
    """Peaks nearest to 1/4, 1/3, 1/2 and all of the main resonance; NaN where none lies within 12 %."""
    top = main_resonance(found)
    nearest = [found.place[np.argmin(np.abs(found.place * n - top))] for n in (4, 3, 2, 1)]
    return [p if abs(p * n / top - 1) < 0.12 else np.nan for p, n in zip(nearest, (4, 3, 2, 1), strict=True)]


def fitted_inertia(box: exugear.Gearbox, at_150: Resonances) -> float:
    """Inertia of each gear that moves the main resonance at 150 N m to the paper's 1804 Hz [kg m^2]."""
    return box.driven.inertia * (main_resonance(at_150) / TABLE_II[150.0][-1]) ** 2


class Clock:
    """Wall time of named phases."""

    def __init__(self):
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str):
        print(f"{name} ...", flush=True)
        start = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - start


def compute(folder: Path, d_bore: float, damping_ratio: float, fit: bool, clock: Clock):
    """STE map and run-ups, written to the folder as netCDF."""
    pair = paper_pair(d_bore)
    with clock("STE curves (30 phases, 150 and 350 N m)"):
        curves = fem.static_transmission_error(pair, TORQUES, 30)
    with clock(f"STE map ({MAP_PHASES} phases, {len(MAP_TORQUES)} torques)"):
        ste = fem.static_transmission_error(pair, MAP_TORQUES, MAP_PHASES)
    fem.save(curves, folder / "ste_curves.nc")
    fem.save(ste, folder / "ste_map.nc")
    box = gearbox(ste, damping_ratio)
    if fit:
        with clock("run-up for the fit of the inertia"):
            inertia = fitted_inertia(box, resonances(run(box, 150.0)))
        box = gearbox(ste, damping_ratio, inertia)
    print(exugear.build(box).plan)
    with clock("run-ups, 150 and 350 N m side by side"):
        runs = run_ups(box)
    for load, result in runs.items():
        result.save(folder / f"run_up_{load:g}Nm.nc")
    return curves, ste, box, runs


def draw(folder: Path, curves, ste, runs) -> None:
    """Mesh, STE and run-ups as PNG."""
    gear, density = fem.pair_of(ste).pinion, fem.Resolution().density.paired()
    figure = plots.figure(columns=2, spatial=(0,))
    solid, plane = hexahedra(gear, density), section(gear, density)
    plots.plot_solid(solid.p, solid.facets[:, solid.boundary_facets()], figure.axes[0])
    plots.plot_section(plane.p, plane.t, figure.axes[1], height=12 * mm)
    figure.savefig(folder / "mesh.png", dpi=150)
    figure = plots.figure(columns=2)
    plots.plot_ste(curves, figure.axes[0])
    plots.plot_stiffness(ste, figure.axes[1])
    figure.savefig(folder / "ste.png", dpi=150)
    figure = plots.figure(rows=2)
    for ax, result in zip(figure.axes, runs.values(), strict=True):
        plots.plot_run_up(result, ax, found=resonances(result))
    figure.savefig(folder / "run_up.png", dpi=150)
    figure = plots.figure(columns=2)
    for ax, result in zip(figure.axes, runs.values(), strict=True):
        plots.plot_waterfall(result, ax)
    figure.savefig(folder / "orders.png", dpi=150)


def report(curves, box, runs, fit: bool, clock: Clock) -> str:
    """Tables of STE, resonances beside Table II, and wall times beside the paper's."""
    lines = ["", "static transmission error [um]     mean   peak to peak"]
    for load in TORQUES:
        te = curves["te"].sel(torque=load).values / um
        lines.append(f"{load:>12g} N m              {te.mean():9.3f}{np.ptp(te):12.3f}")
    pair = fem.pair_of(curves)
    standard = iso6336.mesh_stiffness(pair, 150.0 / pair.pinion.r / pair.b) * pair.b
    ours = " and ".join(f"{mean_stiffness(curves, load) * um:.1f}" for load in TORQUES)
    lines += ["", f"mean of F / STE {ours} N/um; ISO 6336 gives {standard * um:.0f} N/um, which knows no rim and hub"]
    found = {load: superharmonics(resonances(result)) for load, result in runs.items()}
    lines += ["", "DTE resonances [Hz]        150 N m   paper    350 N m   paper     stiffening   paper"]
    for i, (name, low, high) in enumerate(zip(("1/4", "1/3", "1/2", "main"), *found.values(), strict=True), start=1):
        ours, theirs = (high / low - 1) * 100, (TABLE_II[350.0][i] / TABLE_II[150.0][i] - 1) * 100
        hertz = f"{low:9.0f}{TABLE_II[150.0][i]:8d}{high:11.0f}{TABLE_II[350.0][i]:8d}"
        lines.append(f"{name:>12s}            {hertz}{ours:13.2f} %{theirs:7.2f} %".replace("nan", "  -"))
    lines.append("The paper's 116 and 122 Hz are no such share of its main resonance and are not looked for.")
    inertia = f"inertia of each gear {box.driven.inertia:.4e} kg m^2"
    fitted = "fitted to 1804 Hz at 150 N m; all else is predicted" if fit else "of solid discs: nothing is fitted"
    lines += ["", f"{inertia}, {fitted}.", "", "wall time [s]                                     here       paper"]
    paper = {"STE curves": 150 * 60, "run-ups,": 2 * 36 * 60}
    for name, seconds in clock.seconds.items():
        beside = next((f"{value:10d}" for key, value in paper.items() if name.startswith(key)), "")
        lines.append(f"{name:45s}{seconds:9.1f}  {beside}")
    lines.append(f"{'all':45s}{sum(clock.seconds.values()):9.1f}")
    return "\n".join(lines)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for figures (PNG) and results (netCDF)")
    parser.add_argument("--bore", type=float, default=60.0, help="diameter of the rigid hub [mm], 60 by default")
    parser.add_argument("--damping-ratio", type=float, default=0.08, help="of critical at 150 N m, 0.08 by default")
    parser.add_argument("--fit-inertia", action="store_true", help="fit one inertia to the paper's 1804 Hz at 150 N m")
    return parser.parse_args()


def main() -> None:
    chosen, clock = arguments(), Clock()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    curves, ste, box, runs = compute(chosen.folder, chosen.bore * mm, chosen.damping_ratio, chosen.fit_inertia, clock)
    with clock("figures"):
        draw(chosen.folder, curves, ste, runs)
    text = report(curves, box, runs, chosen.fit_inertia, clock)
    (chosen.folder / "report.txt").write_text(text + "\n", encoding="utf-8")
    print(text, f"\nresults in {chosen.folder}")


if __name__ == "__main__":
    main()
