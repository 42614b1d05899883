"""Elastic shafts in Exudyn: an object with constant matrices between the bodies of the gears and a further node.

Each gear has a rigid body, to which its contact is tied, in coordinates that do not turn. The object adds what these
bodies lack: the rest of the mass matrix, the stiffness of shaft and bearings, and gyroscopic moments, which are
proportional to the speed and which a compiled kernel evaluates. It records the elastic coordinates, too, from which the
motion of each bearing follows.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia, RotXYZ2RotationMatrix
from numba import carray
from numba.np.unsafe.ndarray import to_fixed_tuple

from exugear.contact.recorder import HEADER, SAME, header_at, sample_of
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import linear_part, radial_reaction, tangent_stiffness
from exugear.gearbox.disc import Disc
from exugear.gearbox.elastic_shaft import ElasticShaft
from exugear.mesh_force.kernel_records import address_of, doubles_at, floats_at, reader, record_type
from exugear.multibody.bearings_and_drags import points_of, radial_law_at, radial_record
from exugear.multibody.direct_call import direct
from exugear.multibody.exudyn_objects import node_of
from exugear.multibody.user_function_errors import FAR, Diverged, OutOfRange, errors_kept
from fem.support.numba_cache import kept

#: Number of elastic coordinates; addresses of the gyroscopic matrix (n, n), of the rows (elastic, n) that measure the
#: elastic coordinates, and of room for forces (n).
ELASTIC = record_type(*((name, "i8") for name in ("elastic", "polar", "rows", "forces")))
#: Address of a `RADIAL_LAW`, of the rows (2, n) that measure the radial displacement, and of room for forces (n).
BEARING = record_type(*((name, "i8") for name in ("law", "rows", "forces")))
elastic_at, bearing_at = reader(ELASTIC), reader(BEARING)
#: Index of the spin of a body in space.
SPIN = 5


@dataclass(frozen=True, eq=False)
class ElasticRecorder:
    """Elastic coordinates of a shaft and their rates at t = 0, interval, ..., as `exugear.Recorder` samples a contact.

    elastic   number of elastic coordinates
    """

    elastic: int
    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: dict[str, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    def start(self, interval: float, number: int, *, steps: int, first: int = 0) -> None:
        """Allocate a number of samples, 0 until written; arguments as those of `exugear.Recorder.start`."""
        self.samples.update({name: np.zeros((self.elastic, number), np.float32) for name in ("amplitudes", "rates")})
        self.header.interval, self.header.tolerance = interval, SAME / steps
        self.header.number, self.header.first = number, first
        self.header.samples[:2] = [array.ctypes.data for array in self.samples.values()]

    def motion(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """(number, elastic) first amplitudes and their rates."""
        amplitudes, rates = (self.samples[name][:, :number].T for name in ("amplitudes", "rates"))
        return amplitudes, rates


@dataclass(frozen=True, eq=False)
class BuiltShaft:
    """An elastic shaft in a built system.

    elastic    its coordinates and matrices
    bodies     axial position of each gear [m] -> object number of its body
    number     of the object with the matrices
    indices    (size,) of its coordinates among those of the system: of the bodies, then of the further node
    spins      axial position of each gear [m] -> index of the spin of its body
    recorder   samples of the elastic coordinates
    """

    elastic: ElasticShaft
    bodies: Mapping[float, int]
    number: int
    indices: np.ndarray
    spins: Mapping[float, int]
    recorder: ElasticRecorder

    @property
    def stiffness(self) -> np.ndarray:
        """(size, size) stiffness of the shaft and its bearings, nonlinear ones at their steepest slopes."""
        return self.elastic.stiffness_matrix + sum(
            rows.T @ bearing.stiffness @ rows for rows, bearing in at_bearings(self.elastic)
        )

    def following(self, axial: float) -> np.ndarray:
        """(size, 6) coordinates of the whole shaft that follow the body of a gear, nothing else pushing it."""
        first = 6 * self.elastic.shaft.stations.index(axial)
        moved = np.arange(first, first + 6)
        rest, stiffness = np.setdiff1d(np.arange(self.elastic.size), moved), self.stiffness
        follow = np.zeros((self.elastic.size, 6))
        follow[moved] = np.eye(6)
        follow[rest] = np.linalg.solve(stiffness[np.ix_(rest, rest)], -stiffness[np.ix_(rest, moved)])
        return follow


def at_bearings(elastic: ElasticShaft) -> list[tuple[np.ndarray, Bearing]]:
    """(6, size) rows that measure the motion at each bearing, and the bearing."""
    return [(elastic.at_bearing(axial), bearing) for axial, bearing in elastic.shaft.bearings.items()]


def add_elastic_shaft(mbs, pose: list[float], elastic: ElasticShaft) -> BuiltShaft:
    """Add an elastic shaft with its bearings; pose: reference coordinates (6) of its centre of mass [m, rad]."""
    shaft = elastic.shaft
    inertias = _inertias_of_bodies(elastic)
    bodies = {
        axial: _add_body(mbs, shaft.name if i == 0 else f"{shaft.name} gear {i + 1}", pose, inertia)
        for i, (axial, inertia) in enumerate(zip(shaft.stations, inertias, strict=True))
    }
    nodes = [node_of(mbs, body) for body in bodies.values()]
    if elastic.further:
        zeros = [0.0] * elastic.further
        initial = {f"initialCoordinates{end}": zeros for end in ("", "_t")}
        data = {"referenceCoordinates": zeros, "numberOfODE2Coordinates": elastic.further, **initial}
        nodes.append(mbs.AddNode(eii.NodeGenericODE2(name=f"{shaft.name} shapes", **data)))
    recorder = ElasticRecorder(elastic.elastic)
    number = _add_matrices(mbs, nodes, elastic, inertias, recorder)
    for axial, bearing in shaft.bearings.items():
        if not bearing.linear:
            _add_bearing(mbs, nodes, elastic.at_bearing(axial), bearing)
    return BuiltShaft(elastic, bodies, number, np.zeros(0, int), {}, recorder)


def located(mbs, built: BuiltShaft) -> BuiltShaft:
    """The shaft with the indices of its coordinates in the assembled system."""
    indices = np.array(mbs.systemData.GetObjectLTGODE2(built.number), int)
    spins = {axial: int(indices[6 * i + SPIN]) for i, axial in enumerate(built.bodies)}
    return BuiltShaft(built.elastic, built.bodies, built.number, indices, spins, built.recorder)


def _inertias_of_bodies(elastic: ElasticShaft) -> list[Disc]:
    """The inertia of each body: of the first gear that of the shaft, less what the bodies of the others have."""
    shaft, further = elastic.shaft, elastic.shaft.stations[1:]
    share = 0.5 / max(len(further), 1)
    of_others = [Disc(share * shaft.mass, share * shaft.body_inertia, share * shaft.transverse) for _ in further]
    left = 1.0 - share * len(further)
    return [Disc(left * shaft.mass, left * shaft.body_inertia, left * shaft.transverse), *of_others]


def _add_body(mbs, name: str, pose: list[float], inertia: Disc) -> int:
    """Add the body of a gear."""
    tensor = np.diag([inertia.transverse] * 2 + [inertia.inertia])
    return mbs.CreateRigidBody(
        name=name,
        referencePosition=pose[:3],
        referenceRotationMatrix=RotXYZ2RotationMatrix([*pose[3:5], 0.0]),
        inertia=RigidBodyInertia(mass=inertia.mass, inertiaTensor=tensor),
        nodeType=exu.NodeType.RotationRxyz,
    )


def _add_matrices(mbs, nodes: list[Any], elastic: ElasticShaft, inertias: list[Disc], recorder: ElasticRecorder) -> int:
    """Add the object with the matrices that bodies lack, the linear bearings among them."""
    n = elastic.size
    mass, polar = elastic.mass_matrix.copy(), elastic.polar_matrix.copy()
    for i, body in enumerate(inertias):
        part = slice(6 * i, 6 * i + 6)
        mass[part, part] -= np.diag([body.mass] * 3 + [body.transverse] * 2 + [body.inertia])
        polar[6 * i + 3, 6 * i + 4] -= body.inertia
        polar[6 * i + 4, 6 * i + 3] += body.inertia
    stiffness, damping = elastic.stiffness_matrix.copy(), elastic.damping_matrix.copy()
    for rows, bearing in at_bearings(elastic):
        k = rows.T @ linear_part(bearing, 0.0) @ rows
        stiffness, damping = stiffness + k, damping + bearing.damping_time * k
    arrays = np.ascontiguousarray(polar), np.ascontiguousarray(elastic.from_nodes[6:]), np.zeros(n)
    record = np.zeros(1, ELASTIC)[0]
    record.elastic, (record.polar, record.rows, record.forces) = elastic.elastic, (x.ctypes.data for x in arrays)
    kernel, addresses = elastic_kernel(n), (address_of(record), address_of(recorder.header))

    def elastic_shaft(mbs, t, item, q, q_t):
        return kernel(*addresses, t, *q, *q_t)

    def elastic_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        jacobian = factor_t * q_t[SPIN] * polar
        jacobian[:, SPIN] += factor_t * polar @ q_t
        return jacobian

    function = direct(elastic_shaft, kernel, (record, recorder.header), n, pointed_to=(arrays, recorder))
    item: Any = eii.ObjectGenericODE2(
        name=f"{elastic.shaft.name} shaft",
        nodeNumbers=nodes,
        massMatrix=mass,
        stiffnessMatrix=stiffness,
        dampingMatrix=damping,
        forceUserFunction=function,
        jacobianUserFunction=elastic_jacobian,
    )
    item.visualization["show"] = False
    return mbs.AddObject(item)


@cache
def elastic_kernel(n: int):
    """The function (record, recorder, t, *coordinates, *velocities) -> gyroscopic moments (n) of an elastic shaft.

    The first two are addresses: of an `ELASTIC` and of a recorder's header.
    """

    @kept
    def elastic_shaft(record, recorder, t, *x):
        shaft = elastic_at(record)
        polar, forces = carray(doubles_at(shaft.polar), (n, n)), carray(doubles_at(shaft.forces), n)
        speed = x[n + 5]
        for i in range(n):
            moment = 0.0
            for j in range(n):
                moment += polar[i, j] * x[n + j]
            forces[i] = -speed * moment
        k = sample_of(recorder, t)
        if k >= 0:
            header = header_at(recorder)
            rows = carray(doubles_at(shaft.rows), (shaft.elastic, n))
            for i in range(shaft.elastic):
                amplitude, rate = 0.0, 0.0
                for j in range(n):
                    amplitude, rate = amplitude + rows[i, j] * x[j], rate + rows[i, j] * x[n + j]
                floats_at(header.samples[0])[i * header.number + k] = amplitude
                floats_at(header.samples[1])[i * header.number + k] = rate
        return to_fixed_tuple(forces, n)

    return elastic_shaft


def _add_bearing(mbs, nodes: list[Any], rows: np.ndarray, bearing: Bearing) -> None:
    """Add the radial part of a nonlinear bearing, whose motion rows (6, n) measure."""
    n, law = rows.shape[1], radial_record(bearing, 0.0)
    arrays = np.ascontiguousarray(rows[:2]), np.zeros(n)
    record = np.zeros(1, BEARING)[0]
    record.law, record.rows, record.forces = address_of(law), arrays[0].ctypes.data, arrays[1].ctypes.data
    kernel, address = bearing_kernel(n), address_of(record)

    def elastic_bearing(mbs, t, item, q, q_t):
        try:
            return kernel(address, t, *q, *q_t)
        except ValueError as error:
            r, end = error.args
            beyond = f"displacement {r:.4g} m of a bearing lies beyond its table, which ends at {end:.4g} m"
            raise (OutOfRange(f"{beyond}; extend it") if r < FAR else Diverged(beyond)) from None

    def bearing_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        radial = tangent_stiffness(bearing, 0.0, rows @ np.array(q)) - linear_part(bearing, 0.0)
        return (factor + factor_t * bearing.damping_time) * rows.T @ radial @ rows

    function = direct(errors_kept(mbs, elastic_bearing), kernel, (record,), n, pointed_to=(law, arrays))
    item: Any = eii.ObjectGenericODE2(
        nodeNumbers=nodes, forceUserFunction=function, jacobianUserFunction=bearing_jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)


@cache
def bearing_kernel(n: int):
    """The function (record, t, *coordinates, *velocities) -> forces (n) of a nonlinear bearing on an elastic shaft.

    record is the address of a `BEARING`. Raises ValueError(r, end) where the radial displacement r lies beyond the end
    of the law.
    """

    @kept
    def elastic_bearing(record, t, *x):
        bearing = bearing_at(record)
        law = radial_law_at(bearing.law)
        points, rows = points_of(law), carray(doubles_at(bearing.rows), (2, n))
        forces, at_x, at_y, v_x, v_y = carray(doubles_at(bearing.forces), n), 0.0, 0.0, 0.0, 0.0
        for j in range(n):
            at_x, at_y = at_x + rows[0, j] * x[j], at_y + rows[1, j] * x[j]
            v_x, v_y = v_x + rows[0, j] * x[n + j], v_y + rows[1, j] * x[n + j]
        r, end = np.hypot(at_x, at_y), points[0, law.points - 1]
        if not r <= end:
            raise ValueError(r, end)
        p, q = radial_reaction(points, law.damping, at_x, at_y, v_x, v_y)
        for j in range(n):
            forces[j] = rows[0, j] * p + rows[1, j] * q
        return to_fixed_tuple(forces, n)

    return elastic_bearing
