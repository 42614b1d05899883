"""A model built by hand in Exudyn: rigid bodies, springs as bearings, a brake, a single gear contact and its sensor.

    python examples/hand_built_contact.py results

A torque drives the pinion, a viscous brake loads the wheel. The run starts at the steady speed without mesh force and
settles where mesh, torques and bearings balance. Only `CreateGearContact` and its sensor come from exugear.
"""

from math import tan
from pathlib import Path

import exudyn as exu
import numpy as np
from command_line import command_line
from exudyn.utilities import InertiaCylinder, SensorObject

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm, um

TORQUE, SPEED, STIFFNESS = 100.0, 600 * rpm, np.array([2e8, 2e8, 1e8])
COARSE = fem.Slices(fem.Density().scaled(0.5))
SIZES = {"m_n": 3 * mm, "b": 25 * mm, "d_bore": 30 * mm}
PAIR = fem.GearPair(fem.Gear(z=25, beta=15 * deg, **SIZES), fem.Gear(z=40, beta=-15 * deg, **SIZES))


def add_gear(mbs, gear: fem.Gear, x: float, speed: float) -> tuple[int, list[int]]:
    """A cylinder in space at x [m] that turns about z, between two bearings: their numbers."""
    disc = InertiaCylinder(density=7850, length=gear.b, outerRadius=gear.r, axis=2)
    spin = {"initialAngularVelocity": [0, 0, speed], "nodeType": exu.NodeType.RotationRxyz}
    ends = [mbs.CreateGround(), mbs.CreateRigidBody(referencePosition=[x, 0, 0], inertia=disc, **spin)]
    spring = {"itemNumbers": ends, "stiffness": STIFFNESS, "damping": 5e-5 * STIFFNESS}
    positions = ({"localPosition0": [x, 0, z], "localPosition1": [0, 0, z]} for z in (-0.03, 0.03))
    return ends[1], [mbs.CreateCartesianSpringDamper(**spring, **position) for position in positions]


def solve(ste, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """What the sensor of the contact stores (n, 9), and the forces of the wheel's bearings (2, n, 3) [N]."""
    container = exu.SystemContainer()
    mbs, ratio = container.AddSystem(), PAIR.wheel.z / PAIR.pinion.z
    pinion, _ = add_gear(mbs, PAIR.pinion, 0.0, SPEED)
    wheel, bearings = add_gear(mbs, PAIR.wheel, PAIR.a, -SPEED / ratio)
    mbs.CreateTorque(itemNumber=pinion, loadVector=[0, 0, TORQUE])
    brake = {"itemNumbers": [mbs.CreateGround(), wheel], "position": [PAIR.a, 0, 0], "axis": [0, 0, 1]}
    mbs.CreateTorsionalSpringDamper(**brake, damping=TORQUE * ratio**2 / SPEED)
    force = exugear.MeshForce.from_ste(ste, damping=3000.0)
    contact = mbs.CreateGearContact(itemNumbers=[pinion, wheel], pair=PAIR, force=force)
    mesh_sensor = mbs.CreateGearSensor(contact, storeInternal=True)
    kind = {"outputVariableType": exu.OutputVariableType.Force, "storeInternal": True}
    sensors = [mbs.AddSensor(SensorObject(objectNumber=bearing, **kind)) for bearing in bearings]
    mbs.Assemble()
    settings = exugear.integrator(mbs, duration, frequency=5000.0)
    settings.solution.sensors.writePeriod = 2e-5
    mbs.SolveDynamic(settings)
    stored = np.array([mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in sensors])
    return mbs.GetSensorStoredData(mesh_sensor), stored


def main(folder: Path, quick: bool = False) -> dict[str, tuple[float, float]]:
    """Means of the second half of the run beside what balance and the STE map give."""
    folder.mkdir(parents=True, exist_ok=True)
    exu.config.printToConsole = False
    ste = fem.static_transmission_error(PAIR, (0, 5, 20, 50, TORQUE, 200, 400), 16, resolution=COARSE)
    contact, bearings = solve(ste, 0.05 if quick else 0.1)
    force, settled = TORQUE / PAIR.pinion.r_b, contact[:, 0] > contact[-1, 0] / 2
    values = {
        "mesh force [N]": (contact[settled, 2].mean(), force),
        "DTE [µm]": (contact[settled, 1].mean() / um, float(ste["te"].sel(torque=TORQUE).mean()) / um),
        "axial force [N]": (abs(bearings[:, settled, 2].sum(0).mean()), force * tan(abs(PAIR.pinion.beta_b))),
    }
    ax = plots.figure().axes[0]
    ax.plot(contact[:, 0] * 1e3, contact[:, 2], linewidth=1, label="mesh force")
    for i, radial in enumerate(np.hypot(*bearings.transpose(2, 0, 1)[:2])):
        ax.plot(contact[:, 0] * 1e3, radial, linewidth=1, label=f"bearing {i + 1} of the wheel")
    ax.axhline(force, color="k", linestyle="--", linewidth=1, label="torque / base radius")
    ax.set(xlabel="time [ms]", ylabel="force [N]", xlim=(-1, 25))
    ax.legend(frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    ax.figure.savefig(folder / "hand_built_contact.png", dpi=100)
    for name, (value, expected) in values.items():
        print(f"{name:16s}{value:9.3f}, expected {expected:9.3f}")
    return values


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
