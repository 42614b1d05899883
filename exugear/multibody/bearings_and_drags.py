"""Bearings and drags of a shaft in Exudyn.

Linear bearings are stiffness and damping matrices; nonlinear bearings and drags are user functions whose compiled
kernels read records.
"""

from collections.abc import Collection, Mapping, Sequence
from functools import cache
from typing import Any

import exudyn.itemInterface as eii
import numpy as np
from numba import carray

from exugear.gearbox.bearing import Bearing, radial_points
from exugear.gearbox.bearing_law import (
    has_radial_law,
    has_rolling_law,
    linear_part,
    radial_motion,
    radial_potential,
    radial_reaction,
    tangent_stiffness,
)
from exugear.gearbox.drag import DragTerms, braking_slope, braking_torque
from exugear.gearbox.seats_on_shafts import DragBetween
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.kernel_records import doubles_at, record_of, record_type, start_of
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.direct_call import direct
from exugear.multibody.rolling_bearings import add_rolling_bearing, law_at
from exugear.multibody.user_function_errors import FAR, Diverged, OutOfRange, errors_kept
from exugear.planning.coordinates import Coordinates
from exugear.rolling_bearings.law import LawRecord, reaction
from fem.support.numba_cache import compiled, kept
from fem.support.validation import require

#: Head of a radial law: number of points, axial distance from the centre of mass [m], damping over stiffness [s];
#: behind it lie the points (3, n), as `radial_points`.
RADIAL_LAW = record_type(("points", "i8"), ("lever", "f8"), ("damping", "f8"))
RADIAL_LAW_SIZE = RADIAL_LAW.itemsize
radial_law_at = reader(RADIAL_LAW)
#: A drag: its terms; radial stiffness (2, 5) of its bearing over the motion of the centre of mass [N/m, N/rad], without
#: that of a nonlinear bearing; whether it needs the load of that bearing; addresses of the radial law and of the law of
#: a rolling bearing, else 0.
DRAG = record_type(
    *((name, "f8") for name in DragTerms._fields),
    *(("stiffness", "f8", (2, 5)), ("loaded", "i8"), ("law", "i8"), ("rolling_law", "i8")),
)
#: Head of the drags of a shaft: their number; behind it they lie one after the other.
DRAGS = record_type(("number", "i8"))
DRAG_SIZE, DRAGS_SIZE = DRAG.itemsize, DRAGS.itemsize
drag_at, drags_at = reader(DRAG), reader(DRAGS)


def add_bearings(
    mbs, node: int, shaft: Shaft, coordinates: Coordinates, on_moving_seats: Collection[float] = ()
) -> None:
    """Add the bearings of a shaft, with the external forces and the weight that they carry, to the node of its body.

    on_moving_seats   axial positions [m] of bearings that are left out (`exugear.multibody.moving_seats`)
    """
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    standing = {axial: bearing for axial, bearing in shaft.bearings.items() if axial not in on_moving_seats}
    for axial, bearing in standing.items():
        k = linear_part(bearing, axial - shaft.centre)
        stiffness, damping = stiffness + k, damping + bearing.damping_time * k
    part = np.ix_(coordinates.components, coordinates.components)
    matrices: dict[str, Any] = {"stiffnessMatrix": stiffness[part], "dampingMatrix": damping[part]}
    load = shaft.constant_load[coordinates.components]
    items = [eii.ObjectGenericODE2(nodeNumbers=[node], forceVector=load, **matrices)]
    for axial, bearing in standing.items():
        if has_rolling_law(bearing):
            items.append(add_rolling_bearing(mbs, node, bearing, axial - shaft.centre))
        elif has_radial_law(bearing):
            force, jacobian, law = bearing_functions(bearing, axial - shaft.centre)
            force = direct(errors_kept(mbs, force), bearing_kernel, (law,), 6)
            item = eii.ObjectGenericODE2(nodeNumbers=[node], forceUserFunction=force, jacobianUserFunction=jacobian)
            items.append(item)
    for item in items:
        item.visualization["show"] = False
        mbs.AddObject(item)


def bearing_functions(bearing: Bearing, lever: float):
    """Force and Jacobian of a nonlinear bearing for Exudyn, and the record that its kernel takes.

    lever   axial distance of the bearing from the shaft's centre of mass [m]

    The Jacobian leaves out the change of the damping with the displacement.
    """
    law = radial_record(bearing, lever)
    address = address_of(law)

    def bearing_force(mbs, t, item, q, q_t):
        try:
            return bearing_kernel(address, t, *q, *q_t)
        except ValueError as error:
            r, end = error.args
            beyond = f"displacement {r:.4g} m of a bearing lies beyond its table, which ends at {end:.4g} m"
            raise (OutOfRange(f"{beyond}; extend it") if r < FAR else Diverged(beyond)) from None

    def bearing_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        in_radial_plane = tangent_stiffness(bearing, lever, np.array(q)) - linear_part(bearing, lever)
        return (factor + factor_t * bearing.damping_time) * in_radial_plane

    return bearing_force, bearing_jacobian, law


def radial_record(bearing: Bearing, lever: float) -> np.record:
    """The record of a nonlinear bearing that kernels read: `RADIAL_LAW`, behind it the points."""
    points = radial_points(bearing)
    head = record_of(RADIAL_LAW, points=points.shape[1], lever=lever, damping=bearing.damping_time)
    return record_of(record_type(("head", RADIAL_LAW), ("points", "f8", points.shape)), head=head, points=points)


@compiled
def points_of(law):
    """The points (3, n) behind the head of a radial law."""
    return carray(doubles_at(start_of(law) + RADIAL_LAW_SIZE), (3, law.points))


@kept
def bearing_kernel(record, t, *x):
    """Generalized forces (6) of a nonlinear bearing on a shaft, first order in the tilts.

    record   address of a `RADIAL_LAW`
    x        coordinates of the shaft's centre of mass (x, y, z, tilts, spin) and their rates

    Raises ValueError(r, end) where the radial displacement r lies beyond the end of the law.
    """
    law = radial_law_at(record)
    points, lever = points_of(law), law.lever
    at_x, at_y = radial_motion(lever, x[0], x[1], x[3], x[4])
    r, end = np.hypot(at_x, at_y), points[0, law.points - 1]
    if not r <= end:
        raise ValueError(r, end)
    p, q = radial_reaction(points, law.damping, at_x, at_y, *radial_motion(lever, x[6], x[7], x[9], x[10]))
    return p, q, 0.0, -lever * q, lever * p, 0.0


def drag_name(shaft: Shaft) -> str:
    """Name of the object with the drags of a shaft."""
    return f"{shaft.name} drag"


def add_drags(mbs, node: int, shaft: Shaft, coordinates: Coordinates) -> None:
    """Add the drags of a shaft, if it has any, to the node of its body."""
    if not shaft.drags:
        return
    unknown = [axial for axial, drag in shaft.drags if drag.needs_load and not coordinates.on_bearings]
    joint = f"load of the BearingDrag at {unknown} m of shaft {shaft.name!r} is not known on ideal joints"
    require(not unknown, f"{joint}; pass load=... [N]")
    function, jacobian = drag_functions(shaft, len(coordinates.components))
    item = eii.ObjectGenericODE2(
        name=drag_name(shaft), nodeNumbers=[node], forceUserFunction=function, jacobianUserFunction=jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)


def names_of_drags_between(drags: Sequence[DragBetween]) -> list[str]:
    """Names of the objects with the drags between shafts, in their order."""
    return [f"{drag.carried} drag {number} on {drag.carrying}" for number, drag in enumerate(drags, start=1)]


def add_drag_between(mbs, nodes: tuple[int, int], drag: DragBetween, name: str) -> None:
    """Add the drag between two shafts to the nodes of their bodies, carried and carrying."""
    n, m = (len(mbs.GetNode(node)["referenceCoordinates"]) for node in nodes)
    entries = np.zeros(1, DRAG)
    for term, value in drag.drag.terms._asdict().items():
        entries[0][term] = value
    kind = record_type(("head", DRAGS), ("drags", DRAG, 1))
    record = record_of(kind, head=record_of(DRAGS, number=1), drags=entries)
    kernel, address, spins = drag_between_kernel(n, m), address_of(record), [n - 1, n + m - 1]

    def drag_forces(mbs, t, item, q, q_t):
        return kernel(address, t, *q, *q_t)

    def drag_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        slope = factor_t * float(braking_slope(drag.drag.terms, q_t[spins[0]] - q_t[spins[1]], 0.0))
        jacobian = np.zeros((n + m, n + m))
        jacobian[np.ix_(spins, spins)] = slope * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return jacobian

    item = eii.ObjectGenericODE2(
        name=name,
        nodeNumbers=list(nodes),
        forceUserFunction=direct(drag_forces, kernel, (record,), n + m),
        jacobianUserFunction=drag_jacobian,
    )
    item.visualization["show"] = False
    mbs.AddObject(item)


@cache
def drag_between_kernel(n: int, m: int):
    """The function (record, t, *coordinates, *velocities) -> forces (n + m) of a drag between two shafts.

    record is the address of `DRAGS` with a single one. The last coordinate of each shaft is its spin; that which
    is carried has n coordinates, that which carries the seat or the pin m: 6, 3 in the plane or only the spin.
    """

    @kept
    def drag_between(record, t, *x):
        torque = braking_torque(drag_at(record + DRAGS_SIZE), x[2 * n + m - 1] - x[-1], 0.0)
        carried = (-torque,) if n == 1 else (0.0, 0.0, -torque) if n == 3 else (0.0, 0.0, 0.0, 0.0, 0.0, -torque)
        if m == 1:
            return (*carried, torque)
        return (*carried, 0.0, 0.0, torque) if m == 3 else (*carried, 0.0, 0.0, 0.0, 0.0, 0.0, torque)

    return drag_between


def drag_functions(shaft: Shaft, n: int):
    """Force and Jacobian of the drags of a shaft with n coordinates for Exudyn.

    The Jacobian is the slope over the speed: the change of a load with the displacement, by friction, is negligible.
    """
    bearings = shaft.bearings.items()
    laws: dict[float, np.record | LawRecord] = {}
    laws |= {axial: x.record_of_runs(axial - shaft.centre) for axial, x in bearings if has_rolling_law(x)}
    laws |= {axial: radial_record(x, axial - shaft.centre) for axial, x in bearings if has_radial_law(x)}
    record, kernel = drag_record(shaft, laws), drag_kernel(n)
    address = address_of(record)

    def drag_forces(mbs, t, item, q, q_t):
        return kernel(address, t, *q, *q_t)

    def drag_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        jacobian = np.zeros((n, n))
        jacobian[-1, -1] = factor_t * drag_slope(address, *q, *q_t)
        return jacobian

    return direct(drag_forces, kernel, (record,), n, pointed_to=laws), drag_jacobian


def drag_record(shaft: Shaft, laws: Mapping[float, np.record | LawRecord]) -> np.record:
    """The record of the drags of a shaft that the kernels read; laws: of the nonlinear bearings, by axial position."""
    entries = np.zeros(len(shaft.drags), DRAG)
    for entry, (axial, drag) in zip(entries, shaft.drags, strict=True):
        for name, value in drag.terms._asdict().items():
            entry[name] = value
        if drag.needs_load:
            entry["loaded"] = 1
            entry["stiffness"] = linear_part(shaft.bearings[axial], axial - shaft.centre)[:2, :5]
            law = laws.get(axial)
            entry["rolling_law"] = address_of(law.record) if isinstance(law, LawRecord) else 0
            entry["law"] = address_of(law) if isinstance(law, np.record) else 0
    kind = record_type(("head", DRAGS), ("drags", DRAG, len(entries)))
    return record_of(kind, head=record_of(DRAGS, number=len(entries)), drags=entries)


@compiled
def bearing_load(drag, displacement, spin):
    """Radial force [N] of the bearing of a drag at displacements and tilts (5) of the centre of mass and spin [rad]."""
    if drag.loaded == 0:
        return 0.0
    if drag.rolling_law != 0:
        forces = reaction(law_at(drag.rolling_law), displacement, (0.0, 0.0, 0.0, 0.0, 0.0), spin)
        return np.hypot(forces[0], forces[1])
    p, q, k = 0.0, 0.0, drag.stiffness
    for i in range(5):
        p, q = p + k[0, i] * displacement[i], q + k[1, i] * displacement[i]
    if drag.law != 0:
        law, (x, y, _, a, b) = radial_law_at(drag.law), displacement
        _, gradient, _ = radial_potential(points_of(law), *radial_motion(law.lever, x, y, a, b))
        p, q = p + gradient[0], q + gradient[1]
    return np.hypot(p, q)


@compiled
def displacement_of(x):
    """Displacements and tilts (5) of a shaft, of its coordinates and velocities x (2 n)."""
    if len(x) == 2:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    return (x[0], x[1], 0.0, 0.0, 0.0) if len(x) == 6 else (x[0], x[1], x[2], x[3], x[4])


@compiled
def torque_and_slope(record, x):
    """Torque [N m] of all drags of a shaft against its rotation, and its derivative by the speed [N m s/rad].

    record, x   address of `DRAGS`; coordinates and velocities (2 n) of the shaft
    """
    drags, displacement, torque, slope = drags_at(record), displacement_of(x), 0.0, 0.0
    for i in range(drags.number):
        drag = drag_at(record + DRAGS_SIZE + DRAG_SIZE * i)
        load = bearing_load(drag, displacement, x[len(x) // 2 - 1])
        torque, slope = torque + braking_torque(drag, x[-1], load), slope + braking_slope(drag, x[-1], load)
    return torque, slope


@kept
def drag_slope(record, *x):
    """Derivative of the torque of all drags of a shaft by its speed [N m s/rad]; arguments of `torque_and_slope`."""
    return torque_and_slope(record, x)[1]


@cache
def drag_kernel(n: int):
    """The function (record, t, *coordinates, *velocities) -> forces (n) of the drags on a shaft with n coordinates.

    record is the address of `DRAGS`. The last coordinate is the spin.
    """

    @kept
    def shaft_drag(record, t, *x):
        torque = -torque_and_slope(record, x)[0]
        if n == 1:
            return (torque,)
        return (0.0, 0.0, torque) if n == 3 else (0.0, 0.0, 0.0, 0.0, 0.0, torque)

    return shaft_drag
