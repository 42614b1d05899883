"""The variables of a run about power: in and out of its ends, losses, and stored energy.

The rates of the recorded motion are the true ones (`exugear.multibody.velocity_lag`).
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from exugear.gearbox.elastic_housing import ElasticHousing
from exugear.gearbox.housing import seat_label
from exugear.gearbox.shaft_dynamics import (
    ShaftMotion,
    bearing_energy,
    bearing_losses,
    coupling_energy,
    coupling_losses,
    elastic_loss,
    kinetic_energy,
)
from exugear.multibody.drive_and_load import ShaftTorques, is_known_function_of_time
from exugear.multibody.elastic_rings import BuiltRing
from exugear.multibody.elastic_shafts import BuiltShaft
from exugear.multibody.housing import coupling_of, seat_motions
from exugear.multibody.model import Model, is_first, on_bearings
from exugear.multibody.moving_seats import motions_of_seats, positions_on
from exugear.multibody.shaft_motion import spin_of_cages
from exugear.multibody.velocity_lag import true_rates_by
from exugear.operation.conditions import Conditions
from exugear.planning.integrator_and_step import Rule
from fem.units import mm

#: Ends of shafts by name of their torques in the data: the name of their powers, and words for it.
ENDS = {"drive": ("power_in", "into the gearbox by the drive"), "load": ("power_out", "out of the gearbox by the load")}
#: From rates (n, ...) of the integrator to true ones.
TrueRates = Callable[[np.ndarray], np.ndarray]


def power_variables(
    model: Model, conditions: Conditions, torques: ShaftTorques, data: xr.Dataset, rule: Rule
) -> dict[str, Any]:
    """Powers [W] and energies [J] over time, from the recorded motion and the torques in the data of a run.

    rule   of the integrator
    """
    time = data["time"].values
    true_rates = true_rates_by(rule, time)
    motions, rings = shaft_motions(model, conditions, torques, time, true_rates), ring_motions(model, time, true_rates)
    housing = housing_motion(model, time, true_rates)
    of_all = _on_seats(model, motions, housing), rings, housing
    return _powers(model, motions, data) | _losses(model, *of_all) | _energies(model, *of_all)


class RingMotion(NamedTuple):
    """An elastic ring with its amplitudes (n, m) and their rates over time."""

    ring: BuiltRing
    amplitudes: np.ndarray
    rates: np.ndarray


def ring_motions(model: Model, time: np.ndarray, true_rates: TrueRates) -> dict[str, RingMotion]:
    """Motion of each elastic ring by the name of its shaft; true_rates: of those of the integrator."""
    motions = {name: (ring, *ring.motion(time.size)) for name, ring in model.rings.items()}
    return {name: RingMotion(ring, a, true_rates(v)) for name, (ring, a, v) in motions.items()}


class HousingMotion(NamedTuple):
    """Coordinates (n, m) of a housing that has its own, and their rates."""

    housing: ElasticHousing
    q: np.ndarray
    q_t: np.ndarray

    @property
    def loss(self) -> np.ndarray:
        """(n,) power that its damping dissipates [W]."""
        return _forms(self.q_t.T, self.housing.damping)

    @property
    def energies(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) kinetic and strain energy [J]."""
        return 0.5 * _forms(self.q_t.T, self.housing.mass), 0.5 * _forms(self.q.T, self.housing.stiffness)


def housing_motion(model: Model, time: np.ndarray, true_rates: TrueRates) -> HousingMotion | None:
    """Recorded motion of a housing with coordinates; true_rates: of those of the integrator."""
    if model.seats is None or model.seats.housing is None:
        return None
    q, q_t = model.seats.motion(time.size)
    return HousingMotion(model.seats.housing, q, true_rates(q_t))


def _on_seats(
    model: Model, motions: Mapping[str, ShaftMotion], of_housing: HousingMotion | None
) -> dict[str, ShaftMotion]:
    """The motions of shafts with those of their seats that move."""
    if model.seats is None:
        return dict(motions)
    shafts = {shaft.name: shaft for shaft in model.gearbox.shafts}
    moving = {
        name: (shafts[name], motion.q, motion.q_t)
        for name, motion in motions.items()
        if name in shafts and motion.q is not None and motion.q_t is not None
    }
    none = np.zeros((0, 0))
    of_seats = (of_housing.q, of_housing.q_t) if of_housing else (none, none)
    seats = motions_of_seats(model.gearbox, model.scene, model.seats, moving, of_seats)
    on_seats = {
        name: replace(motions[name], seats={x: seats[name, x] for x in positions_on([*seats], shaft)})
        for name, (shaft, *_) in moving.items()
    }
    return {**motions, **on_seats}


def _powers(model: Model, motions: Mapping[str, ShaftMotion], data: xr.Dataset) -> dict[str, Any]:
    """Power of the torque on each end."""
    variables: dict[str, Any] = {}
    for kind, (name, words) in ENDS.items():
        if f"{kind}_torque" in data:
            ends = data[f"{kind}_end"].values.tolist()
            speeds = [_end_speed(model, motions, end) for end in ends]
            about = {"units": "W", "long_name": f"power {words}"}
            variables[name] = (f"{kind}_end", "time"), data[f"{kind}_torque"].values * np.array(speeds), about
    return variables


def _end_speed(model: Model, motions: Mapping[str, ShaftMotion], end: str) -> np.ndarray:
    """(n,) speed [rad/s] in its sense of motion of what a drive or load acts on, by the name of a shaft or rotor."""
    shaft = model.gearbox.ends[end]
    body = shaft.end if end == shaft.name else end
    return motions[body].speed * model.gearbox.directions[shaft.name]


def _losses(
    model: Model,
    motions: Mapping[str, ShaftMotion],
    rings: Mapping[str, RingMotion],
    housing: HousingMotion | None,
) -> dict[str, Any]:
    """Power that damping dissipates in meshes, bearings and couplings."""
    meshes = np.array([mesh.recorder.power["dissipation"] for mesh in model.meshes])
    bearings = {
        f"{shaft.name} at {axial / mm:g} mm": loss
        for shaft in model.gearbox.shafts
        for axial, loss in bearing_losses(shaft, motions[shaft.name]).items()
    }
    couplings = {name: loss for shaft in model.gearbox.shafts for name, loss in coupling_losses(shaft, motions).items()}
    ends = {shaft.name: shaft for shaft in model.gearbox.shafts if shaft.name in model.elastics and shaft.twist}
    towards_ends = {
        name: couplings.pop(name if len(shaft.rotors) == 1 else shaft.end_name) for name, shaft in ends.items()
    }
    couplings |= {
        f"{shaft.name} torque support": sum(x.torsion * x.damping_time for x in shaft.torque_supports) * speed**2
        for shaft, speed in ((shaft, motions[shaft.name].speed) for shaft in model.gearbox.shafts)
        if shaft.torque_supports
    }
    on_seats = losses_on_housing(model, motions)
    couplings |= {name: on_seats.pop(name) for name in ("housing",) if name in on_seats}
    bearings |= on_seats
    couplings |= {"housing": housing.loss} if housing else {}
    for name in model.elastics:
        couplings[f"{name} shaft"] = elastic_loss(motions[name]) + towards_ends.get(name, 0.0)
    couplings |= {f"{name} rim": ring.elastic.loss(rates) for name, (ring, _, rates) in rings.items()}
    about = {"units": "W", "long_name": "power that damping dissipates"}
    variables: dict[str, Any] = {"mesh_loss": (("stage", "time"), meshes, about)}
    for kind, losses in {"bearing": bearings, "coupling": couplings}.items():
        if losses:
            variables[f"{kind}_loss"] = (kind, "time"), np.array(list(losses.values())), about
            variables[kind] = kind, list(losses)
    return variables


def _at_seats(model: Model, motions: Mapping[str, ShaftMotion]) -> tuple[Any, np.ndarray, np.ndarray] | None:
    """Coupling of bearings and housing, and motions and rates (6 n, samples) of the shafts at its seats."""
    coupling = coupling_of(model.gearbox, model.scene)
    if coupling is None:
        return None
    shafts = {shaft.name: shaft for shaft in model.gearbox.shafts}
    moving = {
        name: (shafts[name], motion.q, motion.q_t)
        for name, motion in motions.items()
        if name in shafts and motion.q is not None and motion.q_t is not None
    }
    return coupling, *seat_motions(coupling, moving, model.scene)


def losses_on_housing(model: Model, motions: Mapping[str, ShaftMotion]) -> dict[str, np.ndarray]:
    """(n,) power [W] that each bearing on a seat dissipates, and the housing; empty without a housing."""
    at_seats = _at_seats(model, motions)
    if at_seats is None:
        return {}
    coupling, _, rates = at_seats
    against, losses = coupling.against_seats @ rates, {}
    for i, seat in enumerate(coupling.housing.seats):
        part = slice(6 * i, 6 * i + 6)
        losses[seat_label(seat)] = _forms(against[part], coupling.damping[part, part])
    losses["housing"] = coupling.housing.damping_time * _forms(rates, coupling.of_housing)
    return losses


def energy_by_housing(model: Model, motions: Mapping[str, ShaftMotion]) -> np.ndarray | float:
    """(n,) energy [J] of bearings on seats and the housing beyond that of these bearings on ground: < 0."""
    at_seats = _at_seats(model, motions)
    if at_seats is None:
        return 0.0
    coupling, moved, _ = at_seats
    return 0.5 * _forms(moved, coupling.stiffness - coupling.bearings)


def _forms(vectors: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(n,) quadratic forms of vectors (k, n)."""
    return np.einsum("in,ij,jn->n", vectors, matrix, vectors)


def _energies(
    model: Model,
    motions: Mapping[str, ShaftMotion],
    rings: Mapping[str, RingMotion],
    housing: HousingMotion | None,
) -> dict[str, Any]:
    """Kinetic energy, and strain energy of meshes, bearings and couplings together."""
    meshes = np.sum([mesh.recorder.power["energy"] for mesh in model.meshes], axis=0)
    shafts = model.gearbox.shafts
    inertias = model.gearbox.body_inertias
    kinetic = np.sum([kinetic_energy(shaft, motions, inertias[shaft.name]) for shaft in shafts], axis=0)
    elastic = np.sum(
        [bearing_energy(shaft, motions[shaft.name]) + coupling_energy(shaft, motions) for shaft in shafts], 0
    )
    elastic = elastic + energy_by_housing(model, motions)
    of_housing = housing.energies if housing else (0.0, 0.0)
    moving = of_housing[0] + sum(ring.elastic.kinetic_energy(rates) for ring, _, rates in rings.values())
    bent = of_housing[1] + sum(ring.elastic.strain_energy(amplitudes) for ring, amplitudes, _ in rings.values())
    energies = {
        "kinetic_energy": (kinetic + moving, "kinetic energy of shafts, rotors, elastic rings, housing"),
        "strain_energy": (
            meshes + elastic + bent,
            "energy of meshes, bearings, couplings, elastic shafts, rings and housing",
        ),
    }
    return {name: ("time", x, {"units": "J", "long_name": words}) for name, (x, words) in energies.items()}


def shaft_motions(
    model: Model, conditions: Conditions, torques: ShaftTorques, time: np.ndarray, true_rates: TrueRates
) -> dict[str, ShaftMotion]:
    """Motion of each shaft by its name, and of each rotor by its own; true_rates: of those of the integrator."""
    by_name = {}
    for mesh in model.meshes:
        for side, shaft in enumerate(mesh.stage.shafts):
            if shaft.name in model.gearbox.carriers_of_pins:
                continue
            samples = mesh.recorder.power
            spin, speed = samples[f"spin_{side + 1}"], true_rates(samples[f"speed_{side + 1}"])
            q, q_t = mesh.recorder.motion(side) if side < 2 and on_bearings(model, mesh) else (None, None)
            moves = q is not None and model.plan.shafts[shaft.name].on_bearings
            rates = true_rates(np.asarray(q_t, float)) if moves else None
            if not is_first(model, mesh.stage, shaft):
                continue
            positions = np.asarray(q, float) if moves else None
            by_name[shaft.name] = ShaftMotion(spin, speed, positions, rates)
            if built := model.elastics.get(shaft.name):
                amplitudes, velocities = (x.astype(float) for x in built.motion(time.size))
                by_name[shaft.name] = _elastic(by_name[shaft.name], built, amplitudes, true_rates(velocities))
    by_name |= _motions_on_pins(model, by_name, time.size, true_rates)
    for name in model.rotor_spins:
        recorder = torques[name].recorder
        spin, speed = recorder["angle"][: time.size], recorder["speed"][: time.size]
        by_name[name] = ShaftMotion(spin, true_rates(speed))
    by_name |= _imposed_motion(model, conditions, time, by_name)
    for name, built in model.elastics.items():
        held = name in conditions.held and is_known_function_of_time(model)
        by_name[name] = _with_torsion(model, built, by_name, time.size, true_rates, held=held)
    for shaft in model.gearbox.shafts:
        if cages := spin_of_cages(model, shaft):
            by_name[shaft.name] = replace(by_name[shaft.name], cages=cages)
    return by_name


def _elastic(motion: ShaftMotion, built: BuiltShaft, amplitudes: np.ndarray, rates: np.ndarray) -> ShaftMotion:
    """The motion of a shaft with its recorded elastic coordinates (n, m + n_torsion) and their rates."""
    elastic, m = built.elastic, built.elastic.elastic
    twists = amplitudes[:, m:], rates[:, m:]
    if motion.q is None or motion.q_t is None:
        return replace(motion, elastic=elastic, twists=twists[0], twist_rates=twists[1])
    q, q_t = elastic.decoupled(motion.q, amplitudes[:, :m]), elastic.decoupled(motion.q_t, rates[:, :m])
    return replace(motion, q=q, q_t=q_t, elastic=elastic, twists=twists[0], twist_rates=twists[1])


def _with_torsion(
    model: Model,
    built: BuiltShaft,
    motions: Mapping[str, ShaftMotion],
    number: int,
    true_rates: TrueRates,
    *,
    held: bool,
) -> ShaftMotion:
    """The motion of an elastic shaft with all coordinates of its torsion; held: the motion of its end is imposed."""
    shaft, motion = built.elastic.shaft, motions[built.elastic.shaft.name]
    angles, speeds = {shaft.stations[0]: motion.spin}, {shaft.stations[0]: motion.speed}
    for mesh in model.meshes:
        for side, (name, axial) in enumerate(mesh.stage.ends, start=1):
            if name == shaft.name and axial not in angles:
                samples = mesh.recorder.power
                angles[axial] = samples[f"spin_{side}"]
                speeds[axial] = true_rates(samples[f"speed_{side}"])
    turned, turning = ([of[axial] for axial in shaft.stations] for of in (angles, speeds))
    torsion = built.elastic.torsion
    beside = (torsion.held_mass if held else torsion.mass).copy()
    beside[0, 0] -= shaft.body_inertia
    if shaft.twist:
        end = motions[shaft.end_name]
        turned, turning = [*turned, end.spin], [*turning, end.speed]
        beside[len(shaft.stations), len(shaft.stations)] -= 0.0 if held else shaft.twist.inertia
    amplitudes, velocities = np.asarray(motion.twists), np.asarray(motion.twist_rates)
    twists = np.column_stack([np.reshape(turned, (-1, number)).T - motion.spin[:, None], amplitudes])
    rates = np.column_stack([np.reshape(turning, (-1, number)).T, velocities])
    damping = torsion.held_damping if held else torsion.damping
    return replace(motion, twists=twists, twist_rates=rates, beside=beside, twist_damping=damping)


def _motions_on_pins(
    model: Model, recorded: Mapping[str, ShaftMotion], number: int, true_rates: TrueRates
) -> dict[str, ShaftMotion]:
    """Motion of planets on pins and of their carriers; recorded: the spins of the planets by their meshes."""
    by_name = {}
    for pin in model.pins:
        recorder, samples = pin.recorder, {name: x[:number] for name, x in pin.recorder.samples.items()}
        rates = recorder.deflection(number, rate=True), recorder.velocity(number), recorder.centre(number, rate=True)
        w, velocity, of_carrier = (_padded(true_rates(rate)) for rate in rates)
        planet, on_bearings = recorded[pin.planet.name], model.plan.shafts[pin.carrier.name].on_bearings
        deflection, tilt_y = _padded(recorder.deflection(number)), samples.get("planet_tilt_y")
        by_name[pin.planet.name] = ShaftMotion(planet.spin, planet.speed, deflection, w, velocity, tilt_y)
        moving = (_padded(recorder.centre(number)), of_carrier) if on_bearings else ()
        by_name[pin.carrier.name] = ShaftMotion(samples["spin"], true_rates(samples["speed"]), *moving)
    return by_name


def _padded(columns: np.ndarray) -> np.ndarray:
    """(n, 5) of (n, 2 or 5): no axial displacement and no tilts in the plane."""
    return np.column_stack([columns, np.zeros((len(columns), 5 - columns.shape[1]))])


def _imposed_motion(model: Model, conditions: Conditions, time: np.ndarray, recorded: Mapping[str, ShaftMotion]):
    """The motions of the shafts or rotors whose speeds are imposed, with these speeds."""
    motions = {}
    for name, speed_of in zip(conditions.held, conditions.speeds_of, strict=True):
        end, speed = model.gearbox.ends[name].end, model.gearbox.directions[name] * speed_of(time)
        motions[end] = replace(recorded[end], speed=speed * np.ones(time.size))
    return motions
