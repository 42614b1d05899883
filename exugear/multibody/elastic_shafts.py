"""Elastic shafts in Exudyn: an object with constant matrices between the bodies of the gears and a further node.

Each gear has a body with the coordinates of a rigid one in a frame that does not turn, to which its contact is tied.
The object holds the mass matrix, the stiffness of shaft and bearings, and what a compiled kernel evaluates: gyroscopic
moments, which are proportional to the speed, and nonlinear bearings, rolling ones with a predictor
(`exugear.multibody.step_ends`). It records the elastic coordinates, too, from which the motion of each bearing
follows.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import exudyn.itemInterface as eii
import numpy as np
from numba import carray, types

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import linear_part, radial_reaction, tangent_stiffness
from exugear.gearbox.elastic_shaft import ElasticShaft
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import address_of, as_tuple, floats_at, integers_at, put_all, reader
from exugear.multibody.bearings_and_drags import points_of, radial_law_at, radial_record
from exugear.multibody.direct_call import direct
from exugear.multibody.exudyn_objects import assemble_in_state, node_of
from exugear.multibody.recorder import BodyRecorder, header_at, sample_of
from exugear.multibody.rolling_bearings import COORDINATES, law_at, reaction_in_step
from exugear.multibody.step_ends import StepEnds, keep_step_ends
from exugear.multibody.unbalance import add_unbalance
from exugear.multibody.user_function_errors import FAR, Diverged, OutOfRange, errors_kept
from exugear.rolling_bearings.law import FAR as FAR_FROM_CENTRE
from fem.support.numba_cache import compiled, kept
from fem.support.on_demand import on_demand

#: Number of elastic coordinates, index of the spin, number of nonlinear bearings, number of meshes; addresses of the
#: gyroscopic matrix (n, n), 0 without, of the rows that measure the elastic coordinates, compressed: first entry of
#: each row (elastic + 1), columns and values of the entries; of room for coordinates and velocities (2 n) and for
#: forces (n), of the `BEARING` records, and of the `IN_STEP` records.
ELASTIC = record_type(
    *((name, "i8") for name in ("elastic", "spin", "number", "meshes", "polar", "starts", "columns", "values")),
    *((name, "i8") for name in ("state", "forces", "bearings", "in_steps")),
)
#: A mesh of the shaft in the steps of an integrator: addresses of the accelerations (2 n) along its line of action by
#: coordinates and velocities of the shaft [1/s^2, 1/s], and of their sum [m/s^2], which its contact reads.
IN_STEP = record_type(*((name, "i8") for name in ("rows", "acceleration")))
#: Addresses of a `RADIAL_LAW`, 0 of a rolling bearing, of whose `LAW` and `STEP_ENDS`, and of the rows (5, n) that
#: measure the motion at the bearing; the `CageSpin`.
BEARING = record_type(
    *((name, "i8") for name in ("radial", "law", "ends", "rows", "spin", "carrying")), ("factor", "f8")
)
#: Key under which a system keeps the bodies that carry graphics, by the bodies of the gears of elastic shafts.
GRAPHICS = "graphics of elastic shafts"
elastic_at, bearing_at, in_step_at = reader(ELASTIC), reader(BEARING), reader(IN_STEP)
BEARING_SIZE, IN_STEP_SIZE = BEARING.itemsize, IN_STEP.itemsize


class MeshesInSteps:
    """What contacts learn of an elastic shaft in the steps of an integrator: its kernel computes accelerations.

    Elastic forces change the acceleration along the line of action as much as the mesh force does. By their change in a
    step, which the kernel takes from all coordinates of the shaft, the contact's first guess ends Newton's iteration.

    rows       (n_mesh, 2 n) accelerations along the line of action by coordinates and velocities [1/s^2, 1/s]
    records    (n_mesh,) `IN_STEP`
    contacts   object numbers of the contacts that read them
    """

    def __init__(self, meshes: int, n: int):
        self.rows, self.records = np.zeros((meshes, 2 * n)), np.zeros(meshes, IN_STEP)
        self.unread, self.contacts = np.zeros(1), list[int]()
        self.records["acceleration"] = self.unread.ctypes.data
        for record, row in zip(self.records, self.rows, strict=True):
            record["rows"] = row.ctypes.data

    def read_by(self, contact: int, acceleration: np.ndarray) -> None:
        """Let the kernel write the acceleration along the line of action of a contact where that reads it."""
        self.records[len(self.contacts)]["acceleration"] = acceleration.ctypes.data
        self.contacts.append(contact)


@dataclass(frozen=True, eq=False)
class BuiltShaft:
    """An elastic shaft in a built system.

    elastic    its coordinates and matrices
    bodies     axial position of each gear [m] -> object number of its body
    number     of the object with the matrices
    recorder   samples of the amplitudes and their rates
    indices    (size,) of its coordinates among those of the system
    in_steps   of an integrator: what its meshes learn of it
    left_out   axial positions [m] of bearings that are no part of it
    """

    elastic: ElasticShaft
    bodies: Mapping[float, int]
    number: int
    recorder: BodyRecorder
    indices: np.ndarray
    in_steps: MeshesInSteps
    left_out: Collection[float] = ()

    def motion(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """(number, elastic) first recorded amplitudes and their rates, of torsion last."""
        amplitudes, rates = (self.recorder[name][:number] for name in self.recorder.names)
        return amplitudes, rates

    @property
    def spins(self) -> dict[float, int]:
        """Axial position of each gear [m] -> index of the spin of its body."""
        turning = self.elastic.turning[: len(self.bodies)]
        return {axial: int(index) for axial, index in zip(self.bodies, self.indices[turning], strict=True)}

    @property
    def turning(self) -> np.ndarray:
        """(n,) indices of the coordinates of torsion among those of the system."""
        return self.indices[self.elastic.turning]

    @property
    def stiffness(self) -> np.ndarray:
        """(size, size) stiffness of the shaft and its bearings, nonlinear ones at their steepest slopes."""
        bearings = at_bearings(self.elastic)
        return sum((rows.T @ bearing.stiffness @ rows for rows, bearing in bearings), self.elastic.stiffness_matrix)

    def following(self, axial: float) -> np.ndarray:
        """(size, 6) coordinates of the whole shaft that follow the body of a gear, nothing else pushing it."""
        first = 6 * self.elastic.shaft.stations.index(axial)
        moved = np.arange(first, first + 6)
        follow, stiffness = np.zeros((self.elastic.size, 6)), self.stiffness
        follow[moved] = np.eye(6)
        follow[self.elastic.turning[: len(self.bodies)], 5] = 1.0
        rest = np.setdiff1d(self.elastic.moving, moved)
        follow[rest] = np.linalg.solve(stiffness[np.ix_(rest, rest)], -stiffness[np.ix_(rest, moved)])
        return follow

    def mass(self, *, held: bool) -> np.ndarray:
        """(size, size) mass that the rotor of the end lacks; held: the motion of the end is imposed."""
        elastic = self.elastic
        mass = elastic.mass_matrix(held=held)
        if elastic.shaft.twist and not held:
            mass[elastic.end, elastic.end] -= elastic.shaft.twist.inertia
        return mass

    def damping(self, *, held: bool) -> np.ndarray:
        """(size, size) damping of the shaft and of the linear parts of its bearings; held: as for the mass."""
        damping = self.elastic.damping_matrix(held=held)
        for rows, bearing in at_bearings(self.elastic, self.left_out):
            damping = damping + bearing.damping_time * (rows.T @ linear_part(bearing, 0.0) @ rows)
        return damping


def at_bearings(
    elastic: ElasticShaft, left_out: Collection[float] = ()
) -> list[tuple[np.ndarray, Bearing | RollingBearing]]:
    """(6, size) rows that measure the motion at each bearing, and the bearing; none of a shaft that only spins.

    left_out   axial positions of other bearings [m]
    """
    bearings = elastic.shaft.bearings if elastic.spatial else {}
    return [(elastic.at_bearing(axial), bearing) for axial, bearing in bearings.items() if axial not in left_out]


def add_bodies_of_gears(mbs, pose: list[float], elastic: ElasticShaft) -> dict[float, int]:
    """Add the bodies of the gears of an elastic shaft; pose: reference coordinates (6) of its centre of mass.

    They have no mass: the matrices of the shaft contain it. Were they rigid bodies, Exudyn would assemble the mass
    matrix of the whole system anew for each residual: a quarter more time in runs.
    """
    bodies: dict[float, int] = {}
    for axial in elastic.shaft.stations:
        name = f"{elastic.shaft.name} gear {len(bodies) + 1}" if bodies else elastic.shaft.name
        if elastic.spatial:
            node = mbs.AddNode(eii.NodeRigidBodyRxyz(name=name, referenceCoordinates=[*pose[:5], 0.0]))
            bodies[axial] = mbs.AddObject(eii.ObjectGenericODE2(name=name, nodeNumbers=[node]))
        else:
            node = mbs.AddNode(eii.Node1D(name=name, referenceCoordinates=[0.0]))
            data = {"inertia": 0.0, "nodeNumber": node, "referencePosition": pose[:3]}
            bodies[axial] = mbs.AddObject(eii.ObjectRotationalMass1D(name=name, **data))
    return bodies


def graphics_body(mbs, body: int) -> int:
    """The rigid body without mass on the node of a gear's body which carries the graphics of that; added when needed.

    Graphics by a user function would do without it, but Exudyn's raytracer waits for them for ever.
    """
    carriers = mbs.variables.setdefault(GRAPHICS, {})
    if body not in carriers:
        item = eii.ObjectRigidBody(mass=0.0, inertia=[0.0] * 6, nodeNumber=node_of(mbs, body))
        carriers[body] = mbs.AddObject(item)
        assemble_in_state(mbs)
    return carriers[body]


def graphics_bodies(mbs) -> list[int]:
    """Numbers of the bodies of a system that carry graphics alone."""
    return [int(number) for number in dict(mbs.variables).get(GRAPHICS, {}).values()]


def add_elastic_shaft(
    mbs,
    elastic: ElasticShaft,
    bodies: Mapping[float, int],
    end: int | None,
    meshes: int,
    on_moving_seats: Collection[float] = (),
) -> BuiltShaft:
    """Add matrices and bearings of an elastic shaft to the bodies of its gears and to the rotor of its end, if any.

    meshes            number of the meshes of its gears, whose contacts must be added later
    on_moving_seats   axial positions [m] of bearings that are left out (`exugear.multibody.moving_seats`)
    """
    nodes = [node_of(mbs, body) for body in [*bodies.values(), *([] if end is None else [end])]]
    if elastic.further:
        nodes.append(further_node(mbs, f"{elastic.shaft.name} shapes", elastic.further))
    recorder = BodyRecorder(("amplitudes", "rates"), vector_size=len(elastic.amplitude_rows))
    in_steps = MeshesInSteps(meshes, elastic.size)
    built = BuiltShaft(elastic, bodies, 0, recorder, np.zeros(0, int), in_steps, on_moving_seats)
    number = _add_matrices(mbs, nodes, built)
    for axial, unbalance in elastic.shaft.unbalances if elastic.spatial else ():
        add_unbalance(mbs, nodes, elastic.at_bearing(axial)[:2], int(elastic.turning[0]), unbalance)
    return replace(built, number=number)


def located(mbs, built: BuiltShaft) -> BuiltShaft:
    """The shaft with the indices of its coordinates in the assembled system."""
    return replace(built, indices=np.array(mbs.systemData.GetObjectLTGODE2(built.number), int))


def set_held(mbs, built: BuiltShaft, *, held: bool) -> None:
    """Set mass and damping of a shaft for an end whose motion is imposed, or is free."""
    mbs.SetObjectParameter(built.number, "massMatrix", built.mass(held=held))
    mbs.SetObjectParameter(built.number, "dampingMatrix", built.damping(held=held))


class CageSpin(NamedTuple):
    """The spin that turns a cage: that of the shaft, and that of the shaft that carries the seat times a factor.

    spin, carrying   indices of these spins among coordinates
    factor           0 where the seat stands (`exugear.gearbox.seats_on_shafts.carrying_spin_factor`)
    """

    spin: int
    carrying: int
    factor: float

    def at(self, q: Sequence[float]) -> float:
        """The spin [rad] at coordinates (n,)."""
        return q[self.spin] + self.factor * q[self.carrying]


class NonlinearBearings(NamedTuple):
    """Nonlinear bearings: (rows (6, n), bearing, spin of its cage, step ends or None), records, what these point to."""

    bearings: list[tuple[np.ndarray, Bearing | RollingBearing, CageSpin, StepEnds | None]]
    records: np.ndarray
    arrays: list[Any]


def nonlinear_bearings(
    measured_by: Sequence[tuple[np.ndarray, Bearing | RollingBearing, CageSpin]],
) -> NonlinearBearings:
    """The nonlinear ones of bearings with rows (6, n) and the spin of a cage, with the records of the kernel."""
    nonlinear = [each for each in measured_by if not each[1].linear]
    bearings, records = [], np.zeros(len(nonlinear), BEARING)
    arrays: list[Any] = []
    for record, (rows, bearing, spin) in zip(records, nonlinear, strict=True):
        measuring = np.ascontiguousarray(rows[:5])
        record["rows"], ends = measuring.ctypes.data, None
        record["spin"], record["carrying"], record["factor"] = spin
        if isinstance(bearing, RollingBearing):
            law, ends = bearing.record_of_runs(0.0), StepEnds(COORDINATES)
            record["law"], record["ends"] = address_of(law.record), ends.address
            arrays.append(law)
        else:
            radial = radial_record(bearing, 0.0)
            record["radial"] = address_of(radial)
            arrays.append(radial)
        bearings.append((rows, bearing, spin, ends))
        arrays += [measuring, ends]
    return NonlinearBearings(bearings, records, arrays)


def _add_matrices(mbs, nodes: list[Any], built: BuiltShaft) -> int:
    """Add the object with the matrices of the shaft, the bearings among them, the end free."""
    elastic, recorder = built.elastic, built.recorder
    bearings, spin = at_bearings(elastic, built.left_out), int(elastic.turning[0])
    of_bearings = (rows.T @ linear_part(bearing, 0.0) @ rows for rows, bearing in bearings)
    stiffness = sum(of_bearings, elastic.stiffness_matrix)
    matrices = built.mass(held=False), stiffness, built.damping(held=False), elastic.polar_matrix
    measured_by = spin, elastic.amplitude_rows
    turning = CageSpin(spin, spin, 0.0)
    nonlinear = nonlinear_bearings([(rows, bearing, turning) for rows, bearing in bearings])
    name, load = f"{elastic.shaft.name} shaft", elastic.constant_load
    return add_matrices(
        mbs,
        name,
        nodes,
        matrices,
        measured_by,
        recorder,
        load=load,
        nonlinear=nonlinear,
        in_steps=built.in_steps,
    )


def add_matrices(
    mbs,
    name: str,
    nodes: list[Any],
    matrices: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None],
    measured_by: tuple[int, np.ndarray],
    recorder: BodyRecorder,
    *,
    load: np.ndarray | None = None,
    nonlinear: NonlinearBearings | None = None,
    in_steps: MeshesInSteps | None = None,
) -> int:
    """Add an object with constant matrices on nodes, which records amplitudes; returns its number.

    matrices      mass, stiffness, damping, and gyroscopic moments per speed or None, (n, n)
    measured_by   index of the coordinate whose rate is that speed, and rows (m, n) of the amplitudes
    load          (n,) constant forces
    nonlinear     bearings
    in_steps      of an integrator: what meshes learn of an elastic shaft
    """
    (mass, stiffness, damping, polar), (spin, rows), n = matrices, measured_by, len(matrices[0])
    nonlinear = nonlinear or NonlinearBearings([], np.zeros(0, BEARING), [])
    in_steps = in_steps or MeshesInSteps(0, n)
    room = np.zeros(2 * n), np.zeros(n)
    gyroscopic = np.zeros((n, n)) if polar is None else polar
    entries = rows != 0
    of_rows = np.append(0, np.cumsum(entries.sum(axis=1))), np.nonzero(entries)[1].copy(), rows[entries]
    arrays = np.ascontiguousarray(gyroscopic), *of_rows, *room
    record = np.zeros(1, ELASTIC)[0]
    record.elastic, record.spin, record.number = recorder.vector_size, spin, len(nonlinear.records)
    for field, array in zip(("polar", "starts", "columns", "values", "state", "forces"), arrays, strict=True):
        record[field] = array.ctypes.data
    record.polar = 0 if polar is None else record.polar
    record.bearings, record.in_steps = nonlinear.records.ctypes.data, in_steps.records.ctypes.data
    record.meshes = len(in_steps.records)
    kernel, addresses = elastic_kernel(n), (address_of(record), address_of(recorder.header))

    def elastic_shaft(mbs, t, item, q, q_t):
        try:
            return kernel(*addresses, t, *q, *q_t)
        except ValueError as error:
            r, end = error.args
            if end == 0.0:
                raise Diverged(f"displacement {r:.4g} m of a rolling bearing is beyond all bounds") from None
            beyond = f"displacement {r:.4g} m of a bearing lies beyond its table, which ends at {end:.4g} m"
            raise (OutOfRange(f"{beyond}; extend it") if r < FAR else Diverged(beyond)) from None

    def elastic_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        jacobian = factor_t * q_t[spin] * gyroscopic
        jacobian[:, spin] += factor_t * gyroscopic @ q_t
        for rows, bearing, turning, ends in nonlinear.bearings:
            at_bearing = np.append(rows[:5] @ np.array(q), turning.at(q))
            tangent = tangent_stiffness(bearing, 0.0, at_bearing) - linear_part(bearing, 0.0)
            share = (factor + factor_t * bearing.damping_time) * tangent
            if ends is not None:
                ends.note(share[:COORDINATES, :COORDINATES])
            jacobian += rows.T @ share @ rows
        return jacobian

    keep_step_ends(mbs, [ends for *_, ends in nonlinear.bearings if ends is not None])
    function = errors_kept(mbs, elastic_shaft) if nonlinear.bearings else elastic_shaft
    kept_alive = arrays, recorder, nonlinear, in_steps
    item: Any = eii.ObjectGenericODE2(
        name=name,
        nodeNumbers=nodes,
        massMatrix=mass,
        stiffnessMatrix=stiffness,
        dampingMatrix=damping,
        forceVector=np.zeros(n) if load is None else load,
        forceUserFunction=direct(function, kernel, (record, recorder.header), n, pointed_to=kept_alive),
        jacobianUserFunction=elastic_jacobian,
    )
    item.visualization["show"] = False
    return mbs.AddObject(item)


def further_node(mbs, name: str, size: int) -> int:
    """Add a node with a number of coordinates, all 0; returns the number of the node."""
    zeros = [0.0] * size
    initial = {f"initialCoordinates{rate}": zeros for rate in ("", "_t")}
    data = {"referenceCoordinates": zeros, "numberOfODE2Coordinates": size, **initial}
    return mbs.AddNode(eii.NodeGenericODE2(name=name, **data))


@compiled
def measured(rows, state, first, n):
    """Motion (5) that rows (5, n) measure in a state, from an index on."""
    x, y, z, a, b = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        value = state[first + j]
        x, y, z = x + rows[0, j] * value, y + rows[1, j] * value, z + rows[2, j] * value
        a, b = a + rows[3, j] * value, b + rows[4, j] * value
    return x, y, z, a, b


@compiled
def reaction_on_elastic(bearing, t, q, q_t, spin):
    """Forces (6) of a nonlinear bearing by the motion (5) at it; ValueError(r, end) beyond its table or all bounds."""
    if bearing.radial == 0:
        far = abs(q[0]) + abs(q[1]) + abs(q[2])
        if not far <= FAR_FROM_CENTRE:
            raise ValueError(far, 0.0)
        return reaction_in_step(law_at(bearing.law), bearing.ends, t, q, q_t, spin)
    law = radial_law_at(bearing.radial)
    points = points_of(law)
    r, end = np.hypot(q[0], q[1]), points[0, law.points - 1]
    if not r <= end:
        raise ValueError(r, end)
    p, s = radial_reaction(points, law.damping, q[0], q[1], q_t[0], q_t[1])
    return p, s, 0.0, 0.0, 0.0, 0.0


@on_demand(types.none, types.int64, types.int64, types.float64, types.int64)
def write_forces(record, recorder, t, n):
    """Write the forces (n) on an elastic shaft in its state; arguments as of `elastic_kernel`.

    Compiled once for shafts of any number of coordinates.
    """
    shaft = elastic_at(record)
    polar, forces = carray(doubles_at(shaft.polar), (n, n)), carray(doubles_at(shaft.forces), n)
    state = carray(doubles_at(shaft.state), 2 * n)
    speed = state[n + shaft.spin]
    for i in range(n):
        forces[i] = 0.0
    for j in range(n if shaft.polar else 0):
        # -polar is its transpose, whose rows lie together
        rate = speed * state[n + j]
        for i in range(n):
            forces[i] += polar[j, i] * rate
    for k in range(shaft.number):
        bearing = bearing_at(shaft.bearings + BEARING_SIZE * k)
        rows = carray(doubles_at(bearing.rows), (5, n))
        q, q_t = measured(rows, state, 0, n), measured(rows, state, n, n)
        spin = state[bearing.spin] + bearing.factor * state[bearing.carrying]
        f = reaction_on_elastic(bearing, t, q, q_t, spin)
        for j in range(n):
            forces[j] += (
                rows[0, j] * f[0] + rows[1, j] * f[1] + rows[2, j] * f[2] + rows[3, j] * f[3] + rows[4, j] * f[4]
            )
        forces[bearing.spin] += f[5]
        forces[bearing.carrying] += bearing.factor * f[5]
    for k in range(shaft.meshes):
        in_step, acceleration = in_step_at(shaft.in_steps + IN_STEP_SIZE * k), 0.0
        by_state = carray(doubles_at(in_step.rows), 2 * n)
        for i in range(2 * n):
            acceleration += by_state[i] * state[i]
        doubles_at(in_step.acceleration)[0] = acceleration
    k = sample_of(recorder, t)
    if k >= 0:
        header, m = header_at(recorder), shaft.elastic
        starts, columns = carray(integers_at(shaft.starts), m + 1), integers_at(shaft.columns)
        values = doubles_at(shaft.values)
        for i in range(m):
            amplitude, rate = 0.0, 0.0
            for p in range(starts[i], starts[i + 1]):
                amplitude, rate = (
                    amplitude + values[p] * state[columns[p]],
                    rate + values[p] * state[n + columns[p]],
                )
            floats_at(header.samples[0])[m * k + i] = amplitude
            floats_at(header.samples[1])[m * k + i] = rate


@cache
def elastic_kernel(n: int):
    """The function (record, recorder, t, *coordinates, *velocities) -> forces (n) on an elastic shaft.

    They are gyroscopic moments and the forces of nonlinear bearings. The first two are addresses: of an `ELASTIC` and
    of a recorder's header. Raises ValueError(r, end) where the displacement r of a bearing lies beyond its law's end.
    """

    @kept
    def elastic_shaft(record, recorder, t, *x):
        shaft = elastic_at(record)
        put_all(shaft.state, x)
        write_forces(record, recorder, t, n)
        return as_tuple(carray(doubles_at(shaft.forces), n), n)

    return elastic_shaft
