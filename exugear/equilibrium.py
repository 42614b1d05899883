"""Static equilibrium of a built gearbox under its load, from which a run starts."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import isfinite

import exudyn as exu
import numpy as np

from exugear.axes import static_offsets
from exugear.bodies import SPIN_PLACE
from exugear.kinematics import DIRECTION, TURNS
from exugear.map_range import larger_torque
from exugear.model import Mesh, Model, lay, open_system, seats
from exugear.seats import radial_table
from fem.gear import require
from fem.units import rpm

INSTANT = 1e-12
STUCK = "no static equilibrium; try a load under which teeth and bearings touch, less load or stiffer bearings"
#: Rounds in which nonlinear bearings find their secant stiffness, and meshes their phases to within [m, rad].
ROUNDS, SETTLED = 30, 1e-14
#: What the user functions say.
#: What other functions of a system say.
FAILED = r"USER FUNCTION '([^']*)':\s*([^\n]+)"
ITERATION = "Newton's iteration failed; {}"
SAID = r"\b(deflection|displacement|misalignment|a|axial|load\(t\)) [^\n]*(beyond|must)[^\n]+"


def start(model: Model, load: float, speed: float) -> None:
    """Put the system into static equilibrium under a load [N m], all shafts turning as the driving one makes them."""
    system, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    forces = np.array(model.gearbox.static_forces(load))
    q = _displaced(model, forces)
    torques = -forces @ np.array([mesh.row for mesh in model.meshes])
    driving, driven = model.gearbox.driving, model.gearbox.driven
    if driving.coupling:
        q[model.spins[driving.name]] = torques[model.spins[driving.name]] / driving.coupling.torsion
    q = _pressed(model, forces, q)
    if driving.coupling:
        q[model.rotors[driving.name]] = 0.0
    if driven.coupling:
        q[model.rotors[driven.name]] -= model.gearbox.turns[driven.name] * load / driven.coupling.torsion
    system.SetODE2Coordinates(q, initial)
    system.SetODE2Coordinates_t(np.zeros(q.size), initial)
    if _yields(model):
        _settle(model, speed)
    velocity = np.zeros(q.size)
    for name, ratio in model.gearbox.ratios.items():
        velocity[[model.spins[name], model.rotors.get(name, model.spins[name])]] = ratio * speed
    system.SetODE2Coordinates_t(velocity, initial)


def _yields(model: Model) -> bool:
    """Whether more than the meshes gives way."""
    elastic = any(kind.on_bearings for kind in model.plan.shafts.values())
    return elastic or bool(model.rotors) or len(model.meshes) >= len(model.bodies)


def _settle(model: Model, speed: float) -> None:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.loadStepDuration = INSTANT
    with explained(model, STUCK, lambda t: speed):
        model.mbs.SolveStatic(settings, updateInitialValues=True)


def _displaced(model: Model, forces: np.ndarray) -> np.ndarray:
    """Coordinates of the shafts on their bearings under mesh forces (n_stage,) [N], spins 0."""
    q = np.zeros(model.mbs.systemData.ODE2Size())
    held = {name: kind for name, kind in model.plan.shafts.items() if kind.on_bearings}
    if not held:
        return q
    free = np.concatenate([model.spins[name] - np.arange(1, SPIN_PLACE[kind] + 1) for name, kind in held.items()])
    push = -forces @ np.array([mesh.row for mesh in model.meshes])
    _, stiffness = open_system(model)
    secants = None
    for _ in range(ROUNDS):
        total = stiffness + seats(model, secants)
        q[free] = np.linalg.solve(total[np.ix_(free, free)], push[free])
        secants = _secants(model, q, secants)
        if not any(secants.values()):
            break
    return q


def _secants(model: Model, q: np.ndarray, before) -> Mapping[str, Mapping[float, float]]:
    """Secant stiffness [N/m] of every nonlinear bearing under the force that it has carried, by shaft and place."""
    found: dict[str, dict[float, float]] = {}
    for shaft in model.gearbox.shafts:
        found[shaft.name] = {}
        for axial, bearing in shaft.bearings.items():
            if not bearing.linear:
                x, y, _, a, b = q[model.spins[shaft.name] - 5 : model.spins[shaft.name]]
                lever = axial - shaft.centre
                k = float(bearing.stiffness[0, 0]) if before is None else before[shaft.name][axial]
                force = k * np.hypot(x + lever * b, y - lever * a)
                displacement, table = radial_table(bearing)
                reached = bool(force <= table[-1])
                more = f"bearing of shaft {shaft.name!r} at {axial:g} m carries {force:.4g} N, its table ends at"
                require(reached, f"{more} {table[-1]:.4g} N; extend it")
                loaded = np.flatnonzero(table == 0)[-1]
                r = np.interp(force, table[loaded:], displacement[loaded:])
                found[shaft.name][axial] = float(force / r) if force > 0 else k
    return found


def _pressed(model: Model, forces: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The same coordinates with spins such that the meshes carry forces (n_stage,) [N]: what turns moves the phases."""
    for _ in range(ROUNDS):
        before = q
        q = lay(model, [_deflection(model, mesh, f, q) for mesh, f in zip(model.meshes, forces, strict=True)], q)
        if np.abs(q - before).max() < SETTLED:
            return q
    raise RuntimeError(STUCK)


def _deflection(model: Model, mesh: Mesh, force: float, q: np.ndarray) -> float:
    """Static deflection of a mesh [m] where its pinion has turned; ValueError for loads beyond the map."""
    law = mesh.law
    phase = mesh.phase + mesh.frame[DIRECTION] * mesh.frame[TURNS] * q[model.spins[mesh.stage.fast.name]]
    static = static_offsets(model.gearbox, mesh.stage, 1 if force >= 0 else -1)
    law = law.at(**{n: x for n, x in static.items() if n in law.offsets})
    if force >= 0:
        return _under(mesh, law, phase, force)
    other = f"backlash must be finite for a load that lies on the other flank, got {law.backlash}"
    require(isfinite(law.backlash), other)
    behind = law.backlash + 2 * mesh.opening
    return -behind - _under(mesh, law, law.back_phase - phase, -force)


def _under(mesh: Mesh, law, phase: float, force: float) -> float:
    """Static deflection [m] under a force >= 0 [N]; ValueError with the torque to map beyond the law."""
    try:
        return law.deflection_at(phase, force)
    except ValueError:
        reason = larger_torque(law.law, force, mesh.stage.pair.pinion.r_b)
        raise ValueError(f"load: in stage {mesh.stage.name} {reason}") from None


@contextmanager
def explained(model: Model, remedy: str, speed_of) -> Iterator[None]:
    """Turn what Exudyn raises into RuntimeError with time, speed and the next thing to try; let Ctrl-C be one."""
    try:
        yield
    except Exception as error:
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from None
        t = model.mbs.systemData.GetTime()
        where = f"at t = {t:.6g} s ({float(speed_of(t)) / rpm:.5g} rpm)"
        left, failed = re.search(SAID, str(error)), re.search(FAILED, str(error))
        reason = f"user function {failed.group(1)} failed, {failed.group(2)}" if failed else ITERATION.format(remedy)
        reason = left.group(0) if left else reason
        raise RuntimeError(f"{where}: {reason}") from None
