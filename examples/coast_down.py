"""Coast-down: the motor lets go, drag slows the pair down, the DTE passes its resonances.

    python examples/coast_down.py results

Motor and fan have a constant and a viscous drag. The fan's is the larger: the rotor of the motor pushes it through the
mesh. With rigid teeth the speed is omega = (omega_0 + T / c) exp(-c t / J) - T / c, with the drag T + c omega and the
inertia J of both shafts; friction of the teeth adds a share of what the mesh transmits. Drags, inertia and damping are
chosen here.
"""

from pathlib import Path

import numpy as np
from command_line import command_line
from korta_pair import paper_pair

import exugear
import fem
from exugear import plots
from fem.units import rpm

SPEED, LAST, DAMPING_RATIO, FRICTION = 2800 * rpm, 300 * rpm, 0.05, 0.06
#: The motor's rotor; constant [N m] and viscous drag [N m s/rad] of each shaft.
ROTOR, DRAGS = exugear.Disc(mass=20.0, inertia=0.15, transverse=0.15), {"motor": (1.0, 2e-3), "fan": (25.0, 0.15)}
TORQUES = (0, 1, 5, 20, 50, 100, 200, 400)


def gearbox(ste) -> exugear.Gearbox:
    """The paper's pair between motor and fan."""
    pair = fem.pair_of(ste)
    motor = exugear.Shaft("motor", {0.0: [pair.pinion, ROTOR, exugear.Drag(*DRAGS["motor"])]})
    fan = exugear.Shaft("fan", {0.0: [pair.wheel, exugear.Drag(*DRAGS["fan"])]})
    rubbing = exugear.MeshFriction.from_ste(ste, FRICTION, torque=50.0)
    return exugear.Gearbox([exugear.Stage(motor, fan, ste, damping_ratio=DAMPING_RATIO, friction=rubbing)])


def rigid_speed(box: exugear.Gearbox, time: np.ndarray) -> np.ndarray:
    """Speed (n,) [rad/s] of shafts with equal gears and rigid teeth."""
    motor, fan = (shaft.inertia for shaft in box.shafts)
    loss, inertia = box.stages[0].friction.loss(box.stages[0].pair), motor + fan
    of_motor, of_fan = (np.array(drag) for drag in DRAGS.values())
    transmitted = (of_fan * motor - of_motor * fan) / inertia
    constant, viscous = of_motor + of_fan + loss * transmitted
    return (SPEED + constant / viscous) * np.exp(-viscous / inertia * time) - constant / viscous


def coast(box: exugear.Gearbox, last: float = LAST) -> exugear.Run:
    """After a short drive at constant speed the motor lets go, until its speed [rad/s] has fallen to the last one."""
    model = exugear.build(box)
    driven = exugear.run(model, drives={"motor": SPEED}, duration=0.02, progress=False)
    stop = [exugear.SpeedReached("motor", last)]
    return exugear.run(model, duration=20.0, initial=driven, stop=stop, power=True)


def draw(path: Path, box: exugear.Gearbox, run: exugear.Run) -> None:
    """Speed over time beside the closed form; DTE over mesh frequency, from right to left."""
    figure, time = plots.figure(columns=2), run.data["time"].values
    speeds, dte = figure.axes
    speeds.plot(time, run.data["shaft_speed"].sel(shaft="motor") / rpm, label="run")
    speeds.plot(time, rigid_speed(box, time) / rpm, "k:", linewidth=2, label="closed form, rigid teeth")
    speeds.set(xlabel="time [s]", ylabel="speed [rpm]")
    speeds.legend(frameon=False)
    speeds.grid(alpha=0.3)
    plots.plot_run_up(run, dte)
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> tuple[exugear.Gearbox, exugear.Run]:
    folder.mkdir(parents=True, exist_ok=True)
    box = gearbox(fem.static_transmission_error(paper_pair(), TORQUES, 20 if quick else 40))
    run = coast(box, 0.9 * SPEED if quick else LAST)
    draw(folder / "coast_down.png", box, run)
    print(run.energy_balance(), f"{run.data.attrs['stopped_by']} after {float(run.data['time'][-1]):.3f} s", sep="\n\n")
    return box, run


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
