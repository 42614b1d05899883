"""Figure of `benchmark.py`: error over time, growth with the scene, time of a contact state, run-ups in parts.

    PYTHONPATH=examples python tests/benchmarks/benchmark_figure.py results

draws it again from the numbers in results/benchmark.json.
"""

import json
from pathlib import Path

import numpy as np
from benchmark_growth import exponent
from benchmark_points import Points
from command_line import command_line
from cycler import cycler
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from exugear import plots

#: Implicit static and explicit dynamic STE, run-up of the paper [s].
PAPER = {"implicit FE": 150 * 60.0, "explicit FE": 3330 * 60.0, "run-up": 36 * 60.0}
#: Ten colours, so that no two lines of a panel share one: those of plots, then black and shades of grey and brown.
COLOURS = (*plots.DISTINCT, "#000000", "#56B4E9", "#8C564B", "#7F7F7F", "#B8860B")
#: matplotlib's settings for letters that are 9 pt high where the figure is printed 18 cm wide.
STYLE = {
    "font.size": 9,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.grid": True,
    "grid.color": "0.88",
    "axes.axisbelow": True,
}


def mark_times(ax, seconds: dict[str, float]) -> None:
    """Dotted lines at the times of yardsticks."""
    frame = ax.get_xaxis_transform()
    for name, at in seconds.items():
        ax.axvline(at, color="0.6", ls=":")
        ax.text(at, 0.02, name, rotation=90, fontsize=8, ha="right", transform=frame)


def draw_growth(ax, grown: dict) -> None:
    """Time over size, both over the smallest."""
    for name, (sizes, times) in grown.items():
        label = f"{name}: {exponent(sizes, times):.2f}"
        ax.loglog(np.array(sizes) / sizes[0], np.array(times) / times[0], "o-", ms=5, label=label)
    ax.set(xlabel="size over the smallest", ylabel="time over the smallest")
    ax.set_yticks([1, 2, 4, 8], ["1", "2", "4", "8"])
    ax.minorticks_off()


def draw_states(ax, times: dict[str, dict[str, list[float]]]) -> None:
    """Times of a state by kind of gear, each mode a colour; those of the old code as hollow circles."""
    rows = np.arange(len(times))
    for i, mode in enumerate(next(iter(times.values()))):
        new, old = np.array([row[mode] for row in times.values()]).T
        ax.hlines(rows + 0.2 * (i - 1), new, old, color=f"C{i}", lw=1)
        ax.plot(new, rows + 0.2 * (i - 1), f"C{i}o", ms=5, label=mode)
        ax.plot(old, rows + 0.2 * (i - 1), f"C{i}o", ms=5, mfc="w")
    ax.set_yticks(rows, list(times))
    label = "time of a state [ms]; hollow: before\ncontacts were compiled"
    ax.set(xscale="log", xlabel=label, ylim=(len(times) + 0.7, -0.5))
    ax.legend(loc="lower right", fontsize=8, labelspacing=0.15)


def draw_parts(ax, rows: dict[str, dict[str, list[float]]]) -> None:
    """Time of a 70 s run-up over the processes: by the model as lines, measured as crosses."""
    for i, (name, row) in enumerate(rows.items()):
        ax.plot(row["processes"], row["model"], f"C{i}o-", ms=4, label=f"{name}, model")
        ax.plot([1, 2], row["measured"], f"C{i}x", ms=9, mew=2, label=f"{name}, measured")
    ax.set(xscale="log", yscale="log", xlabel="processes", ylabel="processor time of a 70 s run-up [s]")
    ax.set_xticks(row["processes"], [str(n) for n in row["processes"]])
    ax.set_yticks([0.5, 1, 2, 5], ["0.5", "1", "2", "5"])
    ax.minorticks_off()
    ax.legend(fontsize=8, labelspacing=0.15)


def draw_legends(ax, panels: dict) -> None:
    """Legends of panels, one below the other, in place of a panel."""
    ax.axis("off")
    top = 1.0
    for title, panel in panels.items():
        handles, labels = panel.get_legend_handles_labels()
        options = {
            "loc": "upper left",
            "fontsize": 8,
            "labelspacing": 0.1,
            "borderpad": 0,
            "alignment": "left",
            "frameon": False,
        }
        ax.add_artist(Legend(ax, handles, labels, title=title, bbox_to_anchor=(0, top), **options))
        top -= (len(labels) + 1.7) / 21


def draw(path: Path, numbers: dict) -> None:
    """All panels from the numbers of `benchmark.main`."""
    ste, runs, floor = Points(numbers["STE"]), Points(numbers["run-up"]), numbers["70 s in equal steps"]
    with rc_context(STYLE):
        figure = Figure(figsize=(7.1, 9.6), layout="constrained")
        upper, beside, lower, legends, states, parts = figure.subplots(3, 2).flat
        ste.draw(upper)
        mark_times(upper, {f"paper, {name}": PAPER[name] for name in ("implicit FE", "explicit FE")})
        upper.set(xlabel="processor time of 30 phases, cold [s]", ylabel="error of the STE [% of its mean]")
        runs.draw(beside)
        mark_times(beside, {name: x for name, x in (floor | {"paper": PAPER["run-up"]}).items() if name != "exugear"})
        beside.set(xlabel="processor time of a 70 s run-up [s]", ylabel="error of the rms of the DTE [%], median")
        draw_growth(lower, numbers["growth"])
        draw_legends(legends, {"A  STE": upper, "B  run-up": beside, "C  growth, exponent": lower})
        draw_states(states, numbers["states"])
        draw_parts(parts, numbers["parts"])
        for letter, ax in zip("ABCDE", (upper, beside, lower, states, parts), strict=True):
            ax.set_title(letter, loc="left", fontweight="bold")
        figure.savefig(path, dpi=200)


if __name__ == "__main__":
    folder = command_line(__doc__).parse_args().folder
    draw(folder / "benchmark.png", json.loads((folder / "benchmark.json").read_text(encoding="utf-8")))
