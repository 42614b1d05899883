"""Side bands and ghost orders: a pinion whose teeth differ, beside one whose teeth are alike, in runs.

    python examples/side_bands.py results

The pinion of 23 teeth has run-out, random pitch deviations and an undulation of order 31, as the indexing wheel of a
grinding machine leaves it. Its force law over 23 pitches is composed of single tooth pairs. In the vibration at
constant speed the run-out is order 1, with the pitch deviations the side bands 22 and 24 of the mesh order 23, and
order 31 is the ghost: a tone that no number of teeth explains. At this low speed they are those of the static
transmission error.
"""

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

Z, GHOST, LOAD, SPEED = 23, 31, 150.0, 300 * rpm
RUN_OUT, PITCH, WAVE = 8 * um, 2 * um, 0.5 * um
ORDERS = 1, 22, 23, 24, 31, 46


def pairs() -> dict[str, fem.GearPair]:
    """The pair with equal teeth, and with those of a real pinion."""
    pinion, wheel = (fem.Gear(z=z, m_n=3 * mm, b=20 * mm, d_bore=25 * mm) for z in (Z, 47))
    alike = fem.GearPair(pinion, wheel, a=fem.GearPair(pinion, wheel).a + 0.1 * mm)
    random = PITCH * np.random.default_rng(1).standard_normal(Z)
    index = np.array(fem.PitchDeviation.run_out(Z, RUN_OUT).values) + random
    flank = fem.PitchDeviation(tuple(index)), fem.Waviness(GHOST, WAVE)
    return {"teeth alike": alike, "real pinion": replace(alike, pinion=replace(pinion, flank=flank))}


def law_of(pair: fem.GearPair) -> exugear.MeshForce:
    """Its force law over all pitches, composed of single tooth pairs."""
    return exugear.MeshForce.from_tooth_pairs(
        fem.tooth_pair_map(pair, 2 * LOAD, resolution=fem.Slices()), damping=2000.0
    )


def vibration(pair: fem.GearPair, law: exugear.MeshForce, turns: int) -> exugear.Run:
    """A run at constant speed for some turns of the pinion."""
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("pinion", pair.pinion), ("wheel", pair.wheel))]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)]))
    print(model.plan)
    return exugear.run_up(model, speed=(SPEED, SPEED), duration=turns * 2 * pi / SPEED, load=LOAD)


def lines(dte: np.ndarray) -> np.ndarray:
    """Amplitudes of the orders 0, 1, 2, ... of a vibration over one turn, sampled evenly."""
    return 2 * np.abs(np.fft.rfft(dte)) / dte.size


def main(folder: Path, quick: bool = False) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Orders of the static transmission error and of the run by name; a figure."""
    folder.mkdir(parents=True, exist_ok=True)
    figure, orders = plots.figure(columns=2), {}
    for axis, (name, pair) in zip(figure.axes, pairs().items(), strict=True):
        law = law_of(pair)
        te = law.ste(pair, LOAD * Z / pair.wheel.z, phases=64)["te"].values[0]  # the load acts on the wheel
        te = np.resize(te, 64 * Z)
        run = vibration(pair, law, 2 if quick else 4)
        angle, dte = run.data["time"].values * SPEED, run.data["dte"].values.ravel()
        last = angle[-1] - 2 * pi * (1 - np.arange(64 * Z) / (64 * Z))
        orders[name] = lines(te), lines(np.interp(last, angle, dte))
        for values, label, width in zip(orders[name], ("static transmission error", "run"), (5, 2), strict=True):
            axis.vlines(np.arange(60), 1e-3, values[:60] / um, lw=width, alpha=0.5 if width > 2 else 1, label=label)
        axis.set(yscale="log", ylim=(1e-3, 20), xlabel="order of the pinion", ylabel="DTE [µm]", title=name)
        axis.legend()
        table = (f"{k}: {orders[name][0][k] / um:.3f} / {orders[name][1][k] / um:.3f}" for k in ORDERS)
        print(f"{name}: order: static / run [µm] {', '.join(table)}")
    figure.savefig(folder / "side_bands.png")
    return orders


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
