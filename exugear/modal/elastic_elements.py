"""Elastic elements of a system as stiffness matrices: bearings and couplings of a gearbox, springs of Exudyn."""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import tangent_stiffness
from exugear.gearbox.housing import seat_number
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft
from exugear.multibody.elastic_shafts import BuiltShaft
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.housing import coupling_of, seat_rows
from exugear.multibody.model import Model, pin_coordinates
from exugear.multibody.planet_pins import pin_matrices
from fem.units import mm

#: Share of an entry of the whole stiffness below which the difference of matrices is rounding.
ROUNDING = 1e-9
#: Names that Exudyn gives.
UNNAMED = re.compile(r"object\d+")


class ElasticElement(NamedTuple):
    """An element by its name and kind, with its tangent stiffness over all coordinates of the system (n, n)."""

    name: str
    kind: str
    stiffness: np.ndarray


def bearings_and_couplings(model: Model) -> Iterator[ElasticElement]:
    """The elements between the shafts of a gearbox and its housing, and its rotors, in its initial state."""
    q = np.array(model.bare_mbs.systemData.GetODE2Coordinates(INITIAL))
    for shaft in model.gearbox.shafts:
        kind, spin = model.plan.shafts[shaft.name], model.spins[shaft.name]
        if shaft.torque_supports:
            torsion = np.array([[sum(support.torsion for support in shaft.torque_supports)]])
            yield ElasticElement(f"{shaft.name} torque support", "coupling", embedded(torsion, [spin], q.size))
        if built := model.elastics.get(shaft.name):
            yield ElasticElement(f"{shaft.name} shaft", "shaft", _over(built, built.elastic.stiffness_matrix, q.size))
            for axial, bearing in _beside_housing(model, shaft).items():
                rows = built.elastic.at_bearing(axial)
                matrix = tangent_stiffness(bearing, 0.0, rows @ q[built.indices])
                name = f"{shaft.name} bearing at {axial / mm:.4g} mm"
                yield ElasticElement(name, "bearing", _over(built, rows.T @ matrix @ rows, q.size))
        elif kind.on_bearings and shaft.name not in model.gearbox.planets:
            part, components = np.arange(spin - kind.spin_index, spin + 1), np.ix_(kind.components, kind.components)
            displacement = np.zeros(6)
            displacement[kind.components] = q[part]
            for axial, bearing in _beside_housing(model, shaft).items():
                matrix = tangent_stiffness(bearing, axial - shaft.centre, displacement)
                name = f"{shaft.name} bearing at {axial / mm:.4g} mm"
                yield ElasticElement(name, "bearing", embedded(matrix[components], part, q.size))
        if ring := model.rings.get(shaft.name):
            stiffness = np.diag(ring.elastic.stiffness)
            yield ElasticElement(f"{shaft.name} rim", "ring", embedded(stiffness, ring.indices, q.size))
        for rotor in shaft.rotors:
            spring = rotor.coupling.torsion * np.array([[1.0, -1.0], [-1.0, 1.0]])
            ends = [model.turning[rotor.body], model.turning[rotor.name]]
            yield ElasticElement(rotor.spring, "coupling", embedded(spring, ends, q.size))
    yield from on_housing(model)
    yield from on_moving_seats(model, q)


def on_moving_seats(model: Model, q: np.ndarray) -> Iterator[ElasticElement]:
    """The bearings on moving seats, and a housing with coordinates, at coordinates q (n,) of the system."""
    if model.seats is None:
        return
    for seat in model.seats.seats:
        tangent = tangent_stiffness(seat.bearing, 0.0, seat.rows @ q[model.seats.indices])
        matrix = embedded(seat.rows.T @ tangent @ seat.rows, model.seats.indices, q.size)
        yield ElasticElement(f"{seat.seat[0]} bearing at {seat.seat[1] / mm:.4g} mm", "bearing", matrix)
    if housing := model.seats.housing:
        yield ElasticElement("housing", "housing", embedded(housing.stiffness, model.seats.of_housing, q.size))


def on_housing(model: Model) -> Iterator[ElasticElement]:
    """The bearings on the seats of a housing, and the housing."""
    coupling = coupling_of(model.gearbox, model.scene)
    if coupling is None:
        return
    n = model.bare_mbs.systemData.ODE2Size()
    rows = seat_rows(model.gearbox, model.scene, coupling, model.spins, model.elastics, n)
    against = coupling.against_seats @ rows
    for i, (name, axial) in enumerate(coupling.housing.seats):
        part = slice(6 * i, 6 * i + 6)
        matrix = against[part].T @ coupling.bearings[part, part] @ against[part]
        yield ElasticElement(f"{name} bearing at {axial / mm:.4g} mm", "bearing", matrix)
    yield ElasticElement("housing", "housing", rows.T @ coupling.of_housing @ rows)


def _beside_housing(model: Model, shaft: Shaft) -> dict[float, Bearing | RollingBearing]:
    """The bearings of a shaft that stand on ground."""
    housing, moving = model.gearbox.housing, [x.seat for x in model.seats.seats] if model.seats else []
    return {
        x: bearing
        for x, bearing in shaft.bearings.items()
        if seat_number(housing, shaft.name, x) is None and (shaft.name, x) not in moving
    }


def _over(built: BuiltShaft, matrix: np.ndarray, n: int) -> np.ndarray:
    """(n, n) matrix over all coordinates from that over those of an elastic shaft."""
    return embedded(matrix, built.indices, n)


def pins(model: Model) -> Iterator[ElasticElement]:
    """The pins of planets between these and their carriers, in the initial state of the gearbox."""
    q = np.array(model.bare_mbs.systemData.GetODE2Coordinates(INITIAL))
    for pin in model.pins:
        part, n = pin_coordinates(model, pin)
        stiffness, _ = pin_matrices(pin, q[part].tolist(), n, float(q[part[n - 1]]))
        yield ElasticElement(f"{pin.planet.name} pin", "bearing", embedded(stiffness, part, q.size))


def springs(mbs, numbers: Sequence[int]) -> Iterator[ElasticElement]:
    """The elastic ones among the objects of a system, in its initial state; gear contacts are left out."""
    whole, constraints = stiffness_of(mbs), ("Constraint", "Joint")
    least = ROUNDING * np.abs(whole)
    for number in numbers:
        item = mbs.GetObject(number)
        if item["objectType"] == "GenericODE2":
            matrix = _generic_matrix(mbs, number, item)
        elif item.get("activeConnector") and not any(name in item["objectType"] for name in constraints):
            matrix = whole - _without(mbs, number)
        else:
            continue
        if (np.abs(matrix) > least).any():
            yield ElasticElement(name_of(mbs, number), item["objectType"].removeprefix("Connector"), matrix)


def name_of(mbs, number: int) -> str:
    """Name of an object, with its kind where Exudyn has named it."""
    item = mbs.GetObject(number)
    kind = item["objectType"].removeprefix("Connector")
    return f"{kind} {number}" if UNNAMED.fullmatch(item["name"]) else item["name"]


def names_of_nodes(mbs) -> dict[int, str]:
    """Name of the body on each node where the user has named it, else that of the node."""
    names = {node: str(mbs.GetNode(node)["name"]) for node in range(mbs.systemData.NumberOfNodes())}
    for number in range(mbs.systemData.NumberOfObjects()):
        item = mbs.GetObject(number)
        if "nodeNumber" in item and "nodeNumbers" not in item and not UNNAMED.fullmatch(item["name"]):
            names[int(item["nodeNumber"])] = item["name"]
    return names


def stiffness_of(mbs) -> np.ndarray:
    """(n, n) tangent stiffness of a system in its initial state."""
    return np.array(mbs.ComputeLinearizedSystem()[1])


def _generic_matrix(mbs, number: int, item: dict) -> np.ndarray:
    """Tangent stiffness of an ObjectGenericODE2 over all coordinates of its system."""
    coordinates, n = mbs.systemData.GetObjectLTGODE2(number), mbs.systemData.ODE2Size()
    q = np.array(mbs.systemData.GetODE2Coordinates(INITIAL))[coordinates].tolist()
    constant, jacobian = np.array(item["stiffnessMatrix"].Convert2DenseMatrix()), item["jacobianUserFunction"]
    matrix = constant if constant.size else np.zeros((len(coordinates),) * 2)
    if isinstance(jacobian, dict):
        matrix = matrix + jacobian["function"](mbs, 0.0, number, q, [0.0] * len(q), 1.0, 0.0)
    return embedded(matrix, coordinates, n)


def _without(mbs, number: int) -> np.ndarray:
    """Tangent stiffness of a system without one of its connectors."""
    try:
        mbs.SetObjectParameter(number, "activeConnector", False)
        return stiffness_of(mbs)
    finally:
        mbs.SetObjectParameter(number, "activeConnector", True)


def embedded(matrix: np.ndarray, coordinates, n: int) -> np.ndarray:
    """(n, n) matrix that holds a matrix (k, k) in the rows and columns of k coordinates."""
    whole = np.zeros((n, n))
    whole[np.ix_(coordinates, coordinates)] = matrix
    return whole
