"""Rolling bearings in Exudyn: user functions whose compiled kernel reads the energy law.

Where they carry their tangent changes within a step: the first call of a step takes the reaction at its expected end
(`exugear.multibody.step_ends`).
"""

from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from exugear.gearbox.bearing_law import tangent_stiffness
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.direct_call import direct
from exugear.multibody.step_ends import StepEnds, at_step_end, for_newton, keep_step_ends
from exugear.multibody.user_function_errors import Diverged, errors_kept
from exugear.rolling_bearings.law import FAR, LAW, reaction
from fem.support.numba_cache import compiled, kept

#: Coordinates of a bearing beside the spin with which its cage rolls.
COORDINATES = 5
law_at = reader(LAW)


def add_rolling_bearing(mbs, node: int, bearing: RollingBearing, lever: float) -> Any:
    """The object of a rolling bearing a lever [m] above the centre of mass of the body on a node."""
    force, jacobian, (law, ends) = rolling_functions(bearing, lever)
    keep_step_ends(mbs, [ends])
    records, pointed_to = (law.record, ends.record), (law, ends)
    force = direct(errors_kept(mbs, force), rolling_bearing_kernel, records, 6, pointed_to=pointed_to)
    return eii.ObjectGenericODE2(nodeNumbers=[node], forceUserFunction=force, jacobianUserFunction=jacobian)


def rolling_functions(bearing: RollingBearing, lever: float):
    """Force and Jacobian of a rolling bearing for Exudyn, and the law and step ends that its kernel reads.

    lever   axial distance of the bearing from the shaft's centre of mass [m]

    The Jacobian leaves out the change of the damping with the displacement.
    """
    law, ends = bearing.record_of_runs(lever), StepEnds(COORDINATES)
    addresses = address_of(law.record), ends.address

    def rolling_force(mbs, t, item, q, q_t):
        try:
            return rolling_bearing_kernel(*addresses, t, *q, *q_t)
        except ValueError as error:
            raise Diverged(f"displacement {error.args[0]:.4g} m of a rolling bearing is beyond all bounds") from None

    def rolling_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        matrix = (factor + factor_t * bearing.damping_time) * tangent_stiffness(bearing, lever, np.array(q))
        ends.note(matrix[:COORDINATES, :COORDINATES])
        return matrix

    return rolling_force, rolling_jacobian, (law, ends)


@compiled
def reaction_in_step(law, ends, t, q, q_t, spin):
    """`reaction` for a step: at its expected end in the first call; ends: address of `STEP_ENDS`."""
    x = at_step_end(ends, t, q + q_t)
    f = reaction(law, (x[0], x[1], x[2], x[3], x[4]), (x[5], x[6], x[7], x[8], x[9]), spin)
    return for_newton(ends, f[:5]) + f[5:]


@kept
def rolling_bearing_kernel(record, ends, t, *x):
    """Generalized forces (6) of a rolling bearing on a shaft, first order in the tilts.

    record   address of a `LAW`
    ends     address of `STEP_ENDS`
    x        coordinates of the shaft's centre of mass (x, y, z, tilts, spin) and their rates

    Raises ValueError(displacement) beyond all bounds.
    """
    far = abs(x[0]) + abs(x[1]) + abs(x[2])
    if not far <= FAR:
        raise ValueError(far)
    q, q_t = (x[0], x[1], x[2], x[3], x[4]), (x[6], x[7], x[8], x[9], x[10])
    return reaction_in_step(law_at(record), ends, t, q, q_t, x[5])
