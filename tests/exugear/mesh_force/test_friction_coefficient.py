"""Published mean coefficients of friction: values by hand in the units of the sources, limits, units, the kernel."""

from math import cos, sin

import numpy as np
import pytest
from friction_cases import N, unlike_pair
from scenes import K, linear_law
from spatial_meshes import PAIRS, friction_of_spins

import exugear
import fem
from fem.units import deg, mm, um

SCHLENK = exugear.SchlenkFriction(viscosity=10e-3, roughness=0.4 * um)
NIEMANN = exugear.NiemannFriction(viscosity=10e-3, roughness=0.4 * um)
XU = exugear.XuFriction(viscosity=10e-3, roughness=0.4 * um)
LAW = linear_law(reach=9e-3)


def fzg_c() -> fem.GearPair:
    """FZG test gears of type C: pitch circle of the pinion 73.2 mm, alpha_wt = 22.44 deg."""
    data = {"m_n": 4.5 * mm, "b": 14 * mm, "d_bore": 30 * mm}
    pinion = fem.Gear(z=16, x=0.1817, d_a=82.45 * mm, **data)
    return fem.GearPair(pinion, fem.Gear(z=24, x=0.1715, d_a=118.35 * mm, **data), a=91.5 * mm)


def at(law, pair, force: float, pitch_line_speed: float) -> float:
    """Coefficient at a transverse mesh force [N] and a pitch line speed [m/s]."""
    omega_1 = pitch_line_speed / (pair.pinion.r_b / cos(pair.alpha_wt))
    return law.power_law(pair).at(force, omega_1 * (1 + pair.pinion.z / pair.wheel.z))


def test_fzg_test_by_hand():
    """Load stage 9 at 8.3 m/s: 302 N m, F_bt/b = 637.6 N/mm, rho_redC = 8.38 mm, v_sum = 6.34 m/s, 10 mPa s, 0.4 um."""
    pair = fzg_c()
    force = 302 / pair.pinion.r_b
    assert force / 14 == pytest.approx(637.6, rel=1e-3)
    common = (637.6 / (6.336 * 8.383)) ** 0.2 * 10**-0.05
    assert at(SCHLENK, pair, force, 8.3) == pytest.approx(0.048 * common * 0.4**0.25, rel=1e-3)
    assert at(NIEMANN, pair, force, 8.3) == pytest.approx(0.045 * common * 2.2 * (0.4 / 8.383) ** 0.25, rel=1e-3)
    oil = exugear.SchlenkFriction(viscosity=10e-3, roughness=0.4 * um, lubricant_factor=0.8)
    assert at(oil, pair, force, 8.3) == pytest.approx(0.8 * at(SCHLENK, pair, force, 8.3), rel=1e-12)


def test_roughness_factors_of_niemann_and_winter_and_of_din_3990_agree():
    """X_R = 3.8 (Ra / d_1)^0.25 in the book, 2.2 (Ra / rho_redC)^0.25 in the standard."""
    pair = fzg_c()
    radius = 73.2 / 2 * sin(pair.alpha_wt) * 1.5 / 2.5
    assert pytest.approx(2.2 * (0.4 / radius) ** 0.25, rel=0.02) == 3.8 * (0.4 / 72) ** 0.25


@pytest.mark.parametrize("law", [SCHLENK, NIEMANN])
@pytest.mark.parametrize("pair", [unlike_pair(), unlike_pair(20 * deg), PAIRS["ring"]])
def test_coefficient_falls_with_speed_and_rises_with_load_within_the_limits(law, pair):
    least = 150e3 * pair.b
    assert at(law, pair, 32 * least, 10.0) == pytest.approx(2 * at(law, pair, least, 10.0), rel=1e-12)
    assert at(law, pair, least, 0.32) == pytest.approx(2 * at(law, pair, least, 10.24), rel=1e-12)
    assert at(law, pair, 0.0, 10.0) == at(law, pair, least, 10.0)
    assert at(law, pair, least, 80.0) == pytest.approx(at(law, pair, least, 50.0), rel=1e-12)
    assert 0.04 < at(law, pair, least, 0.0) < 0.15
    assert at(law, pair, least, -10.0) == at(law, pair, least, 10.0)


def forces_and_moments(pair, friction, phase: float, force: float, speed: float) -> tuple[float, float]:
    """Friction [N] and its moment about the pitch point [N m] at a mesh force [N]; speed: omega_1 - omega_2 [rad/s]."""
    lead, omega_1 = force / K / pair.pinion.r_b, speed / (1 + pair.pinion.z / pair.wheel.z)
    speeds = omega_1, omega_1 - speed
    turned = lead * pair.pinion.z / (2 * np.pi)
    on_pinion, on_wheel = friction_of_spins(pair, LAW, friction, phase - turned, 1, (lead, 0.0), speeds)
    pull = -(on_pinion + on_wheel) / (pair.pinion.r_b + pair.wheel.r_b) / np.tan(pair.alpha_wt)
    return pull, on_wheel + pair.wheel.r_b * np.tan(pair.alpha_wt) * pull


@pytest.mark.parametrize("law", [SCHLENK, NIEMANN, 0.06])
def test_friction_of_a_contact_agrees_with_the_law(law):
    """By its ratio to the friction of a constant coefficient."""
    pair = unlike_pair(12 * deg)
    friction, constant = (exugear.MeshFriction.of_pair(pair, x) for x in (law, 0.1))
    for force in (10.0, 4e3, 3e4):
        for speed in (-2000.0, 1.0, 300.0, 5e4):
            expected = friction.power_law(pair).at(force, speed) / 0.1
            (pull, moment), (pull_of_constant, moment_of_constant) = (
                forces_and_moments(pair, x, 0.1, force, speed) for x in (friction, constant)
            )
            assert pull / pull_of_constant == pytest.approx(expected, rel=1e-12)
            assert moment / moment_of_constant == pytest.approx(expected, rel=1e-12)


def test_loss_by_a_law_is_that_of_its_coefficient():
    pair = unlike_pair()
    friction = exugear.MeshFriction.of_pair(pair, SCHLENK)
    mu = at(SCHLENK, pair, 5e3, 3.0)
    omega_1 = 3.0 / (pair.pinion.r_b / cos(pair.alpha_wt))
    constant = exugear.MeshFriction.of_pair(pair, mu)
    assert friction.loss(pair, force=5e3, speed=omega_1) == pytest.approx(constant.loss(pair), rel=1e-12)
    with pytest.raises(ValueError, match="force and speed must be given"):
        friction.loss(pair)
    assert np.array_equal(friction.pull, constant.pull)
    assert friction.pull.size == N


def test_local_coefficient_by_hand():
    """1.28 GPa, S = 0.308 and V = 0.493 m/s at 3 mm beyond the pitch point of FZG type C at 637.6 N/mm, 10 mPa s."""
    pair, s = fzg_c(), 3 * mm
    rho_1, rho_2 = 36.6 * sin(pair.alpha_wt) + 3, 54.9 * sin(pair.alpha_wt) - 3
    radius = rho_1 * rho_2 / (rho_1 + rho_2) * mm
    pressure = (637.6e3 / radius * 210e9 / (2 * np.pi * 0.91)) ** 0.5 / 1e9
    u_1, u_2 = rho_1 / (36.6 * 2 * sin(pair.alpha_wt)), rho_2 / (54.9 * 2 * sin(pair.alpha_wt))
    mean, sliding = (u_1 + u_2) / 2, 2 * (u_1 - u_2) / (u_1 + u_2)
    f = -8.916465 - 0.354068 * sliding * pressure + 2.812084 * np.exp(-sliding * pressure) + 0.620305 * np.exp(0.4)
    expected = np.exp(f) * pressure**1.03303 * sliding**1.036077 * mean**-0.100601 * 10**0.752755 * radius**-0.390958
    assert XU.local(pair, s, 637.6e3) == pytest.approx(expected, rel=2e-3)
    assert 0.02 < expected < 0.06
    assert XU.local(pair, 0.0, 637.6e3) == pytest.approx(0, abs=1e-6)


def test_local_friction_is_the_sum_over_the_tooth_pairs_and_passes_the_pitch_point_without_a_jump():
    """Single contact about the pitch point: the force is mu F there, mu by the whole load."""
    pair = PAIRS["spur"]
    friction, mean = (exugear.MeshFriction.of_pair(pair, law) for law in (XU, 0.03))
    for row, force in zip(friction.pull[::6], friction.forces[::6], strict=True):
        for step in (20, 60):
            mu = XU.local(pair, step / N * pair.p_bt, force / pair.b)
            assert row[step] == pytest.approx(mu, rel=1e-3)
            assert row[-step] == pytest.approx(-XU.local(pair, -step / N * pair.p_bt, force / pair.b), rel=1e-3)
        assert np.abs(np.diff(row[:60])).max() < 0.1 * row[60]
    assert np.abs(np.diff(mean.pull[:60])).max() == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("pair", [unlike_pair(), unlike_pair(20 * deg)])
def test_a_contact_with_a_local_coefficient_interpolates_the_tables(pair):
    friction = exugear.MeshFriction.of_pair(pair, XU)
    v = friction.power_law(pair).sum_speed
    for force, speed in (
        (float(friction.forces[4]), 300.0),
        (7.7e3, 30.0),
        (3e6, 300.0),
        (1.0, 300.0),
    ):
        forces = np.array([forces_and_moments(pair, friction, i / N, force, speed) for i in range(N)])
        loss = forces[:, 1].mean() / force * abs(1 / pair.pinion.r_b + 1 / pair.wheel.r_b)
        omega_1 = speed / (1 + pair.pinion.z / pair.wheel.z)
        assert loss == pytest.approx(friction.loss(pair, force=force, speed=omega_1), rel=1e-12)
    fast, slow = (forces_and_moments(pair, friction, 0.1, 5e3, x / v)[0] for x in (10.0, 1.0))
    assert fast == pytest.approx(slow * 10**-0.100601, rel=1e-12)


def test_tables_of_a_local_coefficient_belong_to_it():
    tables = exugear.MeshFriction.of_pair(PAIRS["spur"], XU)
    for law, forces in ((XU, None), (0.05, tables.forces)):
        with pytest.raises(ValueError, match="forces and pull"):
            exugear.MeshFriction(law, tables.pull, tables.lever, forces=forces)
    with pytest.raises(ValueError, match="forces and pull"):
        exugear.MeshFriction(XU, tables.pull[0], tables.lever[0])
    with pytest.raises(ValueError, match="geometric progression"):
        exugear.MeshFriction(XU, tables.pull[:3], tables.lever[:3], forces=[1.0, 2.0, 3.0])


@pytest.mark.parametrize("law", [exugear.SchlenkFriction, exugear.NiemannFriction, exugear.XuFriction])
@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"viscosity": 20.0, "roughness": 0.4 * um}, r"pass Pa s, the dynamic viscosity: 20 mPa s are 0.02"),
        ({"viscosity": 20e-6, "roughness": 0.4 * um}, "pass Pa s"),
        ({"viscosity": 0.02, "roughness": 0.4}, r"got 400000 um; pass metres: 0.4\*um"),
        ({"viscosity": 0.02, "roughness": np.nan}, "roughness must lie"),
        ({"viscosity": 0.02, "roughness": "fine"}, "roughness must be one real number"),
    ],
)
def test_other_units_are_refused(law, data, message):
    with pytest.raises(ValueError, match=message):
        law(**data)


@pytest.mark.parametrize("distance", [5.0, 0.3, [0.0, -0.3]])
def test_no_coefficient_beyond_the_base_circles(distance):
    with pytest.raises(ValueError, match="distance must lie between the base circles"):
        exugear.XuFriction(0.02, 0.4 * um).local(unlike_pair(), distance, 1e5)


def test_other_lubricant_factors_are_refused():
    with pytest.raises(ValueError, match="lubricant_factor must lie"):
        exugear.SchlenkFriction(0.02, 0.4 * um, 10.0)
    with pytest.raises(ValueError, match="coefficient must be"):
        exugear.MeshFriction.of_pair(unlike_pair(), "oil")
