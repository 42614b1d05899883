"""What Exudyn's user function calls: one compiled function for each two kinds of bodies."""

from functools import cache

from numba import carray

from exugear.kernels.attitude import EULER, IN_PLANE, RXYZ, SPIN_ALONE, VECTOR
from exugear.kernels.contact_frame import bodies_seen, given_back
from exugear.kernels.kinematics import FRAME, rotational_mesh, spatial_mesh
from exugear.kernels.recorder import at, sample_of, write, write_motion
from exugear.mesh_force.force_kernels import HEADER, SIZE
from fem.support.numba_cache import compiled, kept

SPIN, PLANAR, SPATIAL = "spin", "planar", "spatial"
PARAMETERS, ROTATION_VECTOR = "Euler parameters", "rotation vector"


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
SIZES = {SPIN: 1, PLANAR: 3, SPATIAL: 6, PARAMETERS: 7, ROTATION_VECTOR: 6}
CODES = {SPIN: SPIN_ALONE, PLANAR: IN_PLANE, SPATIAL: RXYZ, PARAMETERS: EULER, ROTATION_VECTOR: VECTOR}


@cache
def kernel_of(kinds: tuple[str, ...], displaced: bool = False, turned: bool = False):
    """The function (law, frame, record, t, *coordinates, *velocities) -> generalized forces of two bodies.

    Addresses of law, frame and record; a third body that only spins carries two that only spin. Displaced bodies that
    only spin need their places; turned ones have a contact frame of their own.
    """
    if turned:
        return _turned(*(CODES[kind] for kind in kinds), *(SIZES[kind] for kind in kinds))
    if kinds == (SPIN, SPIN) and not displaced:
        return rotational
    return carried if kinds == (SPIN, SPIN, SPIN) else _general(*(SIZES[kind] for kind in kinds))


@kept
def rotational(law, frame, record, t, q_1, q_2, v_1, v_2):
    """Torques on two bodies that spin about resting axes."""
    deflection, force, forces = rotational_mesh(table(law), carray(at(frame), FRAME), q_1, q_2, v_1, v_2)
    k = sample_of(record, t)
    if k >= 0:
        write(record, k, deflection, force, (0.0, 0.0, 0.0), 0.0)
    return forces


@kept
def carried(law, frame, record, t, q_1, q_2, q_3, v_1, v_2, v_3):
    """Torques on two such bodies and on a third one that carries them."""
    one, other = rotational(law, frame, record, t, q_1 - q_3, q_2 - q_3, v_1 - v_3, v_2 - v_3)
    return one, other, -one - other


def _general(n_1: int, n_2: int):
    """Encloses numbers alone, by which the compiled function is found on disk; branches not taken are cut off."""

    @kept
    def general(law, frame, record, t, *x):
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


def _turned(kind_1: int, kind_2: int, n_1: int, n_2: int):
    """The same of bodies that stand in a contact frame of their own."""

    @kept
    def turned(law, frame, record, t, *x):
        numbers = carray(at(frame), FRAME)
        (q_1, q_2, v_1, v_2), standing_1, standing_2 = bodies_seen(numbers, kind_1, kind_2, n_1, n_2, x)
        deflection, force, row_1, row_2, offsets, centroid = spatial_mesh(table(law), numbers, q_1, q_2, v_1, v_2)
        k = sample_of(record, t)
        if k >= 0:
            write(record, k, deflection, force, offsets, centroid)
            write_motion(record, k, q_1, q_2, v_1, v_2)
        back_1 = given_back(numbers, kind_1, standing_1, row_1)
        back_2 = given_back(numbers, kind_2, standing_2, row_2)
        one = (back_1[5],) if n_1 == 1 else (back_1[0], back_1[1], back_1[5]) if n_1 == 3 else back_1[:n_1]
        other = (back_2[5],) if n_2 == 1 else (back_2[0], back_2[1], back_2[5]) if n_2 == 3 else back_2[:n_2]
        return one + other

    return turned


#: Coordinates of a body among displacements and tilts
TAKEN = {PLANAR: [0, 1, 5], SPATIAL: [0, 1, 2, 3, 4, 5]}
