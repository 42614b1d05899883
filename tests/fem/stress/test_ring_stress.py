"""Stresses of pinions in rings: balance of the loads on both gears, root stress in plane and in space."""

import numpy as np
import pytest
from ring_gears import COARSE, bolted, helical_ring_pair, ring_pair, thin_ring_pair

import fem
from fem import Density
from fem.stress import gear_elasticity
from fem.stress.flank_loads import flank_loads, tooth_contacts, with_loaded_teeth
from fem.units import MPa

ROOT = Density(flank=6, fillet=4, land=2, tooth=2, rim=2, body=2, width=1)


@pytest.mark.parametrize("pair", [ring_pair(), helical_ring_pair()])
def test_the_clamped_rim_takes_the_torque_of_the_ring(pair):
    """Nodal forces of the contact: torque F r_b2, thrust that of the pinion reversed."""
    (contact,), _ = tooth_contacts(pair, [0.2], None, COARSE)
    state, force = contact.state(2000.0), 2000.0
    thrusts = []
    for gear, loads in zip((pair.pinion, pair.wheel), flank_loads(contact, state), strict=True):
        elastic = gear_elasticity.solid_gear(gear, with_loaded_teeth(gear, ROOT, loads))
        nodal = gear_elasticity.nodal_forces(elastic, loads)
        f = elastic.in_fixed_axes(nodal)
        x, y = (part.ravel() for part in _positions(elastic))
        assert (x * f[1] - y * f[0]).sum() == pytest.approx(-force * gear.r_b, rel=2e-3)
        thrusts.append(f[2].sum())
    assert thrusts[0] == pytest.approx(-thrusts[1], rel=1e-6, abs=1e-6)
    assert abs(thrusts[0]) == pytest.approx(force * abs(np.tan(pair.beta_b)), rel=2e-3, abs=1e-6)


def _positions(elastic):
    """x and y of the dofs of a solid along the helix, (n_section, n_axis)."""
    turn = np.exp(1j * elastic.gear.twist * elastic.axial)
    points = (elastic.section.doflocs[0] + 1j * elastic.section.doflocs[1])[:, None] * turn
    return points.real, points.imag


def test_root_stress_of_a_ring_in_plane_and_in_space():
    """A spur pair under an even load: the solid's root stress is near that of the section, in both gears."""
    pair = ring_pair()
    solid = fem.root_stress(pair, [50], [0.0, 0.5], density=ROOT, resolution=COARSE, progress=False)
    plane = [f.root_stress / MPa for f in fem.stress.plane_fields(pair, 50, 0.0, resolution=COARSE, refine=4)]
    stress = solid["root_stress"].values[:, 0] / MPa
    assert (stress > 50).all()
    assert stress[:, 0] == pytest.approx(plane, rel=0.1)


def test_load_factors_and_distribution_of_a_helical_ring():
    pair = helical_ring_pair()
    loads = fem.load_distribution(pair, [50], 4, resolution=COARSE, progress=False)
    force = (loads["line_load"] * loads["length"]).sum(["pair", "axial_position"]) * np.cos(pair.beta_b)
    assert force.values == pytest.approx(50 / pair.pinion.r_b, rel=5e-3)
    factors = fem.load_factors(pair, [50], 4, resolution=COARSE, progress=False)
    assert 1 <= float(factors["K_H_beta"].values[0]) < 1.2
    assert float(factors["K_H_alpha"].values[0]) == pytest.approx(1)


def test_the_root_of_a_thin_rim_is_bent_between_bolts():
    """A stiff bush leaves the stress of the clamped rim; on bolts the bending of the rim relieves this root."""
    options = {"density": ROOT, "resolution": COARSE, "progress": False}
    stresses = [
        fem.root_stress(thin_ring_pair(support), [50], [0.0], ring_angle=angle, **options)["root_stress"].values[
            1, 0, 0
        ]
        for support, angle in (((), 0.0), (fem.Bush(radial=1e13, tangential=1e13), 0.0), (bolted(), 0.35))
    ]
    assert stresses[1] == pytest.approx(stresses[0], rel=0.02)
    assert stresses[2] < 0.8 * stresses[0]


@pytest.mark.slow
def test_flanks_of_a_ring_on_bolts_touch_in_the_fields():
    """Displacements of the section, on its springs, and te of the contact, by the condensed rim: within 6 % of te."""
    pair = thin_ring_pair(bolted())
    options = {"resolution": COARSE, "ring_angle": 0.35}
    ste = fem.static_transmission_error(pair, 50, [0.0], resolution=COARSE, ring_angles=[0.35], progress=False)
    pinion, wheel = fem.stress.plane_fields(pair, 50, 0.0, refine=4, **options)
    turn = [field.turn * gear.r_b for field, gear in zip((pinion, wheel), (pair.pinion, pair.wheel), strict=True)]
    assert abs(turn[0]) + abs(turn[1]) == pytest.approx(ste["te"].item(), rel=1e-6)
    loaded = [field.points[:, field.pressure > 0.9 * field.pressure.max()] for field in (pinion, wheel)]
    moved = [field.displacement[:, field.pressure > 0.9 * field.pressure.max()] for field in (pinion, wheel)]
    assert loaded[0].mean(axis=1) == pytest.approx(loaded[1].mean(axis=1), abs=2e-4)
    normal = np.array([np.sin(pair.alpha_wt), np.cos(pair.alpha_wt)])
    closing = normal @ (moved[1].mean(axis=1) - moved[0].mean(axis=1))
    assert abs(closing) == pytest.approx(ste["te"].item(), rel=0.06)
