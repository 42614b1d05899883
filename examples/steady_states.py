"""Steady states with jumps: all branches of the paper's pair over the speed, and a run-up and a coast-down on them.

    python examples/steady_states.py results

Where teeth part, the mesh softens, and the resonance leans towards lower frequencies: two stable states and an unstable
one lie above each other. Run-up and coast-down stay on a branch up to its fold, and jump there. Near a fold a branch
attracts ever less, so that the runs are more accurate than by default.
"""

from math import pi
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from command_line import command_line
from korta_pair import gearbox, paper_pair

import exugear
import fem
from exugear import plots

LOAD, DAMPING_RATIO = 150.0, 0.06
TORQUES = (0, 1, 5, 20, 50, 100, 150, 250, 350, 500, 750, 1000, 1500)
#: Mesh frequencies [Hz] between which the branches lie, duration of a sweep [s] and tolerance of its DTE.
RANGE, DURATION, TOLERANCE = (150.0, 3300.0), 20.0, 1e-4


def folds(states: xr.Dataset) -> pd.DataFrame:
    """Mesh frequency [Hz] and rms [um] of the bifurcations."""
    marked = states.where(states["bifurcation"] != "", drop=True)
    columns = {"bifurcation": marked["bifurcation"], "mesh frequency [Hz]": marked["mesh_frequency"]}
    return pd.DataFrame(columns | {"rms of the DTE [µm]": marked["rms"] * 1e6}).sort_values("mesh frequency [Hz]")


def jump(run: exugear.Run) -> float:
    """Mesh frequency [Hz] at which the rms of the DTE changes most from a window to the next."""
    outline = exugear.dte_envelope(run)
    return float(outline.abscissa[np.abs(np.diff(outline.rms)).argmax()])


def draw(path: Path, states: xr.Dataset, sweeps: dict[str, exugear.Run]) -> None:
    """Branches above the envelope of each sweep."""
    figure = plots.figure(columns=2)
    for ax, (name, run) in zip(figure.axes, sweeps.items(), strict=True):
        plots.plot_branches(states, ax, run=run)
        ax.set_title(name)
    figure.axes[0].get_legend().remove()
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> tuple[xr.Dataset, dict[str, exugear.Run]]:
    folder.mkdir(parents=True, exist_ok=True)
    ste = fem.static_transmission_error(paper_pair(), TORQUES, 30 if quick else 60)
    model = exugear.build(gearbox(ste, DAMPING_RATIO))
    low, high = (2 * pi * frequency / 57 for frequency in RANGE)
    states = exugear.steady_states(model, speed=(low, high), load=LOAD)
    conditions = {"duration": 6.0 if quick else DURATION, "load": LOAD, "tolerance": TOLERANCE}
    speeds = {"run-up": (low, high), "coast-down": (high, low)}
    sweeps = {name: exugear.run_up(model, speed=speed, **conditions) for name, speed in speeds.items()}
    draw(folder / "steady_states.png", states, sweeps)
    print(folds(states).to_string(index=False, float_format="%.1f"))
    print(", ".join(f"largest jump of the {name}: {jump(run):.0f} Hz" for name, run in sweeps.items()))
    return states, sweeps


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
