"""A planetary set built by hand: natural frequencies beside published ones, then a run with one planet's pin displaced.

    python examples/planetary.py results

Planar, three planets, every mesh of constant stiffness: Lin & Parker, Analytical characterization of the unique
properties of planetary gear free vibration, J. Vib. Acoust. 121 (1999). Not theirs: damping, teeth and loads. Only the
ratios of inertia to squared base radius enter the frequencies, so that any radii that fit each other serve.
"""

import argparse
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from tqdm import tqdm

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm, um

PUBLISHED = (0, 743.2, 743.2, 1102.4, 1102.4, 1475.7, 1896.0, 1896.0, 1930.3, 2276.4, 2276.4, 2658.3)
MESH, BEARING, RING_TORSION = 5e8, 1e8, 1e9
#: Mass [kg], inertia over the squared base radius (carrier: squared centre distance) [kg]
SUN, RING, CARRIER, PLANET = (0.4, 0.39), (2.35, 3.0), (5.43, 6.29), (0.66, 0.61)
#: How deep the teeth press for natural frequencies [m], which it moves by 2e-6; 0.2 um by 2e-5, 10 um by 1e-3.
DEPTH, LEAST = 0.02 * um, 1e-9
DAMPING_TIME, MESH_DAMPING = 2e-5, 1500.0
SPEED, LOAD = 1000 * rpm, (500.0, 2500.0)

GEAR = fem.Gear(z=30, m_n=3 * mm, alpha_n=24.6 * deg, b=25 * mm, d_bore=30 * mm)
OUTER = fem.GearPair(GEAR, GEAR, a=90 * mm)
INNER = exugear.RingPair(GEAR, -90, a=-OUTER.a)
R_SUN, R_RING, RATIO = GEAR.r_b, -INNER.wheel.r_b, 1 - INNER.wheel.z / GEAR.z


@dataclass
class Set:
    """The system, nodes and bodies by name, and what the meshes of every planet with sun and ring record."""

    mbs: Any
    container: Any
    nodes: dict[str, int] = field(default_factory=dict)
    bodies: dict[str, int] = field(default_factory=dict)
    sun: list[exugear.Recorder] = field(default_factory=list)
    ring: list[exugear.Recorder] = field(default_factory=list)

    def place(self, name: str) -> int:
        """Of the x coordinate of a body among all; y and the angle follow."""
        return self.mbs.GetNodeODE2Index(self.nodes[name])


def add_body(made: Set, name: str, place, sizes, radius: float) -> None:
    made.nodes[name] = made.mbs.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*place, 0]))
    data = {"mass": sizes[0], "inertia": sizes[1] * radius**2, "nodeNumber": made.nodes[name]}
    made.bodies[name] = made.mbs.AddObject(eii.ObjectRigidBody2D(**data))


def ground(mbs) -> int:
    return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))


def coordinate(made: Set, name: str, number: int) -> int:
    return made.mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=made.nodes[name], coordinate=number))


def add_springs(made: Set, sun_bearing: float) -> None:
    """Sun, ring and carrier on their bearings, the ring against turning."""
    fixed = ground(made.mbs)
    held = [(name, i, BEARING) for name in ("ring", "carrier") for i in (0, 1)]
    held += [("sun", i, sun_bearing) for i in (0, 1)]
    for name, i, k in [*held, ("ring", 2, RING_TORSION * R_RING**2)]:
        spring = {"stiffness": k, "damping": DAMPING_TIME * k}
        made.mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=[fixed, coordinate(made, name, i)], **spring))


def add_planet(made: Set, number: int, planets: int, error: float) -> None:
    """On its pin, which lies error [m] ahead of its place on the carrier, in mesh with sun and ring."""
    angle, name = 2 * np.pi * number / planets, f"planet {number + 1}"
    outward, ahead = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    add_body(made, name, OUTER.a * outward, PLANET, GEAR.r_b)
    pin = [*(OUTER.a * outward + error * ahead), 0]
    spring = {"stiffness": [BEARING, BEARING, 0], "damping": [DAMPING_TIME * BEARING] * 2 + [0]}
    ends = {"itemNumbers": [made.bodies["carrier"], made.bodies[name]], "localPosition0": pin}
    made.mbs.CreateCartesianSpringDamper(**ends, localPosition1=[0, 0, 0], **spring)
    reach = 1 * mm
    law = exugear.MeshForce([0.0], np.array([0, reach]), np.array([[0, MESH * reach]]), damping=MESH_DAMPING)
    made.sun.append(exugear.Recorder())
    made.ring.append(exugear.Recorder())
    with_sun = {"itemNumbers": [made.bodies["sun"], made.bodies[name]], "pair": OUTER, "recorder": made.sun[-1]}
    made.mbs.CreateGearContact(**with_sun, force=law)
    with_ring = {"itemNumbers": [made.bodies[name], made.bodies["ring"]], "pair": INNER, "recorder": made.ring[-1]}
    made.mbs.CreateGearContact(**with_ring, force=law, direction=-1)


def build(error: float = 0.0, planets: int = 3, sun_bearing: float = BEARING) -> Set:
    """Sun, ring, carrier and planets, the first planet's pin displaced; not yet assembled."""
    container = exu.SystemContainer()
    made = Set(container.AddSystem(), container)
    for name, sizes, radius in (("sun", SUN, R_SUN), ("ring", RING, R_RING), ("carrier", CARRIER, OUTER.a)):
        add_body(made, name, (0, 0), sizes, radius)
    add_springs(made, sun_bearing)
    for number in range(planets):
        add_planet(made, number, planets, error if number == 0 else 0.0)
    return made


def put_into_mesh(made: Set, depth: float = DEPTH) -> None:
    """Sun and ring turned until all teeth press to a depth [m]; ValueError where they hardly touch."""
    if not depth >= LEAST:
        why = "below, the least motion parts the teeth"
        raise ValueError(f"depth must be >= {LEAST:g} m, got {depth:g}: {why}; take {DEPTH:g}, and more under load")
    q = np.zeros(made.mbs.systemData.ODE2Size())
    q[[made.place("sun") + 2, made.place("ring") + 2]] = depth / R_SUN, depth / R_RING
    made.mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)


def natural_frequencies(planets: int = 3, depth: float = DEPTH) -> np.ndarray:
    """In rising order [Hz]: all coordinates free, all teeth in contact to a depth [m]."""
    made = build(planets=planets)
    made.mbs.Assemble()
    put_into_mesh(made, depth)
    squares, _ = made.mbs.ComputeODE2Eigenvalues()
    return np.sqrt(np.abs(np.sort(squares))) / (2 * np.pi)


def velocities(made: Set, speed: float) -> np.ndarray:
    """Of rigid gears, the ring at rest."""
    v, carrier = np.zeros(made.mbs.systemData.ODE2Size()), speed / RATIO
    v[made.place("sun") + 2], v[made.place("carrier") + 2] = speed, carrier
    for name in made.nodes:
        if name.startswith("planet"):
            x, y = made.mbs.GetNode(made.nodes[name])["referenceCoordinates"][:2]
            i = made.place(name)
            v[i : i + 3] = -carrier * y, carrier * x, carrier - (speed - carrier) * R_SUN / GEAR.r_b
    return v


def run(made: Set, duration: float, load=LOAD, speed: float = SPEED) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) [s], mesh forces (2, n_planet, n) with sun and ring [N], torques (n,) against the carrier [N m].

    The sun turns at its speed; the load grows from load[0] to load[1], from the equilibrium under load[0] on.
    """
    mbs, (low, high) = made.mbs, load
    drive = mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[ground(mbs), coordinate(made, "sun", 2)]))
    torque = {"markerNumber": coordinate(made, "carrier", 2), "load": -low}
    brake = mbs.AddLoad(eii.LoadCoordinate(**torque))
    mbs.Assemble()
    put_into_mesh(made)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    mbs.SolveStatic(settings, updateInitialValues=True)
    mbs.SetObjectParameter(drive, "offsetUserFunction", lambda mbs, t, item, offset: speed * t)
    mbs.SetObjectParameter(drive, "offsetUserFunction_t", lambda mbs, t, item, offset: speed)
    mbs.SetLoadParameter(brake, "loadUserFunction", lambda mbs, t, load: -low - (high - low) * t / duration)
    mbs.systemData.SetODE2Coordinates_t(velocities(made, speed), exu.ConfigurationType.Initial)
    settings = exugear.integrator(mbs, duration, PUBLISHED[-1])
    steps = int(settings.timeIntegration.numberOfSteps)
    for recorder in (*made.sun, *made.ring):
        recorder.start(duration / steps, steps + 1)
    mbs.SolveDynamic(settings)
    times = np.linspace(0, duration, steps + 1)
    forces = np.array([[recorder.force for recorder in side] for side in (made.sun, made.ring)])
    return times, forces, low + (high - low) * times / duration


def shares(forces: np.ndarray) -> np.ndarray:
    """(n_planet, n) of the sun's torque."""
    return forces[0] / forces[0].sum(axis=0)


def draw(path: Path, runs: dict) -> None:
    """Mesh forces with the sun where the pin lags most, and the first planet's share for every displacement."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    times, forces, _ = runs[min(runs)]
    for k, (force, style) in enumerate(zip(forces[0], ("-", "-", "--"), strict=True)):
        left.plot(times, force / 1e3, style, label=f"planet {k + 1}")
    left.set(title=f"pin of planet 1 {-min(runs) / um:g} µm behind its place", ylabel="mesh force with the sun [kN]")
    for error, (times, forces, _) in runs.items():
        right.plot(times, shares(forces)[0] * 100, label=f"{error / um:+g} µm")
    right.set(title="pin of planet 1 ahead (+) or behind (-)", ylabel="share of planet 1 in the load [%]")
    for ax in figure.axes:
        ax.set_xlabel(f"time [s]; load on the carrier {LOAD[0]:g} to {LOAD[1]:g} N m")
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    figure.savefig(path, dpi=110)


def report(found: np.ndarray, runs: dict) -> str:
    lines = ["natural frequencies [Hz]    here  published"]
    beside = zip(found[: len(PUBLISHED)], PUBLISHED, strict=True)
    lines += [f"{i:16d}{ours:16.1f}{theirs:11.1f}" for i, (ours, theirs) in enumerate(beside, start=1)]
    lines += [
        "",
        "shares of the planets [%]  at the start         at the end          torque of the sun (of the load) [N m]",
    ]
    for error, (_, forces, torque) in runs.items():
        start, end = ("".join(f"{x * 100:6.1f}" for x in shares(forces)[:, i]) for i in (0, -1))
        half = torque.size // 2
        sun, load = forces[0, :, half:].sum(axis=0).mean() * R_SUN, torque[half:].mean() / RATIO
        lines.append(f"pin at {error / um:+6.1f} um:    {start}   {end}   {sun:8.1f} ({load:.1f})")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> tuple[np.ndarray, dict]:
    """Natural frequencies [Hz], and the runs by displacement of the pin [m]."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure")
    parser.add_argument("--error", type=float, default=20.0, help="of the first planet's pin [um], 20 by default")
    parser.add_argument("--quick", action="store_true", help="fewer and shorter runs")
    chosen = parser.parse_args(arguments)
    chosen.folder.mkdir(parents=True, exist_ok=True)
    exu.config.printToConsole = False
    errors = np.linspace(-1, 1, 3 if chosen.quick else 5) * chosen.error * um
    duration = 0.05 if chosen.quick else 0.5
    runs = {error: run(build(error), duration) for error in tqdm(errors, desc="runs", leave=False)}
    draw(chosen.folder / "planetary.png", runs)
    found = natural_frequencies()
    print(report(found, runs))
    return found, runs


if __name__ == "__main__":
    main()
