"""A mesh between bodies that move in space: helical forces, offsets, orbits, and energy."""

import numpy as np
import pytest
from exudyn.rigidBodyUtilities import RotXYZ2RotationMatrix
from scenes import K, linear_law, smooth_law, smooth_map, wrench
from spatial_meshes import (
    BETA,
    OFFSETS,
    PAIRS,
    SPUR,
    attitudes,
    frame_in_space,
    law_of,
    mesh_in_space,
    mesh_of_spins,
)

import exugear
from fem.units import mm, um

NONE = (0.0,) * 6
#: Angle between the axes [rad], to first order in which the geometry holds.
RELATIVE_TILT = 1e-4


def twist(reference, q, v) -> np.ndarray:
    """Velocity of the body's point at the origin and angular velocity (6)."""
    a, b = reference[3] + q[3], reference[4] + q[4]
    turn = np.c_[[1, 0, 0], [0, np.cos(a), np.sin(a)], RotXYZ2RotationMatrix([a, b, 0])[:, 2]] @ v[3:]
    return np.r_[v[:3] - np.cross(turn, reference[:3] + q[:3]), turn]


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(6))
def test_forces_moments_and_power_balance_in_every_attitude(name, seed):
    pair = PAIRS[name]
    reference, q, v = attitudes(pair, seed)
    frame = frame_in_space(pair, reference, 0.2)
    law = linear_law(reach=9e-3)
    _, force, on_pinion, on_wheel, *_ = mesh_in_space(law, frame, *q, *v)
    wrenches = [wrench(r, x, f) for r, x, f in zip(reference, q, (on_pinion, on_wheel), strict=True)]
    powers = [twist(r, x, u) @ w for r, x, u, w in zip(reference, q, v, wrenches, strict=True)]
    assert np.sum(powers) == pytest.approx(
        np.r_[on_pinion, on_wheel] @ v.ravel(), rel=1e-9, abs=1e-12 * np.abs(powers).max()
    )
    assert abs(force) > 100
    assert np.abs(wrenches[0] + wrenches[1]).max() < 1e-12 * np.abs(wrenches[0]).max()
    assert np.linalg.norm(wrenches[0][:3]) * np.cos(pair.beta_b) == pytest.approx(abs(force), rel=RELATIVE_TILT)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("law", [law_of(), law_of().at(a=SPUR.a, misalignment=-5e-5)], ids=["axes", "expanded"])
def test_all_forces_are_the_slope_of_the_potential_in_every_attitude(law, seed, direction, measured):
    """Also in tilts and along the axes, on helical teeth, with the force centroid beside mid-plane."""
    pair = PAIRS["helical"]
    random = np.random.default_rng(seed)
    reference = np.zeros((2, 6))
    reference[:, 3:5] = random.normal(size=2) * 0.02
    turn, axial = RotXYZ2RotationMatrix([*reference[0, 3:5], 0.0]), np.array([10, 15]) * mm
    reference[1, :3] = turn @ [pair.a, 0, axial[0] - axial[1] + 2 * mm]
    frame = frame_in_space(pair, reference, 0.3, direction, axial)
    q = random.normal(size=12) * np.tile([*[4 * um] * 3, *[3e-5] * 2, 0.0], 2)
    q[5] = -direction * 100 * um / pair.pinion.r_b
    apart = mesh_in_space(law, frame, q[:6], q[6:], NONE, NONE).deflection
    q[5] += (12 * um - apart) * direction / pair.pinion.r_b

    def mesh(x):
        return mesh_in_space(law, frame, x[:6], x[6:], NONE, NONE)

    steps = np.tile([*[2e-8] * 3, *[3e-7] * 3], 2)
    slope = [
        (mesh(q + h * e).energy - mesh(q - h * e).energy) / (2 * h) for h, e in zip(steps, np.eye(12), strict=True)
    ]
    forces = np.r_[mesh(q).pinion, mesh(q).wheel]
    assert mesh(q).force > 500
    scale = np.tile([*[np.abs(forces[:3]).max()] * 3, *[np.abs(forces[3:6]).max()] * 3], 2)
    row = "all forces of a contact in any attitude, with all offset axes, helical"
    measured(row, (np.abs(forces + slope) / scale).max(), 1e-6)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("direction", [1, -1])
def test_generalized_forces_are_the_slope_of_the_energy(name, side, direction):
    """First order in the tilts: about aligned axes."""
    pair = PAIRS[name]
    reference = np.zeros((2, 6))
    reference[1, :2] = pair.a * np.cos(0.7), pair.a * np.sin(0.7)
    law = linear_law(backlash=100 * um, reach=9e-3)
    frame = frame_in_space(pair, reference, 0.0, direction, [0.01, 0.01])
    q = np.zeros(12)
    q[5] = direction * (side * 200 - 50) * um / pair.pinion.r_b

    def energy(x):
        return mesh_in_space(law, frame, x[:6], x[6:], NONE, NONE)[1] ** 2 / (2 * K)

    _, _, on_pinion, on_wheel, *_ = mesh_in_space(law, frame, q[:6], q[6:], NONE, NONE)
    h = 2e-7
    slope = np.array([(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(12)])
    assert np.r_[on_pinion, on_wheel] == pytest.approx(-slope, rel=1e-6, abs=2e-3 if name == "ring" else 1e-3)
    if side == 1:
        force = law(0.0, 150 * um)
        ahead, behind = (
            np.array([mesh_in_space(law, frame, *np.split(q + s * e, 2), NONE, NONE).deflection for e in np.eye(12)])
            for s in (h, -h)
        )
        row = (ahead - behind) / (2 * h)
        assert np.r_[on_pinion, on_wheel] == pytest.approx(-force * row, rel=1e-4, abs=1e-6 * force)


@pytest.mark.parametrize("direction", [1, -1])
def test_axial_force_of_a_helical_pair(direction):
    """F_t tan(beta) at the reference circle; a right-handed pinion that drives counter-clockwise is pushed up."""
    pair = PAIRS["helical"]
    reference = np.zeros((2, 6))
    reference[1, 0] = pair.a
    frame = frame_in_space(pair, reference, 0.0, direction)
    turned = (*NONE[:5], direction * 8 * um / pair.pinion.r_b)
    _, force, on_pinion, on_wheel, *_ = mesh_in_space(linear_law(), frame, turned, NONE, NONE, NONE)
    f_t = abs(on_pinion[5]) / pair.pinion.r
    assert on_pinion[2] == pytest.approx(direction * f_t * np.tan(BETA), rel=1e-6)
    assert on_wheel[2] == -on_pinion[2]
    assert abs(on_pinion[5]) == pytest.approx(force * pair.pinion.r_b, rel=1e-12)


def test_axial_shift_turns_a_helical_gear():
    pair = PAIRS["helical"]
    reference = np.zeros((2, 6))
    reference[1, 0] = pair.a
    frame = frame_in_space(pair, reference)
    lifted = (0.0, 0.0, 50 * um, 0.0, 0.0, 0.0)
    deflection, *_ = mesh_in_space(linear_law(), frame, NONE, lifted, NONE, NONE)
    assert deflection == pytest.approx(50 * um * np.tan(pair.beta_b), rel=1e-12)


def test_force_of_misaligned_axes_acts_at_the_centroid_of_the_springs():
    """Tilt about the line of action's normal: force and moment are those of springs across the width.

    The force is square to the wheel's axis, the centroid counts along the pinion's: the moment about the pitch point
    holds to first order in the tilt.
    """
    law, reference = law_of(backlash=1e-4), np.zeros((2, 6))
    reference[1, 0] = SPUR.a
    frame = frame_in_space(SPUR, reference)
    alpha, gamma, lead = SPUR.alpha_wt, 1e-4, 8 * um
    n = np.array([np.sin(alpha), np.cos(alpha)])
    tilts = -gamma * n[1], gamma * n[0]
    turned = (*NONE[:5], lead / SPUR.pinion.r_b)
    _, force, _, on_wheel, (a, misalignment, axial), centroid, *_ = mesh_in_space(
        law, frame, turned, (0.0, 0.0, 0.0, *tilts, 0.0), NONE, NONE
    )
    assert (a, misalignment, axial) == pytest.approx((SPUR.a, gamma, 0.0), rel=1e-6, abs=1e-9)
    assert force == pytest.approx(K * lead, rel=1e-4)
    assert centroid == pytest.approx(-gamma * (20 * mm) ** 2 / 12 / lead, rel=1e-3)
    total = wrench(reference[1], (*NONE[:3], *tilts, 0.0), on_wheel)
    pitch_point = np.array([SPUR.pinion.r_b / np.cos(alpha), 0.0, 0.0])
    moment = total[3:] - np.cross(pitch_point, total[:3])
    assert np.hypot(*moment[:2]) == pytest.approx(force * abs(centroid), rel=2e-3)


def test_law_with_offsets_interpolates_between_their_values():
    law, lead = law_of(), 9 * um
    for a in OFFSETS["a"]:
        assert law(0.3, lead, a=a, misalignment=-5e-5) == pytest.approx(K * lead, rel=1e-5)
    assert law(0.1, lead, a=SPUR.a, misalignment=7e-5) == pytest.approx(K * lead, rel=2e-4)
    plain = law.at(a=SPUR.a, misalignment=7e-5)
    assert plain(0.1, lead) == pytest.approx(law(0.1, lead, a=SPUR.a, misalignment=7e-5), rel=1e-6)
    assert law.deflection_at(0.1, K * lead, a=SPUR.a, misalignment=7e-5) == pytest.approx(lead, rel=2e-4)


def test_force_stays_positive_between_offsets_far_apart():
    """Springs across the width at misalignments that differ by several times what the deflection closes."""
    law = law_of(tilts=np.array([0, 1, 3, 6]) * 1e-4)
    for tilt in np.linspace(0, 6e-4, 37):
        unloaded = law.at(a=SPUR.a, misalignment=tilt).unloaded(0.0)[0]
        force = law(0.0, unloaded + np.geomspace(1e-9, 30 * um, 40), a=SPUR.a, misalignment=tilt)
        assert (np.diff(force) > 0).all() and force[0] > 0


def test_offsets_beyond_the_map_are_refused():
    law = law_of()
    with pytest.raises(ValueError, match=r"misalignment 0.0003 lies beyond the map's axis from -0.0002 to 0.0002"):
        law(0.0, 9 * um, a=SPUR.a, misalignment=3e-4)
    with pytest.raises(ValueError, match=r"a 0.151 lies beyond"):
        law.at(a=151 * mm, misalignment=0.0)
    with pytest.raises(ValueError, match="offsets must be"):
        law(0.0, 9 * um)


@pytest.mark.parametrize("turns", [0.3, 2.0, 1e4])
@pytest.mark.parametrize("name", PAIRS)
def test_an_orbit_of_the_whole_pair_changes_nothing(name, turns):
    """The planet's case: both gears and the line of centres turn together."""
    pair, angle = PAIRS[name], 2 * np.pi * turns
    reference = np.zeros((2, 6))
    reference[1, 0] = pair.a
    frame = frame_in_space(pair, reference, 0.2)
    lead = 8 * um / pair.pinion.r_b
    at = pair.a * np.cos(angle) - pair.a, pair.a * np.sin(angle)
    law = linear_law((0.5 * K, K, 1.5 * K))
    orbit = mesh_in_space(law, frame, (*NONE[:5], angle + lead), (*at, *NONE[:3], angle), NONE, NONE)
    rest = mesh_in_space(law, frame, (*NONE[:5], lead), NONE, NONE, NONE)
    assert orbit[:2] == pytest.approx(rest[:2], rel=1e-9 + 1e-9 * turns)


@pytest.mark.parametrize("name", ["spur", "helical"])
def test_conserving_forces_are_the_slope_of_one_potential(name):
    """Work around a closed loop of spins and displacements is 0; without the torque from dU/dphase it is not."""
    pair, law = PAIRS[name], smooth_law(conserves=True, backlash=np.inf)
    plain = smooth_law(conserves=False, backlash=np.inf)
    reference = np.zeros((2, 6))
    reference[1, 0] = pair.a
    frame = frame_in_space(pair, reference)
    phase = 2 * np.pi * (np.arange(1000) + 0.5) / 1000
    turn = pair.pinion.r_b / pair.wheel.r_b
    lead, pitch = (8 + 4 * np.cos(phase)) * um, (0.3 + 0.1 * np.sin(phase)) * 2 * np.pi / 57
    slide = 3 * um * np.cos(phase)
    path = np.zeros((phase.size, 12))
    path[:, 0], path[:, 5] = slide, pitch
    path[:, 11] = -pitch * turn + lead / pair.wheel.r_b

    def work(force_law):
        step = np.roll(path, -1, axis=0) - path
        middle = path + step / 2
        forces = [mesh_in_space(force_law, frame, q[:6], q[6:], NONE, NONE) for q in middle]
        return sum(np.r_[f[2], f[3]] @ s for f, s in zip(forces, step, strict=True))

    scale = float(plain(0.0, 12 * um)) * 8 * um
    assert abs(work(law)) < 2e-5 * scale
    assert abs(work(plain)) > 2e-3 * scale


def test_the_former_law_has_the_same_force():
    law, former = (smooth_law(conserves=c, backlash=np.inf) for c in (True, False))
    phase, deflection = np.meshgrid(np.linspace(0, 1, 41), np.linspace(1, 20, 30) * um)
    assert law(phase, deflection) == pytest.approx(former(phase, deflection), rel=1e-12)


def test_conserving_spins_agree_with_bodies_in_space():
    law = smooth_law(conserves=True)
    reference = np.zeros((2, 6))
    reference[1, 0] = SPUR.a
    lead = 8 * um / SPUR.pinion.r_b
    for spins in ((0.02 + lead, -0.02), (0.07, -0.07 - SPUR.backlash / SPUR.wheel.r_b - lead)):
        frame, (q_1, q_2) = frame_in_space(SPUR, reference, 0.1), ((*NONE[:5], spin) for spin in spins)
        space = mesh_in_space(law, frame, q_1, q_2, NONE, NONE)
        spin = mesh_of_spins(law, SPUR, 0.1, spins, (0.0, 0.0))
        assert (space[2][5], space[3][5]) == pytest.approx(spin[2], rel=1e-9)
        assert spin[2][0] != pytest.approx(spin[2][1], rel=1e-4)


def test_secant_law_has_the_stiffness_at_its_torque():
    ste = smooth_map()
    law, torque = exugear.MeshForce.secant(ste, 150.0), 150.0
    te = ste["te"].sel(torque=torque).values
    assert law(ste["phase"].values, te) * SPUR.pinion.r_b == pytest.approx(np.full(te.size, torque), rel=1e-3)
    assert law(0.2, 4 * um) == pytest.approx(2 * law(0.2, 2 * um), rel=1e-9)
    with pytest.raises(ValueError, match=r"lie in \[0, 4000\] N m of the map"):
        exugear.MeshForce.secant(ste, 1e5)
