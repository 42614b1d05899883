"""What a scene needs: coordinates, integrator, step; and what it will cost."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import pi, sqrt

from exugear.gearbox import Gearbox
from fem.gear import require_within

#: Newmark beta = 1/12, gamma = 1/2 (Fox & Goodwin 1949): fourth order, stable for omega h below this.
STABLE = sqrt(6)
BETA, GAMMA = 1 / 12, 1 / 2
#: omega_mesh h and 1 / steps per mesh cycle at tolerance 1e-3; half of it was measured (tests/test_run.py, slow).
ANGLE_AT_1E3, CYCLE_SHARE_AT_1E3 = 0.55, 1 / 15
SPIN_COST, BODY_COST = 4e-6, 13e-6


class Coordinates(Enum):
    """What a shaft may do."""

    SPIN = "1 coordinate, spin about z"
    BEARINGS = "6 coordinates, rigid body on elastic bearings"
    JOINT = "6 coordinates, rigid body on an ideal revolute joint"


@dataclass(frozen=True)
class Plan:
    """How a gearbox becomes a model; print it.

    shafts      coordinates per shaft
    why         reason per shaft
    meshes      number of meshes
    omega       bound on the highest eigenfrequency of the built model, meshes at their stiffest [rad/s]; 0: not built
    omega_mesh  the highest of a mesh between its two freely spinning shafts [rad/s]; 0: not built
    """

    shafts: Mapping[str, Coordinates]
    why: Mapping[str, str]
    meshes: int
    omega: float = 0.0
    omega_mesh: float = 0.0

    def with_joints(self) -> "Plan":
        """The unreduced plan: every shaft a rigid body in space on an ideal revolute joint."""
        why = dict.fromkeys(self.shafts, "asked for: unreduced, to check the reduced one")
        return replace(self, shafts=dict.fromkeys(self.shafts, Coordinates.JOINT), why=why, omega=0.0, omega_mesh=0.0)

    @property
    def largest_step(self) -> float:
        """Step at which the integrator loses stability [s]."""
        return STABLE / self.omega

    def step(self, tolerance: float = 1e-3, mesh_frequency: float = 0.0) -> float:
        """Step [s] for a tolerance of the windowed rms of the DTE up to a mesh frequency [Hz]; fourth order."""
        require_within("tolerance", tolerance, 1e-9, 0.1, remedy="(relative error of the rms: 1e-3)")
        finer = (tolerance / 1e-3) ** 0.25
        cycle = CYCLE_SHARE_AT_1E3 * finer / mesh_frequency if mesh_frequency > 0 else 1.0
        return min(ANGLE_AT_1E3 * finer / self.omega_mesh, cycle, 0.95 * self.largest_step)

    @property
    def step_cost(self) -> float:
        """Estimated wall time of a step [s], measured on a two-core machine for one mesh."""
        spins = all(kind is Coordinates.SPIN for kind in self.shafts.values())
        return self.meshes * (SPIN_COST if spins else BODY_COST)

    def cost(self, duration: float, step: float) -> str:
        """Number of steps and estimated wall time."""
        steps = duration / step
        return f"{duration:g} s in {steps:.3g} steps of {step:.3g} s: about {steps * self.step_cost:.3g} s"

    def __str__(self) -> str:
        lines = [f"{name}: {kind.value} ({self.why[name]})" for name, kind in self.shafts.items()]
        lines.append("integrator: Newmark beta = 1/12, gamma = 1/2 (fourth order, conditionally stable), index 2")
        if self.omega:
            lines.append(f"highest eigenfrequency: below {self.omega / 2 / pi:.4g} Hz")
            lines.append(f"largest stable step: {self.largest_step:.3g} s")
            lines.append(f"tolerance 1e-3: {self.cost(1.0, self.step())}")
        else:
            lines.append("step: known once the model is built (build(box).plan)")
        return "\n".join(lines)


def plan(gearbox: Gearbox) -> Plan:
    """Coordinates that the scene needs, and why: what is absent is skipped."""
    ideal = Coordinates.JOINT if any(shaft.bearings for shaft in gearbox.shafts) else Coordinates.SPIN
    shafts = {shaft.name: Coordinates.BEARINGS if shaft.bearings else ideal for shaft in gearbox.shafts}
    reasons = {ideal: "no bearings given: ideal ones", Coordinates.BEARINGS: "it has elastic bearings"}
    return Plan(shafts, {name: reasons[kind] for name, kind in shafts.items()}, len(gearbox.stages))
