"""Static equilibrium of a built gearbox under its load, from which a run starts."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import isfinite

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

from exugear.elements.divergence import DIVERGED
from exugear.gearbox.bearing_stiffness import radial_table
from exugear.gearbox.shaft import Shaft
from exugear.kernels.kinematics import DIRECTION, TURNS
from exugear.mesh_force.map_range import larger_torque
from exugear.plan.coordinates import SPIN_PLACE
from exugear.plan.map_axes import static_offsets
from exugear.plan.plan import UNDAMPED
from exugear.simulation.model import Mesh, Model, lay, open_system, seats
from fem.support.validation import require
from fem.units import mm, rpm

INSTANT = 1e-12
STUCK = "no static equilibrium; try a load under which teeth and bearings touch, less load or stiffer bearings"
#: Rounds in which nonlinear bearings find their secant stiffness, and meshes their phases to within [m, rad].
ROUNDS, SETTLED = 30, 1e-14
#: Static displacement of a shaft [m, rad] and twist of a coupling [rad] beyond which data are in another unit.
LARGEST_SHIFT, LARGEST_TILT, LARGEST_TWIST = 0.01, 0.05, 2.0
UNIT = "(in N/m: 200 N/um are 200e6)"
#: Share of a map's largest force from which on inertia takes part.
LEAST = 1e-6
#: What other functions of a system say.
FAILED = r"USER FUNCTION '([^']*)':\s*([^\n]+)"
ITERATION = "Newton's iteration failed; {}"
#: What the user functions say.
SAID = r"\b(deflection|displacement|misalignment|a|axial|load\(t\)) [^\n]*(beyond|must)[^\n]+"


def start(model: Model, load: float, speed: float, acceleration: float = 0.0) -> None:
    """Put the system into equilibrium under a load [N m], all shafts turning as the driving one makes them.

    acceleration   of the driving shaft [rad/s^2]: the inertia torques of all shafts and rotors take part in the
                   equilibrium. Their gyroscopic moments do not: the axes stand still, tilted by some 1e-4 rad
    """
    system, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    turning = _turning(model)
    felt = acceleration if _matters(model, acceleration) else 0.0
    try:
        q = _laid_out(model, load, felt)
    except ValueError as error:
        cause = f"; of it inertia torques at {acceleration:.4g} rad/s^2: let the speed rise more slowly at the start"
        raise ValueError(f"{error}{cause if felt else ''}") from None
    if _yields(model):
        q = _settled(model, q, speed, felt * turning)
    system.SetODE2Coordinates(q, initial)
    system.SetODE2Coordinates_t(speed * turning, initial)
    system.SetODE2Coordinates_tt(acceleration * turning, initial)


def _matters(model: Model, acceleration: float) -> bool:
    """Whether inertia loads a mesh by more than a share of its map so small that no static solve would find it."""
    forces = np.abs(model.gearbox.static_forces(0.0, acceleration))
    return any(f > LEAST * mesh.law.force_table.max() for f, mesh in zip(forces, model.meshes, strict=True))


def _turning(model: Model) -> np.ndarray:
    """(n_coordinates,) speed of each coordinate over that of the driving shaft: the ratios of the spins."""
    turning = np.zeros(model.mbs.systemData.ODE2Size())
    for name, ratio in model.gearbox.ratios.items():
        turning[[model.spins[name], model.rotors.get(name, model.spins[name])]] = ratio
    return turning


def _laid_out(model: Model, load: float, acceleration: float) -> np.ndarray:
    """Coordinates that carry the load and the inertia torques, the phases as the shafts' static displacement is."""
    box = model.gearbox
    forces = np.array(box.static_forces(load, acceleration))
    q = _displaced(model, forces)
    driving, spin = box.driving, model.spins[box.driving.name]
    if driving.coupling:
        torques = -forces @ np.array([mesh.row for mesh in model.meshes])
        q[spin] = _twist(driving, torques[spin] - driving.inertia * acceleration)
    q = _pressed(model, forces, q)
    for shaft in box.shafts:
        if shaft.coupling:
            outer = -box.turns[shaft.name] * load if shaft.name == box.driven.name else 0.0
            torque = outer - shaft.coupling.inertia * box.ratios[shaft.name] * acceleration
            rotor = model.rotors[shaft.name]
            q[rotor] = 0.0 if shaft.name == driving.name else q[rotor] + _twist(shaft, torque)
    return q


def _twist(shaft: Shaft, torque: float) -> float:
    """Twist [rad] of a shaft's coupling under a torque [N m]; ValueError beyond what couplings stand."""
    torsion = shaft.coupling.torsion  # type: ignore[union-attr]
    far = f"the coupling of shaft {shaft.name!r} twists by {torque / torsion:.3g} rad under {torque:.4g} N m"
    units = "pass its torsion in N m/rad (8 kN m/rad are 8e3), or less load"
    require(abs(torque) < LARGEST_TWIST * torsion, f"{far}; {units}")
    return torque / torsion


def _yields(model: Model) -> bool:
    """Whether more than the meshes gives way."""
    elastic = any(kind.on_bearings for kind in model.plan.shafts.values())
    return elastic or bool(model.rotors) or len(model.meshes) >= len(model.bodies)


def _settled(model: Model, q: np.ndarray, speed: float, accelerations: np.ndarray) -> np.ndarray:
    """The coordinates in equilibrium, from near ones on, while all coordinates have these accelerations."""
    system, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.loadStepDuration = INSTANT
    with _inertia_torques(model, accelerations), explained(model, STUCK, lambda t: speed):
        system.SetODE2Coordinates(q, initial)
        system.SetODE2Coordinates_t(np.zeros(q.size), initial)
        model.mbs.SolveStatic(settings, updateInitialValues=True)
        return system.GetODE2Coordinates(initial)


def _turning_masses(model: Model) -> list[tuple[int, int, float]]:
    """Place of the spin among all coordinates and among those of its node, and inertia, of every shaft and rotor."""
    shafts, kinds = model.gearbox.shafts, model.plan.shafts
    turning = [(model.spins[shaft.name], SPIN_PLACE[kinds[shaft.name]], shaft.inertia) for shaft in shafts]
    return turning + [(model.rotors[s.name], 0, s.coupling.inertia) for s in shafts if s.coupling]


@contextmanager
def _inertia_torques(model: Model, accelerations: np.ndarray) -> Iterator[None]:
    """Loads on the spins of shafts and rotors, as accelerations (n_coordinates,) ask for; none without them."""
    mbs, loads = model.mbs, []
    nodes = {mbs.GetNodeODE2Index(n): n for n in range(mbs.systemData.NumberOfNodes())}
    for spin, coordinate, inertia in _turning_masses(model) if accelerations.any() else ():
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=nodes[spin - coordinate], coordinate=coordinate))
        load = eii.LoadCoordinate(markerNumber=marker, load=-inertia * accelerations[spin])
        loads.append(mbs.AddLoad(load))
    try:
        if loads:
            mbs.Assemble()
        yield
    finally:
        for load in reversed(loads):
            mbs.DeleteLoad(load, suppressWarnings=True)
        if loads:
            mbs.Assemble()


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
    _check_yield(model, forces, q)
    return q


def _check_yield(model: Model, forces: np.ndarray, q: np.ndarray) -> None:
    """Bearings hold their shafts in mesh under forces (n_stage,) [N], or are given in another unit: RuntimeError."""
    for mesh, force in zip(model.meshes, forces, strict=True):
        shafts = [s.name for s in (mesh.stage.fast, mesh.stage.slow) if model.plan.shafts[s.name].on_bearings]
        displaced = [q[model.spins[s] - SPIN_PLACE[model.plan.shafts[s]] : model.spins[s]] for s in shafts]
        shift = max((np.abs(x[:3]).max() for x in displaced), default=0.0)
        tilt = max((np.abs(x[3:]).max(initial=0.0) for x in displaced), default=0.0)
        if shift > LARGEST_SHIFT or tilt > LARGEST_TILT:
            far = f"bearings of {mesh.stage.name} yield by {shift / mm:.3g} mm, {tilt:.2g} rad under {abs(force):.4g} N"
            raise RuntimeError(f"{far}; try less load or stiffer bearings {UNIT}")


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
        reason = left.group(0).replace(DIVERGED, remedy) if left else reason
        raise RuntimeError(f"{where}: {reason}{without_damping(model, t)}") from None


def without_damping(model: Model, t: float) -> str:
    """What a run that fails at t [s] is told where no mesh, bearing or coupling is damped."""
    return f" ({UNDAMPED})" if model.plan.scene.undamped and t > INSTANT else ""
