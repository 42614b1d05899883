"""Stresses of pinions in rings: balance of the loads on both gears, root stress in plane and in space."""

import numpy as np
import pytest
from ring_gears import COARSE, helical_ring_pair, ring_pair

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
