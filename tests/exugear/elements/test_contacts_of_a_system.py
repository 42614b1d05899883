"""Which objects of a system are gear contacts, also after mbs.Reset, and what two contacts must not share."""

import exudyn as exu
import exudyn.itemInterface as eii
import pytest
from scenes import linear_law, paper_pair

import exugear

PAIR, LAW = paper_pair(), linear_law(backlash=1e-4)
FRICTION = exugear.MeshFriction.of_pair(PAIR, 0.05)


def spinning_bodies(mbs) -> list[int]:
    """Two bodies that spin, on torsional springs, under a torque on the first."""
    ground = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    bodies = []
    for torque in (50.0, 0.0):
        node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0]))
        bodies.append(mbs.AddObject(eii.ObjectRotationalMass1D(inertia=8e-3, nodeNumber=node)))
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=[ground, marker], stiffness=1e4))
        mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=torque))
    return bodies


def pair_on_springs(mbs, *, rubs: bool) -> int:
    """Number of the contact of two such bodies, behind an object of friction if it rubs."""
    bodies = spinning_bodies(mbs)
    if rubs:
        mbs.CreateGearFriction(itemNumbers=bodies, pair=PAIR, force=LAW, friction=FRICTION)
    number = mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=LAW)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    mbs.SolveStatic(settings, updateInitialValues=True)
    return number


def test_contacts_before_a_reset_do_not_count(mbs):
    former = pair_on_springs(mbs, rubs=False)
    mbs.Reset()
    number = pair_on_springs(mbs, rubs=True)
    assert number != former
    after_reset = exugear.modes(mbs)
    assert after_reset.sizes["stage"] == 1
    fresh = exu.SystemContainer()
    twin = fresh.AddSystem()
    pair_on_springs(twin, rubs=True)
    assert after_reset["frequency"].values == pytest.approx(exugear.modes(twin)["frequency"].values, rel=1e-9)
    with pytest.raises(ValueError, match=f"contact must be what CreateGearContact returned, got object {former}"):
        mbs.CreateGearSensor(former)
    mbs.CreateGearSensor(number)


def test_contacts_do_not_share_a_recorder(mbs):
    recorder = exugear.Recorder()
    first = mbs.CreateGearContact(itemNumbers=spinning_bodies(mbs), pair=PAIR, force=LAW, recorder=recorder)
    with pytest.raises(ValueError, match=rf"recorder records the gear contact \[{first}\] already"):
        mbs.CreateGearContact(itemNumbers=spinning_bodies(mbs), pair=PAIR, force=LAW, recorder=recorder)
    mbs.Reset()
    mbs.CreateGearContact(itemNumbers=spinning_bodies(mbs), pair=PAIR, force=LAW, recorder=recorder)


def test_a_gear_does_not_mesh_with_itself(mbs):
    pinion, wheel = spinning_bodies(mbs)
    for items in ([pinion, pinion], [pinion, wheel, wheel]):
        with pytest.raises(ValueError, match="itemNumbers must be different bodies"):
            mbs.CreateGearContact(itemNumbers=items, pair=PAIR, force=LAW)
