"""A crack that grows in the root of a pinion's tooth, seen by condition indicators through noise of 20 dB.

    python examples/growing_crack.py results

Both gears have pitch deviations of class 6 (ISO 1328-1). Each run is that of a pinion whose tooth 5 has lost a share of
its stiffness. Noise of a tenth of the signal is added to the transmission error, as a sensor has it. Averages over 47
turns of the pinion take it out, and what the 47 teeth of the wheel do. The change since the sound gear shows the crack
at once, NA4 of the residual signal later, the kurtosis of the whole average not at all.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

Z, TOOTH, LOAD, SPEED = (23, 47), 5, 200.0, 1500 * rpm
LOST, NOISE = (0.0, 0.05, 0.1, 0.2, 0.3), 0.1
CHANGE = "kurtosis of the change"


def stage(lost: float) -> exugear.Stage:
    """The pair with a pinion whose tooth has lost a share of its stiffness."""
    bare = [fem.Gear(z=z, m_n=3 * mm, b=20 * mm, d_bore=25 * mm) for z in Z]
    classed = [
        fem.drawn_deviations(gear, fem.iso1328(gear, 6), seed=seed, profiles=False) for seed, gear in enumerate(bare)
    ]
    crack = (fem.OnTooth(TOOTH, fem.crack(bare[0], lost)),) if lost else ()
    pinion, wheel = replace(classed[0], flank=(*classed[0].flank, *crack)), classed[1]
    pair = fem.GearPair(pinion, wheel, a=fem.GearPair(*bare).a + 0.1 * mm)
    law = exugear.MeshForce.from_tooth_pairs(fem.tooth_pair_map(pair, 1.5 * LOAD, progress=False), damping=2000.0)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("pinion", pinion), ("wheel", wheel))]
    return exugear.Stage(*shafts, law, pair=pair)


def averages(lost: float, duration: float) -> xr.DataArray:
    """Averages of the noisy transmission error over turns of the pinion at constant speed."""
    model = exugear.build(exugear.Gearbox([stage(lost)]))
    run = exugear.run_up(model, speed=(SPEED, SPEED), duration=duration, load=LOAD, progress=False, checks=0)
    dte = exugear.signal(run, "dte", stage=0).sel(time=slice(0.1, None))
    noise = NOISE * float(dte.std()) * np.random.default_rng(round(100 * lost)).normal(size=dte.size)
    return exugear.synchronous_average(dte.copy(data=dte.values + noise), highest_order=4 * Z[0], turns=Z[1])


def main(folder: Path, quick: bool = False) -> dict[float, xr.Dataset]:
    """Indicators by the lost share of the stiffness; a figure."""
    folder.mkdir(parents=True, exist_ok=True)
    lost_shares, duration = (LOST[::2], 4.2) if quick else (LOST, 8.0)
    seen = {lost: averages(lost, duration) for lost in lost_shares}
    indicators = {lost: exugear.condition_indicators(x, baseline=seen[0.0]) for lost, x in seen.items()}
    for lost, average in seen.items():
        change = average.isel(average=slice(1, None)) - seen[0.0].isel(average=0, drop=True)
        of_change = exugear.condition_indicators(change.assign_attrs(average.attrs))
        indicators[lost] = indicators[lost].assign({CHANGE: of_change["kurtosis"]})
    figure = plots.figure(columns=2)
    for name, colour in zip((CHANGE, "NA4", "kurtosis"), plots.DISTINCT, strict=False):
        values = [indicators[lost][name].values for lost in seen]
        figure.axes[0].plot([100 * lost for lost in seen], values, "o-", color=colour, mfc="none")
        figure.axes[0].plot([], [], "o-", color=colour, label=name)
        print(name, {f"{lost:.0%}": np.round(x, 2).tolist() for lost, x in zip(seen, values, strict=True)})
    figure.axes[0].set(xlabel="lost stiffness of the tooth [%]", ylabel="indicator", yscale="log")
    figure.axes[0].set_yticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"])
    figure.axes[0].minorticks_off()
    figure.axes[0].legend()
    for lost, colour in zip((0.0, max(seen)), plots.DISTINCT, strict=False):
        residual = exugear.residual_signal(seen[lost].isel(average=0)) / um
        look = {"color": colour, "label": f"{lost:.0%} lost", "lw": 1.2}
        figure.axes[1].plot(residual["angle"] / (2 * np.pi) * Z[0], residual, **look)
    figure.axes[1].set(xlabel="angle of the pinion [pitches]", ylabel="residual signal [µm]")
    figure.axes[1].legend()
    figure.savefig(folder / "growing_crack.png")
    return indicators


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
