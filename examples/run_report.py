"""The report of a run: the two-stage helical gearbox of `two_stage_helical.py` as a page for a customer.

    python examples/run_report.py results

One HTML file with all figures inside: results with resonances, dynamic factors and bearing forces; vibration modes and
a Campbell diagram; data sheets of gears, shafts and bearings; assumptions, and what the plan skipped; error estimates
and versions. A browser on the machine prints it to PDF.
"""

from pathlib import Path

import two_stage_helical
from command_line import command_line

import exugear
from exugear import plots

TITLE = "Two-stage helical gearbox"


def solve(phases: int, duration: float) -> tuple[exugear.Model, exugear.Run]:
    """The gearbox and its run-up, with the powers."""
    box = two_stage_helical.gearbox(two_stage_helical.laws(phases), two_stage_helical.pairs())
    conditions = {"speed": two_stage_helical.SPEED, "duration": duration, "load": two_stage_helical.LOAD}
    model = exugear.build(box)
    return model, exugear.run_up(model, **conditions, power=True)


def draw(path: Path, model: exugear.Model, run: exugear.Run) -> None:
    """Four of the figures of the report, at a size at which they can be read."""
    figure = plots.figure(rows=2, columns=2)
    swept, bearings, diagram, losses = figure.axes
    plots.plot_run_up(run, swept)
    plots.plot_bearing_forces(run, bearings)
    highest = float(run.data["speed"].max())
    plots.plot_campbell(exugear.campbell(model, load=two_stage_helical.LOAD, speed=(0.0, highest)), diagram)
    plots.plot_power(run, losses)
    for ax in (bearings, diagram, losses):
        beside = ax.get_legend()
        words = [text.get_text() for text in beside.get_texts()]
        ax.legend(beside.legend_handles, words, loc="upper left", fontsize=9, framealpha=0.9)
    for letter, ax in zip("ABCD", (swept, bearings, diagram, losses), strict=True):
        ax.set_title(f"{letter}  {ax.get_title()}", loc="left")
        ax.set_title("", loc="center")
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> tuple[exugear.Run, list[Path]]:
    """The run, and the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    model, run = solve(12, 0.1) if quick else solve(24, 4.0)
    files = exugear.report(run, folder / "two_stage_helical.html", model=model, title=TITLE)
    draw(folder / "run_report.png", model, run)
    print(run.energy_balance())
    for path in files:
        print(f"{path}, {path.stat().st_size / 1e3:.0f} kB")
    return run, files


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
