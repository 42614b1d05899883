"""Load over the face with elastic shafts and bearings, against closed forms, balances and the finite elements."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from valid_arguments import run_on_bearings

import exugear
import fem
from fem.units import GPa, deg, mm, um

STEEL = fem.Material(E=206 * GPa, nu=0.3)
RIGID = exugear.Bearing(radial=9e12, axial=1e9)
COARSE = {"phases": 4, "progress": False}


def law() -> exugear.MeshForce:
    return exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 5e5], [0, 5e5]], backlash=0.1 * mm)


def spur(z: int = 50, m: float = 2 * mm, b: float = 20 * mm, **options) -> fem.Gear:
    return fem.Gear(z=z, m_n=m, b=b, **{"d_bore": 20 * mm} | options)


def box_of(fast: exugear.Shaft, slow: exugear.Shaft, pair: fem.GearPair, **stage) -> exugear.Gearbox:
    return exugear.Gearbox([exugear.Stage(fast, slow, law(), pair=pair, **stage)])


PINION = fem.Gear(z=20, m_n=3 * mm, b=42 * mm, beta=15 * deg, d_bore=20 * mm)
WHEEL = fem.Gear(z=61, m_n=3 * mm, b=40 * mm, beta=-15 * deg, d_bore=60 * mm)
HELICAL = fem.GearPair(PINION, WHEEL, a=81 * 1.5 * mm / np.cos(15 * deg) + 0.2 * mm)


def helical_box(bearing=None, overhung: bool = False, **stage) -> exugear.Gearbox:
    """A helical pair between its bearings, or with an overhung pinion."""
    ball = bearing or exugear.Bearing(radial=3e8, axial=1e8)
    ends = (20 * mm, 60 * mm) if overhung else (20 * mm, 150 * mm)
    at = 95 * mm
    fast = exugear.Shaft(
        "fast", dict.fromkeys(ends, ball) | {at: PINION}, sections=[(40 * mm, 170 * mm)], torque_at=0.0
    )
    slow = exugear.Shaft("slow", dict.fromkeys((20 * mm, 150 * mm), ball) | {at: WHEEL}, sections=[(55 * mm, 170 * mm)])
    return box_of(fast, slow, HELICAL, **stage)


def test_torsion_alone_is_that_of_the_closed_form():
    """lambda b coth(lambda b), lambda^2 = c r_b^2/(G J), the torque at one end: 1.15784."""
    z = 65
    m = 100 * mm / (z * np.cos(20 * deg))
    gear = spur(z, m, 100 * mm, material=STEEL)
    assert gear.r_b == pytest.approx(50 * mm)
    driven = exugear.Shaft("fast", {50 * mm: gear}, sections=[(102.37 * mm, 100 * mm)], material=STEEL, torque_at=0.0)
    box = box_of(driven, exugear.Shaft("slow", {50 * mm: gear}), fem.GearPair(gear, gear, a=z * m))
    data = exugear.load_distribution(box, 1000.0, mesh_stiffness=16.7e9)
    assert float(data["K_H_beta"][0]) == pytest.approx(1.15784, rel=1e-4)
    load = data["line_load"].values[0]
    assert (np.diff(load) < 0).all()
    assert load.mean() * 100 * mm == pytest.approx(1000.0 / gear.r_b, rel=1e-8)


@pytest.mark.parametrize(("q", "factor"), [(300e3, 1.6666667), (100e3, np.sqrt(8.0)), (200e3, 2.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_misalignment_alone_is_that_of_the_closed_form(q, factor, sign):
    """1 + F c/(2 q) while the whole face carries, sqrt(2 F c/q) beyond: F 20 um, c 20 N/(mm um)."""
    gear = spur()
    pair = fem.GearPair(gear, gear, a=100 * mm)
    tilt = exugear.Placement(tilt_x=sign * um / mm / np.cos(pair.alpha_wt), pivot=10 * mm)
    shafts = exugear.Shaft("fast", {10 * mm: gear}), exugear.Shaft("slow", {10 * mm: gear}, offset=tilt)
    box = box_of(*shafts, pair)
    options = {"mesh_stiffness": 20e9, "parts": 100}
    data = exugear.load_distribution(box, q * gear.b * gear.r_b, **options)
    assert abs(float(data["F_beta_y"][0])) == pytest.approx(20 * um, rel=1e-6)
    assert float(data["K_H_beta"][0]) == pytest.approx(factor, rel=2e-3)
    assert float(data["K_H_beta_C"][0]) == pytest.approx(factor, rel=2e-3)
    other_end = exugear.load_distribution(box, -q * gear.b * gear.r_b, **options)
    assert float(other_end["K_H_beta"][0]) == pytest.approx(factor, rel=2e-3)


def pinned(torque_at: float = 0.0) -> exugear.Gearbox:
    """A shaft 300 x 60 mm pinned at both ends, its gear in the middle, the mate rigid.

    The torsion of a root circle of 68 mm on r_b = 35 mm is that of 60 mm on r_b = 35 (60/68)^2 mm.
    """
    r_b, z = 35 * (60 / 68) ** 2 * mm, 50
    m = 2 * r_b / (z * np.cos(25 * deg))
    gear = spur(z, m, 40 * mm, alpha_n=25 * deg, x=0.5, material=STEEL)
    assert 2 * gear.r_f < 60 * mm
    parts = {0.0: RIGID, 150 * mm: gear, 300 * mm: RIGID}
    fast = exugear.Shaft("fast", parts, sections=[(60 * mm, 300 * mm)], material=STEEL, torque_at=torque_at)
    return box_of(fast, exugear.Shaft("slow", {150 * mm: gear}), fem.GearPair(gear, gear, a=(z + 1.2) * m))


def test_bending_and_torsion_are_those_of_a_pinned_timoshenko_beam():
    box = pinned()
    load = 12e3 * box.stages[0].pair.pinion.r_b
    data = exugear.load_distribution(box, load, mesh_stiffness=16e9)
    assert float(data["K_H_beta"][0]) == pytest.approx(1.11641, rel=1e-3)
    mirrored = exugear.load_distribution(pinned(300 * mm), load, mesh_stiffness=16e9)
    np.testing.assert_allclose(mirrored["line_load"].values[:, ::-1], data["line_load"], rtol=1e-9)


@pytest.mark.parametrize("overhung", [False, True])
@pytest.mark.parametrize("load", [900.0, -900.0])
def test_forces_moments_and_energy_are_balanced(overhung, load):
    box = helical_box(overhung=overhung, angle=30 * deg)
    data = exugear.load_distribution(box, load, mesh_stiffness=15e9)
    forces, moments = data["bearing_force"].values, data["bearing_moment"].values
    positions = np.array([[*box.shaft_positions[str(name)], z] for name, z in
                          zip(data["bearing_shaft"].values, data["bearing_axial"].values, strict=True)])  # fmt: skip
    largest = np.abs(forces).max()
    np.testing.assert_allclose(forces.sum(axis=0), 0, atol=1e-9 * largest)
    drive = load * PINION.z / WHEEL.z
    torques = np.array([0, 0, -np.sign(box.ratios["slow"]) * load + drive])
    about = np.cross(positions, forces).sum(axis=0) + np.array([*moments.sum(axis=0), 0.0]) + torques
    np.testing.assert_allclose(about, 0, atol=1e-8 * abs(load))
    thrust = data["mesh_force"].values[0] * np.tan(PINION.beta_b)
    of_fast = forces[data["bearing_shaft"].values == "fast"]
    assert abs(of_fast[:, 2].sum()) == pytest.approx(thrust, rel=1e-8)
    if float(data["line_load"].min()) > 0:
        end = box.shafts[1].end_position
        twist = np.interp(end, data["axial"].sel(shaft="slow"), data["twist"].sel(shaft="slow"))
        work = -0.5 * load * np.sign(box.ratios["slow"]) * twist
        assert float(data["energy"].sum()) == pytest.approx(work, rel=1e-6)
    else:
        assert overhung


def on_two_springs(*loads, sections=None, **options) -> exugear.Gearbox:
    """A spur pinion amid bearings of 2e7 N/m 200 mm apart, and what acts 50 mm beyond them; the mate is rigid."""
    gear, spring = spur(b=40 * mm), exugear.Bearing(radial=2e7, axial=1e7)
    parts = {0.0: spring, 100 * mm: gear, 200 * mm: spring} | dict.fromkeys([250 * mm] * bool(loads), (*loads,))
    fast = exugear.Shaft("fast", parts, sections=sections, **options)
    return box_of(fast, exugear.Shaft("slow", {100 * mm: gear}), fem.GearPair(gear, gear, a=100 * mm))


@pytest.mark.parametrize(("force", "part"), [({"y": -3000.0}, np.cos), ({"x": 3000.0}, np.sin)])
def test_an_overhung_force_tilts_the_gear(force, part):
    """Bearings k at +-L/2 and n springs of teeth, c b^3/12 (1 - 1/n^2), hold the tilt against F (L/2 + 50 mm)."""
    box, c, load = on_two_springs(exugear.ExternalForce(**force)), 15e9, 4000.0
    pair = box.stages[0].pair
    data = exugear.load_distribution(box, load, mesh_stiffness=c)
    moment = 3000.0 * 150 * mm * part(pair.alpha_wt)
    tilt = moment / (2e7 * (200 * mm) ** 2 / 2 + c * (40 * mm) ** 3 / 12 * (1 - 1 / 20**2))
    assert abs(float(data["F_beta_y"][0])) == pytest.approx(tilt * 40 * mm, rel=1e-6)
    assert float(data["K_H_beta"][0]) == pytest.approx(
        1 + tilt * 20 * mm * c / (load / pair.pinion.r_b / 40 / mm), rel=1e-6
    )
    plain = exugear.load_distribution(on_two_springs(), load, mesh_stiffness=c)
    assert float(plain["K_H_beta"][0]) == pytest.approx(1.0, abs=1e-9)
    added = (data["bearing_force"] - plain["bearing_force"]).values
    acting = np.array([force.get("x", 0.0), force.get("y", 0.0), 0.0])
    np.testing.assert_allclose(added.sum(axis=0), -acting, atol=1e-5)
    mesh = (data["line_load"] - plain["line_load"]).values[0]
    of_teeth = mesh @ data["axial_position"].values[0] * float(data["width"][0]) / mesh.size
    on_line = np.array([np.sin(pair.alpha_wt), np.cos(pair.alpha_wt)])
    of_shaft = (added[:, :2] @ on_line) @ [0.0, 200 * mm] + (acting[:2] @ on_line) * 250 * mm
    assert abs(of_shaft) == pytest.approx(abs(of_teeth), rel=1e-5)


def test_unbalance_has_no_part_in_statics():
    loads = [exugear.load_distribution(on_two_springs(*x), 400.0, mesh_stiffness=15e9)["line_load"].values
             for x in ((), (exugear.Unbalance(1e-3),))]  # fmt: skip
    np.testing.assert_array_equal(*loads)


@pytest.mark.parametrize("elastic", [True, False])
def test_bearings_carry_weight_and_forces_of_elastic_and_rigid_shafts(elastic):
    sections, gravity = [(30 * mm, 400 * mm)] if elastic else None, (3.0, -9.81, 2.0)
    force = exugear.ExternalForce(y=-50.0, z=20.0, moment_x=3.0)
    box = on_two_springs(force, sections=sections, gravity=gravity)
    data, plain = (
        exugear.load_distribution(x, 40.0, mesh_stiffness=15e9) for x in (box, on_two_springs(sections=sections))
    )
    shaft = box.shafts[0]
    added = (data["bearing_force"] - plain["bearing_force"]).values
    np.testing.assert_allclose(added.sum(axis=0), -shaft.mass * np.array(gravity) - [0, -50, 20], atol=1e-6)


def test_the_free_end_of_a_shaft_sags_as_a_cantilever_under_its_weight():
    """w a^4/(8 E I) and shear w a^2/(2 kappa G A) of the 150 mm beyond its bearing, on the slope there."""
    d, beyond, g = 30 * mm, 200 * mm, 9.81
    box = on_two_springs(sections=[(d, 400 * mm)], gravity=(0, -g, 0), material=STEEL)
    data = exugear.load_distribution(box, 40.0, mesh_stiffness=15e9).sel(shaft="fast")
    at = {x: [float(np.interp(x, data["axial"], data[name][i])) for name, i in (("deflection", 1), ("tilt", 0))]
          for x in (200 * mm, 400 * mm)}  # fmt: skip
    sag = at[400 * mm][0] - at[200 * mm][0] + beyond * at[200 * mm][1]
    area, second = np.pi * d**2 / 4, np.pi * d**4 / 64
    weight, kappa, G = STEEL.density * area * g, 6 * 1.3 / (7 + 6 * 0.3), STEEL.E / 2.6
    expected = weight * beyond**4 / (8 * STEEL.E * second) + weight * beyond**2 / (2 * kappa * G * area)
    assert sag == pytest.approx(-expected, rel=1e-4)


def test_light_loads_leave_a_part_of_the_face_empty():
    box = helical_box(overhung=True, bearing=exugear.Bearing(radial=3e8, axial=1e8, clearance=10 * um))
    data = exugear.load_distribution(box, 20.0, mesh_stiffness=15e9)
    load = data["line_load"].values[0]
    assert (load == 0).any()
    assert load.mean() * float(data["width"][0]) == pytest.approx(20.0 / WHEEL.r_b, rel=1e-6)


def test_rolling_bearings_carry_by_their_laws():
    ball = exugear.RollingBearing.deep_groove(Z=9, D_w=12 * mm, D_pw=60 * mm, clearance=10 * um)
    data = exugear.load_distribution(helical_box(ball), 900.0, mesh_stiffness=15e9)
    for i in range(data.sizes["bearing"]):
        at = np.r_[data["bearing_displacement"].values[i], data["bearing_tilt"].values[i]]
        force = np.r_[data["bearing_force"].values[i], data["bearing_moment"].values[i]]
        np.testing.assert_allclose(ball.displaced(at).force, -force, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("parts", [40, 80])
def test_equilibrium_holds_where_the_potential_is_lost_in_rounding(parts):
    """Short, stiff sections between many stations leave more of it than the last steps to the equilibrium gain."""
    ball = exugear.RollingBearing.deep_groove(Z=9, D_w=12 * mm, D_pw=60 * mm, clearance=10 * um)
    data = exugear.load_distribution(helical_box(ball), 1050.0, mesh_stiffness=15e9, parts=parts)
    np.testing.assert_allclose(data["mesh_force"], 1050.0 / WHEEL.r_b, rtol=1e-9)
    np.testing.assert_allclose(data["bearing_force"].sum("bearing"), 0, atol=1e-5)


def test_stages_share_one_equilibrium():
    """Torques follow the ratios; a middle shaft is twisted and bent by both of its meshes."""
    gear, ball = spur(b=20 * mm), exugear.Bearing(radial=3e8, axial=1e8)
    pair = fem.GearPair(gear, gear, a=100 * mm)
    places = {"a": (60 * mm,), "b": (60 * mm, 140 * mm), "c": (140 * mm,)}
    shafts = [
        exugear.Shaft(name, {0.0: ball, 200 * mm: ball} | dict.fromkeys(at, gear), sections=[(40 * mm, 200 * mm)])
        for name, at in places.items()
    ]
    stages = [exugear.Stage(*ends, law(), pair=pair) for ends in (shafts[:2], shafts[1:])]
    data = exugear.load_distribution(exugear.Gearbox(stages), 400.0, mesh_stiffness=15e9)
    np.testing.assert_allclose(data["mesh_force"], 400.0 / gear.r_b, rtol=1e-9)
    np.testing.assert_allclose(data["line_load"].mean("face") * 20 * mm, 400.0 / gear.r_b, rtol=1e-7)
    # The gearbox is its own mirror image but for drive and load.
    forces = data["bearing_force"].values[:, :2]
    np.testing.assert_allclose(np.hypot(*forces[:2].T), np.hypot(*forces[4:].T)[::-1], rtol=2e-2)


@pytest.mark.slow
def test_the_contact_of_the_finite_elements_agrees_with_the_pair_that_lies_likewise():
    box = helical_box()
    data = exugear.load_distribution(box, 900.0, **COARSE)
    deflected = exugear.deflected_pair(box, data)
    factors = fem.load_factors(deflected.pair, deflected.torque, 4, offsets=deflected.offsets, progress=False)
    assert float(data["K_H_beta"][0]) == pytest.approx(float(factors["K_H_beta"][0]), rel=2e-3)
    assert float(data["line_load"].mean()) * 40 * mm == pytest.approx(900.0 / WHEEL.r_b, rel=1e-8)
    assert 1.0 < float(data["K_H_beta_B"][0]) < 3.0


def test_modifications_of_the_loaded_flank_count():
    """A helix slope on the left flanks matters to them alone; its gap is that over the whole face."""
    gear = spur(flank=fem.Sides(left=(fem.HelixSlope(20 * um),)))
    pair = fem.GearPair(gear, spur(), a=100.2 * mm)
    box = box_of(exugear.Shaft("fast", {10 * mm: gear}), exugear.Shaft("slow", {10 * mm: spur()}), pair)
    forward, backward = (exugear.load_distribution(box, sign * 300.0, mesh_stiffness=20e9) for sign in (1, -1))
    assert float(forward["F_beta_y"][0]) == pytest.approx(20 * um, rel=1e-6)
    assert float(backward["F_beta_y"][0]) == pytest.approx(0.0, abs=1e-12)
    assert float(forward["line_load"][0, 0]) > float(forward["line_load"][0, -1])


@pytest.mark.parametrize("load", [900.0, -900.0])
def test_corrections_even_out_the_load(load):
    box = helical_box()
    proposal = exugear.propose_flank_corrections(box, load, mesh_stiffness=15e9)
    before, after = proposal.table["K_H_beta"].values[0]
    assert after - 1 < 0.3 * (before - 1)
    pair = proposal.pairs["fast-slow"]
    parts = dict(zip(("fast", "slow"), (pair.pinion, pair.wheel), strict=True))
    shafts = [
        exugear.Shaft(
            shaft.name,
            {**shaft.bearings, 95 * mm: parts[shaft.name]},
            sections=shaft.sections,
            torque_at=shaft.torque_at,
        )
        for shaft in box.shafts
    ]
    again = exugear.load_distribution(box_of(*shafts, pair), load, mesh_stiffness=15e9)
    assert float(again["K_H_beta"][0]) == pytest.approx(after, rel=1e-6)
    crowned = exugear.propose_flank_corrections(box, load, mesh_stiffness=15e9, spread=10 * um)
    assert float((crowned.table["C_beta"] - proposal.table["C_beta"])[0]) == pytest.approx(5 * um, abs=1e-8)


def test_wrong_input_is_refused_in_words():
    box = helical_box()
    with pytest.raises(ValueError, match="20 N/\\(mm um\\) are 20e9"):
        exugear.load_distribution(box, 900.0, mesh_stiffness=20.0)
    with pytest.raises(ValueError, match="load must be finite and not 0"):
        exugear.load_distribution(box, 0.0)
    with pytest.raises(ValueError, match="must name the stages"):
        exugear.load_distribution(box, 900.0, mesh_stiffness={"a": 2e10})
    with pytest.raises(ValueError, match="does not carry the load"):
        soft = exugear.Bearing(radial=1e5, axial=1e4)
        exugear.load_distribution(helical_box(soft), 900.0, mesh_stiffness=15e9)
    with pytest.raises(ValueError, match="mesh must be one of"):
        exugear.deflected_pair(box, exugear.load_distribution(box, 900.0, mesh_stiffness=15e9), "a-b")


def test_a_report_has_a_page_of_the_load_over_the_face(tmp_path):
    data = exugear.load_distribution(helical_box(), 900.0, mesh_stiffness=15e9)
    page = exugear.report(run_on_bearings(), tmp_path / "run.html", load_distribution=data)[0].read_text("utf-8")
    assert "Load over the face" in page
    assert "method B" in page
    assert f"{float(data['K_H_beta'][0]):.3f}" in page


def test_plots_show_line_loads_deflections_and_bearing_forces():
    data = exugear.load_distribution(helical_box(), 900.0, mesh_stiffness=15e9)
    ax = exugear.plots.plot_line_load(data, linewidth=3)
    assert np.mean(ax.lines[0].get_ydata()) == pytest.approx(1.0)
    ax = exugear.plots.plot_shaft_deflection(data, direction="y", shaft="fast")
    assert len(ax.lines) == 3
    ax = exugear.plots.plot_bearing_loads(data)
    assert len(ax.patches) == 8
    plt.close("all")
