"""Speeds of the shafts, torques on their ends, forces and displacements at their bearings, from recorded samples."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from exugear.gearbox.drag import braking_torque
from exugear.gearbox.housing import seat_number
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.seats_on_shafts import carrying_spin_factor
from exugear.gearbox.shaft import Rotor, Shaft
from exugear.gearbox.shaft_dynamics import (
    AgainstSeats,
    Measured,
    bearing_displacements,
    bearing_forces,
    bearing_tilts,
    braking_torques,
    parted_bearings,
    unbalance_torques,
)
from exugear.multibody.drive_and_load import ShaftTorques
from exugear.multibody.housing import coupling_of, forces_on_seats, seat_motions
from exugear.multibody.model import Model, is_first
from exugear.multibody.moving_seats import SeatMotion, motions_of_seats, positions_on
from exugear.operation.conditions import Conditions, ShaftEnd
from exugear.operation.stop_conditions import SpeedReached
from fem.support.blas_threads import one_thread
from fem.support.user_warning import warn_user
from fem.units import mm

ALL = slice(None)
#: Samples whose bearing forces are computed at once: memory that is used again costs less than new memory, which took a
#: tenth of the time of a run on elastic shafts.
PART = 1 << 14


def needs_speeds(model: Model, conditions: Conditions) -> bool:
    """Whether meshes must record spins and speeds, which drags, torque supports, rolling cages and free trains need."""
    stops = any(isinstance(stop, SpeedReached) for stop in conditions.stop)
    braked = any(shaft.drags or shaft.torque_supports or shaft.unbalances for shaft in model.gearbox.shafts)
    braked = braked or any(mesh.frame.fixed.any() for mesh in model.meshes)
    braked = braked or any(cages_roll(shaft) for shaft in model.gearbox.shafts)
    behind_couplings = any(name in model.rotors for name in conditions.held)
    return conditions.power or not conditions.prescribed or behind_couplings or stops or braked


def cages_roll(shaft: Shaft) -> bool:
    """Whether the cage of a rolling bearing of a shaft rolls with it."""
    return any(isinstance(x, RollingBearing) and x.cage_rolls for x in shaft.bearings.values())


def spin_of_cages(model: Model, shaft: Shaft) -> dict[float, np.ndarray]:
    """Axial position [m] of each bearing of a shaft whose cage rolls -> (n,) recorded spin about z [rad] that turns it.

    It is that of the shaft, and that of a shaft that carries the seat times `carrying_spin_factor`.
    """
    if not cages_roll(shaft):
        return {}
    box, spins = model.gearbox, recorded(model, "spin")
    by_position = {}
    for axial, bearing in shaft.bearings.items():
        if isinstance(bearing, RollingBearing) and bearing.cage_rolls:
            by_position[axial] = box.directions[shaft.name] * spins[shaft.name]
            if (shaft.name, axial) in box.between:
                on, _ = box.between[shaft.name, axial]
                by_position[axial] = by_position[axial] + carrying_spin_factor(bearing) * box.directions[on] * spins[on]
    return by_position


def recorded(model: Model, quantity: str) -> dict[str, np.ndarray]:
    """(n,) spins [rad] or speeds [rad/s] of all shafts in their senses of motion; empty where they are not recorded.

    quantity   "spin" or "speed"
    """
    by_shaft: dict[str, np.ndarray] = {}
    for mesh in model.meshes:
        if "energy" in mesh.recorder.samples:
            for number, shaft in enumerate(mesh.stage.shafts, start=1):
                if shaft.name not in model.gearbox.carriers_of_pins and is_first(model, mesh.stage, shaft):
                    samples = mesh.recorder.power[f"{quantity}_{number}"]
                    by_shaft[shaft.name] = model.gearbox.directions[shaft.name] * samples
    for pin in model.pins if by_shaft else ():
        samples = pin.recorder.samples[quantity][: model.meshes[0].recorder.deflection.size]
        by_shaft[pin.carrier.name] = model.gearbox.directions[pin.carrier.name] * samples
    return by_shaft


def driving_speed(model: Model, conditions: Conditions, time: np.ndarray) -> np.ndarray:
    """(n,) speed of the driving shaft about z [rad/s], imposed or recorded."""
    driving = model.gearbox.driving.name
    return conditions.driving_speed(time) if conditions.prescribed else recorded(model, "speed")[driving]


def mesh_frequencies(model: Model, conditions: Conditions, time: np.ndarray) -> np.ndarray:
    """(n_stage, n) mesh frequencies [Hz] by the speeds of the anchors, imposed or recorded."""
    if conditions.prescribed:
        speeds = conditions.anchor_speeds(time)
    else:
        directions, by_shaft = model.gearbox.directions, recorded(model, "speed")
        speeds = np.array([directions[name] * by_shaft[name] for name in conditions.anchors])
    return np.abs(model.gearbox.cycles @ conditions.motions.T @ speeds)


def speed_variables(model: Model, torques: ShaftTorques, number: int) -> dict[str, Any]:
    """Recorded speeds of shafts, and of the rotors behind couplings; number: of valid samples."""
    shafts = model.gearbox.ends
    rotors = {
        name: model.gearbox.directions[shafts[name].name] * torque.recorder["speed"][:number]
        for name, torque in torques.items()
        if name in model.rotor_spins
    }
    return _speeds("shaft", recorded(model, "speed")) | _speeds("rotor", rotors)


def _speeds(kind: str, speeds: dict[str, np.ndarray]) -> dict[str, Any]:
    """Variables of speeds by name; empty where there are none."""
    if not speeds:
        return {}
    about = {"units": "rad/s", "long_name": f"speed of the {kind} in its sense of motion"}
    return {f"{kind}_speed": ((kind, "time"), np.array(list(speeds.values())), about), kind: (kind, list(speeds))}


def motions_on_bearings(model: Model, part: slice = ALL) -> dict[str, tuple[Shaft, np.ndarray, np.ndarray]]:
    """Shafts on bearings by name, with recorded motions (n, 2 or 5) of their centres of mass [m, rad], and rates.

    part   of the samples

    Of planets those against their pins, along and across the pin's radius and along the pin. Of elastic shafts
    (n, 5 + elastic) the motion of the rigid shaft and the elastic coordinates.
    """
    kinds, motions, by_name = model.plan.shafts, {}, {}
    number = model.meshes[0].recorder.deflection.size
    for pin in model.pins:
        recorder = pin.recorder
        motions[pin.planet.name] = recorder.deflection(number), recorder.deflection(number, rate=True)
        if kinds[pin.carrier.name].on_bearings:
            motions[pin.carrier.name] = recorder.centre(number), recorder.centre(number, rate=True)
    for mesh in model.meshes:
        for side, shaft in enumerate((mesh.stage.fast, mesh.stage.slow)):
            first = is_first(model, mesh.stage, shaft)
            if kinds[shaft.name].on_bearings and shaft.name not in motions and first:
                motions[shaft.name] = mesh.recorder.motion(side)
    for shaft in [shaft for shaft in model.gearbox.shafts if shaft.name in motions]:
        moving, (q, q_t) = slice(kinds[shaft.name].spin_index), (x[part] for x in motions[shaft.name])
        by_name[shaft.name] = shaft, q[:, moving], q_t[:, moving]
        if built := model.elastics.get(shaft.name):
            elastic, (amplitudes, rates) = built.elastic, (x[part] for x in built.motion(number))
            q, q_t = (elastic.decoupled(x, y[:, : elastic.elastic]) for x, y in ((q, amplitudes), (q_t, rates)))
            by_name[shaft.name] = shaft, q, q_t
    return by_name


@dataclass(frozen=True, eq=False)
class InBearings:
    """A shaft with the coordinates that determine its motion in the bearings.

    shaft      the shaft
    q, q_t     coordinates (n, k) and their rates, with the motions of its seats if these move
    measured   gives the motion in each bearing by these; None for a rigid shaft whose seats stand
    """

    shaft: Shaft
    q: np.ndarray
    q_t: np.ndarray
    measured: Measured | None


Motions = Mapping[str, tuple[Shaft, np.ndarray, np.ndarray]]


def motion_in_bearings(model: Model, on_bearings: Motions, part: slice = ALL) -> dict[str, InBearings]:
    """Shafts on bearings by name, with their recorded motion against the seats in a part of the samples.

    on_bearings   their motions in it, `motions_on_bearings`
    """
    if not model.seats:
        return against_seats(model, on_bearings, None)
    q, q_t = model.seats.motion(model.meshes[0].recorder.deflection.size)
    return against_seats(model, on_bearings, (q[part], q_t[part]))


def against_seats(
    model: Model, motions: Motions, of_housing: tuple[np.ndarray, np.ndarray] | None
) -> dict[str, InBearings]:
    """Shafts on bearings by name, with their motion against the seats.

    motions      of the shafts, as in `motions_on_bearings`
    of_housing   (n, m) coordinates of the housing and their rates; None where no seat moves on its own
    """
    seats = motions_of_all_seats(model, motions, of_housing)
    by_name = {}
    for name, (shaft, q, q_t) in motions.items():
        elastic, moving = model.scene.elastic.get(name), positions_on([*seats], shaft)
        measured: Measured | None = elastic
        if moving:
            measured = AgainstSeats(shaft, elastic, q.shape[1], moving)
            of_seats = [seats[name, axial] for axial in moving]
            q, q_t = np.hstack([q, *(x.q for x in of_seats)]), np.hstack([q_t, *(x.q_t for x in of_seats)])
        by_name[name] = InBearings(shaft, q, q_t, measured)
    return by_name


def motions_of_all_seats(
    model: Model, motions: Motions, of_housing: tuple[np.ndarray, np.ndarray] | None
) -> dict[tuple[str, float], SeatMotion]:
    """Motion of all seats that move or yield; arguments of `against_seats`."""
    seats = {}
    if coupling := coupling_of(model.gearbox, model.scene):
        q, q_t = ((coupling.seat_motion @ x).T for x in seat_motions(coupling, motions, model.scene))
        for name, (shaft, *_) in motions.items():
            for axial in shaft.bearings:
                if (number := seat_number(coupling.housing, name, axial)) is not None:
                    part = slice(6 * number, 6 * number + 6)
                    seats[name, axial] = SeatMotion(q[:, part], q_t[:, part])
    if of_housing is None:
        return seats
    return seats | motions_of_seats(model.gearbox, model.scene, model.seats, motions, of_housing)


def replace_forces_on_seats(model: Model, motions: Motions, forces: np.ndarray) -> None:
    """Put the forces (n_bearing, 3 or 5, n) of bearings whose seats yield without coordinates of their own."""
    coupling = coupling_of(model.gearbox, model.scene)
    if coupling is None:
        return
    of_seats = forces_on_seats(coupling, *seat_motions(coupling, motions, model.scene))
    bearings = [(name, axial) for name, (shaft, *_) in motions.items() for axial in shaft.bearings]
    for row, bearing in enumerate(bearings):
        if (seat := seat_number(coupling.housing, *bearing)) is not None:
            forces[row] = of_seats[6 * seat : 6 * seat + forces.shape[1]]


@dataclass
class BearingForces:
    """Forces of all bearings on their shafts over the samples of a run, computed while the samples come.

    samples    number of samples of the whole run
    moments    whether moments about x and y are computed, too
    computed   number of those of which the forces are computed
    """

    model: Model
    samples: int
    moments: bool = False
    computed: int = 0

    @cached_property
    def shafts(self) -> list[Shaft]:
        """Those on bearings."""
        return [shaft for shaft in self.model.gearbox.shafts if self.model.plan.shafts[shaft.name].on_bearings]

    @cached_property
    def values(self) -> np.ndarray:
        """(n_bearing, 3, samples) [N], or 5 with moments [N m]; 0 until computed."""
        number = sum(len(shaft.bearings) for shaft in self.shafts)
        return np.zeros((number, 5 if self.moments else 3, self.samples))

    @one_thread()
    def extend(self, number: int) -> None:
        """Compute the forces up to a number of samples."""
        spins = {shaft.name: spin_of_cages(self.model, shaft) for shaft in self.shafts}
        for first in range(self.computed, number, PART):
            self._compute(slice(first, min(first + PART, number)), spins)
        self.computed = max(self.computed, number)

    def _compute(self, part: slice, spins: Mapping[str, Mapping[float, np.ndarray]]) -> None:
        """Compute the forces in a part of the samples; spins: of rolling cages by shaft and axial position."""
        on_bearings, last = motions_on_bearings(self.model, part), 0
        for name, moved in motion_in_bearings(self.model, on_bearings, part).items():
            first, last = last, last + len(moved.shaft.bearings)
            of_cages = {axial: spin[part] for axial, spin in spins[name].items()}
            bearing_forces(moved.shaft, moved.q, moved.q_t, self.values[first:last, :, part], moved.measured, of_cages)
        replace_forces_on_seats(self.model, on_bearings, self.values[:, :, part])

    def variables(self, number: int, displacement: bool) -> dict[str, Any]:
        """The forces over a number of samples; empty where no shaft is on bearings.

        displacement   whether the displacements of the shafts at their bearings are computed too
        """
        if not self.shafts:
            return {}
        self.extend(number)
        motions = self._motions if displacement or self._rolling else {}
        labels = [f"{shaft.name} at {axial / mm:g} mm" for shaft in self.shafts for axial in shaft.bearings]
        over, about = ("bearing", "direction", "time"), {"units": "N", "long_name": "force of the bearing on its shaft"}
        data: dict[str, Any] = {"bearing_force": (over, self.values[:, :3, :number], about)}
        if self.moments:
            about = {"units": "N m", "long_name": "moment of the bearing on its shaft about x and y"}
            data["bearing_moment"] = ("bearing", "tilt", "time"), self.values[:, 3:, :number], about
            data["tilt"] = "tilt", ["x", "y"]
        if displacement:
            about = {"units": "m", "long_name": "displacement of the shaft in the bearing"}
            displaced, last = np.empty((len(labels), 3, number)), 0
            for moved in motions.values():
                first, last = last, last + len(moved.shaft.bearings)
                bearing_displacements(moved.shaft, moved.q, displaced[first:last], moved.measured)
            data["bearing_displacement"] = over, displaced, about
            data |= self._tilts(motions)
        data |= self._parted(motions, labels, number)
        return data | {"bearing": ("bearing", labels), "direction": ("direction", ["x", "y", "z"])}

    @property
    def _rolling(self) -> bool:
        """Whether there are rolling bearings."""
        return any(isinstance(x, RollingBearing) for shaft in self.shafts for x in shaft.bearings.values())

    @property
    def _motions(self) -> dict[str, InBearings]:
        """Shafts with their recorded motion against the seats."""
        return motion_in_bearings(self.model, motions_on_bearings(self.model))

    def _parted(self, motions: dict[str, InBearings], labels: list[str], number: int):
        """Share of the samples in which bearings have lost their axial force, with a warning; empty where none has."""
        shares, last = dict.fromkeys(labels, 0.0), 0
        for name, moved in motions.items():
            first, last = last, last + len(moved.shaft.bearings)
            forces = self.values[first:last, :, :number]
            for axial, lost in parted_bearings(moved.shaft, moved.q[:number], forces, moved.measured).items():
                shares[f"{name} at {axial / mm:g} mm"] = float(lost.mean())
        told = {label: f"{share:.2g} of the samples" for label, share in shares.items() if share}
        if not told:
            return {}
        warn_user(
            f"rings of bearings with a contact angle part, their axial force is lost: {told}; from then on their balls "
            "press where rings have no shoulder, or nothing carries. Preload them in pairs, turn them by direction=, "
            "or load them along their axis"
        )
        about = {"units": "1", "long_name": "share of the samples in which the axial force of the bearing is lost"}
        return {"bearing_parted": ("bearing", [*shares.values()], about)}

    def _tilts(self, motions: dict[str, InBearings]) -> dict[str, Any]:
        """Tilts of the shafts at all bearings, which loads on rolling elements need; empty without such bearings."""
        if not self._rolling:
            return {}
        tilts = [bearing_tilts(moved.shaft, moved.q, moved.measured) for moved in motions.values()]
        about = {"units": "rad", "long_name": "tilt of the shaft in the bearing"}
        return {
            "bearing_tilt": (("bearing", "tilt", "time"), np.concatenate(tilts), about),
            "tilt": ("tilt", ["x", "y"]),
        }


def drag_variables(model: Model) -> dict[str, Any]:
    """Torques of the drags of all shafts and the power that they dissipate; empty where no shaft has a drag.

    Drags between shafts drive the one that carries the seat: its part of the loss is negative, the sum of both is not.
    """
    shafts = model.gearbox.shafts
    if not any(shaft.drags for shaft in shafts):
        return {}
    speeds = recorded(model, "speed")
    torque = np.array([_drag_torque(model, shaft) for shaft in shafts])
    loss = torque * np.array([speeds[shaft.name] for shaft in shafts])
    braking = "torque of the drag of the shaft, against its motion at positive speed"
    return {
        "drag_torque": (("shaft", "time"), torque, {"units": "N m", "long_name": braking}),
        "drag_loss": (("shaft", "time"), loss, {"units": "W", "long_name": "power that drag dissipates"}),
        "shaft": ("shaft", [shaft.name for shaft in shafts]),
    }


def _drag_torque(model: Model, shaft: Shaft) -> np.ndarray:
    """(n,) torque of the drags of a shaft against its sense of motion [N m]."""
    _, motion, _ = motions_on_bearings(model).get(shaft.name, (shaft, None, None))
    spins, elastic = spin_of_cages(model, shaft), model.scene.elastic.get(shaft.name)
    box, speeds = model.gearbox, recorded(model, "speed")
    torque = braking_torques(box.braked_on_ground[shaft.name], speeds[shaft.name], motion, elastic, spins)
    for carried, carrying, drag in box.drags_between:
        if shaft.name in (carried, carrying):
            against = box.directions[carried] * speeds[carried] - box.directions[carrying] * speeds[carrying]
            sense = box.directions[shaft.name] * (1 if shaft.name == carried else -1)
            torque = torque + sense * braking_torque(drag.terms, against, 0.0)
    return torque


def _unbalance_torque(model: Model, shaft: Shaft) -> np.ndarray:
    """(n,) torque of the unbalance of a shaft in its sense of motion [N m]; 0 on ideal joints."""
    direction = model.gearbox.directions[shaft.name]
    spin, speed = (direction * recorded(model, x)[shaft.name] for x in ("spin", "speed"))
    _, _, rates = motions_on_bearings(model).get(shaft.name, (shaft, None, None))
    elastic = model.scene.elastic.get(shaft.name)
    return np.zeros(spin.size) if rates is None else direction * unbalance_torques(shaft, spin, speed, rates, elastic)


def torque_variables(model: Model, conditions: Conditions, torques: ShaftTorques, time: np.ndarray) -> dict[str, Any]:
    """Torques of drives, with the motion, and of loads, against it, over the ends of shafts and time."""
    by_sense: dict[int, dict[str, np.ndarray]] = {1: {}, -1: {}}
    for number, imposed in enumerate(conditions.imposed):
        by_sense[imposed.sense][imposed.shaft] = imposed_torque(model, conditions, number, torques, time)
    for end in conditions.ends:
        by_sense[end.sense][end.name] = _applied_torque(model, conditions, end, torques, time)
    data: dict[str, Any] = {}
    for sense, (name, words) in {1: ("drive", "of the drive, with"), -1: ("load", "of the load, against")}.items():
        if by_sense[sense]:
            about = {"units": "N m", "long_name": f"torque {words} the motion of the shaft at positive speed"}
            data[f"{name}_torque"] = (f"{name}_end", "time"), rows(list(by_sense[sense].values())), about
            data[f"{name}_end"] = f"{name}_end", list(by_sense[sense])
    return data | _reactions(model)


def _reactions(model: Model) -> dict[str, Any]:
    """Torques of the housing on held shafts over the held shafts and time; empty where none is held."""
    box = model.gearbox
    held = [shaft for shaft in box.shafts if shaft.name in box.reaction_members]
    if not held:
        return {}
    about = {"units": "N m", "long_name": "torque of the housing on the held shaft, about z"}
    torques = rows([
        _torque_of_housing(model, shaft) if shaft.name in box.held else _support_torque(model, shaft) for shaft in held
    ])  # fmt: skip
    return {"reaction_torque": (("held_end", "time"), torques, about), "held_end": [shaft.name for shaft in held]}


def _torque_of_housing(model: Model, shaft: Shaft) -> np.ndarray:
    """(n,) torque of the housing on a held shaft about z [N m]; elastic rings turn on their supports."""
    torque = -mesh_torque(model, shaft)
    for name, carrier in model.gearbox.planets.items():
        planet = model.gearbox.ends[name]
        if carrier.name == shaft.name and planet.drags:  # which drive the pins of a carrier that stands
            torque -= model.gearbox.directions[name] * _drag_torque(model, planet)
    if ring := model.rings.get(shaft.name):
        meshes = [(i, mesh) for i, mesh in enumerate(model.meshes) if mesh.stage.slow.name == shaft.name]
        acting = []
        for number, mesh in meshes:
            pitch = 2 * np.pi / abs(mesh.stage.pair.wheel.z)
            start = model.gearbox.ring_angles[number] - pitch * model.gearbox.phases[number]
            acting.append((mesh.recorder.force, start + pitch * mesh.recorder.phase))
        accelerations = ring.elastic.accelerations(*ring.motion(torque.size), acting)
        sense = model.gearbox.flank_senses[meshes[0][0]]
        torque -= sense * (accelerations @ ring.elastic.modes["turning"].values)
    return torque


def rows(arrays: list[np.ndarray]) -> np.ndarray:
    """A contiguous matrix with the arrays as its rows; a single contiguous array is not copied."""
    return np.ascontiguousarray(arrays[0])[None] if len(arrays) == 1 else np.array(arrays)


def _applied_torque(model: Model, conditions: Conditions, end: ShaftEnd, torques: ShaftTorques, time) -> np.ndarray:
    """(n,) torque of an end [N m], > 0 as the user gives it."""
    if conditions.tables[end.name].constant:
        return np.full(time.size, float(conditions.tables[end.name](0.0, 0.0, 0.0)))
    samples = torques[end.body].recorder["torque"]
    return end.sense * model.gearbox.directions[end.shaft] * samples[: time.size]


def imposed_torque(
    model: Model, conditions: Conditions, number: int, torques: ShaftTorques, time: np.ndarray
) -> np.ndarray:
    """(n,) torque [N m] by which a drive imposes its speed, with the motion (against it for a load); number: of it.

    It accelerates the shaft against the torques of its meshes and its drag, or the rotor against that of the coupling.
    """
    shaft = model.gearbox.ends[conditions.held[number]]
    acceleration = conditions.speeds_of[number].slope(time)
    if rotor := shaft.end_rotor:
        by_coupling = _coupling_torque(model, conditions, number, rotor, torques, time)
        torque = rotor.coupling.inertia * acceleration + by_coupling
    else:
        torque = mesh_torque(model, shaft)
        np.subtract(model.gearbox.body_inertias[shaft.name] * acceleration, torque, out=torque)
        if shaft.drags or model.gearbox.drags_between:
            torque += _drag_torque(model, shaft)
        if shaft.unbalances:
            torque -= _unbalance_torque(model, shaft)
    torque *= conditions.imposed[number].sense
    return torque


def mesh_torque(model: Model, shaft: Shaft) -> np.ndarray:
    """(n,) torque of all meshes on a shaft in its sense of motion [N m].

    A carrier bears those on its gears, by elastic pins by the torques of these.
    """
    number = model.meshes[0].recorder.deflection.size
    torques = [pin.recorder.samples["torque"][:number] for pin in model.pins if pin.carrier.name == shaft.name]
    for mesh in model.meshes:
        on_pinion, on_wheel, stage = mesh.recorder.pinion_torque, mesh.recorder.wheel_torque, mesh.stage
        if shaft.name in (stage.fast.name, stage.slow.name):
            torques.append(on_pinion if shaft.name == stage.fast.name else on_wheel)
        elif stage.carrier and shaft.name == stage.carrier.name and shaft.name not in model.gearbox.carriers_of_pins:
            torques.append(mesh.recorder.samples.get("torque_3", -on_pinion - on_wheel))
    return model.gearbox.directions[shaft.name] * sum(torques[1:], start=torques[0])


def _support_torque(model: Model, shaft: Shaft) -> np.ndarray:
    """(n,) torque of the torque supports of a shaft on it, about z [N m]."""
    spin, speed = (model.gearbox.directions[shaft.name] * recorded(model, x)[shaft.name] for x in ("spin", "speed"))
    return -np.sum([x.torsion * (spin + x.damping_time * speed) for x in shaft.torque_supports], axis=0)


def _coupling_torque(
    model: Model, conditions: Conditions, number: int, rotor: Rotor, torques: ShaftTorques, time: np.ndarray
) -> np.ndarray:
    """(n,) torque of the coupling of a held rotor on the body that bears it, in the sense of motion [N m]."""
    held, speed_of = conditions.held[number], conditions.speeds_of[number]
    if rotor.body == held:
        spin, speed = (recorded(model, quantity)[held] for quantity in ("spin", "speed"))
    else:
        recorder, direction = torques[rotor.body].recorder, model.gearbox.directions[held]
        spin, speed = (direction * recorder[name][: time.size] for name in ("angle", "speed"))
    angle = conditions.imposed[number].start_angle + speed_of.integral(time)
    coupling = rotor.coupling
    return coupling.torsion * (angle - spin) + coupling.damping * (speed_of(time) - speed)
