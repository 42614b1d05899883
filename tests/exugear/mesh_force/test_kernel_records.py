"""Records: the same numbers by the same names in Python and in compiled kernels."""

import numpy as np
import pytest
from numba import njit

from exugear import MeshForce, Recorder
from exugear.mesh_force.kernel_records import (
    array_behind,
    behind,
    changed,
    packed,
    record_of,
    record_type,
    start_of,
    within,
)
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.recorder import sample_of

GEAR = record_type(("r_b", "f8"), ("axes", "f8", (3, 3)))
PAIR = record_type(("teeth", "i8"), ("pinion", GEAR), ("wheel", GEAR))
pair_at, pair_within, gear_behind = reader(PAIR), within(PAIR), behind(GEAR)
PAIR_SIZE = PAIR.itemsize


@njit
def seen(address):
    """What a kernel reads at an address, and the address of what it reads."""
    pair = pair_at(address)
    return pair.teeth, pair.pinion.r_b, pair.wheel.axes[1, 2], start_of(pair)


def test_a_kernel_reads_what_python_wrote():
    wheel = record_of(GEAR, r_b=0.2, axes=np.arange(9).reshape(3, 3))
    pair = record_of(PAIR, teeth=23, pinion=record_of(GEAR, r_b=0.1), wheel=wheel)
    assert seen(address_of(pair)) == (23, 0.1, 5.0, address_of(pair))
    assert (pair.teeth, pair.pinion.r_b, pair.wheel.axes[1, 2]) == (23, 0.1, 5.0)


@njit
def of_packed(values, start):
    """What a kernel reads of a record in an array, and of the floats behind its head."""
    pair = pair_within(values, start)
    return pair.teeth, pair.wheel.r_b, array_behind(pair, PAIR_SIZE, 2)[1], gear_behind(pair, PAIR_SIZE + 16).r_b


def test_packed_records_are_found_by_their_starts():
    """Records of different lengths, one behind another; the copies change without the originals."""
    kind = record_type(("head", PAIR), ("values", "f8", (2,)), ("idler", GEAR))
    heads = [record_of(PAIR, teeth=z, wheel=record_of(GEAR, r_b=z / 100)) for z in (23, 47)]
    pairs = [record_of(kind, head=x, values=[1.0, x.teeth], idler=record_of(GEAR, r_b=x.teeth)) for x in heads]
    values, starts = packed([heads[0], *pairs])
    assert [of_packed(values, start) for start in starts[1:]] == [(23, 0.23, 23.0, 23.0), (47, 0.47, 47.0, 47.0)]
    values[:] = 0.0
    assert pairs[0].head.teeth == 23


def test_records_are_constant_and_copies_change():
    pair = record_of(PAIR, teeth=23)
    with pytest.raises(ValueError, match="read-only"):
        pair.teeth = 24
    with pytest.raises(ValueError, match="read-only"):
        pair.pinion.axes[0, 0] = 1.0
    assert (changed(pair, teeth=24).teeth, pair.teeth) == (24, 23)


def test_the_table_of_a_law_has_names():
    """Potential over penetration^2 at the nodes, force at the end of the table."""
    law = MeshForce([0.0, 0.5], [0.0, 1e-5, 2e-5], [[0.0, 1e3, 2e3]] * 2, backlash=1e-4)
    assert law.table.potentials["value"] == pytest.approx(0.5e8)
    assert law.table.edges["largest"] == pytest.approx(2e-5)
    assert law.table.head.last_force == pytest.approx(2e3)
    assert law.table.head.backlash == law.backlash


def test_samples_of_ten_million_steps_are_found():
    """The time is a sum of steps, as in Exudyn."""
    recorder, step, number = Recorder(), 2.8865556813498194e-05, 10**7
    recorder.start(step, 10, steps=1)
    recorder.header.number = number + 1
    times = np.cumsum(np.full(number, step))
    numbers = [sample_of(address_of(recorder.header), time) for time in times[-2000:]]
    assert numbers == list(range(number - 1999, number + 1))
