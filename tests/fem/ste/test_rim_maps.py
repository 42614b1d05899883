"""Maps of a pinion in a ring on supports, over the position of the mesh on the ring."""

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np
import pytest
import xarray as xr
from ring_gears import COARSE, bolted, thin_ring_pair

import exugear
import fem
from fem import Slices
from fem.units import mm, um

TORQUE, Z = 40.0, 53
PITCH = 2 * pi / Z


def ste_of(pair: fem.GearPair, torque=TORQUE, phases=4, **options) -> xr.Dataset:
    return fem.static_transmission_error(pair, torque, phases, progress=False, **{"resolution": COARSE} | options)


@cache
def over_angles() -> xr.Dataset:
    """Over the default ring angles of a thin rim on eight bolts."""
    return ste_of(thin_ring_pair(bolted()), [0, 10.0, TORQUE], 6)


def test_a_rim_between_bolts_is_softer_than_at_a_bolt():
    """And than a clamped one; without load te does not depend on the rim.

    It is stiffest where the line of action meets the rim near a bolt: the mesh is then past the bolt.
    """
    ste, clamped = over_angles(), ste_of(thin_ring_pair(), [0, TORQUE], 6)
    assert dict(ste.sizes) | {"pair": 0} == {"torque": 3, "ring_angle": 12, "phase": 6, "pair": 0}
    assert ste["te"].values[0] == pytest.approx(np.tile(clamped["te"].values[0], (12, 1)), abs=1e-15)
    mean = ste["te"].sel(torque=TORQUE).mean("phase").values
    assert mean.min() > clamped["te"].sel(torque=TORQUE).mean("phase").values
    assert mean.max() > 2 * mean.min()
    ring, alpha_wt = fem.pair_of(ste).wheel, fem.pair_of(ste).alpha_wt
    assert 0 < ste["ring_angle"].values[mean.argmin()] < np.arccos(ring.r_b / ring.r_clamp) - alpha_wt
    assert ste["load_share"].sum("pair").values[1:] == pytest.approx(1, abs=1e-9)
    assert (np.diff(ste["te"].values, axis=0) > 0).all()


def test_ring_angles_of_the_map_give_the_teeth_one_after_the_other():
    """Solved directly by unlike teeth that do not deviate, whose phases run over all pitches: within 1 %."""
    pair = thin_ring_pair(bolted())
    numbered = replace(pair, wheel=replace(pair.wheel, flank=fem.PitchDeviation([0.0] * Z)))
    phases = np.array([0.0, 0.5, 2.0, 3.5, 20.5])
    direct = ste_of(numbered, [TORQUE], phases)
    ste = fem.over_pitches(over_angles())
    assert ste.attrs["pitches"] == Z
    assert ste["phase"].size == 6 * Z
    at = ste.sel(torque=TORQUE, phase=phases, method="nearest")
    assert at["te"].values == pytest.approx(direct["te"].values[0], rel=0.01)
    assert at["load_share"].sum("pair").values == pytest.approx(1, abs=1e-9)
    shares = at["load_share"].sel(pair=direct["pair"].values).transpose(*direct["load_share"].dims[1:]).values
    assert shares == pytest.approx(direct["load_share"].values[0], abs=0.02)


def test_a_map_over_all_pitches_repeats_after_the_period_of_the_bolts():
    """52 bolts would repeat after a pitch and a bit; 53 repeat after each pitch."""
    ste = fem.over_pitches(ste_of(thin_ring_pair(bolted(number=Z, width=1 * mm)), ring_angles=4))
    assert ste.attrs["pitches"] == 1
    with pytest.raises(ValueError, match="without gaps of more than a quarter"):
        fem.over_pitches(over_angles().isel(ring_angle=slice(0, 6)))
    with pytest.raises(ValueError, match="must have the axis ring_angle"):
        fem.over_pitches(ste)


def test_right_flanks_are_left_ones_of_the_mirror_image():
    """With unlike bolts, at the mirrored ring angles."""
    pair = thin_ring_pair(bolted(angles=(0.1, 0.9, 2.0, 4.0)))
    angles, phases = np.array([0.3, 1.2]), np.array([0.1, 0.6])
    both = ste_of(pair, [-TORQUE, 0, TORQUE], phases, ring_angles=angles)
    mirror, at = fem.mirror_image(pair), PITCH * pair.back_phase - angles[::-1]
    for phase in phases:
        alone = ste_of(mirror, TORQUE, [(pair.back_phase - phase) % 1], ring_angles=at)
        expected = both["te"].sel(torque=-TORQUE, phase=phase).values
        assert -alone["te"].values[0, ::-1, 0] == pytest.approx(expected, rel=1e-6)


def test_a_mirrored_ring_has_mirrored_right_flanks():
    """Bolts symmetric about the middle of tooth 0: both flanks are alike where it is as far before as behind."""
    pair = thin_ring_pair(bolted())
    ring_angle, phase = 0.2, 0.0
    left = ste_of(pair, TORQUE, [phase], ring_angles=[ring_angle])
    # The right flank of the same tooth touches at the pitch point a tooth thickness earlier.
    thickness = PITCH * (1 - pair.back_phase)
    right = ste_of(pair, [-TORQUE], [pair.back_phase], ring_angles=[-ring_angle - thickness])
    assert right["te"].values.ravel() == pytest.approx(-left["te"].values.ravel(), rel=1e-4)


def test_slices_are_near_on_a_ring_that_bends():
    resolved = over_angles()["te"].sel(torque=TORQUE).isel(ring_angle=[0, 6])
    by_slices = ste_of(thin_ring_pair(bolted()), TORQUE, 6, resolution=Slices.like(COARSE))["te"].isel(
        ring_angle=[0, 6]
    )
    assert by_slices.values[0] == pytest.approx(resolved.values, rel=0.01)


def test_a_map_knows_its_supports_after_it_was_saved(tmp_path):
    ste = over_angles()
    loaded = fem.load(fem.save(ste, tmp_path / "map.nc"))
    assert fem.pair_of(loaded) == fem.pair_of(ste)
    assert loaded["ring_angle"].attrs["units"] == "rad"
    with pytest.raises(ValueError, match=r"fem\.over_pitches"):
        exugear.MeshForce.from_ste(ste)


def test_ring_angles_are_refused_where_they_do_not_exist():
    for pair in (thin_ring_pair(), thin_ring_pair(fem.Bush(radial=1e10, tangential=1e10))):
        with pytest.raises(ValueError, match="ring_angles belong to a ring on bolts"):
            ste_of(pair, ring_angles=8)
    bolts = thin_ring_pair(bolted())
    for ring_angles in (2, [0.0, 45.0], [0.3, 0.1]):
        with pytest.raises(ValueError, match="ring_angles must"):
            ste_of(bolts, ring_angles=ring_angles)


def test_a_bush_is_even_and_the_average_of_as_many_bolts():
    """Springs of a bolt at each pitch, spread over the circumference, are a little softer: they hold mean values."""
    pair = thin_ring_pair()
    length = 2 * pi * abs(pair.wheel.r_clamp) / Z
    bush = fem.Bush(radial=1e9 / length, tangential=1e9 / length)
    bolts = bolted(number=Z, width=0.999 * length)
    even = ste_of(thin_ring_pair(bush))["te"].values[0]
    softer = ste_of(thin_ring_pair(bolts), ring_angles=4)["te"].mean("ring_angle").values[0]
    assert (softer > even).all()
    assert softer == pytest.approx(even, rel=0.02)


def test_the_supports_take_force_and_torque_of_the_mesh():
    """Reactions of a bush, integrated around the rim, per unit mesh force; the ring turns with the planet."""
    pair = thin_ring_pair(fem.Bush(radial=2e10, tangential=1e9))
    angle = np.linspace(0, 2 * pi, 400, endpoint=False)
    moved = fem.ring_deflection(pair, angle, resolution=COARSE).isel(mesh=0)
    per_angle = 2 * pi * abs(pair.wheel.r_clamp) / angle.size
    radial, tangential = 2e10 * moved["radial"].values * per_angle, 1e9 * moved["tangential"].values * per_angle
    outwards = np.exp(1j * angle)
    assert abs((radial * outwards + 1j * tangential * outwards).sum()) == pytest.approx(1, rel=2e-3)
    assert tangential.sum() * pair.wheel.r_clamp == pytest.approx(abs(pair.wheel.r_b), rel=5e-3)


def test_meshes_deflect_each_other_alike():
    """Maxwell and Betti; and a mesh on the right flanks is the mirror image of one on the left flanks."""
    pair = thin_ring_pair(bolted())
    ahead = fem.ring_deflection(pair, [1.0], 0.3, resolution=COARSE)["deflection"].item()
    assert fem.ring_deflection(pair, [0.3], 1.0, resolution=COARSE)["deflection"].item() == pytest.approx(
        ahead, rel=1e-9
    )
    angle = np.array([0.2, 2.0])
    left = fem.ring_deflection(pair, angle, 0.0, resolution=COARSE)
    right = fem.ring_deflection(pair, -angle, PITCH * (pair.back_phase - 1), side=-1, resolution=COARSE)
    assert right["radial"].values == pytest.approx(left["radial"].values, rel=1e-9)
    assert right["tangential"].values == pytest.approx(-left["tangential"].values, rel=1e-9)
    with pytest.raises(ValueError, match="give the ring a support"):
        fem.ring_deflection(thin_ring_pair(), [0.0])


@pytest.mark.slow
def test_an_accuracy_chooses_the_ring_angles():
    """As many as keep the error half-way between them within it; given ones are kept, and their error is told."""
    pair = thin_ring_pair(bolted())
    options = {"accuracy": 0.03, "resolution": None}
    chosen, given = (ste_of(pair, [0, TORQUE], ring_angles=angles, **options) for angles in (None, 6))
    deflection = (chosen["te"][1] - chosen["te"][0]).mean(["ring_angle", "phase"]).item()
    assert chosen["error_ring_angle"].values[1] <= 0.03 * deflection < given["error_ring_angle"].values[1] * 10
    assert given.sizes["ring_angle"] == 6
    assert chosen["error_ring_angle"].values[1] < given["error_ring_angle"].values[1]


def test_the_cost_counts_ring_angles():
    pair = thin_ring_pair(bolted())
    assert fem.map_cost(pair, [0, 10.0], 6, resolution=COARSE).states == 2 * 6 * 12
    assert fem.map_cost(pair, [0, 10.0], 6, resolution=COARSE, ring_angles=5).states == 2 * 6 * 5
    assert over_angles()["te"].max() < 100 * um
