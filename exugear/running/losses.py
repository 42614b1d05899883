"""Power that the damping of bearings and couplings dissipates; that of the meshes is recorded."""

from collections.abc import Mapping

import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_stiffness import linear_part, radial_stiffness
from exugear.gearbox.shaft import Shaft
from exugear.multibody.model import Model
from exugear.running.recorded_motion import ShaftMotion
from exugear.running.stored_energy import coupling_twists, couplings_of, radial_motion


def coupling_losses(model: Model, motions: Mapping[str, ShaftMotion]) -> dict[str, np.ndarray]:
    """(n,) power [W] that each coupling dissipates, named as in `couplings_of`."""
    damping = {name: rotor.coupling.damping for name, rotor in couplings_of(model).items()}
    return {name: damping[name] * rate**2 for name, (_, rate) in coupling_twists(model, motions).items()}


def bearing_losses(shaft: Shaft, motion: ShaftMotion) -> dict[float, np.ndarray]:
    """(n,) power [W] that each bearing of a shaft dissipates, by its axial position [m]."""
    if motion.q is None or motion.q_t is None:
        return {}
    losses = {}
    for axial, bearing in shaft.bearings.items():
        stiffness = linear_part(bearing, axial - shaft.centre)[:5, :5]
        losses[axial] = bearing.damping * np.einsum("ni,ij,nj->n", motion.q_t, stiffness, motion.q_t)
        if not bearing.linear:
            at, rate = (radial_motion(x, axial - shaft.centre) for x in (motion.q, motion.q_t))
            losses[axial] = losses[axial] + _radial_loss(bearing, at, rate)
    return losses


def _radial_loss(bearing: Bearing, displacement: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Power of the damping of a nonlinear bearing in the radial plane, of displacements (n, 2) and rates (n, 2)."""
    r = np.linalg.norm(displacement, axis=1)
    slope, secant = radial_stiffness(bearing, r)
    radial_rate = (displacement * rate).sum(axis=1) / np.maximum(r, np.finfo(float).tiny)
    return bearing.damping * (slope * radial_rate**2 + secant * ((rate**2).sum(axis=1) - radial_rate**2))
