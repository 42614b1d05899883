"""Names of compiled kernels: those of different code differ, as processes that read the cache would mix them up."""

from itertools import product

import pytest
from spatial_meshes import SPUR, frame_in_space

from exugear.contact.rotation import CODES
from exugear.mesh_force.force import mesh_forces
from exugear.multibody.contact_kernels import kernel_of
from exugear.multibody.imposed_motion import coupling_kernel
from exugear.multibody.torque_kernels import torque_kernel

PARALLEL = frame_in_space(SPUR, [[0] * 6, [SPUR.a, *[0] * 5]])
ROTATED = frame_in_space(SPUR, [[0] * 6, [SPUR.a, *[0] * 5]], axes=[[0, 1, 0], [0, 0, 1], [1, 0, 0]])


def test_kernels_of_different_bodies_frames_and_friction_have_different_names():
    """Bodies on Rxyz nodes alone are computed otherwise in a rotated frame."""
    cases = product(product(CODES, repeat=2), (PARALLEL, ROTATED), (False, True))
    names = {kernel_of(kinds, frame, rubs=rubs).py_func.__qualname__ for kinds, frame, rubs in cases}
    assert len(names) == 2 * ((len(CODES) + 1) ** 2 - 2)


@pytest.mark.parametrize("kernel", [coupling_kernel, torque_kernel])
def test_kernels_of_shafts_with_different_numbers_of_coordinates_have_different_names(kernel):
    assert len({kernel(n).py_func.__qualname__ for n in (1, 3, 6)}) == 3


@pytest.mark.parametrize("kinds", [("planar", "spatial"), ("spatial", "spatial")])
def test_kernels_are_found_on_disk_by_numbers(kinds):
    """A closure over functions would get a new name in every session, and miss the cache."""
    enclosed = [cell.cell_contents for cell in kernel_of(kinds, PARALLEL, rubs=False).py_func.__closure__]
    assert all(isinstance(value, int) for value in enclosed)


def test_kernels_of_laws_with_and_without_offsets_have_names_of_their_own():
    """Kernels of equal names that other processes have compiled are mixed up."""
    names = {mesh_forces(has_offsets).py_func.__qualname__ for has_offsets in (False, True)}
    assert len(names) == 2
