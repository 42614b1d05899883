"""Rolling bearings in Exudyn: user functions whose compiled kernel reads the energy law, with a predictor for steps.

What Exudyn does. Newton's iteration begins each step at q + h v + h^2 (1/2 - beta) a, without the acceleration at its
end, and keeps its matrix over many steps. A linear bearing is in that matrix, so that the first iteration ends at the
solution; of a nonlinear one that carries, the tangent changes on the way, which costs further iterations.

Predictor. The acceleration of the last step follows from the velocities of the first call and of the last one before,
a = 2 (v - v_last) / h. The first call of a step evaluates the reaction R at the end of the step by that acceleration,
q + beta h^2 a and v + gamma h a, and returns R + J a with the share J of the bearing in the kept matrix: then the first
iteration ends where the linearization about that end has its solution. All further calls return the reaction in their
state, so that the residual that ends the iteration is true: a poor guess costs an iteration and no accuracy.
"""

from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from exugear.gearbox.bearing_law import tangent_stiffness
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.mesh_force.kernel_records import record_type
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.direct_call import direct
from exugear.multibody.integrator_steps import SAME_STEP
from exugear.multibody.user_function_errors import Diverged, errors_kept
from exugear.planning.integrator_and_step import GAMMA, Rule
from exugear.rolling_bearings.law import FAR, LAW, reaction
from fem.support.numba_cache import compiled, kept

#: Key under which a system keeps the steps of its rolling bearings.
BEARINGS = "rolling bearings"
#: A bearing in the steps of an integrator. duration: of a step [s], 0 without predictor; displacement and rate per
#: acceleration at the end of a step [s^2, s]; time of the last call [s] and velocities (5) in it; share (5, 5) in the
#: matrix of Newton's iteration, force per acceleration.
BEARING_STEPS = record_type(
    *((name, "f8") for name in ("duration", "by_acceleration", "rate_by_acceleration", "last_time")),
    *(("last_rates", "f8", 5), ("last_accelerations", "f8", 5), ("matrix", "f8", (5, 5))),
)
law_at, steps_at = reader(LAW), reader(BEARING_STEPS)


def add_rolling_bearing(mbs, node: int, bearing: RollingBearing, lever: float) -> Any:
    """The object of a rolling bearing a lever [m] above the centre of mass of the body on a node."""
    force, jacobian, (law, steps) = rolling_functions(bearing, lever)
    mbs.variables[BEARINGS] = [*mbs.variables.get(BEARINGS, []), steps]
    force = direct(errors_kept(mbs, force), rolling_bearing_kernel, (law.record, steps), 6, pointed_to=law)
    return eii.ObjectGenericODE2(nodeNumbers=[node], forceUserFunction=force, jacobianUserFunction=jacobian)


def rolling_functions(bearing: RollingBearing, lever: float):
    """Force and Jacobian of a rolling bearing for Exudyn, and the records that its kernel takes.

    lever   axial distance of the bearing from the shaft's centre of mass [m]

    The Jacobian leaves out the change of the damping with the displacement.
    """
    law, steps = bearing.record_of_runs(lever), np.zeros(1, BEARING_STEPS)[0]
    addresses = address_of(law.record), address_of(steps)

    def rolling_force(mbs, t, item, q, q_t):
        try:
            return rolling_bearing_kernel(*addresses, t, *q, *q_t)
        except ValueError as error:
            raise Diverged(f"displacement {error.args[0]:.4g} m of a rolling bearing is beyond all bounds") from None

    def rolling_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        matrix = (factor + factor_t * bearing.damping_time) * tangent_stiffness(bearing, lever, np.array(q))
        if steps.duration:
            steps.matrix = matrix[:5, :5]
        return matrix

    return rolling_force, rolling_jacobian, (law, steps)


def predict_bearings(mbs, rule: Rule | None) -> None:
    """Let the rolling bearings of a system predict the steps of a rule; None: no further step."""
    for steps in mbs.variables.get(BEARINGS, []):
        steps.duration, steps.last_time, steps.matrix = 0.0, np.nan, 0.0
        if rule is not None:
            h = rule.step
            steps.duration, steps.by_acceleration, steps.rate_by_acceleration = h, rule.beta * h**2, GAMMA * h


@compiled
def expected(steps, i, rate):
    """Acceleration to expect at the end of a step, of a coordinate with its rate in the first call."""
    before = 2.0 * (rate - steps.last_rates[i]) / steps.duration
    change = before - steps.last_accelerations[i]
    steps.last_accelerations[i] = before
    return before + change


@compiled
def predicted_reaction(law, steps, t, q, q_t, spin):
    """`reaction` for a step: at its end in the first call, with the share of the bearing in the kept matrix."""
    h, begins = steps.duration, abs(t - steps.last_time - steps.duration)
    steps.last_time = t
    if h == 0.0 or not begins < SAME_STEP * h:
        for i in range(5):
            steps.last_rates[i] = q_t[i]
        return reaction(law, q, q_t, spin)
    a_x, a_y, a_z = expected(steps, 0, q_t[0]), expected(steps, 1, q_t[1]), expected(steps, 2, q_t[2])
    a_a, a_b = expected(steps, 3, q_t[3]), expected(steps, 4, q_t[4])
    d, r, m = steps.by_acceleration, steps.rate_by_acceleration, steps.matrix
    ahead = q[0] + d * a_x, q[1] + d * a_y, q[2] + d * a_z, q[3] + d * a_a, q[4] + d * a_b
    rates = q_t[0] + r * a_x, q_t[1] + r * a_y, q_t[2] + r * a_z, q_t[3] + r * a_a, q_t[4] + r * a_b
    f = reaction(law, ahead, rates, spin)
    return (
        f[0] + m[0, 0] * a_x + m[0, 1] * a_y + m[0, 2] * a_z + m[0, 3] * a_a + m[0, 4] * a_b,
        f[1] + m[1, 0] * a_x + m[1, 1] * a_y + m[1, 2] * a_z + m[1, 3] * a_a + m[1, 4] * a_b,
        f[2] + m[2, 0] * a_x + m[2, 1] * a_y + m[2, 2] * a_z + m[2, 3] * a_a + m[2, 4] * a_b,
        f[3] + m[3, 0] * a_x + m[3, 1] * a_y + m[3, 2] * a_z + m[3, 3] * a_a + m[3, 4] * a_b,
        f[4] + m[4, 0] * a_x + m[4, 1] * a_y + m[4, 2] * a_z + m[4, 3] * a_a + m[4, 4] * a_b,
        f[5],
    )


@kept
def rolling_bearing_kernel(record, steps_record, t, *x):
    """Generalized forces (6) of a rolling bearing on a shaft, first order in the tilts.

    record         address of a `LAW`
    steps_record   address of `BEARING_STEPS`
    x              coordinates of the shaft's centre of mass (x, y, z, tilts, spin) and their rates

    Raises ValueError(displacement) beyond all bounds.
    """
    far = abs(x[0]) + abs(x[1]) + abs(x[2])
    if not far <= FAR:
        raise ValueError(far)
    q, q_t = (x[0], x[1], x[2], x[3], x[4]), (x[6], x[7], x[8], x[9], x[10])
    return predicted_reaction(law_at(record), steps_at(steps_record), t, q, q_t, x[5])
