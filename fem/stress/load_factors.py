"""Load factors K_Hbeta and K_Halpha of a pair, from the loads that the contact solution puts on the flanks."""

from concurrent.futures import Executor
from dataclasses import replace
from math import floor
from typing import Any

import numpy as np
import xarray as xr

from fem.contact.contact_state import State
from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import ToothContact
from fem.pair.offsets import ANGLES, Offsets
from fem.pair.pair import GearPair
from fem.ste.inputs import checked_torque, phases_of_measures
from fem.ste.ste_map import TORQUE, description, phase_weights
from fem.stress.flank_loads import contact_inputs, states_of, tooth_contacts
from fem.support.arguments import Finite, Numbers, checked
from fem.support.progress import shown
from fem.support.validation import require

__all__ = ["load_factors"]

AXIAL = "axial_position"
#: Variables over torque: axes, unit, long name.
VARIABLES = {
    "K_H_beta": ((TORQUE,), "1", "face load factor of the line load averaged over the mesh cycle"),
    "K_H_beta_max": ((TORQUE,), "1", "face load factor of the line load at a phase, the largest of all phases"),
    "K_H_alpha": ((TORQUE,), "1", "transverse load factor: largest load of a tooth pair over that of accurate gears"),
    "line_load": ((TORQUE, AXIAL), "N/m", "load of all tooth pairs per face width, mean over the mesh cycle"),
    "largest_share": ((TORQUE,), "1", "largest share of the load on a tooth pair"),
}


@checked
def load_factors(
    pair: GearPair,
    torque: Numbers,
    phases: Numbers = 30,
    *,
    offsets: Offsets | None = None,
    ring_angle: Finite = 0.0,
    resolution: Resolution | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Face load factor and transverse load factor of a pair over the torque, by its contact solution.

    torque, phases, offsets, ring_angle, resolution, executor   as for `fem.root_stress`; torques > 0

    Returns a dataset over torque [N m] and axial_position [m], from the pinion's mid-plane:

    K_H_beta        largest over mean line load across the face width. The line load in a section is summed over the
                    tooth pairs and averaged over the mesh cycle, so that the variation of the load along inclined lines
                    of contact does not count
    K_H_beta_max    the same at each phase, without the average, the largest of all phases: with that variation, which
                    makes it larger than 1 on perfect helical gears
    K_H_alpha       largest load of a tooth pair in the mesh cycle over that of accurate gears, which are involutes
                    without modification on parallel axes. It is 1 where a single pair carries all the load at times
    line_load       [N/m] over (torque, axial_position), averaged over as many equal parts of the face width as the
                    resolution has slices
    largest_share   of the load on a tooth pair

    The flanks with their modifications and deviations, the offsets, and the elasticity of teeth and gear bodies up to
    the bores are in these factors; shafts, bearings and housing only as far as the offsets describe them.

    Source: definitions of ISO 6336-1:2019, clauses 7 and 8, method A. Raises ValueError for bad input, RuntimeError
    where the contact does not converge.
    """
    torque, phase = checked_torque(pair, torque), phases_of_measures(phases, pair)
    require(bool(torque[0] > 0), f"torque must be > 0 N m, without which there is no load to distribute, got {torque}")
    offsets = Offsets() if offsets is None else offsets
    resolution = Resolution() if resolution is None else resolution
    forces = torque / pair.pinion.r_b
    with shown(progress):
        contacts, misalignment = tooth_contacts(pair, phase, offsets, resolution, ring_angle)
        line_loads, shares = _distributions(contacts, forces, misalignment, resolution.slices, executor)
        accurate, parallel = _accurate(pair), replace(offsets, **dict.fromkeys(ANGLES, 0.0))
        accurate_shares = shares
        if (accurate, parallel) != (pair, offsets):
            contacts, misalignment = tooth_contacts(accurate, np.unique(phase % 1), parallel, resolution, ring_angle)
            _, accurate_shares = _distributions(contacts, forces, misalignment, resolution.slices, executor)
    line_load = np.einsum("p,tps->ts", phase_weights(phase, floor(phase[-1]) + 1), line_loads)
    largest = shares.max(axis=1)
    momentary = face_load_factor(line_loads).max(axis=1)
    columns = face_load_factor(line_load), momentary, largest / accurate_shares.max(axis=1), line_load, largest
    ends = station_ends(contacts[0], resolution.slices)
    inputs = contact_inputs(pair, offsets, resolution)
    return _dataset(inputs, torque, (ends[1:] + ends[:-1]) / 2, columns)


def face_load_factor(line_load: np.ndarray) -> np.ndarray:
    """(...) largest over mean of line loads (..., n) on equal parts of the face width."""
    return line_load.max(axis=-1) / line_load.mean(axis=-1)


def station_ends(contact: ToothContact, stations: int) -> np.ndarray:
    """(stations + 1,) axial ends of equal stations of the face width common to both gears [m]."""
    return np.linspace(*contact.position.face, stations + 1)


def share_per_width(state: State, ends: np.ndarray) -> np.ndarray:
    """(n,) share of the load, per face width [1/m], in stations that end at (n + 1,) axial positions [m]."""
    low, high, force = state.face.unfolded(state.slices.low, state.slices.high, state.force)
    overlap = np.minimum(high, ends[1:, None]) - np.maximum(low, ends[:-1, None])
    return np.maximum(overlap, 0.0) @ (force / (high - low)) / np.diff(ends) / force.sum()


def _distributions(
    contacts: list[ToothContact],
    forces: np.ndarray,
    misalignment: float,
    stations: int,
    executor: Executor | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Line loads (n_torque, n_phase, n_stretch) [N/m] and largest shares of a tooth pair (n_torque, n_phase)."""
    line_loads = np.zeros((forces.size, len(contacts), stations))
    shares = np.zeros(line_loads.shape[:2])
    columns = states_of(contacts, forces, misalignment, executor, "contact")
    for column, (contact, states) in enumerate(zip(contacts, columns, strict=True)):
        ends = station_ends(contact, stations)
        for row, (force, state) in enumerate(zip(forces, states, strict=True)):
            line_loads[row, column] = force * share_per_width(state, ends)
            shares[row, column] = state.quantities.load_share.max()
    return line_loads, shares


def _accurate(pair: GearPair) -> GearPair:
    """The pair without modifications and deviations of its flanks."""
    return GearPair(replace(pair.pinion, flank=()), replace(pair.wheel, flank=()), a=pair.a)


def _dataset(
    inputs: dict[str, Any], torque: np.ndarray, axial: np.ndarray, columns: tuple[np.ndarray, ...]
) -> xr.Dataset:
    """The labelled `VARIABLES`."""
    axes = {
        TORQUE: (TORQUE, torque, description(TORQUE)),
        AXIAL: (AXIAL, axial, {"units": "m", "long_name": "axial position from the pinion's mid-plane"}),
    }
    values = {
        name: (dims, column, {"units": unit, "long_name": long_name})
        for (name, (dims, unit, long_name)), column in zip(VARIABLES.items(), columns, strict=True)
    }
    return xr.Dataset(values, axes, {"title": "load factors", **inputs})
