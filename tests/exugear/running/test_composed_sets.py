"""Planetary sets on laws composed of tooth pairs: faults of single teeth of planets, at their turns and places."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from composed_laws import PAIR_STIFFNESS, law_of_equal_pairs
from planetary_boxes import GEAR, PIN, RING_PAIR, SUN_PAIR, planar_box, planetary, planetary_box

import exugear
import fem
from fem.units import mm, rpm, um

PLANETS, RING, DEVIATION, STIFFNESS = 30, 90, 8 * um, 2 * PAIR_STIFFNESS
#: Path over which tooth pairs are counted, 2 pitches, and a step of the table beyond.
WIDE = 2.02


def faulty(tooth: int = 0) -> np.ndarray:
    """Pitch deviations of a planet, of a single tooth."""
    pitch = np.zeros(PLANETS)
    pitch[tooth] = DEVIATION
    return pitch


def laws() -> dict:
    """Laws of meshes in which two equally stiff tooth pairs touch, and tooth 0 of the first planet deviates."""
    none, damping = np.zeros(1), {"damping": 3e3}
    alike = law_of_equal_pairs(none, none, 1, WIDE, **damping)
    sun = law_of_equal_pairs(none, faulty(), PLANETS, WIDE, **damping)
    ring = law_of_equal_pairs(faulty(), none, PLANETS, WIDE, **damping)
    return {"sun_mesh": [sun, alike, alike], "ring_mesh": [ring, alike, alike]}


def turn_of_carrier(box, speed: float, load: float = 2000.0, **options):
    """A run over a turn of the carrier (a quarter of the sun's speed) at constant speed, after a tenth of it."""
    turn = 8 * np.pi / speed
    options = {"duration": 1.1 * turn, "sample": turn / 3600, "progress": False, "checks": 0} | options
    run = exugear.run(exugear.build(box), drives={"sun": speed}, loads={"carrier": load}, **options)
    return run, run.data["time"].values > 0.1 * turn - options["sample"] / 2


def orders_of(values) -> np.ndarray:
    """Amplitudes of orders 0, 1, ... of the carrier, of values over a turn."""
    return 2 * np.abs(np.fft.rfft(values)) / len(values)


def test_a_tooth_fault_of_a_planet_has_the_side_bands_of_the_closed_form():
    """Lines at n z_ring / z_planet +- 1 of the carrier in the sensor; none in the torque, whose sum the load holds.

    A tooth that stands back by d while two equally stiff tooth pairs touch shifts its mesh by d / 2 over two pitches,
    twice in a turn of the planet, at the sun and at the ring. Of three planets on meshes of the stiffness k its force
    then falls by k / 3 of both shifts, that of the others rises by half of that. With the influence cos a sensor on the
    ring sees 3/2 of it times the cosine of its place.
    """
    box = planetary_box(**laws())
    sensor = exugear.RingSensor(0.0, lambda angle: 1e-9 * np.cos(angle))
    run, last = turn_of_carrier(box, 200 * rpm)
    lines = orders_of(sensor.signal(run).values[last])
    n, per_turn = np.arange(1, 9), RING // PLANETS
    apart = (box.phases[1] - box.phases[0]) / PLANETS
    width = 2 / PLANETS
    shift = DEVIATION * width * np.sinc(n * width) * np.abs(1 + np.exp(2j * np.pi * n * apart))
    force = STIFFNESS / 3 * shift
    for side in (-1, 1):
        assert lines[n * per_turn + side] == pytest.approx(0.75e-9 * force, rel=0.02, abs=0.75e-11 * force.max())
    assert lines[n * per_turn].max() < 0.02 * 0.75e-9 * force.max()
    forces = run.data["mesh_force"].values[:, last]
    beside_others = orders_of(forces[1] - (forces[3] + forces[5]) / 2)
    assert beside_others[n * per_turn] == pytest.approx(1.5 * force, rel=0.02, abs=0.015 * force.max())
    torque = orders_of(forces[::2].sum(axis=0))[1:90]
    assert torque.max() < 0.05 * force.max()


@pytest.mark.parametrize("planar", [False, True])
def test_composed_laws_of_a_set_are_those_of_their_tables(planar):
    """The same set on tables over all pitches of the planets, on ideal axes and on pins.

    Pins leave a tenth of the lines, 1e-3 of the mean force, beside the ringing after each change of the number of
    tooth pairs: sampled 40 times in a pitch it folds into them, by 3 to 6 % of the largest line, 320 times by 1.6 %.
    """
    meshes, phase = laws(), np.arange(64 * PLANETS) / 64
    # tooth 0 is in mesh within a pitch of phase 0; the table changes over a step, in the middle at its ends
    apart = np.minimum(phase, PLANETS - phase)
    shift = DEVIATION / 4 * (1.0 * (apart < 1) + 1.0 * (apart <= 1))
    reach = np.array([0.0, 400 * um])
    table = np.broadcast_to(STIFFNESS * reach, (phase.size, 2))
    mapped = exugear.MeshForce(phase, shift[:, None] + reach, table, pitches=PLANETS, damping=3e3)
    of_table = {name: [mapped, *x[1:]] for name, x in meshes.items()}
    make = (lambda x: planar_box(**x)) if planar else (lambda x: planetary_box(**x))
    lines, samples = [], 28800 if planar else 3600
    for given in (meshes, of_table):
        run, last = turn_of_carrier(make(given), 200 * rpm, sample=8 * np.pi / (200 * rpm) / samples)
        lines.append(np.array([orders_of(force) for force in run.data["mesh_force"].values[:, last]])[:, 1:60])
    # every second line of the planet: the shifts at the sun and at the ring add up
    composed, by_table = (np.array(x)[:, 5::6] for x in lines)
    assert composed == pytest.approx(by_table, abs=0.02 * by_table.max())


def test_a_set_in_space_on_composed_laws_runs_as_in_the_plane():
    box = planar_box(bearings=PIN, **laws())
    plans = exugear.plan(box), exugear.plan(box).with_bodies()
    options = {"speed": (50.0, 60.0), "load": 100.0, "duration": 0.005, "progress": False, "checks": 0}
    planar, space = (exugear.run_up(exugear.build(box, plan=plan), **options).data for plan in plans)
    for name in ("mesh_force", "dte", "bearing_force"):
        assert float(np.abs(space[name] - planar[name]).max()) < 1e-7 * float(np.abs(planar[name]).max())


def test_a_planet_has_its_teeth_counted_from_either_side():
    """The same flanks in both meshes are another tooth in each, unless the pattern is the same from both sides."""
    crack = fem.crack(GEAR, lost=0.3)

    def a_set(*flank):
        pairs = {"sun_pair": replace(SUN_PAIR, wheel=replace(GEAR, flank=flank))}
        return planetary(**pairs, ring_pair=replace(RING_PAIR, pinion=pairs["sun_pair"].wheel))

    assert not a_set(fem.OnTooth(0, crack)).stepped
    with pytest.raises(ValueError, match=r"tooth k of sun_mesh is tooth -k there.*OnTooth\(-k % z"):
        a_set(fem.OnTooth(3, crack))
    unlike = replace(SUN_PAIR, wheel=replace(GEAR, flank=fem.OnTooth(3, crack)))
    assert not planetary(sun_pair=unlike).stepped


def test_maps_of_tooth_pairs_are_composed_first():
    pair = fem.GearPair(*(fem.Gear(z=z, m_n=3 * mm, b=20 * mm, d_bore=15 * mm, x=0.4) for z in (12, 13)))
    pairs = fem.tooth_pair_map(pair, 20.0, resolution=COARSE, checks=0, progress=False)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("in", pair.pinion), ("out", pair.wheel))]
    with pytest.raises(ValueError, match=r"compose the law, exugear\.MeshForce\.from_tooth_pairs"):
        exugear.Stage(*shafts, pairs)
