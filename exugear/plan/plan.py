"""What a scene needs: coordinates, integrator, step; and what it will cost."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.mesh_force.force import MeshForce
from exugear.plan.coordinates import Coordinates
from exugear.plan.integrator import ANGLE_AT_1E3, ANGLE_ON_BEARINGS_AT_1E3, BOUND_MARGIN, STABLE, Rule, rule
from exugear.plan.map_axes import stage_law
from exugear.plan.missing_offsets import missing_axes
from fem.support.arguments import Finite, checked

#: Wall time of a step per mesh on a two-core machine [s], bytes per sample and mesh.
COST = {Coordinates.SPIN: 4e-6, Coordinates.PLANAR: 8e-6, Coordinates.BEARINGS: 13e-6, Coordinates.JOINT: 13e-6}
SAMPLE = 48
SAMPLE_ON_BEARINGS = 130
ROUNDING = 1e-9
UNDAMPED = "damping: none, vibrations do not decay; give Stage(damping_ratio=0.06)"
JUMPS = "its force jumps at phase {}: at constant speed steps divide the mesh period; else smooth the table"


@checked
@dataclass(frozen=True)
class Plan:
    """How a gearbox becomes a model; print it.

    shafts      coordinates per shaft
    why         reason per shaft
    laws        force law of every stage by its label, with the axes that the scene needs
    axes        reason per stage
    undamped    whether no mesh, bearing or coupling is damped
    omega       bound on the highest eigenfrequency of the built model, meshes at their stiffest [rad/s]; 0: not built
    omega_mesh  the same of those in which meshes take part: what the step resolves [rad/s]; 0: not built
    contact     how Exudyn calls the contacts of the built model: without Python, or by way of it and why
    """

    shafts: Mapping[str, Coordinates]
    why: Mapping[str, str]
    laws: Mapping[str, MeshForce]
    axes: Mapping[str, str]
    undamped: bool = False
    omega: Finite = 0.0
    omega_mesh: Finite = 0.0
    contact: str = ""

    def with_joints(self) -> "Plan":
        """The unreduced plan: every shaft a rigid body in space on an ideal revolute joint."""
        why = dict.fromkeys(self.shafts, "asked for: unreduced, to check the reduced one")
        return replace(self, shafts=dict.fromkeys(self.shafts, Coordinates.JOINT), why=why, omega=0.0, omega_mesh=0.0)

    def with_bodies(self) -> "Plan":
        """The plan in which planar bodies move in space, to check the reduced one."""
        planar = [name for name, kind in self.shafts.items() if kind is Coordinates.PLANAR]
        why = dict(self.why) | dict.fromkeys(planar, "asked for: unreduced, to check the reduced one")
        shafts = dict(self.shafts) | dict.fromkeys(planar, Coordinates.BEARINGS)
        return replace(self, shafts=shafts, why=why, omega=0.0, omega_mesh=0.0)

    @property
    def largest_step(self) -> float:
        """Step at which the integrator loses stability [s]."""
        return STABLE / self.omega

    @checked
    def rule(self, tolerance: float = 1e-3, mesh_frequency: Finite = 0.0) -> Rule:
        """Integrator and step for a tolerance of the windowed rms of the DTE up to a mesh frequency [Hz]."""
        elastic = any(kind.on_bearings for kind in self.shafts.values())
        angle = ANGLE_ON_BEARINGS_AT_1E3 if elastic else ANGLE_AT_1E3
        return rule(self.omega_mesh, BOUND_MARGIN * self.largest_step, tolerance, mesh_frequency, angle)

    @checked
    def step(self, tolerance: float = 1e-3, mesh_frequency: Finite = 0.0) -> float:
        """Step [s] of that rule."""
        return self.rule(tolerance, mesh_frequency).step

    @checked
    def cost(self, duration: Finite, step: Finite, sample: Finite = 4e-5) -> str:
        """Number of steps, estimated wall time and memory."""
        kinds, meshes = set(self.shafts.values()), len(self.laws)
        steps, per_step = duration / step, meshes * max(COST[kind] for kind in kinds)
        size = SAMPLE_ON_BEARINGS if any(kind.on_bearings for kind in kinds) else SAMPLE
        memory = meshes * size * duration / max(sample, step) / 1e6
        about = f"about {steps * per_step:.3g} s, {memory:.3g} MB of samples"
        return f"{duration:g} s in {steps:.3g} steps of {step:.3g} s: {about}"

    def __str__(self) -> str:
        lines = [f"{name}: {kind.value} ({self.why[name]})" for name, kind in self.shafts.items()]
        lines += [f"{label}: {text}" for label, text in self.axes.items()]
        lines += [UNDAMPED] * self.undamped
        for label, law in self.laws.items():
            if law.jumps.size:
                lines.append(f"{label}: {JUMPS.format(', '.join(f'{x:.3f}' for x in law.jumps))}")
        if self.omega:
            lines.append(f"integrator: {self.rule()}")
            resolved = f"{self.omega_mesh / 2 / pi:.4g} Hz with meshes in them"
            lines.append(f"eigenfrequencies: below {self.omega / 2 / pi:.4g} Hz, {resolved}")
            lines.append(f"largest stable step: {self.largest_step:.3g} s")
            lines.append(f"tolerance 1e-3: {self.cost(1.0, self.step())}")
            lines.append(f"contact: {self.contact}")
        else:
            lines.append("integrator and step: known once the model is built (build(box).plan)")
        return "\n".join(lines)

    __repr__ = __str__


@checked
def plan(gearbox: Gearbox, *, load: float | None = None) -> Plan:
    """Coordinates and axes of the maps that the scene needs, and why: what is absent is skipped.

    load   on the driven shaft [N m], under which the plan tells how far gears move along axes that their maps lack; by
           default the largest that all maps carry

    Raises ValueError for displaced shafts whose map lacks the axis.
    """
    found = {shaft.name: _coordinates(gearbox, shaft) for shaft in gearbox.shafts}
    shafts = {name: kind for name, (kind, _) in found.items()}
    labelled = zip(gearbox.labels, gearbox.stages, strict=True)
    laws = {label: stage_law(gearbox, stage, shafts) for label, stage in labelled}
    why = {name: reason for name, (_, reason) in found.items()}
    lacking = dict(zip(laws, missing_axes(gearbox, shafts, load), strict=True))
    axes = {label: "; ".join(filter(None, (text, lacking[label]))) for label, (_, text) in laws.items()}
    return Plan(shafts, why, {label: law for label, (law, _) in laws.items()}, axes, _undamped(gearbox))


def _undamped(gearbox: Gearbox) -> bool:
    """Whether no mesh, bearing or coupling is damped."""
    parts = [part for shaft in gearbox.shafts for part in (shaft.coupling, *shaft.bearings.values()) if part]
    return not any(part.damping for part in (*parts, *(stage.force for stage in gearbox.stages)))


def _coordinates(gearbox: Gearbox, shaft: Shaft) -> tuple[Coordinates, str]:
    if not shaft.bearings:
        return Coordinates.SPIN, "no bearings given: ideal ones"
    tilted = _tilted_by(shaft, [stage for stage in gearbox.stages if shaft in (stage.fast, stage.slow)])
    if tilted:
        return Coordinates.BEARINGS, f"it has elastic bearings, and {tilted}"
    return Coordinates.PLANAR, "it has elastic bearings, and nothing tilts it or pushes it along its axis"


def _tilted_by(shaft: Shaft, stages: list[Stage]) -> str:
    """What moves a shaft out of its plane; empty where nothing does."""
    place, *others = shaft.gears
    about = sum((bearing.at(axial - place) for axial, bearing in shaft.bearings.items()), np.zeros((6, 6)))
    scale = np.sqrt(np.maximum(np.diag(about), np.finfo(float).tiny))
    coupled = np.abs(about / np.outer(scale, scale))[:2, 2:5].max() > ROUNDING
    laws = [stage.force for stage in stages]
    reasons = {
        "it carries several gears": bool(others),
        "helical gears push it along its axis": any(stage.pair.beta_b for stage in stages),
        "the force of its mesh wanders along the face": any(np.any(law.centroid) for law in laws),
        "its map has a misalignment axis": any("misalignment" in law.offsets for law in laws),
        "its mass lies beside the gear": abs(shaft.centre - place) > ROUNDING,
        "its bearings do not lie alike about the gear": bool(coupled),
        "a bearing is not linear": not all(bearing.linear for bearing in shaft.bearings.values()),
        "it stands askew": any(askew(stage) for stage in stages),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def askew(stage: Stage) -> bool:
    """Whether the shafts of a stage are tilted."""
    return any(shaft.offset.tilt_x or shaft.offset.tilt_y for shaft in (stage.fast, stage.slow))
