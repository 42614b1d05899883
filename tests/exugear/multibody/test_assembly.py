"""Whole scenes: reductions that agree, equilibrium, bearings of every kind, couplings, displaced shafts, refusals."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from bearing_boxes import ENDS, SPUR, box_of
from modal_boxes import train_matrices
from paper_gears import paper_gear
from scenes import smooth_box, smooth_stage
from spatial_meshes import helical_pair, law_of

import exugear
import fem
from fem.units import mm, um

SLOW = {"speed": 0.5, "duration": 1e-3, "load": 150.0, "progress": False}


def softened(factor: float) -> dict:
    return {
        axial: exugear.Bearing(b.radial * factor, b.axial * factor, damping_time=b.damping_time)
        for axial, b in ENDS.items()
    }


def windows(model, speed=(150.0, 200.0), **options) -> np.ndarray:
    """Windowed rms of the DTE over a short run-up."""
    options = {"speed": speed, "duration": 0.4, "load": 150.0, "progress": False} | options
    dte = exugear.run_up(model, **options).data["dte"].values[0]
    parts = np.array_split(dte, 16)
    return np.array([part.std() for part in parts])


def moment_of(data, axial) -> float:
    """Moment of the fast shaft's bearing forces about the gear's middle, across the line of action [N m]."""
    n = np.array([np.sin(SPUR.alpha_wt), np.cos(SPUR.alpha_wt)])
    return sum(data["bearing_force"].sel(bearing=f"fast at {z:g} mm").values[:2] @ n * (z - 30) * mm for z in axial)


def test_planar_and_spatial_bodies_agree_and_the_plan_says_why():
    box = box_of()
    plan = exugear.plan(box)
    assert [kind.name for kind in plan.shafts.values()] == ["PLANAR", "PLANAR"]
    assert "nothing tilts it" in str(plan) and "centre distance moves, but the map has no such axis" in str(plan)
    planar, spatial = (windows(exugear.build(box, plan=p)) for p in (plan, plan.with_bodies()))
    assert spatial == pytest.approx(planar, rel=1e-3)


def test_stiff_bearings_converge_to_the_spinning_scene():
    """In proportion to their compliance; windows are compared at samples that resolve their ends."""
    conditions = {"duration": 0.8, "sample": 1e-5}
    spin = windows(exugear.build(smooth_box()), **conditions)
    errors = []
    for factor in (10, 100, 1000):
        stiff = box_of(fast=softened(factor), slow=softened(factor))
        errors.append(np.abs(windows(exugear.build(stiff), **conditions) / spin - 1).max())
    assert errors[1] < 0.1 * errors[0]
    assert errors[2] < 0.2 * errors[1]
    assert errors[2] < 3e-3


@pytest.mark.parametrize("unused", ["offset", "clearance"])
def test_an_unused_feature_changes_neither_result_nor_plan(unused):
    ends = {
        axial: exugear.Bearing(b.radial, b.axial, damping_time=b.damping_time, clearance=0.0)
        for axial, b in ENDS.items()
    }
    changes = {"offset": {"offset": exugear.Placement(x=0.0)}, "clearance": {"fast": ends}}[unused]
    plain, with_unused = box_of(), box_of(**changes)
    models = [exugear.build(box) for box in (plain, with_unused)]
    assert str(models[0].plan) == str(models[1].plan)
    runs = [exugear.run_up(model, **SLOW).data["dte"].values for model in models]
    assert (runs[0] == runs[1]).all()


def test_shafts_that_close_the_backlash_are_refused():
    """Both flanks would press at once: 2 tan(alpha_wt) of play per distance."""
    reach, distances = np.array([0.0, 1e-4]), {"a": SPUR.a + np.array([-1, 0, 1]) * 100 * um}
    law = exugear.MeshForce(
        [0, 1 / 3, 2 / 3], reach, np.tile(4e8 * reach, (3, 3, 1)), backlash=40 * um, offsets=distances
    )
    for x, jams in ((-50 * um, False), (-60 * um, True)):
        box = box_of(law=law, fast={}, slow={}, offset=exugear.Placement(x=x))
        closed = -2 * x * np.tan(SPUR.alpha_wt)
        assert (closed > 40 * um + 1 * um) == jams
        if jams:
            with pytest.raises(ValueError, match=r"too close for its backlash of 40 um: .* are missing"):
                exugear.plan(box)
        else:
            assert exugear.plan(box).laws["fast-slow"].backlash == 40 * um


def test_helical_forces_reach_the_bearings():
    pair = helical_pair()
    run = exugear.run_up(exugear.build(box_of(pair)), **SLOW)
    force = run.data["bearing_force"].isel(time=0)
    mesh = float(run.data["mesh_force"][0, 0])
    assert mesh == pytest.approx(150 / pair.pinion.r_b, rel=1e-6)
    for name, sign in (("fast", -1), ("slow", 1)):
        on_shaft = force.sel(bearing=[b for b in force["bearing"].values if b.startswith(name)]).sum("bearing").values
        expected = sign * mesh * np.array([np.sin(pair.alpha_wt), np.cos(pair.alpha_wt), -np.tan(pair.beta_b)])
        assert on_shaft == pytest.approx(-expected, rel=2e-3)
    axial = force.sel(direction="z", bearing="fast at 0 mm")
    f_t = 150 / pair.pinion.r
    assert abs(float(axial)) == pytest.approx(f_t * np.tan(pair.pinion.beta), rel=2e-4), "the axes tilt by 2e-5"


def test_displaced_shaft_has_the_deflection_of_its_map():
    """Stiff bearings, an askew wheel: misalignment, centroid and deflection are those of springs across the width."""
    alpha, gamma = SPUR.alpha_wt, 1e-4
    askew = exugear.Placement(tilt_x=-gamma * np.cos(alpha), tilt_y=gamma * np.sin(alpha), x=20 * um)
    stiff = {axial: exugear.Bearing(1e11, 1e11) for axial in (0.0, 60 * mm)}
    law = law_of(backlash=1e-3)
    model = exugear.build(box_of(law=law, fast=stiff, slow=stiff, offset=askew))
    assert "map over phase, force, centre distance, misalignment" in str(model.plan)
    data = exugear.run_up(model, **SLOW | {"step": 1e-7, "sample": 1e-4}).data.isel(time=0, stage=0)
    assert float(data["misalignment"]) == pytest.approx(gamma, rel=0.02)
    offsets = {"a": float(data["centre_distance"]), "misalignment": float(data["misalignment"])}
    force = 150 / SPUR.pinion.r_b
    assert float(data["mesh_force"]) == pytest.approx(force, rel=1e-4)
    assert float(data["dte"]) == pytest.approx(law.deflection_at(0.0, force, **offsets), rel=1e-4)
    moment = moment_of(data, (0, 60))
    by_tilt = force * gamma * SPUR.a / 2
    assert moment == pytest.approx(force * float(data["centroid"]), abs=by_tilt)


def test_tilted_shafts_that_only_spin_need_no_map_axes():
    law = law_of(backlash=1e-3)
    askew = exugear.Placement(tilt_x=-1e-4, x=20 * um)
    model = exugear.build(box_of(law=law, fast={}, slow={}, offset=askew))
    assert "misalignment dropped: stays at" in str(model.plan)
    assert not model.meshes[0].law.offsets
    data = exugear.run_up(model, **SLOW).data.isel(time=0, stage=0)
    static = model.gearbox.offsets(model.gearbox.stages[0])
    expected = law.deflection_at(0.0, 150 / SPUR.pinion.r_b, a=static["a"], misalignment=static["misalignment"])
    assert float(data["dte"]) == pytest.approx(expected, rel=1e-3)


def test_clearance_lets_the_shaft_fall_until_the_bearing_carries():
    c = 10 * um
    play = {axial: exugear.Bearing(5e8, b.axial, clearance=c) for axial, b in ENDS.items()}
    data = exugear.run_up(exugear.build(box_of(fast=play)), **SLOW).data.isel(time=0)
    force = float(data["mesh_force"][0])
    radial = np.hypot(*data["bearing_force"].sel(bearing="fast at 0 mm").values[:2])
    assert radial == pytest.approx(force / 2, rel=1e-3)
    table = {
        axial: exugear.Bearing(axial=b.axial, table=([0, c, c + 100 * um], [0, 0, 5e4])) for axial, b in ENDS.items()
    }
    same = exugear.run_up(exugear.build(box_of(fast=table)), **SLOW).data.isel(time=0)
    assert float(same["dte"][0]) == pytest.approx(float(data["dte"][0]), rel=1e-6)
    short = {axial: exugear.Bearing(axial=b.axial, table=([0, 1 * um], [0, 500])) for axial, b in ENDS.items()}
    with pytest.raises(ValueError, match="its table ends at 500 N; extend it"):
        exugear.run_up(exugear.build(box_of(fast=short)), **SLOW)


def test_coupling_twists_under_the_load_and_has_its_frequency():
    coupling = exugear.Coupling(2e4, inertia=0.5)
    fast = exugear.Shaft("fast", {30 * mm: paper_gear()})
    slow = exugear.Shaft("slow", {30 * mm: paper_gear(), 0.1: coupling})
    model = exugear.build(exugear.Gearbox([smooth_stage(fast, slow, damping=2700.0)]))
    mass, stiffness = train_matrices(model.gearbox)
    rotor, spin = model.rotors["slow"], model.spins["slow"]
    assert mass[rotor, rotor] == pytest.approx(0.5)
    assert stiffness[rotor, spin] == pytest.approx(-2e4, rel=1e-6)
    exugear.run_up(model, **SLOW | {"speed": 0.0})
    q = model.mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Current)
    assert q[spin] - q[rotor] == pytest.approx(model.gearbox.directions["slow"] * 150 / 2e4, rel=1e-4)


@pytest.mark.parametrize(
    ("placement", "message"),
    [
        (exugear.Placement(tilt_x=1e-4), r"misalignment = .*map it with fem.Offsets\(misalignment"),
        (exugear.Placement(x=50 * um), r"give a = 0.15005.*map it with fem.Offsets\(a"),
        (exugear.Placement(z=1 * mm), r"axial = .*map it with fem.Offsets\(axial"),
    ],
)
def test_displaced_shafts_need_the_axis(placement, message):
    with pytest.raises(ValueError, match=message):
        exugear.plan(box_of(offset=placement))


@pytest.mark.slow
def test_misaligned_scene_agrees_with_a_direct_finite_element_solve():
    """Deflection and centroid against a direct solve at the misalignment that the scene finds.

    The moment of the potential needs light loads in the map: without 3 and 10 N m the centroid is 3 % off. A torque on
    the spin of an Rxyz node stands along (0, -tilt_x, 1) and takes part in the moments.
    """
    at = fem.Offsets(misalignment=(-2e-4, -1e-4, 0.0, 1e-4, 2e-4))
    torques = [0, 1, 3, 10, 20, 50, 100, 150, 350]
    ste = fem.static_transmission_error(SPUR, torques, 30, offsets=at, progress=False)
    ends = {0.0: exugear.Bearing(2e8, 1e8), 80 * mm: exugear.Bearing(5e8)}
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear()} | ends) for name in ("fast", "slow")]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste)]))
    data = exugear.run_up(model, **SLOW).data.isel(time=0, stage=0)
    offsets = fem.Offsets(misalignment=float(data["misalignment"]))
    direct = fem.static_transmission_error(SPUR, 150.0, [0.0], offsets=offsets, progress=False)
    assert abs(float(data["misalignment"])) > 1e-5
    assert float(data["dte"]) == pytest.approx(direct["te"].item(), rel=1e-3)
    assert float(data["centroid"]) == pytest.approx(direct["centroid"].item(), rel=1e-2)
    moment, force = moment_of(data, (0, 80)), float(data["mesh_force"])
    (*_, tilt_x, _), _ = (part[0] for part in model.meshes[0].recorder.motion(0))
    across = np.array([-np.cos(SPUR.alpha_wt), np.sin(SPUR.alpha_wt)])
    moment += 150 * np.array([0.0, -tilt_x]) @ across
    by_tilt = force * abs(float(data["misalignment"])) * SPUR.a / 2
    assert moment == pytest.approx(force * float(data["centroid"]), abs=by_tilt)


def test_stiff_bearings_make_the_step_small_or_the_rule_stable():
    """Second order where the fourth-order step would be tiny; both give the same DTE."""
    models = [exugear.build(box_of(fast=softened(f), slow=softened(f))) for f in (1, 1000)]
    assert "fourth order" in str(models[0].plan)
    assert "trapezoidal rule" in str(models[1].plan.rule(1e-2))
    short = {"duration": 0.05, "tolerance": 1e-2}
    trapezoidal = windows(models[1], **short)
    fourth_order = windows(models[1], **short | {"step": 0.9 * models[1].plan.largest_step})
    assert trapezoidal == pytest.approx(fourth_order, rel=3e-2)


def test_graphics_have_their_teeth_in_mesh():
    model = exugear.build(box_of())
    exugear.draw(model)
    for body in model.bodies.values():
        assert len(model.mbs.GetObject(body, addGraphicsData=True)["VgraphicsData"]) >= 2


def test_sensor_and_recorder_of_a_contact_agree():
    model = exugear.build(box_of())
    sensor = model.mbs.CreateGearSensor(model.meshes[0].contact, storeInternal=True)
    model.mbs.Assemble()
    data = exugear.run_up(model, **SLOW | {"duration": 2e-3}).data.isel(stage=0)
    stored = model.mbs.GetSensorStoredData(sensor)
    assert stored[-1, 1:4] == pytest.approx(
        [float(data[name][-1]) for name in ("dte", "mesh_force", "centre_distance")], rel=1e-6
    )
    with pytest.raises(ValueError, match="contact must be what CreateGearContact returned"):
        model.mbs.CreateGearSensor(model.bodies["fast"])


def test_items_added_to_the_system_count_for_the_step():
    """A stiff oscillator beside the gears: its eigenfrequency shortens the step, and nothing else changes."""
    model, plain = (exugear.build(smooth_box()) for _ in range(2))
    mbs = model.mbs
    node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0]))
    mbs.AddObject(eii.ObjectMass1D(mass=1.0, nodeNumber=node))
    ground = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    mass = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=[ground, mass], stiffness=(2e5) ** 2))
    mbs.Assemble()
    with_mass, without = (exugear.run_up(m, **SLOW | {"tolerance": 1e-2}) for m in (model, plain))
    assert with_mass.step < 1.01 * np.sqrt(6) / 2e5 < without.step
    assert with_mass.data["dte"].values[0, -1] == pytest.approx(without.data["dte"].values[0, -1], rel=1e-4)
