"""Advice of the plan on axes that a map lacks: a run stays within a map that is made by it."""

import re

import numpy as np
import pytest
from paper_gears import paper_gear
from scenes import paper_pair, ran, smooth_box, smooth_map
from spatial_meshes import helical_pair

import exugear
import fem
from fem import ste_map
from fem.units import mm, um

LINEAR = {0.0: exugear.Bearing(2e8, 1e8, damping_time=1e-5), 80 * mm: exugear.Bearing(2e8, damping_time=1e-5)}
LOOSE = {0.0: exugear.Bearing(2e8, 1e8, clearance=5 * um, damping_time=1e-5), 80 * mm: LINEAR[80 * mm]}
SOFT = LINEAR | {0.0: exugear.Bearing(2e8, 1e7, damping_time=1e-5)}
RECORDED = {"a": "centre_distance", "misalignment": "misalignment", "axial": "axial_offset"}


def pasted(plan: exugear.Plan) -> dict[str, np.ndarray]:
    """The `fem.Offsets` of the printed plan."""
    line = re.search(r"map with offsets=(fem\.Offsets\(.*\))", str(plan)).group(1)
    offsets = eval(line, {"fem": fem})
    return {name: np.array(getattr(offsets, name)) for name in offsets.axes()}


def over(offsets, pair=None):
    """The smooth map, 10 % softer at the ends of every axis but the misalignment: 1 %, as it also turns the shafts."""
    plain, softer = smooth_map((0, 1, 20, 50, 150, 350, 1000)), np.ones([x.size for x in offsets.values()])
    for i, axis in enumerate(offsets.values()):
        size = 0.1 * np.abs(axis - axis.mean()) / np.ptp(axis)
        size = 0.1 * size if list(offsets)[i] == "misalignment" else size
        softer = softer * (1 + size).reshape([-1 if i == j else 1 for j in range(softer.ndim)])
    te = plain["te"].values
    te = te.reshape(te.shape[0], *[1] * softer.ndim, -1) * softer[..., None]
    return ste_map(pair or paper_pair(), plain["torque"].values, plain["phase"].values, te, dict(offsets))


def box(parts, offsets=(), pair=None) -> exugear.Gearbox:
    pair = pair or paper_pair()
    gears = {"fast": pair.pinion, "slow": pair.wheel}
    shafts = [exugear.Shaft(name, {30 * mm: gear} | parts) for name, gear in gears.items()]
    return exugear.Gearbox([exugear.Stage(*shafts, over(dict(offsets), pair), damping=2700.0)])


@pytest.mark.parametrize(
    ("parts", "pair", "axes"),
    [
        (LINEAR, paper_pair(), {"a", "misalignment"}),
        (LOOSE, paper_pair(), {"a", "misalignment"}),
        (SOFT, helical_pair(), {"a", "misalignment", "axial"}),
    ],
)
def test_a_run_stays_within_a_map_over_the_offsets_of_the_plan(parts, pair, axes):
    offsets = pasted(exugear.plan(box(parts, pair=pair), load=350.0))
    assert set(offsets) == axes
    ends_and_middle = {name: axis[[0, axis.size // 2, -1]] for name, axis in offsets.items()}
    data = ran(exugear.build(box(parts, ends_and_middle, pair)), load=350.0, duration=0.01)
    for name, axis in offsets.items():
        values = data[RECORDED[name]].values
        assert axis[0] < values.min() and values.max() < axis[-1]
        step = np.diff(axis)[0] / (2 if name == "axial" else 1)
        reached = np.abs(values[0, 0] - (pair.a if name == "a" else 0.0))
        assert reached == pytest.approx(step, rel=0.15)


def test_axes_that_the_map_has_stay_in_the_advice():
    a = np.array([149.9, 150, 150.2]) * mm
    offsets = pasted(exugear.plan(box(LINEAR, {"a": a}), load=350.0))
    assert offsets["a"] == pytest.approx(a, rel=1e-9)
    assert offsets["misalignment"].size == 5


def test_by_default_the_load_is_the_largest_of_the_map():
    assert re.search(r"under 1000 N m a = [\d.]+ m\b", str(exugear.plan(box(LINEAR))))


def test_shafts_that_hardly_move_need_no_axes():
    stiff = exugear.Bearing(9e12, 9e12, 9e10)
    assert "too little to matter" in str(exugear.plan(smooth_box(parts={30 * mm: [paper_gear(), stiff]}), load=1.0))
    assert "Offsets" not in str(exugear.plan(smooth_box()))


def test_bearings_too_soft_for_gears_to_mesh_are_named():
    soft = exugear.Bearing(2e5, 1e5, 1e4)
    assert "yield too far for the gears to mesh: use stiffer" in str(exugear.plan(smooth_box(soft), load=350.0))


def test_plans_need_a_load():
    with pytest.raises(ValueError, match="load must be finite and not 0"):
        exugear.plan(smooth_box(), load=0.0)
