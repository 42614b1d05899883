"""Gears whose mid-planes differ: the axial offset of their map, and the forces that it causes."""

from functools import cache

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import linear_law, smooth_map

import exugear
import fem
from exugear import Bearing, Gearbox, Placement, Shaft, Stage
from fem.units import deg, mm, um

ENDS = {0.0: Bearing(2e8, 1e8, damping_time=2e-5), 60 * mm: Bearing(5e8, damping_time=2e-5)}


def offset_map(axial: float):
    """A map that was made for an axial offset [m]."""
    return smooth_map().assign_attrs(axial=axial)


def stage(wheel: float, mesh, pinion: float = 30 * mm, parts=None, **changes) -> Stage:
    shafts = [Shaft(name, {z: paper_gear(), **(parts or {})}) for name, z in (("fast", pinion), ("slow", wheel))]
    return Stage(*shafts, mesh, **changes)


@pytest.mark.parametrize("wheel", [32.5 * mm, 27.5 * mm])
def test_a_stage_takes_a_map_that_was_made_for_its_axial_offset(wheel):
    offset = wheel - 30 * mm
    box = Gearbox([stage(wheel, offset_map(offset))])
    assert box.offsets(box.stages[0])["axial"] == pytest.approx(offset)
    assert "fast-slow" in exugear.plan(box).axes
    for mesh in (smooth_map(), offset_map(-offset)):
        with pytest.raises(ValueError, match=rf"pinion at 30 mm, wheel at {wheel / mm:g} mm: .*axial={offset:g}\)"):
            exugear.plan(Gearbox([stage(wheel, mesh)]))
    with pytest.raises(ValueError, match=rf"give axial = 0, but its map is for {offset:g}"):
        exugear.plan(Gearbox([stage(30 * mm, offset_map(offset))]))


def test_a_pinion_that_turns_clockwise_takes_the_map_with_the_opposite_sign():
    """The z axis of the map is that of a pinion that turns counter-clockwise."""
    first, middle, last = (Shaft(n, {z: paper_gear()}) for n, z in (("a", 0.0), ("b", 0.0), ("c", 3 * mm)))

    def planned(axial: float):
        return exugear.plan(Gearbox([Stage(first, middle, smooth_map()), Stage(middle, last, offset_map(axial))]))

    assert planned(-3 * mm)
    with pytest.raises(ValueError, match=r"axial = -0\.003"):
        planned(3 * mm)


def test_the_pair_meshes_where_its_faces_overlap():
    """A pinion takes the nearest of two wheels; faces of 23 mm that overlap by less than a tenth do not mesh."""
    pinion, twice = Shaft("fast", {30 * mm: paper_gear()}), {2 * mm: paper_gear(), 33 * mm: paper_gear()}
    law = linear_law()
    given = {"pair": paper_pair()}
    assert Stage(pinion, Shaft("slow", twice), law, **given).axial_positions == (30 * mm, 33 * mm)
    with pytest.raises(ValueError, match=r"tenth of their face width.* pinion at \[30.0\] mm, wheel at \[51.0\] mm"):
        stage(51 * mm, law, **given)


@pytest.mark.parametrize("moved", [2.5 * mm, -2.5 * mm])
def test_gears_beside_each_other_are_those_of_a_displaced_shaft(moved):
    """On bearings: the wheel further along its shaft, or the whole shaft with its bearings displaced."""
    law = exugear.MeshForce.from_ste(axial_map())
    nearer = {z - moved: bearing for z, bearing in ENDS.items()}
    shafts = [
        Shaft("slow", {30 * mm + moved: paper_gear(), **ENDS}),
        Shaft("slow", {30 * mm: paper_gear(), **nearer}, offset=Placement(z=moved)),
    ]
    fast = Shaft("fast", {30 * mm: paper_gear(), **ENDS})
    models = [exugear.build(Gearbox([Stage(fast, slow, law, pair=paper_pair())])) for slow in shafts]
    runs = [exugear.run_up(model, speed=100.0, duration=2e-3, load=150.0, progress=False).data for model in models]
    for name in ("dte", "misalignment", "bearing_force"):
        largest = np.abs(runs[0][name].values).max()
        assert runs[1][name].values == pytest.approx(runs[0][name].values, abs=1e-6 * largest), name
    start = runs[0].isel(time=0, stage=0)
    assert float(start["axial_offset"]) == pytest.approx(moved, abs=5 * um)
    assert "mid-planes of its mesh differ" in models[0].plan.why["slow"]


def axial_map():
    """A law that is softer where less of the face meets, and whose force acts in the middle of the common face."""
    flat, axial = smooth_map(), np.array([-4, -2, 0, 2, 4]) * mm
    width = paper_pair().b
    te = flat["te"].expand_dims(axial=axial, axis=1) * (width / (width - abs(axial)))[None, :, None]
    data = fem.ste_map(paper_pair(), flat["torque"].values, flat["phase"].values, te.values, {"axial": axial})
    return data.assign(centroid=(data["te"].dims, np.broadcast_to(axial[None, :, None] / 2, data["te"].shape)))


@cache
def idler_gears(beta: float):
    sizes = {"m_n": 2 * mm, "d_bore": 20 * mm}
    narrow = [fem.Gear(z=z, b=14 * mm, beta=beta, **sizes) for z in (23, 29)]
    return narrow[0], fem.Gear(z=31, b=40 * mm, beta=-beta, **sizes), narrow[1]


def dte_of_idler(beta: float, idler: float, times: np.ndarray) -> np.ndarray:
    """(2, n) DTE of both meshes of a wide idler at an axial position [m]."""
    a, b, c = idler_gears(beta)
    stages, shafts = [], [Shaft("a", {0.0: a}), Shaft("b", {idler: b}), Shaft("c", {0.0: c})]
    for i, (z, angle) in enumerate(((54, 0.0), (60, 40 * deg))):
        pair = fem.GearPair(*(a, b, c)[i : i + 2], a=z * mm / np.cos(beta) + 0.1 * mm)
        at = fem.Offsets(axial=idler)
        options = {"resolution": fem.Slices(), "progress": False, "offsets": at}
        ste = fem.static_transmission_error(pair, [0, 5, 20, 60, 150, 400], 16, **options)
        stages.append(Stage(*shafts[i : i + 2], ste, damping_ratio=0.1, angle=angle))
    model = exugear.build(Gearbox(stages))
    data = exugear.run_up(model, speed=2.0, duration=0.4, load=80.0, progress=False, sample=2e-4).data
    return np.array([np.interp(times, data["time"], dte) for dte in data["dte"].values])


@pytest.mark.slow
@pytest.mark.parametrize("beta", [15 * deg, -15 * deg])
def test_a_wide_idler_may_move_along_its_axis(beta):
    """Its helix only turns it: the DTE of both meshes stays within 3 % of the peak to peak, by finite elements."""
    times = np.linspace(0.1, 0.39, 1000)
    still, moved = (dte_of_idler(beta, idler, times) for idler in (0.0, 3 * mm))
    assert np.ptp(still, axis=1).min() > 1.5 * um
    assert np.abs(moved - still).max() < 0.06 * um
