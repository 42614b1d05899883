"""A three-stage gearbox from a REXS file: its drawing, static results, and a run-up with bearing forces, as a report.

    python examples/rexs_gearbox.py results

`three_stage.rexs` holds what KISSsoft, the FVA-Workbench or Bearinx would write: gears, shafts by sections, bearings by
their inner geometry, a belt force on the input shaft and a load spectrum. The printed account tells what was read and
what was assumed. Maps of the meshes are coarse: slice mode, half the elements along every direction.
"""

from pathlib import Path

import pandas as pd
import xarray as xr
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import rpm

FILE = Path(__file__).parent / "three_stage.rexs"
SHARES = 0, 0.05, 0.2, 0.5, 1.0, 1.5
COARSE = fem.Slices(fem.Density().scaled(0.5))


def law(pair: fem.GearPair, torque: float, phases: int = 16) -> xr.Dataset:
    """Coarse map of a pair up to 1.5 times its torque in the load cases [N m]."""
    return fem.static_transmission_error(pair, [x * torque for x in SHARES], phases, resolution=COARSE)


def statics(model: exugear.Model, case: exugear.LoadCase) -> pd.DataFrame:
    """Mesh forces and frequencies of a load case."""
    box = model.gearbox
    frequencies = model.mesh_cycles * case.speed
    table = {"mesh force [N]": box.static_forces(case.load), "mesh frequency [Hz]": frequencies}
    return pd.DataFrame(table, index=box.labels)


def draw(path: Path, model: exugear.Model, run: exugear.Run) -> None:
    """The gearbox to scale beside the bearing forces of its run-up."""
    figure = plots.figure(columns=2)
    figure.set_size_inches(11, 4.6)
    plots.plot_gearbox(model.gearbox, figure.axes[0])
    plots.plot_bearing_forces(run, figure.axes[1])
    figure.savefig(path, dpi=100, bbox_inches="tight")


def main(folder: Path, quick: bool = False) -> tuple[exugear.Model, exugear.Run, list[Path]]:
    """Model, run-up of the first load case, and the files of the report; quick: rigid shafts on linear bearings."""
    folder.mkdir(parents=True, exist_ok=True)
    simple = {"shafts": "rigid", "bearings": "linear"} if quick else {}
    read = exugear.read_rexs(FILE, mesh=law, **simple)
    print(read)
    case, model = read.load_cases[0], exugear.build(read.gearbox)
    print(statics(model, case).to_string(float_format="%.5g"))
    run = exugear.run_up(model, speed=(300 * rpm, case.speed), load=case.load, duration=0.1 if quick else 3.0)
    draw(folder / "rexs_gearbox.png", model, run)
    files = exugear.report(run, folder / "three_stage.html", model=model, title="Three-stage gearbox")
    print(exugear.resonances(run).to_dataframe())
    return model, run, files


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
