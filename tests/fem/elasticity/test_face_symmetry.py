"""Symmetry about mid-plane: clamped displacements, positions and slices of half and whole face agree."""

import numpy as np
import pytest
from paper_gears import paper_gear

from fem.elasticity.face_symmetry import HalfFace, WholeFace, clamped
from fem.units import mm

GEAR = paper_gear()


@pytest.mark.parametrize(
    ("face", "in_mid_plane"),
    [(WholeFace(), ()), (HalfFace(), (2,)), (HalfFace(antisymmetric=True), (0, 1))],
)
def test_the_bore_is_clamped_and_mid_plane_where_the_loads_are_symmetric(face, in_mid_plane):
    r_bore = GEAR.d_bore / 2
    on_bore, in_plane, in_body = [r_bore, 0, 5 * mm], [0, 70 * mm, 0], [0, 70 * mm, 5 * mm]
    held = np.array([True, False, False])
    vanish = clamped(GEAR, held, np.transpose([on_bore, in_plane, in_body]), 3, face)
    assert vanish[:, 0].all()
    assert tuple(np.flatnonzero(vanish[:, 1])) == in_mid_plane
    assert not vanish[:, 2].any()


def test_slices_of_a_half_face_unfold_to_the_whole():
    low, high, force = np.array([0.0, 2.0]), np.array([2.0, 3.0]), np.array([[7.0], [5.0]])
    low, high, force = HalfFace().unfolded(low, high, force)
    assert low == pytest.approx([-3, -2, 0, 2])
    assert high == pytest.approx([-2, 0, 2, 3])
    assert force[:, 0] == pytest.approx([5, 7, 7, 5])
    assert force[:, 0] @ (low + high) == 0


def test_positions_of_a_half_are_the_upper_ones_of_the_whole():
    upper = np.array([0.0, 1.0, 3.0])
    assert WholeFace().positions(upper) == pytest.approx([-3, -1, 0, 1, 3])
    assert HalfFace().positions(upper) == pytest.approx(upper)
