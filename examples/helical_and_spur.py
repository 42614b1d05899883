"""Helical against spur: what the overlap ratio does to the static and to the dynamic transmission error.

    python examples/helical_and_spur.py results

Pairs of one ratio, normal module, face width and torque; only the helix angle differs, and with it the centre distance.
Where the overlap ratio is a whole number the total length of the contact lines hardly changes over the mesh cycle. The
maps are coarse: slice mode, half the elements along every direction. Gears and damping are chosen here.
"""

from math import asin, pi
from pathlib import Path

import numpy as np
from command_line import command_line
from tqdm import tqdm

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm, um

TORQUE, TOP_SPEED, DAMPING_RATIO = 200.0, 8000 * rpm, 0.12
TORQUES = (0, 5, 20, 50, 100, TORQUE, 400, 800, 1600)
COARSE = fem.Slices(fem.Density().scaled(0.5))
WIDTH, MODULE = 30 * mm, 3 * mm
OVERLAPS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)


def pair_of_overlap(eps_beta: float) -> fem.GearPair:
    """30 and 60 teeth with the helix angle that gives an overlap ratio."""
    beta = asin(eps_beta * pi * MODULE / WIDTH)
    pinion = fem.Gear(z=30, m_n=MODULE, b=WIDTH, beta=beta, d_bore=40 * mm)
    return fem.GearPair(pinion, fem.Gear(z=60, m_n=MODULE, b=WIDTH, beta=-beta, d_bore=80 * mm))


def ste_maps(overlaps=OVERLAPS, phases: int = 24) -> dict:
    """STE over torque and phase by overlap ratio."""
    return {
        x: fem.static_transmission_error(pair_of_overlap(x), TORQUES, phases, resolution=COARSE, progress=False)
        for x in tqdm(overlaps, desc="maps", leave=False)
    }


def run_up(ste, duration: float) -> exugear.Run:
    """Both shafts only spin: the helical pair's axial force needs no bearing."""
    pair = fem.pair_of(ste)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("driving", pair.pinion), ("driven", pair.wheel))]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=DAMPING_RATIO)]))
    load = TORQUE * pair.wheel.z / pair.pinion.z
    return exugear.run_up(model, speed=(200 * rpm, TOP_SPEED), duration=duration, load=load, progress=False)


def swing_of(ste) -> float:
    """Peak to peak of the STE under load [m]."""
    return float(fem.peak_to_peak(ste)["peak_to_peak"].sel(torque=TORQUE))


def draw(path: Path, maps: dict, runs: dict[str, exugear.Run]) -> None:
    """Alternating STE over a pitch, its peak to peak over the overlap ratio, DTE over mesh frequency."""
    figure = plots.figure(columns=3)
    figure.set_size_inches(12, 3.6)
    curves, swings, dynamic = figure.axes
    phase = np.append(next(iter(maps.values()))["phase"].values, 1.0)
    for x in (0.0, 0.5, 1.0):
        te = maps[x]["te"].sel(torque=TORQUE).values
        curves.plot(phase, (np.append(te, te[0]) - te.mean()) / um, label=f"overlap ratio {x:g}")
    curves.set(xlabel="phase of the mesh cycle [pitches]", ylabel="STE less its mean [µm]")
    curves.legend(frameon=False, fontsize="small")
    swings.plot(list(maps), [swing_of(ste) / um for ste in maps.values()], "o-")
    swings.set(xlabel="overlap ratio", ylabel="peak to peak of the STE [µm]", ylim=(0, None))
    plots.plot_envelopes(runs, dynamic).legend(frameon=False, fontsize="small")
    for ax in (curves, swings):
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> dict[float, tuple[float, float]]:
    """Peak to peak of the STE and largest rms of the DTE [m] by overlap ratio."""
    folder.mkdir(parents=True, exist_ok=True)
    chosen = (0.0, 0.5, 1.0)
    maps = ste_maps(chosen if quick else OVERLAPS, 12 if quick else 24)
    runs = {x: run_up(maps[x], 0.5 if quick else 5.0) for x in chosen}
    draw(folder / "helical_and_spur.png", maps, {f"overlap ratio {x:g}": run for x, run in runs.items()})
    numbers = {}
    for x, run in runs.items():
        swing, rms = swing_of(maps[x]), float(exugear.dte_envelope(run).rms.max())
        beta, numbers[x] = fem.pair_of(maps[x]).pinion.beta / deg, (swing, rms)
        print(f"overlap {x:4g}, beta {beta:5.2f} deg: STE {swing / um:.3f} µm peak to peak, DTE {rms / um:.3f} µm rms")
    return numbers


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
