"""Laws whose coast flank has its own table: against the law of the pair turned by hand, energy, ends of the map."""

import numpy as np
import pytest
import xarray as xr
from coarse_maps import COARSE
from paper_gears import paper_gear, paper_pair
from scenes import TORQUES, smooth_map
from two_sided_maps import TILTS, both_sides, flank_te

import exugear
import fem
from fem.units import mm, um

J = 40 * um
LEFT = smooth_map(TORQUES[:-3])


def turned_by_hand(tilts=None) -> xr.Dataset:
    """The map of the left flanks of the pair turned about the line of centres: z the other way."""
    pair, phase, torque = (
        paper_pair(),
        np.sort((paper_pair().back_phase - np.arange(24) / 24) % 1.0),
        [0, 100, 350, 700],
    )
    load = np.array(torque, float)
    if tilts is None:
        return fem.ste_map(pair, load, phase, flank_te(load[:, None], phase, softer=1.4))
    te = flank_te(load[:, None, None], phase, tilts[:, None], softer=1.4)
    return fem.ste_map(pair, load, phase, te[:, ::-1], {"misalignment": -tilts[::-1]})


@pytest.mark.parametrize("tilts", [None, TILTS])
def test_the_coast_flank_is_the_driving_one_of_the_pair_turned_by_hand(tilts):
    law = exugear.MeshForce.from_ste(both_sides(tilts), backlash=J)
    turned = exugear.MeshForce.from_ste(turned_by_hand(tilts))
    offsets = {} if tilts is None else {"misalignment": 0.5e-4}
    phase, depth = np.meshgrid(np.linspace(0, 1, 31), np.array([1, 4, 8]) * um + turned.deflection.min() + 12 * um)
    coast = law(phase, -J - depth, **offsets)
    assert -coast == pytest.approx(turned(law.back_phase - phase, depth, **offsets), rel=1e-9)
    alone = exugear.MeshForce.from_ste(both_sides(tilts).sel(torque=slice(0, None)), backlash=J)
    assert law(phase, depth, **offsets) == pytest.approx(alone(phase, depth, **offsets), rel=1e-12)
    if offsets:
        at = law.at(**offsets)
        assert at(phase, -J - depth) == pytest.approx(coast, rel=1e-3, abs=1e-4 * np.abs(coast).max())


def test_a_mirror_image_takes_no_memory_and_a_map_says_whether_it_holds():
    """Of symmetric gears torques < 0 say nothing new."""
    unlike = fem.GearPair(paper_gear(flank=fem.Sides((), (fem.TipRelief(20 * um, 3 * mm),))), paper_gear(), a=150 * mm)
    slices = fem.Slices(COARSE.density, COARSE.slices)
    both, right = (
        fem.static_transmission_error(pair, [-350, -150, 0, 150, 350], 8, resolution=slices, progress=False)
        for pair in (paper_pair(), unlike)
    )
    left = exugear.MeshForce.from_ste(both.sel(torque=slice(0, None)))
    assert exugear.MeshForce.from_ste(both).table.tobytes() == left.table.tobytes()
    assert left.coast_unlike == ""
    assert exugear.MeshForce.from_ste(right).coast is not None
    assert exugear.MeshForce.from_ste(right).coast_unlike == ""
    assert exugear.MeshForce.from_ste(right.sel(torque=slice(0, None))).coast_unlike == "left and right flanks differ"


def test_ends_of_the_map_of_the_coast_flank():
    law = exugear.MeshForce.from_ste(both_sides(), backlash=J)
    with pytest.raises(ValueError, match=r"deflection -\d+ um lies beyond the map, which ends at -"):
        law(0.0, -J - 200 * um)
    tilted = exugear.MeshForce.from_ste(both_sides(TILTS), backlash=J)
    with pytest.raises(ValueError, match=r"extend the axis: fem.Offsets\(misalignment=\(-0.0003, .*, 0.000"):
        tilted(0.0, -J - 20 * um, misalignment=-2e-4)
    assert np.isfinite(tilted(0.0, -J - 20 * um, misalignment=2e-4))


def test_secant_law_of_both_sides():
    law = exugear.MeshForce.secant(both_sides(), 350.0, backlash=J)
    stiffer = flank_te(350.0, 0.3, softer=1.4) / flank_te(350.0, 0.3, softer=1.0)
    assert law(0.3, 5 * um) == pytest.approx(stiffer * -law(law.back_phase - 0.3, -J - 5 * um), rel=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda ste: ste.drop_vars("te_unloaded_right"), "assign it over"),
        (lambda ste: ste.assign(te_unloaded_right=0.0), "te_unloaded_right must have the axes"),
        (
            lambda ste: ste.assign(te_unloaded_right=ste["te_unloaded_right"] * np.nan),
            "te_unloaded_right must be finite",
        ),
        (lambda ste: ste.sel(torque=[-700, 0, 100, 350]), "right flanks, with torque and te reversed: torque needs 0"),
        (lambda ste: ste.assign(te=abs(ste["te"])), "right flanks, with torque and te reversed: te must grow"),
    ],
)
def test_maps_with_an_unfinished_side_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        exugear.MeshForce.from_ste(change(both_sides()))


@pytest.mark.parametrize("call", [exugear.MeshForce.from_ste, lambda ste: exugear.MeshForce.secant(ste, 100.0)])
@pytest.mark.parametrize(
    "change", [lambda ste: ste.sel(phase=ste["phase"] <= 0.5), lambda ste: ste.isel(phase=[0, 1, 9])]
)
def test_a_law_needs_the_whole_mesh_cycle(call, change):
    with pytest.raises(ValueError, match="phase must cover the mesh cycle"):
        call(change(LEFT))
    sparse = fem.ste_map(paper_pair(), LEFT["torque"], [0.0, 0.1, 0.2], LEFT["te"].values[:, :3])
    assert call(sparse).phase.size > 0
