"""A planar planetary set built by hand in Exudyn, to compare with `exugear.Planetary` and to test hand-built systems.

Masses and stiffnesses: Lin & Parker, Analytical characterization of the unique properties of planetary gear free
vibration, J. Vib. Acoust. 121 (1999); every mesh has a constant stiffness. Damping and teeth are chosen here. Only the
ratios of inertia to squared base radius enter the frequencies, so that any radii of gears that fit will do.
"""

from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

import exugear
import fem
from fem.units import deg, mm, um

MESH, BEARING, RING_TORSION = 5e8, 1e8, 1e9
#: Mass [kg], inertia over the squared base radius (carrier: squared centre distance) [kg]
SUN, RING, CARRIER, PLANET = (0.4, 0.39), (2.35, 3.0), (5.43, 6.29), (0.66, 0.61)
#: Depth to which teeth press for natural frequencies [m], which change by 2e-6; by 2e-5 at 0.2 um, 1e-3 at 10 um.
DEPTH, LEAST = 0.02 * um, 1e-9
DAMPING_TIME, MESH_DAMPING = 2e-5, 1500.0

GEAR = fem.Gear(z=30, m_n=3 * mm, alpha_n=24.6 * deg, b=25 * mm, d_bore=30 * mm)
OUTER = fem.GearPair(GEAR, GEAR, a=90 * mm)
INNER = exugear.RingPair(GEAR, -90, a=-OUTER.a)
R_SUN, R_RING = GEAR.r_b, -INNER.wheel.r_b
LAW = exugear.MeshForce([0.0], np.array([0, 1 * mm]), np.array([[0, MESH * 1 * mm]]), damping=MESH_DAMPING)


@dataclass
class PlanetarySet:
    """The system, nodes and bodies by name, and what the meshes of every planet with sun and ring record."""

    mbs: Any
    container: Any
    nodes: dict[str, int] = field(default_factory=dict)
    bodies: dict[str, int] = field(default_factory=dict)
    sun: list[exugear.Recorder] = field(default_factory=list)
    ring: list[exugear.Recorder] = field(default_factory=list)

    def index(self, name: str) -> int:
        """Index of the x coordinate of a body in the system; y and the angle follow."""
        return self.mbs.GetNodeODE2Index(self.nodes[name])

    def add_body(self, name: str, position, sizes, radius: float) -> None:
        node = self.mbs.AddNode(eii.NodeRigidBody2D(name=name, referenceCoordinates=[*position, 0]))
        data = {"name": name, "mass": sizes[0], "inertia": sizes[1] * radius**2, "nodeNumber": node}
        self.nodes[name], self.bodies[name] = node, self.mbs.AddObject(eii.ObjectRigidBody2D(**data))

    def coordinate(self, name: str, number: int) -> int:
        """Marker of x (0), y (1) or angle (2) of a body."""
        return self.mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=self.nodes[name], coordinate=number))

    def mesh(self, bodies, pair, direction: int = 1) -> exugear.Recorder:
        """Gear contact between two bodies, and its recorder."""
        ends, recorder = [self.bodies[name] for name in bodies], exugear.Recorder()
        self.mbs.CreateGearContact(itemNumbers=ends, pair=pair, force=LAW, direction=direction, recorder=recorder)
        return recorder


def add_springs(gears: PlanetarySet, sun_bearing: float) -> None:
    """Sun, ring and carrier on their bearings, the ring held against turning."""
    mbs, ground = gears.mbs, gears.mbs.CreateGround()
    for name, k in {"ring": BEARING, "carrier": BEARING, "sun": sun_bearing}.items():
        spring = {"stiffness": [k, k, 0], "damping": [DAMPING_TIME * k, DAMPING_TIME * k, 0]}
        mbs.CreateCartesianSpringDamper(f"{name} bearing", itemNumbers=[ground, gears.bodies[name]], **spring)
    k, node = RING_TORSION * R_RING**2, mbs.AddNode(eii.NodePointGround())
    ends = [mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)), gears.coordinate("ring", 2)]
    spring = {"stiffness": k, "damping": DAMPING_TIME * k}
    mbs.AddObject(eii.CoordinateSpringDamper(name="ring support", markerNumbers=ends, **spring))


def add_planet(gears: PlanetarySet, name: str, angle: float, error: float) -> None:
    """Planet on its pin, which lies error [m] ahead of its nominal position, in mesh with sun and ring."""
    outward, ahead = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    gears.add_body(name, OUTER.a * outward, PLANET, GEAR.r_b)
    pin = [*(OUTER.a * outward + error * ahead), 0]
    spring = {"stiffness": [BEARING, BEARING, 0], "damping": [DAMPING_TIME * BEARING] * 2 + [0]}
    ends = {"itemNumbers": [gears.bodies["carrier"], gears.bodies[name]], "localPosition0": pin}
    gears.mbs.CreateCartesianSpringDamper(f"{name} pin", **ends, localPosition1=[0, 0, 0], **spring)
    gears.sun.append(gears.mesh(("sun", name), OUTER))
    gears.ring.append(gears.mesh((name, "ring"), INNER, direction=-1))


def build(error: float = 0.0, planets: int = 3, sun_bearing: float = BEARING) -> PlanetarySet:
    """Sun, ring, carrier and planets, the first planet's pin displaced; not yet assembled."""
    container = exu.SystemContainer()
    gears = PlanetarySet(container.AddSystem(), container)
    for name, sizes, radius in (("sun", SUN, R_SUN), ("ring", RING, R_RING), ("carrier", CARRIER, OUTER.a)):
        gears.add_body(name, (0, 0), sizes, radius)
    add_springs(gears, sun_bearing)
    for i in range(planets):
        add_planet(gears, f"planet {i + 1}", 2 * np.pi * i / planets, error if i == 0 else 0.0)
    return gears


def put_into_mesh(gears: PlanetarySet, depth: float = DEPTH) -> None:
    """Turn sun and ring until all teeth press to a depth [m]; ValueError where they hardly touch."""
    if not depth >= LEAST:
        why = "below, the least motion parts the teeth"
        raise ValueError(f"depth must be >= {LEAST:g} m, got {depth:g}: {why}; take {DEPTH:g}, and more under load")
    q = np.zeros(gears.mbs.systemData.ODE2Size())
    q[[gears.index("sun") + 2, gears.index("ring") + 2]] = depth / R_SUN, depth / R_RING
    gears.mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
