"""Which objects of a system are gear contacts, also after mbs.Reset, and what two contacts must not share."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import RotationMatrixY, RotationMatrixZ
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
    """Number of the contact of two such bodies, with friction if it rubs, behind another object."""
    bodies = spinning_bodies(mbs)
    if rubs:
        mbs.CreateGround()
    number = mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=LAW, friction=FRICTION if rubs else None)
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


def forces_of(mbs, sensor: int) -> float:
    """Mesh force [N] that a sensor shows in the initial state."""
    return float(mbs.GetSensorValues(sensor, exu.ConfigurationType.Initial)[1])


def test_contacts_keep_their_sensors_where_objects_are_deleted(mbs):
    """Exudyn then counts the objects anew: the number of a contact may become that of the next."""
    extra = mbs.CreateGround()
    contacts = [pair_on_springs(mbs, rubs=False) for _ in range(2)]
    sensors = [mbs.CreateGearSensor(contact) for contact in contacts]
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([2e-4, 0.0, 3e-4, 0.0], exu.ConfigurationType.Initial)
    forces, frequencies = [forces_of(mbs, sensor) for sensor in sensors], exugear.modes(mbs)["frequency"].values
    assert forces[1] > 1.2 * forces[0] > 0
    mbs.DeleteObject(extra)
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([2e-4, 0.0, 3e-4, 0.0], exu.ConfigurationType.Initial)
    assert [forces_of(mbs, sensor) for sensor in sensors] == forces
    modes = exugear.modes(mbs)
    assert modes.sizes["stage"] == 2
    assert modes["frequency"].values == pytest.approx(frequencies, rel=1e-9)
    mbs.DeleteObject(contacts[0] - 1, deleteDependentItems=False)
    mbs.Assemble()
    with pytest.raises(Exception, match="the gear contact of a sensor was deleted"):
        forces_of(mbs, sensors[0])


@pytest.mark.usefixtures("way")
def test_a_sensor_beyond_the_map_says_what_to_change(mbs):
    mbs.CreateGearSensor(pair_on_springs(mbs, rubs=False))
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([2e-3, 0.0], exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    with pytest.raises(Exception, match="extend the map to a larger torque"):
        mbs.SolveDynamic(settings)


def test_bodies_that_spin_turn_about_the_same_axis(mbs):
    def contact(*axes) -> int:
        nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in axes]
        options = [{"nodeNumber": n, "referenceRotation": rotation} for n, rotation in zip(nodes, axes, strict=True)]
        bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=8e-3, **each)) for each in options]
        return mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=LAW)

    along_x, turned_over = RotationMatrixY(np.pi / 2), np.diag([1.0, -1.0, -1.0])
    for axes in ((np.eye(3), turned_over), (along_x, np.eye(3))):
        with pytest.raises(ValueError, match="must turn about the same axis; leave out their referenceRotation"):
            contact(*axes)
    contact(along_x, along_x)
    contact(np.eye(3), RotationMatrixZ(0.4))


def test_steps_are_chosen_with_the_teeth_in_contact(mbs):
    """Between the flanks only the springs count, and the step would be far too long for the mesh."""
    pair_on_springs(mbs, rubs=False)
    pressed = exugear.integrator(mbs, 0.01, 100.0).timeIntegration.numberOfSteps
    mbs.systemData.SetODE2Coordinates([-5e-4, 0.0], exu.ConfigurationType.Initial)
    with pytest.warns(UserWarning, match="no teeth touch in the initial state, so that steps may be unstable"):
        apart = exugear.integrator(mbs, 0.01, 100.0).timeIntegration.numberOfSteps
    assert apart < 0.5 * pressed


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
        with pytest.raises(ValueError, match="itemNumbers must be bodies with a node each"):
            mbs.CreateGearContact(itemNumbers=items, pair=PAIR, force=LAW)
