"""Run time against error: STE by several methods, run-ups by step, integrator and reduction, growth with the scene.

    python examples/benchmark.py results            (a minute on two cores; --full: all points, 3 minutes)

Every error is against a run that is several times finer. Every time stands beside yardsticks: a compiled loop without
Exudyn, Exudyn with a built-in spring instead of the mesh, and the times that the paper states.
"""

import json
import sys
from pathlib import Path

import exudyn as exu
import numpy as np
from benchmark_growth import exponent, growth, yardsticks
from benchmark_points import Points
from benchmark_run_up import paper_gearbox, run_up_points
from benchmark_ste import ste_points
from benchmark_steps import steps
from matplotlib import rc_context

from exugear import plots

#: Implicit static and explicit dynamic STE, run-up of the paper [s].
PAPER = {"implicit FE": 150 * 60.0, "explicit FE": 3330 * 60.0, "run-up": 36 * 60.0}


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


def draw_legends(ax, panels: dict) -> None:
    """Legends of all panels, one below the other, in place of a panel."""
    ax.axis("off")
    top = 1.0
    for title, panel in panels.items():
        handles, labels = panel.get_legend_handles_labels()
        options = {"loc": "upper left", "labelspacing": 0.15, "borderpad": 0, "alignment": "left", "frameon": False}
        ax.add_artist(ax.legend(handles, labels, title=title, bbox_to_anchor=(0, top), **options))
        top -= (len(labels) + 1.3) / 19.5


def draw(path: Path, ste: Points, runs: Points, floor: dict[str, float], grown: dict) -> None:
    """Error over time of STE and run-up, and the growth; 9 pt where it is printed 18 cm wide."""
    with rc_context({"font.size": 9}):
        figure = plots.figure(rows=2, columns=2)
        figure.set_size_inches(7.1, 6.6)
        upper, beside, lower, legends = figure.axes
        ste.draw(upper)
        mark_times(upper, {f"paper, {name}": PAPER[name] for name in ("implicit FE", "explicit FE")})
        upper.set(xlabel="time of 30 phases, cold [s]", ylabel="error of the STE [% of its mean]")
        runs.draw(beside)
        mark_times(beside, {name: x for name, x in (floor | {"paper": PAPER["run-up"]}).items() if name != "exugear"})
        beside.set(xlabel="time of a 70 s run-up [s]", ylabel="error of the rms of the DTE [%], median")
        draw_growth(lower, grown)
        draw_legends(legends, {"STE": upper, "run-up": beside, "growth, exponent": lower})
        figure.savefig(path, dpi=200)


def main(folder: Path, quick: bool = False) -> dict:
    """Numbers as they stand in benchmark.json; the figure beside it."""
    exu.config.printToConsole = False
    folder.mkdir(parents=True, exist_ok=True)
    box = paper_gearbox()
    ste, runs = ste_points(quick), run_up_points(box, quick)
    floor, grown = yardsticks(box, 2.4e-5), growth(box, runs, quick)
    print({name: round(seconds, 2) for name, seconds in floor.items()})
    print({name: round(exponent(*rows), 2) for name, rows in grown.items()})
    numbers = {"STE": ste.rows, "run-up": runs.rows, "70 s in equal steps": floor, "growth": grown}
    numbers["steps"] = steps(box, quick)
    (folder / "benchmark.json").write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    draw(folder / "benchmark.png", ste, runs, floor, grown)
    return numbers


if __name__ == "__main__":
    main(Path(sys.argv[1]), quick="--full" not in sys.argv)
