"""Figure of the conventions of `exugear`: senses of rotation, positions on a shaft, sign of DTE and mesh force.

python examples/figures/exugear_conventions.py examples/figures
"""

import sys
from pathlib import Path

import numpy as np
from fem_conventions import GREY, LINE, PINION, WHEEL, WHITE, arrow
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle
from palette import save_small

import exugear
from fem.units import um


def turn(ax, centre, radius: float, sense: int, color) -> None:
    """Arrow about a centre, counter-clockwise for sense > 0."""
    ends = np.radians([60, 120][::sense])
    start, end = (np.array(centre) + radius * np.array([np.cos(t), np.sin(t)]) for t in ends)
    arrow(ax, start, end, color=color, connectionstyle=f"arc3,rad={0.3 * sense}")


def draw_train(ax) -> None:
    """Two stages seen from +z, with the angle of the second."""
    radii, angle = (1.0, 1.7, 0.8, 1.4), np.radians(50)
    first = np.array([radii[0] + radii[1], 0.0])
    second = first + (radii[2] + radii[3]) * np.array([np.cos(angle), np.sin(angle)])
    wheels = (
        ((0, 0), radii[0], PINION),
        (first, radii[1], WHEEL),
        (first, radii[2], PINION),
        (second, radii[3], WHEEL),
    )
    for centre, radius, color in wheels:
        ax.add_patch(Circle(centre, radius, facecolor=color, edgecolor="0.3", alpha=0.8))
    for centre, radius, sense in (((0, 0), 0.75, 1), (first, 1.35, -1), (second, 1.05, 1)):
        turn(ax, centre, radius, sense, LINE)
    arrow(ax, (0, 0), (1.9, 0))
    arrow(ax, (0, 0), (0, 1.9))
    ax.text(1.45, -0.42, "x")
    ax.text(0.1, 1.8, "y")
    ax.plot(0, 0, "o", ms=8, mfc="w", mec="k")
    ax.plot(0, 0, ".", ms=4, color="k")
    ax.text(-0.35, -0.35, "z")
    ax.plot([first[0], first[0] + 3.2], [0, 0], color=GREY, lw=0.8)
    ax.plot(*np.transpose([first, second]), color=GREY, lw=0.8)
    ax.add_patch(Arc(first, 5.0, 5.0, theta1=0, theta2=50, color=GREY))
    ax.text(first[0] + 2.75, 0.62, "angle of\nthe stage", color=GREY, va="center", bbox=WHITE)
    ax.text(0, -1.3, "fast: speed\nimposed", ha="center", va="top")
    ax.text(first[0], -2.0, "middle", ha="center", va="top")
    ax.text(second[0], second[1] + 1.5, "slow: load against\nits motion", ha="center")
    ax.set(aspect="equal", xlim=(-1.5, 7.4), ylim=(-2.8, 4.4), title="Gearbox, seen from +z")
    ax.axis("off")


def draw_shaft(ax) -> None:
    """A shaft from the side: parts at axial positions, and its displacement as mounted."""
    ax.add_patch(Rectangle((0, -0.12), 6, 0.24, facecolor="0.85", edgecolor="0.3"))
    ax.add_patch(Rectangle((2.0, -1.2), 1.1, 2.4, facecolor=WHEEL, edgecolor="0.3"))
    for z, name in ((0.5, "Bearing"), (5.0, "Bearing")):
        for y in (-0.42, 0.42):
            ax.add_patch(Circle((z, y), 0.25, facecolor="w", edgecolor="0.3"))
        ax.text(z, -1.0, name, ha="center")
        ax.text(z, -1.4, f"{z * 20:.0f} mm", ha="center", color=GREY)
    ax.text(2.55, -1.6, "Gear", ha="center")
    ax.text(2.55, -2.0, "51 mm", ha="center", color=GREY)
    arrow(ax, (0, 0), (7.0, 0))
    ax.text(7.1, 0, "z", va="center")
    arrow(ax, (0, 0), (0, 1.7))
    ax.text(0, 1.85, "y", ha="center")
    gear, slope = 2.55, -0.24
    ax.plot([-0.5, 6.5], [slope * (z - gear) for z in (-0.5, 6.5)], "-.", color=LINE, lw=1.2)
    ax.plot(gear, 0, "o", color=LINE, ms=4)
    ax.annotate(
        "Placement(tilt_x > 0, pivot=51 mm):\nthe shaft turns about +x at the gear",
        (1.3, slope * (1.3 - gear)),
        (1.0, 2.1),
        color=LINE,
        va="center",
        arrowprops={"arrowstyle": "-", "color": LINE, "lw": 0.8},
    )
    ax.set(aspect="equal", xlim=(-0.6, 7.4), ylim=(-2.4, 2.8), title="Shaft: axial position → part")
    ax.axis("off")


def draw_force(ax) -> None:
    """Mesh force over DTE of a law with backlash."""
    law = exugear.MeshForce([0.0], np.array([0, 30 * um]), np.array([[0, 6e3]]), backlash=20 * um)
    dte = np.linspace(-42, 24, 400) * um
    ax.axhline(0, color=GREY, lw=0.8)
    ax.axvline(0, color=GREY, lw=0.8)
    ax.plot(dte / um, law(0.0, dte) / 1e3, color=LINE, lw=2)
    ax.annotate("", (-20, 0.7), (0, 0.7), arrowprops={"arrowstyle": "<->"})
    ax.text(-10, 0.9, "backlash", ha="center")
    ax.text(4, 4.3, "driving flank", ha="right")
    ax.text(-24, -4.0, "coast flank", ha="left")
    ax.set(
        xlabel="DTE [µm], > 0: the pinion leads", ylabel="mesh force [kN]", title="mesh force of a law with backlash"
    )


def draw() -> Figure:
    with rc_context({"font.size": 9, "axes.titlesize": 10, "figure.constrained_layout.use": True}):
        figure = Figure(figsize=(9.6, 3.4))
        panels = figure.add_gridspec(1, 3, width_ratios=(1.1, 1.15, 0.9))
        for i, panel in enumerate((draw_train, draw_shaft, draw_force)):
            panel(figure.add_subplot(panels[i]))
        return figure


if __name__ == "__main__":
    save_small(draw(), Path(sys.argv[1]) / "exugear_conventions.png")
