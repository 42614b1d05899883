"""Tip relief against the dynamic transmission error: how much relief, for which load.

    python examples/tip_relief.py results

The paper's pair with linear tip relief on both gears. A long relief begins where a single pair of teeth carries the
load, a short one half-way from there to the tip. The relief that evens out the deflection at the design torque makes
the transmission error of lightly loaded teeth. The compliance of the gears is that of unmodified ones: flanks cost
only contact solves. The design torque and the damping are chosen here.
"""

from dataclasses import replace
from pathlib import Path

from command_line import command_line
from korta_pair import paper_pair
from tqdm import tqdm

import exugear
import fem
from exugear import plots
from fem.units import rpm, um

DESIGN, LIGHT, DAMPING_RATIO, TOP_SPEED = 250.0, 20.0, 0.05, 3500 * rpm
TORQUES = (0, 2, 10, LIGHT, 50, 100, 150, DESIGN, 400, 700, 1200)
#: Name of the flank -> amount of relief [m], its length as share of the long one.
FLANKS = {
    "no relief": (0.0, 1.0),
    "long, 5 µm": (5 * um, 1.0),
    "long, 10 µm": (10 * um, 1.0),
    "long, 20 µm": (20 * um, 1.0),
    "short, 10 µm": (10 * um, 0.5),
}
BEST = "long, 10 µm"


def relieved(amount: float, share: float) -> fem.GearPair:
    """The paper's pair with tip relief [m] on both gears, over a share of the path on which two pairs carry."""
    pair = paper_pair()
    length = share * (pair.eps_alpha - 1) * pair.p_bt
    gear = replace(pair.pinion, flank=[fem.TipRelief(amount, length)] if amount else [])
    return fem.GearPair(gear, gear, a=pair.a)


def ste_maps(phases: int = 40) -> dict:
    """STE over torque and phase by flank."""
    pairs = {name: relieved(*flank) for name, flank in FLANKS.items()}
    return {
        name: fem.static_transmission_error(pair, TORQUES, phases, progress=False)
        for name, pair in tqdm(pairs.items(), desc="maps", leave=False)
    }


def run_up(ste, load: float, duration: float) -> exugear.Run:
    """Both shafts only spin."""
    pair = fem.pair_of(ste)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("driving", pair.pinion), ("driven", pair.wheel))]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=DAMPING_RATIO)]))
    return exugear.run_up(model, speed=(0, TOP_SPEED), duration=duration, load=load, progress=False)


def draw(path: Path, maps: dict, runs: dict[float, dict[str, exugear.Run]]) -> None:
    """Peak to peak of the STE over the torque; DTE over mesh frequency at both loads."""
    figure = plots.figure(columns=3)
    figure.set_size_inches(12, 4.2)
    blue, orange, green = plots.DISTINCT[:3]
    styles = zip(("-", ":", "--", "-.", ":"), (blue, "k", orange, "k", green), strict=True)
    for (name, ste), (line, colour) in zip(maps.items(), styles, strict=True):
        swing = fem.peak_to_peak(ste)["peak_to_peak"] / um
        figure.axes[0].plot(ste["torque"], swing, line, color=colour, label=name)
    figure.axes[0].set(xlabel="torque [N m]", ylabel="peak to peak of the STE [µm]", xlim=(0, 500), ylim=(0, 12))
    figure.axes[0].axvline(DESIGN, color="0.7", linewidth=1, zorder=0, label=f"design torque, {DESIGN:g} N m")
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.08), "frameon": False, "fontsize": 10}
    figure.axes[0].legend(ncols=2, **above)
    for ax, (load, by_flank) in zip(figure.axes[1:], runs.items(), strict=True):
        plots.plot_envelopes(by_flank, ax).set_title(f"{load:g} N m")
        ax.legend(ncols=2, **above)
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> dict[str, dict[float, tuple[float, float]]]:
    """Peak to peak of the STE and largest rms of the DTE [m] by flank and load."""
    folder.mkdir(parents=True, exist_ok=True)
    maps, duration = ste_maps(20 if quick else 40), 2.0 if quick else 10.0
    chosen = ("no relief", BEST, "short, 10 µm")
    runs = {load: {name: run_up(maps[name], load, duration) for name in chosen} for load in (DESIGN, LIGHT)}
    draw(folder / "tip_relief.png", maps, runs)
    numbers: dict[str, dict[float, tuple[float, float]]] = {name: {} for name in chosen}
    for load, by_flank in runs.items():
        for name, run in by_flank.items():
            swing = float(fem.peak_to_peak(maps[name])["peak_to_peak"].sel(torque=load))
            rms = float(exugear.dte_envelope(run).rms.max())
            numbers[name][load] = swing, rms
            print(f"{load:4g} N m, {name:13s} STE {swing / um:5.2f} µm peak to peak, DTE {rms / um:5.2f} µm rms")
    return numbers


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
