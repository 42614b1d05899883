"""A thousand gears of class 6: how loud the paper's pair with tip relief is as it comes from production.

    python examples/class_6_gears.py results

Slopes of profile and helix of both gears, the amount of their tip relief and the misalignment of the axes scatter
within their tolerances, those of the slopes by ISO 1328-1:1995 class 6, as three standard deviations. Finite elements
are solved once: each case costs 90 contact states. Finished cases are kept in the folder, so that a run that was
stopped goes on. Rank correlations say which tolerance matters: below the load for which the relief is made, more of
it makes a pair louder. At that load a deviation of either sign does, so that ranks see nothing and Sobol indices are
needed. The tolerances of relief and axes are chosen here.
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy
from command_line import command_line
from korta_pair import paper_pair

import exugear
import fem
from exugear import plots
from fem.units import mm, um

TORQUES, RELIEF, LENGTH, CROWNING = (150.0, 250.0, 350.0), 14.5 * um, 3.5 * mm, 3 * um
CLASS_6 = fem.iso1328(paper_pair().pinion, 6, edition=1995)
OF_GEARS = {"profile": CLASS_6.f_H_alpha, "helix": CLASS_6.f_H_beta, "relief": 3 * um}
LIMITS = {f"{name}_{gear}": limit for name, limit in OF_GEARS.items() for gear in (1, 2)} | {"misalignment": 2e-4}
TOLERANCES = {name: scipy.stats.truncnorm(-3, 3, 0, limit / 3) for name, limit in LIMITS.items()}


def made(gear: fem.Gear, profile: float, helix: float, relief: float) -> fem.Gear:
    """The gear with its relief and crowning, and deviations of profile slope, helix slope and relief [m]."""
    roll = gear.roll_form, gear.roll_tip
    slope = fem.Grid(roll, (-gear.b / 2, gear.b / 2), ((-profile / 2,) * 2, (profile / 2,) * 2))
    designed = fem.TipRelief(RELIEF + relief, LENGTH), fem.LeadCrowning(CROWNING)
    return replace(gear, flank=[*designed, slope, fem.HelixSlope(helix)])


def measures(profile_1=0.0, profile_2=0.0, helix_1=0.0, helix_2=0.0, relief_1=0.0, relief_2=0.0, misalignment=0.0):
    """Peak to peak of the STE and largest Hertz pressure of a pair with deviations, over the torque."""
    pair = paper_pair()
    pinion, wheel = made(pair.pinion, profile_1, helix_1, relief_1), made(pair.wheel, profile_2, helix_2, relief_2)
    names, tilted = ("peak_to_peak", "hertz_pressure"), fem.Offsets(misalignment=misalignment)
    of_pair = fem.GearPair(pinion, wheel, a=pair.a)
    return fem.flank_measures(of_pair, TORQUES, names, offsets=tilted, resolution=fem.Slices(), progress=False)


def draw(path: Path, gears, correlation, nominal) -> None:
    """Distributions of the peak to peak at all torques, and rank correlations with the tolerances."""
    figure = plots.figure(columns=2)
    for torque, colour in zip(TORQUES, plots.DISTINCT, strict=False):
        swing = gears["peak_to_peak"].sel(torque=torque) / um
        figure.axes[0].hist(swing, bins=40, histtype="step", color=colour, linewidth=1.6, label=f"{torque:g} N m")
        figure.axes[0].axvline(float(nominal["peak_to_peak"].sel(torque=torque)) / um, color=colour, linestyle=":")
        places = np.arange(len(TOLERANCES)) + 0.25 * (TORQUES.index(torque) - 1)
        figure.axes[1].barh(places, correlation["peak_to_peak"].sel(torque=torque), 0.22, color=colour)
    figure.axes[0].set(xlabel="peak to peak of the STE [µm], dotted: nominal", ylabel="pairs")
    figure.axes[0].margins(y=0.2)  # above the distributions
    figure.axes[0].legend(ncols=3, loc="upper center", framealpha=1, edgecolor="none")
    names = [name.replace("_", " ") for name in TOLERANCES]
    figure.axes[1].set_yticks(range(len(names)), names)
    figure.axes[1].set(xlabel="rank correlation with the peak to peak")
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False):
    """Peak to peak and pressure of all gears, rank correlations, Sobol indices at the torques."""
    folder.mkdir(parents=True, exist_ok=True)
    nominal = measures()  # finite elements are solved here, once
    number, points = (20, 2) if quick else (1000, 64)
    with ProcessPoolExecutor(2) as processes:
        shared = {"executor": None if quick else processes, "progress": not quick}
        gears = exugear.monte_carlo(measures, TOLERANCES, number=number, seed=6, store=folder / "class_6", **shared)
        shares = exugear.sobol_indices(measures, TOLERANCES, number=points, seed=6, **shared)
    correlation = exugear.rank_correlation(gears)
    draw(folder / "class_6_gears.png", gears, correlation, nominal)
    percentiles = gears["peak_to_peak"].quantile([0.05, 0.5, 0.95], "case") / um
    print("peak to peak [µm], nominal:", (nominal["peak_to_peak"] / um).round(2).values)
    print(percentiles.round(2).to_pandas(), correlation["peak_to_peak"].round(2).to_pandas(), sep="\n")
    print("total Sobol indices", shares["peak_to_peak_total"].round(2).to_pandas(), sep="\n")
    return gears, correlation, shares


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
