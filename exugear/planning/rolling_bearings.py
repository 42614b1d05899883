"""Rolling bearings in the plan: which shafts have linear ones in runs, and what of them is estimated.

Those of a shaft are linear where the load displaces it as by their stiffness at rest, within `LINEAR`, up to `DYNAMIC`
times the load, and where they push nothing at rest. Bearings whose cages roll are never taken as linear.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import potential, tangent_stiffness
from exugear.gearbox.constant_loads import words_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft, with_bearings
from exugear.planning.coordinates import Coordinates
from exugear.planning.map_axes import push_on_shafts, static_displacement_or_inf
from fem.support.validation import require
from fem.units import mm

#: Difference of displacements, over the largest, up to which bearings count as linear.
LINEAR = 0.01
#: Least eigenvalue of a stiffness, over the largest, of bearings that hold a shaft at rest.
HOLDS = 1e-6
#: Multiple of the load up to which bearings must be linear: teeth that part meet again with up to twice the load.
DYNAMIC = 2.0
LINEAR_IN_RUNS = "they are linear in runs (nonlinear: plan(..., linear_bearings=[]))"


class Range(NamedTuple):
    """The load beside the linear range of the rolling bearings of a shaft.

    difference   of displacements up to `DYNAMIC` times the load, over the largest; None without a linear range
    words        the same in words
    """

    difference: float | None
    words: str


def linear_in_runs(gearbox: Gearbox, shafts: Mapping[str, Coordinates], loads: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the shafts whose rolling bearings loads [N m] keep in their linear range.

    None of gearboxes with planets, a housing that yields or bearings between shafts.
    """
    by_name = {x.name: x for x in gearbox.shafts if _rolling(x) and shafts[x.name].on_bearings}
    if not (by_name and _simple(gearbox)):
        return ()
    push = push_on_shafts(gearbox, loads)
    standing = {name: x for name, x in by_name.items() if not any(b.cage_rolls for b in _rolling(x).values())}
    differences = {name: _range(shaft, push[name]).difference for name, shaft in standing.items()}
    return tuple(name for name, difference in differences.items() if difference is not None and difference <= LINEAR)


def with_linear_bearings(gearbox: Gearbox, names: Collection[str]) -> Gearbox:
    """The gearbox in which the rolling bearings of these shafts are linear.

    Raises ValueError for shafts without rolling bearings and for gearboxes in which that is not built.
    """
    missing = [name for name in names if not any(x.name == name and _rolling(x) for x in gearbox.shafts)]
    have = [shaft.name for shaft in gearbox.shafts if _rolling(shaft)]
    require(not missing, f"linear_bearings must name shafts on rolling bearings, got {missing}; there are {have}")
    if not names:
        return gearbox
    built = "linear_bearings must be empty for gearboxes with planets, a housing or bearings between shafts"
    require(_simple(gearbox), f"{built}, got {list(names)}")
    shafts = {shaft.name: shaft for shaft in gearbox.shafts}
    shafts |= {name: with_bearings(shafts[name], _linear) for name in names}
    of_force: dict[str, Any] = dict.fromkeys(("damping", "damping_ratio", "damping_ramp", "backlash"))
    stages = [
        replace(x, fast=shafts[x.fast.name], slow=shafts[x.slow.name], mesh=x.force, **of_force) for x in gearbox.stages
    ]
    ends: dict[str, Any] = {"driving": shafts[gearbox.driving.name], "driven": shafts[gearbox.driven.name]}
    return replace(gearbox, stages=tuple(stages), **ends)


def _linear(axial: float, bearing: Bearing | RollingBearing) -> Bearing | RollingBearing:
    """The bearing, linear if it is a rolling bearing; axial: its position on the shaft [m]."""
    return replace(bearing, linear=True) if isinstance(bearing, RollingBearing) else bearing


def _simple(gearbox: Gearbox) -> bool:
    """Whether the gearbox has shafts on bearings in a rigid housing alone, without planetary sets."""
    planetary = gearbox.sets or gearbox.held or gearbox.speeds or any(stage.carrier for stage in gearbox.stages)
    return not (planetary or gearbox.between or gearbox.housing)


def words_on_rolling_bearings(
    gearbox: Gearbox, shafts: Mapping[str, Coordinates], loads: Mapping[str, float], linear: Collection[str] = ()
) -> dict[str, str]:
    """What to say of the rolling bearings of each shaft on such bearings, under loads [N m] by their names.

    linear   names of the shafts whose bearings are linear in runs
    """
    on_rolling_bearings = [shaft for shaft in gearbox.shafts if _rolling(shaft) and shafts[shaft.name].on_bearings]
    push = push_on_shafts(gearbox, loads) if on_rolling_bearings else {}
    return {
        shaft.name: "; ".join([
            f"rolling bearings, under {words_of(gearbox, loads)} {_range(shaft, push[shaft.name]).words}",
            *([LINEAR_IN_RUNS] * (shaft.name in linear)),
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


def _range(shaft: Shaft, push: np.ndarray) -> Range:
    """How far a push (6,) [N, N m] on the centre of mass leaves the linear range of the bearings."""
    at_rest = [
        tangent_stiffness(bearing, axial - shaft.centre, np.zeros(6)) for axial, bearing in shaft.bearings.items()
    ]
    arm = np.r_[1.0, 1.0, 1.0, np.full(2, 1 / max(row.R for x in _rolling(shaft).values() for row in x.rows))]
    stiffness = np.sum(at_rest, axis=0)[:5, :5] * np.outer(arm, arm)
    eigenvalues = np.linalg.eigvalsh(stiffness)
    if not eigenvalues[0] > HOLDS * eigenvalues[-1]:
        return Range(None, "not linear: the bearings do not hold the shaft at rest")
    if _preload(shaft) > LINEAR * np.linalg.norm(push[:3]):
        return Range(None, "not linear: the bearings press against each other at rest")
    if not np.isfinite(static_displacement_or_inf(shaft, push, range(5))).all():
        return Range(None, "they do not carry the load")
    differences = []
    for share in (1.0, DYNAMIC):
        linear = np.linalg.solve(stiffness, arm * share * push[:5])
        displacement = static_displacement_or_inf(shaft, share * push, range(5))[:5] / arm
        size = np.abs(displacement).max()
        apart = np.abs(linear - displacement).max() / size if 0.0 < size < np.inf else size
        differences.append(float(apart))
    difference = max(differences)
    if difference <= LINEAR:
        return Range(difference, f"linear to {difference:.1%} of the displacement up to {DYNAMIC:g} times that")
    words = f"not linear: the displacement is {differences[0]:.0%} off that by the stiffness at rest"
    return Range(difference, words if differences[0] > LINEAR else f"{words}, under {DYNAMIC:g} times that more")


def _preload(shaft: Shaft) -> float:
    """The largest force [N] with which a bearing of a shaft pushes it while it rests."""
    at_rest = (potential(replace(x, linear=False), 0.0, np.zeros(5))[1] for x in _rolling(shaft).values())
    return max(float(np.linalg.norm(gradient[:3])) for gradient in at_rest)
