"""Load sharing of the planetary set of `planetary_set.py` under a rising load, the pin of a planet displaced.

    python examples/planetary_load_sharing.py results

A pin ahead of its nominal position takes load off its planet, a pin behind adds load. The force that it shifts does
not depend on the load, so that the shares even out as the load rises. A floating sun (soft bearings) evens them out as
well. Load and displacements are chosen here.
"""

from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from command_line import command_line
from planetary_set import GEAR, INNER, R_SUN, PlanetarySet, build, put_into_mesh
from tqdm import tqdm

import exugear
from exugear import plots
from fem.units import rpm, um

#: Highest natural frequency that the run resolves [Hz].
RESOLVED = 2658.3
SPEED, LOAD, RATIO = 1000 * rpm, (500.0, 2500.0), 1 - INNER.wheel.z / GEAR.z


def velocities(gears: PlanetarySet, speed: float) -> np.ndarray:
    """Velocities of rigid gears, the ring at rest."""
    v, carrier = np.zeros(gears.mbs.systemData.ODE2Size()), speed / RATIO
    v[gears.index("sun") + 2], v[gears.index("carrier") + 2] = speed, carrier
    for name in (name for name in gears.nodes if name.startswith("planet")):
        x, y = gears.mbs.GetNode(gears.nodes[name])["referenceCoordinates"][:2]
        i = gears.index(name)
        v[i : i + 3] = -carrier * y, carrier * x, carrier - (speed - carrier) * R_SUN / GEAR.r_b
    return v


def run(gears: PlanetarySet, duration: float, load=LOAD, speed: float = SPEED):
    """Times (n,) [s], mesh forces (2, n_planet, n) with sun and ring [N], torques (n,) against the carrier [N m].

    The sun turns at its speed; the load grows from load[0] to load[1], starting at the equilibrium under load[0].
    """
    mbs, (low, high) = gears.mbs, load
    drive = mbs.CreateCoordinateConstraint(itemNumbers=[None, gears.bodies["sun"]], coordinates=[None, 2])
    brake = mbs.AddLoad(eii.LoadCoordinate(markerNumber=gears.coordinate("carrier", 2), load=-low))
    mbs.Assemble()
    put_into_mesh(gears)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    mbs.SolveStatic(settings, updateInitialValues=True)
    mbs.SetObjectParameter(drive, "offsetUserFunction", lambda mbs, t, item, offset: speed * t)
    mbs.SetObjectParameter(drive, "offsetUserFunction_t", lambda mbs, t, item, offset: speed)
    mbs.SetLoadParameter(brake, "loadUserFunction", lambda mbs, t, load: -low - (high - low) * t / duration)
    mbs.systemData.SetODE2Coordinates_t(velocities(gears, speed), exu.ConfigurationType.Initial)
    settings = exugear.integrator(mbs, duration, RESOLVED)
    steps = int(settings.timeIntegration.numberOfSteps)
    for recorder in (*gears.sun, *gears.ring):
        recorder.start(duration / steps, steps + 1)
    mbs.SolveDynamic(settings)
    times = np.linspace(0, duration, steps + 1)
    forces = np.array([[recorder.force for recorder in meshes] for meshes in (gears.sun, gears.ring)])
    return times, forces, low + (high - low) * times / duration


def shares(forces: np.ndarray) -> np.ndarray:
    """(n_planet, n) shares of the sun's torque."""
    return forces[0] / forces[0].sum(axis=0)


def draw(path: Path, runs: dict) -> None:
    """Mesh forces with the sun where the pin lags most, and the first planet's share for every displacement."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    times, forces, _ = runs[min(runs)]
    for k, (force, style) in enumerate(zip(forces[0], ("-", "-", "--"), strict=True)):
        left.plot(times, force / 1e3, style, label=f"planet {k + 1}", linewidth=1.2)
    left.set(title=f"pin of planet 1 {-min(runs) / um:g} µm behind", ylabel="mesh force with the sun [kN]")
    for error, (times, forces, _) in runs.items():
        right.plot(times, shares(forces)[0] * 100, label=f"{error / um:+g} µm", linewidth=1.2)
    right.set(title="pin of planet 1 ahead (+) or behind (-)", ylabel="share of planet 1 [%]", ylim=(None, 46))
    for ax in figure.axes:
        ax.set_xlabel(f"time [s]; load {LOAD[0]:g} to {LOAD[1]:g} N m")
        ax.grid(alpha=0.3)
        ax.legend(frameon=False, ncols=2)
    figure.savefig(path, dpi=100)


def report(runs: dict) -> str:
    """Shares at the start and at the end, torque of the sun beside what the carrier's load asks for."""
    lines = [
        "shares of the planets [%]   at the start         at the end          torque of the sun (of the load) [N m]"
    ]
    for error, (_, forces, torque) in runs.items():
        start, end = ("".join(f"{x * 100:6.1f}" for x in shares(forces)[:, i]) for i in (0, -1))
        half = torque.size // 2
        sun, load = forces[0, :, half:].sum(axis=0).mean() * R_SUN, torque[half:].mean() / RATIO
        lines.append(f"pin at {error / um:+6.1f} um:    {start}   {end}   {sun:8.1f} ({load:.1f})")
    return "\n".join(lines)


def main(folder: Path, errors=(-20 * um, -10 * um, 0.0, 10 * um, 20 * um), duration: float = 0.5) -> dict:
    """The runs by displacement of the first planet's pin [m]."""
    folder.mkdir(parents=True, exist_ok=True)
    exu.config.printToConsole = False
    runs = {error: run(build(error), duration) for error in tqdm(errors, desc="runs", leave=False)}
    draw(folder / "planetary_load_sharing.png", runs)
    print(report(runs))
    return runs


if __name__ == "__main__":
    main(**vars(command_line(__doc__).parse_args()))
