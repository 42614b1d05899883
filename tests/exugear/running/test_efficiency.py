"""Efficiency over speed and load: losses by hand, executors, several stages, points that are not solved."""

from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from multiprocessing import get_context

import numpy as np
import pytest
from friction_cases import MU
from paper_gears import few_teeth, paper_gear, paper_pair
from scenes import linear_law, smooth_box

import exugear
import fem
from fem.units import mm, um

PAIR = paper_pair()
FRICTION = exugear.MeshFriction.of_pair(PAIR, MU)
SPEEDS, LOADS = [20.0, 60.0, 120.0], [20.0, 300.0]


def box(parts=None, **stage) -> exugear.Gearbox:
    """The paper's pair with constant mesh stiffness and the same further parts on both shafts."""
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear()} | (parts or {})) for name in ("fast", "slow")]
    return exugear.Gearbox(
        [exugear.Stage(*shafts, linear_law(backlash=50 * um), pair=PAIR, **{"damping_ratio": 0.06} | stage)]
    )


def solved(gearbox: exugear.Gearbox, **changes):
    """Efficiency over the speeds and loads of these tests."""
    data = exugear.efficiency(gearbox, **{"speeds": SPEEDS, "loads": LOADS, "progress": False} | changes)
    assert (data["error"] < data.attrs["tolerance"]).all()
    return data


def test_efficiency_of_constant_friction_is_ohlendorfs():
    """Below the resonance of the mesh, where friction itself excites it and its loss falls by up to 2 %."""
    data = solved(box(friction=FRICTION))
    assert data["efficiency"].dims == ("speed", "load")
    friction = data["loss"].sel(kind="friction") / data["power_out"]
    lost = 1 - data["efficiency"]
    for share in (friction, lost):
        assert share.values == pytest.approx(np.full((3, 2), FRICTION.loss(PAIR)), rel=5e-3)


def test_efficiency_of_viscous_drag_by_hand():
    """Both shafts turn at the same speed: 1 / (1 + 2 d omega / M)."""
    drag = 2e-3
    data = solved(box({0 * mm: exugear.Drag(viscous=drag)}))
    speed, load = np.meshgrid(SPEEDS, LOADS, indexing="ij")
    assert data["efficiency"].values == pytest.approx(1 / (1 + 2 * drag * speed / load), abs=1e-6)
    assert data["loss"].sel(kind="drag").values == pytest.approx(2 * drag * speed**2, rel=1e-6)
    assert data["power_out"].values == pytest.approx(speed * load, rel=1e-6)


def test_without_friction_and_drag_only_the_mesh_damping_is_lost():
    data = solved(smooth_box())
    assert data["kind"].values.tolist() == ["mesh"]
    lost = data["loss"].sel(kind="mesh") / data["power_in"]
    assert (lost > 0).all()
    assert data["efficiency"].values == pytest.approx(1 - lost.values, abs=1e-5)
    undamped = solved(box(damping_ratio=None), speeds=[100.0], loads=[150.0])
    assert undamped["efficiency"].values == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_a_run_twenty_times_as_long_has_the_same_efficiency():
    """Parametric excitation of the mesh, on damped bearings."""
    ball = exugear.Bearing(radial=2e8, axial=1e8, damping_time=2e-5)
    gearbox = smooth_box(friction=FRICTION, parts={0 * mm: ball, 60 * mm: ball})
    data = solved(gearbox, speeds=[150.0], loads=[100.0])
    run = exugear.run_up(exugear.build(gearbox), speed=150.0, load=100.0, duration=0.6, power=True, progress=False)
    expected = run.energy_balance(0.3).efficiency
    assert float(data["efficiency"].item()) == pytest.approx(expected, abs=1e-5)
    assert data["kind"].values.tolist() == ["mesh", "bearing", "friction"]


def test_windows_hold_whole_cycles_of_all_stages():
    """20/40 and 23/50 teeth, whose mesh frequencies have a common period of 40 and 23 cycles."""
    teeth = [(20, 40), (23, 50)]
    pairs = [fem.GearPair(*(few_teeth(z=z, x=0.0) for z in numbers)) for numbers in teeth]
    parts = [{0.0: pairs[0].pinion}, {0.0: pairs[0].wheel, 40 * mm: pairs[1].pinion}, {40 * mm: pairs[1].wheel}]
    shafts = [exugear.Shaft(name, part) for name, part in zip(("fast", "middle", "slow"), parts, strict=True)]
    frictions = [exugear.MeshFriction.of_pair(pair, MU) for pair in pairs]
    stages = [
        exugear.Stage(*ends, linear_law(), pair=pair, friction=friction, damping_ratio=0.06)
        for ends, pair, friction in zip(pairwise(shafts), pairs, frictions, strict=True)
    ]
    data = solved(exugear.Gearbox(stages), speeds=[40.0], loads=[50.0])
    kept = np.prod([1 - friction.loss(pair) for friction, pair in zip(frictions, pairs, strict=True)])
    assert 1 - data["efficiency"].item() == pytest.approx(1 - kept, rel=0.01)


def test_a_load_that_drives_delivers_its_power_at_the_driving_shaft():
    data = solved(box(friction=FRICTION), speeds=[100.0], loads=[-150.0])
    assert data["power_in"].item() < 0
    assert data["power_out"].item() == pytest.approx(-150.0 * 100.0, rel=1e-6)
    assert 1 - data["efficiency"].item() == pytest.approx(FRICTION.loss(PAIR), rel=5e-3)


def test_executor_gives_the_same_numbers():
    gearbox, points = box(friction=FRICTION), {"speeds": [50.0, 100.0], "loads": [100.0]}
    alone = solved(gearbox, **points)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        spread = solved(gearbox, **points, executor=executor)
    assert alone.identical(spread)


def test_points_beyond_the_map_are_nan_with_the_reason(tmp_path):
    data = exugear.efficiency(smooth_box(), speeds=[50.0], loads=[100.0, 5000.0], progress=False)
    assert np.isfinite(data["efficiency"].values).tolist() == [[True, False]]
    assert np.isnan(data["loss"].values[..., 1]).all()
    first, second = data["stopped"].values[0]
    assert first == ""
    assert "the map ends at a pinion torque of 4000 N m" in second
    data.to_netcdf(tmp_path / "efficiency.nc")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speeds": [0.0, 10.0]}, "speeds must be > 0 rad/s"),
        ({"speeds": [20.0, 10.0]}, "speeds must increase"),
        ({"speeds": [1e-4]}, "speeds must be higher than 0.0001 rad/s"),
        ({"loads": [0.0, 10.0]}, "loads must be finite and not 0 N m"),
        ({"loads": []}, "loads must increase over at least 1"),
        ({"tolerance": 0.5}, "tolerance must lie in"),
    ],
)
def test_points_out_of_range_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        solved(box(), **changes)
