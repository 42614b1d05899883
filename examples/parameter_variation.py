"""Exudyn's ParameterVariation over a gear model: bearing stiffness and damping against the resonance of the DTE.

    python examples/parameter_variation.py results

The paper's pair on elastic bearings, run up for each pair of parameters. Both gears yield with their bearings, so that
softer bearings lower the resonance of the mesh. Damping lowers its height; its frequency rises because the teeth part
less. All stiffnesses and ratios share one STE map. With useMultiProcessing the run-ups spread over the cores.
Parameters and load are chosen here.
"""

from pathlib import Path

import numpy as np
from command_line import command_line
from exudyn.processing import ParameterVariation
from korta_pair import paper_pair

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

LOAD, SPEED = 150.0, (900 * rpm, 2400 * rpm)
TORQUES = (0, 1, 5, 20, 50, 100, 150, 250, 400, 700, 1200)
STIFFNESSES, RATIOS = [2e8, 5e8, 1e9, 2e9, 5e9], [0.06, 0.09, 0.13]


def gearbox(ste, stiffness: float, ratio: float) -> exugear.Gearbox:
    """Each gear midway between two bearings of a radial stiffness [N/m]."""
    pair, bearing = fem.pair_of(ste), exugear.Bearing(radial=stiffness, axial=1e8, damping_time=5e-6)
    shafts = [
        exugear.Shaft(name, {-30 * mm: bearing, 0.0: gear, 30 * mm: bearing})
        for name, gear in (("driving", pair.pinion), ("driven", pair.wheel))
    ]
    return exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=ratio)])


def peak(parameters: dict) -> dict[str, float]:
    """Mesh frequency [Hz] and height [m] of the largest rms of the DTE: the function that is varied."""
    ste, duration = parameters["functionData"]["ste"], parameters["functionData"]["duration"]
    model = exugear.build(gearbox(ste, parameters["stiffness"], parameters["damping_ratio"]))
    run = exugear.run_up(model, speed=SPEED, duration=duration, load=LOAD, progress=False, checks=0)
    outline = exugear.dte_envelope(run)
    return {"frequency": float(outline.abscissa[np.argmax(outline.rms)]), "rms": float(outline.rms.max())}


def vary(ste, parameters: dict[str, list[float]], duration: float, processes: bool) -> dict[str, np.ndarray]:
    """Frequency and rms of the peak over stiffness (rows) and damping ratio (columns)."""
    fixed = {"ste": ste, "duration": duration}
    _, peaks = ParameterVariation(
        peak, parameters, parameterFunctionData=fixed, useMultiProcessing=processes, showProgress=False
    )
    shape = [len(values) for values in parameters.values()]
    return {name: np.array([values[name] for values in peaks]).reshape(shape) for name in ("frequency", "rms")}


def draw(path: Path, peaks: dict[str, np.ndarray], parameters: dict[str, list[float]]) -> None:
    """Frequency and height of the peak over the bearing stiffness, a line per damping ratio."""
    figure = plots.figure(columns=2)
    for ax, name, unit, label in zip(
        figure.axes, peaks, (1.0, um), ("frequency [Hz]", "rms of the DTE [µm]"), strict=True
    ):
        for ratio, column in zip(parameters["damping_ratio"], peaks[name].T / unit, strict=True):
            ax.plot(parameters["stiffness"], column, "o-", label=f"damping ratio {ratio:g}")
        ax.set(xlabel="radial stiffness of each bearing [N/m]", ylabel=f"resonance: {label}", xscale="log")
        ax.set_xticks(parameters["stiffness"], [f"{x:.0e}".replace("e+0", "e") for x in parameters["stiffness"]])
        ax.minorticks_off()
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> dict[str, np.ndarray]:
    folder.mkdir(parents=True, exist_ok=True)
    ste = fem.static_transmission_error(paper_pair(), TORQUES, 20, progress=False)
    parameters = {
        "stiffness": STIFFNESSES[::2] if quick else STIFFNESSES,
        "damping_ratio": RATIOS[::2] if quick else RATIOS,
    }
    peaks = vary(ste, parameters, 0.3 if quick else 0.6, processes=not quick)
    draw(folder / "parameter_variation.png", peaks, parameters)
    for name, values in peaks.items():
        print(name, np.array2string(values, precision=4), sep="\n")
    return peaks


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
