"""Deflection and force centroid under any load, interpolated from an STE map."""

import numpy as np
import scipy

from fem.ste.load_interpolation import deflection_under
from fem.ste.ste_map import CENTROID, PHASE, STIFFNESS, TE, TORQUE, at_phases, over_offsets, pair_of, pitches_of
from fem.support.validation import require
from fem.units import um

#: Least load as share of the lowest load of the map; numbers of loads below that load, and from it to the largest.
LIGHTEST_LOAD_SHARE, LOADS_BELOW_MAP, LOADS_WITHIN_MAP = 1e-4, 40, 161


def loaded_deflection(ste, r_b: float, phase: np.ndarray, *, extend: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n,) from 0 [N] and deflections (*n_offset, n_phase, n) under them [m].

    Interpolated between the torques at each phase of the map, by its tangent stiffness where it has one, then between
    the phases.

    extend   multiple of the largest torque up to which they are extrapolated with their last stiffness
    """
    limits = f"extend must lie in [1, 10] times the largest torque, got {extend}; map larger torques instead"
    require(1 <= extend <= 10, limits)
    torque, coarse = ste[TORQUE].values, ste[PHASE].values
    require(coarse.size >= 3, f"phase needs at least 3 values as share of a pitch, got {coarse.size}")
    if torque.size < 3:
        few = f"torque needs 0 and two loads or more, got {torque} N m"
        raise ValueError(f"{few}; map more, or use MeshForce.secant, which needs a single load")
    require(torque[0] == 0, f"torque must start at 0 (unloaded transmission error), got {torque[0]} N m; add it")
    te, stiffness, pitches = over_offsets(ste, TE).values, None, pitches_of(ste)
    closer = "check its sign, map more phases, smooth measured values or drop torques that lie too close"
    require_rising(torque, at_phases(coarse, te, phase, pitches), phase, closer)
    if STIFFNESS in ste:
        stiffness = over_offsets(ste, STIFFNESS).values[1:]
        stiff = f"stiffness must be > 0 N/m under load, got {stiffness.min():g}; drop it: ste.drop_vars('stiffness')"
        require(bool((stiffness > 0).all()), stiff)
    given = torque[1:] / r_b
    below = given[0] * np.geomspace(LIGHTEST_LOAD_SHARE, 1, LOADS_BELOW_MAP + 1)[:-1]
    force = np.r_[below, np.geomspace(given[0], given[-1], LOADS_WITHIN_MAP)]
    force[[LOADS_BELOW_MAP, -1]] = given[[0, -1]]
    loaded = at_phases(coarse, te[:1] + deflection_under(given, te[1:] - te[0], force, stiffness), phase, pitches)
    deflection = np.moveaxis(np.concatenate([at_phases(coarse, te[:1], phase, pitches), loaded]), 0, -1)
    force = np.r_[0, force]
    return (force, deflection) if extend == 1 else _extrapolated(force, deflection, extend)


def _extrapolated(force: np.ndarray, deflection: np.ndarray, extend: float) -> tuple[np.ndarray, np.ndarray]:
    """Forces and deflections with further forces, spaced as the last ones, along the tangent at the largest force."""
    curve = scipy.interpolate.PchipInterpolator(np.log(force[-5:]), deflection[..., -5:], axis=-1)
    compliance = curve(np.log(force[-1]), 1)[..., None] / force[-1]
    number = max(2, round(np.log(extend) / np.log(force[-1] / force[-2])))
    more = force[-1] * np.geomspace(1, extend, number + 1)[1:]
    further = deflection[..., -1:] + compliance * (more - force[-1])
    return np.r_[force, more], np.concatenate([deflection, further], axis=-1)


def require_rising(torque: np.ndarray, te: np.ndarray, phase: np.ndarray, remedy: str) -> None:
    """Require te (n_torque, ..., n_phase) [m] that grows with the torque [N m]."""
    step, *_, at = np.unravel_index(np.diff(te, axis=0).argmin(), te[1:].shape)
    least = np.diff(te, axis=0).min()
    growth = f"{least / um:.3g} um from {torque[step]:g} to {torque[step + 1]:g} N m at phase {phase[at]:.3f}"
    require(bool(least > 0), f"te must grow with the torque at every phase, got {growth}; {remedy}")


def loaded_centroid(ste, r_b: float, phase: np.ndarray, force: np.ndarray) -> np.ndarray | float:
    """Force centroids (*n_offset, n_phase, n) [m] under forces (n,) [N]; 0 where the map has none.

    They are constant below the lowest load.
    """
    if CENTROID not in ste:
        return 0.0
    centroid = at_phases(ste[PHASE].values, over_offsets(ste, CENTROID).values[1:], phase, pitches_of(ste))
    given = np.log(ste[TORQUE].values[1:] / r_b)
    at = np.clip(np.log(np.maximum(force, 1e-300)), given[0], given[-1])
    return np.moveaxis(scipy.interpolate.PchipInterpolator(given, centroid)(at), 0, -1)


def te_under(ste, torque: float, phase: np.ndarray) -> np.ndarray:
    """(n_phase,) transmission error [m] under a torque [N m] of the map's range; ValueError outside it.

    At a torque of the map, which may hold no further torque, nothing is interpolated.
    """
    low, high = float(ste[TORQUE][0]), float(ste[TORQUE][-1])
    within = torque > 0 and low <= torque <= high
    require(within, f"torque must be > 0 and lie in [{low:g}, {high:g}] N m of the map, got {torque}")
    require(
        list(ste[TE].dims) == [TORQUE, PHASE], f"te must have no further axes, got {ste[TE].dims}; select one value"
    )
    if torque in ste[TORQUE].values:
        return at_phases(ste[PHASE].values, over_offsets(ste, TE).sel({TORQUE: torque}).values, phase, pitches_of(ste))
    r_b = pair_of(ste).pinion.r_b
    force, deflection = loaded_deflection(ste, r_b, phase)
    return scipy.interpolate.PchipInterpolator(force, deflection, axis=-1)(torque / r_b)
