"""External forces, unbalance and weight on rigid and elastic shafts, against closed forms."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import smooth_law

import exugear
import fem
from exugear import Bearing, Coupling, Disc, ExternalForce, Shaft, Unbalance
from fem.units import deg, mm, rpm

GEAR, LOAD = paper_gear(), 100.0
LAW = smooth_law(damping=2700.0)
LENGTH, D = 600 * mm, 40 * mm


def box_of(fast: Shaft, inertia: float = 1e-4) -> exugear.Gearbox:
    """The shaft with a gear, and a mate of little inertia that only spins."""
    slow = Shaft("slow", {next(iter(fast.gears)): GEAR}, inertia=inertia, mass=1.0)
    return exugear.Gearbox([exugear.Stage(fast, slow, LAW, pair=paper_pair())])


def settled(fast: Shaft, duration: float = 1e-3, speed: float = 0.0, **options):
    """Data of a run at constant speed."""
    model = exugear.build(box_of(fast))
    options = {"load": LOAD, "duration": duration, "progress": False, "checks": 0, "displacement": True} | options
    return exugear.run_up(model, speed=(speed, speed), **options).data


def on_bearings(parts: dict, **options) -> Shaft:
    """A shaft with a gear over its first bearing, so that the mesh bends nothing."""
    ends = {0.0: [GEAR, Bearing(1e9, 1e8, damping_time=1e-5)], LENGTH: Bearing(1e9, damping_time=1e-5)}
    for axial, part in parts.items():
        ends[axial] = [*np.atleast_1d(np.array(ends.get(axial, []), object)), part]
    return Shaft("fast", ends, **options)


SECTIONS = {"sections": [(D, LENGTH + 100 * mm + GEAR.b)], "start": -GEAR.b}


@pytest.mark.parametrize("options", [{}, pytest.param(SECTIONS, marks=pytest.mark.slow)], ids=["rigid", "elastic"])
def test_bearings_carry_an_overhung_load_by_the_lever_rule(options):
    """2 kN along y and 300 N along z 80 mm beyond the second bearing, and a moment of 50 N m about x."""
    force = ExternalForce(y=-2000.0, z=300.0, moment_x=50.0)
    loaded, alone = (
        settled(on_bearings(parts, **options))["bearing_force"][:, :, 0] for parts in ({LENGTH + 80 * mm: force}, {})
    )
    reactions = (loaded - alone).values
    about_x = 2000 * (LENGTH + 80 * mm) + 50.0
    assert reactions[1] == pytest.approx([0, about_x / LENGTH, 0], abs=0.5)
    assert reactions[0] == pytest.approx([0, 2000 - about_x / LENGTH, -300], abs=0.5)


@pytest.mark.slow
def test_a_shaft_sags_under_its_weight_as_timoshenkos_beam():
    """Displacement at a soft bearing in the middle, which yields with the beam; shear by Cowper's coefficient."""
    soft = {LENGTH / 2: Bearing(1e4)}
    sections = {"sections": [(D, LENGTH + GEAR.b)], "start": -GEAR.b / 2}
    heavy, light = (
        settled(on_bearings(soft, gravity=(0, g, 0), **sections))["bearing_displacement"][:, 1, 0] for g in (-9.81, 0.0)
    )
    sag = (heavy - light).values
    E, nu, area, second = fem.STEEL.E, fem.STEEL.nu, pi * D**2 / 4, pi * D**4 / 64
    w, shear = fem.STEEL.density * area * 9.81, 6 * (1 + nu) / (7 + 6 * nu) * E / (2 * (1 + nu)) * area
    bent = 5 * w * LENGTH**4 / (384 * E * second) + w * LENGTH**2 / (8 * shear)
    bent -= w * (GEAR.b / 2) ** 2 * LENGTH**2 / (16 * E * second)  # both ends hang over by half the face width
    held = 1e4 * (LENGTH**3 / (48 * E * second) + LENGTH / (4 * shear))
    assert sag[1] - (sag[0] + sag[2]) / 2 == pytest.approx(-bent / (1 + held), rel=1e-3)


def test_weight_rests_on_the_bearings():
    shaft = on_bearings({LENGTH / 2: Disc.cylinder(50 * mm, 200 * mm)}, gravity=(0, -9.81, 0))
    without = on_bearings({LENGTH / 2: Disc.cylinder(50 * mm, 200 * mm)})
    runs = [settled(x) for x in (shaft, without)]
    forces = [run["bearing_force"][:, 1, 0].values for run in runs]
    assert ["Gravity(0, -9.81, 0 m/s^2)" in run.attrs["fast_parts"] for run in runs] == [True, False]
    assert (forces[0] - forces[1]).sum() == pytest.approx(9.81 * shaft.mass, rel=1e-5)


def jeffcott(angle: float, tau: float = 1e-3, **options) -> Shaft:
    """A disc of 40 kg between two soft bearings, with an unbalance."""
    disc = Disc(40.0, 0.2, 0.2)
    bearings = {side * 200 * mm: Bearing(4e6, 4e6, damping_time=tau) for side in (-1, 1)}
    parts = {0.0: [GEAR, disc, Unbalance(2e-3, angle)], **bearings}
    return Shaft("fast", parts, **options)


@pytest.mark.parametrize("speed", [2000 * rpm, 6000 * rpm])
def test_unbalance_moves_jeffcotts_rotor_as_its_closed_form(speed):
    """Below and above the critical speed of 4200 rpm: amplitude and phase, less what the mesh does without it."""
    shaft, tau, turns = jeffcott(30 * deg), 1e-3, 8
    period = 2 * pi / speed
    data, alone = (
        settled(x, turns * period + 0.1, speed)
        for x in (shaft, Shaft("fast", {0.0: [GEAR, Disc(40.0, 0.2, 0.2)]} | shaft.bearings))
    )
    time, moved = data["time"].values, data["bearing_displacement"].values - alone["bearing_displacement"].values
    last = time >= time[-1] - turns * period
    turning = np.exp(-1j * speed * time[last])
    x, y = (2 * (moved[0, i, last] * turning).mean() for i in (0, 1))
    stiffness = 8e6
    expected = 2e-3 * speed**2 * np.exp(1j * 30 * deg) / (stiffness * (1 + 1j * speed * tau) - shaft.mass * speed**2)
    assert abs(x - expected) < 0.01 * abs(expected)
    assert abs(y + 1j * expected) < 0.01 * abs(expected)


@pytest.mark.parametrize(
    "sections", [None, pytest.param([(60 * mm, 400 * mm)], marks=pytest.mark.slow)], ids=["rigid", "elastic"]
)
def test_books_are_closed_with_forces_weight_and_unbalance(sections):
    """Over a run-up through the critical speed, whose drive must also turn against the unbalance."""
    parts = jeffcott(0.0, tau=1e-4).parts | {150 * mm: ExternalForce(x=500.0)}
    start = {} if sections is None else {"start": -200 * mm, "torque_at": 200 * mm}
    shaft = Shaft("fast", parts, gravity=(0, -9.81, 0), sections=sections, **start)
    run = exugear.run_up(
        exugear.build(box_of(shaft, 5e-3)),
        speed=(3000 * rpm, 5000 * rpm),
        load=LOAD,
        duration=0.2,
        power=True,
        progress=False,
        checks=0,
    )
    balance = run.energy_balance()
    assert balance.losses["bearing_loss"] > 2
    assert abs(balance.residual) < 2e-3 * balance.losses["bearing_loss"]


@pytest.mark.slow
def test_couplings_beside_the_end_act_in_series_with_the_shaft():
    coupling, end = Coupling(2e4, inertia=0.01), Coupling(1e4, inertia=0.02)
    parts = {100 * mm: GEAR, 300 * mm: [end, Bearing(1e9)], 0.0: [coupling, Bearing(1e9, 1e8)]}
    shaft = Shaft("s", parts, sections=[(D, 300 * mm)], torque_at=300 * mm)
    names = {rotor.name: rotor for rotor in shaft.rotors}
    assert [rotor.body for rotor in shaft.rotors] == ["s", "s", "s end"]
    rigidity = 210e9 / 2.6 * pi / 32 * D**4
    beside = names["s rotor"].coupling.torsion
    assert 1 / (1 / 2e4 + 100 * mm / rigidity) < beside < 1 / (1 / 2e4 + (100 * mm - GEAR.b / 2) / rigidity)
    assert len(exugear.eigenfrequencies(exugear.build(box_of(replace(shaft, name="fast"))), load=LOAD)) > 3


def test_a_shaft_with_a_start_is_the_shaft_moved():
    """Mass, centre, frequencies and stiffness do not depend on where z is counted from."""
    here, there = (
        Shaft(
            "s",
            {z + 100 * mm: GEAR, z: Bearing(1e8, 1e8), z + 300 * mm: Bearing(1e8)},
            sections=[(40 * mm, 200 * mm), (50 * mm, 100 * mm, 10 * mm)],
            start=z,
        )
        for z in (0.0, -170 * mm)
    )
    assert there.centre == pytest.approx(here.centre - 170 * mm)
    assert (there.mass, there.length) == pytest.approx((here.mass, here.length))
    assert there.bending_frequencies()[:6] == pytest.approx(here.bending_frequencies()[:6], rel=1e-8)
    assert there.twist.torsion == pytest.approx(here.twist.torsion)
    assert there.end_position == pytest.approx(here.end_position - 170 * mm)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ExternalForce(), "needs a component"),
        (lambda: ExternalForce(x=1e12), "must lie within 1e"),
        (lambda: Unbalance(500.0), "pass kg m"),
        (lambda: Unbalance(-1e-3), "moment of an unbalance"),
        (lambda: Unbalance(1e-3, 90.0), "pass radians"),
        (lambda: Shaft("s", {0.0: [GEAR, ExternalForce(y=1.0)]}), "no bearings that carry its ExternalForce"),
        (lambda: Shaft("s", {0.0: [GEAR, Unbalance(1e-3)]}), "no bearings that carry its Unbalance"),
        (lambda: Shaft("s", {0.0: GEAR}, gravity=(0, -9.81, 0)), "no bearings that carry its gravity"),
        (lambda: on_bearings({}, gravity=(0, -9.81)), r"must be an acceleration \(x, y, z\)"),
        (lambda: on_bearings({}, gravity=(0, -9810, 0)), r"such as \(0, -9.81, 0\)"),
        (lambda: on_bearings({}, start=0.1), "counts beside sections"),
        (lambda: on_bearings({}, start=0.1, sections=[(D, 1.0)]), "outside the shaft"),
    ],
)
def test_wrong_loads_are_refused_with_the_remedy(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_steady_states_do_not_take_unbalance():
    model = exugear.build(box_of(jeffcott(0.0)))
    with pytest.raises(ValueError, match="without unbalance"):
        exugear.steady_states(model, load=LOAD, speed=(1000 * rpm, 2000 * rpm))
