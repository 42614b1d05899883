"""The data of a run: samples, variables with labels and units, reading from a file, selection of a stage."""

from bisect import bisect_left
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import inf
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import NO_DISPLACEMENT, Shaft, parts_of
from exugear.gearbox.stage import stage_number
from exugear.mesh_force.ring_pair import Ring, RingPair
from exugear.multibody.drive_and_load import ShaftTorques
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.model import Model, on_bearings
from exugear.multibody.recorder import FRICTION_IN_RUNS, IN_RUNS, IN_RUNS_ON_BEARINGS, BodyRecorder, Recorder
from exugear.multibody.shaft_motion import (
    BearingForces,
    drag_variables,
    driving_speed,
    mesh_frequencies,
    rows,
    speed_variables,
    torque_variables,
)
from exugear.multibody.solve_errors import STIFFNESS_UNIT_HINT
from exugear.multibody.solver_settings import Scheme
from exugear.operation.conditions import Conditions
from exugear.operation.shaft_ends import numbers_of_text
from exugear.operation.stop_conditions import End
from exugear.planning.map_axes import IGNORED
from exugear.planning.sampling import Steps
from exugear.running.housing_variables import housing_variables
from exugear.running.power_variables import power_variables
from exugear.running.ring_variables import ring_variables
from fem.gear.gear import Gear
from fem.gear.involute import involute
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_attributes
from fem.support.netcdf import read
from fem.support.validation import require
from fem.units import mm, um

AnyRecorder = Recorder | BodyRecorder
#: End of the names of attributes that hold the angle of a shaft about z at the start of a run that goes on [rad].
START_ANGLE = "_start_angle"
#: Rows of the end state of a run.
DERIVATIVES = ("coordinates", "velocities", "accelerations")
#: Variables that every run holds.
VARIABLES = ("time", "stage", "speed", "mesh_frequency", "dte", "mesh_force")


def stage_data(run, stage: int | str = 0) -> xr.Dataset:
    """The data of a stage, by its number or its label; run: an `exugear.Run` or its data.

    Raises ValueError for other objects and for stages that the run does not have.
    """
    data = run if isinstance(run, xr.Dataset) else getattr(run, "data", xr.Dataset())
    is_run = isinstance(data, xr.Dataset) and set(VARIABLES) <= set(data.variables)
    kind = f"run must be an exugear.Run or its data, got {type(run).__name__}"
    require(is_run, f"{kind}; pass what exugear.run_up returns")
    return data.isel(stage=stage_number(data["stage"].values.tolist(), stage))


def stored(path) -> xr.Dataset:
    """The data of a run from a file of `exugear.Run.save`; ValueError for other files."""
    data = read(path, "run it again")
    missing = [name for name in VARIABLES if name not in data.variables] + ["step"] * ("step" not in data.attrs)
    require(not missing, f"{path} holds no run, it lacks {missing}; pass what exugear.Run.save wrote")
    if "stage" not in data["mesh_frequency"].dims:
        several = f"{path} is of an older version, with the mesh frequency of the first stage alone; run it again"
        require(data["stage"].size == 1, several)
        data["mesh_frequency"] = data["mesh_frequency"].expand_dims(stage=data["stage"])
    for name in {"speed", "load"} & data.attrs.keys():
        data.attrs[name] = numbers_of_text(data.attrs[name]) if isinstance(data.attrs[name], str) else data.attrs[name]
    texts = {name: labels.astype(str) for name, labels in data.coords.items() if labels.dtype == object}
    return data.assign_coords(texts)


@contextmanager
def recording(model: Model, steps: Steps, torques: ShaftTorques, *, power: bool, samples: range) -> Iterator[None]:
    """Record all meshes and torques; later solves leave the samples as they are.

    power     whether meshes record spins and speeds
    samples   numbers of the samples to record
    """
    part: dict[str, Any] = {"steps": steps.every, "first": samples.start}
    for mesh in model.meshes:
        kinds = {"motion": on_bearings(model, mesh), "power": power, "friction": mesh.stage.friction is not None}
        kinds |= {"carrier": mesh.stage.carrier is not None}
        mesh.recorder.start(steps.interval, len(samples), **part, **kinds, zeroed=True)
    for torque in torques.values():
        torque.recorder.start(steps.interval, len(samples), **part)
    for further in _beside_meshes(model):
        further.start(steps.interval, len(samples), **part)
    try:
        yield
    finally:
        for recorder in recorders_of(model, torques):
            recorder.header.number = 0


def recorders_of(model: Model, torques: ShaftTorques) -> list[AnyRecorder]:
    """The recorders of all meshes, torques, pins, elastic shafts and rings."""
    of_meshes, of_torques = [mesh.recorder for mesh in model.meshes], [torque.recorder for torque in torques.values()]
    return [*of_meshes, *of_torques, *_beside_meshes(model)]


def _beside_meshes(model: Model) -> list[BodyRecorder]:
    """The recorders of pins, elastic shafts, elastic rings, and of a housing with coordinates."""
    of_shafts, of_rings = ([x.recorder for x in built.values()] for built in (model.elastics, model.rings))
    of_housing = [model.seats.recorder] if model.seats and model.seats.housing else []
    return [*(pin.recorder for pin in model.pins), *of_shafts, *of_rings, *of_housing]


def keep_valid(
    model: Model, steps: Steps, end: End | None, stop: BaseException | None, stopped_at: float
) -> BaseException | None:
    """Drop the samples after an end, or after a stop at a time [s].

    Returns the stop, also where bearings yield until the teeth part, or until both flanks would carry.
    """
    lost = np.logical_or.reduce([np.isnan(mesh.recorder.deflection) for mesh in model.meshes])
    if end:
        lost |= np.arange(lost.size) > end.sample
    if stop:
        lost |= steps.time[: lost.size] >= stopped_at
    number = int(lost.argmax()) if lost.any() else lost.size
    for beyond in (_out_of_mesh, _jammed):
        last, reason = beyond(model, number)
        number, stop = (last, RuntimeError(f"at t = {steps.time[last]:.6g} s: {reason}")) if reason else (number, stop)
    for mesh in model.meshes:
        mesh.recorder.keep_first(number)
    return stop


def _out_of_mesh(model: Model, number: int) -> tuple[int, str]:
    """First sample at which bearings have yielded until the teeth part, and the reason; else (number, "").

    number   of samples to examine
    """
    for mesh in model.meshes:
        pair, a = mesh.stage.pair, mesh.recorder.a[:number]
        if pair.a < 0:
            continue
        if on_bearings(model, mesh) and _is_apart(pair, a.max(initial=pair.a)):
            peaks = np.maximum.accumulate(a)
            apart = bisect_left(peaks, True, key=partial(_is_apart, pair))
            far = f"bearings of {mesh.stage.name} yield to a centre distance of {peaks[apart] / mm:.6g} mm"
            return apart, f"{far}, where the pair cannot run; try less load or stiffer bearings {STIFFNESS_UNIT_HINT}"
    return number, ""


def _jammed(model: Model, number: int) -> tuple[int, str]:
    """First sample at which a tooth of a mesh with backlash would touch both flanks of its gap, and the reason.

    The law has a single flank in contact. number: of samples to examine, which is returned where there is none.
    """
    for mesh in model.meshes:
        pair, a, largest = mesh.stage.pair, mesh.recorder.a[:number], mesh.law.backlash + IGNORED["a"]
        may_jam = on_bearings(model, mesh) and 0 < mesh.law.backlash < inf and number > 0
        if may_jam and _lost_backlash(pair, a.min()) > largest:
            at = int((_lost_backlash(pair, a) > largest).argmax())
            near = f"gears of {mesh.stage.name} come {abs(a[at] - pair.a) / um:.4g} um too close for their backlash of"
            remedy = "both flanks would carry; run slower, take stiffer pins or bearings, or give more backlash"
            return at, f"{near} {mesh.law.backlash / um:.4g} um: {remedy}"
    return number, ""


def _lost_backlash(pair, a):
    """Backlash along the line of action that a pair has lost at centre distances a [m], a < 0 of a ring."""
    r_b = pair.pinion.r_b + pair.wheel.r_b
    return 2 * r_b * (involute(pair.alpha_wt) - involute(np.arccos(r_b / a)))


def _is_apart(pair, a: float) -> bool:
    """Whether a pair is out of mesh at a centre distance [m]; smaller distances than its nominal one count as that."""
    try:
        replace(pair, a=max(float(a), pair.a))
    except ValueError:
        return True
    return False


def labelled(
    model: Model,
    conditions: Conditions,
    scheme: Scheme,
    torques: ShaftTorques,
    forces: BearingForces,
) -> xr.Dataset:
    """All variables of a run, its inputs in the attributes.

    torques   tabulated torques and recorded motions of shafts
    forces    of the bearings
    """
    time = scheme.steps.time[: model.meshes[0].recorder.deflection.size]
    data = _over_time(model, conditions, time)
    variables = forces.variables(time.size, conditions.displacement) | _beyond_maps(model, scheme.steps.interval)
    variables |= speed_variables(model, torques, time.size) | torque_variables(model, conditions, torques, time)
    variables |= drag_variables(model) | ring_variables(model, time.size) | housing_variables(model, time.size)
    data = data.assign(variables)
    if conditions.power:
        data = data.assign(power_variables(model, conditions, torques, data, scheme.rule))
    inputs = {"duration": conditions.duration, "tolerance": scheme.tolerance}
    steps = {"sample": scheme.steps.interval, "step": scheme.steps.size}
    used = {"integrator": str(scheme.rule), "plan": str(model.plan)}
    jumps = {"jumps": scheme.jumps} if scheme.jumps else {}
    if conditions.run_up:
        ends = ("drive_end", "load_end", "held_end")
        data = data.squeeze([name for name in ends if data.sizes.get(name) == 1])
    return data.assign_attrs({**conditions.attributes(), **inputs, **steps, **used, **jumps, **scene_attributes(model)})


def _over_time(model: Model, conditions: Conditions, time: np.ndarray) -> xr.Dataset:
    """The variables over time."""
    over, speed = ("stage", "time"), driving_speed(model, conditions, time)
    frequency = mesh_frequencies(model, conditions, time)
    variables = {
        "speed": ("time", speed, {"units": "rad/s", "long_name": "speed of the driving shaft"}),
        "mesh_frequency": (over, frequency, {"units": "Hz", "long_name": "mesh frequency"}),
    }
    elastic = any(on_bearings(model, mesh) for mesh in model.meshes)
    for name, (recorded, unit, long_name) in (IN_RUNS | (IN_RUNS_ON_BEARINGS if elastic else {})).items():
        values = rows([getattr(mesh.recorder, recorded) for mesh in model.meshes])
        variables[name] = over, values, {"units": unit, "long_name": long_name}
    coords = {
        "time": ("time", time, {"units": "s", "long_name": "time"}),
        "stage": ("stage", list(model.gearbox.labels)),
    }
    return xr.Dataset(variables | _friction(model, time), coords=coords | _members_of_sets(model.gearbox))


def _members_of_sets(gearbox: Gearbox) -> dict[str, Any]:
    """Labels of the stages: planet, and member (sun or ring) with which it meshes, "" apart from a carrier; or none."""
    if not gearbox.planets:
        return {}
    planets = [next((x.name for x in (s.slow, s.fast) if x.name in gearbox.planets), "") for s in gearbox.stages]
    mates = [
        "" if not planet else stage.fast.name if stage.slow.name == planet else stage.slow.name
        for planet, stage in zip(planets, gearbox.stages, strict=True)
    ]
    return {"planet": ("stage", planets), "member": ("stage", mates)}


def _friction(model: Model, time: np.ndarray) -> dict[str, Any]:
    """Friction between the teeth over time, 0 in stages without it; empty where no stage has friction."""
    if all(mesh.stage.friction is None for mesh in model.meshes):
        return {}
    none = np.zeros(time.size)
    return {
        name: (
            ("stage", "time"),
            np.array([none if m.stage.friction is None else getattr(m.recorder, name) for m in model.meshes]),
            {"units": unit, "long_name": long_name},
        )
        for name, (unit, long_name) in FRICTION_IN_RUNS.items()
    }


def _beyond_maps(model: Model, interval: float) -> dict[str, Any]:
    """For how long and how far meshes were beyond their maps; empty where no law is extrapolated."""
    laws = [(mesh.law, mesh.law if mesh.law.coast is None else mesh.law.coast) for mesh in model.meshes]
    ends = np.array([[law.mapped_force for law in flanks] for flanks in laws])
    if np.isinf(ends).all():
        return {}
    forces = np.array([mesh.recorder.force for mesh in model.meshes])
    shares = np.abs(forces) / np.where(forces >= 0, ends[:, :1], ends[:, 1:])
    time, force = "time of the samples beyond the map", "largest mesh force of the samples over the map's largest"
    return {
        "beyond_map_time": ("stage", (shares > 1).sum(axis=1) * interval, {"units": "s", "long_name": time}),
        "beyond_map_force": ("stage", shares.max(axis=1, initial=0.0), {"units": "1", "long_name": force}),
    }


def scene_attributes(model: Model) -> dict[str, float | str]:
    """Data of shafts with their parts and speeds over that of the driving shaft, of pairs, force laws and frictions."""
    inputs: dict[str, float | str] = {}
    for shaft in model.gearbox.shafts:
        inputs |= {f"{shaft.name}_{name}": getattr(shaft, name) for name in ("inertia", "mass", "transverse")}
        inputs[f"{shaft.name}_speed_ratio"] = model.gearbox.ratios[shaft.name]
        inputs |= {f"{shaft.name}_parts": text for text in [_parts(shaft)] if text}
    box = model.gearbox
    for label, stage, phase, sense in zip(box.labels, box.stages, box.phases, box.flank_senses, strict=True):
        law = stage.force
        numbers = _pair_attributes(stage.pair) | {"damping": law.damping, "backlash": law.backlash}
        numbers |= {"damping_ramp": law.damping_ramp}
        numbers |= {"critical_damping": stage.critical_damping}
        numbers |= {"angle": stage.angle, "phase": phase, "flank_sense": sense}
        numbers |= {"pitches": law.pitches} if law.pitches > 1 else {}
        numbers |= {"friction": repr(stage.friction.coefficient)} if stage.friction else {}
        numbers |= {"carrier": stage.carrier.name} if stage.carrier else {}
        inputs |= {f"{label}_{name}": value for name, value in numbers.items()}
    if len(box.independent) > 1:
        inputs["independent_speeds"] = ", ".join(box.independent)
    if model.gearbox.held:
        inputs["held"] = ", ".join(model.gearbox.held)
    return inputs


def _pair_attributes(pair: GearPair | RingPair) -> dict[str, float | str]:
    """Inputs of a pair by attribute name; of a `RingPair` the sizes that it has."""
    if not isinstance(pair, RingPair):
        return pair_attributes(pair)
    names = {"pinion": ("z", "m_n", "x", "b", "alpha_n", "beta"), "wheel": ("z", "m_n", "b", "beta")}
    sizes = {f"{gear}_{x}": getattr(getattr(pair, gear), x) for gear, listed in names.items() for x in listed}
    return {"a": pair.a} | sizes


def _parts(shaft: Shaft) -> str:
    """Parts of a shaft beside its gears with their axial positions, sections, weight and displacement; a line each."""
    beside_gears = [(axial, part) for axial, part in parts_of(shaft) if not isinstance(part, Gear | Ring)]
    lines = [f"{axial / mm:g} mm: {part!r}" for axial, part in beside_gears]
    if shaft.sections:
        sizes = [f"{x.d / mm:g}{f'/{x.d_inner / mm:g}' * (x.d_inner > 0)} x {x.length / mm:g}" for x in shaft.cylinders]
        lines.insert(0, f"{shaft.start / mm:g} mm: Sections({', '.join(sizes)} mm)")
    if any(shaft.gravity):
        lines.append(f"whole shaft: Gravity({', '.join(f'{x:g}' for x in shaft.gravity)} m/s^2)")
    return "\n".join(lines + [f"whole shaft: {shaft.offset!r}"] * (shaft.offset != NO_DISPLACEMENT))


def with_end_state(model: Model, data: xr.Dataset, end: End | None) -> xr.Dataset:
    """The data with the state of the system at the end, and with the condition that has ended the run, if any."""
    system = model.bare_mbs.systemData
    state = [system.GetODE2Coordinates(INITIAL), system.GetODE2Coordinates_t(INITIAL)]
    values = np.array([*state, system.GetODE2Coordinates_tt(INITIAL)])
    about = {"units": "SI", "long_name": "coordinates of the system at the end, with their time derivatives"}
    data = data.assign(end_state=(("derivative", "coordinate"), values, about), derivative=list(DERIVATIVES))
    return data.assign_attrs(stopped_by=str(end.condition)) if end else data
