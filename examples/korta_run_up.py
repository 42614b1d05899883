"""The run-up of the paper from its Table I: STE by finite elements, multibody run-up on Exudyn, resonances.

    python examples/korta_run_up.py results            (--fit-inertia: one inertia fitted to the paper's 1804 Hz)

With a damping ratio of 0.1 the teeth part at the main resonance: the envelope jumps there, and its top leans towards
lower frequencies. The peaks below it lie at 1/2, 1/3 and 1/4 of the main resonance. Two processes solve the run-ups
side by side, or the single run-up for the fit in parts.
"""

import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from command_line import command_line
from korta_pair import (
    MAP_PHASES,
    MAP_TORQUES,
    TABLE_II,
    TORQUES,
    envelope_peaks,
    gearbox,
    mean_stiffness,
    paper_pair,
    plan_of,
    resonance_table,
    run,
    run_ups,
)

import exugear
import fem
from exugear import plots, spectrum
from fem import iso6336
from fem.units import um

#: Wall times in the paper [s].
PAPER = {"STE curves": 150 * 60, "run-ups": 2 * 36 * 60}


def fitted_inertia(box: exugear.Gearbox, at_150: spectrum.Peaks) -> float:
    """Inertia of each gear that moves the main resonance at 150 N m to the paper's 1804 Hz [kg m^2]."""
    main = at_150.abscissa[np.argmax(at_150.height)]
    return box.driven.inertia * float(main / TABLE_II[150.0][-1]) ** 2


@contextmanager
def timed(seconds: dict[str, float], name: str):
    """Store the wall time of a part of the job under its name."""
    print(f"{name} ...", flush=True)
    start = time.perf_counter()
    yield
    seconds[name] = time.perf_counter() - start


def compute(folder: Path, fit: bool, seconds: dict[str, float]):
    """STE map and run-ups, written to the folder as netCDF."""
    with timed(seconds, "STE curves"):
        curves = fem.static_transmission_error(paper_pair(), TORQUES, 30)
    with timed(seconds, "STE map"):
        ste = fem.static_transmission_error(paper_pair(), MAP_TORQUES, MAP_PHASES)
    fem.save(ste, folder / "ste_map.nc")
    box = gearbox(ste)
    if fit:
        with timed(seconds, "run-up for the fit"), ProcessPoolExecutor(2) as pool:
            at_150 = envelope_peaks(run(box, 150.0, executor=pool))
        box = gearbox(ste, inertia=fitted_inertia(box, at_150))
    print(plan_of(box))
    with timed(seconds, "run-ups"):
        runs = run_ups(box)
    for load, result in runs.items():
        result.save(folder / f"run_up_{load:g}Nm.nc")
    return curves, ste, box, runs


def draw(folder: Path, curves, ste, runs) -> None:
    """STE, run-ups and order maps as PNG."""
    panels = [plots.figure(columns=2) for _ in range(3)]
    plots.plot_ste(curves, panels[0].axes[0])
    plots.plot_stiffness(ste.sel(torque=[20, 50, 150, 350, 750, 1500]), panels[0].axes[1])
    for i, result in enumerate(runs.values()):
        superharmonics = spectrum.superharmonics(envelope_peaks(result))
        plots.plot_run_up(result, panels[1].axes[i], resonances=superharmonics)
        plots.plot_mesh_order_map(result, panels[2].axes[i])
    for name, panel in zip(("ste", "run_up", "orders"), panels, strict=True):
        panel.savefig(folder / f"{name}.png", dpi=100)


def report(curves, box, runs, fit: bool, seconds: dict[str, float]) -> str:
    """STE, resonances beside Table II, and wall times beside the paper's."""
    te = {load: curves["te"].sel(torque=load).values / um for load in TORQUES}
    lines = [f"STE at {load:g} N m: mean {x.mean():.3f} um, peak to peak {np.ptp(x):.3f} um" for load, x in te.items()]
    pair = fem.pair_of(curves)
    standard = iso6336.mesh_stiffness(pair, 150.0 / pair.pinion.r / pair.b) * pair.b
    secant = " and ".join(f"{mean_stiffness(curves, load) * um:.1f}" for load in TORQUES)
    stiffness = f"mean of F / STE {secant} N/um; ISO 6336, without rim and hub: {standard * um:.0f} N/um"
    lines = ["", *lines, "", stiffness, "", resonance_table({"exugear": runs})]
    origin = "fitted to 1804 Hz" if fit else "of solid discs; bore, inertia and damping are chosen, nothing is fitted"
    lines += ["", f"inertia of each gear {box.driven.inertia:.4e} kg m^2, {origin}", "", "wall time [s]          paper"]
    lines += [f"{name:20s}{x:7.1f}{PAPER.get(name, ''):>8}" for name, x in seconds.items()]
    return "\n".join(lines)


def main(folder: Path, fit_inertia: bool = False) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    seconds: dict[str, float] = {}
    curves, ste, box, runs = compute(folder, fit_inertia, seconds)
    with timed(seconds, "figures"):
        draw(folder, curves, ste, runs)
    text = report(curves, box, runs, fit_inertia, seconds)
    (folder / "report.txt").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "fit-inertia").parse_args()))
