"""Static force and damping of a flank as means over a step, in which the teeth may begin or cease to touch.

A sample in the middle of the step would make the motion over a cycle jump in its slope whenever a further sample comes
into contact, which neither Newton's iteration nor the multipliers endure. Away from the loss of contact the sample and
the mean agree to the second order of the step.
"""

from typing import NamedTuple

from exugear.mesh_force.force_kernels import damping
from exugear.mesh_force.potential import centroid_at, extent_of, potential
from fem.support.numba_cache import compiled

#: Travel of the teeth in a step [m] below which means are the values in its middle.
LEAST_TRAVEL = 1e-10


class StepMean(NamedTuple):
    """Mean of a quantity over a step, and its slopes by the penetration in the middle and by the travel [per m]."""

    value: float
    by_penetration: float
    by_travel: float


class FlankSlopes(NamedTuple):
    """Slopes in the middle of a step: of potential and force by phase and lever, of the moment by the lever."""

    by_phase: float
    by_lever: float
    force_by_phase: float
    force_by_lever: float
    moment_by_lever: float


@compiled
def flank_means(table, cell, deflection, lever, travel):
    """`StepMean` of the static force [N] and of the damping coefficient [N s/m] of a flank, `FlankSlopes`.

    deflection   in the middle of the step [m]
    lever        misalignment beside that of the table [rad]
    travel       change of the deflection in the step [m]
    """
    middle = potential(table, 0, cell, deflection, lever)
    c, slopes = mean_damping(table, middle.penetration, travel), slopes_of(table, cell, deflection, middle)
    depth = abs(middle.penetration) / max(abs(travel), LEAST_TRAVEL)
    if depth >= 1.0 or abs(travel) < LEAST_TRAVEL:
        return StepMean(middle.force, middle.stiffness, 0.0), c, slopes
    after = potential(table, 0, cell, deflection + 0.5 * travel, lever)
    before = potential(table, 0, cell, deflection - 0.5 * travel, lever)
    mean = mean_between(before.energy, after.energy, before.force, after.force, travel)
    if depth <= 0.5:
        return mean, c, slopes
    share = 2.0 - 2.0 * depth
    side, excess = 1.0 if middle.penetration > 0.0 else -1.0, mean.value - middle.force
    by_penetration = -2.0 * side / abs(travel) * excess + share * mean.by_penetration + (1.0 - share) * middle.stiffness
    by_travel = 2.0 * depth / travel * excess + share * mean.by_travel
    return StepMean(middle.force + share * excess, by_penetration, by_travel), c, slopes


@compiled
def slopes_of(table, cell, deflection, u):
    """`FlankSlopes` from the `Potential` of a flank; no torque by the phase where the law does not conserve energy."""
    by_phase = u.by_phase if table.conserves != 0 else 0.0
    if table.has_centroid == 0 or u.penetration <= 0.0:
        return FlankSlopes(by_phase, 0.0, u.force_by_phase, 0.0, 0.0)
    extent = extent_of(table, 0, cell)
    centroid = centroid_at(table, 0, cell, extent, deflection - extent.unloaded)
    by_lever = -u.stiffness * centroid.value - u.force * centroid.by_deflection
    moment_by_lever = u.stiffness * centroid.value * centroid.value
    return FlankSlopes(by_phase, u.by_lever, u.force_by_phase, by_lever, moment_by_lever)


@compiled
def mean_between(integral_before, integral_after, before, after, travel):
    """`StepMean` of a function by its integrals and values at both ends of a step."""
    mean = (integral_after - integral_before) / travel
    return StepMean(mean, (after - before) / travel, (0.5 * (before + after) - mean) / travel)


@compiled
def mean_damping(table, penetration, travel):
    """`StepMean` of the damping coefficient [N s/m]: teeth travel further in a step than the depth of its ramp."""
    if abs(travel) < LEAST_TRAVEL:
        r = min(max(penetration / table.damping_ramp, 0.0), 1.0)
        return StepMean(damping(table, penetration), table.damping * 6.0 * r * (1.0 - r) / table.damping_ramp, 0.0)
    before, after = penetration - 0.5 * travel, penetration + 0.5 * travel
    integrals = damping_integral(table, before), damping_integral(table, after)
    return mean_between(integrals[0], integrals[1], damping(table, before), damping(table, after), travel)


@compiled
def damping_integral(table, penetration):
    """Integral of the damping coefficient over the penetration [N s]."""
    if penetration <= 0.0:
        return 0.0
    r = penetration / table.damping_ramp
    if r >= 1.0:
        return table.damping * (penetration - 0.5 * table.damping_ramp)
    return table.damping * table.damping_ramp * r * r * r * (1.0 - 0.5 * r)
