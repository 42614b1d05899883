"""A measured table instead of finite elements: deflections of a mesh from a CSV file become its force law.

    python examples/measured_table.py results [table.csv]

The columns: phase [pitches], force [N], deflection [µm] along the line of action, on a full grid. Without a file of
yours the example writes a SYNTHETIC one by a formula: the mesh stiffness per width of ISO 6336-1, 20 N/(mm µm), that
varies by 8 % over the mesh cycle, softer at light loads, read off to 0.1 µm. No finite elements are solved.
"""

from math import pi, sqrt
from pathlib import Path

import numpy as np
import pandas as pd
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

LOAD, DAMPING_RATIO, SPEED = 300.0, 0.08, (500 * rpm, 6500 * rpm)
PAIR = fem.GearPair(*(fem.Gear(z=z, m_n=3 * mm, b=25 * mm, d_bore=30 * mm) for z in (31, 47)), a=117.1 * mm)
COLUMNS = ("phase", "force_N", "deflection_um")


def synthetic_measurement() -> pd.DataFrame:
    """Deflections at 12 phases under 8 forces, by a formula."""
    grid = pd.MultiIndex.from_product([np.arange(12) / 12, (0, 200, 500, 1000, 2000, 4000, 8000, 16000)])
    phase, force = (grid.get_level_values(i).to_numpy(float) for i in (0, 1))
    stiffness = 20e9 * PAIR.b * (1 + 0.08 * np.cos(2 * pi * phase) + 0.03 * np.cos(4 * pi * phase))
    deflection = force / stiffness + 1 * um * force / (force + 1000)
    return pd.DataFrame(dict(zip(COLUMNS, (phase, force, (deflection / um).round(1)), strict=True)))


def law_of(table: pd.DataFrame) -> exugear.MeshForce:
    """The force law that interpolates a table of measured deflections."""
    deflection = table.pivot(index="phase", columns="force_N", values="deflection_um") * um
    force = np.broadcast_to(deflection.columns.to_numpy(float), deflection.shape)
    return exugear.MeshForce(deflection.index.to_numpy(), deflection.to_numpy(), force, backlash=PAIR.backlash)


def gearbox(law: exugear.MeshForce) -> exugear.Gearbox:
    """Two shafts that only spin."""
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("motor", PAIR.pinion), ("brake", PAIR.wheel))]
    return exugear.Gearbox([exugear.Stage(*shafts, law, pair=PAIR, damping_ratio=DAMPING_RATIO)])


def expected_resonance(box: exugear.Gearbox) -> float:
    """sqrt(k / m) / (2 pi) [Hz]: k at the load, mean over phase; m of the brake, as the speed is imposed."""
    law, force, h = box.stages[0].force, LOAD / PAIR.wheel.r_b, 1e-9
    phases = np.arange(64) / 64
    at_load = np.array([law.deflection_at(phase, force) for phase in phases])
    stiffness = (law(phases, at_load + h) - law(phases, at_load - h)) / (2 * h)
    return sqrt(stiffness.mean() / (box.driven.inertia / PAIR.wheel.r_b**2)) / (2 * pi)


def draw(path: Path, table: pd.DataFrame, law: exugear.MeshForce, run: exugear.Run, expected: float) -> None:
    """Measured points on the force law; the run-up."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    for phase in (0.0, 0.5):
        points = table[np.isclose(table["phase"], phase)]
        x = np.linspace(-2 * um, points["deflection_um"].max() * um, 200)
        (line,) = left.plot(x / um, law(phase, x) / 1e3, label=f"phase {phase:g}")
        left.plot(points["deflection_um"], points["force_N"] / 1e3, "o", color=line.get_color(), markersize=4)
    left.set(xlabel="deflection [µm]", ylabel="mesh force [kN]", title="points: synthetic measurement")
    left.legend(frameon=False)
    left.grid(alpha=0.3)
    plots.plot_run_up(run, right).axvline(expected, color="k", linestyle="--")
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False, source: Path | None = None) -> tuple[float, exugear.Run]:
    """Expected resonance [Hz] and the run-up."""
    folder.mkdir(parents=True, exist_ok=True)
    if source is None:
        source = folder / "synthetic_measurement.csv"
        synthetic_measurement().to_csv(source, index=False)
    table = pd.read_csv(source)
    box = gearbox(law_of(table))
    expected, model = expected_resonance(box), exugear.build(box)
    run = exugear.run_up(model, speed=SPEED, duration=1.0 if quick else 5.0, load=LOAD, progress=False)
    draw(folder / "measured_table.png", table, box.stages[0].force, run, expected)
    outline = exugear.dte_envelope(run)
    resonance = outline.abscissa[np.argmax(outline.amplitude)]
    print(f"resonance {resonance:.0f} Hz, sqrt(k / m) / (2 pi) = {expected:.0f} Hz")
    return expected, run


if __name__ == "__main__":
    parser = command_line(__doc__, "quick")
    parser.add_argument("source", type=Path, nargs="?", help="CSV file of the table; without it a synthetic one")
    main(**vars(parser.parse_args()))
