"""Friction between the teeth: balance, dissipation, mirror images."""

import exudyn as exu
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import InertiaCuboid, RotXYZ2RotationMatrix
from friction_cases import MU, SPUR, N, friction_for, unlike_pair
from paper_gears import paper_gear
from scenes import K, linear_law, wrench
from spatial_meshes import (
    PAIRS,
    attitudes,
    bodies_of_kinds,
    frame_in_space,
    friction_in_space,
    friction_of_spins,
    law_of,
    mesh_in_space,
)

import exugear
import fem
from fem.units import deg, mm, um

NONE = (0.0,) * 6
LAW = linear_law(reach=9e-3)


def spun(pair, friction, spins, speeds, *, phase=0.0, direction=1, law=LAW):
    """Torques on two bodies that spin."""
    return friction_of_spins(pair, law, friction, phase, direction, spins, speeds)


@pytest.mark.parametrize("direction", [1, -1])
def test_mean_power_over_a_mesh_cycle_is_the_loss(direction):
    pair = unlike_pair()
    friction, phases = friction_for(pair), np.arange(N) / N
    speeds = direction * 300 * np.array([1, -pair.pinion.z / pair.wheel.z])
    lead, force = np.array([direction * 8 * um / pair.pinion.r_b, 0]), K * 8 * um
    shift = lead[0] * direction * pair.pinion.z / (2 * np.pi)
    torques = np.array([spun(pair, friction, lead, speeds, phase=p - shift, direction=direction) for p in phases])
    power = torques @ speeds
    assert power.max() < 0
    assert -power.mean() == pytest.approx(friction.loss(pair) * force * pair.pinion.r_b * 300, rel=1e-9)


def test_single_contact_jumps_at_the_pitch_point():
    """The friction force reverses: its torque on either gear jumps by 2 mu F r_b tan(alpha), without loss there."""
    friction, lead, force = friction_for(SPUR), 8 * um / SPUR.pinion.r_b, K * 8 * um
    shift = lead * SPUR.pinion.z / (2 * np.pi)
    before, at, behind = (spun(SPUR, friction, (lead, 0), (90, -90), phase=p - shift) for p in (-1 / N, 0, 1 / N))
    jump = 2 * MU * force * SPUR.pinion.r_b * np.tan(SPUR.alpha_wt)
    assert behind - before == pytest.approx([-jump, -jump], rel=1e-9)
    assert np.abs(at).max() < 1e-2 * jump
    slid = SPUR.p_bt / N * MU * force
    assert (before + behind) / 2 == pytest.approx([-slid, slid], rel=1e-3)


def test_efficiency_of_one_pair_of_teeth():
    """Statics of one contact at s: the levers of its friction are r_b tan(alpha) + s and r_b tan(alpha) - s."""
    friction, r_b, tan_a = friction_for(SPUR), SPUR.pinion.r_b, np.tan(SPUR.alpha_wt)
    force, lead = K * 8 * um, 8 * um / SPUR.pinion.r_b
    shift = lead * SPUR.pinion.z / (2 * np.pi)
    for phase in (20 / N, 100 / N):
        s = phase * SPUR.p_bt
        on_pinion, on_wheel = spun(SPUR, friction, (lead, 0), (90, -90), phase=phase - shift)
        assert on_pinion == pytest.approx(-MU * force * (r_b * tan_a + s), rel=1e-9)
        assert on_wheel == pytest.approx(-MU * force * (r_b * tan_a - s), rel=1e-9)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(6))
def test_forces_and_moments_balance_in_every_attitude(name, seed):
    pair = PAIRS[name]
    reference, q, v = attitudes(pair, seed)
    v[0, 5] = 40.0
    frame = frame_in_space(pair, reference, 0.2)
    forces = friction_in_space(pair, LAW, friction_for(pair), frame, *q, *v)
    first, second = (wrench(r, x, f) for r, x, f in zip(reference, q, forces, strict=True))
    assert np.abs(first[3:]).max() > 1
    assert np.abs(first + second).max() < 1e-12 * np.abs(first).max()
    _, force, pushed, *_ = mesh_in_space(LAW, frame, *q, *np.zeros((2, 6)))
    normal = wrench(reference[0], q[0], pushed)[:3]
    assert abs(first[:3] @ normal) <= 1e-4 * np.linalg.norm(first[:3]) * np.linalg.norm(normal)
    assert np.linalg.norm(first[:3]) <= MU * np.linalg.norm(normal) * (1 + 1e-12)
    assert np.linalg.norm(normal) == pytest.approx(abs(force) / np.cos(pair.beta_b), rel=1e-4)


def rates(reference, q, pole, twist, spin) -> np.ndarray:
    """Velocity (6) of an Rxyz body that turns with `twist` (3) and by `spin` about z, at rest in the pole."""
    a, b = reference[3] + q[3], reference[4] + q[4]
    g = np.c_[[1, 0, 0], [0, np.cos(a), np.sin(a)], RotXYZ2RotationMatrix([a, b, 0])[:, 2]]
    omega = twist + np.array([0, 0, spin])
    return np.r_[np.cross(omega, reference[:3] + q[:3] - pole), np.linalg.solve(g, omega)]


def axis(reference, q) -> np.ndarray:
    """Direction of the axis of an Rxyz body."""
    return RotXYZ2RotationMatrix([*(reference[3:5] + q[3:5]), 0.0])[:, 2]


def pitch_point(pair, reference, q) -> np.ndarray:
    """On the line from the pinion's centre to the wheel's axis in the mid-plane of the pinion."""
    (c_1, c_2), (z_1, z_2) = reference[:, :3] + q[:, :3], (axis(*body) for body in zip(reference, q, strict=True))
    line = c_2 - c_1 - (c_2 - c_1) @ z_1 / (z_2 @ z_1) * z_2
    return c_1 + pair.pinion.r_b / (pair.pinion.r_b + pair.wheel.r_b) * line


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(6))
def test_friction_dissipates_power_for_any_motion(name, seed):
    """It is the power of the moment alone: there is none in the rolling of the pitch point or a common rotation."""
    pair, random = PAIRS[name], np.random.default_rng(seed + 100)
    reference, q, _ = attitudes(pair, seed)
    spins, twist = random.normal(size=2) * 60, random.normal(size=3)
    frame = frame_in_space(pair, reference, 0.2)
    pole = pitch_point(pair, reference, q)
    v = [rates(r, x, pole, twist, spin) for r, x, spin in zip(reference, q, spins, strict=True)]
    forces = friction_in_space(pair, LAW, friction_for(pair), frame, *q, *v)
    power = sum(np.dot(f, x) for f, x in zip(forces, v, strict=True))
    total = wrench(reference[1], q[1], forces[1])
    moment = total[3:] - np.cross(pole, total[:3])
    assert np.linalg.norm(np.cross(moment, axis(reference[0], q[0]))) < 1e-9 * abs(moment[2])
    assert power == pytest.approx(-moment[2] * (spins[0] - spins[1]), rel=1e-9)
    assert power < 0


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_spins_and_bodies_in_space_agree(name, direction, side):
    pair, law, reference = PAIRS[name], linear_law(backlash=50 * um, reach=9e-3), np.zeros((2, 6))
    reference[1, 0] = pair.a
    friction = friction_for(pair)
    frame = frame_in_space(pair, reference, 0.1, direction)
    lead = direction * (side * 60 - 25) * um
    spins = 7.3, -7.3 * pair.pinion.r_b / pair.wheel.r_b + lead / pair.wheel.r_b
    q, v = [(*NONE[:5], spin) for spin in spins], [(*NONE[:5], speed) for speed in (3.0, -1.0)]
    on_pinion, on_wheel = friction_in_space(pair, law, friction, frame, *q, *v)
    torques = spun(pair, friction, spins, (3.0, -1.0), phase=0.1, direction=direction, law=law)
    assert abs(torques).min() > 0
    assert (on_pinion[5], on_wheel[5]) == pytest.approx(torques, rel=1e-9)


@pytest.mark.parametrize("pair", [SPUR, unlike_pair(12 * deg)])
def test_directions_are_mirror_images(pair):
    friction, spins, speeds = (
        friction_for(pair),
        np.array([0.31, -0.31 * pair.pinion.z / pair.wheel.z]),
        np.array([9, -3]),
    )
    spins[0] += 8 * um / pair.pinion.r_b
    torques = spun(pair, friction, spins, speeds, phase=0.1)
    assert spun(pair, friction, -spins, -speeds, phase=0.1, direction=-1) == pytest.approx(-torques, rel=1e-9)
    assert spun(pair, friction, spins, -speeds, phase=0.1) == pytest.approx(-torques, rel=1e-9)


@pytest.mark.parametrize("direction", [1, -1])
def test_friction_of_the_back_flank_is_that_of_a_driving_flank(direction):
    pair, backlash, back = SPUR, 100 * um, 0.37
    law = linear_law(backlash=backlash, reach=9e-3)
    law = exugear.MeshForce(law.phase, law.deflection, law.force_table, backlash=backlash, back_phase=back)
    friction, turned, depth = friction_for(pair), 0.02, 8 * um
    behind = -direction * (backlash + depth) / pair.wheel.r_b
    ahead = -direction * depth / pair.wheel.r_b
    speeds = direction * np.array([9.0, -3.0])
    far = spun(pair, friction, (turned, -turned + behind), speeds, phase=0.1, direction=direction, law=law)
    near = spun(pair, friction, (turned, -turned + ahead), speeds, phase=back - 0.1, direction=-direction, law=law)
    assert abs(far).min() > 0
    assert far == pytest.approx(near, rel=1e-6)


def test_no_friction_without_coefficient_force_or_sliding():
    lead = 8 * um / SPUR.pinion.r_b
    assert not spun(SPUR, friction_for(SPUR, 0.0), (lead, 0), (9, -9), phase=0.3).any()
    assert not spun(SPUR, friction_for(SPUR), (-lead, 0), (9, -9), phase=0.3).any()
    assert not spun(SPUR, friction_for(SPUR), (lead, 0), (9, 9), phase=0.3).any()
    fast, slow = (spun(SPUR, friction_for(SPUR, speed=2.0), (lead, 0), (x, 0), phase=0.3) for x in (200, 1))
    assert slow == pytest.approx(np.tanh(0.5) * fast)


@pytest.mark.parametrize("kinds", [("spin", "spin"), ("planar", "spatial"), ("spatial", "spin")])
def test_friction_between_bodies_of_any_kind(kinds):
    mbs = exu.SystemContainer().AddSystem()
    bodies = bodies_of_kinds(mbs, kinds)
    friction, law, lead = friction_for(SPUR), LAW, 8 * um / SPUR.pinion.r_b
    given = {"itemNumbers": bodies, "pair": SPUR, "force": law, "phase": 0.2}
    number = mbs.CreateGearContact(name="rub", **given, friction=friction)
    mbs.Assemble()
    turning = {"spin": 0, "planar": 2, "spatial": 5}
    sizes = {"spin": 1, "planar": 3, "spatial": 6}
    spins = turning[kinds[0]], sizes[kinds[0]] + turning[kinds[1]]
    q, v = np.zeros(sum(sizes[kind] for kind in kinds)), np.zeros(sum(sizes[kind] for kind in kinds))
    q[spins[0]], v[list(spins)] = lead, (20, -20)
    mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
    mbs.systemData.SetODE2Coordinates_t(v, exu.ConfigurationType.Initial)
    solver, settings = exu.MainSolverImplicitSecondOrder(), exu.SimulationSettings()
    settings.solution.file.write = False
    solver.InitializeSolver(mbs, settings)
    solver.ComputeODE2RHS(mbs)
    torques = np.array(solver.GetSystemResidual())[list(spins)]
    solver.FinalizeSolver(mbs, settings)
    assert mbs.GetObject(number)["name"] == "rub"
    mesh_torque = law(0.2, 8 * um) * SPUR.pinion.r_b
    rubbing = spun(SPUR, friction, (lead, 0), (20, -20), phase=0.2)
    assert torques == pytest.approx(rubbing - mesh_torque, rel=1e-9)
    assert np.abs(rubbing).min() > 1


def test_jacobian_is_the_slope_of_the_torques():
    mbs = exu.SystemContainer().AddSystem()
    bodies = bodies_of_kinds(mbs, ("spin", "spin"))
    given = {"itemNumbers": bodies, "pair": SPUR, "force": LAW, "phase": 0.2}
    contact = mbs.GetObject(mbs.CreateGearContact(**given, friction=friction_for(SPUR)))
    forces, jacobian = (contact[f"{name}UserFunction"]["function"] for name in ("force", "jacobian"))
    q, v = np.array([8 * um / SPUR.pinion.r_b, 0]), np.array([0.2, -0.1])
    for factors, nudge in (((1.0, 0.0), [0, 1e-8]), ((0.0, 1.0), None)):
        step = np.array(nudge or [0, 1e-4])
        states = [(q + s * step, v) if nudge else (q, v + s * step) for s in (1, -1)]
        ahead, behind = (np.array(forces(mbs, 0.0, 0, *state)) for state in states)
        slope = -(ahead - behind) / (2 * step[1])
        assert np.array(jacobian(mbs, 0.0, 0, q, v, *factors))[:, 1] == pytest.approx(slope, rel=1e-4)


def test_friction_uses_the_mesh_force_at_the_offsets_of_the_bodies():
    law, reference = law_of(), np.zeros((2, 6))
    reference[1, 0] = SPUR.a
    frame, friction = frame_in_space(SPUR, reference, 0.2), friction_for(SPUR)
    plain = law.at(a=SPUR.a, misalignment=0.0)
    spins = (*NONE[:5], 8 * um / SPUR.pinion.r_b), NONE, (*NONE[:5], 9.0), NONE
    forces, expected = (np.array(friction_in_space(SPUR, x, friction, frame, *spins)) for x in (law, plain))
    assert forces == pytest.approx(expected, rel=1e-6, abs=1e-9)


def two_bodies(mbs) -> list[int]:
    data = {"inertia": InertiaCuboid(7850, [0.1, 0.1, 0.02]), "nodeType": exu.NodeType.RotationRxyz}
    return [mbs.CreateRigidBody(referencePosition=[x, 0, 0], **data) for x in (0, SPUR.a)]


def test_friction_is_an_exugear_mesh_friction():
    mbs = exu.SystemContainer().AddSystem()
    with pytest.raises(ValueError, match=r"friction must be an exugear.MeshFriction, got float; make it with"):
        mbs.CreateGearContact(itemNumbers=two_bodies(mbs), pair=SPUR, force=linear_law(), friction=0.05)


@pytest.mark.parametrize(
    ("changes", "difference"),
    [
        ({"gear": {"b": 40 * mm}}, "b of the pinion"),
        ({"gear": {"s_n": 3.9 * mm}}, "s_n of the pinion"),
        ({"gear": {"d_a": 154 * mm}}, "d_a of the pinion"),
        ({"a": 150.2 * mm}, "a"),
    ],
)
def test_friction_of_another_pair_is_refused_by_all_doors(changes, difference):
    """Also of one with equal teeth of another width, thickness, tip circle or centre distance."""
    gears = [paper_gear(**changes.get("gear", {})), paper_gear()]
    other = fem.GearPair(*gears, a=changes.get("a", 150 * mm))
    message = rf"pair must be .*, to which the friction belongs.*which differs in {difference}\b"
    friction, mbs = friction_for(other), exu.SystemContainer().AddSystem()
    shafts = [exugear.Shaft(name, {0.0: paper_gear()}) for name in ("fast", "slow")]
    given = {"itemNumbers": two_bodies(mbs), "pair": SPUR, "force": linear_law()}
    with pytest.raises(ValueError, match=message):
        mbs.CreateGearContact(**given, friction=friction)
    with pytest.raises(ValueError, match=message):
        exugear.Stage(*shafts, linear_law(), pair=SPUR, friction=friction)
    mbs.CreateGearContact(**given)
    with pytest.raises(ValueError, match=message):
        mbs.CreateGearFriction(**given, friction=friction)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pair": None}, "pair must be a fem.GearPair"),
        ({"pair": unlike_pair()}, r"pair must be .*, that of gear contact 2, got .*, which differs in z of the pinion"),
        ({"phase": 0.3}, r"phase must be 0.2 as that of gear contact 2, got 0.3; pass friction= to CreateGearContact"),
        ({"direction": -1}, "direction must be 1 as that of gear contact 2, got -1"),
        ({"force": linear_law((2 * K,) * 3)}, "force must be that of gear contact 2"),
        ({"localPositions": [[0, 0, 1e-3], [0, 0, 0]]}, "localPositions and localAxes must be those of"),
        ({"itemNumbers": [1, 0]}, r"there is none on \[1, 0\]; pass friction= to CreateGearContact"),
        ({"itemNumbers": [0, 1, 2]}, "also for gears on a carrier"),
    ],
)
def test_the_former_way_refuses_what_the_contact_has_not(changes, message):
    mbs = exu.SystemContainer().AddSystem()
    given = {"itemNumbers": two_bodies(mbs), "pair": SPUR, "force": linear_law(), "phase": 0.2}
    assert int(mbs.CreateGearContact(**given)) == 2
    given["friction"] = friction_for(SPUR)
    with pytest.raises(ValueError, match=message):
        mbs.CreateGearFriction(**given | changes)
    with pytest.warns(DeprecationWarning, match="CreateGearFriction is deprecated; pass friction= to"):
        mbs.CreateGearFriction(**given)
    with pytest.raises(ValueError, match="gear contact 2 has friction already"):
        mbs.CreateGearFriction(**given)


def test_both_ways_rub_alike_and_a_carrier_takes_part():
    """On a carrier at rest the torques on the gears are those without it, and it bears what they leave."""
    torques = []
    for carrier, former in ((False, False), (False, True), (True, False)):
        mbs = exu.SystemContainer().AddSystem()
        bodies = bodies_of_kinds(mbs, ("spin",) * 2) + (bodies_of_kinds(mbs, ("spin",) * 2)[:1] if carrier else [])
        given = {"itemNumbers": bodies, "pair": SPUR, "force": LAW, "phase": 0.2}
        mbs.CreateGearContact(**given, friction=None if former else friction_for(SPUR))
        if former:
            with pytest.warns(DeprecationWarning):
                mbs.CreateGearFriction(**given, friction=friction_for(SPUR))
        mbs.Assemble()
        size = mbs.systemData.ODE2Size()
        system = mbs.systemData
        system.SetODE2Coordinates([8 * um / SPUR.pinion.r_b] + [0] * (size - 1), exu.ConfigurationType.Initial)
        system.SetODE2Coordinates_t([20, -20] + [0] * (size - 2), exu.ConfigurationType.Initial)
        solver, settings = exu.MainSolverImplicitSecondOrder(), exu.SimulationSettings()
        settings.solution.file.write = False
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        torques.append(np.array(solver.GetSystemResidual())[:3])
        solver.FinalizeSolver(mbs, settings)
    new, former, carried = torques
    assert former == pytest.approx(new, rel=1e-12)
    assert carried[:2] == pytest.approx(new[:2], rel=1e-12)
    assert carried[2] == pytest.approx(-new[:2].sum(), rel=1e-12)
    assert abs(new[0] - new[1]) > 0.5
