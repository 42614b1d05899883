"""Bodies of any kind that mesh in Exudyn: frequencies of pairs, of a carrier, and of a planetary set."""

from itertools import product

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from paper_gears import paper_gear
from scenes import K, linear_law
from spatial_meshes import (
    SPUR,
    bodies_of_kinds,
)

import exugear
import fem
from fem.units import deg, mm, um


def torsional_frequency(kinds, depth: float = 10 * um) -> float:
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    bodies = bodies_of_kinds(mbs, kinds)
    mbs.CreateGearContact(itemNumbers=bodies, pair=SPUR, force=linear_law(reach=9e-3))
    mbs.Assemble()
    q = np.zeros(mbs.systemData.ODE2Size())
    q[{"spin": 0, "planar": 2, "spatial": 5}[kinds[0]]] = depth / SPUR.pinion.r_b
    mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
    squares, _ = mbs.ComputeODE2Eigenvalues()
    return float(np.sqrt(np.abs(squares).max()))


@pytest.mark.parametrize("kinds", sorted({*product(["spin", "planar", "spatial"], repeat=2)} - {("planar", "spatial")}))
def test_bodies_of_any_kind_mesh(kinds):
    """A planar pinion with a wheel of any rotation: test_any_axis."""
    expected = np.sqrt(2 * K * SPUR.pinion.r_b**2 / 1e-2)
    assert torsional_frequency(kinds) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kind", ["spin", "planar", "spatial"])
def test_teeth_that_just_touch_have_the_full_stiffness(kind):
    """Difference quotients do not reach across the loss of contact; the error is rounding of the deflection."""
    expected = np.sqrt(2 * K * SPUR.pinion.r_b**2 / 1e-2)
    assert torsional_frequency((kind, kind), depth=1e-12) == pytest.approx(expected, rel=1e-4)


def test_carrier_takes_the_torques_of_pinion_and_wheel():
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(3)]
    spins = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=1e-2, nodeNumber=node)) for node in nodes]
    mbs.CreateGearContact(itemNumbers=spins, pair=SPUR, force=linear_law(reach=9e-3))
    mbs.Assemble()
    lead = 10 * um / SPUR.pinion.r_b
    mbs.systemData.SetODE2Coordinates([lead + 0.3, 0.3, 0.3], exu.ConfigurationType.Initial)
    squares, shapes = mbs.ComputeODE2Eigenvalues()
    row = SPUR.pinion.r_b * np.array([1, 1, -2])
    assert np.max(squares) == pytest.approx(K * row @ row / 1e-2, rel=1e-6)
    assert shapes[:, np.argmax(squares)] @ np.ones(3) == pytest.approx(0, abs=1e-6)


def test_ring_pairs_of_wrong_signs_are_refused():
    with pytest.raises(ValueError, match="a ring has z < 0"):
        exugear.RingPair(paper_gear(), 120, a=-84 * mm)
    with pytest.raises(ValueError, match="change its sign"):
        exugear.RingPair(paper_gear(), -120, a=84 * mm)
    with pytest.raises(ValueError, match="base circles touch"):
        exugear.RingPair(paper_gear(), -120, a=-60 * mm)


def planetary(mbs, planets: int = 3) -> None:
    """Lin & Parker's planar planetary set with all coordinates free, every mesh in contact.

    Only the ratios of inertia to squared base radius enter, so that any consistent base radii serve.
    """
    alpha, k_mesh, k_bearing = 24.6 * deg, 5e8, 1e8
    gear = fem.Gear(z=30, m_n=3 * mm, alpha_n=alpha, b=25 * mm, d_bore=30 * mm)
    pair = fem.GearPair(gear, gear, a=90 * mm)
    inner = exugear.RingPair(gear, -90, a=-pair.a)
    ring_base, law = -inner.wheel.r_b, linear_law((k_mesh,) * 3, reach=9e-3)
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))

    def body(centre, mass, over_square, radius):
        node = mbs.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[*centre, 0]))
        data = {"mass": mass, "inertia": over_square * radius**2, "nodeNumber": node}
        return node, mbs.AddObject(eii.ObjectRigidBody2D(**data))

    def spring(node, coordinate, k):
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=[fixed, marker], stiffness=k))

    sun, ring, carrier = (
        body((0, 0), *sizes) for sizes in ((0.4, 0.39, gear.r_b), (2.35, 3.0, ring_base), (5.43, 6.29, pair.a))
    )
    for node, _ in (sun, ring, carrier):
        for coordinate in (0, 1):
            spring(node, coordinate, k_bearing)
    spring(ring[0], 2, 1e9 * ring_base**2)
    for i in range(planets):
        centre = pair.a * np.cos(2 * np.pi * i / planets), pair.a * np.sin(2 * np.pi * i / planets)
        _, planet = body(centre, 0.66, 0.61, gear.r_b)
        positions = {"localPosition0": [*centre, 0], "localPosition1": [0, 0, 0]}
        mbs.CreateCartesianSpringDamper(
            itemNumbers=[carrier[1], planet], stiffness=[k_bearing, k_bearing, 0], **positions
        )
        mbs.CreateGearContact(itemNumbers=[sun[1], planet], pair=pair, force=law)
        mbs.CreateGearContact(itemNumbers=[planet, ring[1]], pair=inner, force=law, direction=-1)
    mbs.Assemble()
    q = np.zeros(mbs.systemData.ODE2Size())
    q[[2, 5]] = 10 * um / gear.r_b, 10 * um / ring_base
    mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)


def test_natural_frequencies_of_the_planetary_set_of_lin_and_parker():
    """Natural frequencies at rest [Hz] (1999, planar, three planets)."""
    published = (0, 743.2, 743.2, 1102.4, 1102.4, 1475.7, 1896.0, 1896.0, 1930.3, 2276.4, 2276.4, 2658.3)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    planetary(mbs)
    squares, _ = mbs.ComputeODE2Eigenvalues()
    frequencies = np.sqrt(np.abs(np.sort(squares))) / (2 * np.pi)
    assert frequencies[0] < 2
    assert frequencies[1:12] == pytest.approx(published[1:], rel=1e-3)
    assert frequencies[12:] == pytest.approx([6986.3, 6986.3, 7462.8, 9647.9, 9647.9, 11775.3], rel=1e-3)
