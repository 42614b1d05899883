"""Unbalance of a shaft in Exudyn: a force that turns with the shaft, evaluated by a compiled kernel.

The full equations couple displacement and spin by the mass matrix, moment * (-sin, cos). Here the speed counts as
constant in a turn: the force is moment * speed^2, and the spin is braked by moment * speed times the velocity along the
force. Both together do no work, like a gyroscopic term; what is left out is the derivative of a bounded quantity.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import exudyn.itemInterface as eii
import numpy as np
from numba import carray

from exugear.gearbox.shaft_loads import Unbalance
from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import address_of, as_tuple, put_all, reader
from exugear.multibody.direct_call import direct
from fem.support.numba_cache import kept

#: Index of the spin, moment [kg m], angle [rad]; addresses of the rows (2, n) that measure the displacement at the
#: unbalance, and of room for coordinates and velocities (2 n) and for forces (n).
UNBALANCE = record_type(
    *(("spin", "i8"), ("moment", "f8"), ("angle", "f8")), *((name, "i8") for name in ("rows", "state", "forces"))
)
unbalance_at = reader(UNBALANCE)


def add_unbalance(mbs, nodes: Sequence[Any], rows: np.ndarray, spin: int, unbalance: Unbalance) -> None:
    """Add an unbalance, whose displacement rows (2, n) measure over the coordinates of nodes; spin: index of theirs."""
    n = rows.shape[1]
    arrays = np.ascontiguousarray(rows), np.zeros(2 * n), np.zeros(n)
    record = np.zeros(1, UNBALANCE)[0]
    record.spin, record.moment, record.angle = spin, unbalance.moment, unbalance.angle
    record.rows, record.state, record.forces = (array.ctypes.data for array in arrays)
    kernel, address, no_stiffness = unbalance_kernel(n), address_of(record), np.zeros((n, n))

    def unbalance_force(mbs, t, item, q, q_t):
        return kernel(address, t, *q, *q_t)

    def unbalance_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        return no_stiffness

    function = direct(unbalance_force, kernel, (record,), n, pointed_to=arrays)
    item: Any = eii.ObjectGenericODE2(
        nodeNumbers=list(nodes), forceUserFunction=function, jacobianUserFunction=unbalance_jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)


@cache
def unbalance_kernel(n: int):
    """The function (record, t, *coordinates, *velocities) -> forces (n) of an unbalance on a shaft.

    record is the address of an `UNBALANCE`.
    """

    @kept
    def shaft_unbalance(record, t, *x):
        unbalance = unbalance_at(record)
        put_all(unbalance.state, x)
        state, rows = carray(doubles_at(unbalance.state), 2 * n), carray(doubles_at(unbalance.rows), (2, n))
        forces, spin = carray(doubles_at(unbalance.forces), n), unbalance.spin
        angle, speed = state[spin] + unbalance.angle, state[n + spin]
        cos, sin, rate = np.cos(angle), np.sin(angle), 0.0
        for j in range(n):
            along = cos * rows[0, j] + sin * rows[1, j]
            rate += along * state[n + j]
            forces[j] = unbalance.moment * speed**2 * along
        forces[spin] -= unbalance.moment * speed * rate
        return as_tuple(forces, n)

    return shaft_unbalance
