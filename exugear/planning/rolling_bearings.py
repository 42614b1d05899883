"""What the plan says of rolling bearings: whether a load leaves their linear range, and what of them is estimated."""

from collections.abc import Mapping

import numpy as np

from exugear.gearbox.bearing_law import tangent_stiffness
from exugear.gearbox.constant_loads import words_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft
from exugear.planning.coordinates import Coordinates
from exugear.planning.map_axes import push_on_shafts, static_displacement_or_inf
from fem.units import mm

#: Difference of displacements, over the largest, up to which bearings count as linear.
LINEAR = 0.01
#: Least eigenvalue of a stiffness, over the largest, of bearings that hold a shaft at rest.
HOLDS = 1e-6
KEEP = "so that bearing.displaced([0] * 5).linear would do in runs"


def words_on_rolling_bearings(
    gearbox: Gearbox, shafts: Mapping[str, Coordinates], loads: Mapping[str, float]
) -> dict[str, str]:
    """What to say of the rolling bearings of each shaft that has some, under loads [N m] by their names."""
    on_rolling_bearings = [shaft for shaft in gearbox.shafts if _rolling(shaft) and shafts[shaft.name].on_bearings]
    push = push_on_shafts(gearbox, loads) if on_rolling_bearings else {}
    return {
        shaft.name: "; ".join([
            f"rolling bearings, under {words_of(gearbox, loads)} {_range(shaft, push[shaft.name])}",
            *_estimates(shaft),
        ])
        for shaft in on_rolling_bearings
    }  # fmt: skip


def _rolling(shaft: Shaft) -> dict[float, RollingBearing]:
    return {axial: x for axial, x in shaft.bearings.items() if isinstance(x, RollingBearing)}


def _estimates(shaft: Shaft) -> list[str]:
    """What is estimated of the bearings of a shaft."""
    rolling = _rolling(shaft).items()
    return [f"{x.kind} at {axial / mm:g} mm, {x.estimate}" for axial, x in rolling if x.estimate]


def _range(shaft: Shaft, push: np.ndarray) -> str:
    """Whether a push (6,) [N, N m] on the centre of mass leaves the linear range of the bearings, in words."""
    at_rest = [
        tangent_stiffness(bearing, axial - shaft.centre, np.zeros(6)) for axial, bearing in shaft.bearings.items()
    ]
    arm = np.r_[1.0, 1.0, 1.0, np.full(2, 1 / max(row.R for x in _rolling(shaft).values() for row in x.rows))]
    stiffness = np.sum(at_rest, axis=0)[:5, :5] * np.outer(arm, arm)
    eigenvalues = np.linalg.eigvalsh(stiffness)
    if not eigenvalues[0] > HOLDS * eigenvalues[-1]:
        return "not linear: the bearings do not hold the shaft at rest"
    linear = np.linalg.solve(stiffness, arm * push[:5])
    displacement = static_displacement_or_inf(shaft, push, range(5))[:5] / arm
    size = np.abs(displacement).max()
    if not np.isfinite(size):
        return "they do not carry the load"
    difference = np.abs(linear - displacement).max() / size if size else 0.0
    if difference <= LINEAR:
        return f"linear to {difference:.1%} of the displacement, {KEEP}"
    return f"not linear: the displacement is {difference:.0%} off that by the stiffness at rest"
