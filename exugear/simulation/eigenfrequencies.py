"""Eigenfrequencies of a built gearbox under load."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite, pi

import exudyn as exu
import numpy as np
import scipy

from exugear.kernels.kinematics import HELD
from exugear.simulation.drive_and_load import OFFSETS, applied, set_drive
from exugear.simulation.equilibrium import start
from exugear.simulation.model import Model, linearized, quiet
from exugear.simulation.time_functions import Conditions
from fem.support.arguments import checked
from fem.support.validation import require


@checked
def eigenfrequencies(model: Model, *, load: float) -> np.ndarray:
    """Eigenfrequencies [Hz] (n,), rising, about the equilibrium under a load [N m], undamped, the shafts at rest.

    The driving shaft, or the rotor behind its coupling, is held as in a run; teeth, bearings and whatever else is in
    the system have their tangent stiffness; the phases of the meshes are those in which the gearbox was built. The
    system stays as it was.

    Exudyn's own mbs.ComputeODE2Eigenvalues() linearizes about the state that the system is in. Straight after `build`
    the teeth just touch there: they push on one side and are loose on the other, and its frequencies are far too low.

    Raises ValueError for a load of 0, under which the teeth only just touch, and for loads beyond the maps.
    """
    require(isinstance(model, Model), f"model must be an exugear.Model, got {type(model).__name__}; build(gearbox)")
    require(isfinite(load) and load != 0, f"load must be finite and not 0, got {load}; without it no teeth are pressed")
    model, conditions = linearized(model), Conditions(speed=0.0, load=float(load), duration=1.0)
    with quiet(), _restored(model), applied(model, conditions):
        start(model, conditions)
        mass, stiffness, *_ = model.mbs.ComputeLinearizedSystem(projectIntoConstraintNullspace=True)
    squares = scipy.linalg.eigvals(stiffness, mass).real
    return np.sqrt(np.sort(np.maximum(squares, 0.0))) / (2 * pi)


@contextmanager
def _restored(model: Model) -> Iterator[None]:
    """Leave state, drive and load of the system as they were."""
    mbs, initial = model.mbs, exu.ConfigurationType.Initial
    held, load = [mesh.frame[HELD] for mesh in model.meshes], mbs.GetLoad(model.load)
    functions = [mbs.GetObjectParameter(model.drive, name) for name in OFFSETS]
    state = mbs.systemData.GetSystemState(initial)
    try:
        yield
    finally:
        set_drive(mbs, model.drive, functions)
        for name in ("load", "loadUserFunction"):
            mbs.SetLoadParameter(model.load, name, load[name])
        for mesh, force in zip(model.meshes, held, strict=True):
            mesh.frame[HELD] = force
        mbs.Assemble()
        mbs.systemData.SetSystemState(state, initial)
