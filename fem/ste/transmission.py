"""Static transmission error by finite elements: from gear pair, torques and phases to the labelled map."""

from concurrent.futures import Executor
from dataclasses import replace
from typing import Annotated

import numpy as np
import xarray as xr

from fem.contact.resolution import Resolution, Slices
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import Offsets, check_offsets
from fem.pair.pair import GearPair
from fem.ste.accuracy import MapGrid, choose, with_ring_angles
from fem.ste.error_estimation import MapError, compared_slices
from fem.ste.inputs import UpTo, check_offsets_mesh, checked_accuracy, checked_request
from fem.ste.map_solver import FORCE, ContactModel, compliances_of, elastic_gears
from fem.ste.right_flanks import Symmetry, sweep_both_sides, symmetry_of
from fem.ste.ring_angle import checked_ring_angles
from fem.ste.ring_deflection import cross_compliance
from fem.ste.ring_modes import cross_left_out
from fem.ste.ste_map import (
    CROSS_COMPLIANCE,
    CROSS_LEFT_OUT,
    LOAD_SHARE,
    MIRRORED,
    OFFSETS,
    PAIR,
    PHASE,
    RIGHT_FLANKS,
    RING_ANGLE,
    SOLVED,
    TE,
    TORQUE,
    description,
    number_of_pitches,
    pair_attributes,
    ste_map,
)
from fem.ste.te_measures import LEAST_ERROR, curve_peak_to_peak
from fem.support.arguments import Numbers, checked
from fem.support.progress import shown
from fem.support.representation import exact


@checked
def static_transmission_error(
    pair: GearPair,
    torque: Numbers | UpTo,
    phases: Numbers | None = 30,
    *,
    offsets: Annotated[Offsets, check_offsets] | None = None,
    accuracy: Annotated[float, checked_accuracy] | None = None,
    resolution: Resolution | Slices | None = None,
    ring_angles: Numbers | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Map of the static transmission error of a spur or helical pair over pinion torque, offsets and phase.

    Finite elements give the compliance of both gears; the contact of all tooth pairs is then solved at each phase,
    offset and torque.

    torque      pinion torque F r_b1 of the mesh force F [N m]: one or several increasing values, where 0 gives the
                transmission error without load and values < 0 load the right flanks; or `fem.UpTo(350)`: 0 to 350 N m,
                as many as the accuracy needs
    phases      number of equidistant phases, or increasing values in [0, 1) as share of a pitch; at 0, tooth pair 0
                touches at the pitch point. None: as many as the accuracy needs. With a `fem.PitchDeviation` no two
                teeth are alike: pass values up to any number of pitches (a number of phases maps the first pitch only,
                from which no `exugear.MeshForce` can be made)
    offsets     offsets of the wheel; an offset with several values becomes an axis of the map
    accuracy    largest root mean square error by each cause (mesh, phases, torques) over the deflection, say 0.005;
                five times that share is allowed of the peak to peak by `fem.peak_to_peak`. It chooses the mesh; the map
                holds the estimates
    resolution  mesh and slices by hand instead of an accuracy, without estimated errors: `fem.Resolution` (default;
                the mean of aligned spurs is within 0.3 % of the converged one) or `fem.Slices`, 4 times as fast or more
    ring_angles positions of the mesh on a ring between the `fem.Bolts` of its support [rad], an axis of the map: a
                number of them over the period of the support, or increasing values within a period; by default as many
                as its rim needs. At phase p, counted over all pitches from where tooth 0 of the ring touches at the
                pitch point, the ring angle is 2 pi p / |z|: `fem.over_pitches` makes such a map of one pitch after the
                other. With a `fem.PitchDeviation` the phases say where the mesh is
    executor    any `concurrent.futures.Executor`, which solves the contacts; finite elements are solved in this process
    progress    whether to show bars with the time left

    Returns a dataset with these variables over (torque, *offsets, ring_angle, phase); the inputs are its attributes:

    te                  transmission error [m], in mid-plane on the line of action, > 0: the pinion leads
    stiffness           tangent stiffness of the mesh [N/m], from which loads between the torques are interpolated
    centroid            axial position of the force centroid [m]
    line_load           largest force per length of contact line [N/m]
    hertz_pressure      largest pressure of the line loads on the curvature of the involutes [Pa], as in ISO 6336-2
    peak_pressure       largest pressure of a strip [Pa]; with `fem.Slices` that of Hertz. It has no limit on sharp
                        edges: at tips (`fem.EdgeBreak` rounds them), corners of the face, kinks of a relief
    tip_contact         share of the load where the contact reaches a tip edge
    load_share          share of the load on each tooth pair; over pair too
    pairs_in_contact    number of tooth pairs in contact
    contact_ratio       pitches over which a tooth pair carries load, over (torque, *offsets), continuous between the
                        phases; at 0 N m the nominal one, NaN where phases leave a gap of more than a third of a pitch
    error_mesh, error_phase, error_torque, error_ring_angle
                        with an accuracy, over torque: root mean square errors [m] by the mesh and by interpolation over
                        phase, torque and ring angle
    error_p2p, error_p2p_curve
                        with an accuracy, over torque: error [m] by all of them together of the largest less the least
                        te of the phases, and of the peak to peak by `fem.peak_to_peak`

    error_slices        of helical pairs by `fem.Resolution`, over (torque, *offsets): error of the peak to peak [m] by
                        the number of slices, estimated by `fem.Slices`

    Under torques < 0 the right flanks are in contact: te is < 0 and counts from where they touch without load and
    without modifications, backlash left out, so that a run's DTE there is te minus backlash. The phase is that of the
    left flanks, of which the right ones are at `GearPair.back_phase` minus the phase; misalignment > 0 opens the gap
    of the loaded flanks towards +z on both sides, and f_sigma_beta is the same inclination for both. Tooth pair k is
    that of tooth k of the pinion. With torque 0 the map holds both unloaded curves, that of the right flanks as

    te_unloaded_right   over (*offsets, phase) [m]

    The compliance of each gear is kept in the cache (see `fem.support.cache.folder`).
    Raises ValueError for bad input, RuntimeError if a contact does not converge or the accuracy is not reached.
    Source: Korta et al., section IV; te = theta_P r_b1 + theta_G r_b2.
    """
    offsets = Offsets() if offsets is None else offsets
    values = offsets.values(pair)
    check_offsets_mesh(pair, values["a"], values["axial"])
    pair = replace(pair, a=float(values["a"][0])) if "a" not in offsets.axes() else pair
    torques, phase = checked_request(pair, torque, phases, accuracy, resolution)
    angles, turns = checked_ring_angles(pair, ring_angles)
    axes = offsets.axes() + (RING_ANGLE,) * turns
    pair_attributes(pair)  # raises before anything is solved
    with shown(progress):
        model = ContactModel(pair, values | {RING_ANGLE: angles}, resolution or Resolution())
        if accuracy is not None:
            grid = choose(model, torques, phase, accuracy)
            model = replace(model, resolution=grid.resolution)
            if angles.size > 1:
                fixed = ring_angles is not None
                model, error = with_ring_angles(model, grid.torque, accuracy, fixed=fixed)
                grid = replace(grid, errors=grid.errors | {"error_ring_angle": error})
        else:
            grid = MapGrid(torques, phase, model.resolution, errors={})
        forces = grid.torque / pair.pinion.r_b
        states = sweep_both_sides(model, forces, grid.phase, executor=executor)
        slices = compared_slices(model, grid.torque, grid.phase) if accuracy is None else None
        estimate = sweep_both_sides(slices, forces, grid.phase, executor=executor) if slices else None
    data = _labelled(model, grid, states, axes)
    if estimate is not None:
        data = data.assign(error_slices=_slices_error(data, estimate))
    return data.assign(_estimates(data, grid.errors)) if grid.errors else data


def _slices_error(data: xr.Dataset, estimate: xr.Dataset) -> xr.DataArray:
    """Error of the peak to peak over (torque, *offsets) by the number of slices: twice its difference from `Slices`.

    With the least error, which is always stated under load, it bounded the true one in 23 of 24 states of 8 pairs.
    """
    dims = [name for name in data[TE].dims if name != PHASE]
    te = data[TE].transpose(*dims, PHASE)
    values = estimate[TE].values.reshape(te.shape)
    error = 2 * np.abs(np.ptp(te.values, axis=-1) - np.ptp(values, axis=-1)) + LEAST_ERROR
    return xr.DataArray(error, dims=dims, attrs=description("error_slices")).where(data[TORQUE] != 0, 0.0)


def _labelled(model: ContactModel, grid: MapGrid, states: xr.Dataset, offset_axes: tuple[str, ...]) -> xr.Dataset:
    """The map with all its variables; an offset with one value is an attribute instead of an axis."""
    fixed = [name for name in OFFSETS if name not in offset_axes]
    states = states.rename({FORCE: TORQUE}).isel(dict.fromkeys(fixed, 0), drop=True)
    axes = {name: model.offsets[name] for name in OFFSETS if name in offset_axes}
    attributes = {"resolution": exact(grid.resolution), "pitches": number_of_pitches(grid.phase)}
    attributes |= {name: float(model.offsets[name][0]) for name in fixed if name not in ("a", RING_ANGLE)}
    if model.pair.wheel.support:
        bodies, _ = compliances_of(model.pair, model.offsets, model.resolution)
        gear, density, _ = elastic_gears(model.pair, model.offsets, model.resolution)[1]
        left_out = cross_left_out(model.pair, gear, density.paired(), bodies[1])
        attributes[CROSS_COMPLIANCE] = cross_compliance(model.pair, bodies[1])
        attributes[CROSS_LEFT_OUT] = left_out.ravel()
    if grid.torque[0] < 0:
        attributes[RIGHT_FLANKS] = MIRRORED if symmetry_of(model) is Symmetry.TURNED else SOLVED
    data = ste_map(model.pair, grid.torque, grid.phase, states[TE].values, axes, **attributes)
    variables = {str(name): values for name, values in states.data_vars.items() if name != TE}
    variables |= _load_sharing(states[LOAD_SHARE])
    variables["contact_ratio"] = _nominal_without_load(variables["contact_ratio"], model, grid.torque)
    described = {name: (values.dims, values.values, description(name)) for name, values in variables.items()}
    return data.assign(described).assign_coords(pair=(PAIR, variables[LOAD_SHARE][PAIR].values, description(PAIR)))


def _load_sharing(share: xr.DataArray) -> dict[str, xr.DataArray]:
    """Load shares of the tooth pairs that carry load at any phase, and number of those that carry load."""
    loaded = (share > 0).any([name for name in share.dims if name != PAIR])
    share = share.isel(pair=np.flatnonzero(loaded))
    return {LOAD_SHARE: share, "pairs_in_contact": (share > 0).sum(PAIR)}


def _nominal_without_load(contact_ratio: xr.DataArray, model: ContactModel, torque: np.ndarray) -> xr.DataArray:
    """Contact ratios; without load, where a single point touches at a time, those of the involutes."""
    a, axial = model.offsets["a"].tolist(), model.offsets["axial"].tolist()
    ratios = [[MeshPosition(model.pair, distance, shift, 0.0).eps_gamma for shift in axial] for distance in a]
    nominal = xr.DataArray(ratios, dims=("a", "axial"))
    nominal = nominal.squeeze([name for name in nominal.dims if name not in contact_ratio.dims])
    loaded = xr.DataArray(torque != 0, dims=TORQUE)
    return contact_ratio.where(loaded, nominal).transpose(*contact_ratio.dims)


def _estimates(data: xr.Dataset, errors: dict[str, MapError]) -> dict[str, tuple]:
    """Estimated errors of each torque: root mean squares by kind, and of the peak to peak by all kinds together.

    The largest less the least te of the phases is as far from the true peak to peak as that of the curve through them,
    and by their difference further.
    """
    te, torque = data[TE].transpose(TORQUE, ..., PHASE).values, data[TORQUE].values
    curve = np.nansum([error.peak_to_peak for error in errors.values()], axis=0)
    curve = np.where(torque != 0, np.maximum(curve, LEAST_ERROR), curve)
    further = np.abs(curve_peak_to_peak(data[PHASE].values, te) - np.ptp(te, axis=-1))
    values = {name: error.rms for name, error in errors.items()}
    values |= {"error_p2p": curve + further.reshape(torque.size, -1).max(axis=1), "error_p2p_curve": curve}
    return {name: (TORQUE, error, description(name)) for name, error in values.items()}
