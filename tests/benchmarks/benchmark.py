"""Run time against error: STE by several methods, run-ups by step, integrator and reduction, growth with the scene.

    PYTHONPATH=examples python tests/benchmarks/benchmark.py results     (4 minutes on two cores; --quick: 1)

Every error is against a run that is several times finer. Every time stands beside yardsticks: a compiled loop without
Exudyn, Exudyn with a built-in spring instead of the mesh, Exudyn's own bodies and bearings without gears, and the times
that the paper states. Contact states stand beside those before contacts were compiled, run-ups in parts beside a model.
"""

import json
import resource
from pathlib import Path

import exudyn as exu
from benchmark_designs import designs
from benchmark_figure import draw
from benchmark_growth import exponent, growth, yardsticks
from benchmark_parts import parts
from benchmark_run_up import paper_gearbox, run_up_points
from benchmark_states import states
from benchmark_ste import ste_points
from benchmark_steps import steps
from benchmark_unlike_teeth import unlike_teeth
from benchmark_variants import variants
from command_line import command_line


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
    numbers |= {"steps": steps(box, quick), "parts": parts(box, quick), "states": states(quick)}
    numbers |= {"variants": variants(quick), "unlike teeth": unlike_teeth(quick), "designs": designs(quick)}
    numbers["memory [GB]"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"memory {numbers['memory [GB]']:.2f} GB")
    (folder / "benchmark.json").write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    draw(folder / "benchmark.png", numbers)
    return numbers


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
