"""Static transmission error by finite elements: the table of contents of this package."""

from concurrent.futures import Executor
from dataclasses import replace
from math import floor
from typing import Annotated

import numpy as np
import xarray as xr

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.pair.offsets import Offsets, check_offsets
from fem.pair.pair import GearPair
from fem.ste.accuracy import UpTo, choose
from fem.ste.error_estimation import MapError
from fem.ste.inputs import check_places, checked_accuracy, checked_phases, checked_torque, given, require_one_way
from fem.ste.map_solver import ORDER, QUANTITIES, each, sweep
from fem.ste.ste_map import PHASE, TORQUE, ste_map
from fem.support.arguments import Numbers, checked
from fem.support.progress import shown
from fem.support.representation import exact
from fem.support.validation import numbers, require


@checked
def static_transmission_error(
    pair: GearPair,
    torque: Numbers | UpTo,
    phases: Numbers | None = 30,
    *,
    offsets: Annotated[Offsets, check_offsets] | None = None,
    accuracy: Annotated[float, checked_accuracy] | None = None,
    resolution: Resolution | Slices | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """STE map of a spur or helical pair: "te" [m] in mid-plane on the line of action over (torque, offsets, phase).

    Beside it stand the tangent "stiffness" of the mesh [N/m], by which loads between the torques are interpolated,
    "centroid" of the force across the width [m], "hertz_pressure" [Pa], of the line load on the curvature of the
    involutes, as ISO 6336-2 has it, "line_load" [N/m], the "load_share" of every pair of teeth, "pairs_in_contact", and
    over the torque "contact_ratio", that under load, as finely as phases lie (at 0 N m the nominal one). "tip_contact"
    is the share of the load where the contact reaches a tip edge. There, where the corner of a face touches, or a
    relief begins with a kink, "peak_pressure" [Pa] is far more: it has no limit on sharp edges, and is a mean over one
    strip; `fem.EdgeBreak` rounds the tip's. In the slice mode it is that of Hertz.

    torque          pinion torque F r_b1 [N m], one or several increasing values >= 0; 0: unloaded transmission error;
                    `UpTo(350)`: as many from 0 to 350 N m as the accuracy takes
    phases          number of equidistant phases from 0 (pair 0 at the pitch point), or their values in [0, 1); with
                    pitch deviations values up to any number of pitches, as each tooth differs (a number of phases maps
                    the first pitch only, which makes no `exugear.MeshForce`); None: as many as the accuracy takes
    offsets         of the wheel; those with several values are axes of the map
    accuracy        share of the deflection that each kind of error may be, and of the largest peak to peak (see
                    `fem.ste.accuracy`), say 0.005: it chooses the mesh, and the map carries what is estimated of each
                    torque, "error_mesh", "error_phase", "error_torque", and of the peak to peak by all together
                    "error_p2p" [m]
    resolution      instead of an accuracy, without estimates: `Resolution` (default, within 0.3 % of the converged mean
                    of aligned spurs) or the faster `Slices`
    executor        any `concurrent.futures.Executor` to spread phases and places over; finite elements are solved here
    progress        show bars with the time left

    The compliance of each different gear is kept in the cache (see `fem.support.cache.folder`).
    Raises ValueError for bad input, RuntimeError where a contact does not settle or the accuracy is not reached.
    Source: Korta et al., section IV; TE = theta_P r_b1 + theta_G r_b2.
    """
    offsets = Offsets() if offsets is None else offsets
    values = offsets.values(pair)
    check_places(pair, values["a"], values["axial"])
    require_one_way(accuracy, resolution)
    pair = replace(pair, a=float(values["a"][0])) if "a" not in offsets.axes() else pair
    with shown(progress):
        level: Discretization = resolution or Resolution()
        errors: dict[str, MapError] = {}
        if accuracy is None:
            torque, phase = given(pair, torque, phases)
        else:
            torque, phase, level, errors = _chosen(pair, torque, phases, values, accuracy)
        states = sweep(pair, torque / pair.pinion.r_b, phase, values, level, executor=executor)
    axes = {name: values[name] for name in offsets.axes()}
    fixed = {name: float(values[name][0]) for name in ORDER[1:] if name not in axes}
    attributes = {"resolution": exact(level), "pitches": floor(phase[-1]) + 1} | fixed
    return _labelled(pair, torque, phase, axes, states, attributes).assign(_estimates(errors))


def _estimates(errors: dict[str, MapError]) -> dict:
    """Estimated errors of each torque: root mean squares by kind, and of the peak to peak by all kinds together."""
    if not errors:
        return {}
    kinds = {
        "error_mesh": "mesh",
        "error_phase": "interpolation over phase",
        "error_torque": "interpolation over torque",
    }
    described = {name: f"estimated root mean square error by {kinds[name]}" for name in errors}
    values = {name: error.rms for name, error in errors.items()}
    values["error_p2p"] = np.sum([error.peak_to_peak for error in errors.values()], axis=0)
    described["error_p2p"] = "estimated error of the peak to peak over the mesh cycle"
    return {name: (TORQUE, values[name], {"units": "m", "long_name": text}) for name, text in described.items()}


def _chosen(pair, torque, phases, values: dict, accuracy: float) -> tuple[np.ndarray, np.ndarray, Discretization, dict]:
    """Torques, phases and resolution that an accuracy asks for, with estimated errors by kind (n_torque,) [m]."""
    loaded = isinstance(torque, UpTo) or numbers("torque", torque).max(initial=0.0) > 0
    require(bool(loaded), f"accuracy needs a torque > 0 to be a share of its deflection, got {torque}")
    torque = torque if isinstance(torque, UpTo) else checked_torque(pair, torque)
    phase = None if phases is None else checked_phases(phases, pair)
    return choose(pair, torque, phase, values, accuracy)


def _labelled(pair, torque, phase, axes: dict, states: np.ndarray, attributes: dict) -> xr.Dataset:
    """The map with all its variables; offsets of one value are no axis."""
    grid = (TORQUE, *(name for name in ORDER if name in axes), PHASE)
    states = states.reshape([torque.size, *(axes[name].size for name in grid[1:-1]), phase.size])
    te = each(states, lambda state: state[0])
    data = ste_map(pair, torque, phase, te, {name: axes[name] for name in grid[1:-1]}, **attributes)
    variables = {
        name: (grid, each(states, lambda state, i=i: state[i]), {"units": units, "long_name": described})
        for i, (name, (units, described)) in enumerate(QUANTITIES.items(), start=1)
    }
    data = data.assign(variables).assign(_shares(states, grid, lengths(phase, attributes["pitches"])))
    return data.assign(contact_ratio=_nominal_unloaded(data["contact_ratio"], pair))


def _nominal_unloaded(contact_ratio: xr.DataArray, pair: GearPair) -> xr.DataArray:
    """Without load one point touches at a time: there the contact ratio of the involutes at that centre distance."""
    nominal: float | xr.DataArray = pair.eps_gamma
    if "a" in contact_ratio.dims:
        at_distance = [replace(pair, a=float(a)).eps_gamma for a in contact_ratio["a"]]
        nominal = xr.DataArray(at_distance, dims="a", coords={"a": contact_ratio["a"]})
    return contact_ratio.where(contact_ratio[TORQUE] > 0, nominal).transpose(*contact_ratio.dims)


def lengths(phase: np.ndarray, pitches: int) -> np.ndarray:
    """(n_phase,) share of the mesh cycles around each phase, half-way to its neighbours."""
    ahead = np.diff(phase, append=phase[0] + pitches)
    return (ahead + np.roll(ahead, 1)) / (2 * pitches)


def _shares(states: np.ndarray, grid: tuple[str, ...], length: np.ndarray) -> dict:
    """What the pairs of teeth carry, and how many do; on average over phases of these lengths."""
    numbers = sorted({k for state in states.ravel() for k, share in state[-1].items() if share > 0})
    columns = [each(states, lambda s, k=k: s[-1].get(k, 0.0)) for k in numbers]
    shares = np.stack(columns, axis=-1) if numbers else np.zeros((*states.shape, 0))
    count = (shares > 0).sum(axis=-1)
    return {
        "load_share": ((*grid, "pair"), shares, {"units": "1", "long_name": "share of the load on a pair of teeth"}),
        "pairs_in_contact": (grid, count, {"units": "1", "long_name": "pairs of teeth in contact"}),
        "contact_ratio": (grid[:-1], count @ length, {"units": "1", "long_name": "contact ratio under load"}),
        "pair": ("pair", numbers, {"long_name": "number of the pair of teeth, ahead of pair 0"}),
    }
