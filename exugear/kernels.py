"""What Exudyn's user function calls: one compiled function for each two kinds of bodies."""

from functools import cache
from pathlib import Path
from zlib import crc32

from numba import carray

import exugear.kinematics
import exugear.law
import exugear.recorder
from exugear.kinematics import FRAME, rotational_mesh, spatial_mesh
from exugear.law import HEADER, SIZE, compiled, kept
from exugear.recorder import at, sample_of, write, write_motion

#: Kernels kept on disk for other sources are compiled anew.
MODULES = (exugear.law, exugear.kinematics, exugear.recorder)
STAMP = crc32(b"".join(Path(str(module.__file__)).read_bytes() for module in MODULES))
SPIN, PLANAR, SPATIAL = "spin", "planar", "spatial"


@compiled
def table(law):
    """The law's array, whose size stands in its header."""
    return carray(at(law), int(carray(at(law), HEADER)[SIZE]))


@compiled
def six_of(x, i, n):
    """Displacements (6) of the body whose n coordinates begin at i."""
    if n == 1:
        return 0.0, 0.0, 0.0, 0.0, 0.0, x[i]
    if n == 3:
        return x[i], x[i + 1], 0.0, 0.0, 0.0, x[i + 2]
    return x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5]


@compiled
def bodies_of(x, n_1, n_2):
    """Displacements (6) and velocities (6) of two bodies of n_1 and n_2 coordinates."""
    both = n_1 + n_2
    return six_of(x, 0, n_1), six_of(x, n_1, n_2), six_of(x, both, n_1), six_of(x, both + n_1, n_2)


#: Number of coordinates
SIZES = {SPIN: 1, PLANAR: 3, SPATIAL: 6}


@cache
def kernel_of(kinds: tuple[str, ...], displaced: bool = False):
    """The function (law, frame, record, t, *coordinates, *velocities) -> generalized forces of two bodies.

    Addresses of law, frame and record; a third body that only spins carries two that only spin. Displaced bodies that
    only spin need their places.
    """
    if kinds == (SPIN, SPIN) and not displaced:
        return _rotational(STAMP)
    return _carried(STAMP) if kinds == (SPIN, SPIN, SPIN) else _general(STAMP, *(SIZES[kind] for kind in kinds))


def _rotational(stamp: int):
    @kept
    def rotational(law, frame, record, t, q_1, q_2, v_1, v_2):
        _ = stamp
        deflection, force, forces = rotational_mesh(table(law), carray(at(frame), FRAME), q_1, q_2, v_1, v_2)
        k = sample_of(record, t)
        if k >= 0:
            write(record, k, deflection, force, (0.0, 0.0, 0.0), 0.0)
        return forces

    return rotational


def _carried(stamp: int):
    @kept
    def carried(law, frame, record, t, q_1, q_2, q_3, v_1, v_2, v_3):
        _ = stamp
        relative = q_1 - q_3, q_2 - q_3, v_1 - v_3, v_2 - v_3
        deflection, force, (one, other) = rotational_mesh(table(law), carray(at(frame), FRAME), *relative)
        k = sample_of(record, t)
        if k >= 0:
            write(record, k, deflection, force, (0.0, 0.0, 0.0), 0.0)
        return one, other, -one - other

    return carried


def _general(stamp: int, n_1: int, n_2: int):
    """Encloses numbers alone, by which the compiled function is found on disk; branches not taken are cut off."""

    @kept
    def general(law, frame, record, t, *x):
        _ = stamp
        q_1, q_2, v_1, v_2 = bodies_of(x, n_1, n_2)
        mesh = spatial_mesh(table(law), carray(at(frame), FRAME), q_1, q_2, v_1, v_2)
        deflection, force, row_1, row_2, offsets, centroid = mesh
        k = sample_of(record, t)
        if k >= 0:
            write(record, k, deflection, force, offsets, centroid)
            write_motion(record, k, q_1, q_2, v_1, v_2)
        one = (row_1[5],) if n_1 == 1 else (row_1[0], row_1[1], row_1[5]) if n_1 == 3 else row_1
        other = (row_2[5],) if n_2 == 1 else (row_2[0], row_2[1], row_2[5]) if n_2 == 3 else row_2
        return one + other

    return general
