"""A ring on supports, of one pitch, against finite elements of the whole ring with its supports as springs."""

from functools import partial
from math import pi

import numpy as np
import pytest
import scipy.sparse as sp
from ring_gears import COARSE, bolted, ring, thin_ring_pair
from scipy.sparse.linalg import splu
from skfem import Basis, ElementQuad2
from whole_section import uniform_prism

import fem
from fem import Density
from fem.elasticity import section_mesh
from fem.elasticity.flank_compliance import flank_compliance, flank_forces
from fem.elasticity.pitch_condensation import Prism, flank_displacements
from fem.elasticity.rim_bending import rim_bending
from fem.elasticity.rim_harmonics import rim_harmonics
from fem.elasticity.rim_springs import rim_springs
from fem.units import mm

TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=2, teeth=2, behind=0)
TEETH = 0, 1, 2


def into_flanks(gear: fem.Gear, section: Basis, arcs: np.ndarray, tooth: int) -> np.ndarray:
    """(2, n_dofs, n_hat) unit line loads into a flank."""
    return flank_forces(section, gear, arcs, tooth)[0, :2]


def compliance_of_whole_ring(gear: fem.Gear, arcs: np.ndarray) -> np.ndarray:
    """(n_tooth, n_hat, n_tooth, n_hat) in plane strain, all pitches meshed, per line load [m^2/N]."""
    section = Basis(section_mesh.section(gear, TINY.with_teeth(abs(gear.z), 0)), ElementQuad2())
    free = Prism(gear, None, np.ones((1, 1)), uniform_prism(gear).face, clamped=False)
    springs = rim_springs(gear, section, gear.support) / np.sqrt(gear.b)
    matrix = free.stiffness(section)[0].matrix + springs.T @ springs
    forces = np.hstack([into_flanks(gear, section, arcs, tooth).reshape(-1, arcs.size) for tooth in TEETH])
    u = splu(sp.csc_matrix(matrix)).solve(forces)
    return (forces.T @ u).reshape(len(TEETH), arcs.size, len(TEETH), arcs.size)


def compliance_of_one_pitch(gear: fem.Gear, arcs: np.ndarray) -> np.ndarray:
    """The same: clamped ring, and bending of the rim."""
    prism, forces = uniform_prism(gear), partial(flank_forces, gear=gear, arcs=arcs)
    held = flank_displacements(prism, TINY.with_teeth(abs(gear.z), 0), forces)
    ring = rim_harmonics(Prism(gear, None, np.ones((1, 1)), prism.face, clamped=False), TINY, forces)
    flank = ring["flank"].reshape(-1, 2, 2, 1, arcs.size)
    of_width = {"stiffness": ring["stiffness"] * gear.b}
    rim = rim_bending(of_width, flank, gear.support, abs(gear.r_clamp), 1.0, abs(gear.z))
    modes = rim.modes(0.0, range(len(TEETH))).normal[:, :, 0]
    total = gear.b * np.einsum("mth,msk->thsk", modes, modes)
    for i, j in np.ndindex(len(TEETH), len(TEETH)):
        total[i, :, j] += held[i - j] if i >= j else held[j - i].T
    return total


@pytest.mark.parametrize("first", [0.0, 0.5], ids=["at a bolt", "between bolts"])
def test_one_pitch_stands_for_the_ring_on_bolts(first):
    """Bolts of a pitch's width, radial and tangential springs unlike: within 0.1 % of the largest displacement."""
    support = bolted(number=6, first=first * 2 * pi / 6, tangential=2e8, width=6.5 * mm)
    gear = thin_ring_pair(support).wheel
    arcs = section_mesh.flank_hats(gear, TINY)
    expected = compliance_of_whole_ring(gear, arcs)
    assert np.abs(compliance_of_one_pitch(gear, arcs) - expected).max() < 1e-3 * np.abs(expected).max()


def test_one_pitch_stands_for_the_ring_in_a_bush():
    gear = thin_ring_pair(fem.Bush(radial=2e10, tangential=1e9)).wheel
    arcs = section_mesh.flank_hats(gear, TINY)
    expected = compliance_of_whole_ring(gear, arcs)
    assert np.abs(compliance_of_one_pitch(gear, arcs) - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("beta", [0.0, 0.15])
def test_a_stiff_bush_clamps_the_rim(beta):
    """But for warping and contraction along the axis, which the clamp of the default prevents."""
    options = {"beta": beta, "rim": 6.0}
    clamped, bushed = (
        ring(-53, -0.1, support=support, **options) for support in ((), fem.Bush(radial=1e16, tangential=1e16))
    )
    density = COARSE.density.with_teeth(2, 1)
    held, on_bush = (flank_compliance(gear, density, gear.b) for gear in (clamped, bushed))
    modes = on_bush.rim.modes(0.3, range(2)).normal
    assert np.abs(np.einsum("mtyh,msxk->tyhsxk", modes, modes)).max() < 1e-4 * held.blocks.max()
    more = (on_bush.blocks[0] - held.blocks[0]).reshape(held.axial.size * held.arcs.size, -1)
    assert np.abs(more).max() < 0.05 * held.blocks[0].max()
    assert np.linalg.eigvalsh((more + more.T) / 2).min() > -1e-6 * held.blocks.max()
