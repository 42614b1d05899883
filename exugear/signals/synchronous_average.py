"""Averages of a signal over the turns of a shaft, and what remains of them without the regular meshing.

What repeats with each turn of the averaged shaft remains; noise and the turns of other shafts fall with the number of
turns. Sources: P. D. McFadden, Mech. Syst. Signal Process. 1 (1987) 83; R. M. Stewart, Univ. of Southampton MHM/R/10/77
(1977).
"""

import json
from collections.abc import Sequence

import numpy as np
import scipy
import xarray as xr

from exugear.signals.angle_sampling import HALF_LENGTH, REVOLUTION, SAMPLES_PER_PERIOD, over_angle, resolved_order
from exugear.signals.signal import WHOLE, channel_coordinates, require_signal
from fem.support.arguments import checked
from fem.support.validation import require, require_finite

ANGLE, AVERAGE, SPEED, TURNS = "angle", "average", "speed", "turns"
ANGLE_OF_TURN = {"units": "rad", "long_name": "angle of the averaged shaft"}
NUMBER = {"units": "1", "long_name": "number of the average"}
#: Share of the steps that must have samples enough: a few may be longer.
SAMPLED = 0.99


@checked
def synchronous_average(
    signal: xr.DataArray, *, highest_order: float, shaft_order: float = 1.0, turns: int | None = None
) -> xr.DataArray:
    """Time-synchronous average: the mean of a signal over whole turns of a shaft, at equal steps of its angle.

    signal         (..., time) as `exugear.signal` returns it: turns_of="slow" counts the turns of that shaft
    highest_order  highest order wanted, in orders of the averaged shaft: 3.5 times the number of teeth of its gear
                   holds three mesh harmonics with their side bands
    shaft_order    turns of the averaged shaft per turn of the shaft whose speed the signal has: z_1 / z_2 for a wheel
                   where a tachometer is at the pinion
    turns          of an average; by default one average over all of the signal

    The first and the last 30 angular samples, which its ends disturb in `exugear.over_angle`, are left out.

    Returns a DataArray (..., angle), or (..., average, angle) where turns is given, over the angle [rad] of the shaft
    in [0, 2 pi), 0 where the signal begins; with the time [s] and the speed [rad/s] of the averaged shaft in the middle
    of each average, mesh_order, mesh cycles per turn of this shaft, and in its attributes turns, those of an average,
    and turns_left_out, the rest behind the last one. Raises ValueError for signals shorter than an average, for orders
    that the samples do not resolve, and for a shaft that reverses: its teeth then pass in another order.
    """
    require_signal(signal)
    speed = signal[SPEED].values
    reverses = f"speed of the signal must keep its sign, got {speed.min():g} to {speed.max():g} rad/s"
    require(bool((speed >= 0).all() or (speed <= 0).all()), f"{reverses}; cut the signal where the shaft reverses")
    turns_at_all = "signal must be of a turning shaft, its speed is 0 throughout; pass a run at speed"
    require(bool((speed != 0).any()), turns_at_all)
    require(0 < shaft_order < np.inf, f"shaft_order must be > 0 and finite, got {shaft_order:g}")
    require(1 <= highest_order < np.inf, f"highest_order must be >= 1 and finite, got {highest_order:g}")
    require(turns is None or turns >= 1, f"turns must be >= 1, got {turns}")
    most = resolved_order(signal, SAMPLED) / shaft_order
    finer = f"got samples for order {most:.4g} at the highest speed; sample finer, or pass a lower highest_order"
    few = f"signal must have {SAMPLES_PER_PERIOD} samples per period of order {highest_order:g}"
    require(highest_order <= most, f"{few} of the averaged shaft, {finer}")
    samples = int(np.ceil(SAMPLES_PER_PERIOD * highest_order))
    turned = float(np.ptp(signal["angle"].values)) / REVOLUTION * shaft_order
    ends = 2 * HALF_LENGTH / samples
    least = (turns or 1) + ends
    short = (
        f"signal must hold {least:.4g} turns of the averaged shaft, {ends:.3g} of them for its ends, got {turned:.4g}"
    )
    require(turned * (1 + 1e-9) >= least, f"{short}; record longer, or pass fewer turns")
    sampled = over_angle(signal, highest_order=samples * shaft_order / SAMPLES_PER_PERIOD)
    inner = sampled.sizes["angle"] - 2 * HALF_LENGTH
    length = turns or inner // samples
    number = inner // samples // length
    used = slice(HALF_LENGTH, HALF_LENGTH + number * length * samples)
    of_turns = sampled.values[..., used].reshape(*sampled.shape[:-1], number, length, samples)
    averages = np.roll(of_turns.mean(axis=-2), HALF_LENGTH, axis=-1)
    along = {name: sampled[name].values[used].reshape(number, -1).mean(axis=1) for name in ("time", SPEED)}
    along[SPEED] = along[SPEED] * shaft_order
    coordinates = channel_coordinates(signal) | _mesh_order(signal, shaft_order)
    coordinates |= {name: (AVERAGE, values, sampled[name].attrs) for name, values in along.items()}
    coordinates |= {AVERAGE: (AVERAGE, np.arange(number), NUMBER)}
    coordinates |= {ANGLE: (ANGLE, np.arange(samples) * REVOLUTION / samples, ANGLE_OF_TURN)}
    left_out = (inner - number * length * samples) / samples
    attributes = signal.attrs | {TURNS: length, "turns_left_out": left_out}
    result = xr.DataArray(averages, coordinates, (*sampled.dims[:-1], AVERAGE, ANGLE), signal.name, attributes)
    return result if turns else result.isel(average=0, drop=False).drop_vars(AVERAGE)


def _mesh_order(signal: xr.DataArray, shaft_order: float) -> dict[str, tuple]:
    """The mesh orders of a signal in turns of another shaft."""
    if "mesh_order" not in signal.coords:
        return {}
    about = dict(signal["mesh_order"].attrs)
    of_stages = {label: order / shaft_order for label, order in json.loads(about.get("of_stages", "{}")).items()}
    return {"mesh_order": ((), float(signal["mesh_order"]) / shaft_order, about | {"of_stages": json.dumps(of_stages)})}


@checked
def residual_signal(
    average: xr.DataArray, mesh_orders: Sequence[int] | None = None, *, side_bands: int = 0, shaft_orders: int = 2
) -> xr.DataArray:
    """What remains of an average without the regular meshing: where a fault of a few teeth shows.

    average        (..., angle) as `exugear.synchronous_average` returns it
    mesh_orders    numbers of teeth on the averaged shaft, whose harmonics are removed; by default those mesh orders of
                   the signal that are whole numbers
    side_bands     number of side bands removed on either side of each harmonic: 0 leaves the residual signal, 1 the
                   difference signal
    shaft_orders   removed too, from the mean to this order: run-out and unbalance

    Returns a DataArray like the average. Raises ValueError for mesh orders that the average does not resolve.
    """
    check_average(average)
    samples = average.sizes[ANGLE]
    regular = regular_orders(average, mesh_orders, side_bands=side_bands, shaft_orders=shaft_orders)
    axis = average.get_axis_num(ANGLE)
    lines = np.moveaxis(scipy.fft.rfft(average.values, axis=axis), axis, -1)
    lines[..., regular] = 0.0
    return average.copy(data=np.moveaxis(scipy.fft.irfft(lines, samples), -1, axis))


def regular_orders(
    average: xr.DataArray, mesh_orders: Sequence[int] | None, *, side_bands: int, shaft_orders: int
) -> np.ndarray:
    """Orders of the regular meshing that an average resolves, rising."""
    teeth, highest = teeth_of(average, mesh_orders), average.sizes[ANGLE] // 2
    require(0 <= shaft_orders <= highest, f"shaft_orders must lie in [0, {highest}], got {shaft_orders}")
    most = (min(teeth) - 1) // 2
    between = f"side_bands must lie in [0, {most}], below half the distance of the mesh harmonics, got {side_bands}"
    require(0 <= side_bands <= most, between)
    harmonics = np.concatenate([np.arange(z, highest + side_bands + 1, z) for z in teeth])
    bands = np.add.outer(harmonics, np.arange(-side_bands, side_bands + 1)).ravel()
    orders = np.unique(np.concatenate([np.arange(shaft_orders + 1), bands]))
    return orders[orders <= highest]


def teeth_of(average: xr.DataArray, mesh_orders: Sequence[int] | None) -> list[int]:
    """Mesh orders of an average: the given ones, or those of its signal that are whole numbers."""
    highest = average.sizes[ANGLE] / SAMPLES_PER_PERIOD
    if mesh_orders is not None:
        orders = sorted({int(order) for order in mesh_orders})
        inside = bool(orders) and orders[0] >= 1 and orders[-1] <= highest
        require(inside, f"mesh_orders must lie in [1, {highest:.4g}], which the average resolves, got {[*mesh_orders]}")
        return orders
    given = "mesh_orders must be given, the numbers of teeth on the averaged shaft"
    require("mesh_order" in average.coords, f"{given}: the signal has none")
    about = json.loads(average["mesh_order"].attrs.get("of_stages", "{}"))
    known = list(about.values()) or [float(average["mesh_order"])]
    whole = sorted({round(order) for order in known if order > 0 and abs(order - round(order)) < WHOLE * order})
    require(bool(whole), f"{given}: none of the signal's mesh orders {known} is a whole number per turn of this shaft")
    require(whole[-1] <= highest, f"average must resolve its mesh order {whole[-1]}, highest_order was {highest:.4g}")
    return whole


def check_average(average: xr.DataArray, name: str = "average") -> None:
    """ValueError unless this is a finite average over the angle of a turn."""
    over = f"{name} must be over the angle of a turn; pass what exugear.synchronous_average returned"
    require(ANGLE in average.dims and TURNS in average.attrs, over)
    require_finite(name, average.values, "leave out averages of samples that are missing")
