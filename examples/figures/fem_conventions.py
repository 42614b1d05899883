"""Figure of the conventions of `fem`: axes, flanks, signs of te and of the offsets, hand, phase 0.

python examples/figures/fem_conventions.py examples/figures
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from palette import save_small

import fem
from exugear import graphics
from fem.units import mm

PINION, WHEEL, LINE, GREY = "#c6dbef", "#fdd0a2", "#cb181d", "0.35"
WHITE = {"boxstyle": "round,pad=0.15", "facecolor": "w", "edgecolor": "none", "alpha": 0.85}


def pair() -> fem.GearPair:
    pinion, wheel = (fem.Gear(z=z, m_n=4 * mm, b=30 * mm, d_bore=20 * mm) for z in (18, 24))
    return fem.GearPair(pinion, wheel, a=84.4 * mm)


def outline(gear: fem.Gear, angle: float) -> np.ndarray:
    """Closed outline of a gear [mm] as complex numbers, tooth 0 at an angle [rad]."""
    x, y = graphics.gear_outline(gear, phase_angle=angle, points_per_tooth=40) / mm
    return x + 1j * y


def arrow(ax, start, end, color="k", **options) -> None:
    style = {"arrowstyle": "-|>", "mutation_scale": 11, "color": color, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    ax.add_patch(FancyArrowPatch(start, end, **(style | options)))


def draw_gears(ax, gears: fem.GearPair, pinion_lead: float = 0.0) -> None:
    """Both gears at phase 0, the pinion ahead by an angle [rad]."""
    angles = graphics.meshing_angles(gears)
    for gear, centre, angle, color in (
        (gears.pinion, 0, angles[0] + pinion_lead, PINION),
        (gears.wheel, gears.a / mm, angles[1], WHEEL),
    ):
        points = centre + outline(gear, angle)
        ax.fill(points.real, points.imag, facecolor=color, edgecolor="0.3", lw=0.8, alpha=0.75)


def draw_section(ax, gears: fem.GearPair) -> None:
    """Transverse section seen from +z: axes, sense of rotation, line of action, flanks."""
    draw_gears(ax, gears)
    alpha, r_b, a = gears.alpha_wt, gears.pinion.r_b / mm, gears.a / mm
    r_w = r_b / np.cos(alpha)
    normal = np.array([np.sin(alpha), np.cos(alpha)])
    ends = [np.array([r_w, 0]) + s * normal for s in (-r_w * np.sin(alpha), (a - r_w) * np.sin(alpha))]
    ax.plot(*np.transpose(ends), color=LINE, lw=1.4)
    for centre, radius, turn in (
        (0, r_b, np.linspace(-1, 1, 60)),
        (a, gears.wheel.r_b / mm, np.linspace(2.4, 3.9, 60)),
    ):
        ax.plot(centre + radius * np.cos(turn), radius * np.sin(turn), ":", color=GREY, lw=1)
    ax.plot(r_w, 0, "o", color=LINE, ms=4)
    for start, end, name in (((0, 0), (13, 0), "x"), ((0, 0), (0, 13), "y")):
        arrow(ax, start, end)
        ax.text(*(1.22 * np.array(end)), name, ha="center", va="center")
    ax.plot(0, 0, "o", ms=8, mfc="w", mec="k")
    ax.plot(0, 0, ".", ms=4, color="k")
    ax.text(-2.5, -6, "z", ha="center")
    arrow(ax, (-7, 24), (-22, 12), connectionstyle="arc3,rad=0.25", color="#08519c")
    ax.text(-10, 14, "drives", color="#08519c", ha="center")
    arrow(ax, (a - 8, 25), (a + 4, 24), connectionstyle="arc3,rad=-0.15", color="#a63603")
    arrow(ax, (r_w, 0), tuple(np.array([r_w, 0]) + 12 * normal), color=LINE, linewidth=2)
    notes = {
        "force on the wheel": ((r_w, 0) + 9 * normal, (4, 44), LINE),
        "line of action": (ends[0], (42, -36), LINE),
        "base circles": ((a - 37, -25.8), (a - 18, -38), GREY),
        "C": ((r_w, 0), (r_w - 9, -1.5), LINE),
    }
    for text, (point, position, color) in notes.items():
        line = {"arrowstyle": "-", "color": color, "lw": 0.8}
        ax.annotate(text, point, position, color=color, va="center", arrowprops=line, bbox=WHITE)
    ax.text(-6, -20, "pinion\nat the origin", ha="center", va="center")
    ax.text(a - 10, 8, "wheel at x = a", ha="center", va="center")
    ax.set(
        aspect="equal", xlim=(-42, a + 8), ylim=(-43, 49), xticks=[], yticks=[], title="section seen from +z, phase 0"
    )


def draw_te(ax, gears: fem.GearPair) -> None:
    """Flanks at the pitch point, with the pinion ahead (exaggerated): they overlap by te before they deflect."""
    draw_gears(ax, gears, pinion_lead=0.035)
    alpha, r_w = gears.alpha_wt, gears.pinion.r_b / np.cos(gears.alpha_wt) / mm
    normal = np.array([np.sin(alpha), np.cos(alpha)])
    centre = np.array([r_w, 0])
    ax.plot(*np.transpose([centre - 6 * normal, centre + 6 * normal]), color=LINE, lw=1, ls="--")
    arrow(ax, centre, centre + 0.035 * gears.pinion.r_b / mm * normal, color=LINE, linewidth=2)
    ax.text(r_w + 1.2, 0.4, "te", color=LINE, va="center", ha="left", weight="bold")
    note = {"arrowprops": {"arrowstyle": "-", "color": "k", "lw": 0.8}, "bbox": WHITE, "va": "center"}
    ax.annotate("left flank\nof the pinion", (r_w - 1.9, 0.7), (r_w - 4.6, 5.4), **note)
    ax.annotate("left flank\nof the wheel", (r_w + 2.3, -0.55), (r_w + 0.9, -5.2), **note)
    ax.text(
        r_w, 8.2, r"te = $r_{b1}\varphi_1 + r_{b2}\varphi_2$, $\varphi$ about +z", ha="center", va="top", bbox=WHITE
    )
    ax.set(aspect="equal", xlim=(r_w - 5, r_w + 5), ylim=(-6.5, 8.5), xticks=[], yticks=[])
    ax.set_title("te > 0: the pinion leads")


def draw_phase(ax, gears: fem.GearPair) -> None:
    """Contact points of tooth pairs on the path of contact at three phases."""
    p_bt = gears.p_bt
    start, end = ((roll - gears.roll_pitch) / p_bt for roll in (gears.roll_start, gears.roll_end))
    for i, phase in enumerate((0.0, 0.25, 0.5, 0.75)):
        ax.plot((start, end), (-i, -i), color=LINE, lw=1.2)
        for k in (-1, 0, 1):
            if start <= k + phase <= end:
                ax.plot(k + phase, -i, "o", color="#08519c", ms=6)
                ax.annotate(f"pair {k}", (k + phase, -i), (0, 6), textcoords="offset points", ha="center")
    ax.axvline(0, color=GREY, lw=0.8, ls=":")
    ax.text(0.02, -3.62, "C", color=GREY)
    ax.set(yticks=[0, -1, -2, -3], yticklabels=["0", "0.25", "0.5", "0.75"], ylabel="phase")
    ax.set(xlabel="roll length beyond C [base pitches]", title="phase")
    ax.set(xlim=(start - 0.12, end + 0.12), ylim=(-3.7, 0.6))


def bare(ax, title: str) -> None:
    ax.set(title=title, aspect="equal", xlim=(-1.75, 1.75), ylim=(-1.25, 1.35))
    ax.axis("off")


def draw_misalignment(ax) -> None:
    """Plane of action: axial direction to the right, normal of the flanks upwards."""
    z = np.array([-1.2, 1.2])
    ax.fill_between(z, -0.75, -0.1, color=PINION, ec="0.3")
    ax.fill_between(z, 0.25 + 0.17 * z, 0.9, color=WHEEL, ec="0.3")
    ax.text(0, -0.45, "pinion", ha="center", va="center")
    ax.text(-0.2, 0.62, "wheel", ha="center", va="center")
    arrow(ax, (1.35, -0.1), (1.35, 0.45), color=LINE, arrowstyle="<|-|>")
    ax.text(1.43, 0.17, "gap", color=LINE, va="center")
    arrow(ax, (-1.2, -1.0), (-0.2, -1.0))
    ax.text(-0.12, -1.0, "z", va="center")
    bare(ax, "misalignment > 0:\nthe gap opens towards +z")


def draw_parallelism(ax) -> None:
    """Axes of both gears over z, in the plane of the axes (left) and across it (right)."""
    errors = (-0.85, r"$f_{\Sigma\delta}$ > 0", "x"), (0.85, r"$f_{\Sigma\beta}$ > 0", "y")
    for x, name, direction in errors:
        ax.plot((x - 0.3, x - 0.3), (-0.75, 0.75), "-.", color="#08519c", lw=1.4)
        ax.plot((x + 0.1, x + 0.45), (-0.75, 0.75), "-.", color="#a63603", lw=1.4)
        ax.plot((x + 0.1, x + 0.1), (-0.75, 0.75), ":", color=GREY, lw=0.8)
        ax.text(x + 0.1, 0.88, name, ha="center")
        arrow(ax, (x - 0.7, -0.9), (x - 0.7, -0.4))
        ax.text(x - 0.7, -0.3, "z", ha="center")
        arrow(ax, (x - 0.7, -0.9), (x - 0.25, -0.9))
        ax.text(x - 0.18, -0.92, direction, va="center")
    ax.text(-1.22, 0.35, "pinion", color="#08519c", rotation=90, ha="right", va="center")
    ax.text(-0.42, 0.0, "wheel", color="#a63603", rotation=75, ha="left", va="center")
    bare(ax, "axes of pinion and wheel")


def draw_hand(ax) -> None:
    """Cylinder of a right-hand gear seen from +x."""
    ax.fill_between((-1.0, 1.0), -0.7, 0.7, color=PINION, ec="0.3")
    for y in np.linspace(-0.85, 0.55, 6):
        ax.plot((y, y + 0.4), (-0.7, 0.7), color="0.3", lw=1.2, clip_on=True)
    arrow(ax, (-1.4, -0.9), (-1.4, -0.2))
    ax.text(-1.4, -0.05, "z", ha="center")
    arrow(ax, (-1.4, -0.9), (-0.8, -0.9))
    ax.text(-0.7, -0.92, "y", va="center")
    ax.text(0.0, 0.9, "seen from +x", ha="center", va="center")
    bare(ax, r"$\beta$ > 0: right-hand pinion")


def draw() -> Figure:
    with rc_context({"font.size": 9, "axes.titlesize": 10, "figure.constrained_layout.use": True}):
        figure, gears = Figure(figsize=(9.6, 7.6)), pair()
        upper, lower = figure.add_gridspec(2, 1, height_ratios=(1.5, 1))
        upper, lower = (
            upper.subgridspec(1, 2, width_ratios=(1.75, 1)),
            lower.subgridspec(1, 4, width_ratios=(1.25, 1, 1.1, 1)),
        )
        draw_section(figure.add_subplot(upper[0]), gears)
        draw_te(figure.add_subplot(upper[1]), gears)
        draw_phase(figure.add_subplot(lower[0]), gears)
        for cell, panel in zip((1, 2, 3), (draw_misalignment, draw_parallelism, draw_hand), strict=True):
            panel(figure.add_subplot(lower[cell]))
        return figure


if __name__ == "__main__":
    save_small(draw(), Path(sys.argv[1]) / "fem_conventions.png")
