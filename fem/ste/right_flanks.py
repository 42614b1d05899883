"""The part of a map under torques < 0, which load the right flanks.

It is solved with the left flanks of `fem.mirror_image` at `GearPair.back_phase` minus the phase, which is the same
rotation of the gears; tooth pair k there is tooth pair -k. Contact states that a symmetric pair has on both sides are
solved once.
"""

from concurrent.futures import Executor
from dataclasses import replace
from enum import Enum
from functools import partial
from math import pi

import numpy as np
import xarray as xr

from fem.microgeometry.flank import names_teeth
from fem.pair.mirror_image import mirror_image
from fem.ste.map_sides import halves_alike
from fem.ste.map_solver import FORCE, ContactModel, sweep
from fem.ste.ste_map import (
    CENTROID,
    OFFSETS,
    PAIR,
    PHASE,
    RING_ANGLE,
    ROUNDING,
    TE,
    UNLOADED_RIGHT,
    number_of_pitches,
)

F_SIGMA_BETA = "f_sigma_beta"


class Symmetry(Enum):
    """How the right flanks of a pair, at all its offsets, are like the left ones.

    NONE      unlike
    TURNED    the pair turned by half a turn about the line of centres is the same pair
    MIRRORED  the pair mirrored in the plane of the axes is the same pair, which is spur
    """

    NONE, TURNED, MIRRORED = range(3)


def symmetry_of(model: ContactModel) -> Symmetry:
    """Symmetry of a pair at its offsets; unlike teeth (pitch deviations) and a ring on bolts have none."""
    gears, offsets = (model.pair.pinion, model.pair.wheel), model.offsets
    if model.turns_on_supports or any(
        gear.drive_flank != gear.coast_flank or names_teeth(gear.drive_flank) for gear in gears
    ):
        return Symmetry.NONE
    reversed_by_turning = (offsets[name] for name in ("misalignment", "f_sigma_delta", "axial"))
    if all(map(halves_alike, gears)) and all(map(_antisymmetric, reversed_by_turning)):
        return Symmetry.TURNED
    return Symmetry.MIRRORED if not model.pair.beta_b and _antisymmetric(offsets[F_SIGMA_BETA]) else Symmetry.NONE


def _antisymmetric(values: np.ndarray) -> bool:
    return np.array_equal(values, -values[::-1])


def mirrored_model(model: ContactModel) -> ContactModel:
    """The model of the mirror image; f_sigma_beta has the other sign, and increases again, as does the ring angle."""
    ring_angle = 2 * pi * model.pair.back_phase / abs(model.pair.wheel.z) - model.offsets[RING_ANGLE][::-1]
    offsets = model.offsets | {F_SIGMA_BETA: -model.offsets[F_SIGMA_BETA][::-1], RING_ANGLE: ring_angle}
    return replace(model, pair=mirror_image(model.pair), offsets=offsets)


def sweep_both_sides(
    model: ContactModel, forces: np.ndarray, phase: np.ndarray, *, executor: Executor | None = None
) -> xr.Dataset:
    """`sweep` over mesh forces (n_force,) [N], of which those < 0 load the right flanks, with te < 0.

    Where the forces are 0 and < 0 too, te_unloaded_right over (*OFFSETS, phase) is the transmission error of the right
    flanks without load.
    """
    solve = partial(sweep, pitches=number_of_pitches(phase), executor=executor)
    if forces[0] >= 0:
        return solve(model, forces, phase)
    left, right = forces[forces >= 0], np.abs(forces[forces <= 0])[::-1]
    order = shared_phases(model, phase)
    if order is not None:
        solved = solve(model, np.union1d(left, right), phase)
        mirrored = _mirrored(solved.sel({FORCE: right}).isel({PHASE: order}), symmetry_of(model))
        left_states = [solved.sel({FORCE: left})] if left.size else []
    else:
        left_states = [solve(model, left, phase)] if left.size else []
        mirrored = solve(mirrored_model(model), right, model.pair.back_phase - phase)
        mirrored = mirrored.isel({RING_ANGLE: slice(None, None, -1)})
    mirrored = mirrored.assign_coords({RING_ANGLE: model.offsets[RING_ANGLE]})
    states = _of_the_pair(mirrored, phase)
    unloaded = states[TE].sel({FORCE: 0.0}, drop=True) if 0.0 in right else None
    states = states.sel({FORCE: forces[forces < 0]})
    both = xr.concat([states, *left_states], FORCE, data_vars="all", coords="minimal", join="outer", fill_value=0.0)
    both = both.transpose(FORCE, *OFFSETS, PHASE, PAIR)
    return both if unloaded is None else both.assign({UNLOADED_RIGHT: unloaded})


def shared_phases(model: ContactModel, phase: np.ndarray) -> np.ndarray | None:
    """Indices of the phases at which left flanks touch as right ones do at each phase; None where there are none."""
    if symmetry_of(model) is Symmetry.NONE:
        return None
    apart = (model.pair.back_phase - phase[:, None] - phase + 0.5) % 1.0 - 0.5
    order = np.abs(apart).argmin(axis=1)
    return order if np.abs(apart).min(axis=1).max() < ROUNDING else None


def _mirrored(states: xr.Dataset, symmetry: Symmetry) -> xr.Dataset:
    """States of the left flanks of a symmetric pair as those of its mirror image."""
    if symmetry is Symmetry.MIRRORED:
        return states
    axes = "misalignment", "f_sigma_delta", F_SIGMA_BETA, "axial"
    states = states.isel(dict.fromkeys(axes, slice(None, None, -1)))
    return states.assign({CENTROID: -states[CENTROID]}).assign_coords({name: -states[name].values for name in axes})


def _of_the_pair(mirrored: xr.Dataset, phase: np.ndarray) -> xr.Dataset:
    """States of the right flanks, under forces <= 0, from those of the mirror image at back_phase minus phase."""
    states = mirrored.isel(dict.fromkeys((FORCE, F_SIGMA_BETA), slice(None, None, -1)))
    axes = {name: -states[name].values for name in (FORCE, F_SIGMA_BETA, PAIR)}
    return states.assign({TE: 0.0 - states[TE]}).assign_coords(axes | {PHASE: phase}).sortby(PAIR)
