"""Joint least-squares fit of orders in windows of the shaft angle: amplitudes, phases and their standard errors."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.polynomial import legendre

from exugear.signals.angle_sampling import HALF_LENGTH, REVOLUTION, SAMPLES_PER_PERIOD, over_angle
from exugear.signals.columns import check_size

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


def samples_of(signal: xr.DataArray, highest: float) -> Samples:
    """A signal sampled for orders up to a highest one."""
    angle, time = signal["angle"].values, signal["time"].values
    rows = signal.values.reshape(-1, time.size)
    even_angle, even_rows = np.zeros(0), np.zeros((rows.shape[0], 0))
    if (angle[-1] - angle[0]) / REVOLUTION * SAMPLES_PER_PERIOD * highest > 2 * HALF_LENGTH + 2:
        even = over_angle(signal, orders=highest).isel(angle=slice(HALF_LENGTH, -HALF_LENGTH))
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
        value[..., at], error[..., at] = _from_own_samples(samples, points[at], middle, half, orders, frequencies)
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


def _from_own_samples(samples: Samples, points, centre: float, half: float, orders, frequencies) -> Phasors:
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
