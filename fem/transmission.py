"""Static transmission error by finite elements: the table of contents of this package."""

from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from math import ceil, pi

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from fem.compliance import Compliance, flank_compliance
from fem.contact import State, state_at
from fem.flank import removed
from fem.gear import GearPair, require
from fem.hertz import flattening
from fem.mesh import Density
from fem.ste import PHASE, TORQUE, ste_map


def static_transmission_error(
    pair: GearPair,
    torque,
    phases=30,
    *,
    misalignment: float = 0.0,
    density: Density | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """STE map of a spur pair: "te" [m] in mid-plane on the line of action over (torque, phase).

    Beside it: "peak_pressure" [Pa], "centroid" of the force across the width [m], "pairs_in_contact", and the
    "load_share" of every pair of teeth.

    torque          pinion torque F r_b1 [N m], one or several increasing values >= 0; 0: unloaded transmission error
    phases          number of equidistant phases from 0 (pair 0 at the pitch point), or their values in [0, 1)
    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]
    density         of the FE mesh; the default is within 0.2 % of the converged mean and peak to peak, and has three
                    times as many slices where the gap varies across the width
    executor        any `concurrent.futures.Executor` to spread the phases over; the finite elements are solved here
    progress        show a bar with time left

    The compliance of each different gear is kept in the cache (see `fem.cache.folder`).
    Raises ValueError for bad input, RuntimeError where a contact does not settle.
    Source: Korta et al., section IV; TE = theta_P r_b1 + theta_G r_b2.
    """
    beta = pair.pinion.beta
    require(beta == 0, f"beta must be 0, got {beta:g} rad; only spur pairs are solved so far")
    torque, phase = _checked_torque(pair, torque), _checked_phases(phases)
    slope = f"misalignment must lie within 0.01 rad, got {misalignment}; pass radians: 0.5e-3"
    require(abs(misalignment) < 0.01, slope)
    varies, whole = _across_width(pair, misalignment)
    density = replace(density or Density(slices=3 if varies else 1), teeth=ceil(pair.eps_alpha))
    pinion, wheel = (flank_compliance(gear, density, pair.b, whole=whole) for gear in (pair.pinion, pair.wheel))
    column = partial(_column, pair, pinion, wheel, torque / pair.pinion.r_b, misalignment)
    columns = (map if executor is None else executor.map)(column, phase)
    bar = tqdm(columns, "transmission error", phase.size, disable=not progress, delay=1.0, leave=False)
    states = np.stack(list(bar), axis=1)
    te = _each(states, lambda state: state.te)
    data = ste_map(pair, torque, phase, te, density=str(density), misalignment=misalignment)
    return data.assign(_contact_variables(states))


def _column(
    pair: GearPair, pinion: Compliance, wheel: Compliance, forces: np.ndarray, misalignment: float, phase: float
) -> np.ndarray:
    """(n_force,) states of one phase; on one thread, which suits matrices of this size."""
    states = np.empty(forces.size, object)
    with threadpool_limits(1):
        for i, force in enumerate(forces):
            states[i] = state_at(pair, pinion, wheel, phase, force, misalignment)
    return states


def _each(states: np.ndarray, number) -> np.ndarray:
    return np.vectorize(number, otypes=[float])(states)


def _contact_variables(states: np.ndarray) -> dict:
    """What the contact says beside the transmission error."""
    grid = (TORQUE, PHASE)
    pairs = sorted({number for state in states.ravel() for number in state.pairs})
    share = [_each(states, lambda s, n=n: dict(zip(s.pairs, s.share(), strict=True)).get(n, 0.0)) for n in pairs]
    shares = np.stack(share, axis=-1) if share else np.zeros((*states.shape, 0))
    pressure, centroid = (_each(states, method) for method in (State.peak_pressure, State.centroid))
    told = "share of the load that a pair of teeth carries"
    return {
        "peak_pressure": (grid, pressure, {"units": "Pa", "long_name": "largest contact pressure"}),
        "centroid": (grid, centroid, {"units": "m", "long_name": "axial place of the resultant force"}),
        "load_share": ((*grid, "pair"), shares, {"units": "1", "long_name": told}),
        "pairs_in_contact": (grid, (shares > 0).sum(axis=-1), {"units": "1", "long_name": "pairs of teeth in contact"}),
        "pair": ("pair", pairs, {"long_name": "number of the pair of teeth, ahead of pair 0"}),
    }


def _across_width(pair: GearPair, misalignment: float) -> tuple[bool, bool]:
    """Whether the gap varies across the width, and whether differently on its two halves."""
    axial = np.linspace(-pair.b / 2, pair.b / 2, 101)[:, None]
    added = misalignment * axial
    for gear in (pair.pinion, pair.wheel):
        roll = np.linspace(gear.roll_form, gear.roll_tip, 101)
        added = added + removed(gear.flank, gear.face, roll, axial)
    tolerance = 1e-15
    return bool(np.ptp(added, axis=0).max() > tolerance), bool(np.abs(added - added[::-1]).max() > tolerance)


def _checked_torque(pair: GearPair, torque) -> np.ndarray:
    values = np.atleast_1d(np.asarray(torque, float))
    rising = values.ndim == 1 and values.size > 0 and bool((np.diff(values) > 0).all())
    require(rising and values[0] >= 0, f"torque must increase from 0 or above [N m]; sort it, got {torque}")
    largest = largest_torque(pair)
    limit = f"{largest:.4g} N m, where Hertz pressure passes E/20 (pass newton metres)"
    require(bool(values[-1] < largest), f"torque must be finite and below {limit}, got {values[-1]:g}")
    return values


def largest_torque(pair: GearPair) -> float:
    """Pinion torque at which Hertz pressure at the pitch point reaches E/20, far beyond any elastic gear [N m]."""
    one, other = pair.pinion.material, pair.wheel.material
    roll = pair.roll_pitch, pair.wheel.r_b * pair.roll_pitch / pair.pinion.r_b
    curvature = 1 / roll[0] + 1 / roll[1]
    modulus = 2 / (pi * (flattening(one) + flattening(other)))
    pressure = min(one.E, other.E) / 20
    return pair.pinion.r_b * pair.b * pi * pressure**2 / (modulus * curvature)


def _checked_phases(phases) -> np.ndarray:
    if np.ndim(phases) == 0:
        require(4 <= phases < 1e6 and phases == int(phases), f"phases must be a whole number, at least 4, got {phases}")
        return np.arange(int(phases)) / int(phases)
    values = np.asarray(phases, float)
    rising = bool((np.diff(values) > 0).all()) and values.min() >= 0 and values.max() < 1
    require(rising, f"phases must increase within [0, 1) as share of a pitch, got {phases}")
    return values
