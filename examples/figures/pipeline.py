"""Figure of the pipeline: mesh, contact, STE map, mesh force, run-up, each drawn from what it computes.

python examples/figures/pipeline.py examples/figures
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from palette import save_small

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

sys.path.insert(0, str(Path(__file__).parents[1]))
from korta_pair import gearbox, paper_pair

TORQUES = (0, 5, 20, 50, 150, 350, 700, 1500)


def draw_mesh(ax, pair: fem.GearPair) -> None:
    mesh = fem.section(pair.pinion, fem.Resolution().density.paired())
    plots.plot_section(mesh.p, mesh.t, ax, height=11 * mm)
    top = pair.pinion.r_a / mm
    ax.set(xlabel="", ylabel="", xticks=[], yticks=[], xlim=(-5, 5), ylim=(top - 11, top + 0.5))


def draw_contact(ax, ste) -> None:
    """Shares of the load on the tooth pairs that carry any."""
    phase = np.append(ste["phase"], 1.0)
    shares = ste["load_share"].sel(torque=350)
    carrying = shares["pair"].values[shares.max("phase") > 0]
    for pair, colour in zip(carrying, plots.DISTINCT, strict=False):
        share = shares.sel(pair=pair).values
        ax.plot(phase, np.append(share, np.nan), color=colour)
        x, side = (0.2, "left") if share[0] > 0.5 else (0.8, "right")
        ax.text(x, 0.94, f"tooth\npair {pair}", color=colour, ha=side, va="center")
    ax.set(xlabel="phase", ylabel="load share", xticks=[0, 0.5, 1], ylim=(0, 1.05))


def draw_map(ax, ste) -> None:
    for torque in (50, 150, 350):
        ax.plot(ste["phase"], ste["te"].sel(torque=torque) / um, color=plots.DISTINCT[0])
        ax.text(0.5, float(ste["te"].sel(torque=torque)[0]) / um, f"{torque} N m", ha="center", va="center", fontsize=8)
    ax.set(xlabel="phase", ylabel="te [µm]", xticks=[0, 0.5, 1], ylim=(0, None))


def draw_law(ax, force: exugear.MeshForce) -> None:
    deflection = np.linspace(-5, 20, 200) * um
    for phase, side in ((0.0, "top"), (0.5, "bottom")):
        ax.plot(deflection / um, force(phase, deflection) / 1e3, color=plots.DISTINCT[side == "bottom"])
        ax.text(20, force(phase, 20 * um) / 1e3 - 2.6 * (side == "top"), f"phase {phase:g}", ha="right", va=side)
    ax.set(xlabel="deflection [µm]", ylabel="force [kN]", ylim=(-0.5, 8))


def draw_run(ax, run: exugear.Run) -> None:
    plots.plot_run_up(run, ax)
    ax.set(title="", xlabel="mesh frequency [Hz]", ylabel="DTE [µm]", xticks=[0, 1500, 3000])


def draw() -> Figure:
    pair = paper_pair()
    ste = fem.static_transmission_error(pair, TORQUES, 60, progress=False)
    box = gearbox(ste)
    run = exugear.run_up(exugear.build(box), speed=(0, 3500 * rpm), duration=14.0, load=350.0, progress=False)
    panels = {
        "elasticity": (draw_mesh, pair, "finite elements,\nonce per gear"),
        "contact": (draw_contact, ste, "gap + compliance:\nactive set"),
        "STE map": (draw_map, ste, "te over torque,\noffsets, phase"),
        "mesh force": (draw_law, box.stages[0].force, "the map inverted:\nF(phase, deflection)"),
        "run": (draw_run, run, "Exudyn: DTE,\nbearing forces"),
    }
    with rc_context({"font.size": 8, "figure.constrained_layout.use": True}):
        figure = Figure(figsize=(9.6, 2.7))
        for i, (name, (panel, data, text)) in enumerate(panels.items(), start=1):
            ax = figure.add_subplot(1, len(panels), i)
            panel(ax, data)
            bold = name.replace(" ", r"\ ")
            ax.set_title(rf"{'→ ' * (i > 1)}$\bf{{{bold}}}$" + f"\n{text}", fontsize=9)
        return figure


if __name__ == "__main__":
    save_small(draw(), Path(sys.argv[1]) / "pipeline.png")
