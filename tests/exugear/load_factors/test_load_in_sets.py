"""Load over the faces of planetary sets, and its sharing among the planets, against closed forms and balances."""

from dataclasses import replace

import numpy as np
import pytest
from planetary_boxes import (
    GEAR,
    PIN,
    STIFFNESS,
    SUN_PAIR,
    helical_box,
    members,
    planar_box,
    planetary_box,
    waving_law,
)
from ring_gears import COARSE

import exugear
import fem
from fem.units import GPa, deg, mm, um

LAW, WIDTH = waving_law(0.0), GEAR.b
OF_WIDTH = STIFFNESS / WIDTH
STEEL = fem.Material(E=206 * GPa, nu=0.3)
ONLY_SUN = exugear.Bearing(radial=1e4, axial=1e6, tilt=1e6)


@pytest.mark.parametrize(("planets", "factor"), [(3, 1.44678), (4, 1.57995)])
def test_torsion_of_the_sun_under_its_planets_is_that_of_the_closed_form(planets, factor):
    """lambda b coth(lambda b), lambda^2 = N c r_b^2/(G J): with N = 1 the 1.15784 of a pair."""
    m = 100 * mm / (65 * np.cos(20 * deg))
    sun, planet = (fem.Gear(z=z, m_n=m, b=100 * mm, d_bore=10 * mm, material=STEEL) for z in (65, 25))
    pairs = {"sun_pair": fem.GearPair(sun, planet, a=45 * m), "ring_pair": exugear.RingPair(planet, -115, a=-45 * m)}
    shaft = exugear.Shaft("sun", {50 * mm: sun}, sections=[(102.37 * mm, 100 * mm)], material=STEEL, torque_at=0.0)
    ring = exugear.Shaft("ring", {50 * mm: pairs["ring_pair"].wheel}, inertia=0.05, mass=5.0)
    box = planetary_box(law=LAW, planets=planets, sun=shaft, ring=ring, **pairs)
    data = exugear.load_distribution(box, 3000.0, mesh_stiffness=16.7e9)
    assert data["K_H_beta"].values[::2] == pytest.approx(factor, rel=1e-4)
    assert data["K_H_beta"].values[1::2] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(("q", "factor"), [(300e3, 1.6666667), (100e3, np.sqrt(8.0))])
@pytest.mark.parametrize("sign", [1, -1])
def test_pins_that_lean_load_one_end_of_the_face_as_in_the_closed_form(q, factor, sign):
    """1 + F c/(2 q) or sqrt(2 F c/q), F = slope b cos alpha across the pin's radius: 20 um, c 20 N/(mm um)."""
    lean = np.zeros((3, 4))
    lean[:, 2] = sign * 20 * um / WIDTH / np.cos(20 * deg)
    load = 4 * 3 * q * WIDTH * GEAR.r_b
    box = planetary_box(law=LAW, pin_errors=lean)
    data = exugear.load_distribution(box, load, mesh_stiffness=20e9, parts=100)
    assert data["K_H_beta"].values == pytest.approx(factor, rel=2e-3)
    assert data["F_beta_y"].values == pytest.approx(sign * 20 * um, rel=1e-3)
    assert data["K_gamma"].values == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("planets", [3, 4])
@pytest.mark.parametrize("pin", [None, PIN])
@pytest.mark.parametrize("floating", [False, True])
def test_planets_share_the_load_as_in_the_closed_form(planets, pin, floating):
    """(1 + (N-1) X)/N and (1 - X)/N; floating sun (1 + (N-3) X)/N at the pin that is behind, and opposite it."""
    load, X = 2000.0, 0.1
    of_pin = 1 / PIN.radial if pin else 0.0
    compliance = 1 / (2 * STIFFNESS * np.cos(20 * deg) ** 2) + of_pin
    errors = np.zeros(planets)
    errors[0] = -X * load / (GEAR.z * 3 * mm) * compliance
    options = {"pin": pin, "planets": planets, "pin_errors": errors}
    box = planar_box(ONLY_SUN, LAW, **options) if floating else planetary_box(law=LAW, **options)
    data = exugear.load_distribution(box, load, mesh_stiffness=OF_WIDTH)
    shares = data["K_gamma"].values[::2] / planets
    np.testing.assert_allclose(data["K_gamma"].values[1::2] / planets, shares, rtol=1e-4)
    if floating:
        behind = (1 + (planets - 3) * X) / planets
        expected = {3: [behind] * 3, 4: [behind, 0.225, behind, 0.225]}[planets]
    else:
        expected = [(1 + (planets - 1) * X) / planets] + [(1 - X) / planets] * (planets - 1)
    np.testing.assert_allclose(shares, expected, atol=3e-4)


@pytest.mark.parametrize("load", [1500.0, -1500.0])
def test_pins_carry_their_planets_and_the_carrier_its_load(load):
    box = helical_box(LAW)
    data = exugear.load_distribution(box, load, mesh_stiffness=OF_WIDTH)
    forces, shafts = data["bearing_force"].values, data["bearing_shaft"].values
    on_pins = np.array([name.startswith("planet") for name in shafts])
    a, turning = box.stages[0].pair.a, np.sign(box.ratios["carrier"])
    angles = np.array([box.stages[2 * i].angle for i in range(3)])
    across = np.stack([-np.sin(angles), np.cos(angles), 0 * angles], axis=1)
    torques = -a * (forces[on_pins] * across).sum(axis=1)
    assert torques.sum() == pytest.approx(turning * load, rel=1e-9)
    sun, planet = box.stages[0].pair.pinion, box.stages[0].pair.wheel
    thrust = data["mesh_force"].values[::2].sum() * np.tan(sun.beta_b)
    assert abs(forces[shafts == "sun", 2].sum()) == pytest.approx(thrust, rel=1e-6)
    assert np.abs(forces[on_pins, 2]).max() < 1e-6 * thrust
    # Axial forces of sun and ring tilt each planet on its pin.
    moments = np.hypot(*data["bearing_moment"].values[on_pins].T)
    assert moments == pytest.approx(2 * planet.r * thrust / 3, rel=0.05)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("pin", [None, replace(PIN, tilt=1e9)])
def test_a_tilted_carrier_loads_one_end_of_each_face_as_in_the_closed_form(pin, sign):
    """1 + F c/(2 q), F = b |z . n| with the lines of action n = cos alpha e_t +- sin alpha e_r of sun and ring."""
    tilt, q, c = 2e-4, 60e3, 20e9
    x, y = tilt * np.cos(0.5), tilt * np.sin(0.5)
    carrier = replace(members()["carrier"], offset=exugear.Placement(tilt_x=x, tilt_y=y))
    box = planetary_box(law=LAW, pin=pin, carrier=carrier)
    data = exugear.load_distribution(box, sign * 4 * 3 * q * WIDTH * GEAR.r_b, mesh_stiffness=c, parts=100)
    psi, alpha = np.arange(3) * 2 * np.pi / 3, SUN_PAIR.alpha_wt
    across, along = -y * np.sin(psi) - x * np.cos(psi), y * np.cos(psi) - x * np.sin(psi)
    for role, side in enumerate((sign, -sign)):
        slope = WIDTH * np.abs(np.cos(alpha) * across + side * np.sin(alpha) * along)
        assert np.abs(data["F_beta_y"].values[role::2]) == pytest.approx(slope, abs=1e-3 * WIDTH * tilt)
        assert data["K_H_beta"].values[role::2] == pytest.approx(1 + slope * c / (2 * q), rel=2e-3)
    assert data["K_gamma"].values == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_planet_is_loose_until_both_its_gaps_exceed_the_backlash(sign):
    """Its gaps add up to 2 (e cos alpha - F/k), its pin ahead by e: as in runs, its back flanks touch beyond."""
    backlash, load, alpha = 50 * um, 500.0, SUN_PAIR.alpha_wt
    deflection = load / (2 * 4 * GEAR.r_b) / STIFFNESS
    ahead, law = (backlash + deflection) / np.cos(alpha), replace(LAW, backlash=backlash)
    for error, jams in ((ahead - 0.5 * um, False), (ahead + 0.5 * um, True)):
        box = planetary_box(law=law, pin_errors=[sign * error, 0.0, 0.0])
        options = {"speed": 1.0, "load": sign * load, "duration": 1e-4, "progress": False, "checks": 0}
        run = exugear.run_up(exugear.build(box), **options).data["mesh_force"].values[:2, 0]
        assert bool(np.all(sign * run < -1.0)) is jams
        if jams:
            with pytest.raises(
                ValueError, match=r"mesh 'sun-planet 1' is open by .*, its back flanks touch; raise the"
            ):
                exugear.load_distribution(box, sign * load, mesh_stiffness=OF_WIDTH)
        else:
            factors = exugear.load_distribution(box, sign * load, mesh_stiffness=OF_WIDTH)["K_gamma"].values
            assert factors == pytest.approx([0.0, 0.0, 1.5, 1.5, 1.5, 1.5], abs=1e-3)


def test_a_planet_with_thinner_teeth_carries_less():
    thin = fem.Gear(z=30, m_n=3 * mm, alpha_n=20 * deg, b=25 * mm, d_bore=30 * mm, s_n=np.pi / 2 * 3 * mm - 10 * um)
    box = planetary_box(law=LAW, planet=[GEAR, thin, GEAR])
    shares = exugear.load_distribution(box, 2000.0, mesh_stiffness=OF_WIDTH)["K_gamma"].values[::2]
    assert shares[1] < 0.99 < shares[0] == pytest.approx(shares[2], rel=1e-3)


def test_corrections_of_a_set_are_common_to_its_planets():
    sun = exugear.Shaft("sun", {0.0: GEAR}, sections=[(50 * mm, 60 * mm)], start=-30 * mm, torque_at=-30 * mm)
    ring = fem.Gear(z=-90, m_n=3 * mm, alpha_n=20 * deg, b=25 * mm, d_a=-88.4 * 3 * mm, d_rim=-310 * mm)
    pairs = {"ring_pair": fem.GearPair(GEAR, ring, a=-90 * mm)}
    shaft = exugear.Shaft("ring", {0.0: ring})
    box = planetary_box(law=LAW, sun=sun, ring=shaft, pin_errors=[-5 * um, 0.0, 0.0], **pairs)
    proposal = exugear.propose_flank_corrections(box, 2000.0, mesh_stiffness=OF_WIDTH)
    table = proposal.table
    assert np.ptp(table["C_Hbeta"].values[::2]) == 0
    assert (table["K_H_beta"].sel(state="corrected") <= table["K_H_beta"].sel(state="before") + 1e-9).all()
    before, corrected = table["K_H_beta"].values[0] - 1
    assert before > 0.05
    assert corrected < 0.4 * before
    assert set(proposal.corrections) == set(box.labels)


def gears_of_set() -> dict[str, fem.Gear]:
    """Sun, planet and ring, which finite elements can mesh."""
    sizes = {"m_n": 2 * mm, "b": 20 * mm}
    return {
        "sun": fem.Gear(z=24, x=0.3, d_bore=15 * mm, **sizes),
        "planet": fem.Gear(z=27, x=-0.3, d_bore=30 * mm, **sizes),
        "ring": fem.Gear(z=-78, x=0.3, d_a=151.6 * mm, d_rim=177 * mm, **sizes),
    }


@pytest.mark.slow
def test_planets_share_the_load_so_that_teeth_of_finite_elements_fit_their_pins():
    """te of sun and ring add up to 2 cos alpha_w times the tangential displacement of the pin, beside other planets."""
    gears, error = gears_of_set(), 15 * um
    pairs = {
        "sun_pair": fem.GearPair(gears["sun"], gears["planet"], a=51 * mm),
        "ring_pair": fem.GearPair(gears["planet"], gears["ring"], a=-51 * mm),
    }
    shafts = {name: exugear.Shaft(name, {0.0: gears[name]}) for name in ("sun", "ring")}
    box = planetary_box(law=LAW, pin_errors=[-error, 0.0, 0.0], **shafts, **pairs)
    data = exugear.load_distribution(box, 600.0, phases=4, resolution=COARSE, progress=False)
    forces = data["mesh_force"].values.reshape(3, 2)
    np.testing.assert_allclose(forces[:, 0], forces[:, 1], rtol=1e-6)
    assert data["K_gamma"].values[0] > 1.2
    te = np.zeros(2)
    for pair in pairs.values():
        torque = np.sort(forces[:2, 0]) * pair.pinion.r_b
        ste = fem.static_transmission_error(pair, torque, 4, resolution=COARSE, progress=False)
        te += ste["te"].mean("phase").values
    assert te[1] - te[0] == pytest.approx(2 * np.cos(pairs["sun_pair"].alpha_wt) * error, rel=2e-3)
