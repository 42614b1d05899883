"""A torque on a shaft in Exudyn: an ObjectGenericODE2 on the node of its body, with the torque by a compiled kernel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from exugear.mesh_force.kernel_records import address_of
from exugear.multibody.native import direct_or_portable
from exugear.operation.shaft_recorder import ShaftRecorder
from exugear.operation.torque_kernels import torque_kernel, torque_record, torque_slopes
from exugear.operation.torque_tables import TorqueTable


@dataclass(frozen=True, eq=False)
class ShaftTorque:
    """The torque on a shaft in a system.

    name       of the object
    record     which the kernel reads (`exugear.operation.torque_kernels.SHAFT_TORQUE`)
    recorder   samples of the torque and of the motion of the body
    """

    name: str
    record: np.record
    recorder: ShaftRecorder


def add_torque(
    mbs, name: str, node, table: TorqueTable, *, direction: int, sense: int, states: Sequence[np.record], factors
) -> ShaftTorque:
    """Add a torque on the last coordinate of a node, which is its spin; called without Python where that works.

    name              of the object
    direction         of rotation of the shaft about z at positive speed
    sense             +1: acts with that motion, -1: against it
    states, factors   of the contacts: their states, and the mesh force per torque about z [1/m]
    """
    record, arrays = torque_record(table, direction, sense, states, factors)
    recorder, n = ShaftRecorder(), len(mbs.GetNode(node)["referenceCoordinates"])
    kernel, addresses = torque_kernel(n), (address_of(record), address_of(recorder.header))

    def shaft_torque(mbs, t, item, q, q_t):
        return kernel(*addresses, t, *q, *q_t)

    def torque_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        return _jacobian(record, t, q, q_t, (factor, factor_t))

    vars(shaft_torque)["owned"] = record, arrays, states, recorder
    function = direct_or_portable(shaft_torque, kernel, addresses, n)
    item: Any = eii.ObjectGenericODE2(
        name=name, nodeNumbers=[node], forceUserFunction=function, jacobianUserFunction=torque_jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)
    return ShaftTorque(name, record, recorder)


def _jacobian(record: np.record, t: float, q, q_t, factors: tuple[float, float]) -> np.ndarray:
    """(n, n) matrix -factor dT/dangle - factor_t dT/dspeed."""
    jacobian = np.zeros((len(q), len(q)))
    jacobian[-1, -1] = -np.dot(factors, torque_slopes(address_of(record), t, q[-1], q_t[-1]))
    return jacobian
