"""What drives and loads a built system while a run or its static equilibrium is solved: imposed speeds and torques.

A drive has two modes. While a run is solved, an imposed angle is a known function of time that the contacts of the held
shaft evaluate, or the coupling behind its rotor, with no algebraic equation and no function in Python; so do contacts
with a constant torque. In static solves, and beside items of the user or what else acts on a held shaft, constraints
impose the angles (`exugear.multibody.drive_items`); those of free shafts are inactive. A run adds couplings and torques
of its own, and takes them away at its end; what the system has beside them is the same before, in and after it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import exudyn.itemInterface as eii
import numpy as np
from exudyn.utilities import CreateSymbolicUserFunction

from exugear.gearbox.shaft import Coupling, Shaft
from exugear.multibody.addresses import address_of
from exugear.multibody.direct_call import direct
from exugear.multibody.drive_items import OFFSETS, DriveItems
from exugear.multibody.exudyn_objects import (
    CURRENT,
    INITIAL,
    assemble_in_state,
    node_of,
    set_state_of_system,
    state_of_system,
)
from exugear.multibody.gear_contact import state_of
from exugear.multibody.imposed_motion import coupling_kernel, coupling_record
from exugear.multibody.model import (
    Model,
    by_shaft,
    further_loads,
    further_objects,
    hold_members,
    is_first,
)
from exugear.multibody.polynomial_pieces import pieces_record
from exugear.multibody.recorder import BodyRecorder
from exugear.multibody.torque_kernels import SHAFT_NAMES, torque_kernel, torque_record, torque_slopes
from exugear.operation.conditions import Conditions, ShaftEnd
from exugear.operation.shaft_ends import Torque
from exugear.operation.torque_tables import NO_TORQUE, TorqueTable

#: Key under which the system keeps imposed motions while they are known functions of time; name of a coupling of a
#: shaft that reads its motion.
MOTION, COUPLING = "imposed motion", "driven coupling of {}"


@dataclass(frozen=True, eq=False)
class ShaftTorque:
    """A tabulated torque on a shaft or rotor in a system.

    name       of the object
    record     which the kernel reads (`exugear.multibody.torque_kernels.SHAFT_TORQUE`)
    recorder   samples of the torque and of the motion of the body
    """

    name: str
    record: np.record
    recorder: BodyRecorder


#: Tabulated torques and recorded motions of a run, by the name of the shaft or rotor.
ShaftTorques = dict[str, ShaftTorque]


@dataclass(eq=False)
class DriveAndLoad:
    """Drive and load of a model under the conditions of a run.

    torques       tabulated torques and recorded motions
    constrained   whether the constraints impose the speeds while the run is solved
    """

    model: Model
    conditions: Conditions
    torques: ShaftTorques = field(default_factory=dict)
    constrained: bool = field(init=False)

    def __post_init__(self):
        rubbing = {name for drag in self.model.gearbox.drags_between for name in (drag.carried, drag.carrying)}
        braked = any(
            held.end_rotor is None and (held.drags or held.unbalances or held.name in rubbing) for held in self.held
        )
        added = bool(further_objects(self.model)) or bool(further_loads(self.model))
        twists = any(held.end_rotor is None and held.name in self.model.elastics for held in self.held)
        self.constrained = braked or added or twists or self._observed()

    def _observed(self) -> bool:
        """Whether sensors of the user measure constraint or load."""
        mbs, items = self.model.bare_mbs, self.items
        sensors = [mbs.GetSensor(i) for i in range(mbs.systemData.NumberOfSensors())]
        return any(
            int(sensor.get(kind, -1)) in map(int, numbers)
            for sensor in sensors
            for kind, numbers in (("objectNumber", items.numbers), ("loadNumber", items.loads))
        )

    @property
    def held(self) -> list[Shaft]:
        """The shafts whose speeds are imposed."""
        return [self.model.gearbox.ends[name] for name in self.conditions.held]

    @property
    def items(self) -> DriveItems:
        """Drive and load as items of Exudyn."""
        return self.model.drive_items

    def hold(self) -> None:
        """Let the constraints hold the anchors at rest at their angles at the start, for the static equilibrium."""
        model, conditions = self.model, self.conditions
        angles = by_shaft(model, conditions.initial_angles)
        for i, name in enumerate(conditions.anchors):
            markers = [self.items.ground, model.end_markers[name]]
            held = {"markerNumbers": markers, "activeConnector": True, "offset": angles[name]}
            self.items.set_constraint(i, held | dict.fromkeys(OFFSETS, 0))

    def release(self) -> None:
        """Let the torques vary, and the train turn as imposed or freely; the initial state of the system stays."""
        for shaft_torque in self.torques.values():
            shaft_torque.record.held = 0
        if self.constrained:
            self._impose_by_constraints(symbolic=True)
        else:
            self.items.set_aside()
            self._impose_as_functions_of_time()
        assemble_in_state(self.model.bare_mbs)

    def end(self) -> None:
        """Remove what the run has added; the system keeps its state, the imposed speeds and the constant load."""
        mbs, driven = self.model.bare_mbs, self.model.gearbox.driven.name
        for shaft_torque in self.torques.values():
            _delete(mbs, shaft_torque.name)
        for mesh in self.model.meshes:
            state = state_of(mbs, mesh.contact)
            state.torques[:], state.imposed[:], state.inertias[:] = 0.0, 0, 0.0
        hold_members(self.model)
        known = mbs.variables.pop(MOTION, None)
        for held in [shaft for shaft in self.held if shaft.end_rotor and known]:
            _delete(mbs, COUPLING.format(held.name))
            self._set_spring(held, True)
        self.hold()
        self._impose_by_constraints(symbolic=False)
        self.items.set_load({"markerNumber": self.items.driven})
        for end in self.conditions.ends:
            if end.name == driven and self.conditions.tables[driven].constant:
                self.items.set_load({"load": self._constant_torque(end)})
        assemble_in_state(self.model.bare_mbs)

    def _impose_by_constraints(self, *, symbolic: bool) -> None:
        """Let the constraints impose the speeds, or be inactive where shafts are free.

        symbolic   lines by expressions, which Exudyn evaluates itself; left behind they would keep the system in memory
        """
        imposed = angles_and_rates(self.conditions)
        for i, (functions, speed_of) in enumerate(zip(imposed, self.conditions.speeds_of, strict=False)):
            as_functions = dict(zip(OFFSETS, functions, strict=True))
            expressed = symbolic and speed_of.single
            self.items.set_constraint(i, self._expressed(i, as_functions) if expressed else as_functions)
        for i in range(len(imposed), len(self.items.ends)):
            self.items.set_constraint(i, {"activeConnector": False})

    def _expressed(self, i: int, functions: dict[str, Any]) -> dict[str, Any]:
        """The functions of a constraint, by its number, as expressions that Exudyn evaluates."""
        mbs, number = self.model.bare_mbs, self.items.numbers[i]
        return {name: CreateSymbolicUserFunction(mbs, each, name, number) for name, each in functions.items()}

    def _impose_as_functions_of_time(self) -> None:
        """Let the couplings of held rotors, or the contacts of held shafts, evaluate their imposed motions.

        The first of the contacts accelerates the coordinate of a shaft, of a carrier the first of its pins.
        """
        motions = []
        for held, imposed, speed_of in zip(self.held, self.conditions.imposed, self.conditions.speeds_of, strict=True):
            knots, coefficients = speed_of.angle_pieces
            coefficients[:, 0] += imposed.start_angle
            motions.append(pieces_record(knots, self.model.gearbox.directions[held.name] * coefficients))
            self._impose(held, motions[-1][0])
        if motions:
            self.model.bare_mbs.variables[MOTION] = motions

    def _impose(self, held: Shaft, motion: np.record) -> None:
        """Let the coupling of a held rotor, or the contacts of a held shaft, evaluate an imposed motion."""
        model, mbs = self.model, self.model.bare_mbs
        if held.end_rotor:
            self._set_spring(held, False)
            nodes = _node_of(model, held.end_rotor.name), _node_of(model, held.end_rotor.body)
            _add_driven_coupling(mbs, COUPLING.format(held.name), nodes, held.end_rotor.coupling, motion)
            return
        inertia, on_pins = model.gearbox.body_inertias[held.name], held.name in model.gearbox.carriers_of_pins
        for record in [pin.record for pin in model.pins if pin.carrier.name == held.name]:
            record.imposed, record.inertia, inertia = address_of(motion), inertia, 0.0
        for mesh in model.meshes:
            state = state_of(mbs, mesh.contact)
            for side, shaft in enumerate(mesh.stage.shafts):
                if shaft.name == held.name and not on_pins:
                    state.imposed[side], state.inertias[side], inertia = address_of(motion), inertia, 0.0

    def _set_spring(self, held: Shaft, active: bool) -> None:
        """Activate the spring between the rotor at the end of the held shaft and the body beside it, or not."""
        if held.end_rotor:
            number = self.model.bare_mbs.GetObjectNumber(held.end_rotor.spring)
            self.model.bare_mbs.SetObjectParameter(number, "activeConnector", active)

    def _constant_torque(self, end: ShaftEnd) -> float:
        """Torque about z of an end whose torque never changes [N m]."""
        value = float(self.conditions.tables[end.name](0.0, 0.0, 0.0))
        return end.sense * self.model.gearbox.directions[end.shaft] * value

    def apply_torques(self) -> None:
        """Apply a constant torque on a shaft by a contact of the shaft, others by their tables."""
        for end in self.conditions.ends:
            table = self.conditions.tables[end.name]
            if end.body in self.model.rotor_spins or not table.constant:
                self._add_torque(end, table, self.conditions.initial_torque(end))
                continue
            if pin := next((pin for pin in self.model.pins if pin.carrier.name == end.shaft), None):
                pin.record.torque = self._constant_torque(end)
                continue
            mesh, side = next(
                (mesh, side)
                for mesh in self.model.meshes
                for side, shaft in enumerate(mesh.stage.shafts)
                if shaft.name == end.shaft and is_first(self.model, mesh.stage, shaft)
            )
            state_of(self.model.bare_mbs, mesh.contact).torques[side] = self._constant_torque(end)

    def record_rotors(self) -> None:
        """Record the motion of the rotors behind couplings where it is needed; the meshes record that of bodies."""
        everywhere = not self.conditions.prescribed or self.conditions.power
        beside_held = {held.end_rotor.body for held in self.held if held.end_rotor}
        for shaft in self.model.gearbox.shafts:
            for rotor in shaft.rotors:
                if rotor.name not in self.torques and (everywhere or rotor.name in beside_held):
                    end = ShaftEnd(rotor.name, shaft.name, rotor.name, 1, Torque(0.0))
                    self._add_torque(end, NO_TORQUE, 0.0)

    def _add_torque(self, end: ShaftEnd, table: TorqueTable, at_start: float) -> None:
        """Add a tabulated torque on the end of a shaft, held at its value at the start [N m]."""
        model, name = self.model, f"torque on {end.body}"
        column = [shaft.name for shaft in model.gearbox.shafts].index(end.shaft)
        states = [state_of(model.bare_mbs, mesh.contact) for mesh in model.meshes]
        factors = [float(mesh.force_per_torque[column]) for mesh in model.meshes]
        record, arrays = torque_record(table, model.gearbox.directions[end.shaft], end.sense, states, factors)
        record.held, record.torque = 1, at_start
        recorder, node = BodyRecorder(SHAFT_NAMES), _node_of(model, end.body)
        _add_torque_object(model.bare_mbs, name, node, record, recorder, pointed_to=(arrays, states, recorder))
        self.torques[end.body] = ShaftTorque(name, record, recorder)


@contextmanager
def applied(model: Model, conditions: Conditions) -> Iterator[DriveAndLoad]:
    """Apply the imposed speed and the torques; afterwards the system keeps the speed and the load of the driven shaft.

    Contacts correct their damping by the drags at the start of the whole run, in each of its parts, too.

    Until `DriveAndLoad.release` the torques have their values at the start, and free anchors are held, so that the
    static equilibrium can be solved.
    """
    items, acting = model.drive_items, DriveAndLoad(model, conditions)
    if acting.constrained:
        items.add()
    before, items.busy = items.busy, True
    try:
        acting.hold()
        items.set_load({"load": 0.0, "loadUserFunction": 0})
        set_holding_forces(model, conditions.initial_torques + conditions.drags_at_zero)
        try:
            acting.apply_torques()
            acting.record_rotors()
            model.bare_mbs.Assemble()
            yield acting
        finally:
            acting.end()
    finally:
        items.busy = before


def is_known_function_of_time(model: Model) -> bool:
    """Whether imposed speeds are known functions of time, which contacts or couplings evaluate."""
    return MOTION in model.bare_mbs.variables


def angles_and_rates(conditions: Conditions) -> list[tuple[Any, Any]]:
    """Angle about z of each held shaft and its rate as user functions of Exudyn."""
    return [_angle_and_rate(conditions, number) for number in range(len(conditions.imposed))]


def _angle_and_rate(conditions: Conditions, number: int) -> tuple[Any, Any]:
    speed_of, imposed = conditions.speeds_of[number], conditions.imposed[number]
    direction, start_angle = conditions.gearbox.directions[imposed.shaft], imposed.start_angle

    def angle(mbs, t, item, offset):
        return speed_of.integral(t)

    def rate(mbs, t, item, offset):
        return speed_of(t)

    def angle_about_z(mbs, t, item, offset):
        return direction * (start_angle + speed_of.integral(t))

    def rate_about_z(mbs, t, item, offset):
        return direction * speed_of(t)

    return (angle_about_z, rate_about_z) if start_angle or direction < 0 else (angle, rate)


@contextmanager
def restored(model: Model) -> Iterator[None]:
    """Restore coordinates, drive, load and holding forces of the contacts afterwards."""
    mbs = model.bare_mbs
    contacts, parameters = [state_of(mbs, mesh.contact) for mesh in model.meshes], model.drive_items.parameters()
    holding_forces = [float(contact.holding_force) for contact in contacts]
    states = {configuration: state_of_system(mbs, configuration) for configuration in (INITIAL, CURRENT)}
    try:
        yield
    finally:
        model.drive_items.set_parameters(parameters)
        for contact, force in zip(contacts, holding_forces, strict=True):
            contact.holding_force = force
        mbs.Assemble()
        for configuration, state in states.items():
            set_state_of_system(mbs, state, configuration)


def set_holding_forces(model: Model, torques: np.ndarray) -> None:
    """Mesh forces that balance torques about z (n_shaft,) [N m] and loads, by which contacts correct their damping."""
    for mesh in model.meshes:
        force = float(mesh.force_per_torque @ torques) + mesh.force_by_loads
        state_of(model.bare_mbs, mesh.contact).holding_force = force


def _delete(mbs, name: str) -> None:
    """Delete an object by its name."""
    mbs.DeleteObject(mbs.GetObjectNumber(name), deleteDependentItems=False, suppressWarnings=True)


def _node_of(model: Model, body: str):
    """Node of a shaft, or of a rotor, by its name."""
    mbs, number = model.bare_mbs, model.bodies.get(body)
    return node_of(mbs, mbs.GetObjectNumber(body) if number is None else number)


def _add_torque_object(mbs, name: str, node, record: np.record, recorder: BodyRecorder, pointed_to: object) -> None:
    """Add a torque on the last coordinate of a node, which is its spin; called without Python where that works.

    pointed_to   what the records hold addresses of
    """
    n = len(mbs.GetNode(node)["referenceCoordinates"])
    kernel, addresses = torque_kernel(n), (address_of(record), address_of(recorder.header))

    def shaft_torque(mbs, t, item, q, q_t):
        return kernel(*addresses, t, *q, *q_t)

    def torque_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        jacobian = np.zeros((n, n))
        jacobian[-1, -1] = -np.dot((factor, factor_t), torque_slopes(addresses[0], t, q[-1], q_t[-1]))
        return jacobian

    function = direct(shaft_torque, kernel, (record, recorder.header), n, pointed_to)
    item: Any = eii.ObjectGenericODE2(
        name=name, nodeNumbers=[node], forceUserFunction=function, jacobianUserFunction=torque_jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)


def _add_driven_coupling(mbs, name: str, nodes: tuple[Any, Any], coupling: Coupling, motion: np.record) -> None:
    """Add a coupling between the nodes of a rotor with an imposed motion and of the body that bears the coupling."""
    record, n = coupling_record(coupling, motion), len(mbs.GetNode(nodes[1])["referenceCoordinates"])
    kernel, address = coupling_kernel(n), address_of(record)

    def driven_coupling(mbs, t, item, q, q_t):
        return kernel(address, t, *q, *q_t)

    def coupling_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        jacobian = np.zeros((n + 1, n + 1))
        jacobian[n, n] = factor * record.torsion + factor_t * record.damping
        return jacobian

    function = direct(driven_coupling, kernel, (record,), n + 1)
    item = eii.ObjectGenericODE2(
        name=name, nodeNumbers=list(nodes), forceUserFunction=function, jacobianUserFunction=coupling_jacobian
    )
    item.visualization["show"] = False
    mbs.AddObject(item)
