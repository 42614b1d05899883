"""A two-stage helical reducer of an electric axle up to 15,000 rpm: Campbell diagram, run-up, bearing force orders.

    python examples/ev_reducer.py results

A rotor behind a splined coupling drives the input shaft; three shafts lie on elastic bearings. A crossing of a mesh
order with a mode is a resonance where that mesh takes part in the mode, by its share of the strain energy. The bearing
forces of the run-up peak at such crossings. The maps are coarse: slice mode, half the elements along every direction.
All data are chosen here.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm

LOAD, SPEED, DAMPING, PLAY = 1200.0, (500 * rpm, 15000 * rpm), 2500.0, 0.06 * mm
#: Axial positions of bearings and gears.
BEARINGS, FIRST, SECOND = (0.0, 110 * mm), 30 * mm, 75 * mm
TORQUES = {"first": (0, 2, 10, 40, 120, 300, 600), "second": (0, 5, 25, 100, 370, 900, 1800)}
#: Least share of the energy of a mode in a mesh whose order meets it.
SHARE = 0.02
COARSE = fem.Slices(fem.Density().scaled(0.5))


def pairs() -> dict[str, fem.GearPair]:
    """Both pairs with backlash; equal hands on the middle shaft."""
    sizes = {"m_n": 1.75 * mm, "b": 28 * mm}, {"m_n": 2.5 * mm, "b": 36 * mm}
    teeth, helix, bores = ((23, 71), (22, 71)), (-25 * deg, 18 * deg), ((20 * mm, 45 * mm), (25 * mm, 70 * mm))
    tight = [
        fem.GearPair(*(fem.Gear(z=z[i], beta=(beta, -beta)[i], d_bore=d[i], **size) for i in (0, 1)))
        for size, z, beta, d in zip(sizes, teeth, helix, bores, strict=True)
    ]
    return {name: replace(pair, a=pair.a + PLAY) for name, pair in zip(TORQUES, tight, strict=True)}


def laws(phases: int) -> dict[str, exugear.MeshForce]:
    """Force laws of both pairs by their STE maps."""
    solve = fem.static_transmission_error
    maps = {name: solve(pair, TORQUES[name], phases, resolution=COARSE) for name, pair in pairs().items()}
    return {name: exugear.MeshForce.from_ste(ste, damping=DAMPING) for name, ste in maps.items()}


def gearbox(phases: int = 24) -> exugear.Gearbox:
    """Rotor, three shafts and six bearings."""
    geared, meshes = pairs(), laws(phases)
    first, second = geared["first"], geared["second"]
    locating = exugear.Bearing(radial=4e8, axial=2e8, damping_time=1e-5)
    bearings = dict(zip(BEARINGS, (locating, exugear.Bearing(radial=4e8, damping_time=1e-5)), strict=True))
    motor = exugear.Coupling(torsion=1.5e4, damping=0.5, inertia=0.03)
    fast = exugear.Shaft("input", bearings | {-20 * mm: motor, FIRST: first.pinion})
    middle = exugear.Shaft("middle", bearings | {FIRST: first.wheel, SECOND: second.pinion})
    slow = exugear.Shaft("output", bearings | {SECOND: second.wheel})
    upper = exugear.Stage(middle, slow, meshes["second"], pair=second, angle=-50 * deg)
    return exugear.Gearbox([exugear.Stage(fast, middle, meshes["first"], pair=first), upper])


def crossings(diagram: xr.Dataset) -> pd.DataFrame:
    """First mesh orders that meet a mode with a noticeable share of its energy in that mesh, by speed."""
    columns = ["crossing_speed", "crossing_frequency", "crossing_order", "crossing_mode", "crossing_energy_share"]
    table = diagram[columns].to_dataframe().rename(columns=lambda name: name.removeprefix("crossing_"))
    chosen = table["order"].str.startswith("1 x mesh") & (table["energy_share"] > SHARE)
    return table[chosen].assign(speed=table["speed"] / rpm).rename(columns={"speed": "rpm", "frequency": "Hz"})


def bearing_peaks(run: exugear.Run) -> np.ndarray:
    """Speeds [rpm] at which the sum of the varying bearing forces peaks."""
    forces = exugear.spectrum.bearing_force_rms(run, windows=100).sum("bearing")
    return exugear.peaks(forces["speed"].values / rpm, forces.values, prominence=0.15).abscissa


def order_cuts(run: exugear.Run) -> xr.Dataset:
    """Two mesh orders of each stage in the force along y of a bearing of the output shaft."""
    orders = np.concatenate([exugear.mesh_orders(run, stage, harmonics=2) for stage in (0, 1)])
    force = exugear.signal(run, "bearing_force", bearing="output at 110 mm", direction="y")
    return exugear.order_cut(force, orders)


def draw(path: Path, diagram: xr.Dataset, run: exugear.Run) -> None:
    """Campbell diagram beside the orders of the output bearing's force."""
    figure = plots.figure(columns=2)
    figure.set_size_inches(10, 4.6)
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.08), "ncols": 2, "frameon": False, "fontsize": "small"}
    modes = plots.plot_campbell(diagram, figure.axes[0], marked=SHARE)
    handles = modes.get_legend().legend_handles
    modes.legend(handles, [handle.get_label() for handle in handles], **above)
    orders = plots.plot_order_cuts(order_cuts(run), figure.axes[1])
    orders.legend(**above)
    orders.set_xticks((0, 5000, 10000, 15000))
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> tuple[pd.DataFrame, np.ndarray]:
    """Crossings of the Campbell diagram, and speeds [rpm] at which the bearing forces of the run-up peak."""
    folder.mkdir(parents=True, exist_ok=True)
    model = exugear.build(gearbox(12 if quick else 24))
    diagram = exugear.campbell(model, load=LOAD, speed=SPEED, harmonics=2)
    run = exugear.run_up(model, speed=SPEED, duration=1.0 if quick else 3.0, load=LOAD)
    draw(folder / "ev_reducer.png", diagram, run)
    table, peaks = crossings(diagram), bearing_peaks(run)
    print(table.to_string(index=False, float_format="%.4g"))
    print("bearing forces peak at", ", ".join(f"{peak:.0f}" for peak in peaks), "rpm")
    return table, peaks


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
