"""The contact element of the paper beside the law of the whole STE map, and beside its former form without a potential.

    python examples/korta_two_laws.py results            (--full: run-ups of 70 s, as in the paper, instead of 14 s)

The paper's element (Palermo et al. 2013) has the secant stiffness F / STE at the nominal torque. The law of the map
follows the STE over all torques, and derives force and torques from one potential. The former law has the same force
without the torque by which the potential changes over the phase. Pair, inertia and damping are the same: only the law
differs. Far from resonance all three agree. Where teeth part, the secant law differs.
"""

from functools import partial
from pathlib import Path

from command_line import command_line
from korta_pair import DURATION, MAP_PHASES, MAP_TORQUES, TORQUES, gearbox, paper_pair, resonance_table, run

import exugear
import fem
from exugear import plots


def laws(load: float) -> dict:
    """Functions (ste, damping=...) -> MeshForce for a run at a load [N m]."""
    return {
        "whole map": exugear.MeshForce.from_ste,
        "secant (paper)": partial(exugear.MeshForce.secant, torque=load),
        "without dU/dphase": partial(exugear.MeshForce.from_ste, conserves=False),
    }


def compute(ste, duration: float) -> dict[str, dict[float, exugear.Run]]:
    """Run-ups by law and load."""
    runs: dict[str, dict[float, exugear.Run]] = {}
    for load in TORQUES:
        for name, law_of in laws(load).items():
            print(f"{name}, {load:g} N m ...", flush=True)
            runs.setdefault(name, {})[load] = run(gearbox(ste, law_of=law_of), load, duration)
    return runs


def draw(runs: dict[str, dict[float, exugear.Run]], path: Path) -> None:
    """Envelopes of the DTE by law, a panel per load."""
    figure = plots.figure(columns=2)
    for ax, load in zip(figure.axes, TORQUES, strict=True):
        at_load = {name: by_load[load] for name, by_load in runs.items()}
        plots.plot_envelopes(at_load, ax).set_title(f"{load:g} N m")
    figure.savefig(path, dpi=100)


def main(folder: Path, full: bool = False) -> dict[str, dict[float, exugear.Run]]:
    folder.mkdir(parents=True, exist_ok=True)
    ste = fem.static_transmission_error(paper_pair(), MAP_TORQUES, MAP_PHASES)
    runs = compute(ste, DURATION if full else DURATION / 5)
    draw(runs, folder / "korta_two_laws.png")
    print(resonance_table(runs))
    for name, by_load in runs.items():
        largest = ", ".join(f"{float(r.data['dte'].max()) * 1e6:.1f} at {load:g} N m" for load, r in by_load.items())
        print(f"{name}: largest DTE [um] {largest}")
    return runs


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "full").parse_args()))
