"""Eigenfrequencies of a built gearbox under load."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite, pi

import exudyn as exu
import numpy as np
import scipy

from exugear.elements.exudyn_objects import quiet, set_state_of_system, state_of_system
from exugear.elements.gear_contact import state_of
from exugear.operation.conditions import run_up_conditions
from exugear.system.drive_and_load import applied
from exugear.system.equilibrium import start
from exugear.system.imposed_speed import CONSTRAINT
from exugear.system.model import Model, linearized
from fem.support.arguments import checked
from fem.support.validation import require


@checked
def eigenfrequencies(model: Model, *, load: float) -> np.ndarray:
    """Eigenfrequencies [Hz] (n,) of the undamped gearbox at rest under a load, rising.

    load   torque on the driven shaft [N m]

    The driving shaft, or the rotor behind its coupling, is fixed, as a run prescribes its speed. Teeth, bearings and
    further items of the system have their tangent stiffness in the equilibrium under the load. The meshes are at the
    phases in which the gearbox was built. The state of the system is restored afterwards.

    Exudyn's mbs.ComputeODE2Eigenvalues() linearizes about the present state of the system. Straight after `build` the
    teeth just touch: they are stiff in compression only, and its frequencies are far too low.

    Raises ValueError for a load of 0, under which the teeth just touch, and for loads beyond the maps.
    """
    require(isinstance(model, Model), f"model must be an exugear.Model, got {type(model).__name__}; build(gearbox)")
    require(isfinite(load) and load != 0, f"load must be finite and not 0, got {load}; without it no teeth are pressed")
    model = linearized(model, model.gearbox.driving.name)
    conditions = run_up_conditions(model.gearbox, 0.0, float(load), 1.0)
    with quiet(), _restored(model), applied(model, conditions):
        start(model, conditions)
        mass, stiffness, *_ = model.mbs.ComputeLinearizedSystem(projectIntoConstraintNullspace=True)
    squares = scipy.linalg.eigvals(stiffness, mass).real
    return np.sqrt(np.sort(np.maximum(squares, 0.0))) / (2 * pi)


@contextmanager
def _restored(model: Model) -> Iterator[None]:
    """Restore coordinates, drive, load and the states of the contacts afterwards."""
    mbs, initial = model.mbs, exu.ConfigurationType.Initial
    contacts, load = [state_of(mbs, mesh.contact) for mesh in model.meshes], mbs.GetLoad(model.load)
    holding_forces = [float(contact.holding_force) for contact in contacts]
    constraint = {name: mbs.GetObjectParameter(model.drive, name) for name in CONSTRAINT}
    coordinates = state_of_system(mbs, initial)
    try:
        yield
    finally:
        for name, value in constraint.items():
            mbs.SetObjectParameter(model.drive, name, value)
        for name in ("load", "loadUserFunction"):
            mbs.SetLoadParameter(model.load, name, load[name])
        for contact, force in zip(contacts, holding_forces, strict=True):
            contact.holding_force = force
        mbs.Assemble()
        set_state_of_system(mbs, coordinates, initial)
