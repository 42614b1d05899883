"""The plan of a built model: integrator, step and cost, which follow from its eigenfrequencies."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import pi

from exugear.planning.coordinates import Coordinates
from exugear.planning.integrator_and_step import (
    ANGLE_AT_1E3,
    ANGLE_ON_BEARINGS_AT_1E3,
    BOUND_MARGIN,
    STABLE,
    Rule,
    rule_for,
)
from exugear.planning.linear_train import SEAM_TOLERANCE, settling_time
from exugear.planning.plan import Plan
from fem.support.arguments import Finite, checked

#: What an imposed speed means for the main resonance of a mesh.
IMPOSED = "{:.0f} Hz where the driving speed is imposed (infinite inertia), {:.0f} Hz where it is free"
#: Wall time of a step per mesh, measured on a two-core machine [s].
STEP_COST = {Coordinates.SPIN: 4e-6, Coordinates.PLANAR: 8e-6, Coordinates.BEARINGS: 13e-6, Coordinates.JOINT: 13e-6}
#: What an elastic coordinate and a rolling bearing add to the wall time of a step, likewise [s].
ELASTIC_COST, ROLLING_COST = 0.6e-6, 1.6e-6
#: Memory of a recorder per sample and mesh, of an elastic coordinate, and of the force of a bearing [bytes].
SAMPLE_SIZE, SAMPLE_SIZE_ON_BEARINGS, ELASTIC_SIZE, BEARING_SIZE = 72, 152, 8, 24


@checked
@dataclass(frozen=True)
class BuiltPlan(Plan):
    """The `Plan` of a built model, with integrator, step and cost, which need the built system; print it.

    omega       upper bound of all eigenfrequencies, meshes at their stiffest [rad/s]
    omega_mesh  upper bound for the modes in which meshes deform, which the step resolves [rad/s]
    contact     whether Exudyn calls the contacts without Python, or why by way of Python

    mesh_resonances   for each stage [Hz]: main resonance of its mesh with the speed of the driving shaft imposed, and
                      with that shaft free; the meshes have their mean stiffness at the largest torque of their maps.
                      All stages of a planetary set have the resonance of the set: the mode that strains its meshes most
    largest_torques   of these maps, on the pinions [N m], by stage
    supports, rolling numbers of bearings that shafts move on, and of rolling ones among them
    decay             rate [1/s] at which the slowest of the modes decays that the meshes excite; 0 without damping
    damping_ratio     least one of these modes
    """

    omega: Finite = field(kw_only=True)
    omega_mesh: Finite = field(kw_only=True)
    contact: str = field(kw_only=True)
    mesh_resonances: Mapping[str, tuple[float, float]] = field(kw_only=True)
    decay: Finite = field(kw_only=True)
    damping_ratio: Finite = field(kw_only=True)
    largest_torques: Mapping[str, float] = field(kw_only=True)
    supports: int = field(kw_only=True)
    rolling: int = field(kw_only=True)

    @property
    def scene(self) -> Plan:
        """The plan by which the model was built."""
        return Plan(**{field.name: getattr(self, field.name) for field in fields(Plan)})

    @property
    def on_bearings(self) -> bool:
        """Whether bearings carry at least one shaft."""
        return any(kind.on_bearings for kind in self.shafts.values())

    @property
    def largest_step(self) -> float:
        """Step at which the fourth-order integrator becomes unstable [s]."""
        return STABLE / self.omega

    @property
    def overlap(self) -> str:
        """How early the parts of a run with executor= start, in words."""
        if not self.decay:
            return "none, the run is serial: a mode that the meshes excite is not damped"
        settling = settling_time(self.decay, SEAM_TOLERANCE)
        return f"start {settling:.2g} s early and at least a segment, vibrations decay at {self.decay:.3g} 1/s"

    @checked
    def rule(self, tolerance: float = 1e-3, mesh_frequency: Finite = 0.0) -> Rule:
        """Integrator and step for a relative error of the windowed rms of the DTE, up to a mesh frequency [Hz]."""
        angle = ANGLE_ON_BEARINGS_AT_1E3 if self.on_bearings else ANGLE_AT_1E3
        of_shafts = min(self.steps.values(), default=1.0) * (tolerance / 1e-3) ** 0.25
        largest = min(BOUND_MARGIN * self.largest_step, of_shafts)
        return rule_for(self.omega_mesh, largest, tolerance, mesh_frequency, angle)

    @checked
    def step(self, tolerance: float = 1e-3, mesh_frequency: Finite = 0.0) -> float:
        """Step [s] of the integrator that `rule` chooses."""
        return self.rule(tolerance, mesh_frequency).step

    @checked
    def cost(self, duration: Finite, step: Finite, sample: Finite = 4e-5) -> str:
        """Number of steps, estimated wall time and memory of a run with a duration, step and sample interval [s]."""
        steps, memory = duration / step, self.memory(duration / max(sample, step)) / 1e6
        about = f"about {self.wall_time(steps):.3g} s, {memory:.3g} MB of samples"
        return f"{duration:g} s in {steps:.3g} steps of {step:.3g} s: {about}"

    def _resonances(self) -> list[str]:
        """The main resonances in words, of each planetary set once, with the load at which they are."""
        in_sets = {label: carrier for carrier, labels in self.set_stages.items() for label in labels}
        first = {labels[0]: carrier for carrier, labels in self.set_stages.items()}
        lines = []
        for label, resonance in self.mesh_resonances.items():
            if label in in_sets and label not in first:
                continue
            of = f"the planetary set on {first[label]}, all meshes together" if label in first else label
            pinion = f"the pinion of {label}" if label in first else "the pinion"
            at = f", at {self.largest_torques[label]:.4g} N m on {pinion}, the largest of the map"
            lines.append(f"resonance of {of}: {IMPOSED.format(*resonance)}{at}")
        return lines

    @checked
    def wall_time(self, steps: Finite) -> float:
        """Estimated wall time [s] of a number of steps; steps in which teeth touch or part take longer."""
        of_meshes = len(self.laws) * max(STEP_COST[kind] for kind in self.shafts.values())
        return steps * (of_meshes + ELASTIC_COST * self.elastic_coordinates + ROLLING_COST * self.rolling)

    @property
    def elastic_coordinates(self) -> int:
        """Number of elastic coordinates of all shafts, and of the housing."""
        of_housing = self.elastic_housing.size if self.elastic_housing else 0
        return of_housing + sum(elastic.elastic + elastic.torsion.modes for elastic in self.elastic.values())

    @checked
    def memory(self, samples: Finite) -> float:
        """Memory [bytes] of a number of samples."""
        of_mesh = SAMPLE_SIZE_ON_BEARINGS if self.on_bearings else SAMPLE_SIZE
        beside = ELASTIC_SIZE * self.elastic_coordinates + BEARING_SIZE * self.supports
        return samples * (len(self.laws) * of_mesh + beside)

    def __str__(self) -> str:
        resolved = f"those in which meshes deform below {self.omega_mesh / 2 / pi:.4g} Hz"
        lines = [
            *self.lines(),
            f"integrator: {self.rule()}",
            f"eigenfrequencies: below {self.omega / 2 / pi:.4g} Hz, {resolved}",
            *self._resonances(),
            f"largest stable step: {self.largest_step:.3g} s",
            f"tolerance 1e-3: {self.cost(1.0, self.step())}; parts of a run with executor=: {self.overlap}",
            f"contact: {self.contact}",
        ]
        return "\n".join(lines)

    __repr__ = __str__
