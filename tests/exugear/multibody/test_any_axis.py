"""Gears whose axes point anywhere, on any rigid body of Exudyn: the same forces as along global z."""

from contextlib import nullcontext
from itertools import product

import exudyn as exu
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import InertiaCuboid, RigidBodyInertia
from friction_cases import friction_for
from paper_gears import paper_pair
from scenes import K, linear_law, smooth_law
from scipy.spatial.transform import Rotation
from spatial_meshes import PAIRS, bodies_of_kinds, law_of

import exugear
from fem.units import mm, um

RXYZ = exu.NodeType.RotationRxyz
EULER = exu.NodeType.RotationEulerParameters
VECTOR = exu.NodeType.RotationRotationVector
TURNED_BY = {"x": (0, np.pi / 2, 0), "y": (-np.pi / 2, 0, 0), "-z": (np.pi, 0, 0), "askew": (0.4, -0.9, 0.7)}
#: Attitude of the contact: its z is where the axes point.
FRAMES = {"z": np.eye(3)} | {name: Rotation.from_rotvec(x).as_matrix() for name, x in TURNED_BY.items()}
UP, AHEAD, ASIDE, SLANTED = (0, 0, 1), (1, 0, 0), (0, 1, 0), (0.6, 0, 0.8)
ALONG_Z = (FRAMES["z"], RXYZ, UP)
#: Frame, node and the gears' axis on their bodies, where no Rxyz node is singular.
SCENES = [
    *(("z", node, axis) for node in (EULER, VECTOR) for axis in (UP, AHEAD)),
    *(("x", RXYZ, axis) for axis in (AHEAD, ASIDE)),
    *(("x", node, axis) for node in (EULER, VECTOR) for axis in (UP, AHEAD)),
    *((name, node, UP) for name in ("y", "-z", "askew") for node in (RXYZ, EULER, VECTOR)),
    *(("askew", node, SLANTED) for node in (RXYZ, EULER, VECTOR)),
]


def turned_to(axis) -> np.ndarray:
    """(3, 3) rotation that turns e_z into an axis; a cyclic permutation where it is a coordinate axis."""
    z = np.array(axis, float)
    x = np.roll(z, 1) - np.roll(z, 1) @ z * z
    x /= np.linalg.norm(x)
    return np.c_[x, np.cross(z, x), z]


def bodies_along(mbs, pair, frame, node, axis, **data):
    """Two bodies whose gears' axes lie along z of a frame."""
    given = {"inertia": InertiaCuboid(7850, [0.1, 0.1, 0.02]), "nodeType": node} | data
    given["referenceRotationMatrix"] = frame @ turned_to(axis).T
    return [mbs.CreateRigidBody(referencePosition=frame @ [x, 0, 0], **given) for x in (0, pair.a)]


def node_of(mbs, body) -> tuple[int, np.ndarray]:
    number = mbs.GetObject(body)["nodeNumber"]
    return number, np.array(mbs.GetNode(number)["referenceCoordinates"])


def coordinates(node, reference, matrix) -> np.ndarray:
    """Displacements of a node's rotational coordinates that stand for an attitude near the reference."""
    attitude = Rotation.from_matrix(matrix)
    if node == RXYZ:
        return (attitude.as_euler("XYZ") - reference + np.pi) % (2 * np.pi) - np.pi
    if node == VECTOR:
        return attitude.as_rotvec() - reference
    parameters = np.roll(attitude.as_quat(), 1)
    return parameters * np.sign(parameters @ reference) - reference


def turns(node, p, matrix) -> np.ndarray:
    """Angular velocity per rate of the rotational coordinates p."""
    if node == RXYZ:
        return np.c_[[1, 0, 0], [0, np.cos(p[0]), np.sin(p[0])], matrix[:, 2]]
    e, f, g, h = np.append(p, 0)[:4]
    return matrix if node == VECTOR else 2 * np.array([[-f, e, -h, g], [-g, h, e, -f], [-h, -g, f, e]])


def motion_of(pair, lead: float):
    """Displacement (3), attitude and twist (6) of both bodies in the contact frame."""
    random = np.random.default_rng(7)
    spins = 0.03 + lead / pair.pinion.r_b, -0.03 * pair.pinion.r_b / pair.wheel.r_b
    tilts = random.uniform(-5e-5, 5e-5, (2, 2))
    attitudes = [Rotation.from_euler("XYZ", [*tilt, spin]).as_matrix() for tilt, spin in zip(tilts, spins, strict=True)]
    twists = random.normal(size=(2, 6)) * [*[1e-3] * 5, 0] + np.outer([1, -1], [0, 0, 0, 0, 0, 20])
    return list(zip(random.normal(size=(2, 3)) * 3 * um, attitudes, twists, strict=True))


def pushed(mbs, bodies, node, axis, frame, motion, kernel) -> np.ndarray:
    """Force and moment about the bodies' centres (2, 6) in the contact frame by a kernel (*q, *v) of these bodies."""
    q, v, jacobians = [], [], []
    for body, (displacement, attitude, twist) in zip(bodies, motion, strict=True):
        _, reference = node_of(mbs, body)
        matrix = frame @ attitude @ turned_to(axis).T
        displaced = coordinates(node, reference[3:], matrix)
        jacobians.append(turns(node, reference[3:] + displaced, matrix))
        q += [*(frame @ displacement), *displaced]
        v += [*(frame @ twist[:3]), *(np.linalg.pinv(jacobians[-1]) @ frame @ twist[3:])]
    forces = np.split(np.array(kernel(*map(float, q + v))), 2)
    moments = [np.linalg.pinv(jacobian.T) @ f[3:] for jacobian, f in zip(jacobians, forces, strict=True)]
    return np.array([[*(frame.T @ f[:3]), *(frame.T @ m)] for f, m in zip(forces, moments, strict=True)])


def forces_of(mbs, number: int):
    """Function (*coordinates, *velocities) -> generalized forces of a contact, as Exudyn calls it."""
    function = mbs.GetObject(number)["forceUserFunction"]["function"]
    return lambda *x: function(mbs, 0.0, number, x[: len(x) // 2], x[len(x) // 2 :])


def meshing(scene, pair, law, motion, direction=1):
    """The forces that `pushed` returns and the sample of the recorder, of bodies in motion."""
    frame, node, axis = scene
    mbs, recorder = exu.SystemContainer().AddSystem(), exugear.Recorder()
    bodies = bodies_along(mbs, pair, frame, node, axis)
    given = {"localAxes": [axis, axis], "phase": 0.2, "direction": direction, "recorder": recorder}
    number = mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=law, **given)
    recorder.start(1.0, 1)
    kernel = forces_of(mbs, number)
    return pushed(mbs, bodies, node, axis, frame, motion, kernel), first_sample(recorder)


def first_sample(recorder: exugear.Recorder) -> list[float]:
    """The first sample of each quantity."""
    return [float(values[0]) for values in recorder.samples.values()]


def rubbing(scene, pair, law, motion):
    """The forces of friction, as `pushed` returns them."""
    frame, node, axis = scene
    mbs, friction = exu.SystemContainer().AddSystem(), friction_for(pair)
    bodies = bodies_along(mbs, pair, frame, node, axis)
    given = {"itemNumbers": bodies, "pair": pair, "force": law, "localAxes": [axis, axis], "phase": 0.2}
    plain, rough = (mbs.CreateGearContact(**given, friction=x) for x in (None, friction))
    kernels = [forces_of(mbs, number) for number in (rough, plain)]
    total, smooth = (pushed(mbs, bodies, node, axis, frame, motion, kernel) for kernel in kernels)
    return total - smooth


@pytest.mark.parametrize(("name", "node", "axis"), SCENES)
def test_forces_are_those_along_z(name, node, axis):
    """Tilted, displaced and in motion, on either flank and in either direction; samples are in the contact frame."""
    pair, law = PAIRS["helical"], law_of(backlash=50 * um, damping=2700.0)
    for direction, lead in ((1, 8 * um), (-1, 58 * um)):
        motion = motion_of(pair, lead)
        expected, reference = meshing(ALONG_Z, pair, law, motion, direction)
        forces, recorded = meshing((FRAMES[name], node, axis), pair, law, motion, direction)
        assert abs(reference[1]) > 2000 and np.sign(reference[1]) == direction and abs(reference[3]) > 1e-5
        assert np.abs(forces - expected).max() < 1e-9 * np.abs(expected).max()
        assert recorded == pytest.approx(reference, rel=1e-8, abs=1e-15)


def test_friction_is_that_along_z():
    pair, law, motion = PAIRS["helical"], law_of(), motion_of(PAIRS["helical"], 8 * um)
    expected = rubbing(ALONG_Z, pair, law, motion)
    forces = rubbing((FRAMES["askew"], VECTOR, SLANTED), pair, law, motion)
    assert np.abs(expected[0, :3]).max() > 10
    assert np.abs(forces - expected).max() < 1e-9 * np.abs(expected).max()


def force_over_time(frame, node, axis) -> np.ndarray:
    """Mesh force of a pair on revolute joints that settles under 150 N m, more than one turn at 1000 rad/s."""
    pair, law = paper_pair(), smooth_law(damping=2700.0)
    mbs, recorder = exu.SystemContainer().AddSystem(), exugear.Recorder()
    ground, z = mbs.CreateGround(), frame[:, 2]
    about = turned_to(axis)
    inertia = RigidBodyInertia(mass=3, inertiaTensor=about @ np.diag([5e-3, 5e-3, 1e-2]) @ about.T)
    bodies = bodies_along(mbs, pair, frame, node, axis, inertia=inertia)
    for body, sense in zip(bodies, (1, -1), strict=True):
        number, reference = node_of(mbs, body)
        matrix = frame @ about.T
        rates = np.linalg.pinv(turns(node, reference[3:], matrix)) @ z * sense * 1000
        mbs.SetNodeParameter(number, "initialVelocities", [0, 0, 0, *rates])
        mbs.CreateRevoluteJoint(itemNumbers=[ground, body], position=reference[:3], axis=z)
        mbs.CreateTorque(itemNumber=body, loadVector=z * 150)
    given = {"pair": pair, "force": law, "localAxes": [axis, axis], "recorder": recorder}
    sensor = mbs.CreateGearSensor(mbs.CreateGearContact(itemNumbers=bodies, **given), storeInternal=True)
    mbs.Assemble()
    recorder.start(1e-4, 76, steps=10)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 1e-4
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 7.5e-3, 750
    mbs.SolveDynamic(settings)
    stored = mbs.GetSensorStoredData(sensor)
    assert stored[1:, 2] == pytest.approx(recorder.force[1:], rel=1e-6)
    assert recorder.force[-1] == pytest.approx(150 / pair.pinion.r_b, rel=0.3)
    return recorder.force


def test_runs_along_any_axis_are_the_same():
    """But for Newton's tolerance; Euler parameters spin as well as their integrator lets them."""
    expected = force_over_time(FRAMES["z"], RXYZ, UP)
    for name, node, axis, error in (
        ("x", RXYZ, AHEAD, 1e-6),
        ("y", RXYZ, UP, 1e-6),
        ("x", VECTOR, UP, 1e-6),
        ("askew", EULER, UP, 2e-3),
    ):
        difference = np.abs(force_over_time(FRAMES[name], node, axis) - expected).max()
        assert difference < error * expected.max(), (name, node)


def deflection(node, axis, wheel_turned: float, law=None, name: str = "x") -> float:
    """At the wheel's angle [rad], along x or another axis."""
    pair, frame, recorder = paper_pair(), FRAMES[name], exugear.Recorder()
    mbs = exu.SystemContainer().AddSystem()
    bodies = bodies_along(mbs, pair, frame, node, axis)
    law = law or linear_law(backlash=100 * um, reach=9e-3)
    given = {"pair": pair, "force": law, "localAxes": [axis, axis], "recorder": recorder}
    number = mbs.CreateGearContact(itemNumbers=bodies, **given)
    recorder.start(1.0, 1)
    q = []
    for body, angle in zip(bodies, (0.0, wheel_turned), strict=True):
        _, reference = node_of(mbs, body)
        matrix = frame @ Rotation.from_rotvec([0, 0, angle]).as_matrix() @ turned_to(axis).T
        q += [0, 0, 0, *coordinates(node, reference[3:], matrix)]
        if node == RXYZ:
            q[-1 if axis == UP else -3] = angle
    forces_of(mbs, number)(*map(float, q), *[0.0] * len(q))
    return float(recorder.deflection[0])


def test_whole_turns_are_counted_where_a_coordinate_counts_them():
    """Otherwise the teeth nearest to each other mesh."""
    pair = paper_pair()
    pitch = 2 * np.pi / pair.wheel.z
    apart = [-(40 * um) / pair.wheel.r_b - k * pitch for k in (0, 1, 57)]
    teeth = [deflection(EULER, UP, angle) for angle in apart]
    assert teeth == pytest.approx([-40 * um] * 3, rel=1e-9)
    wide = linear_law(backlash=9.9 * mm, reach=9e-3)
    assert deflection(RXYZ, UP, apart[1], wide, "y") == pytest.approx(pair.wheel.r_b * apart[1], rel=1e-9)


CARRIED = [("z", RXYZ, UP), ("z", EULER, UP), ("z", VECTOR, AHEAD), ("x", RXYZ, AHEAD), ("askew", EULER, SLANTED)]


@pytest.mark.parametrize(("name", "node", "axis"), CARRIED)
def test_a_pair_that_is_carried_through_space_has_the_same_force(name, node, axis):
    """About any axis and by any angle, with and without a back flank; an Rxyz node is singular at 90 deg about y."""
    pair, frame, mbs = PAIRS["helical"], FRAMES[name], exu.SystemContainer().AddSystem()
    angles = 0, 30, 89.9 if node == RXYZ else 90, 135, 175, 269
    for backlash in (50 * um, np.inf):
        bodies, recorder = bodies_along(mbs, pair, frame, node, axis), exugear.Recorder()
        given = {"localAxes": [axis, axis], "phase": 0.2, "recorder": recorder}
        law = law_of(backlash=backlash)
        kernel = forces_of(mbs, mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=law, **given))
        recorder.start(1.0, 1)
        for about, angle in product(([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 2, 3]), angles):
            carried, q = Rotation.from_rotvec(np.radians(angle) * np.array(about) / np.linalg.norm(about)), []
            for body, spin in zip(bodies, (8 * um / pair.pinion.r_b, 0.0), strict=True):
                _, reference = node_of(mbs, body)
                spun = Rotation.from_rotvec([0, 0, spin]).as_matrix() @ turned_to(axis).T
                displaced = carried.apply(reference[:3]) - reference[:3]
                q += [*displaced, *coordinates(node, reference[3:], carried.as_matrix() @ frame @ spun)]
            kernel(*map(float, q), *[0.0] * len(q))
            assert recorder.force[0] == pytest.approx(K * 8 * um, rel=1e-6), (about, angle)


@pytest.mark.parametrize(("node", "name"), [(EULER, "z"), (VECTOR, "x")])
def test_teeth_without_back_flank_separate_by_any_number_of_pitches(node, name):
    """The wheel turns back by 3.4 pitches, under a torque that returns it to the same teeth at the end."""
    pair, frame, mbs, recorder = paper_pair(), FRAMES[name], exu.SystemContainer().AddSystem(), exugear.Recorder()
    inertia = RigidBodyInertia(mass=3, inertiaTensor=np.diag([5e-3, 5e-3, 1e-2]))
    bodies, half, steps = bodies_along(mbs, pair, frame, node, UP, inertia=inertia), 5e-3, 100
    speed = 6.8 * 2 * np.pi / pair.wheel.z / half
    for body in bodies:
        number, reference = node_of(mbs, body)
        mbs.CreateRevoluteJoint(itemNumbers=[mbs.CreateGround(), body], position=reference[:3], axis=frame[:, 2])
    rates = np.linalg.pinv(turns(node, reference[3:], frame)) @ frame[:, 2] * -speed
    mbs.SetNodeParameter(number, "initialVelocities", [0, 0, 0, *rates])
    mbs.CreateTorque(itemNumber=bodies[1], loadVector=frame[:, 2] * 1e-2 * speed / half)
    mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=linear_law(reach=9e-3), recorder=recorder)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = half, steps
    times = np.arange(1, steps) * half / steps
    for repeated in range(2):  # the second solve begins as the first, whose end is forgotten
        recorder.start(half / steps, steps + 1, steps=1)
        with nullcontext() if repeated else pytest.warns(UserWarning, match="never touched"):
            mbs.SolveDynamic(settings, updateInitialValues=bool(repeated))
        expected = pair.wheel.r_b * (-speed * times + speed / half * times**2 / 2)
        assert recorder.deflection[1:-1] == pytest.approx(expected, abs=5e-3 * pair.p_bt)
        assert not recorder.force[1:].any()
    recorder.start(half / steps, steps + 1, steps=1)
    mbs.SolveDynamic(settings)  # from the end of the second solve, which is remembered
    returning = -3.4 * pair.p_bt + pair.wheel.r_b * speed / half * times**2 / 2
    assert recorder.deflection[1:-1] == pytest.approx(returning, abs=1e-2 * pair.p_bt)
    assert not recorder.force[1:-5].any()


def test_an_axis_may_have_either_sense():
    """A wheel that is mounted upside down."""
    pair, frame, motion = PAIRS["helical"], FRAMES["y"], motion_of(PAIRS["helical"], 8 * um)
    expected, reference = meshing((frame, RXYZ, UP), pair, law_of(), motion)
    mbs, recorder, over = exu.SystemContainer().AddSystem(), exugear.Recorder(), np.diag([1.0, -1.0, -1.0])
    pinion, wheel = bodies_along(mbs, pair, frame, RXYZ, UP)
    upside_down = {"referencePosition": frame @ [pair.a, 0, 0], "referenceRotationMatrix": frame @ over}
    wheel = mbs.CreateRigidBody(inertia=InertiaCuboid(7850, [0.1, 0.1, 0.02]), nodeType=RXYZ, **upside_down)
    number = mbs.CreateGearContact(itemNumbers=[pinion, wheel], pair=pair, force=law_of(), phase=0.2, recorder=recorder)
    recorder.start(1.0, 1)
    kernel = forces_of(mbs, number)
    turned = [motion[0], (motion[1][0], motion[1][1] @ over, motion[1][2])]
    forces = pushed(mbs, (pinion, wheel), RXYZ, UP, frame, turned, kernel)
    assert np.abs(forces - expected).max() < 1e-9 * np.abs(expected).max()
    assert first_sample(recorder) == pytest.approx(reference, rel=1e-8, abs=1e-15)


def test_a_planar_body_meshes_with_a_body_of_any_rotation():
    """Displaced along the line of centres, which opens both flanks."""
    pair, mbs, recorder, apart = paper_pair(), exu.SystemContainer().AddSystem(), exugear.Recorder(), 20 * um
    pinion = bodies_of_kinds(mbs, ("planar", "spin"))[0]
    wheel = bodies_along(mbs, pair, FRAMES["z"], EULER, UP)[1]
    number = mbs.CreateGearContact(
        itemNumbers=[pinion, wheel], pair=pair, force=linear_law(reach=9e-3), recorder=recorder
    )
    recorder.start(1.0, 1)
    lead = 30 * um / pair.pinion.r_b
    kernel = forces_of(mbs, number)
    forces = kernel(0.0, 0.0, lead, apart, *[0.0] * 16)
    depth = 30 * um - apart * np.sin(pair.alpha_wt)
    assert recorder.force[0] == pytest.approx(K * depth, rel=1e-3)
    assert forces[2] == pytest.approx(-recorder.force[0] * pair.pinion.r_b, rel=1e-9)
    assert 0.5 * forces[9] == pytest.approx(-recorder.force[0] * pair.wheel.r_b, rel=1e-9)


def test_bodies_whose_axes_do_not_fit_are_refused():
    pair, mbs = paper_pair(), exu.SystemContainer().AddSystem()
    given = {"pair": pair, "force": linear_law()}
    pinion, wheel = bodies_along(mbs, pair, FRAMES["x"], RXYZ, UP)
    with pytest.raises(ValueError, match=r"singular; use nodeType=exu.NodeType.RotationRotationVector, or put"):
        mbs.CreateGearContact(itemNumbers=[pinion, wheel], **given)
    upright, _ = bodies_along(mbs, pair, FRAMES["z"], RXYZ, UP)
    with pytest.raises(ValueError, match=r"axes of pinion and wheel must be parallel within 0.05 rad.*, got 1"):
        mbs.CreateGearContact(itemNumbers=[upright, wheel], **given)
    with pytest.raises(ValueError, match=r"not turn its z axis into global x"):
        mbs.CreateGearContact(
            itemNumbers=bodies_along(mbs, pair, FRAMES["y"], RXYZ, ASIDE), **given, localAxes=[ASIDE] * 2
        )
    for axes in ([UP, (0, 0, 0)], [UP, 1.0], [(0, np.nan, 1), UP], [UP]):
        with pytest.raises(ValueError, match="localAxes must"):
            mbs.CreateGearContact(itemNumbers=bodies_along(mbs, pair, FRAMES["z"], RXYZ, UP), **given, localAxes=axes)
    planar = bodies_of_kinds(mbs, ("planar", "spin"))
    with pytest.raises(ValueError, match=r"localAxes of a planar body must be \[0, 0, 1\]"):
        mbs.CreateGearContact(itemNumbers=planar, **given, localAxes=[AHEAD, AHEAD])
    with pytest.raises(ValueError, match="must be parallel"):
        mbs.CreateGearContact(itemNumbers=[planar[0], wheel], **given)


@pytest.mark.parametrize("node", [EULER, RXYZ])
def test_a_law_over_several_pitches_needs_teeth_that_the_attitude_tells_apart(node):
    """Of 57 teeth a law over three pitches repeats within a turn of the pinion, one over two does not."""
    mbs, pair = exu.SystemContainer().AddSystem(), paper_pair()
    bodies = bodies_along(mbs, pair, FRAMES["x"], node, AHEAD)

    def contact(pitches: int):
        phase = np.arange(2 * pitches) / 2
        law = exugear.MeshForce(phase, [0.0, 1e-4], np.tile([0.0, K * 1e-4], (phase.size, 1)), pitches=pitches)
        return mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=law, localAxes=[AHEAD, AHEAD])

    with pytest.raises(ValueError, match="divisor of 57 pitches, got 2"):
        contact(2)
    contact(3)
