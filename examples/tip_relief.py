"""Optimal tip relief of the paper's pair for one load and for a range of loads, with the run-up before and after.

    python examples/tip_relief.py results

Linear relief of the same amount and length on both gears, in steps of 0.5 and 50 µm. One design makes the peak to peak
of the STE small at 350 N m, the other the largest of those at 150, 250 and 350 N m. Each has its valley in the
landscape: longer reliefs are shallower. The run-ups at 350 N m show the DTE before and after: a table has the resonance
of each mesh harmonic, and that harmonic of the STE, which excites it. The compliance of the gears is that of unmodified
ones, so that flanks cost only contact solves. Damping is chosen here.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from command_line import command_line
from korta_pair import paper_pair

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

LOAD, RANGE, DAMPING_RATIO, TOP_SPEED = 350.0, (150.0, 250.0, 350.0), 0.05, 3500 * rpm
TORQUES = (0, 2, 10, 30, 70, 110, 150, 200, 250, 300, 350, 450, 700, 1200)
VARIABLES = {
    "C_a": exugear.Variable(0, 40 * um, step=0.5 * um, unit="um"),
    "length": exugear.Variable(0.5 * mm, 5 * mm, step=0.05 * mm, unit="mm"),
}
GOALS = {
    "best at 350 N m": exugear.Goal("peak_to_peak", LOAD, weight=1 / um),
    "best of 150 to 350 N m": exugear.Goal("peak_to_peak", RANGE, weight=1 / um),
}


def relieved(C_a: float, length: float) -> fem.GearPair:
    """The paper's pair with linear tip relief [m] on both gears, over a roll length [m]."""
    pair = paper_pair()
    gear = replace(pair.pinion, flank=[fem.TipRelief(C_a, length)])
    return fem.GearPair(gear, gear, a=pair.a)


def run_up(ste, duration: float) -> exugear.Run:
    """Both shafts only spin."""
    pair = fem.pair_of(ste)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("driving", pair.pinion), ("driven", pair.wheel))]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=DAMPING_RATIO)]))
    return exugear.run_up(model, speed=(0, TOP_SPEED), duration=duration, load=LOAD, progress=False)


def resonances(maps: dict, runs: dict[str, exugear.Run]) -> pd.DataFrame:
    """Amplitude of the DTE at the resonance of each mesh harmonic, and that harmonic of the STE [µm], by design."""
    columns = {}
    for name, run in runs.items():
        peaks = exugear.resonances(run).to_dataframe().set_index("harmonic")["amplitude"] / um
        of_map = fem.te_harmonics(maps[name], 10)["amplitude"].sel(torque=LOAD)
        columns[name, "DTE"] = peaks.groupby(level=0).max()
        columns[name, "STE"] = of_map.to_series() / um
    return pd.DataFrame(columns).dropna(how="all", subset=[(name, "DTE") for name in runs]).round(2)


def draw(folder: Path, landscape, maps: dict, runs: dict[str, exugear.Run], pair: fem.GearPair) -> None:
    """Landscape, peak to peak over the torque and DTE over mesh frequency; the figure for the drawing office."""
    figure = plots.figure(columns=3)
    figure.set_size_inches(13, 4.2)
    about = landscape.attrs | {"long_name": "lg (peak to peak / µm)"}
    plots.plot_landscape(np.log10(landscape).assign_attrs(about), figure.axes[0]).set_title("STE at 350 N m")
    for (name, ste), colour, dash in zip(maps.items(), plots.DISTINCT, ("-", "--", ":"), strict=False):
        swing = fem.peak_to_peak(ste)["peak_to_peak"] / um
        figure.axes[1].plot(ste["torque"], swing, color=colour, linestyle=dash, label=name)
    figure.axes[1].set(xlabel="torque [N m]", ylabel="peak to peak of the STE [µm]", xlim=(0, 500), ylim=(0, 9))
    figure.axes[1].axvspan(RANGE[0], RANGE[-1], color="0.93", zorder=0)
    figure.axes[1].legend(frameon=False, fontsize=9)
    plots.plot_envelopes(runs, figure.axes[2]).set_title("run-up at 350 N m")
    figure.axes[2].get_legend().remove()  # lines as in the middle
    figure.savefig(folder / "tip_relief.png", dpi=100)
    plots.flank_drawing(pair, title="best at 350 N m").savefig(folder / "tip_relief_drawing.png", dpi=100)


def main(folder: Path, quick: bool = False) -> dict[str, dict[str, float]]:
    """Peak to peak of the STE at all loads and largest rms of the DTE at 350 N m [m] by design."""
    folder.mkdir(parents=True, exist_ok=True)
    options = {"resolution": fem.Slices() if quick else fem.Resolution(), "progress": False}
    search = options | ({"phases": 24, "starts": 1} if quick else {})
    best = {name: exugear.optimize_flanks(relieved, VARIABLES, goal, **search) for name, goal in GOALS.items()}
    print(*(f"{name}: {result}" for name, result in best.items()), sep="\n")
    pairs = {"unmodified": paper_pair()} | {name: result.pair for name, result in best.items()}
    phases = 24 if quick else 40
    maps = {name: fem.static_transmission_error(pair, TORQUES, phases, **options) for name, pair in pairs.items()}
    runs = {name: run_up(ste, 2.0 if quick else 10.0) for name, ste in maps.items()}
    first = next(iter(best.values()))
    draw(folder, first.landscape(points=8 if quick else 20), maps, runs, first.pair)
    numbers: dict[str, dict[str, float]] = {}
    for name, run in runs.items():
        swing = fem.peak_to_peak(maps[name])["peak_to_peak"]
        numbers[name] = {f"{load:g} N m": float(swing.sel(torque=load)) for load in RANGE}
        numbers[name]["DTE"] = float(exugear.dte_envelope(run).rms.max())
        print(f"{name}:", ", ".join(f"{key}: {value / um:.2f} µm" for key, value in numbers[name].items()))
    print("resonances by mesh harmonic [µm]", resonances(maps, runs).to_string(na_rep=""), sep="\n")
    return numbers


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
