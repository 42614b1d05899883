"""Drag of shafts in Exudyn: the torque of all drags of a shaft on its spin, by a compiled kernel."""

from functools import partial

import exudyn.itemInterface as eii
import numpy as np

from exugear.contact.difference_jacobian import jacobian
from exugear.gearbox.bearing_stiffness import linear_part
from exugear.gearbox.drag import DragTerms, braking_torque
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.kernel_records import address_of, reader, record_of, record_type, start_of
from exugear.multibody.bearing_elements import radial_force, radial_law, radial_law_at, reactions
from exugear.multibody.native import direct_or_portable
from exugear.planning.coordinates import Coordinates
from fem.support.numba_cache import compiled, kept
from fem.support.validation import require

#: A drag: its terms; radial stiffness (2, 6) of its bearing over the coordinates of the centre of mass [N/m, N/rad], or
#: the address of the radial law of a nonlinear bearing, 0 for a linear one. Behind a head, one drag after the other.
DRAG = record_type(*((name, "f8") for name in DragTerms._fields), ("stiffness", "f8", (2, 6)), ("law", "i8"))
HEAD = record_type(("number", "i8"))
DRAG_SIZE, HEAD_SIZE = DRAG.itemsize, HEAD.itemsize
drag_at, head_at = reader(DRAG), reader(HEAD)
compiled_torque = compiled(braking_torque)
#: Steps of the difference Jacobian in coordinates [m, rad] and velocities [m/s, rad/s].
DIFFERENCE_STEPS = 1e-9, 1e-3


@compiled
def bearing_load(drag, x, y, z, a, b):
    """Radial force [N] of the bearing of a drag at displacements [m] and tilts [rad] of the centre of mass."""
    if drag.law != 0:
        law = radial_law_at(drag.law)
        return radial_force(law, np.hypot(x + law.lever * b, y - law.lever * a))[0]
    k = drag.stiffness
    along_x = k[0, 0] * x + k[0, 1] * y + k[0, 2] * z + k[0, 3] * a + k[0, 4] * b
    along_y = k[1, 0] * x + k[1, 1] * y + k[1, 2] * z + k[1, 3] * a + k[1, 4] * b
    return np.hypot(along_x, along_y)


@compiled
def shaft_drag(address, omega, x, y, z, a, b):
    """Torque [N m] of all drags of a shaft on its spin."""
    head, torque = head_at(address), 0.0
    for i in range(head.number):
        drag = drag_at(start_of(head) + HEAD_SIZE + DRAG_SIZE * i)
        load = bearing_load(drag, x, y, z, a, b) if drag.arm > 0.0 else 0.0
        torque -= compiled_torque(drag, omega, load)
    return torque


@kept
def spin_drag(address, t, spin, omega):
    """Generalized force (1) on a shaft that only spins."""
    return (shaft_drag(address, omega, 0.0, 0.0, 0.0, 0.0, 0.0),)


@kept
def planar_drag(address, t, x, y, spin, u, v, omega):
    """Generalized forces (3) on a shaft that moves in its plane."""
    return 0.0, 0.0, shaft_drag(address, omega, x, y, 0.0, 0.0, 0.0)


@kept
def spatial_drag(address, t, x, y, z, a, b, spin, u, v, w, d, e, omega):
    """Generalized forces (6) on a shaft that moves in space."""
    return 0.0, 0.0, 0.0, 0.0, 0.0, shaft_drag(address, omega, x, y, z, a, b)


KERNELS = {1: spin_drag, 3: planar_drag, 6: spatial_drag}


def drag_name(shaft: Shaft) -> str:
    """Name of the object with the drags of a shaft."""
    return f"{shaft.name} drag"


def add_drags(mbs, node: int, shaft: Shaft, coordinates: Coordinates) -> None:
    """Add the drags of a shaft, if it has any, to the node of its body."""
    if shaft.drags:
        check_loads(shaft, coordinates)
        function, jacobian = user_functions(shaft, len(coordinates.components))
        item = eii.ObjectGenericODE2(
            name=drag_name(shaft), nodeNumbers=[node], forceUserFunction=function, jacobianUserFunction=jacobian
        )
        item.visualization["show"] = False
        mbs.AddObject(item)


def check_loads(shaft: Shaft, coordinates: Coordinates) -> None:
    """ValueError for a drag by the force of a bearing that the shaft does not stand on."""
    unknown = [axial for axial, drag in shaft.drags if drag.needs_load and not coordinates.on_bearings]
    joint = f"load of the BearingDrag at {unknown} m of shaft {shaft.name!r} is not known on ideal joints"
    require(not unknown, f"{joint}; pass load=... [N]")


def drag_record(shaft: Shaft, laws: dict[float, np.record]) -> np.record:
    """The record of the drags of a shaft that the kernels read; laws: of the nonlinear bearings, by axial position."""
    entries = np.zeros(len(shaft.drags), DRAG)
    for entry, (axial, drag) in zip(entries, shaft.drags, strict=True):
        for name, value in drag.terms._asdict().items():
            entry[name] = value
        if axial in laws:
            entry["law"] = address_of(laws[axial])
        elif drag.needs_load:
            entry["stiffness"] = linear_part(shaft.bearings[axial], axial - shaft.centre)[:2]
    kind = record_type(("head", HEAD), ("drags", DRAG, len(entries)))
    return record_of(kind, head=record_of(HEAD, number=len(entries)), drags=entries)


def user_functions(shaft: Shaft, number: int):
    """Force and Jacobian of the drags of a shaft for Exudyn; the force keeps the records alive that it passes.

    number   of coordinates of the shaft
    """
    nonlinear = {axial: bearing for axial, bearing in shaft.bearings.items() if not bearing.linear}
    laws = {axial: radial_law(bearing, axial - shaft.centre) for axial, bearing in nonlinear.items()}
    record, kernel = drag_record(shaft, laws), KERNELS[number]
    address = address_of(record)

    def drag_forces(mbs, t, item, q, q_t):
        return kernel(address, t, *q, *q_t)

    def drag_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        return jacobian(partial(kernel, address, t), q, q_t, (factor, factor_t), DIFFERENCE_STEPS)

    vars(drag_forces)["owned"] = record, laws
    return direct_or_portable(drag_forces, kernel, (address,), number), drag_jacobian


def braking_torques(shaft: Shaft, omega: np.ndarray, motion: np.ndarray | None) -> np.ndarray:
    """(n,) torque of all drags of a shaft against its rotation [N m].

    omega    (n,) speed of the shaft [rad/s]
    motion   (n, 2 or 5) displacements [m] and tilts [rad] of its centre of mass; None where it only spins
    """
    loads: dict[float, np.ndarray] = {}
    if motion is not None:
        forces = np.zeros((len(shaft.bearings), 3, omega.size))
        reactions(shaft, motion, np.zeros_like(motion), forces)
        loads = {axial: np.hypot(x, y) for axial, (x, y, _) in zip(shaft.bearings, forces, strict=True)}
    torques = [braking_torque(drag.terms, omega, loads.get(axial, 0.0)) for axial, drag in shaft.drags]
    return np.sum(torques, axis=0) if torques else np.zeros_like(omega)
