"""Steady states of several meshes: beside an idler, of a common period, in space."""

from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import linear_law, smooth_box, smooth_law, smooth_map, smooth_stage, two_stages
from settled_runs import LOAD, TOP, agree, compare, picked, settled_dte

import exugear
import fem
from exugear.steady_state import steady_system
from exugear.steady_state.gearbox_reduction import reduced
from fem.units import mm, rpm, um


def idler_train(law=None, damping: float = 2700.0) -> exugear.Model:
    """Three gears of the paper, the middle one an idler; the second stage with a law of its own."""
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear()}) for name in ("first", "second", "third")]
    stages = [
        smooth_stage(*shafts[:2], damping=damping),
        exugear.Stage(*shafts[1:], law or smooth_law(damping=damping), pair=paper_pair()),
    ]
    return exugear.build(exugear.Gearbox(stages))


def test_a_second_stage_of_constant_stiffness_leaves_nothing_out():
    model = idler_train(replace(linear_law(k=(3e8, 3e8, 3e8)), damping=8000.0), damping=8000.0)
    data = exugear.steady_states(model, speed=(1000 * rpm, 2000 * rpm), load=LOAD)
    assert data.attrs["variation_of_other_meshes"] < 1e-9
    compare(model, data, LOAD, number=1, step=5e-6)


def test_meshes_beside_an_idler_excite_together():
    model, speeds = idler_train(damping=8000.0), (2770 * rpm, 2800 * rpm)
    data = exugear.steady_states(model, speed=speeds, load=LOAD, stage=(0, 1))
    assert data.attrs["exciting_stages"] == ["first-second", "second-third"]
    assert data.attrs["common_period"] == 1
    stable = data.isel(point=np.flatnonzero(data["stable"]))
    orbit = stable.isel(point=int(stable["rms"].values[:, 0].argmin()))
    agree(orbit, settled_dte(model, orbit, LOAD, 4e-6, 40, 0.1))
    of_stage = exugear.steady_states(model, speed=speeds, load=LOAD, stage=1)
    assert of_stage.attrs["exciting_stages"] == ["second-third", "first-second"]
    ends = data["rms"].sel(stage="second-third").values[[0, -1]]
    assert sorted(of_stage["rms"].values[[0, -1]]) == pytest.approx(sorted(ends))


def test_two_outputs_of_a_held_shaft_vibrate_like_a_single_one():
    """The driving shaft turns at constant speed: the outputs know nothing of each other."""
    driving, port, starboard = (
        exugear.Shaft(name, {30 * mm: paper_gear()}) for name in ("driving", "port", "starboard")
    )
    sides = [(port, 0.0), (starboard, np.pi)]
    stages = [smooth_stage(driving, output, damping=2700.0, angle=angle) for output, angle in sides]
    model, speed = exugear.build(exugear.Gearbox(stages)), (1500 * rpm, 1550 * rpm)
    loads = {"port": LOAD, "starboard": 2 * LOAD}
    data = exugear.steady_states(model, speed=speed, loads=loads, stage=(0, 1))
    for stage, load in zip(data["stage"].values, loads.values(), strict=True):
        alone = exugear.steady_states(exugear.build(smooth_box()), speed=speed, load=load)
        ends = sorted(data["rms"].sel(stage=stage).values[[0, -1]])
        assert ends == pytest.approx(sorted(alone["rms"].values[[0, -1]]), rel=1e-3)
    one = exugear.steady_states(model, speed=speed, loads={"port": LOAD})
    assert one.attrs["idle_stages"] == ["driving-starboard"]
    with pytest.raises(ValueError, match="stage driving-starboard is idle under these loads"):
        exugear.steady_states(model, speed=speed, loads={"port": LOAD}, stage=1)


def two_stages_in_space() -> exugear.Model:
    """The paper's pair, and behind it a pair of other numbers of teeth whose stiffness varies by 7 %."""
    gears = [fem.Gear(z=z, m_n=3 * mm, b=25 * mm, d_bore=25 * mm) for z in (38, 53)]
    pair = fem.GearPair(*gears, a=136.6 * mm)
    law = replace(linear_law(k=(3e8, 3.3e8, 2.85e8), reach=3e-4), damping=2500.0)
    bearing = exugear.Bearing(5e8, 3e8, 2e5, 1e-5)
    first = exugear.Shaft("first", {0.0: bearing, 30 * mm: paper_gear()})
    middle = exugear.Shaft("middle", {0.0: bearing, 30 * mm: paper_gear(), 80 * mm: gears[0], 120 * mm: bearing})
    last = exugear.Shaft("last", {60 * mm: bearing, 80 * mm: gears[1]})
    stages = [smooth_stage(first, middle, damping=2700.0), exugear.Stage(middle, last, law, pair=pair)]
    return exugear.build(exugear.Gearbox(stages))


def test_meshes_of_different_frequencies_excite_over_their_common_period():
    model, load = two_stages_in_space(), 250.0
    data = exugear.steady_states(model, speed=(1200 * rpm, 1210 * rpm), load=load, stage=(0, 1))
    assert data.attrs["common_period"] == 3
    orbit = data.isel(point=0)
    assert orbit["mesh_frequency"].values == pytest.approx(model.mesh_cycles * float(orbit["speed"]), rel=1e-12)
    agree(orbit, settled_dte(model, orbit, load, 4e-6, 3 * 20, 0.15))


@pytest.mark.slow
def test_two_stages_in_space_within_a_minute():
    """Alone, the mesh of the first stage has amplitudes of its orders that differ from a run by 4 %."""
    model, load = two_stages_in_space(), 250.0
    began = process_time()
    of_meshes = exugear.steady_states(model, speed=(500 * rpm, TOP), load=load, stage=(0, 1))
    assert process_time() - began < 60.0
    alone = exugear.steady_states(model, speed=(3300 * rpm, TOP), load=load)
    assert of_meshes.attrs["variation_of_other_meshes"] == 0.0
    assert 0.05 < alone.attrs["variation_of_other_meshes"] < 0.1
    for point in picked(of_meshes.isel(stage=0), 4):
        orbit = of_meshes.isel(point=point)
        agree(orbit, settled_dte(model, orbit, load, 4e-6, 3 * 40))


def test_branches_do_not_depend_on_the_order_of_the_stages_nor_on_the_range():
    """Stable orbits of two periods at 100 to 140 rad/s begin beside the higher of two resonances."""
    model, speeds = exugear.build(two_stages()), (110.0, 130.0)
    for stages in ((0, 1), (1, 0)):
        data = exugear.steady_states(model, speed=speeds, load=LOAD, stage=stages)
        of_two = data["speed"].values[(data["period"].values == 2) & data["stable"].values]
        assert (of_two.min(), of_two.max()) == pytest.approx(speeds)


def common_period_of_36() -> exugear.Model:
    """24/36 and 25/40 teeth: the meshes meet again after a revolution of the shaft between them."""
    gears = [fem.Gear(z=z, m_n=3 * mm, b=25 * mm, d_bore=20 * mm) for z in (24, 36, 25, 40)]
    first = exugear.Shaft("first", {30 * mm: gears[0]})
    middle = exugear.Shaft("middle", {30 * mm: gears[1], 80 * mm: gears[2]})
    last = exugear.Shaft("last", {80 * mm: gears[3]})
    law = replace(linear_law(k=(3e8, 4e8, 3.4e8), reach=3e-4), damping=2500.0)
    pairs = fem.GearPair(*gears[:2]), fem.GearPair(*gears[2:])
    stages = [exugear.Stage(first, middle, law, pair=pairs[0]), exugear.Stage(middle, last, law, pair=pairs[1])]
    return exugear.build(exugear.Gearbox(stages))


def test_a_point_of_a_long_period_costs_few_motions_over_it(monkeypatch):
    """The iteration starts beside the orbit, and the slopes of a motion are computed once."""
    model, motions = common_period_of_36(), {"settled": 0, "periods_end": 0}

    def counted(name):
        method = getattr(steady_system.SteadySystem, name)

        def wrapper(*arguments):
            motions[name] += 1
            return method(*arguments)

        monkeypatch.setattr(steady_system.SteadySystem, name, wrapper)

    for name in motions:
        counted(name)
    data = exugear.steady_states(model, speed=(2800 * rpm, 3200 * rpm), load=200.0, stage=(0, 1))
    assert data.attrs["common_period"] == 36
    assert motions["settled"] < 3 * data.sizes["point"] + 10
    assert motions["periods_end"] < 2 * data.sizes["point"] + 6


def test_what_a_long_period_forgets_is_left_out_of_its_slopes(monkeypatch):
    """At its end the motion depends on few directions of its beginning: the others are dropped on the way."""
    system = reduced(two_stages_in_space(), {"last": 250.0}, [0, 1], speed=50.0, drive="held").system
    frequency, columns = 0.1 * system.resonance, []
    states = system.settled(np.zeros(system.size), frequency, 4)

    original = steady_system.not_forgotten

    def counted(*matrices):
        left = original(*matrices)
        columns.append(left[0].shape[1])
        return left

    monkeypatch.setattr(steady_system, "not_forgotten", counted)
    slopes = system.periods_end(states, frequency, 8).slopes
    monkeypatch.setattr(steady_system, "not_forgotten", lambda *unchanged: unchanged)
    assert columns[-1] < system.size / 2
    assert slopes == pytest.approx(system.periods_end(states, frequency, 8).slopes, abs=1e-10)


def test_the_common_period_holds_all_pitches_of_a_law():
    """Two pitches, one 2 um behind: the orbit is that of a run, with half the mesh frequency in it."""
    single = smooth_map()
    te, phase = single["te"].values, single["phase"].values
    behind = 2 * um * (1 - np.cos(np.pi * np.r_[phase, phase + 1])) / 2
    both = fem.ste_map(
        fem.pair_of(single), single["torque"].values, np.r_[phase, phase + 1], np.tile(te, 2) + behind, pitches=2
    )
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear()}) for name in ("fast", "slow")]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, both, damping=8000.0)]))
    assert "phase of 2 pitches (3.19 MB)" in str(model.plan)
    data = exugear.steady_states(model, speed=(1500 * rpm, 1530 * rpm), load=LOAD, stage=(0,))
    assert data.attrs["common_period"] == 2
    orbit = data.isel(point=int(np.flatnonzero(data["stable"])[0]))
    dte = settled_dte(model, orbit, LOAD, 4e-6, 40, 0.1)
    agree(orbit, dte)
    half = np.abs(np.fft.rfft(dte[0] - dte[0].mean()))
    assert half[:30].argmax() == 20
