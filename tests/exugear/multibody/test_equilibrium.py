"""Runs start in the equilibrium under load and initial acceleration: no transient vibrations."""

from dataclasses import replace

import numpy as np
import pytest
from paper_gears import paper_gear
from scenes import INERTIA, linear_law, paper_pair, smooth_box, smooth_stage

import exugear
import fem
from fem.units import deg, mm, rpm, um

BEARING = exugear.Bearing(radial=5e8, axial=3e8, tilt=2e5, damping_time=1e-5)
R_B = paper_pair().pinion.r_b


def constant(damping: float = 2700.0):
    """A mesh of constant stiffness, in which only the start can excite vibrations."""
    return replace(linear_law(), damping=damping)


def shafts(*names: str, parts=None, **changes) -> list[exugear.Shaft]:
    """Shafts that carry the paper's gear and the same parts."""
    return [exugear.Shaft(name, {30 * mm: paper_gear()} | (parts or {}), inertia=INERTIA, **changes) for name in names]


def accelerated(box, slope: float = 400.0, load: float = 150.0, duration: float = 0.02, **changes):
    """Data of a run whose speed rises from 500 rpm with a slope [rad/s^2]."""
    speed = (500 * rpm, 500 * rpm + slope * duration)
    options = {"speed": speed, "load": load, "duration": duration, "progress": False, "tolerance": 1e-6}
    return exugear.run_up(exugear.build(box), **options | changes).data


def ripple(force: np.ndarray, balance: float) -> float:
    """Largest deviation from the balancing force, as share of it."""
    return float(np.abs(force / balance - 1).max())


def test_soft_coupling_starts_without_torsional_vibration():
    """Against J alpha / k, the amplitude at 3.2 Hz of a start without the inertia torques."""
    inertia, torsion, slope = 20.0, 8e3, 5.0
    brake = exugear.Coupling(torsion, inertia=inertia)
    fast, slow = shafts("fast")[0], shafts("slow", parts={0.0: brake})[0]
    box = exugear.Gearbox([smooth_stage(fast, slow, damping=2700.0)])
    data = accelerated(box, slope, duration=0.5, tolerance=1e-3)
    torque = data["mesh_force"].values[0] * R_B - INERTIA * slope
    window = round(1e-2 / data.attrs["sample"])
    twist = torque[: torque.size // window * window].reshape(-1, window).mean(axis=1) / torsion
    assert np.abs(twist - (150 + inertia * slope) / torsion).max() < 0.01 * inertia * slope / torsion


@pytest.mark.parametrize("where", ["fast", "slow"])
@pytest.mark.parametrize("part", [None, BEARING, exugear.Bearing(5e8, 3e8, 2e5, 1e-5, clearance=5e-6)])
def test_accelerated_gears_keep_their_initial_mesh_force(where, part):
    """Spinning, planar, in space on nonlinear bearings; rotors behind couplings on either side."""
    rotor = {0.0: exugear.Coupling(2e4, inertia=0.1)}
    bearing = {} if part is None else {30 * mm: [paper_gear(), part]}
    ends = [shafts(name, parts=bearing | (rotor if name == where else {}))[0] for name in ("fast", "slow")]
    data = accelerated(exugear.Gearbox([exugear.Stage(*ends, constant(), pair=paper_pair())]))
    balance = (150 + (INERTIA + 0.1 * (where == "slow")) * 400) / R_B
    assert ripple(data["mesh_force"].values[0], balance) < 1e-3


@pytest.mark.parametrize("part", [None, BEARING])
def test_accelerated_loops_keep_their_initial_mesh_forces(part):
    bearing = {} if part is None else {30 * mm: [paper_gear(), part]}
    a, b, c, d = shafts("a", "b", "c", "d", parts=bearing)
    ends = [(a, b, 0.0), (a, c, np.pi / 2), (b, d, np.pi / 2), (c, d, 0.0)]
    stages = [exugear.Stage(*two, constant(), pair=paper_pair(), angle=angle) for *two, angle in ends]
    data = accelerated(exugear.Gearbox(stages))
    force, last = data["mesh_force"].values, (150 + INERTIA * 400) / R_B
    assert ripple(force.T, force[:, 0]) < 1e-6
    assert ripple(force[2:].sum(axis=0), last) < 1e-3
    assert ripple(force[:2].sum(axis=0), last + 2 * INERTIA * 400 / R_B) < 1e-3


def test_deceleration_starts_on_the_back_flank():
    """The inertia torque exceeds the load: the gears brake the slow shaft."""
    fast, slow = shafts("fast", "slow")
    law = replace(constant(), backlash=1e-5)
    data = accelerated(exugear.Gearbox([exugear.Stage(fast, slow, law, pair=paper_pair())]), -400.0, load=1.0)
    assert ripple(data["mesh_force"].values[0], (1 - INERTIA * 400) / R_B) < 1e-3


def test_initial_accelerations_beyond_the_map_are_named():
    model = exugear.build(smooth_box())
    with pytest.raises(ValueError, match=r"extend the map.*inertia torques at 1e\+06 rad/s\^2"):
        exugear.run_up(model, speed=(0.0, 100.0), load=150.0, duration=1e-4, sample=1e-5)


def test_driving_shaft_has_its_acceleration_from_the_first_step_on():
    """It does not alternate between twice the acceleration and 0."""
    model = exugear.build(smooth_box())
    exugear.run_up(model, speed=(50.0, 60.0), load=150.0, duration=0.02)
    assert model.mbs.systemData.GetODE2Coordinates_tt()[model.spins["fast"]] == pytest.approx(500, rel=1e-6)


@pytest.mark.filterwarnings("ignore:torsion 8 N m/rad")
@pytest.mark.parametrize(
    ("part", "message"),
    [
        (exugear.Bearing(2e5, 1e5, 1e5), "bearings of fast-slow yield to .* stiffer bearings .*200e6"),
        (exugear.Bearing(5e4, 5e4, 1e4), "bearings of fast-slow yield by 40 mm, 0 rad under 2154 N.*200e6"),
        (exugear.Coupling(8.0, inertia=1.0), "coupling of shaft 'fast' twists by -18.7 rad under -150 N m.*8e3"),
    ],
)
def test_stiffness_in_a_wrong_unit_is_named_under_load(part, message):
    """200 N/um given as 200e3, 50 N/um as 50e3, 8 kN m/rad as 8."""
    model = exugear.build(smooth_box(parts={30 * mm: [paper_gear(), part]}))
    with pytest.raises((ValueError, RuntimeError), match=message):
        exugear.run_up(model, speed=0.0, load=150.0, duration=1e-3)


@pytest.mark.parametrize("loads", [(100.0, -60.0), (10.0, -6.0), (100.0, 0.0)])
def test_bent_shafts_start_with_the_flanks_that_their_loads_press(loads):
    """A belt bends the shaft by more than the teeth deflect, which opens and closes back flanks and idle teeth."""
    fixed, sideways = (exugear.Bearing(radial=5e8, axial=axial, damping_time=1e-5) for axial in (2e8, 0.0))
    pinion, wheel = (fem.Gear(z=z, m_n=3 * mm, b=30 * mm, d_bore=z * mm) for z in (20, 40))
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 4.5e5], [0, 4.5e5]], backlash=60 * um, damping=2000.0)
    belt = {100 * mm: exugear.ExternalForce(x=200.0, y=-300.0, z=50.0, moment_x=5.0)}

    def drawn(name: str, gear: fem.Gear, further: dict, d: float, end: float) -> exugear.Shaft:
        parts = {0.0: fixed, 60 * mm: gear, 130 * mm: sideways} | further
        return exugear.Shaft(name, parts, sections=[(d, 150 * mm)], start=-10 * mm, torque_at=end)

    fast = drawn("in", pinion, belt, 30 * mm, -10 * mm)
    outputs = [drawn(name, wheel, {}, 40 * mm, 140 * mm) for name in ("first", "second")]
    pair = fem.GearPair(pinion, wheel)
    stages = [exugear.Stage(fast, x, law, pair=pair, angle=y) for x, y in zip(outputs, (0, 120 * deg), strict=True)]
    model = exugear.build(exugear.Gearbox(stages))
    ends = {"drives": {"in": exugear.Speed(10.0)}, "loads": dict(zip(("first", "second"), loads, strict=True))}
    run = exugear.run(model, **ends, duration=1e-3, progress=False, checks=0)
    forces = run.data["mesh_force"].mean("time").values
    assert forces == pytest.approx(np.array(loads) / wheel.r_b, rel=1e-4, abs=0.5)
