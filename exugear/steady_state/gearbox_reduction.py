"""Reduction of a built gearbox to the meshes that excite it: linear about its equilibrium but for their force laws.

The linear system keeps all coordinates. Bearings and couplings have their tangent stiffness under the load, all further
meshes their mean tangent stiffness over the mesh cycle; gyroscopic terms grow with the speed.
The potential of a mesh that excites depends on deflection, phase and misalignment, which depend linearly on the
coordinates; it has the centre distance and the axial offset of the equilibrium, and expands the misalignment to first
order about it. The mean of what this leaves out belongs to the linear system: the tilting stiffness of the mesh, and
the geometric stiffness by which the mean force changes its direction with the shafts.
The amplitudes of an elastic ring stand beside the linear system: its meshes run around them (`ring_blocks`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from math import acos, gcd, lcm
from typing import NamedTuple

import numpy as np
import scipy

from exugear.gearbox.shaft import NO_DISPLACEMENT
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.layout import OFFSETS
from exugear.modal.linear_system import LinearSystem, linear_gearbox
from exugear.modal.mesh_tangents import MeshTangent, averaged_phases, mesh_tangent
from exugear.modal.operating_point import in_loaded_equilibrium
from exugear.multibody.elastic_rings import ring_in_mesh
from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.model import Mesh, Model, moving_of
from exugear.steady_state.exciting_mesh import ExcitingMesh, MeshEquilibrium
from exugear.steady_state.force_error import Reduction
from exugear.steady_state.mesh_measures import (
    STEP,
    Measures,
    curvature_of,
    measures_of,
    static_at,
    tilting_stiffness_at,
)
from exugear.steady_state.modal_blocks import Turning, modal_blocks
from exugear.steady_state.ring_blocks import PassedRing, RingBlocks, passed_ring, ring_blocks
from exugear.steady_state.steady_system import SteadySystem
from fem.gear.involute import involute
from fem.support.validation import require

#: Number of phases in a pitch at which the stiffness of the further meshes is compared.
PHASES = 8
#: Mesh cycles of the common period at most; rounding of ratios of mesh frequencies.
LONGEST_PERIOD, ROUNDING = 1000, 1e-9


def reduced(model: Model, loads: Mapping[str, float], stages: Sequence[int], *, speed: float, drive: str) -> Reduction:
    """The gearbox that the meshes of stages excite together, under loads of shafts by their names [N m].

    stages   numbers; the first is the reference
    speed    of the driving shaft [rad/s] in the middle of the range
    drive    "held": the driving shaft turns as imposed; "free": it turns under a constant torque
    """
    cycles = common_period(model, stages)
    with in_loaded_equilibrium(model, loads, drive) as in_equilibrium:
        system = linear_gearbox(in_equilibrium, [speed, 2 * speed], None)
        q = np.array(model.bare_mbs.systemData.GetODE2Coordinates(INITIAL))
        meshes = in_equilibrium.meshes
        tangents = [mesh_tangent(model.bare_mbs, meshes[stage].contact, None)[1] for stage in stages]
        further = [mesh for i, mesh in enumerate(meshes) if i not in stages and system.mesh_force[i]]
        variation = max((_variation(model.bare_mbs, mesh) for mesh in further), default=0.0)
    rings = ring_blocks((ring.elastic, ring.indices) for ring in model.rings.values())
    of_stages = [_reduced_mesh(model, meshes[i], system, i, x, q) for i, x in zip(stages, tangents, strict=True)]
    stiffness = system.stiffness + sum(mesh.stiffness for mesh in of_stages)
    damping = system.damping[0] + sum(mesh.damping for mesh in of_stages)
    if system.centrifugal is not None:
        stiffness = stiffness + system.centrifugal[0]
    gyroscopic, centrifugal = (system.damping[1] - system.damping[0]) / speed, _centrifugal_stiffness(system, speed)
    system = _beside_rings(system, rings)
    measures = np.array([mesh.rows for mesh in of_stages]) @ system.motions
    measures = measures if np.abs(measures[:, 1:3]).max() > 0 else measures[:, [0, 3]]
    turning = Turning(
        speed, system.reduced(gyroscopic), system.reduced(centrifugal), system.motions.T @ _centrifugal_load(model)
    )
    mass, stiffness, damping = (system.reduced(matrix) for matrix in (system.mass, stiffness, damping))
    blocks = modal_blocks(mass, stiffness, damping, measures, system.rigid, turning)
    mesh_cycles = float(model.mesh_cycles[stages[0]])
    exciting, angle = _exciting(model, of_stages, stages, cycles, rings, blocks.first.size)
    steady = SteadySystem(tuple(exciting), blocks, mesh_cycles, variation, rings)
    q[rings.indices] = 0.0
    motions = np.hstack([system.motions @ blocks.coordinates, rings.coordinates(q.size)])
    return Reduction(steady, [*stages], q, motions, angle / mesh_cycles)


def _exciting(
    model: Model,
    meshes: Sequence["ReducedMesh"],
    stages: Sequence[int],
    cycles: Sequence[int],
    rings: RingBlocks,
    blocks: int,
) -> tuple[list[ExcitingMesh], float]:
    """The meshes of stages from the phase 0 of the first on; turn of the driving shaft to there, in cycles of it.

    cycles   of each in the common period
    blocks   number of blocks of the linear system
    """
    senses = [_sense(model, model.meshes[stage]) for stage in stages]
    back = senses[0] * meshes[0].phase / cycles[0]
    exciting = []
    for stage, mesh, number, sense in zip(stages, meshes, cycles, senses, strict=True):
        ring = _passed(model, stage, rings, blocks)
        # On a ring the phase tells the position, too.
        phase = mesh.phase - sense * number * back
        phase = phase if ring else phase % mesh.law.pitches
        exciting.append(ExcitingMesh(mesh.law, mesh.equilibrium, phase, number, sense, ring))
    return exciting, -back * cycles[0]


def _passed(model: Model, stage: int, rings: RingBlocks, blocks: int) -> PassedRing | None:
    """The elastic ring of a stage; None without."""
    ring = ring_in_mesh(model.rings, model.gearbox, stage)
    if ring is None:
        return None
    return passed_ring(ring, rings, model.rings[model.gearbox.stages[stage].slow.name].indices, blocks)


def _beside_rings(system: LinearSystem, rings: RingBlocks) -> LinearSystem:
    """The system with only those motions in which elastic rings are at rest."""
    if rings.number == 0:
        return system
    still = scipy.linalg.null_space(system.motions[rings.indices])
    return replace(system, motions=system.motions @ still, rigid=still.T @ system.rigid)


def _sense(model: Model, mesh: Mesh) -> int:
    """+1 where the phase of a mesh rises as the driving shaft turns on, -1 where it falls."""
    ratios, stage = model.gearbox.ratios, mesh.stage
    against_carrier = ratios[stage.fast.name] - (ratios[stage.carrier.name] if stage.carrier else 0)
    return 1 if mesh.frame.direction * against_carrier > 0 else -1


def _centrifugal_stiffness(system: LinearSystem, speed: float) -> np.ndarray:
    """(n, n) stiffness that the turning of a carrier's frame adds per (rad/s)^2 of the driving shaft."""
    return np.zeros_like(system.stiffness) if system.centrifugal is None else system.centrifugal[0] / speed**2


def _centrifugal_load(model: Model) -> np.ndarray:
    """(n,) centrifugal forces of the planets on pins per (rad/s)^2 of the driving shaft [N s^2]."""
    load = np.zeros(model.bare_mbs.systemData.ODE2Size())
    for pin in model.pins:
        ratio = float(model.gearbox.ratios[pin.carrier.name])
        first = moving_of(model, pin.planet.name).start
        load[first : first + 2] = pin.planet.mass * ratio**2 * np.asarray(pin.position[:2])
    return load


class ReducedMesh(NamedTuple):
    """A mesh that excites: its law at its offsets, and what it leaves to the linear system.

    phase                in the equilibrium
    rows                 (4, n) as `measures_of`
    stiffness, damping   (n, n) mean stiffness that the law does not contain and its mean, less the tangents of the mesh
    """

    law: MeshForce
    equilibrium: MeshEquilibrium
    phase: float
    rows: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray


def _reduced_mesh(
    model: Model, mesh: Mesh, system: LinearSystem, stage: int, tangent: MeshTangent, q: np.ndarray
) -> ReducedMesh:
    """The mesh of a stage, whose tangent in the linear system is its mean over the mesh cycle, at coordinates q."""
    force = float(system.mesh_force[stage])
    label = model.gearbox.labels[stage]
    apart = f"load: in equilibrium the teeth of stage {label} do not touch, though those beside it carry load"
    require(force != 0, f"{apart}; take a larger load, or smaller errors of the pins")
    side = 1.0 if force > 0 else -1.0
    rows, measures = measures_of(model, mesh, side, q)
    law = _law_at(mesh.law, measures.offsets)
    mean = np.diag([tangent.stiffness, 0.0, _tilting_stiffness(mesh.law, law, force), 0.0])
    stiffness = rows.T @ mean @ rows + force * curvature_of(model, mesh, side, q) - system.elements[stage].stiffness
    damping = -tangent.damping * np.outer(system.rows[stage], system.rows[stage])
    bent = _bent_ring(model, stage, side, measures.phase, q)
    equilibrium = _equilibrium(law, mesh, measures, force, tangent, bent)
    return ReducedMesh(law, equilibrium, measures.phase, rows, stiffness, damping)


def exciting_stages(model: Model, stages: Sequence[int], idle: Sequence[str]) -> list[int]:
    """Numbers of stages, followed by those that share a mesh frequency with them.

    Raises ValueError where one is idle, or turns as a block.

    idle   labels of the stages whose meshes carry nothing: they do not excite
    """
    labels, frequencies = model.gearbox.labels, model.mesh_cycles
    unloaded = [labels[stage] for stage in stages if labels[stage] in idle]
    remedy = "load the shafts behind it, loads={shaft: torque}, or choose another stage"
    require(not unloaded, f"stage {', '.join(unloaded)} is idle under these loads, its teeth are open; {remedy}")
    standing = [labels[stage] for stage in stages if frequencies[stage] < ROUNDING * frequencies.max(initial=1.0)]
    block = f"the teeth of stage {', '.join(standing)} stand in their mesh at these speeds, its members turn as a block"
    require(not standing, f"{block}; choose another stage, or other speeds of the gearbox")
    shared = np.isclose(frequencies[:, None], frequencies[[*stages]], ROUNDING, 0.0).any(axis=1)
    further = [int(number) for number in np.flatnonzero(shared) if labels[number] not in idle]
    return [*stages, *(number for number in further if number not in stages)]


def common_period(model: Model, stages: Sequence[int]) -> list[int]:
    """Numbers of mesh cycles of stages in their shortest common period, in which laws and elastic rings repeat, too.

    Raises ValueError where it takes more than `LONGEST_PERIOD` cycles of the first of them.
    """
    cycles = model.mesh_cycles[[*stages]] / model.mesh_cycles[stages[0]]
    ratios = [Fraction(x).limit_denominator(LONGEST_PERIOD) for x in cycles]
    pitches = [_repeating(model, stage) for stage in stages]
    periods = [ratio.denominator * (n // gcd(n, ratio.numerator)) for ratio, n in zip(ratios, pitches, strict=True)]
    period = lcm(*periods)
    common = period <= LONGEST_PERIOD and np.allclose([float(ratio) for ratio in ratios], cycles, ROUNDING, 0.0)
    free = [*model.gearbox.independent]
    ratio = f" at these speeds of {free}" if len(free) > 1 else ""
    shorter = f"stage must hold stages with a common period of at most {LONGEST_PERIOD} mesh cycles{ratio}"
    several = f", which repeat over {pitches} pitches" if max(pitches) > 1 else ""
    remedy = "take fewer of them at a time" + (", laws over fewer pitches, rings without modes" if several else "")
    require(common, f"{shorter}, got {[*stages]}{several}; {remedy}, or exugear.run_up over a slow ramp")
    return [int(period * ratio) for ratio in ratios]


def _repeating(model: Model, stage: int) -> int:
    """Mesh cycles after which a mesh repeats: the pitches of its law, and the teeth of an elastic ring."""
    of_stage, law = model.gearbox.stages[stage], model.plan.laws[model.gearbox.labels[stage]]
    return lcm(law.pitches, abs(of_stage.pair.wheel.z)) if of_stage.slow.name in model.rings else law.pitches


def _variation(mbs, mesh: Mesh) -> float:
    """Range of the tangent stiffness of a mesh over its cycle, over twice its mean."""
    phases = averaged_phases(mesh.law.pitches, PHASES)
    stiffness = [mesh_tangent(mbs, mesh.contact, phase)[1].stiffness for phase in phases]
    return float(np.ptp(stiffness) / 2 / np.mean(stiffness))


def _bent_ring(model: Model, stage: int, side: float, phase: float, q: np.ndarray) -> tuple[float, float]:
    """How far an elastic ring bends in the mesh of a stage [m], and its slope per pitch, at coordinates q; 0 if rigid.

    side, phase   of the loaded flank, +1 or -1; of the driving flank
    """
    ring = ring_in_mesh(model.rings, model.gearbox, stage)
    if ring is None:
        return 0.0, 0.0
    built = model.rings[model.gearbox.stages[stage].slow.name]
    blocks = ring_blocks([(built.elastic, built.indices)])
    shape, slope = passed_ring(ring, blocks, built.indices, 0).shape_at(side, phase)
    amplitudes = q[built.indices] * blocks.scale
    return float(shape @ amplitudes), float(slope @ amplitudes)


def _equilibrium(
    law: MeshForce,
    mesh: Mesh,
    measures: Measures,
    force: float,
    tangent: MeshTangent,
    bent: tuple[float, float],
) -> MeshEquilibrium:
    """The equilibrium of a mesh at its measures, with a force [N] and its mean tangent.

    bent   as `_bent_ring`
    """
    side, opening = 1.0 if force > 0 else -1.0, _opening(mesh, measures.offsets)
    phase, deflection = measures.phase, measures.dte - bent[0]
    if side < 0:
        phase, deflection = law.back_phase - phase, -(deflection + law.backlash) - 2 * opening
    of_flank = law.flank_at(side)
    of_law = of_flank.fixed_offsets.get("misalignment", 0.0)
    lever = measures.offsets.get("misalignment", of_law) - of_law
    static = static_at(of_flank.table.head, phase, deflection, lever)
    slopes = {"by_phase": side * static.by_phase - force * bent[1], "by_misalignment": static.by_lever}
    return MeshEquilibrium(force, measures.dte, tangent.stiffness, **slopes, lever=lever, opening=opening, side=side)


def _law_at(law: MeshForce, offsets: dict[str, float]) -> MeshForce:
    """A law at offsets, those of each flank clamped to its axes."""
    if law.coast is None:
        return law.flank_at(1, **_within(law, offsets))
    return replace(law.flank_at(1, **_within(law, offsets)), coast=_law_at(law.coast, offsets))


def _within(law: MeshForce, offsets: dict[str, float]) -> dict[str, float]:
    """Offsets clamped to the axes of a law."""
    return {name: float(np.clip(offsets[name], axis[0], axis[-1])) for name, axis in law.offsets.items()}


def _tilting_stiffness(law: MeshForce, at_offsets: MeshForce, force: float) -> float:
    """Mean over the mesh cycle of `tilting_stiffness_at` under a force [N]; 0 of a law of first order."""
    side = 1 if force > 0 else -1
    law, at_offsets = law.flank_at(side), at_offsets.flank_at(side)
    if "misalignment" not in law.offsets:
        return 0.0
    axis, offsets = law.offsets["misalignment"], {"a": 0.0, "axial": 0.0} | dict(at_offsets.fixed_offsets)
    offsets["misalignment"] = float(np.clip(offsets["misalignment"], axis[0] + STEP, axis[-1] - STEP))
    values = tuple(offsets[name] for name in OFFSETS)
    phases = averaged_phases(law.pitches, PHASES)
    deflections = [at_offsets.deflection_at(phase, abs(force)) for phase in phases]
    tables = law.table.head, at_offsets.table.head
    return float(np.mean([tilting_stiffness_at(*tables, *x, values) for x in zip(phases, deflections, strict=True)]))


def _opening(mesh: Mesh, offsets: dict[str, float]) -> float:
    """Opening of either flank [m] by a centre distance beside the nominal one."""
    if not offsets:
        return 0.0
    r_b = mesh.stage.pair.pinion.r_b + mesh.stage.pair.wheel.r_b
    return r_b * (involute(acos(r_b / offsets["a"])) - float(mesh.frame.inv_alpha_wt))


def check_reducible(model: Model) -> None:
    """Require a gearbox without friction and drag, whose torques depend on the speed.

    In the frame that turns with the carrier of planets on pins, stages beside the set whose shafts stand on bearings
    would change their direction.
    """
    kinds, carriers = model.plan.shafts, model.gearbox.carriers_of_pins
    for label, stage in zip(model.gearbox.labels, model.gearbox.stages, strict=True):
        on_bearings = [shaft.name for shaft in stage.shafts if kinds[shaft.name].on_bearings]
        of_set = stage.carrier is not None and stage.carrier.name in carriers
        axes = [x.name for x in stage.shafts if x.name not in model.gearbox.planets and x.offset != NO_DISPLACEMENT]
        turning = f"the axes of {axes} lie beside the others, which turns in the frame of the carrier once a revolution"
        require(not (stage.carrier and axes), f"{turning}; leave out their offset=, or take exugear.run")
        beside = f"stage {label} stands beside a set on pins, its shafts must only spin, {on_bearings} move"
        require(not (carriers and not of_set and on_bearings), f"{beside}; leave out their bearings, or the pins")
    rubbing = [label for label, stage in zip(model.gearbox.labels, model.gearbox.stages, strict=True) if stage.friction]
    require(not rubbing, f"model must be without friction, stages {rubbing} rub; build the gearbox without friction=")
    unbalanced = [shaft.name for shaft in model.gearbox.shafts if shaft.unbalances]
    once = f"model must be without unbalance, which acts once a turn, got it on {unbalanced}"
    require(not unbalanced, f"{once}; build it without Unbalance, or take exugear.run_up over a slow ramp")
    braked = [shaft.name for shaft in model.gearbox.shafts if shaft.drags]
    require(not braked, f"model must be without drag, shafts {braked} are braked; build it without drag= and Drag")
