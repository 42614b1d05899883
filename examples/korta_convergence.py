"""The paper's Figure 4: static transmission error at 350 N m against element size, by nonlinear finite elements.

python examples/korta_convergence.py results
"""

import argparse
import time
from pathlib import Path

import numpy as np
from korta_run_up import paper_pair
from skfem import ElementQuad1, ElementQuad2
from skfem.element import Element

import fem
from exugear import plots
from fem import nonlinear
from fem.elasticity.mesh_density import Density
from fem.elasticity.section_mesh import flank_arcs
from fem.units import mm, um

TORQUE = 350.0
PHASES = np.arange(16) / 30
MESHES = (
    (Density(flank=16), ElementQuad1()),
    (Density(flank=30), ElementQuad1()),
    (Density(flank=30).refined(2), ElementQuad1()),
    (Density(flank=30).refined(4), ElementQuad1()),
    (Density(flank=44).refined(2), ElementQuad2()),
)


def element_size(gear: fem.Gear, density: Density) -> float:
    """Mean length of the elements along the flank [m]."""
    return float(np.diff(flank_arcs(gear, density.flank, density.divide)).mean())


def compute(pair: fem.GearPair, density: Density, element: Element) -> tuple[np.ndarray, float]:
    """Transmission error (30,) [m] over a pitch, by symmetry of like gears out of 16 phases, and wall time [s]."""
    start = time.perf_counter()
    ste = nonlinear.static_transmission_error(pair, TORQUE, PHASES, density=density, element=element, progress=False)
    half = ste["te"].values[0]
    return np.append(half, half[-2:0:-1]), time.perf_counter() - start


def draw(path: Path, curves: dict[str, np.ndarray], table: list[tuple[str, float, float, float]]) -> None:
    """STE over phase for each mesh, and its wall time."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    for name, te in curves.items():
        left.plot(np.linspace(0, 1, te.size + 1), np.append(te, te[0]) / um, label=name)
    left.set(xlabel="phase of the mesh cycle [pitches]", ylabel="static transmission error [µm]")
    left.legend(frameon=False)
    bars = right.barh([row[0] for row in table], [row[3] for row in table])
    right.bar_label(bars, fmt="%.3g s", padding=3)
    right.invert_yaxis()
    right.set(xlabel="wall time of 16 phases [s]")
    right.margins(x=0.1)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure")
    folder, pair = parser.parse_args().folder, paper_pair()
    folder.mkdir(parents=True, exist_ok=True)
    curves, table = {}, []
    for density, element in MESHES:
        degree = "linear" if element.maxdeg == 2 else "quadratic"
        name = f"{element_size(pair.pinion, density) / mm:.3f} mm, {degree}"
        curves[name], seconds = compute(pair, density, element)
        table.append((name, curves[name].mean() / um, np.ptp(curves[name]) / um, seconds))
        print("{:24s} mean {:7.3f} um   peak to peak {:6.3f} um {:8.1f} s".format(*table[-1]), flush=True)
    draw(folder / "korta_convergence.png", curves, table)


if __name__ == "__main__":
    main()
