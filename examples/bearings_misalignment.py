"""The paper's pair on elastic bearings, the driven shaft mounted askew: what misalignment does at rest and in a run-up.

    python examples/bearings_misalignment.py results

A single STE map over misalignment and centre distance serves all tilts. It is solved in slice mode, with a line load
on every slice of the face. Tilt > 0: along z the driven shaft leans to where the teeth push it (f_sigma_beta). Bearings
and damping are chosen here. The mean forces of the run-up are 1 % above those at rest, because it speeds up.
"""

from pathlib import Path

import numpy as np
import pandas as pd
from command_line import command_line
from korta_pair import paper_pair
from tqdm import tqdm

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

LOAD, SPEED, DAMPING = 150.0, (500 * rpm, 4200 * rpm), 2700.0
GEAR, LENGTH, RADIAL = 30 * mm, 60 * mm, 1.5e8
TORQUES = (0, 5, 20, 50, 100, 150, 250, 400, 700)
TILTS = np.array([-0.6, -0.3, 0.0, 0.3, 0.6]) * 1e-3
MISALIGNMENT = np.array([-10, -6, -3.5, -2, -1, -0.5, 0, 0.5, 1, 2, 3.5, 6, 10]) * 1e-4
OPENING = np.array([-20, 40]) * um


def ste_map(quick: bool = False):
    """STE over torque, centre distance (unless quick), misalignment and phase."""
    pair = paper_pair()
    offsets = fem.Offsets(a=None if quick else tuple(pair.a + OPENING), misalignment=tuple(MISALIGNMENT))
    phases = 12 if quick else 24
    return fem.static_transmission_error(pair, TORQUES, phases, offsets=offsets, resolution=fem.Slices())


def gearbox(law: exugear.MeshForce, tilt: float) -> exugear.Gearbox:
    """Both shafts on two bearings, the driven shaft tilted about its gear [rad]."""
    pair = paper_pair()
    locating = exugear.Bearing(radial=RADIAL, axial=1e8, damping_time=2e-5)
    floating = exugear.Bearing(radial=RADIAL, damping_time=2e-5)
    fast, slow = ({0.0: locating, GEAR: gear, LENGTH: floating} for gear in (pair.pinion, pair.wheel))
    askew = exugear.Placement(y=-GEAR * tilt, tilt_x=-tilt)
    shafts = exugear.Shaft("driving", fast), exugear.Shaft("driven", slow, offset=askew)
    return exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)])


def sweep(law, tilts, duration: float) -> tuple[exugear.BuiltPlan, dict[float, exugear.Run]]:
    """The plan of the last tilt, and a run-up for each."""
    runs = {}
    for tilt in tqdm(tilts, desc="tilts", leave=False):
        model = exugear.build(gearbox(law, float(tilt)))
        runs[float(tilt)] = exugear.run_up(model, speed=SPEED, duration=duration, load=LOAD, progress=False)
    return model.plan, runs


def figures(ste, run: exugear.Run) -> dict[str, float]:
    """What a tilt does: misalignment at rest, means over the run-up, largest rms of the DTE, line load by the map."""
    data, outline = run.data, exugear.dte_envelope(run, windows=150)
    at_rest = float(data["misalignment"][0, 0])
    bearings = data["bearing_force"].mean("time")
    forces = {name: float(np.hypot(*bearings.sel(bearing=name).values[:2])) for name in data["bearing"].values}
    line_load = ste["line_load"].sel(torque=LOAD).interp(misalignment=at_rest)
    return {
        "misalignment [µrad]": at_rest / 1e-6,
        "centroid [mm]": float(data["centroid"].mean()) / mm,
        **{f"{name} [N]": force for name, force in forces.items()},
        "DTE rms [µm]": outline.rms.max() / um,
        "resonance [Hz]": outline.abscissa[np.argmax(outline.rms)],
        "line load [N/mm]": float(line_load.max("phase").mean()) / 1e3,
    }


def report(table: dict[float, dict[str, float]]) -> str:
    """A column per tilt [mrad]."""
    return pd.DataFrame({tilt * 1e3: column for tilt, column in table.items()}).to_string(float_format="%.2f")


def draw(path: Path, table: dict[float, dict[str, float]], runs: dict[float, exugear.Run]) -> None:
    """Envelope of the DTE over mesh frequency; misalignment, force centroid and bearing forces over the tilt."""
    figure = plots.figure(rows=2, columns=2)
    envelopes, angles, centroids, bearings = figure.axes
    plots.plot_envelopes({f"{tilt * 1e3:g} mrad": run for tilt, run in runs.items() if tilt >= 0}, envelopes)
    tilts = np.array(list(table)) * 1e3

    def plot(ax, name: str, **style) -> None:
        ax.plot(tilts, [row[name] for row in table.values()], "o-", **style)

    angles.plot(tilts, tilts * 1e3 * np.cos(paper_pair().alpha_wt), "k:", label="rigid bearings")
    plot(angles, "misalignment [µrad]", label="elastic bearings, under load")
    angles.set(ylabel="misalignment [µrad]")
    plot(centroids, "centroid [mm]")
    centroids.set(ylabel="force centroid [mm]")
    for axial in (0.0, LENGTH):
        plot(bearings, f"driven at {axial / mm:g} mm [N]", label=f"bearing at {axial / mm:g} mm")
    bearings.set(ylabel="mean radial bearing force [N]")
    for ax in figure.axes[1:]:
        ax.set_xlabel("tilt of the driven shaft [mrad]")
        ax.grid(alpha=0.3)
    for ax in (angles, bearings):
        ax.legend(frameon=False)
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> dict[float, exugear.Run]:
    """The runs by tilt [rad]; quick: a smaller map, fewer tilts, a shorter run-up."""
    folder.mkdir(parents=True, exist_ok=True)
    ste = ste_map(quick)
    law = exugear.MeshForce.from_ste(ste, damping=DAMPING)
    plan, runs = sweep(law, TILTS[::2] if quick else TILTS, 0.2 if quick else 2.0)
    table = {tilt: figures(ste, run) for tilt, run in runs.items()}
    draw(folder / "bearings_misalignment.png", table, runs)
    print(plan, report(table), sep="\n\n")
    return runs


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
