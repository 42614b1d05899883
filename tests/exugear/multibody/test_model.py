"""The scene, its plan and the built system."""

import numpy as np
import pytest
from modal_boxes import train_matrices
from scenes import paper_gear, paper_pair, smooth_box, smooth_map, smooth_stage, two_stages

import exugear
import fem
from exugear.multibody.first_order_statics import with_deflections
from exugear.multibody.gear_contact import state_of
from fem.units import deg, mm

BEARING = exugear.Bearing(radial=5e8, axial=3e8, tilt=2e5, damping_time=1e-6)
TWO_BEARINGS = {0.0: exugear.Bearing(radial=5e8, axial=1e8), 60 * mm: exugear.Bearing(radial=5e8)}


def shaft(name: str = "fast", **changes) -> exugear.Shaft:
    return exugear.Shaft(name, {30 * mm: paper_gear()}, **changes)


def stage(fast=None, slow=None, **changes) -> exugear.Stage:
    return smooth_stage(fast or shaft("fast"), slow or shaft("slow"), **{"damping": 2700.0} | changes)


def test_default_inertia_is_that_of_solid_steel_discs():
    radius = (154.5 + 141.7) / 4 * mm
    mass = 7850 * np.pi * radius**2 * 23 * mm
    assert shaft().mass == pytest.approx(mass)
    assert shaft().inertia == pytest.approx(mass * radius**2 / 2)
    assert shaft().transverse == pytest.approx(mass * (radius**2 / 4 + (23 * mm) ** 2 / 12))
    assert shaft(inertia=0.5).inertia == 0.5


def test_gearbox_has_directions_positions_ratios_and_static_forces():
    box = two_stages(angle=90 * deg)
    assert box.directions == {"fast": 1, "middle": -1, "slow": 1}
    assert box.shaft_positions["slow"] == pytest.approx((150 * mm, 150 * mm))
    assert box.ratios == pytest.approx({"fast": 1, "middle": -1, "slow": 1})
    assert box.static_forces(100.0) == pytest.approx([100 / paper_pair().wheel.r_b] * 2)
    assert (box.driving.name, box.driven.name) == ("fast", "slow")


def test_plan_chooses_the_fewest_coordinates_with_reasons():
    plan = exugear.plan(smooth_box())
    assert "1 coordinate" in str(plan) and "no bearings given" in str(plan)
    assert "6 coordinates" in str(exugear.plan(smooth_box(BEARING)))
    assert "revolute joint" in str(plan.with_joints())
    assert "about" in str(exugear.build(smooth_box()).plan)


def test_mass_and_stiffness_of_the_built_system():
    model = exugear.build(smooth_box(BEARING))
    mass, stiffness = train_matrices(model.gearbox)
    shaft = model.gearbox.shafts[0]
    inertia = [shaft.mass] * 3 + [shaft.transverse] * 2 + [shaft.inertia]
    assert np.diag(mass) == pytest.approx(np.tile(inertia, 2), rel=1e-12)
    lever = 30 * mm
    tilt = BEARING.tilt + BEARING.radial * lever**2
    springs = [BEARING.radial] * 2 + [BEARING.axial] + [tilt] * 2 + [0]
    assert np.diag(stiffness) == pytest.approx(np.tile(springs, 2), rel=1e-6, abs=10)
    assert abs(stiffness[0, 4]) == pytest.approx(BEARING.radial * lever, rel=1e-5)


def test_highest_eigenfrequency_of_two_spinning_shafts():
    model = exugear.build(smooth_box())
    law, shaft = model.meshes[0].stage.force, model.gearbox.shafts[0]
    omega = np.sqrt(2 * law.stiffness_max * paper_pair().pinion.r_b ** 2 / shaft.inertia)
    assert model.plan.omega == pytest.approx(omega, rel=1e-6)
    assert model.plan.omega_mesh == pytest.approx(omega, rel=1e-6)


def test_step_follows_the_tolerance_with_fourth_order():
    plan = exugear.build(smooth_box()).plan
    assert plan.step(1e-3, 3325) == pytest.approx(2.4e-5, rel=0.02)
    assert plan.step(1e-3 / 16, 3325) == pytest.approx(plan.step(1e-3, 3325) / 2)
    assert plan.step(0.05) < plan.largest_step
    with pytest.raises(ValueError, match="tolerance"):
        plan.step(0.0)


@pytest.mark.parametrize("unreduced", [False, True])
def test_shafts_take_the_spins_of_given_deflections(unreduced):
    box = two_stages(angle=90 * deg)
    plan = exugear.plan(box)
    model = exugear.build(box, plan=plan.with_joints() if unreduced else plan)
    q = with_deflections(model, [1e-5, 2e-5], np.zeros(model.meshes[0].row.size), [box.driving.name])
    assert [mesh.row @ q for mesh in model.meshes] == pytest.approx([1e-5, 2e-5])


def square() -> exugear.Gearbox:
    """Four equal gears: b and c share the load between a and d."""
    a, b, c, d = (shaft(name) for name in "abcd")
    ends = [(a, b, 0), (a, c, 90 * deg), (b, d, 90 * deg), (c, d, 0)]
    return exugear.Gearbox([stage(*pair, angle=angle) for *pair, angle in ends])


@pytest.mark.parametrize("unreduced", [False, True])
def test_loops_take_the_spins_at_which_deflections_agree(unreduced):
    box = square()
    plan = exugear.plan(box)
    model = exugear.build(box, plan=plan.with_joints() if unreduced else plan)
    q = with_deflections(model, [1e-5, 2e-5, 2e-5, 1e-5], np.zeros(model.meshes[0].row.size), ["a"])
    assert [mesh.row @ q for mesh in model.meshes] == pytest.approx([1e-5, 2e-5, 2e-5, 1e-5])
    assert q[model.spins["a"]] == 0
    deflections = [mesh.row @ with_deflections(model, [1e-5, 0, 0, 0], q, ["a"]) for mesh in model.meshes]
    assert deflections == pytest.approx([0.75e-5, 0.25e-5, -0.25e-5, 0.25e-5], abs=1e-12)


def test_phases_reach_the_meshes():
    model = exugear.build(exugear.Gearbox([stage(phase=0.3), stage(shaft("slow"), shaft("last"), angle=1.0)]))
    assert [mesh.frame.phase % 1 for mesh in model.meshes] == pytest.approx(model.gearbox.phases)
    assert model.gearbox.phases[0] == pytest.approx(0.3)


def test_shaft_without_bearings_beside_one_that_has_them():
    fast = exugear.Shaft("fast", {0.0: BEARING, 30 * mm: paper_gear()})
    model = exugear.build(exugear.Gearbox([stage(fast)]))
    kinds = [kind.name for kind in model.plan.shafts.values()]
    assert kinds == ["BEARINGS", "SPIN"]


def test_bearing_by_its_matrix_equals_the_bearing_by_its_stiffnesses():
    boxes = smooth_box(BEARING), smooth_box(exugear.Bearing(matrix=BEARING.stiffness))
    by_stiffness, by_matrix = (train_matrices(box)[1] for box in boxes)
    assert np.abs(by_stiffness - by_matrix).max() < 1e-9 * np.abs(by_stiffness).max()


def test_matrices_without_meshes_also_of_gears_without_backlash():
    boxes = smooth_box(BEARING), smooth_box(BEARING, backlash=0.0)
    with_backlash, without_backlash = (train_matrices(box, exugear.plan(box).with_bodies())[1] for box in boxes)
    assert np.array_equal(with_backlash, without_backlash)
    assert not with_backlash[5].any() and not with_backlash[11].any()


def test_plan_of_another_gearbox_is_refused():
    with pytest.raises(ValueError, match="plan is for the shafts"):
        exugear.build(smooth_box(), plan=exugear.plan(two_stages()))
    on_bearings = smooth_box(parts={0 * mm: exugear.Bearing(2e8, 1e8), 60 * mm: exugear.Bearing(2e8, 1e8)})
    for box, change in (
        (smooth_box(damping=100.0), "damping, backlash"),
        (on_bearings, "shaft 'fast' has 1 coordinate"),
    ):
        with pytest.raises(
            ValueError, match=f"plan is for another gearbox .* call exugear.plan with this one: {change}"
        ):
            exugear.build(box, plan=exugear.plan(smooth_box()))


@pytest.mark.parametrize("names", [("drive", "driven"), ("in", "in rotor"), ("in", "in drag")])
def test_shafts_named_like_other_items_of_the_system_are_refused(names):
    with pytest.raises(ValueError, match=r"would share the names .*; rename a shaft"):
        exugear.Gearbox([stage(*(shaft(name) for name in names))])


def test_the_map_of_another_pair_is_refused():
    gear = fem.Gear(z=31, m_n=2.6 * mm, b=23 * mm, d_bore=40 * mm)
    pair = fem.GearPair(gear, gear)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name in ("fast", "slow")]
    with pytest.raises(ValueError, match="pair must be that of the map"):
        exugear.Stage(*shafts, smooth_map(), pair=pair)


@pytest.mark.parametrize("field", ["radial", "axial", "tilt", "damping_time"])
def test_bad_bearings_are_refused(field):
    for value in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=f"{field} must be >= 0"):
            exugear.Bearing(**{"radial": 1e8} | {field: value})


@pytest.mark.parametrize(
    ("parts", "changes", "message"),
    [
        ({}, {}, "no part with a body: no fem.Gear and no Disc; pass inertia= and mass="),
        ({0.0: "gear"}, {}, "parts holds"),
        ({30.0: paper_gear()}, {}, "pass metres"),
        ({0.0: paper_gear()}, {"inertia": -1.0}, "inertia of shaft"),
        ({0.0: paper_gear()}, {"mass": np.nan}, "mass of shaft"),
        ({0.0: exugear.Bearing(0.0, axial=1e8, tilt=1.0), 30 * mm: paper_gear()}, {}, "radial and axial"),
        ({0.0: exugear.Bearing(1e8), 30 * mm: paper_gear()}, {}, "radial and axial"),
        ({0.0: exugear.Bearing(1e8, axial=1e8), 30 * mm: paper_gear()}, {}, "free to tilt"),
    ],
)
def test_bad_shafts_are_refused(parts, changes, message):
    with pytest.raises(ValueError, match=message):
        exugear.Shaft("fast", parts, **changes)


def test_two_bearings_hold_a_shaft():
    exugear.Shaft("fast", TWO_BEARINGS | {30 * mm: paper_gear()})


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: stage(damping=-1.0), "damping must be >= 0"),
        (lambda: stage(backlash=-1e-5), "backlash must be >= 0"),
        (lambda: stage(angle=90.0), "pass radians"),
        (lambda: stage(slow=shaft("fast")), "two shafts"),
        (
            lambda: exugear.plan(exugear.Gearbox([stage(slow=exugear.Shaft("slow", {31 * mm: paper_gear()}))])),
            "give axial = 0.001, but its map is for 0",
        ),
        (lambda: smooth_stage("a", shaft(), damping=0.0), "fast must be"),
        (lambda: exugear.Stage(shaft(), shaft("slow"), "map", damping=0.0), "mesh must be"),
        (lambda: exugear.Gearbox([]), "at least one Stage"),
        (lambda: exugear.Gearbox(stage()), "must be a list of Stage"),
        (lambda: exugear.build(stage()), "gearbox must be"),
        (lambda: exugear.Gearbox([stage(), stage()]), "coupled twice"),
        (lambda: exugear.Gearbox([stage(), stage(shaft("a"), shaft("b"))]), "not coupled"),
        (lambda: exugear.Gearbox([stage(), stage(shaft("fast", inertia=1.0), shaft("b"))]), "two different shafts"),
        (
            lambda: exugear.Gearbox([stage(exugear.Shaft("fast", {30 * mm: paper_gear(), 0.1: paper_gear()}))]),
            "gear without mate",
        ),
    ],
)
def test_bad_scenes_are_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_a_run_changes_the_state_of_a_contact_and_nothing_else():
    """Frame and table are read-only; the state is restored, except for the force that balances the load."""
    model = exugear.build(smooth_box())
    mesh = model.meshes[0]
    frame, table, before = mesh.frame.tobytes(), mesh.law.table.tobytes(), state_of(model.mbs, mesh.contact).copy()
    exugear.run_up(model, speed=(0, 100.0), duration=1e-3, load=lambda t: 150.0, progress=False)
    state = state_of(model.mbs, mesh.contact)
    assert (mesh.frame.tobytes(), mesh.law.table.tobytes()) == (frame, table)
    assert (state.engaged, state.lag) == (before.engaged, before.lag) == (1.0, 0.0)
    assert state.holding_force == pytest.approx(mesh.force_per_torque @ [0.0, 150.0])
    with pytest.raises(ValueError, match="read-only"):
        mesh.frame.phase = 0.3
