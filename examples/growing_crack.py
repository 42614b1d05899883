"""A crack that grows in the root of a pinion's tooth, seen by condition indicators through noise of 20 dB.

    python examples/growing_crack.py results

Both gears have pitch deviations of class 6 (ISO 1328-1). Each run is that of a pinion whose tooth 5 has lost a share of
its stiffness. Noise of a tenth of the signal is added to the transmission error, as a sensor has it. Averages over 47
turns of the pinion take it out, and what the 47 teeth of the wheel do. The change since the sound gear shows the crack
at once, NA4 of the residual signal later, the kurtosis of the whole average not at all: how many averages of a tooth
with a tenth less stiffness lie above all sound ones is printed, over draws of the noise.
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
CHANGE, SHOWN = "kurtosis of the change", ("kurtosis of the change", "NA4", "kurtosis")


def stage(lost: float, resolution: fem.Resolution | fem.Slices) -> exugear.Stage:
    """The pair with a pinion whose tooth has lost a share of its stiffness."""
    bare = [fem.Gear(z=z, m_n=3 * mm, b=20 * mm, d_bore=25 * mm) for z in Z]
    classed = [
        fem.drawn_deviations(gear, fem.iso1328(gear, 6), seed=seed, profiles=False) for seed, gear in enumerate(bare)
    ]
    crack = (fem.OnTooth(TOOTH, fem.crack(bare[0], lost)),) if lost else ()
    pinion, wheel = replace(classed[0], flank=(*classed[0].flank, *crack)), classed[1]
    pair = fem.GearPair(pinion, wheel, a=fem.GearPair(*bare).a + 0.1 * mm)
    pairs = fem.tooth_pair_map(pair, 1.5 * LOAD, resolution=resolution, progress=False)
    law = exugear.MeshForce.from_tooth_pairs(pairs, damping=2000.0)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("pinion", pinion), ("wheel", wheel))]
    return exugear.Stage(*shafts, law, pair=pair)


def vibration(lost: float, duration: float, resolution: fem.Resolution | fem.Slices) -> xr.DataArray:
    """Transmission error at constant speed."""
    model = exugear.build(exugear.Gearbox([stage(lost, resolution)]))
    run = exugear.run_up(model, speed=(SPEED, SPEED), duration=duration, load=LOAD, progress=False, checks=0)
    return exugear.signal(run, "dte", stage=0).sel(time=slice(0.1, None))


def averages(dte: xr.DataArray, seed: int) -> xr.DataArray:
    """Averages of the noisy transmission error over turns of the pinion."""
    noise = NOISE * float(dte.std()) * np.random.default_rng(seed).normal(size=dte.size)
    return exugear.synchronous_average(dte.copy(data=dte.values + noise), highest_order=4 * Z[0], turns=Z[1])


def indicators_of(average: xr.DataArray, sound: xr.DataArray) -> xr.Dataset:
    """Indicators of averages beside those of the sound gear, and the kurtosis of the change since its first one."""
    change = average - sound.isel(average=0, drop=True)
    of_change = exugear.condition_indicators(change.assign_attrs(average.attrs))["kurtosis"]
    return exugear.condition_indicators(average, baseline=sound).assign({CHANGE: of_change})


def told_apart(sound: xr.DataArray, cracked: xr.DataArray, baseline: xr.DataArray, draws: int) -> dict[str, float]:
    """Share of the averages of a cracked tooth that lie above those of the sound gear, over draws of the noise."""
    of_gears = [
        xr.concat([indicators_of(averages(dte, first + i), baseline)[[*SHOWN]] for i in range(draws)], "draw")
        for dte, first in ((sound, 1000), (cracked, 2000))
    ]
    return {name: float((of_gears[1][name] > of_gears[0][name].max()).mean()) for name in SHOWN}


def main(folder: Path, quick: bool = False) -> dict[float, xr.Dataset]:
    """Indicators by the lost share of the stiffness; a figure."""
    folder.mkdir(parents=True, exist_ok=True)
    lost_shares, *run = (LOST[::2], 4.2, fem.Slices()) if quick else (LOST, 8.0, fem.Resolution())
    vibrations = {lost: vibration(lost, *run) for lost in lost_shares}
    seen = {lost: averages(dte, round(100 * lost)) for lost, dte in vibrations.items()}
    indicators = {lost: indicators_of(x.isel(average=slice(1, None)), seen[0.0]) for lost, x in seen.items()}
    apart = told_apart(vibrations[0.0], vibrations[0.1], seen[0.0], 3 if quick else 20)
    print("10 % lost, averages above all sound ones:", {name: f"{share:.0%}" for name, share in apart.items()})
    figure = plots.figure(columns=2)
    for name, colour in zip(SHOWN, plots.DISTINCT, strict=False):
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
