"""The paper's pair with a flexible pinion shaft: finite elements, Craig-Bampton modes and gear contact in one system.

The shaft is meshed by scikit-fem and reduced by Exudyn. Its gear seat is a rigid cross-section whose node carries the
floating frame, so the gear is a second, rigid body on that very node: no joint, no spring, no added frequency.

python examples/flexible_shaft.py results
"""

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.FEM import FEMinterface, HCBstaticModeSelection, ObjectFFRFreducedOrderInterface
from exudyn.rigidBodyUtilities import RigidBodyInertia
from korta_run_up import paper_pair
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshLine, MeshQuad
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import exugear
import fem
from exugear import plots
from exugear.post.graphics import add_gear_graphics, meshing_angles
from fem import STEEL, Gear, GearPair
from fem.elasticity.extrusion import extruded
from fem.units import mm, rpm, um

LENGTH, DIAMETER, TORQUE, SPEED = 300 * mm, 40 * mm, 150.0, 1000 * rpm
BEARING, BEARING_TIME, SHAFT_TIME, MESH_DAMPING = 2e8, 1e-5, 5e-6, 2700.0
SEATS = (0.0, -LENGTH / 2, LENGTH / 2)
MESH_RESONANCE = 2900.0


def solid_shaft(slices: int = 24, rings: int = 2) -> FEMinterface:
    """Quadratic tetrahedra of a cylinder about z, its cross-section a polygon of the circle's area; no modes yet."""
    square = MeshQuad.init_tensor(*2 * [np.linspace(-1, 1, 2 * rings + 1)])
    x, y = square.p
    corners = 8 * rings
    radius = DIAMETER / 2 * np.sqrt(2 * np.pi / (corners * np.sin(2 * np.pi / corners)))
    disc = MeshQuad(radius * np.array([x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2)]), square.t)
    mesh = extruded(disc, MeshLine(np.linspace(-LENGTH / 2, LENGTH / 2, slices + 1))).to_meshtet()
    solid = FEMinterface()
    element = ElementVector(ElementTetP2())
    elastic = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu))
    solid.stiffnessMatrix = elastic.assemble(Basis(mesh, element, intorder=2)).tocsr()
    basis = Basis(mesh, element, intorder=4)
    solid.massMatrix = BilinearForm(lambda u, v, w: STEEL.density * dot(u, v)).assemble(basis).tocsr()
    solid.nodes = {"Position": np.ascontiguousarray(basis.doflocs[:, ::3].T)}
    solid.surface = [{"Name": "mantle", "Trigs": mesh.facets[:, mesh.boundary_facets()].T}]
    return solid


def seats(solid: FEMinterface) -> list[np.ndarray]:
    """Nodes of the cross-sections under the gear and in both bearings."""
    return [np.flatnonzero(abs(solid.nodes["Position"][:, 2] - z) < 1e-9) for z in SEATS]


def corners(solid: FEMinterface, nodes: np.ndarray) -> np.ndarray:
    """Four nodes of a seat, farthest out in +x, -x, +y, -y: they move as the whole rigid seat does."""
    x, y, _ = solid.nodes["Position"][nodes].T
    return nodes[[x.argmax(), x.argmin(), y.argmax(), y.argmin()]]


def reduced(solid: FEMinterface, modes: int = 6) -> FEMinterface:
    """With Craig-Bampton modes over rigid seats; the gear seat, left out, is where the floating frame sits."""
    solid.ComputeHurtyCraigBamptonModes(seats(solid), modes, computationMode=HCBstaticModeSelection.RBE2)
    return solid


def disc(length: float, outer: float, inner: float = 0.0) -> RigidBodyInertia:
    """Hollow steel cylinder about z, of diameters outer and inner [m]."""
    mass = STEEL.density * np.pi / 4 * (outer**2 - inner**2) * length
    polar = mass * (outer**2 + inner**2) / 8
    across = polar / 2 + mass * length**2 / 12
    return RigidBodyInertia(mass=mass, inertiaTensor=np.diag([across, across, polar]))


def gear_disc(gear: Gear) -> RigidBodyInertia:
    return disc(gear.b, gear.r_a + gear.r_f, DIAMETER)


@dataclass
class Rig:
    """The system, its recorder, the number of its drive, and the markers of gear seat and bearings on the pinion."""

    mbs: Any
    container: Any
    pair: GearPair
    force: exugear.MeshForce
    recorder: exugear.Recorder
    bodies: list[int]
    seats: list[int]
    drive: int

    def positions(self) -> np.ndarray:
        """(3, 3) of gear seat and bearing seats on the pinion's shaft [m]."""
        return np.array([self.mbs.GetMarkerOutput(seat, exu.OutputVariableType.Position) for seat in self.seats])


def rigid_body(mbs, node: int, inertia: RigidBodyInertia) -> int:
    tensor = inertia.GetInertia6D()
    return mbs.AddObject(eii.ObjectRigidBody(nodeNumber=node, mass=inertia.Mass(), inertia=tensor))


def rigid_shaft(mbs, place) -> tuple[int, list[int]]:
    """Node of the gear seat and markers of all seats of a rigid shaft."""
    node = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*place, 0, 0, 0, 0]))
    body = rigid_body(mbs, node, disc(LENGTH, DIAMETER))
    return node, [mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, z])) for z in SEATS]


def flexible_shaft(mbs, place, solid: FEMinterface) -> tuple[int, list[int]]:
    """The same of a flexible one in a floating frame; Rxyz, so that its spin is one coordinate."""
    frame = ObjectFFRFreducedOrderInterface(solid, rigidBodyNodeType=exu.NodeType.RotationRxyz)
    options = {"stiffnessProportionalDamping": SHAFT_TIME, "rotationMatrixRef": np.eye(3)}
    made = frame.AddObjectFFRFreducedOrder(mbs, positionRef=[*place, 0], **options)
    body, markers = made["oFFRFreducedOrder"], []
    for nodes in seats(solid):
        few = corners(solid, nodes)
        marker = eii.MarkerSuperElementRigid(bodyNumber=body, meshNodeNumbers=few, weightingFactors=np.full(4, 0.25))
        markers.append(mbs.AddMarker(marker))
    return made["nRigidBody"], markers


def bearings(mbs, place, markers) -> None:
    for z, marker in zip(SEATS[1:], markers[1:], strict=True):
        fixed = mbs.AddMarker(eii.MarkerBodyPosition(bodyNumber=mbs.CreateGround(), localPosition=[*place, z]))
        spring = {"stiffness": 3 * [BEARING], "damping": 3 * [BEARING * BEARING_TIME]}
        mbs.AddObject(eii.ObjectConnectorCartesianSpringDamper(markerNumbers=[fixed, marker], **spring))


def build(pair: GearPair, force: exugear.MeshForce, solid: FEMinterface | None = None) -> Rig:
    """Pinion on a flexible shaft, or a rigid one without `solid`, wheel on a rigid one; torque at the pinion's end."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    places = [(0.0, 0.0), (pair.a, 0.0)]
    shafts = [rigid_shaft(mbs, place) for place in places[1:]]
    shafts.insert(0, flexible_shaft(mbs, places[0], solid) if solid else rigid_shaft(mbs, places[0]))
    for place, (_, markers) in zip(places, shafts, strict=True):
        bearings(mbs, place, markers)
    gears = zip(shafts, (pair.pinion, pair.wheel), strict=True)
    bodies = [rigid_body(mbs, node, gear_disc(gear)) for (node, _), gear in gears]
    for body, gear, angle in zip(bodies, (pair.pinion, pair.wheel), meshing_angles(pair), strict=True):
        add_gear_graphics(mbs, body, gear, phase_angle=angle)
    recorder = exugear.Recorder()
    mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=force, recorder=recorder)
    mbs.AddLoad(eii.LoadTorqueVector(markerNumber=shafts[0][1][1], loadVector=[0, 0, TORQUE]))
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    spin = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=shafts[1][0], coordinate=5))
    drive = mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[fixed, spin]))
    mbs.Assemble()
    return Rig(mbs, container, pair, force, recorder, bodies, shafts[0][1], drive)


def spins(rig: Rig) -> list[int]:
    """Places of the spins of pinion and wheel among the system's coordinates."""
    return [rig.mbs.GetNodeODE2Index(rig.mbs.GetObject(body)["nodeNumber"]) + 5 for body in rig.bodies]


def stand(rig: Rig) -> Rig:
    """Static equilibrium under the torque, from where the teeth of shafts that do not bend would stand."""
    system, initial = rig.mbs.systemData, exu.ConfigurationType.Initial
    q = np.zeros(system.ODE2Size())
    q[spins(rig)[0]] = rig.force.deflection_at(0.0, TORQUE / rig.pair.pinion.r_b) / rig.pair.pinion.r_b
    system.SetODE2Coordinates(q, initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.newton.relativeTolerance = 1e-8
    rig.mbs.SolveStatic(settings, updateInitialValues=True)
    return rig


def run(rig: Rig, duration: float = 0.06, tolerance: float = 1e-3) -> tuple[np.ndarray, float]:
    """Times (n,) [s] of the recorder's samples at constant speed, and the processor time of a step [s]."""
    system, initial = rig.mbs.systemData, exu.ConfigurationType.Initial
    wheel = -SPEED * rig.pair.pinion.z / rig.pair.wheel.z
    rig.mbs.SetObjectParameter(rig.drive, "offsetUserFunction", lambda mbs, t, item, offset: wheel * t)
    rig.mbs.SetObjectParameter(rig.drive, "offsetUserFunction_t", lambda mbs, t, item, offset: wheel)
    velocity = np.zeros(system.ODE2Size())
    driving, driven = spins(rig)
    velocity[driving], velocity[driven] = SPEED, wheel
    system.SetODE2Coordinates_t(velocity, initial)
    settings = exugear.integrator(rig.mbs, duration, MESH_RESONANCE, tolerance=tolerance)
    steps = int(settings.timeIntegration.numberOfSteps)
    rig.recorder.start(duration / steps, steps + 1)
    began = time.process_time()
    rig.mbs.SolveDynamic(settings)
    return np.linspace(0, duration, steps + 1), (time.process_time() - began) / steps


def free_frequencies(solid: FEMinterface) -> np.ndarray:
    """Eigenfrequencies [Hz] of the reduced shaft, free in Exudyn, without those of its six rigid motions."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    flexible_shaft(mbs, (0.0, 0.0), solid)
    mbs.Assemble()
    squares = np.array(mbs.ComputeODE2Eigenvalues()[0])
    return np.sqrt(np.sort(squares)[6:]) / (2 * np.pi)


def torsion_frequency() -> float:
    """First one of a free rod [Hz]."""
    return np.sqrt(STEEL.E / (2 * (1 + STEEL.nu)) / STEEL.density) / (2 * LENGTH)


def beam_deflection(force: float) -> float:
    """Timoshenko beam on two supports under a force in the middle [m]."""
    area, inertia = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
    shear = STEEL.E / (2 * (1 + STEEL.nu)) * area * 6 * (1 + STEEL.nu) / (7 + 6 * STEEL.nu)
    return force * (LENGTH**3 / (48 * STEEL.E * inertia) + LENGTH / (4 * shear))


def bending(rig: Rig) -> float:
    """How far the gear seat stands off the line between the bearings [m]."""
    gear, *supports = rig.positions()[:, :2]
    return float(np.linalg.norm(gear - np.mean(supports, axis=0)))


def last(times: np.ndarray, values: np.ndarray, cycles: int, teeth: int, n: int = 64) -> np.ndarray:
    """(cycles n,) values over the last mesh cycles at equal steps."""
    period = 2 * np.pi / (SPEED * teeth)
    return np.interp(times[-1] - period * np.arange(cycles * n, 0, -1) / n, times, values)


def draw(path: Path, curves: dict[str, np.ndarray], n: int = 64) -> None:
    """DTE over two mesh cycles, and the amplitudes of its harmonics, of each shaft."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    for i, (name, dte) in enumerate(curves.items()):
        cycles = dte.size // n
        left.plot(np.arange(2 * n) / n, dte[-2 * n :] / um, label=name)
        amplitude = 2 * abs(np.fft.rfft(dte))[cycles : 9 * cycles : cycles] / dte.size
        right.bar(np.arange(1, 9) + 0.4 * i - 0.2, amplitude / um, width=0.4, label=name)
    left.set(xlabel="mesh cycles", ylabel="dynamic transmission error [µm]", title=f"{SPEED / rpm:.0f} rpm")
    right.set(xlabel="order of the mesh frequency", ylabel="amplitude [µm]")
    left.legend(frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure")
    folder, pair = parser.parse_args().folder, paper_pair()
    folder.mkdir(parents=True, exist_ok=True)
    exu.config.printToConsole = False
    ste = fem.static_transmission_error(pair, (0, 5, 50, 150, 350, 700), 30, progress=False)
    force, solid, curves = exugear.MeshForce.from_ste(ste, damping=MESH_DAMPING), reduced(solid_shaft()), {}
    given = TORQUE / pair.pinion.r_b
    found = free_frequencies(solid)
    torsion = found[abs(found - torsion_frequency()).argmin()]
    print(f"free shaft: bending {found[0]:.0f} Hz, torsion {torsion:.0f} Hz (rod: {torsion_frequency():.0f} Hz)")
    for name, body in (("rigid shaft", None), ("flexible shaft", solid)):
        rig = stand(build(pair, force, body))
        print(f"{name}: bends by {bending(rig) / um:.2f} um (beam: {beam_deflection(given) / um:.2f} um)", end=", ")
        times, cost = run(rig)
        dte, mean = (last(times, x, 20, pair.pinion.z) for x in (rig.recorder.deflection, rig.recorder.force))
        print(f"mean mesh force {mean.mean():.1f} N (T/r_b: {given:.1f} N), DTE {np.ptp(dte) / um:.2f} um peak to peak")
        print(f"  {times.size - 1} steps of {times[1] / 1e-6:.2f} us, {cost / 1e-6:.0f} us of processor time each")
        curves[name] = dte
    draw(folder / "flexible_shaft.png", curves)


if __name__ == "__main__":
    main()
