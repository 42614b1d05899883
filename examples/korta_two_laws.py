"""The paper's contact element beside the law of the whole STE map, and beside one that conserves energy.

    python examples/korta_two_laws.py results

The paper's element (Palermo et al. 2013) has the secant stiffness F / STE at the nominal torque; the map's law follows
the STE over all torques; the conserving one derives force and torques from one potential of that law. Same pair, same
inertia, same damping: what differs is the law alone.
"""

import argparse
from math import sqrt
from pathlib import Path

from korta_run_up import (
    DURATION,
    MAP_PHASES,
    MAP_TORQUES,
    TABLE_II,
    TORQUES,
    mean_stiffness,
    paper_pair,
    resonances,
    superharmonics,
)
from korta_run_up import run as run_up

import exugear
import fem
from exugear import plots

NAMES = ("whole map", "secant (paper)", "conserving")


def laws(ste, load: float, damping: float) -> dict[str, exugear.MeshForce]:
    """The three laws for a run at a load."""
    whole, conserving = (exugear.MeshForce.from_ste(ste, damping=damping, conserves=c) for c in (False, True))
    return dict(zip(NAMES, (whole, exugear.MeshForce.secant(ste, load, damping=damping), conserving), strict=True))


def gearbox(ste, force: exugear.MeshForce) -> exugear.Gearbox:
    """Two shafts that only spin."""
    pair = fem.pair_of(ste)
    shafts = exugear.Shaft("driving", {0.0: pair.pinion}), exugear.Shaft("driven", {0.0: pair.wheel})
    return exugear.Gearbox([exugear.Stage(*shafts, force, pair=pair)])


def compute(duration: float, damping_ratio: float, progress: bool = True) -> dict[str, dict[float, exugear.Run]]:
    """Run-ups by law and torque."""
    pair = paper_pair()
    ste = fem.static_transmission_error(pair, MAP_TORQUES, MAP_PHASES, progress=progress)
    mass = exugear.Shaft("driven", {0.0: pair.wheel}).inertia / pair.wheel.r_b**2
    damping = 2 * damping_ratio * sqrt(mean_stiffness(ste, 150.0) * mass)
    found: dict[str, dict[float, exugear.Run]] = {name: {} for name in NAMES}
    for load in TORQUES:
        for name, force in laws(ste, load, damping).items():
            print(f"{name}, {load:g} N m ...", flush=True)
            found[name][load] = run_up(gearbox(ste, force), load, duration)
    return found


def report(runs: dict[str, dict[float, exugear.Run]]) -> str:
    """Resonances and stiffening side by side, with the largest DTE."""
    lines = ["DTE resonances [Hz]         1/4      1/3      1/2     main   stiffening of main   largest DTE [um]"]
    for name, by_load in runs.items():
        peaks = {load: superharmonics(resonances(one)) for load, one in by_load.items()}
        stiffening = 100 * (peaks[350.0][-1] / peaks[150.0][-1] - 1)
        for load, found in peaks.items():
            largest = float(by_load[load].data["dte"].max()) * 1e6
            row = "".join(f"{place:9.0f}" for place in found)
            last = f"{stiffening:12.2f} %" if load == 350.0 else " " * 14
            lines.append(f"{name:15s}{load:4g} N m{row}{last}{largest:20.1f}".replace("nan", "  -"))
    for load, published in TABLE_II.items():
        last = f"{100 * (TABLE_II[350.0][-1] / TABLE_II[150.0][-1] - 1):12.2f} %" if load == 350.0 else ""
        lines.append(f"{'paper, Table II':15s}{load:4g} N m" + "".join(f"{p:9.0f}" for p in published[1:]) + last)
    return "\n".join(lines)


def draw(runs: dict[str, dict[float, exugear.Run]], path: Path) -> None:
    """Envelopes of the DTE by law, one panel a torque."""
    figure = plots.figure(rows=2)
    for ax, load in zip(figure.axes, TORQUES, strict=True):
        at_load = {name: by_load[load] for name, by_load in runs.items()}
        plots.plot_envelopes(at_load, ax).set_title(f"{load:g} N m")
    figure.savefig(path, dpi=150)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure and the report")
    parser.add_argument("--duration", type=float, default=DURATION, help="of a run-up [s], 70 by default")
    parser.add_argument("--damping-ratio", type=float, default=0.08, help="of critical at 150 N m, 0.08 by default")
    return parser.parse_args()


def main() -> None:
    chosen = arguments()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    runs = compute(chosen.duration, chosen.damping_ratio)
    text = report(runs)
    (chosen.folder / "two_laws.txt").write_text(text + "\n", encoding="utf-8")
    draw(runs, chosen.folder / "two_laws.png")
    print(text, f"\nresults in {chosen.folder}")


if __name__ == "__main__":
    main()
