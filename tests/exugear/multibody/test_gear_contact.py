"""The gear contact on Exudyn's bodies: balance, virtual work, modes, refused arguments."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import InertiaCuboid
from paper_gears import paper_pair
from scenes import INERTIA, K, linear_law, wrench
from spatial_meshes import frame_in_space, mesh_in_space, mesh_of_spins

import exugear
from fem.units import mm, um

PAIR = paper_pair()
NONE = (0.0,) * 6


def attitudes(seed: int):
    """Reference and displacements of two bodies in meshing but otherwise arbitrary attitudes, and velocities."""
    random = np.random.default_rng(seed)
    angle, shift = random.uniform(-3, 3), random.normal(size=3)
    reference = np.zeros((2, 6))
    reference[:, :3] = shift
    reference[1, :2] += PAIR.a * np.array([np.cos(angle), np.sin(angle)])
    displacement = np.r_[random.normal(size=3), random.normal(size=2) * 0.05, 0.0]
    q = np.array([displacement, displacement]) + random.normal(size=(2, 6)) * 5 * um
    q[0, 5] = random.uniform(-20, 20)
    q[1, 5] = -q[0, 5] + 4e-3 / PAIR.wheel.r_b
    return reference, q, random.normal(size=(2, 6)) * 1e-3


@pytest.mark.parametrize("seed", range(8))
def test_forces_and_moments_balance_in_every_attitude(seed, measured):
    reference, q, v = attitudes(seed)
    law = linear_law(reach=9e-3)
    frame = frame_in_space(PAIR, reference, 0.2, 1, [0.01, -0.005])
    _, force, on_pinion, on_wheel, *_ = mesh_in_space(law, frame, *q, *v)
    wrenches = [wrench(r, x, f) for r, x, f in zip(reference, q, (on_pinion, on_wheel), strict=True)]
    assert force > 100
    unbalanced = np.abs(wrenches[0] + wrenches[1]).max() / np.abs(wrenches[0]).max()
    measured("force and moment balance of the contact in any attitude", unbalanced, 1e-12)
    assert np.linalg.norm(wrenches[0][:3]) == pytest.approx(force, rel=1e-4), "to first order in the tilts"


def test_generalized_forces_are_those_of_exudyns_own_force_and_torque(mbs):
    reference, q, v = attitudes(3)
    law, axial = linear_law(reach=9e-3), [0.01, -0.005]
    frame = frame_in_space(PAIR, reference, 0.0, 1, axial)
    _, _, on_pinion, on_wheel, *_ = mesh_in_space(law, frame, *q, *v)
    for r, x, forces in zip(reference, q, (on_pinion, on_wheel), strict=True):
        body = mbs.CreateRigidBody(
            referencePosition=r[:3], inertia=InertiaCuboid(1000, [1, 1, 1]), nodeType=exu.NodeType.RotationRxyz
        )
        total = wrench(r, x, forces)
        torque = total[3:] - np.cross(r[:3] + x[:3], total[:3])
        mbs.CreateForce(itemNumber=body, loadVector=list(total[:3]))
        mbs.CreateTorque(itemNumber=body, loadVector=list(torque))
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates(q.ravel(), exu.ConfigurationType.Initial)
    solver, settings = exu.MainSolverStatic(), exu.SimulationSettings()
    settings.solution.file.write = False
    solver.InitializeSolver(mbs, settings)
    solver.ComputeODE2RHS(mbs)
    loads = np.array(solver.GetSystemResidual())[:12]
    solver.FinalizeSolver(mbs, settings)
    assert np.abs(loads - np.r_[on_pinion, on_wheel]).max() < 1e-12 * np.abs(loads).max()


def test_spatial_and_rotational_contact_agree_with_fixed_centres(law):
    reference = np.zeros((2, 6))
    reference[1, 0] = PAIR.a
    q, v = np.zeros((2, 6)), np.zeros((2, 6))
    q[:, 5], v[:, 5] = (3.1, -3.1 + 1e-4), (0.2, -0.1)
    spatial = mesh_in_space(law, frame_in_space(PAIR, reference, 0.1), *q, *v)
    spin = mesh_of_spins(law, PAIR, 0.1, q[:, 5], v[:, 5])
    assert spatial[:2] == pytest.approx(spin[:2], rel=1e-12)
    assert (spatial[2][5], spatial[3][5]) == pytest.approx(spin[2], rel=1e-12)


def test_opening_the_centre_distance_loosens_both_flanks():
    reference = np.zeros((2, 6))
    reference[1, 0] = PAIR.a
    law = linear_law(backlash=100 * um)
    frame = frame_in_space(PAIR, reference)
    apart = (100 * um, *NONE[1:])
    opening = 100 * um * np.sin(PAIR.alpha_wt)
    for lead in (50 * um, -150 * um):
        spun = (*NONE[:5], lead / PAIR.wheel.r_b)
        moved = tuple(np.add(apart, spun))
        _, close, *_ = mesh_in_space(law, frame, NONE, spun, NONE, NONE)
        _, far, *_ = mesh_in_space(law, frame, NONE, moved, NONE, NONE)
        assert abs(close) - abs(far) == pytest.approx(K * opening, rel=1e-2)


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize(
    ("ky", "published"),
    [(1e9, (0, 2078.72, 2851.86, 4765.41)), (2e8, (0, 1002.75, 1275.39, 4417.94))],
)
def test_modes_of_a_pair_on_springs_along_the_line_of_action(mbs, ky, published):
    angle = PAIR.alpha_wt
    centres = [[0, 0, 0], [PAIR.a * np.cos(angle), PAIR.a * np.sin(angle), 0]]
    inertia = exu.rigidBodyUtilities.RigidBodyInertia(mass=3.1145, inertiaTensor=np.diag([5e-3, 5e-3, INERTIA]))
    ground = mbs.CreateGround()
    bodies = [
        mbs.CreateRigidBody(referencePosition=p, inertia=inertia, nodeType=exu.NodeType.RotationRxyz) for p in centres
    ]
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    for body, centre in zip(bodies, centres, strict=True):
        springs = {"localPosition0": centre, "stiffness": [0, ky, 0]}
        mbs.CreateCartesianSpringDamper(itemNumbers=[ground, body], **springs)
        node = mbs.GetObject(body)["nodeNumber"]
        for held in (0, 2, 3, 4):
            marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=held))
            mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[fixed, marker]))
    mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=linear_law(backlash=np.inf, reach=9e-3))
    mbs.Assemble()
    q = np.zeros(12)
    q[5] = 10 * um / PAIR.pinion.r_b
    mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
    squares, _ = mbs.ComputeODE2Eigenvalues()
    frequencies = np.sqrt(np.abs(squares)) / (2 * np.pi)
    assert frequencies[0] < 0.01
    assert frequencies[1:] == pytest.approx(published[1:], rel=1e-4)


@pytest.mark.usefixtures("way")
def test_a_model_built_by_hand_transmits_the_load(mbs, law):
    ground, bodies = mbs.CreateGround(), []
    for x in (0, PAIR.a):
        inertia = InertiaCuboid(7850, [0.1, 0.1, 0.02])
        body = mbs.CreateRigidBody(referencePosition=[x, 0, 0], inertia=inertia, nodeType=exu.NodeType.RotationRxyz)
        mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=[x, 0, 0], axis=[0, 0, 1])
        bodies.append(body)
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    node = mbs.GetObject(bodies[0])["nodeNumber"]
    held = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=5))
    mbs.AddObject(eii.CoordinateConstraint(markerNumbers=[fixed, held]))
    mbs.CreateTorque(itemNumber=bodies[1], loadVector=[0, 0, 150.0])
    recorder = exugear.Recorder()
    number = mbs.CreateGearContact(name="mesh", itemNumbers=bodies, pair=PAIR, force=law, recorder=recorder)
    mbs.Assemble()
    assert mbs.GetObject(number)["name"] == "mesh"
    recorder.start(1.0, 2)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    start = np.zeros(12)
    start[11] = 5 * um / PAIR.wheel.r_b
    mbs.systemData.SetODE2Coordinates(start, exu.ConfigurationType.Initial)
    mbs.SolveStatic(settings)
    assert recorder.force[1] == pytest.approx(150 / PAIR.wheel.r_b, rel=1e-6)
    assert recorder.deflection[1] == pytest.approx(law.deflection_at(0.0, 150 / PAIR.wheel.r_b), rel=1e-6)


@pytest.mark.usefixtures("way")
def test_default_settings_of_exudyn_converge_after_many_turns(mbs, law):
    """1e4 rad: Exudyn's own differences would move the pinion by 70 um on the line of action."""
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    recorder = exugear.Recorder()
    mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law, recorder=recorder)
    mbs.Assemble()
    lead = 5 * um / PAIR.pinion.r_b
    mbs.systemData.SetODE2Coordinates([1e4 + lead, -1e4], exu.ConfigurationType.Initial)
    mbs.systemData.SetODE2Coordinates_t([300, -300], exu.ConfigurationType.Initial)
    recorder.start(1e-5, 101)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 1e-3, 100
    mbs.SolveDynamic(settings)
    assert np.isfinite(recorder.deflection).all()
    assert recorder.deflection.max() < 5.1 * um


def spinning_contact(mbs, law):
    """Force and Jacobian of two bodies that spin, as Exudyn calls them."""
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    contact = mbs.GetObject(mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law))
    return [contact[f"{name}UserFunction"]["function"] for name in ("force", "jacobian")]


def test_jacobian_is_that_of_the_law(mbs, law):
    """Two rotational coordinates: tangent stiffness and damping times row row^T."""
    contact, jacobian = spinning_contact(mbs, law)
    lead, row = 8 * um, np.array([PAIR.pinion.r_b, PAIR.wheel.r_b])
    q = [lead / row[0], 0.0]
    tangent = (law(0.0, lead + 1e-9) - law(0.0, lead - 1e-9)) / 2e-9
    damping = law(0.0, lead, 1.0) - law(0.0, lead, 0.0)
    stiffness = jacobian(mbs, 0.0, 0, q, [0.0, 0.0], 1.0, 0.0)
    assert stiffness[:, 1] == pytest.approx(tangent * row * row[1], rel=1e-4)
    assert jacobian(mbs, 0.0, 0, q, [0.0, 0.0], 0.0, 2.0) == pytest.approx(2 * damping * np.outer(row, row), rel=1e-6)
    assert contact(mbs, 0.0, 0, q, [0.0, 0.0]) == pytest.approx(-law(0.0, lead) * row)


@pytest.mark.usefixtures("way")
def test_leaving_the_map_stops_the_solver_with_a_message(mbs, law):
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law)
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates_t([100.0, 0], exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 1e-2, 1000
    with pytest.raises(Exception, match=r"deflection .* um lies beyond the map, which ends at .* larger torque"):
        mbs.SolveDynamic(settings)


def test_a_state_of_nan_stops_the_solver(mbs, law):
    function, _ = spinning_contact(mbs, law)
    for spins in ([np.nan, 0.0], [np.inf, 0.0], [0.0, np.nan]):
        with pytest.raises(RuntimeError, match="deflection must be finite"):
            function(mbs, 0.0, 0, spins, [0.0, 0.0])


def bodies_of(mbs, **changes):
    data = {"inertia": InertiaCuboid(7850, [0.1, 0.1, 0.02]), "nodeType": exu.NodeType.RotationRxyz} | changes
    return [mbs.CreateRigidBody(referencePosition=[x, 0, 0], **data) for x in (0, PAIR.a)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pair": None}, "pair must be a fem.GearPair"),
        ({"force": None}, "force must be an exugear.MeshForce"),
        ({"direction": 0}, "direction must be"),
        ({"phase": np.nan}, "phase must be finite"),
        ({"itemNumbers": [None, None]}, "itemNumbers must name two bodies"),
        ({"itemNumbers": [0]}, "itemNumbers must be"),
        ({"localPositions": [[0.01, 0, 0], [0, 0, 0]]}, "localPositions must lie"),
        ({"localPositions": [[0, 0, 0], [0, 0, 0.1]]}, "apart along z"),
    ],
)
def test_bad_arguments_are_refused(mbs, law, changes, message):
    bodies = bodies_of(mbs)
    with pytest.raises(ValueError, match=message):
        mbs.CreateGearContact(**{"itemNumbers": bodies, "pair": PAIR, "force": law} | changes)


def test_bodies_that_cannot_carry_a_gear_are_refused(mbs, law):
    points = [mbs.CreateMassPoint(referencePosition=[x, 0, 0], mass=1) for x in (0, PAIR.a)]
    with pytest.raises(ValueError, match=r"gears cannot be carried by a Point .*; use CreateRigidBody"):
        mbs.CreateGearContact(itemNumbers=points, pair=PAIR, force=law)
    node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0]))
    spin = mbs.AddObject(eii.ObjectRotationalMass1D(inertia=1, nodeNumber=node))
    with pytest.raises(ValueError, match="carries ObjectRotationalMass1D alone"):
        mbs.CreateGearContact(itemNumbers=[*bodies_of(mbs), spin], pair=PAIR, force=law)
    with pytest.raises(ValueError, match="one node"):
        mbs.CreateGearContact(itemNumbers=[mbs.CreateGround(), spin], pair=PAIR, force=law)


def test_a_distance_other_than_the_centre_distance_is_refused(mbs, law):
    pinion, _ = bodies_of(mbs)
    inertia = InertiaCuboid(7850, [0.1, 0.1, 0.02])
    far = mbs.CreateRigidBody(referencePosition=[0.2, 0, 0], inertia=inertia, nodeType=exu.NodeType.RotationRxyz)
    with pytest.raises(ValueError, match=f"must be the pair's a = {PAIR.a / mm:g} mm"):
        mbs.CreateGearContact(itemNumbers=[pinion, far], pair=PAIR, force=law)
