"""Published mean coefficients of friction: values by hand in the units of the sources, limits, units, the kernel."""

from math import cos, sin

import numpy as np
import pytest
from friction_cases import N, unlike_pair
from spatial_meshes import PAIRS

import exugear
import fem
from exugear.force_table.kernel_records import address_of
from exugear.kernels.friction_kernels import coefficient, friction_at
from fem.units import deg, mm, um

SCHLENK = exugear.SchlenkFriction(viscosity=10e-3, roughness=0.4 * um)
NIEMANN = exugear.NiemannFriction(viscosity=10e-3, roughness=0.4 * um)


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


@pytest.mark.parametrize("law", [SCHLENK, NIEMANN, 0.06])
def test_kernel_agrees_with_the_law(law):
    pair = unlike_pair(12 * deg)
    friction = exugear.MeshFriction.of_pair(pair, law)
    record = friction.table(pair)
    for force in (10.0, 4e3, 3e4):
        for speed in (-2000.0, 0.0, 1.0, 300.0, 5e4):
            expected = friction.power_law(pair).at(force, speed) / cos(pair.beta_b)
            assert coefficient(friction_at(address_of(record)), force, speed) == pytest.approx(expected, rel=1e-12)


def test_loss_by_a_law_is_that_of_its_coefficient():
    pair = unlike_pair()
    friction = exugear.MeshFriction.of_pair(pair, SCHLENK)
    mu = at(SCHLENK, pair, 5e3, 3.0)
    omega_1 = 3.0 / (pair.pinion.r_b / cos(pair.alpha_wt))
    constant = exugear.MeshFriction.of_pair(pair, mu)
    assert friction.loss(pair, force=5e3, speed=omega_1) == pytest.approx(constant.loss(pair), rel=1e-12)
    assert np.array_equal(friction.pull, constant.pull)
    assert friction.pull.size == N


@pytest.mark.parametrize("law", [exugear.SchlenkFriction, exugear.NiemannFriction])
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


def test_other_lubricant_factors_are_refused():
    with pytest.raises(ValueError, match="lubricant_factor must lie"):
        exugear.SchlenkFriction(0.02, 0.4 * um, 10.0)
    with pytest.raises(ValueError, match="coefficient must be"):
        exugear.MeshFriction.of_pair(unlike_pair(), "oil")
