"""Vibration modes of rings on supports, against statics, rigid motions and thin rings."""

from math import pi

import numpy as np
import pytest
from elastic_rings import BOLTS, BUSH, ring_map, ring_modes, ring_pair
from ring_gears import COARSE, planet

import fem
from fem.units import mm

SUPPORTS = pytest.mark.parametrize("support", [BUSH, BOLTS], ids=["bush", "bolts"])


@SUPPORTS
@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
def test_all_modes_together_are_the_static_ring(support, side):
    """sum g_i g_j / omega^2 over many modes is the cross compliance, of either flank; with radial shapes the rim."""
    pair, modes = ring_pair(support), ring_modes(support, 150)
    at = modes["at"].values[::32]
    static = fem.ring_deflection(pair, at, at[:8], side=side, resolution=COARSE)
    soft = {
        name: modes[name].values[:, ::32] / (2 * pi * modes["frequency"].values[:, None])
        for name in ("left_flank", "right_flank", "radial", "tangential")
    }
    flank = soft["left_flank" if side > 0 else "right_flank"]
    for name, shapes in (("deflection", flank), ("radial", soft["radial"]), ("tangential", soft["tangential"])):
        expected = static[name].values
        assert (flank.T @ shapes)[:8] == pytest.approx(expected, abs=0.01 * np.abs(expected).max())


@SUPPORTS
def test_what_modes_leave_out_is_told(support):
    modes, many = ring_modes(support), ring_modes(support, 150)
    assert modes["cross"].values == pytest.approx(many["cross"].values, abs=1e-3 * many["cross"].values[0])
    own, left_out = (float(modes[name][0]) for name in ("cross", "cross_left_out"))
    apart = modes["cross_left_out"].sel(apart=2 * pi / 3, method="nearest")
    assert 0 < left_out < 0.6 * own
    assert abs(float(apart)) < 0.05 * own
    assert bool((modes["flexibility"] < modes["bending"]).all())
    assert float((many["flexibility"] / many["bending"]).min()) > 0.99


def test_a_soft_bush_lets_the_ring_move_as_a_rigid_body():
    """Translation at (2 pi R k / m)^0.5 with the mass of the finite elements, which exceeds that of the smooth disc."""
    modes, gear = ring_modes(), ring_pair().wheel
    r = abs(gear.d_rim) / 2
    of_translation = modes["frequency"].values[modes["lobes"].values == 1]
    turning = modes["turning"].values[modes["lobes"].values == 0]
    assert of_translation[0] == pytest.approx(of_translation[1], rel=1e-9)
    rigid = np.sqrt(2 * pi * r * 1e8 / gear.mass) / (2 * pi)
    assert of_translation[0] == pytest.approx(rigid, rel=0.05)
    assert turning[0] ** 2 == pytest.approx(gear.inertia, rel=0.03)


def test_a_pair_of_equal_modes_is_not_cut():
    assert ring_modes(BUSH, 1).sizes["ring_mode"] == 2
    assert ring_modes(BUSH, 3).sizes["ring_mode"] == 3
    assert ring_modes(BUSH, 3)["lobes"].values.tolist() == [1, 1, 0]


def test_the_map_without_modes_is_stiffer_by_their_flexibility():
    ste, modes = ring_map(), ring_modes()
    rest = fem.without_ring_modes(ste, modes)
    force = ste["torque"] / ring_pair().pinion.r_b
    expected = ste["te"] - force * float(modes["flexibility"].mean())
    assert rest["te"].values == pytest.approx(expected.values, abs=1e-4 * float(ste["te"].max()))
    assert rest["te"].dims == ste["te"].dims


@pytest.mark.slow
def test_a_map_of_finite_elements_keeps_its_stiffness_and_its_coast_side():
    """On bolts over all pitches, torques of both signs: stiffness is d force / d te of what is left."""
    pair, modes = ring_pair(BOLTS), ring_modes(BOLTS)
    ste = fem.static_transmission_error(pair, [-40.0, 0.0, 40.0, 80.0], 6, resolution=COARSE, progress=False)
    assert ste.attrs["cross_compliance"] == pytest.approx(modes["cross"].values, rel=1e-3, abs=1e-12)
    left_out = ste.attrs["cross_left_out"].reshape(-1, modes.sizes["apart"])[modes.sizes["ring_mode"] - 1]
    assert left_out == pytest.approx(modes["cross_left_out"].values, rel=1e-3, abs=1e-12)
    rest = fem.without_ring_modes(fem.over_pitches(ste), modes)
    loaded = rest.sel(torque=[40.0, 80.0])
    secant = 40.0 / pair.pinion.r_b / loaded["te"].diff("torque").squeeze()
    tangent = 1 / (1 / loaded["stiffness"]).mean("torque")
    assert float((tangent / secant).mean()) == pytest.approx(1.0, abs=0.03)
    assert bool((rest["te"].diff("torque") > 0).all())


@pytest.mark.slow
def test_thin_rings_vibrate_as_those_of_love_and_hoppe():
    """omega_n^2 = (E I n^2 (n^2 - 1)^2 / R^3 + (k_r n^2 + k_t) R) / (rho A R (n^2 + 1)); teeth as mass alone.

    Free, and on a bush: a support as stiff as the rim. The teeth stiffen the rim, shear softens it from three lobes on.
    """
    e, rim = 210e9, 12 * mm
    sizes = {"m_n": 1 * mm, "b": 10 * mm}
    for stiffness in (1e6, 3e7):
        bush = fem.Bush(radial=stiffness, tangential=stiffness)
        ring = fem.Gear(z=-120, d_a=118.4 * mm, d_rim=146.5 * mm, support=bush, **sizes)
        modes = fem.ring_modes(fem.GearPair(planet(30, 0.0, d_bore=15 * mm, **sizes), ring), 12, resolution=COARSE)
        outside = abs(ring.d_rim) / 2
        radius, inertia = outside - rim / 2, sizes["b"] * rim**3 / 12
        translation = 2 * pi * modes["frequency"].values[modes["lobes"].values == 1][0]
        mass = 2 * pi * outside * stiffness / translation**2
        for n, tolerance in ((2, 0.025), (3, 0.025), (4, 0.06)):
            bending, support = e * inertia * n**2 * (n**2 - 1) ** 2 / radius**3, stiffness * outside * (n**2 + 1)
            omega = np.sqrt((bending + support) / (mass / (2 * pi) * (n**2 + 1)))
            of_lobes = 2 * pi * modes["frequency"].values[modes["lobes"].values == n]
            assert of_lobes == pytest.approx(omega, rel=tolerance)


def test_pairs_without_such_a_ring_are_refused():
    with pytest.raises(ValueError, match=r"rim is on fem\.Bolts or a fem\.Bush"):
        fem.ring_modes(ring_pair(()))
    with pytest.raises(ValueError, match="number must be a number of modes"):
        fem.ring_modes(ring_pair(), 0, resolution=COARSE)
    with pytest.raises(ValueError, match="of another pair"):
        fem.without_ring_modes(ring_map(), ring_modes(BOLTS))
