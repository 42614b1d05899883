"""Amplitude and phase of orders along a run: a least-squares filter bank that tells close orders apart."""

import warnings

import numpy as np
import scipy
import xarray as xr
from numpy.polynomial import legendre

from exugear.recordings.angle_sampling import HALF_LENGTH, REVOLUTION, SAMPLES_PER_PERIOD, over_angle
from exugear.recordings.columns import check_size
from exugear.recordings.short_time_spectra import check_overlap
from exugear.recordings.signal import at_angles, channel_coordinates, require_signal
from fem.support.arguments import Numbers, checked
from fem.support.validation import require

#: Degree of the polynomials of the amplitudes within a window: order cuts of a resonance stay unbiased to second order.
DEGREE = 2
#: Least product of window [revolutions] and distance of orders: the condition number of the fit is then about 8.
SEPARATION = 4.0
#: Change of the speed in a window, as share of the speed, from which on `order_cut` warns.
SMEARED = 0.3
#: Windows that are fitted in one matrix product.
CHUNK = 256
#: Matrices of the size of the fit that are in memory at once.
MATRICES = 4
PHASE = {"units": "rad", "long_name": "phase of the cosine over order times angle"}


@checked
def order_cut(
    signal: xr.DataArray, orders: Numbers, *, revolutions: float | None = None, overlap: float = 0.75
) -> xr.Dataset:
    """Amplitude and phase of the orders of a signal over time and speed.

    signal         (..., time) as `exugear.signal` returns it
    orders         (n_order,) orders of the shaft, such as `exugear.mesh_orders` returns
    revolutions    length of a window; by default 4 over the smallest distance of two orders, at least 4
    overlap        of neighbouring windows, as share of their length

    The signal is sampled over the shaft angle. In each window the amplitudes of all orders, and that of order 0, are
    polynomials of second degree over the angle, which are fitted together by least squares with the weights of a Hann
    window. Thus close orders of steady amplitudes do not disturb each other at any slew rate, and the first and the
    last value stand at the ends of the signal. At equal steps of the angle the fit is the same matrix in all windows.

    Coupled orders with smooth amplitudes are those of the Vold-Kalman filter of second generation (Feldbauer and
    Hoeldrich, Proc. DAFX 2000; Tuma, Proc. ICSV12 2005), whose global system polynomials in windows replace.

    The peak of a resonance is flattened where the speed changes within a window: at a damping ratio of 3 and 6 % by 5
    and 1 % if the speed changes by 10 %, by 18 and 5 % if by 15 %, by 39 and 16 % if by 30 %, from where on this warns.

    Returns a Dataset over order and time with amplitude, phase [rad] and the coordinates speed [rad/s] and angle [rad]:
    the signal is the sum of amplitude cos(order angle + phase). Values are NaN where a period of the order has fewer
    than 2.25 samples. Raises ValueError for windows too short to tell the orders apart or longer than the signal, where
    no order has enough samples, and for more than 5e8 values.
    """
    cut = cut_of(signal, orders, revolutions=revolutions, overlap=overlap)
    length = _window_length(_distinct(orders), revolutions)
    change = _change_of_speed(signal, cut["angle"].values, length)
    if change > SMEARED:
        smeared = f"the speed changes by {change:.0%} in a window of {length:.3g} revolutions, which smears resonances"
        remedy = "shorten revolutions, pass fewer close orders, or let the speed change more slowly"
        warnings.warn(f"{smeared}; {remedy}", stacklevel=3)
    return cut


def cut_of(
    signal: xr.DataArray, orders: Numbers, *, revolutions: float | None = None, overlap: float = 0.75
) -> xr.Dataset:
    """`order_cut` at any change of the speed."""
    require_signal(signal)
    orders = _distinct(orders)
    length = _window_length(orders, revolutions)
    check_overlap(overlap)
    angle, highest = signal["angle"].values, float(orders[-1]) + SEPARATION / length
    turned = (angle[-1] - angle[0]) / REVOLUTION
    needed = length + 2 * HALF_LENGTH / (SAMPLES_PER_PERIOD * highest)
    window = f"a window of {length:.3g} revolutions and the ends of its filter take {needed:.3g}"
    long = f"{window} of the signal's {turned:.3g}; record longer, or pass fewer close orders or shorter revolutions"
    require(length < turned, long)
    points = _points(signal, orders, (1 - overlap) * length, overlap)
    coarse = _coarse(signal, points, orders)
    fine = f"no period of an order of {orders} has {SAMPLES_PER_PERIOD} samples or more; sample finer"
    require(not coarse.all(), fine)
    number = _window_samples(orders, length * SAMPLES_PER_PERIOD * highest)
    sampled = over_angle(signal, orders=highest).isel(angle=slice(HALF_LENGTH, -HALF_LENGTH))
    require(sampled["angle"].size > number, long)
    rows = sampled.values.reshape(-1, sampled["angle"].size)
    phasors = np.array([_phasors(row, sampled["angle"].values, points, orders, number) for row in rows])
    phasors[:, coarse] = np.nan
    return _labelled(signal, points, orders, phasors)


def _distinct(orders) -> np.ndarray:
    """The orders in rising order."""
    orders = np.unique(np.atleast_1d(np.asarray(orders, float)))
    positive = bool(orders.size and (orders > 0).all() and np.isfinite(orders).all())
    require(positive, f"orders must be > 0 and finite, one at least, got {orders}")
    return orders


def _window_length(orders: np.ndarray, revolutions: float | None) -> float:
    """Length of a window [revolutions]."""
    closest = float(np.diff(orders, prepend=0).min())
    length = SEPARATION / min(closest, 1.0) if revolutions is None else revolutions
    least = f"revolutions must be >= {SEPARATION / closest:.4g} to tell orders {closest:.4g} apart, got {length:.4g}"
    require(length * closest >= SEPARATION * (1 - 1e-9), least)
    return length


def _change_of_speed(signal: xr.DataArray, angles: np.ndarray, length: float) -> float:
    """Change of the speed in a window [revolutions], as share of the speed: the median over these angles."""
    known, speed = signal["angle"].values, np.abs(signal["speed"].values)
    half = length * REVOLUTION / 2
    ends = [np.interp(angles + shift, known, speed) for shift in (-half, 0.0, half)]
    moving = ends[1] > 0
    return float(np.median(np.abs(ends[2] - ends[0])[moving] / ends[1][moving]))


def _points(signal: xr.DataArray, orders: np.ndarray, step: float, overlap: float) -> np.ndarray:
    """(n_point,) angles from the first to the last, at most a step [revolutions] apart, which the overlap gives."""
    first, last = signal["angle"].values[[0, -1]]
    steps = (last - first) / (REVOLUTION * step)
    values = 2 * signal.size / signal.sizes["time"] * orders.size * steps
    check_size(f"overlap = {overlap}", values, "let the windows overlap less, or pass fewer channels")
    return np.linspace(first, last, int(np.ceil(steps)) + 1)


def _window_samples(orders: np.ndarray, number: float) -> int:
    """Number of samples in a window; ValueError where the matrices of its fit take too many values."""
    columns, fit = (2 * orders.size + 1) * (DEGREE + 1), f"a window of {orders.size} orders up to {orders[-1]:g}"
    check_size(fit, MATRICES * number * columns, "pass fewer or lower orders, or shorter windows by revolutions")
    return round(number)


def _phasors(values: np.ndarray, angle: np.ndarray, points: np.ndarray, orders: np.ndarray, number: int) -> np.ndarray:
    """(n_order, n_point) complex amplitudes at angles, of values at equal steps of the angle.

    number   of samples in a window; the windows of the first and last points are those at the ends of the values
    """
    step = (angle[-1] - angle[0]) / (angle.size - 1)
    half = step * number / 2
    first = np.clip(np.rint((points - angle[0] - half) / step).astype(int), 0, angle.size - number)
    centre = angle[first] + half - step / 2
    offsets = step * (np.arange(number) - (number - 1) / 2)
    fit = _fit(offsets, half, orders)
    windows = np.lib.stride_tricks.sliding_window_view(values, number)
    chunks = [windows[first[k : k + CHUNK]] @ fit.T for k in range(0, points.size, CHUNK)]
    coefficients = np.concatenate(chunks).reshape(points.size, 2, -1, DEGREE + 1)
    cosine, sine = np.einsum("pcoj,pj->cop", coefficients, legendre.legvander((points - centre) / half, DEGREE))
    return (cosine - 1j * sine) * np.exp(-1j * np.outer(orders, centre))


def _fit(offsets: np.ndarray, half: float, orders: np.ndarray) -> np.ndarray:
    """(2 n_order (DEGREE + 1), n) matrix from samples to the coefficients of all cosines, then of all sines.

    offsets   (n,) angles of the samples from the centre of the window
    half      half the window [rad]
    """
    arguments = np.outer(offsets, orders)
    waves = np.concatenate([np.cos(arguments), np.sin(arguments), np.ones((offsets.size, 1))], axis=1)
    polynomials = legendre.legvander(offsets / half, DEGREE)
    base = (waves[:, :, None] * polynomials[:, None, :]).reshape(offsets.size, -1)
    weights = np.sqrt(scipy.signal.get_window("hann", offsets.size, fftbins=False))
    q, r = scipy.linalg.qr(weights[:, None] * base, mode="economic")
    return scipy.linalg.solve_triangular(r, q.T * weights)[: -(DEGREE + 1)]


def _coarse(signal: xr.DataArray, points: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """(n_order, n_point) whether the samples are too coarse for an order."""
    passed = np.gradient(signal["angle"].values) / REVOLUTION
    at_points = np.interp(points, signal["angle"].values, passed)
    return np.outer(orders, at_points) * SAMPLES_PER_PERIOD > 1


def _labelled(signal: xr.DataArray, points: np.ndarray, orders: np.ndarray, phasors: np.ndarray) -> xr.Dataset:
    """The Dataset of the cut: phasors (n_row, n_order, n_point)."""
    about = {"units": "1", "long_name": "order of the shaft"}
    coordinates = channel_coordinates(signal) | at_angles(signal, points, "time")
    coordinates |= {"angle": ("time", points, signal["angle"].attrs), "order": ("order", orders, about)}
    dims, shape = (*signal.dims[:-1], "order", "time"), (*signal.shape[:-1], orders.size, points.size)
    amplitude = dims, np.abs(phasors).reshape(shape), signal.attrs
    return xr.Dataset({"amplitude": amplitude, "phase": (dims, np.angle(phasors).reshape(shape), PHASE)}, coordinates)
