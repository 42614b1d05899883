"""Random gearboxes: built and run a little, or refused in words; forces in balance, from static equilibrium on.

EXUGEAR_CASES in the environment says how many the slow test takes; with -n 0 -s it tells how they ended.
"""

import os
import re
from collections import Counter
from itertools import product

import exudyn as exu
import numpy as np
import pytest
from box_strategies import Scene, scenes, top_force
from hypothesis import HealthCheck, Phase, given, settings
from scenes import wrench
from spatial_meshes import mesh_in_space

import exugear

CASES = int(os.environ.get("EXUGEAR_CASES", "80"))
OPTIONS = {"phases": [Phase.generate], "derandomize": CASES == 80, "suppress_health_check": list(HealthCheck)}
STEPS = 50
#: Of the largest torque: static equilibrium, equation of motion.
STATIC, NEWTON = 1e-3, 1e-8
REMEDY = re.compile(r"[;:] (try|take|use|extend|map|pass|drop|make|or |write)|must|extend the (map|axis)|try step")
NUMBER = re.compile(r"-?\d[\d.e+-]*|stage '[a-d]-[a-d]'|shaft '[a-d]'")
#: How scenes ended.
OUTCOMES: Counter = Counter()


def is_in_words(error: Exception) -> bool:
    """Whether exugear states fault and remedy, rather than a library below it."""
    stated = isinstance(error, exugear.RunStopped) or type(error) in (ValueError, RuntimeError)
    return stated and bool(REMEDY.search(str(error)))


def solved(scene: Scene) -> tuple[exugear.Model, exugear.Run, exugear.Run, float] | None:
    """Model, two steps at rest, run and load [N m] of a scene; None where it is refused in words.

    Tilted shafts have unlike ratios on their two flanks, to first order: at speed damping takes part in the start.
    """
    try:
        model = exugear.build(scene.box())
        load, h = scene.load(model.gearbox), model.plan.step()
        top = scene.speed * model.plan.omega_mesh / model.gearbox.stages[0].pair.pinion.z
        course = {"speed": (top, faster(model.gearbox, top, STEPS * h)), "duration": STEPS * h, "sample": h}
        exact = {"step": model.plan.rule(), "tolerance": 1e-8}
        rest = exugear.run_up(model, load=load, speed=0.0, duration=2 * h, sample=h, **exact, progress=False)
        run = exugear.run_up(model, load=load, **course, **exact, progress=False)
    except Exception as error:
        OUTCOMES[f"{type(error).__name__}: {NUMBER.sub('#', str(error))[:70]}"] += 1
        assert is_in_words(error), repr(error)
        return None
    OUTCOMES["run"] += 1
    return model, rest, run, load


def faster(box: exugear.Gearbox, speed: float, duration: float) -> float:
    """2 % more speed [rad/s], or what a hundredth of the maps' largest forces accelerates the inertia by."""
    asked = np.abs(box.static_forces(0.0, 1.0))
    gentle = 0.01 * min(top_force(stage.pair) / force for stage, force in zip(box.stages, asked, strict=True))
    return speed + np.sign(speed) * min(0.02 * abs(speed), gentle * duration)


def torques(model: exugear.Model, forces: np.ndarray, load: float) -> tuple[np.ndarray, float]:
    """Rest of the torques on the shafts but the driving one [N m], beside the largest of them."""
    box = model.gearbox
    outer = np.array([-box.directions[shaft.name] * load * (shaft is box.driven) for shaft in box.shafts])
    meshes = arms(model) * forces[:, None]
    return (outer - meshes.sum(axis=0))[1:], max(np.abs(meshes).max(), abs(load))


def whole(model) -> float:
    """Largest torque within the maps on any shaft [N m]."""
    tops = [top_force(stage.pair) for stage in model.gearbox.stages]
    return float(np.abs(model.gearbox.rows * np.array(tops)[:, None]).max())


def laid(model) -> float:
    """What the second order of the shafts' displacement may leave of the torques where meshes are laid out [N m]."""
    second = [mesh.reference_deflection**2 / mesh.stage.pair.pinion.r_b for mesh in model.meshes]
    forces = [mesh.law.stiffness_max * x for mesh, x in zip(model.meshes, second, strict=True)]
    return float(np.abs(model.gearbox.rows * np.array(forces)[:, None]).sum())


def starts_in_equilibrium(model, rest, load: float) -> None:
    left, size = torques(model, rest.data["mesh_force"].values[:, 0], load)
    assert np.abs(left).max() <= STATIC * size + 1e-6 * whole(model) + laid(model)


def is_in_space(mesh) -> bool:
    """Whether the frame of a mesh has a line of centres, as that of two shafts which only spin does not."""
    return bool(mesh.frame.e_x or mesh.frame.e_y)


def actions_are_reactions(model) -> None:
    """Force and moment that a mesh exerts on bodies in space, at the end of the run."""
    for mesh in model.meshes:
        if not is_in_space(mesh):
            continue
        force, *forces, motion = meshing(model, mesh)
        ends = mesh.frame.pinion.reference, mesh.frame.wheel.reference
        total = [wrench(end, y, f) for end, y, f in zip(ends, motion[:2], forces, strict=True)]
        assert np.abs(total[0] + total[1]).max() <= 1e-11 * max(np.abs(total[0]).max(), 1e-300)
        recorded, largest = mesh.recorder.force[-1], np.nanmax(np.abs(mesh.recorder.force))
        assert force * recorded >= 0 or min(abs(force), abs(recorded)) <= 1e-9 * largest


def meshing(model, mesh):
    """Force, generalized forces on both shafts, and the motion of the mesh at the end of the run."""
    system, now = model.mbs.systemData, exu.ConfigurationType.Current
    q, q_t = system.GetODE2Coordinates(now), system.GetODE2Coordinates_t(now)
    motion = np.zeros((4, 6))
    for row, (values, shaft) in zip(motion, product((q, q_t), (mesh.stage.fast, mesh.stage.slow)), strict=True):
        row[model.plan.shafts[shaft.name].components] = values[coordinates_of(model, shaft)]
    _, force, pinion, wheel, *_ = mesh_in_space(mesh.law, mesh.frame, *motion)
    return force, pinion, wheel, motion


def arms(model) -> np.ndarray:
    """(n_stage, n_shaft) of the mesh forces about the shafts, which may be tilted [m]."""
    box = model.gearbox
    arms = box.rows.copy()
    for i, mesh in enumerate(model.meshes):
        if is_in_space(mesh):
            force, *by_shaft, _ = meshing(model, mesh)
            for shaft, forces in zip((mesh.stage.fast, mesh.stage.slow), by_shaft, strict=True):
                if force != 0:
                    arms[i, box.shafts.index(shaft)] = -forces[5] / force
    return arms


def coordinates_of(model, shaft: exugear.Shaft) -> list[int]:
    """Indices of a shaft's coordinates in the system."""
    spin = model.spins[shaft.name]
    return list(range(spin - model.plan.shafts[shaft.name].spin_index, spin + 1))


def accelerates_as_forces_ask(model, run) -> None:
    """Momentum of shafts on bearings, spin of the others, at the end of the run."""
    accelerations = model.mbs.systemData.GetODE2Coordinates_tt(exu.ConfigurationType.Current)
    box = model.gearbox
    for shaft in box.shafts:
        free = shaft not in (box.driving, box.driven) and shaft.coupling is None
        if free and not model.plan.shafts[shaft.name].on_bearings:
            asked = shaft.inertia * accelerations[model.spins[shaft.name]] - mesh_torque(model, shaft)
            assert abs(asked) <= NEWTON * whole(model)
    if all(kind.on_bearings for kind in model.plan.shafts.values()):
        momentum = sum(shaft.mass * accelerations[coordinates_of(model, shaft)][:2] for shaft in box.shafts)
        held = run.data["bearing_force"].values[:, :2, -1]
        largest = max(top_force(stage.pair) for stage in box.stages)
        allowed = 1e-3 * np.abs(held).max() + NEWTON * largest + blurred(model)
        assert np.abs(momentum - held.sum(axis=0)).max() <= allowed


def mesh_torque(model, shaft: exugear.Shaft) -> float:
    """Torque of all meshes on the spin of a shaft at the end of the run [N m], that of dU/dphase included."""
    total = 0.0
    for mesh in model.meshes:
        if shaft is mesh.stage.fast:
            total += mesh.recorder.pinion_torque[-1]
        elif shaft is mesh.stage.slow:
            total += mesh.recorder.wheel_torque[-1]
            if not is_in_space(mesh):
                arm = mesh.frame.direction * mesh.stage.pair.wheel.r_b
                assert mesh.recorder.wheel_torque[-1] == pytest.approx(-arm * mesh.recorder.force[-1], rel=1e-12)
    return total


def blurred(model) -> float:
    """What single precision, in which runs keep the motion, may change of the bearings' forces [N]."""
    system, now, total = model.mbs.systemData, exu.ConfigurationType.Current, 0.0
    for shaft in model.gearbox.shafts:
        displacements = coordinates_of(model, shaft)[:-1]
        for axial, bearing in shaft.bearings.items():
            arm = np.array([1.0, 1.0, 1.0, *[abs(axial - shaft.centre)] * 2])[: len(displacements)]
            moved = [
                np.abs(values[displacements]) @ arm
                for values in (system.GetODE2Coordinates(now), system.GetODE2Coordinates_t(now))
            ]
            total += bearing.stiffness.max() * (moved[0] + bearing.damping_time * moved[1])
    return total * float(np.finfo(np.float32).eps)


def check(scene: Scene) -> None:
    solution = solved(scene)
    if solution is None:
        return
    model, rest, run, load = solution
    for name, values in run.data.items():
        assert np.isfinite(values.values).all(), name
    starts_in_equilibrium(model, rest, load)
    actions_are_reactions(model)
    accelerates_as_forces_ask(model, run)


@pytest.mark.filterwarnings("ignore::UserWarning")  # of values drawn over many orders of magnitude
@pytest.mark.slow
def test_many_random_gearboxes():
    OUTCOMES.clear()
    given(scenes())(settings(max_examples=CASES, **OPTIONS)(check))()
    print(*(f"{number:6d} {outcome}" for outcome, number in OUTCOMES.most_common()), sep="\n")
    assert OUTCOMES["run"] > 0.3 * OUTCOMES.total(), OUTCOMES
