"""Amplitude and phase of orders along a run, from windows as long as the change of the speed allows.

In each window all orders are fitted together by least squares (`phasors`); longer windows check shorter ones.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.polynomial import legendre

from exugear.signals.angle_sampling import HALF_LENGTH, REVOLUTION, SAMPLES_PER_PERIOD, over_angle
from exugear.signals.short_time_spectra import check_overlap
from exugear.signals.signal import at_angles, channel_coordinates, check_size, order_names, require_signal
from fem.support.arguments import Numbers, checked
from fem.support.blas_threads import one_thread
from fem.support.user_warning import warn_user
from fem.support.validation import require

#: Share of their length by which neighbouring windows overlap.
OVERLAP = 0.75
#: Least product of window [revolutions] and distance of orders: the condition number of the fit is then about 8.
SEPARATION = 4.0
#: Longest window [revolutions], unless close orders take longer ones.
LONGEST = 5.0
#: Change of the speed in a window, as share of the speed, up to which residuals count as noise.
CHANGE = 0.1
#: Points are as dense as windows over this change of the speed would overlap: peaks of 1 % damping show.
DENSE = 0.025
#: Ratio of neighbouring window lengths at most; lengths by which a window that disagrees is shortened.
RATIO, SHORTER = 2**0.25, 2
#: Length of the window that checks another one over its length.
LONGER = 2**0.5
#: Angles at which the density of the points is found, and knots of the time over the angle for the change of the speed.
GRID, KNOTS = 1000, 20_000
#: Difference of the phasors in both windows up to which they agree, as share of the amplitude: where the speed changes
#: less, and where it changes more. The error of polynomials of second degree is a third of the difference.
DIFFERENCE, STEADY = 0.05, 0.02
#: The same in standard errors, and as share of the largest amplitude at that point.
ERRORS, NEGLIGIBLE = 3.0, 0.005
#: Reasons for NaN, by their number.
REASONS = (
    "told",
    "samples_too_coarse",
    "amplitude_changes_within_the_shortest_window",
    "shaft_reverses_within_the_window",
    "tone_coincides_with_the_order",
)
TOLD, COARSE, CHANGING, REVERSING, COINCIDING = range(len(REASONS))
#: Degree of the polynomials of the amplitudes within a window: order cuts of a resonance stay unbiased to second order.
DEGREE = 2
#: Windows that are fitted in one matrix product.
CHUNK = 256
#: Samples from which on windows at the ends of a signal leave out up to this share of half their length.
SAMPLES, LEFT_OUT = 100_000, 0.1
#: Matrices of the size of the fit that are in memory at once.
MATRICES = 6
#: Error that sampling over the angle leaves, as share of the rms of the signal.
SAMPLING_ERROR = 1e-5
#: Share of a tone that the orders must leave to it: with less they are one and the same in the window.
LEAST_SHARE = 1e-4
#: Added to the moments of a fit as share of their sum: samples too coarse for an order give it a large standard error.
ROUNDING = 1e-14
PHASE = {"units": "rad", "long_name": "phase of the cosine over order times angle"}
RESOLUTION = {"units": "1", "long_name": "distance from which on orders that are not listed do not disturb"}
REASON = {"units": "1", "long_name": "reason of NaN, by number", "flag_meanings": " ".join(REASONS)}


class Phasors(NamedTuple):
    """Complex amplitudes of orders and their standard errors, each (n_row, n_order, n_point).

    The signal is the sum of the real parts of value exp(i order angle). Both are NaN where a tone coincides.
    """

    value: np.ndarray
    standard_error: np.ndarray


class Fit(NamedTuple):
    """Least squares of a window: base.T weights base = r.T r.

    weights      (n,) of the samples
    projection   (n, c) weights base / r: from samples to components, whose squares add up to the energy of the fit
    r            (c, c) upper triangle: from coefficients to components
    covariance   (c, c) of the coefficients under white noise of variance 1
    freedom      expected sum of the weighted squares of the residuals under that noise
    """

    weights: np.ndarray
    projection: np.ndarray
    r: np.ndarray
    covariance: np.ndarray
    freedom: float


@dataclass(frozen=True, eq=False)
class Samples:
    """A signal as the fit reads it: at its own samples, and at equal steps of the angle behind a low-pass filter.

    angle, time   (n,) of the samples
    spacing       (n,) angle between them
    rows          (n_row, n)
    even_angle    (m,), without the ends, where the filter reads a continued signal; empty for short signals
    even_rows     (n_row, m)
    """

    angle: np.ndarray
    time: np.ndarray
    spacing: np.ndarray
    rows: np.ndarray
    even_angle: np.ndarray
    even_rows: np.ndarray

    @property
    def step(self) -> float:
        """Equal step of the angle."""
        return (self.even_angle[-1] - self.even_angle[0]) / (self.even_angle.size - 1)


@checked
def order_cut(
    signal: xr.DataArray,
    orders: Numbers,
    *,
    revolutions: float | None = None,
    overlap: float = OVERLAP,
    frequencies: Numbers = (),
) -> xr.Dataset:
    """Amplitude and phase of the orders of a signal over time and speed.

    signal         (..., time) as `exugear.signal` returns it
    orders         (n_order,) orders of the shaft, such as `exugear.mesh_orders` returns
    revolutions    length of all windows; by default each point has a window of its own
    overlap        of neighbouring windows, as share of their length
    frequencies    (n_tone,) of tones [Hz] in the signal that do not follow the speed: they are fitted together with the
                   orders, whose amplitudes would beat where they cross

    In each window of the angle the amplitudes of all orders, and that of order 0, are polynomials of second degree,
    which are fitted together by least squares with the weights of a Hann window. Thus close orders of steady amplitudes
    do not disturb each other at any slew rate, and the first and the last value stand at the ends of the signal.

    By default a window takes 5 revolutions, or 4 over the smallest distance of two orders where that is more. Each
    value is checked by a window longer by a factor of sqrt(2): where they differ by more than 2 %, shorter windows are
    tried, down to 4 over that distance. Where the speed changes by less than 10 % in a window, 5 % and 3 standard
    errors count as agreement, and 0.5 % of the largest order everywhere. What agrees is right within 3 % or 3 standard
    errors; the rest is NaN, and a warning says where.

    Coupled orders with smooth amplitudes are those of the Vold-Kalman filter of second generation (Feldbauer and
    Hoeldrich, Proc. DAFX 2000; Tuma, Proc. ICSV12 2005), whose global system polynomials in windows replace.

    Returns a Dataset over order and time, with the coordinates speed [rad/s] and angle [rad] along time, and
    order_name, the harmonic and stage of mesh orders of a run:

    amplitude, phase   [rad]: the signal is the sum of amplitude cos(order angle + phase)
    standard_error     of the amplitude: by the residual of the fit as white noise, or a third of the difference above
    resolution         4 over the window: orders that are not listed disturb those that lie nearer to them
    reason             why an amplitude is NaN: 0 it is not, 1 a period of the order has fewer than 2.25 samples, 2 the
                       amplitude changes within the shortest window, 3 the shaft reverses within it, 4 a tone coincides

    Raises ValueError for windows too short to tell the orders apart or, longer by sqrt(2), longer than the signal,
    where no order has enough samples, and for more than 5e8 values.
    """
    cut = cut_of(signal, orders, revolutions, overlap, frequencies)
    _warn_of_changes(cut, _lengths(cut["order"].values, revolutions, np.inf)[0], revolutions is None)
    return told(cut)


def told(cut: xr.Dataset) -> xr.Dataset:
    """A cut of `cut_of` with NaN for what cannot be told."""
    known = cut["reason"] == TOLD
    return cut.assign({name: cut[name].where(known) for name in ("amplitude", "phase", "standard_error")})


def _warn_of_changes(cut: xr.Dataset, shortest: float, by_default: bool) -> None:
    """Warn where amplitudes change too fast for the windows [revolutions]."""
    changing: np.ndarray = (cut["reason"] == CHANGING).transpose("order", "time", ...).values
    if not changing.any():
        return
    changing = np.any(changing.reshape(*changing.shape[:2], -1), axis=2)
    lost, speed = changing.any(axis=1), cut["speed"].values[changing.any(axis=0)] * 30 / np.pi
    names = ", ".join(f"{order:.6g}" for order in cut["order"].values[lost])
    where = f"orders {names} are NaN in {changing[lost].mean():.1%} of the points, between {speed.min():.4g} and"
    cause = f"{speed.max():.4g} rpm: their amplitudes change within windows of {shortest:.3g} revolutions"
    remedy = "pass fewer close orders, or" if by_default else "shorten revolutions, or"
    text = f"{where} {cause}; {remedy} let the speed change more slowly"
    warn_user(text)


@one_thread()
def cut_of(
    signal: xr.DataArray,
    orders: Numbers,
    revolutions: float | None = None,
    overlap: float = OVERLAP,
    frequencies: Numbers = (),
) -> xr.Dataset:
    """`order_cut` without a warning, with the estimates of the shortest windows in place of NaN beside their reason."""
    require_signal(signal)
    orders, frequencies = _distinct(orders), _distinct_tones(frequencies)
    check_overlap(overlap)
    angle = signal["angle"].values
    turned = (angle[-1] - angle[0]) / REVOLUTION
    lengths = _lengths(orders, revolutions, turned / LONGER)
    needed = lengths[0] * LONGER
    window = f"a window of {lengths[0]:.3g} revolutions and the longer one that checks it take {needed:.3g}"
    long = f"{window} of the signal's {turned:.3g}; record longer, or pass fewer close orders or shorter revolutions"
    require(needed <= turned * (1 + 1e-9), long)
    highest = float(orders[-1]) + SEPARATION / lengths[0]
    points = _points(signal, orders, lengths, overlap)
    coarse = _coarse(signal, points, orders)
    fine = f"no period of an order of {orders} has {SAMPLES_PER_PERIOD} samples or more; sample finer"
    require(not coarse.all(), fine)
    check_fit_size(orders, SAMPLES_PER_PERIOD * highest * lengths[-1] * LONGER)
    quiet = _rungs(signal, points, lengths, CHANGE)
    samples = samples_of(signal, highest)
    value, error, length, reason = _checked_phasors(signal, samples, points, lengths, quiet, orders, frequencies)
    value[:, coarse], error[:, coarse], reason[:, coarse] = np.nan, np.nan, COARSE
    return _labelled(signal, points, orders, value, error, SEPARATION / length, reason)


def _distinct(orders) -> np.ndarray:
    """The orders in rising order."""
    orders = np.unique(np.atleast_1d(np.asarray(orders, float)))
    positive = bool(orders.size and (orders > 0).all() and np.isfinite(orders).all())
    require(positive, f"orders must be > 0 and finite, one at least, got {orders}")
    return orders


def _distinct_tones(frequencies) -> np.ndarray:
    """The frequencies [Hz] in rising order."""
    frequencies = np.unique(np.asarray(frequencies, float))
    positive = bool((frequencies > 0).all() and np.isfinite(frequencies).all())
    require(positive, f"frequencies must be > 0 Hz and finite, got {frequencies}")
    return frequencies


def _lengths(orders: np.ndarray, revolutions: float | None, longest: float) -> np.ndarray:
    """(n_length,) rising lengths of windows [revolutions], the first the least that tells the orders apart."""
    closest = float(np.diff(orders, prepend=0).min())
    if revolutions is not None:
        least = f"revolutions must be >= {SEPARATION / closest:.4g} to tell orders {closest:.4g} apart"
        require(revolutions * closest >= SEPARATION * (1 - 1e-9), f"{least}, got {revolutions:.4g}")
        return np.array([revolutions])
    shortest = SEPARATION / closest
    longest = max(min(LONGEST, longest), shortest)
    return np.geomspace(shortest, longest, int(np.ceil(np.log(longest / shortest) / np.log(RATIO))) + 1)


def _rungs(signal: xr.DataArray, points: np.ndarray, lengths: np.ndarray, change: float) -> np.ndarray:
    """(n_point,) number of the longest window in which the speed changes by at most this share, 0 without one.

    The speed is that of the quarters of the window, so that ripple and noise of the speed hardly count.
    """
    every = max(1, signal.sizes["time"] // KNOTS)
    angle, time = (np.append(signal[name].values[:-1:every], signal[name].values[-1]) for name in ("angle", "time"))
    rungs = np.zeros(points.size, int)
    for rung, length in enumerate(lengths[1:], start=1):
        half = length * REVOLUTION / 2
        centre = np.clip(points, angle[0] + half, angle[-1] - half)
        spent = np.diff([np.interp(centre + k * half / 2, angle, time) for k in range(-2, 3)], axis=0)
        speed = 1 / np.maximum(spent, np.finfo(float).tiny)
        rungs[np.ptp(speed, axis=0) * 4 / 3 <= change * speed.mean(axis=0)] = rung
    return rungs


def _points(signal: xr.DataArray, orders: np.ndarray, lengths: np.ndarray, overlap: float) -> np.ndarray:
    """(n_point,) angles from the first to the last, as dense as windows over small changes of the speed overlap."""
    angle = signal["angle"].values
    share = np.linspace(0, 1, GRID)
    evenly = angle[0] + share * (angle[-1] - angle[0])
    every = np.unique([evenly, np.interp(share, np.linspace(0, 1, angle.size), angle)])
    spacing = (1 - overlap) * REVOLUTION * lengths[_rungs(signal, every, lengths, DENSE)]
    steps = np.append(0, np.cumsum(np.diff(every) * (1 / spacing[1:] + 1 / spacing[:-1]) / 2))
    values = 2 * signal.size / signal.sizes["time"] * orders.size * steps[-1]
    check_size(f"overlap = {overlap}", values, "let the windows overlap less, or pass fewer channels")
    number = int(np.ceil(steps[-1] * (1 - 1e-12))) + 1
    return np.interp(np.linspace(0, steps[-1], number), steps, every)


def _checked_phasors(
    signal: xr.DataArray, samples: Samples, points, lengths, quiet, orders, frequencies
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Phasors, their standard errors, lengths of the windows and reasons, each (n_row, n_order, n_point).

    quiet   (n_point,) number of the longest window in which the speed hardly changes
    """
    shape = samples.rows.shape[0], orders.size, points.size
    value, error, length = np.zeros(shape, complex), np.zeros(shape), np.zeros(shape)
    reason, reversals = np.full(shape, CHANGING, np.int8), _reversals(signal)
    left, rungs = np.ones(points.size, bool), np.full(points.size, lengths.size - 1)
    while left.any():
        pending, latest = (reason != TOLD) & left, np.zeros(shape, np.int8)
        for rung in np.unique(rungs[left]):
            at = np.flatnonzero(left & (rungs == rung))
            short = phasors(samples, points[at], lengths[rung], orders, frequencies)
            long = phasors(samples, points[at], lengths[rung] * LONGER, orders, frequencies)
            tried = pending[..., at]
            deviation = np.maximum(short.standard_error, np.abs(long.value - short.value) / ERRORS)
            for kept, tries in ((value, short.value), (error, deviation), (length, lengths[rung])):
                kept[..., at] = np.where(tried, tries, kept[..., at])
            differs = _differs(short, long, rung <= quiet[at])
            differs[..., _reverses(samples.angle, points[at], lengths[rung], reversals)] = REVERSING
            latest[..., at] = np.where(tried, differs, TOLD)
        near = _widened(latest, points, REVOLUTION / 2 * lengths[rungs])
        reason[pending] = np.where(near & (latest == TOLD), CHANGING, latest)[pending]
        left = left & (rungs > 0) & (reason != TOLD).any(axis=(0, 1))
        rungs = np.where(left, np.maximum(rungs - SHORTER, 0), rungs)
    return value, error, length, reason


def _differs(short: Phasors, long: Phasors, quiet: np.ndarray) -> np.ndarray:
    """(n_row, n_order, n_point) reason by which the phasors of a window cannot be told, by those of a longer window.

    quiet   (n_point,) whether the speed hardly changes in the window, so that residuals are noise that explains a
            difference, rather than amplitudes that change
    """
    amplitude, difference = np.abs(short.value), np.abs(long.value - short.value)
    noise = np.where(quiet, ERRORS * short.standard_error, 0.0)
    allowed = np.maximum(np.where(quiet, DIFFERENCE, STEADY) * amplitude, noise)
    agrees = difference <= np.maximum(allowed, NEGLIGIBLE * amplitude.max(axis=1, keepdims=True))
    return np.where(np.isnan(difference), COINCIDING, np.where(agrees, TOLD, CHANGING))


def _reversals(signal: xr.DataArray) -> np.ndarray:
    """Angles at which the shaft reverses."""
    moving = np.flatnonzero(signal["speed"].values)
    turns = np.flatnonzero(np.diff(np.sign(signal["speed"].values[moving])))
    return signal["angle"].values[moving[turns]]


def _reverses(angle: np.ndarray, points: np.ndarray, revolutions: float, reversals: np.ndarray) -> np.ndarray:
    """(n_point,) whether windows about points hold a reversal."""
    half = revolutions * REVOLUTION / 2
    centre = np.clip(points, angle[0] + half, angle[-1] - half)
    return np.searchsorted(reversals, centre - half) < np.searchsorted(reversals, centre + half)


def _widened(reason: np.ndarray, points: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(..., n_point) whether a point lies within the width (n_point,) of one with a reason."""
    first, end = np.searchsorted(points, points - width), np.searchsorted(points, points + width, side="right")
    counts = np.zeros((*reason.shape[:-1], points.size + 1), int)
    for row in np.ndindex(reason.shape[:-1]):
        marked = reason[row] != TOLD
        counts[row] += np.bincount(first[marked], minlength=points.size + 1)
        counts[row] -= np.bincount(end[marked], minlength=points.size + 1)
    return counts.cumsum(axis=-1)[..., :-1] > 0


def _coarse(signal: xr.DataArray, points: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """(n_order, n_point) whether the samples are too coarse for an order."""
    passed = np.gradient(signal["angle"].values) / REVOLUTION
    at_points = np.interp(points, signal["angle"].values, passed)
    return np.outer(orders, at_points) * SAMPLES_PER_PERIOD > 1


def _labelled(signal: xr.DataArray, points, orders, value, error, resolution, reason) -> xr.Dataset:
    """The Dataset of a cut, of arrays (n_row, n_order, n_point)."""
    about = {"units": "1", "long_name": "order of the shaft"}
    coordinates = channel_coordinates(signal) | at_angles(signal, points, "time")
    coordinates |= {"angle": ("time", points, signal["angle"].attrs), "order": ("order", orders, about)}
    names = {"units": "1", "long_name": "name of the order"}
    coordinates["order_name"] = ("order", order_names(signal, orders), names)
    of_error = signal.attrs | {"long_name": "standard error of the amplitude"}
    variables = {
        "amplitude": (np.abs(value), signal.attrs),
        "phase": (np.angle(value), PHASE),
        "standard_error": (error, of_error),
        "resolution": (resolution, RESOLUTION),
        "reason": (reason, REASON),
    }
    dims, shape = (*signal.dims[:-1], "order", "time"), (*signal.shape[:-1], orders.size, points.size)
    return xr.Dataset({name: (dims, x.reshape(shape), attrs) for name, (x, attrs) in variables.items()}, coordinates)


def samples_of(signal: xr.DataArray, highest: float) -> Samples:
    """A signal sampled for orders up to a highest one."""
    angle, time = signal["angle"].values, signal["time"].values
    rows = signal.values.reshape(-1, time.size)
    even_angle, even_rows = np.zeros(0), np.zeros((rows.shape[0], 0))
    if (angle[-1] - angle[0]) / REVOLUTION * SAMPLES_PER_PERIOD * highest > 2 * HALF_LENGTH + 2:
        even = over_angle(signal, highest_order=highest).isel(angle=slice(HALF_LENGTH, -HALF_LENGTH))
        even_angle, even_rows = even["angle"].values, even.values.reshape(rows.shape[0], -1)
    return Samples(angle, time, np.gradient(angle), rows, even_angle, even_rows)


def check_fit_size(orders: np.ndarray, number: float) -> None:
    """ValueError where the matrices of a fit of this number of samples take too many values."""
    columns, fit = (2 * orders.size + 1) * (DEGREE + 1), f"a window of {orders.size} orders up to {orders[-1]:g}"
    check_size(fit, MATRICES * number * columns, "pass fewer or lower orders, or shorter windows by revolutions")


def phasors(
    samples: Samples, points: np.ndarray, revolutions: float, orders: np.ndarray, frequencies: np.ndarray
) -> Phasors:
    """Phasors of the orders at points (n_point,) [rad], each from a window of some revolutions about it.

    frequencies   (n_tone,) of tones [Hz] that are fitted together with the orders, of constant amplitude in a window

    At the ends of the signal windows end with it, and take its own samples where those over the angle are missing.
    """
    half = revolutions * REVOLUTION / 2
    centre = np.clip(points, samples.angle[0] + half, samples.angle[-1] - half)
    value = np.empty((samples.rows.shape[0], orders.size, points.size), complex)
    error = np.empty(value.shape)
    even = _within_even_samples(samples, centre, half)
    if even.any():
        value[..., even], error[..., even] = _from_even_samples(
            samples, points[even], centre[even], half, orders, frequencies
        )
    for middle in np.unique(centre[~even]):
        at = ~even & (centre == middle)
        value[..., at], error[..., at] = _from_recorded_samples(samples, points[at], middle, half, orders, frequencies)
    return Phasors(value, error)


def _within_even_samples(samples: Samples, centre: np.ndarray, half: float) -> np.ndarray:
    """(n_point,) whether windows take the samples at equal steps of the angle.

    At the ends of the signal so do windows whose samples are coarser, and those of many samples, that leave out a small
    share of their length.
    """
    even = samples.even_angle
    if even.size < 2 or even[-1] - even[0] < 2 * half:
        return np.zeros(centre.size, bool)
    low, high = (np.searchsorted(samples.angle, centre + shift) for shift in (-half, half))
    coarser = np.interp(centre, samples.angle, samples.spacing) > samples.step
    margin = np.where(coarser, (HALF_LENGTH + 1) * samples.step, samples.step / 2)
    margin = np.where(high - low > SAMPLES, np.maximum(LEFT_OUT * half, margin), margin)
    return (centre - half >= even[0] - margin) & (centre + half <= even[-1] + margin)


def _fit(offsets: np.ndarray, half: float, orders: np.ndarray, steps: float | np.ndarray = 1.0) -> Fit:
    """The fit of a window.

    offsets   (n,) angles of the samples from the centre of the window [rad]
    half      half the window [rad]
    steps     angle that each sample stands for
    """
    weights = np.cos(np.pi / 2 * np.clip(offsets / half, -1, 1)) ** 2 * steps
    arguments = np.outer(offsets, orders)
    waves = np.concatenate([np.cos(arguments), np.sin(arguments), np.ones((offsets.size, 1))], axis=1)
    polynomials = legendre.legvander(offsets / half, DEGREE)
    base = (waves[:, :, None] * polynomials[:, None, :]).reshape(offsets.size, -1)
    weighted = weights[:, None] * base
    moments = base.T @ weighted
    r = scipy.linalg.cholesky(moments + ROUNDING * np.trace(moments) * np.eye(moments.shape[0]))
    projection = scipy.linalg.solve_triangular(r, weighted.T, trans="T").T
    noise = projection.T @ projection
    inverse = scipy.linalg.solve_triangular(r, np.eye(r.shape[0]))
    return Fit(weights, projection, r, inverse @ noise @ inverse.T, float(weights.sum() - np.trace(noise)))


def _from_even_samples(samples: Samples, points, centre, half: float, orders, frequencies) -> Phasors:
    """`phasors` from samples at equal steps of the angle, where the fit is the same matrix in all windows."""
    step, start = samples.step, samples.even_angle[0]
    number = min(round(2 * half / step), samples.even_angle.size)
    half = number * step / 2
    first = np.clip(np.rint((centre - half - start) / step + 0.5).astype(int), 0, samples.even_angle.size - number)
    centre = start + (first + (number - 1) / 2) * step
    fit = _fit(step * (np.arange(number) - (number - 1) / 2), half, orders)
    time = np.interp(samples.even_angle, samples.angle, samples.time) if frequencies.size else np.zeros(0)
    spacing = np.interp(points, samples.angle, samples.spacing)
    value = np.empty((samples.even_rows.shape[0], orders.size, points.size), complex)
    error = np.empty(value.shape)
    for k in range(0, points.size, CHUNK):
        part = slice(k, k + CHUNK)
        window = first[part, None] + np.arange(number)
        tones = _tones(time[window], frequencies) if frequencies.size else None
        polynomials = legendre.legvander((points[part] - centre[part]) / half, DEGREE)
        for row, values in enumerate(samples.even_rows):
            at_centre, deviation = _solved(values[window], fit, polynomials, tones)
            value[row, :, part] = (at_centre * np.exp(-1j * np.outer(centre[part], orders))).T
            error[row, :, part] = deviation.T
    return Phasors(value, error * np.sqrt(np.maximum(spacing / step, 1.0)))


def _from_recorded_samples(samples: Samples, points, centre: float, half: float, orders, frequencies) -> Phasors:
    """`phasors` at points in one window, from the samples of the signal itself."""
    first, last = np.searchsorted(samples.angle, [centre - half, centre + half])
    window = slice(max(first - 1, 0), last + 1)
    angle = samples.angle[window]
    check_fit_size(orders, angle.size)
    steps = samples.spacing[window]
    fit = _fit(angle - centre, half, orders, steps / steps.mean())
    tones = _tones(samples.time[None, window], frequencies) if frequencies.size else None
    polynomials = legendre.legvander((points - centre) / half, DEGREE)
    turn = np.exp(-1j * np.outer(orders, np.full(points.size, centre)))
    estimates = [
        [_solved(row[None, window], fit, polynomials[[k]], tones) for k in range(points.size)] for row in samples.rows
    ]
    value = np.array([[estimate.value[0] for estimate in row] for row in estimates]).transpose(0, 2, 1) * turn
    error = np.array([[estimate.standard_error[0] for estimate in row] for row in estimates]).transpose(0, 2, 1)
    return Phasors(value, error)


def _tones(time: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """(n_window, n, 2 n_tone) cosines and sines of tones at times (n_window, n)."""
    middle = time[:, [time.shape[1] // 2]]
    arguments = REVOLUTION * (time - middle)[..., None] * frequencies
    return np.concatenate([np.cos(arguments), np.sin(arguments)], axis=2)


def _solved(block: np.ndarray, fit: Fit, polynomials: np.ndarray, tones: np.ndarray | None) -> Phasors:
    """Phasors about the centres of windows and their standard errors, each (n_window, n_order).

    block         (n_window, n) samples
    polynomials   (n_window, DEGREE + 1) at the points
    tones         (n_window, n, 2 n_tone) further columns
    """
    weight = fit.weights.sum()
    energy, mean = (block**2) @ fit.weights, (block @ fit.weights) / weight
    components = block @ fit.projection
    residual = energy - (components**2).sum(axis=1)
    variance = _variances(fit, polynomials)
    if tones is not None:
        components, explained, added = _without_tones(block, components, fit, polynomials, tones)
        residual, variance = residual - explained, variance + added
    cosine, sine = _coefficients(fit, components[..., None], polynomials)[..., 0].swapaxes(0, 1)
    noise = np.maximum(residual, 0.0) / max(fit.freedom, 1e-9)
    sampling = SAMPLING_ERROR**2 * np.maximum(energy / weight - mean**2, 0.0)
    return Phasors(cosine - 1j * sine, np.sqrt(noise[:, None] * variance + sampling[:, None]))


def _coefficients(fit: Fit, components: np.ndarray, polynomials: np.ndarray) -> np.ndarray:
    """(n_window, 2, n_order, k) cosine and sine parts at the points, of components (n_window, c, k)."""
    windows, columns, _ = components.shape
    solved = scipy.linalg.solve_triangular(fit.r, components.swapaxes(0, 1).reshape(columns, -1))
    waves = solved[: -(DEGREE + 1)].reshape(2, -1, DEGREE + 1, windows, components.shape[2])
    return np.einsum("cojpk,pj->pcok", waves, polynomials)


def _variances(fit: Fit, polynomials: np.ndarray) -> np.ndarray:
    """(n_window, n_order) variances under white noise of variance 1: means of those of cosine and sine."""
    columns = DEGREE + 1
    waves = range(0, fit.r.shape[0] - columns, columns)
    blocks = np.array([fit.covariance[k : k + columns, k : k + columns] for k in waves])
    variances = np.einsum("pi,wij,pj->pw", polynomials, blocks, polynomials)
    return variances.reshape(len(polynomials), 2, -1).mean(axis=1)


def _without_tones(block, components, fit: Fit, polynomials, tones) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Components (n_window, c) of a joint fit with tones, the energy that these explain, and variances that they add.

    The columns of the orders are the same in all windows, so that only the small Schur complement of the tones is
    solved in each of them. NaN where the orders leave a tone hardly any share.
    """
    transposed = tones.swapaxes(1, 2)
    moments, shared = transposed * fit.weights, transposed @ fit.projection
    whole = moments @ tones
    left = whole - shared @ shared.swapaxes(1, 2)
    coincide = np.linalg.eigvalsh(left)[:, 0] < LEAST_SHARE * np.linalg.eigvalsh(whole)[:, -1]
    left[coincide] = np.eye(left.shape[1])
    unexplained = moments @ block[..., None] - shared @ components[..., None]
    amplitudes = np.linalg.solve(left, unexplained)
    joint = components - (shared.swapaxes(1, 2) @ amplitudes)[..., 0]
    joint[coincide] = np.nan
    explained = (unexplained * amplitudes).sum(axis=(1, 2))
    leaks = _coefficients(fit, shared.swapaxes(1, 2), polynomials)
    added = np.einsum("pcok,pkl,pcol->po", leaks, np.linalg.inv(left), leaks) / 2
    return joint, explained, added
