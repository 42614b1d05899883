"""Vibration modes under load: closed forms, Exudyn's eigenvalues, energy and damping."""

from math import pi

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import planetary_set
import pytest
import xarray as xr
from exudyn.rigidBodyUtilities import RigidBodyInertia
from measured_rows import deviation
from modal_boxes import pair_of_shafts, planets, three_shafts
from paper_gears import paper_pair
from scenes import INERTIA, K, linear_law, rectangular_law, smooth_box

import exugear
from exugear.modal.operating_point import in_loaded_equilibrium

R_B = paper_pair().pinion.r_b


def test_three_shafts_agree_with_eigenvalues_by_exudyn(measured):
    model = three_shafts()
    with in_loaded_equilibrium(model, {model.gearbox.driven.name: 150.0}):
        by_exudyn = model.mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)[0]
    frequency = exugear.modes(model, load=150.0, phase=0.0)["frequency"].values
    measured("modes of a three-shaft gearbox", deviation(frequency, by_exudyn), 1e-6)
    assert exugear.eigenfrequencies(model, load=150.0) == pytest.approx(by_exudyn, rel=1e-6)


def test_spinning_shafts_agree_with_complex_eigenvalues_by_exudyn():
    model, speed = three_shafts(damping=0.0, bearing_damping=0.0), 2000.0
    with in_loaded_equilibrium(model, {model.gearbox.driven.name: 150.0}):
        model.mbs.systemData.SetODE2Coordinates_t(speed * model.speed_ratios, exu.ConfigurationType.Initial)
        values, _ = model.mbs.ComputeODE2Eigenvalues(computeComplexEigenvalues=True, useAbsoluteValues=False)
    by_exudyn = np.sort(values.imag[values.imag > 0]) / (2 * pi)
    turning = exugear.modes(model, load=150.0, speed=speed, phase=0.0)
    assert turning["frequency"].values == pytest.approx(by_exudyn, rel=1e-5)
    assert float(abs(turning["shape_imaginary"]).max()) > 0.1
    at_rest = exugear.modes(model, load=150.0, phase=0.0)["frequency"].values
    assert np.abs(turning["frequency"].values / at_rest - 1).max() > 0.01


def disc_beside_gears(omega: float) -> tuple[exu.SystemContainer, exu.MainSystem]:
    """A spinning disc on springs (Jeffcott rotor, tilts and displacements apart), and a pair of gears beside it."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    tensor = np.diag([0.02, 0.02, 0.03])
    mbs.CreateRigidBody(
        name="disc", inertia=RigidBodyInertia(mass=5.0, inertiaTensor=tensor), nodeType=exu.NodeType.RotationRxyz
    )
    springs = np.diag([1e8, 1e8, 2e8, 3e5, 3e5, 0.0])
    mbs.AddObject(eii.ObjectGenericODE2(name="springs", nodeNumbers=[0], stiffnessMatrix=springs))
    gears = [mbs.AddNode(eii.Node1D(name=name, referenceCoordinates=[0.0])) for name in ("pinion", "wheel")]
    positions = [[0, 0, 0], [paper_pair().a, 0, 0]]
    bodies = [
        mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node, referencePosition=position))
        for node, position in zip(gears, positions, strict=True)
    ]
    mbs.CreateGearContact(itemNumbers=bodies, pair=paper_pair(), force=linear_law())
    mbs.Assemble()
    initial = exu.ConfigurationType.Initial
    mbs.systemData.SetODE2Coordinates([0, 0, 0, 0, 0, 0, 1e-5, 0], initial)
    mbs.systemData.SetODE2Coordinates_t([0, 0, 0, 0, 0, omega, 0, 0], initial)
    return container, mbs


def test_disc_whirls_forward_and_backward_by_its_gyroscopic_moment(measured):
    """J_t w^2 -+ J_p omega w - k = 0."""
    omega, j_t, j_p, k = 3000.0, 0.02, 0.03, 3e5
    container, mbs = disc_beside_gears(omega)
    data = exugear.modes(mbs)
    g = j_p * omega / (2 * j_t)
    whirls = np.sqrt(g**2 + k / j_t) + g * np.array([-1, 1])
    a, b = (data["shape"] + 1j * data["shape_imaginary"]).sel(coordinate=["disc tilt_x", "disc tilt_y"]).values.T
    numbers = data["mode"].values[np.abs(a) > 0.1]
    error = deviation(data["frequency"].sel(mode=numbers).values * 2 * pi, whirls)
    measured("whirl of a disc, forward and backward", error, 1e-6)
    backward, forward = (a[number - 1] / b[number - 1] for number in numbers)
    assert (backward.real, forward.real) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert (backward.imag, forward.imag) == pytest.approx((-1.0, 1.0), rel=1e-6)
    assert container


def test_energy_of_every_mode_is_shared_by_meshes_bearings_and_couplings():
    data = exugear.modes(three_shafts(), load=150.0, speed=500.0)
    assert data["energy_share"].sum("element").values == pytest.approx(np.ones(data.sizes["mode"]), rel=1e-12)
    kinds = data["element_kind"].values.tolist()
    assert (kinds.count("mesh"), kinds.count("bearing"), kinds.count("coupling"), len(kinds)) == (2, 3, 1, 6)


def test_single_mode_has_the_closed_form_of_damping_energy_and_excitation():
    """Drive held: the slow shaft on the mesh alone, J w^2 = k r^2, 2 zeta w J = c r^2; p = k r J^-1/2."""
    c, inertia = 2700.0, 3 * INERTIA
    law = exugear.MeshForce([0.0], [0.0, 1e-4], [[0.0, K * 1e-4]], damping=c)
    data = exugear.modes(pair_of_shafts(law=law, ratio=3.0), load=150.0)
    omega = np.sqrt(K * R_B**2 / inertia)
    assert data["frequency"].values == pytest.approx([omega / (2 * pi)], rel=1e-6)
    assert data["damping_ratio"].values == pytest.approx([c * R_B**2 / (2 * omega * inertia)], rel=1e-6)
    assert abs(data["participation"].item()) == pytest.approx(K * R_B / np.sqrt(inertia), rel=1e-6)
    assert data["mesh_stiffness"].item() == pytest.approx(K, rel=1e-6)
    assert data["mesh_force"].item() == pytest.approx(150.0 / R_B, rel=1e-6)
    spin = data["shape"].sel(mode=1, shaft="slow", coordinate="spin").item()
    assert spin == pytest.approx(inertia**-0.5, rel=1e-6)


@pytest.mark.filterwarnings("ignore:torsion 10 N m/rad")
def test_damping_ratio_of_a_coupling_between_two_rotors():
    """Free drive: two rotors on a coupling, the other mode on the mesh far above."""
    coupling = exugear.Coupling(10.0, 0.02, inertia=1.0)
    data = exugear.modes(pair_of_shafts(fast=(coupling,)), load=5.0, drive="free")
    reduced = 1 / (1 / 1.0 + 1 / (2 * INERTIA))
    omega = np.sqrt(10.0 / reduced)
    assert data["frequency"].values[:2] == pytest.approx([0.0, omega / (2 * pi)], rel=1e-5)
    assert data["damping_ratio"].values[:2] == pytest.approx([0.0, 0.02 / (2 * omega * reduced)], rel=1e-4)
    assert data["energy_share"].sel(mode=2, element="fast coupling").item() == pytest.approx(1.0, rel=1e-4)
    assert not data["energy_share"].sel(mode=1).any()


def test_free_drive_turns_without_a_spring_although_the_mesh_stiffness_varies():
    model = exugear.build(smooth_box(exugear.Bearing(5e8, 3e8, 2e5)))
    free, held = (exugear.modes(model, load=150.0, drive=drive)["frequency"].values for drive in ("free", "held"))
    assert free[0] == 0.0
    assert held[0] > 500
    rolling = exugear.modes(model, load=150.0, drive="free")["shape"].sel(mode=1, coordinate="spin").values
    assert rolling == pytest.approx([rolling[0], -rolling[0]], rel=1e-9)


def test_mean_stiffness_is_that_over_the_mesh_cycle_and_a_phase_takes_its_tangent():
    model = pair_of_shafts(law=rectangular_law())
    mean = exugear.modes(model, load=150.0)["mesh_stiffness"].item()
    assert mean == pytest.approx(K, rel=0.01)
    double = K / (0.45 + 0.55 * 0.6)
    for phase, stiffness in ((0.2, double), (0.7, 0.6 * double)):
        at = exugear.modes(model, load=150.0, phase=phase)["mesh_stiffness"].item()
        assert at == pytest.approx(stiffness, rel=1e-3)


@pytest.mark.parametrize("pitches", [2, 11])
def test_mean_stiffness_over_several_pitches_is_that_of_all(pitches):
    """A pitch half as stiff as the others; of many pitches each has some of the phases."""
    law = rectangular_law()
    softer = [law.force_table * (0.5 if n == 0 else 1.0) for n in range(pitches)]
    phase = (np.arange(pitches)[:, None] + law.phase).ravel()
    whole = exugear.MeshForce(phase, law.deflection, np.concatenate(softer), pitches=pitches)
    mean = exugear.modes(pair_of_shafts(law=whole), load=150.0)["mesh_stiffness"].item()
    assert mean == pytest.approx(K * (1 - 0.5 / pitches), rel=0.02)


def test_nonlinear_bearings_are_stiffer_under_a_larger_load():
    soft_then_stiff = exugear.Bearing(table=([0.0, 5e-6, 50e-6], [0.0, 250.0, 45250.0]), axial=1e8, tilt=1e5)
    model = exugear.build(smooth_box(soft_then_stiff))
    low, high = (exugear.modes(model, load=load)["frequency"].values for load in (5.0, 300.0))
    assert (high >= low * (1 - 1e-3)).all()
    assert high[0] > 1.3 * low[0]


def test_springs_of_the_user_are_elements_too():
    model = pair_of_shafts()
    ground = model.mbs.AddNode(eii.NodePointGround())
    ends = [
        model.mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        for node in (ground, model.mbs.GetObject(model.bodies["slow"])["nodeNumber"])
    ]
    model.mbs.AddObject(eii.CoordinateSpringDamper(name="brake", markerNumbers=ends, stiffness=1e6))
    model.mbs.Assemble()
    data = exugear.modes(model, load=150.0)
    total = K * R_B**2 + 1e6
    assert data["frequency"].item() * 2 * pi == pytest.approx(np.sqrt(total / INERTIA), rel=1e-6)
    assert data["energy_share"].sel(mode=1, element="brake").item() == pytest.approx(1e6 / total, rel=1e-6)


def test_drag_damps_a_turning_shaft_and_no_resting_one():
    drag = exugear.Drag(10.0, 0.5, speed=1.0)
    model = pair_of_shafts(drag, law=linear_law())
    at_rest, turning = (exugear.modes(model, load=150.0, speed=speed)["damping_ratio"].item() for speed in (0.0, 100.0))
    assert at_rest == pytest.approx(0.0, abs=1e-9)
    assert turning == pytest.approx(0.5 / (2 * np.sqrt(K * R_B**2 * INERTIA)), rel=1e-4)


def test_friction_of_the_teeth_changes_no_mode():
    bearing = exugear.Bearing(5e8, 3e8, 2e5, 1e-6)
    rubbing = exugear.MeshFriction.of_pair(paper_pair(), 0.05)
    boxes = smooth_box(bearing, friction=rubbing), smooth_box(bearing)
    with_friction, without = (exugear.modes(exugear.build(box), load=150.0) for box in boxes)
    for name in ("frequency", "damping_ratio"):
        assert with_friction[name].values == pytest.approx(without[name].values, rel=1e-9)
    sizes = np.abs(without["participation"].values)
    assert np.abs(with_friction["participation"].values) == pytest.approx(sizes, abs=1e-8 * sizes.max())


def test_both_flanks_vibrate_alike():
    """The teeth of the paper's pair are symmetric: a load in the other sense presses their mirror images."""
    model = exugear.build(smooth_box(exugear.Bearing(5e8, 3e8, 2e5, 1e-6), damping=2700.0))
    driving, back = (exugear.modes(model, load=load) for load in (150.0, -150.0))
    assert back["mesh_force"].item() == pytest.approx(-driving["mesh_force"].item(), rel=1e-9)
    for name in ("frequency", "damping_ratio", "energy_share"):
        assert back[name].values == pytest.approx(driving[name].values, rel=1e-4, abs=1e-5)


def test_joints_and_reduced_shafts_agree():
    box = smooth_box()
    joints = exugear.build(box, plan=exugear.plan(box).with_joints())
    for drive in ("held", "free"):
        data = [exugear.modes(model, load=150.0, drive=drive) for model in (joints, exugear.build(box))]
        assert data[0]["frequency"].values == pytest.approx(data[1]["frequency"].values, rel=1e-5)
        assert float(abs(data[0]["shape"].sel(coordinate=["x", "y", "z", "tilt_x", "tilt_y"])).max()) < 1e-9


@pytest.mark.parametrize("node", [exu.NodeType.RotationRxyz, exu.NodeType.RotationEulerParameters])
def test_bodies_with_any_rotation_have_the_eigenvalues_of_exudyn(node):
    container = exu.SystemContainer()
    mbs, pair = container.AddSystem(), paper_pair()
    inertia = RigidBodyInertia(mass=3.0, inertiaTensor=np.diag([5e-3, 5e-3, 9e-3]))
    ground, bodies, springs = mbs.CreateGround(), [], np.diag([1e9, 1e9, 1e9, 1e6, 1e6, 1e4])
    for name, position in (("pinion", [0, 0, 0]), ("wheel", [pair.a, 0, 0])):
        body = mbs.CreateRigidBody(name=name, referencePosition=position, inertia=inertia, nodeType=node)
        mbs.CreateRigidBodySpringDamper(itemNumbers=[ground, body], localPosition0=position, stiffness=springs)
        bodies.append(body)
    mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=linear_law())
    marker = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=bodies[0]))
    mbs.AddLoad(eii.Torque(markerNumber=marker, loadVector=[0, 0, 20.0]))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    mbs.SolveStatic(settings, updateInitialValues=True)
    by_exudyn = mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)[0]
    assert exugear.modes(mbs, phase=0.0)["frequency"].values == pytest.approx(by_exudyn, rel=1e-6)
    assert container


def test_data_are_kept_in_files(tmp_path):
    data = exugear.modes(three_shafts(), load=150.0, speed=300.0)
    data.to_netcdf(tmp_path / "modes.nc")
    with xr.open_dataset(tmp_path / "modes.nc") as loaded_data:
        xr.testing.assert_allclose(loaded_data, data)
    assert all({"units", "long_name"} <= set(variable.attrs) for variable in data.data_vars.values())
    assert list(data["shaft"].values) == ["input", "middle", "output", "input rotor"]


def states(mbs) -> list[np.ndarray]:
    """Initial and current states."""
    kinds = exu.ConfigurationType.Initial, exu.ConfigurationType.Current
    vectors = "ODE2Coordinates", "ODE2Coordinates_t", "ODE2Coordinates_tt", "AECoordinates"
    return [getattr(mbs.systemData, f"Get{name}")(kind) for kind in kinds for name in vectors]


def test_state_of_the_system_is_restored_also_after_an_error():
    model = three_shafts()
    exugear.run_up(model, speed=100.0, load=50.0, duration=1e-3, progress=False)
    before, load = states(model.mbs), model.mbs.GetLoad(model.load)["load"]
    exugear.modes(model, load=150.0, speed=100.0, drive="free")
    with pytest.raises(RuntimeError, match="bearings of input-middle yield"):
        exugear.modes(model, load=1e6)
    assert all((x == y).all() for x, y in zip(before, states(model.mbs), strict=True))
    assert model.mbs.GetLoad(model.load)["load"] == load
    mbs = planets(3)
    before = states(mbs)
    exugear.modes(mbs)
    assert all((x == y).all() for x, y in zip(before, states(mbs), strict=True))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"load": 0.0}, "load must be finite and not 0"),
        ({"load": None}, "load must be the torque"),
        ({"load": 1e6}, "extend the map"),
        ({"speed": -1.0}, r"speed must lie in \[0"),
        ({"phase": 2.0}, "phase must lie in"),
        ({"drive": "loose"}, 'drive must be "held" or "free"'),
    ],
)
def test_conditions_that_make_no_sense_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        exugear.modes(pair_of_shafts(), **{"load": 150.0} | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"load": 1.0}, "load must be None for a hand-built system"),
        ({"speed": 1.0}, "speed must be 0 for a hand-built system"),
        ({"drive": "free"}, 'drive must be "held" for a hand-built system'),
    ],
)
def test_hand_built_systems_bring_their_own_conditions(changes, message):
    with pytest.raises(ValueError, match=message):
        exugear.modes(planets(3), **changes)


def test_systems_without_pressed_teeth_are_refused():
    gears = planetary_set.build()
    with pytest.raises(ValueError, match="model must be assembled"):
        exugear.modes(gears.mbs)
    gears.mbs.Assemble()
    q = np.zeros(gears.mbs.systemData.ODE2Size())
    q[gears.index("sun") + 2] = q[gears.index("ring") + 2] = -1e-4
    gears.mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
    with pytest.raises(ValueError, match="no teeth are pressed"):
        exugear.modes(gears.mbs)
    gears.mbs.systemData.SetODE2Coordinates(np.full(q.size, 1e-20), exu.ConfigurationType.Initial)
    with pytest.raises(ValueError, match="no teeth are pressed"):
        exugear.modes(gears.mbs)
    with pytest.raises(ValueError, match=r"mbs.SolveStatic\(updateInitialValues=True\)"):
        exugear.modes(gears.mbs)
    container = exu.SystemContainer()
    empty = container.AddSystem()
    empty.Assemble()
    with pytest.raises(ValueError, match="model holds no gear contact"):
        exugear.modes(empty)
