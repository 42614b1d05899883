"""What contacts learn of the steps of an integrator: the lag of its velocities, and the data of the predictor."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from exugear.gearbox.mesh_damping import mean_stiffness
from exugear.multibody.addresses import floats_of
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.gear_contact import state_of
from exugear.multibody.integrator_steps import STEPS
from exugear.multibody.model import BearingTangents, Mesh, Model, added_in_steps, bearing_tangents, on_body
from exugear.multibody.step_ends import changes_in_step, step_ends_of
from exugear.multibody.velocity_lag import lag_of
from exugear.planning.integrator_and_step import GAMMA, Rule


def set_predictor(
    model: Model, mesh: Mesh, rule: Rule, steps: np.record, bearings: BearingTangents, changes: np.ndarray
) -> None:
    """Set what the predictor of a contact needs in the steps of a rule (`exugear.multibody.integrator_steps.STEPS`).

    bearings   changes of stiffness and damping by nonlinear bearings at the start, where the linear system is stiffest:
               the predictor only uses the change of their forces in a step, so that an offset does not count
    changes    `changes_in_step` of the system
    """
    system, h = mesh.free_system, rule.step
    if system is None:
        return
    part = np.ix_(system.free, system.free)
    stiffness, damping = system.stiffness + bearings.stiffness[part], system.damping + bearings.damping[part]
    system = system._replace(stiffness=stiffness, damping=damping)
    steps.duration, steps.deflection, steps.rate, steps.matrix = h, rule.beta * h**2, GAMMA * h, 0.0
    row = mesh.row[system.free]
    matrix = system.mass + steps.deflection * system.stiffness + steps.rate * system.damping
    accelerations = np.linalg.solve(matrix, row)
    steps.compliance = row @ accelerations
    lag = lag_of(rule)
    steps.mobility, steps.lag = mesh.mobility if lag else 0.0, lag
    by_bearings = np.zeros((2, mesh.row.size))
    if mesh.stage.carrier and mesh.stage.carrier.name in model.gearbox.carriers_of_pins:
        # The directions in which pins and bearings push turn with the carrier: the guess leaves their forces out. It is
        # the acceleration expected of the bodies; without `STEP_ENDS` that of the last step, corrected by the mesh.
        _share_changes(model, mesh, changes)
        return
    by_bearings[:, system.free] = -system.stiffness @ accelerations, -system.damping @ accelerations
    of_system = np.zeros(mesh.row.size)
    of_system[system.free] = accelerations
    for i, shaft in enumerate((mesh.stage.fast, mesh.stage.slow)):
        if shaft.name in model.elastics:
            _let_shaft_predict(model, mesh, shaft.name, of_system)
            continue
        components = model.plan.shafts[shaft.name].components[:-1]
        by_displacement, by_velocity = (on_body(model, mesh.stage, shaft, forces) for forces in by_bearings)
        steps.by_displacement[i, components], steps.by_velocity[i, components] = by_displacement, by_velocity


def _share_changes(model: Model, mesh: Mesh, changes: np.ndarray) -> None:
    """Let the mesh of a planet that orbits share what its force changes in a step; changes: as for `set_predictor`."""
    address, system = state_of(model.bare_mbs, mesh.contact)["ends"], mesh.free_system
    numbers: list[int] = []
    for shaft in (mesh.stage.fast, mesh.stage.slow):
        spin = model.spins[shaft.name]
        numbers += range(spin - model.plan.shafts[shaft.name].spin_index, spin + 1)
    mobilities = np.zeros(mesh.row.size)
    mobilities[system.free] = 1 / np.diag(system.mass)
    for ends in step_ends_of(model.bare_mbs):
        if ends.address == address:
            ends.share(numbers, mobilities[numbers], changes)


def _let_shaft_predict(model: Model, mesh: Mesh, name: str, accelerations: np.ndarray) -> None:
    """Let the kernel of an elastic shaft compute what its own forces accelerate along the line of action of a mesh.

    accelerations   (n,) of the coordinates of the system by a unit mesh force, in a step
    """
    built, mbs = model.elastics[name], model.bare_mbs
    item, elastic = mbs.GetObject(built.number), built.elastic
    stiffness, damping = (np.array(item[x].Convert2DenseMatrix()) for x in ("stiffnessMatrix", "dampingMatrix"))
    if elastic.shaft.twist and elastic.end is not None:
        ends = np.ix_(*[[elastic.turning[0], elastic.end]] * 2)
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness[ends] += elastic.shaft.twist.torsion * between
        damping[ends] += elastic.shaft.twist.damping * between
    by_shaft = accelerations[built.indices]
    built.in_steps.rows[built.in_steps.contacts.index(mesh.contact)] = -np.concatenate(
        [by_shaft @ stiffness, by_shaft @ damping]
    )


@contextmanager
def lag_corrected(model: Model, rule: Rule, held: Sequence[str]) -> Iterator[None]:
    """Let contacts correct their damping for the lag of an integration rule's velocities; earlier steps are forgotten.

    Elastic shafts have the masses by which their modes keep their frequencies in these steps. In loops the correction
    leaves out the acceleration by the mesh force: there the load does not determine the mesh forces.

    held   names of the shafts whose speeds are imposed
    """
    with _shafts_in_steps(model, rule, held) as meshes:
        yield from _lag_corrected(model, meshes, rule)


@contextmanager
def _shafts_in_steps(model: Model, rule: Rule, held: Sequence[str]) -> Iterator[tuple[Mesh, ...]]:
    """Let elastic shafts keep their frequencies in the steps of the fourth-order rule; the meshes between them."""
    if not (model.elastics and lag_of(rule)):
        yield model.meshes
        return
    mbs, before, names = model.bare_mbs, {}, ("massMatrix", "dampingMatrix")
    try:
        for name, built in model.elastics.items():
            item = mbs.GetObject(built.number)
            before[built.number] = [np.array(item[matrix].Convert2DenseMatrix()) for matrix in names]
            added = built.elastic.added_in_steps(rule.step, held=name in held)
            for matrix, value, further in zip(names, before[built.number], added, strict=True):
                mbs.SetObjectParameter(built.number, matrix, value + further)
        mass, damping = added_in_steps(model, rule.step, held)
        yield tuple(_with_added(model, mesh, mass, damping) for mesh in model.meshes)
    finally:
        for number, values in before.items():
            for matrix, value in zip(names, values, strict=True):
                mbs.SetObjectParameter(number, matrix, value)


def _with_added(model: Model, mesh: Mesh, mass: np.ndarray, damping: np.ndarray) -> Mesh:
    """A mesh whose system has further mass and damping (n, n)."""
    system = mesh.free_system
    part = np.ix_(system.free, system.free)
    system = system._replace(mass=system.mass + mass[part], damping=system.damping + damping[part])
    row, accelerations, forces = mesh.row[system.free], np.zeros(mesh.row.size), np.zeros(mesh.row.size)
    accelerations[system.free] = np.linalg.solve(system.mass, row)
    forces[system.free] = system.stiffness @ accelerations[system.free]
    for mate in model.meshes:
        if mate.contact != mesh.contact:
            forces -= mean_stiffness(mate.law, mate.stage.pair) * (mate.row @ accelerations) * mate.row
    by_bearings = np.zeros((2, 6))
    for by_displacement, shaft in zip(by_bearings, (mesh.stage.fast, mesh.stage.slow), strict=True):
        if all(bearing.linear for bearing in shaft.bearings.values()):
            components = model.plan.shafts[shaft.name].components[:-1]
            by_displacement[components] = on_body(model, mesh.stage, shaft, forces)
    mobility = float(mesh.row @ accelerations)
    return replace(mesh, mobility=mobility, acceleration_by_bearings=by_bearings.ravel(), free_system=system)


def _lag_corrected(model: Model, meshes: Sequence[Mesh], rule: Rule) -> Iterator[None]:
    """`lag_corrected` for the meshes of a system as it is in the steps of the rule."""
    loops = len(model.meshes) >= len(model.bodies)
    lag, predicted = lag_of(rule), rule if rule.spectral_radius is None else None
    for ends in step_ends_of(model.bare_mbs):
        ends.follow(predicted)
    changes = changes_in_step(model.bare_mbs.systemData.ODE2Size())
    bearings = bearing_tangents(model, np.array(model.bare_mbs.systemData.GetODE2Coordinates(INITIAL)))
    for pin in model.pins:
        pin.record.lag = lag
    for mesh in meshes:
        state = state_of(model.bare_mbs, mesh.contact)
        state.lag, state.mobility = lag * mesh.mobility, 0.0 if loops else mesh.mobility
        state.pinion_lag, state.wheel_lag = np.split(lag * mesh.acceleration_by_bearings, 2)
        state["steps"] = np.zeros((), STEPS)
        state.steps.last_time = np.nan
        if rule.spectral_radius is None:
            set_predictor(model, mesh, rule, state.steps, bearings, changes)
    try:
        yield
    finally:
        for ends in step_ends_of(model.bare_mbs):
            ends.follow(None)
        for pin in model.pins:
            pin.record.lag = 0.0
        for mesh in model.meshes:
            state = state_of(model.bare_mbs, mesh.contact)
            state.lag, state.pinion_lag, state.wheel_lag = 0.0, np.zeros(6), np.zeros(6)
            state.steps.duration = 0.0


def steps_of_contacts(model: Model) -> list[np.ndarray]:
    """What the contacts remember of the step before, by which they predict the next one: the memory of `STEPS`."""
    return [floats_of(state_of(model.bare_mbs, mesh.contact)["steps"]) for mesh in model.meshes]
