"""Names of compiled kernels: those of different code differ, as processes that read the cache would mix them up."""

from itertools import product

import pytest

from exugear.contact.contact_kernels import CODES, SPATIAL, codes_of, kernel_of
from exugear.contact.friction_kernels import friction_of
from exugear.contact.rubbing_contact import rubbing_contact_of
from exugear.multibody.coupling_kernels import coupling_kernel
from exugear.operation.torque_kernels import torque_kernel


@pytest.mark.parametrize(
    "kernel",
    [
        lambda kinds, rotated: kernel_of(kinds, displaced=True, rotated=rotated),
        lambda kinds, rotated: rubbing_contact_of(kinds, displaced=True),
        friction_of,
    ],
)
def test_kernels_of_different_bodies_have_different_names(kernel):
    names = {kernel(kinds, False).py_func.__qualname__ for kinds in product(CODES, repeat=2)}
    assert len(names) == len(CODES) ** 2


def test_kernels_of_parallel_and_of_rotated_axes_have_different_names():
    kinds = (SPATIAL, SPATIAL)
    assert codes_of(kinds, True) != codes_of(kinds, False)
    for kernel in (lambda rotated: kernel_of(kinds, rotated=rotated), lambda rotated: friction_of(kinds, rotated)):
        assert kernel(True).py_func.__qualname__ != kernel(False).py_func.__qualname__


@pytest.mark.parametrize("kernel", [coupling_kernel, torque_kernel])
def test_kernels_of_shafts_with_different_numbers_of_coordinates_have_different_names(kernel):
    assert len({kernel(n).py_func.__qualname__ for n in (1, 3, 6)}) == 3


@pytest.mark.parametrize("kinds", [("planar", "spatial"), ("spatial", "spatial")])
def test_kernels_are_found_on_disk_by_numbers(kinds):
    """A closure over functions would get a new name in every session, and miss the cache."""
    enclosed = [cell.cell_contents for cell in kernel_of(kinds).py_func.__closure__]
    assert all(isinstance(value, int) for value in enclosed)
