"""Static equilibrium of a built gearbox under its load, from which a run starts."""

from collections.abc import Mapping
from math import isfinite

import numpy as np

from exugear.contact.reference_configuration import is_spatial
from exugear.gearbox.bearing_law import tangent_stiffness
from exugear.gearbox.gearbox import anchors_of, forces_of_motion
from exugear.multibody.carrier_turns import rigid_motion, turned_with_carriers, velocities_by_turning
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.first_order_statics import loaded_coordinates, state_of_mesh
from exugear.multibody.guarded_solves import exudyn_settings
from exugear.multibody.model import Model, by_shaft, moving_of
from exugear.multibody.planet_load_sharing import shared_among_planets
from exugear.multibody.solve_errors import NO_EQUILIBRIUM, STATIC_SOLVE_TIME, NoEquilibrium, explained
from exugear.multibody.static_loads import (
    applied_torques,
    held_between_teeth,
    softened_by_rotation,
    torques_at_start,
    with_centrifugal_forces,
)
from exugear.multibody.velocity_lag import lag_of
from exugear.operation.conditions import Conditions
from exugear.planning.coordinates import Coordinates
from exugear.planning.integrator_and_step import Rule
from fem.units import um

#: Residual of a static solve that counts as 0 [N, N m], and the rounding of its coordinates in units in the last place.
ABSOLUTE_TOLERANCE, ROUNDED_UNITS = 1e-10, 10
#: Share of a map's largest force below which the mesh force by inertia torques is neglected.
LEAST_INERTIA_SHARE = 1e-6


def solve_initial_equilibrium(model: Model, conditions: Conditions, rule: Rule | None = None) -> None:
    """Put the system into static equilibrium under the torques at the start, all shafts turning at their ratios.

    rule   of the integrator of a run: velocities of orbiting planets start with its lag, without which they begin to
           vibrate

    The inertia torques of all shafts and rotors at the initial acceleration take part in the equilibrium. Their
    gyroscopic moments do not, as the axes stand still, tilted by some 1e-4 rad. Raises NoEquilibrium.
    """
    accelerations, system = conditions.initial_accelerations, model.bare_mbs.systemData
    speeds = by_shaft(model, conditions.initial_speeds)
    loading = accelerations if _inertia_matters(model, conditions) else 0.0 * accelerations
    q = _to_first_order(model, conditions, loading)
    unloaded: list[str] = []
    if _needs_static_solve(model):
        if model.gearbox.planets:
            q, unloaded = shared_among_planets(model, q, conditions, loading)
            q = turned_with_carriers(model, q)
        torques = torques_at_start(model, conditions, rigid_motion(model, q, loading))
        torques = {i: x for i, x in torques.items() if i not in [model.spins[name] for name in unloaded]}
        held_in_gaps = held_between_teeth(model, q, unloaded)
        with model.drive_items.holding(), softened_by_rotation(model, speeds), held_in_gaps:
            q = _statically_solved(model, q, conditions, with_centrifugal_forces(model, torques, speeds))
    velocities = rigid_motion(model, q, conditions.initial_speeds)
    system.SetODE2Coordinates(q, INITIAL)
    centripetal = velocities_by_turning(model, velocities, speeds)
    system.SetODE2Coordinates_t(velocities + lag_of(rule) * velocities_by_turning(model, centripetal, speeds), INITIAL)
    at_start = rigid_motion(model, q, accelerations) + centripetal
    for name in unloaded:
        drag = conditions.initial_drags[[shaft.name for shaft in model.gearbox.shafts].index(name)]
        at_start[model.spins[name]] = drag / model.gearbox.body_inertias[name]
    system.SetODE2Coordinates_tt(at_start, INITIAL)


def _to_first_order(model: Model, conditions: Conditions, accelerations: np.ndarray) -> np.ndarray:
    """`loaded_coordinates` at accelerations (n_shaft,) [rad/s^2]; errors name these as a cause."""
    try:
        return loaded_coordinates(model, conditions, accelerations)
    except NoEquilibrium as error:
        acceleration = accelerations[model.gearbox.shafts.index(model.gearbox.driving)]
        inertia = f"it includes inertia torques at {acceleration:.4g} rad/s^2"
        remedy = f"; {inertia}: let the speed rise more slowly at the start" if accelerations.any() else ""
        raise NoEquilibrium(f"{error}{remedy}") from None


def _inertia_matters(model: Model, conditions: Conditions) -> bool:
    """Whether inertia loads a mesh by more than a static solve can resolve."""
    box, accelerations = model.gearbox, conditions.initial_accelerations
    anchors = anchors_of(box, box.independent)
    forces = np.abs(forces_of_motion(box, np.zeros(len(box.shafts)), accelerations, anchors))
    return any(
        f > LEAST_INERTIA_SHARE * mesh.law.force_table.max() for f, mesh in zip(forces, model.meshes, strict=True)
    )


def _needs_static_solve(model: Model) -> bool:
    """Whether bearings, couplings, loops or several meshes need a static solve for the equilibrium.

    Between two meshes a shaft bears the torque by which the potential of a mesh changes with the phase.
    """
    elastic = any(kind.on_bearings for kind in model.plan.shafts.values())
    return elastic or bool(model.rotor_spins) or len(model.meshes) > 1


def _statically_solved(model: Model, q: np.ndarray, conditions: Conditions, torques: Mapping[int, float]) -> np.ndarray:
    """Coordinates in equilibrium with further torques [N m] on spins, by their indices; the solve starts at q."""
    system = model.bare_mbs.systemData
    settings = exudyn_settings()
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.newton.absoluteTolerance = max(ABSOLUTE_TOLERANCE, _rounding_of_forces(model, q))
    settings.staticSolver.loadStepStart = conditions.start_time
    settings.staticSolver.loadStepDuration = STATIC_SOLVE_TIME

    def cause() -> str:
        return jammed(model, _thrown_outwards(model, q, torques)) or _loose(model, q) or NO_EQUILIBRIUM

    at_start = explained(model, cause, lambda t: conditions.initial_speed, NoEquilibrium)
    with applied_torques(model, torques), at_start:
        system.SetODE2Coordinates(q, INITIAL)
        system.SetODE2Coordinates_t(np.zeros(q.size), INITIAL)
        model.bare_mbs.SolveStatic(settings, updateInitialValues=True)
        return system.GetODE2Coordinates(INITIAL)


def _thrown_outwards(model: Model, q: np.ndarray, torques: Mapping[int, float]) -> np.ndarray:
    """Coordinates q with planets displaced on their pins alone by their centrifugal forces, among further torques."""
    thrown = q.copy()
    for pin in model.pins:
        first = moving_of(model, pin.planet.name).start
        thrown[first : first + 2] += [torques.get(i, 0.0) / pin.stiffness[0, 0] for i in (first, first + 1)]
    return thrown


def jammed(model: Model, q: np.ndarray) -> str:
    """The mesh whose backlash displaced gears use up most at coordinates q, and the remedy; "" where none does."""
    gaps = {}
    for mesh in model.meshes:
        if isfinite(mesh.law.backlash) and is_spatial(mesh.frame):
            gaps[mesh.stage.name] = mesh.law.backlash + 2 * state_of_mesh(model, mesh, q).opening, mesh.law.backlash
    name = min(gaps, key=lambda x: gaps[x][0], default="")
    if not name or gaps[name][0] >= 0:
        return ""
    gap, backlash = gaps[name]
    moved = f"forces move gears of {name} so close that their backlash of {backlash / um:.4g} um is used up"
    both = "a tooth would touch both flanks"
    enough = (
        f"stiffer pins or bearings, or a backlash above {(backlash - gap) / um:.3g} um (Gear(s_n=...), backlash=...)"
    )
    return f"{moved}, {both}; take {enough}, less load or speed, or let it rise more slowly"


def _loose(model: Model, q: np.ndarray) -> str:
    """The rigid shaft whose bearings do not hold it along its axis or against tilting at coordinates q, and the remedy.

    "" where all are held, as by balls that are pressed.
    """
    for shaft in model.gearbox.shafts:
        kind, spin = model.scene.shafts[shaft.name], model.spins[shaft.name]
        if kind is not Coordinates.BEARINGS or shaft.name in {*model.gearbox.planets, *model.elastics}:
            continue
        on_body = q[spin - kind.spin_index : spin + 1]
        stiffness = sum(tangent_stiffness(x, axial - shaft.centre, on_body) for axial, x in shaft.bearings.items())
        if not np.diag(stiffness)[2:5].all():
            loose = f"no static equilibrium: bearings of {shaft.name!r} with play or without load leave it loose"
            return f"{loose} along its axis or in tilt; give one a preload (clearance < 0) or a linear Bearing"
    return ""


def _rounding_of_forces(model: Model, q: np.ndarray) -> float:
    """Mesh force by a few units in the last place of the coordinates q, which is large after many turns [N].

    Of sets also by those of the positions of the planets: their solve starts so near that this is all that is left.
    """
    largest = max(mesh.law.stiffness_max * np.abs(mesh.row).max() for mesh in model.meshes)
    positions = max(m.law.stiffness_max * np.spacing(abs(m.stage.pair.a)) for m in model.meshes)
    by_positions = positions if model.gearbox.planets else 0.0
    return ROUNDED_UNITS * float(max(largest * np.spacing(np.abs(q).max()), by_positions))
