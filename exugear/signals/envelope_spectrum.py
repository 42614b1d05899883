"""Modulation of a band of frequencies: its envelope over time, and the orders of that.

Impacts of a damaged tooth or bearing excite resonances far above their own frequency; the envelope of such a band holds
the orders at which the impacts repeat. Source: R. B. Randall and J. Antoni, Mech. Syst. Signal Process. 25 (2011) 485.
"""

from collections.abc import Sequence

import numpy as np
import scipy
import xarray as xr

from exugear.signals.short_time_spectra import Window, order_tracking
from exugear.signals.signal import require_signal, sample_rate
from fem.support.arguments import checked
from fem.support.validation import require

#: Least width of a band over the resolution of the signal, 1 / duration: what is narrower has no envelope.
RESOLVED = 2.0
#: Order of the Butterworth filter, which runs forwards and backwards: no delay, twice the slope.
FILTER_ORDER = 4


@checked
def demodulate(signal: xr.DataArray, band: Sequence[float]) -> xr.DataArray:
    """Envelope of a band of frequencies of a signal: the modulus of its analytic signal.

    signal   (..., time) as `exugear.signal` returns it, at equal steps of time
    band     lowest and highest frequency [Hz], about a resonance

    Returns a signal like the given one. (1 + m cos x) cos(2 pi f t), with f in the band and the modulation within it,
    has the envelope 1 + m cos x. Raises ValueError for a band that the samples do not resolve.
    """
    require_signal(signal)
    rate = float(sample_rate(signal))
    edges = list(band)
    resolved = len(edges) == 2 and 0 < edges[0] < edges[1] < rate / 2
    require(resolved, f"band must be two rising frequencies in (0, {rate / 2:.6g}) Hz, got {edges}")
    width, least_width = edges[1] - edges[0], RESOLVED * rate / signal.sizes["time"]
    narrow = f"band must be {least_width:.4g} Hz wide or more for a signal of {signal.sizes['time'] / rate:.4g} s"
    require(width >= least_width, f"{narrow}, got {width:.4g} Hz; widen it, or record longer")
    sections = scipy.signal.butter(FILTER_ORDER, edges, "bandpass", fs=rate, output="sos")
    least = 3 * (2 * len(sections) + 1)
    require(signal.sizes["time"] > least, f"signal must have more than {least} samples, got {signal.sizes['time']}")
    inside = scipy.signal.sosfiltfilt(sections, signal.values, axis=-1)
    words = f"envelope of {signal.attrs.get('long_name', 'the signal')}, {edges[0]:g} to {edges[1]:g} Hz"
    padded = scipy.fft.next_fast_len(inside.shape[-1])
    analytic = scipy.signal.hilbert(inside, padded, axis=-1)[..., : inside.shape[-1]]
    return signal.copy(data=np.abs(analytic)).assign_attrs(long_name=words)


@checked
def envelope_spectrum(
    signal: xr.DataArray,
    band: Sequence[float],
    *,
    highest_order: float,
    revolutions: float = 8.0,
    overlap: float = 0.75,
    window: Window = "hann",
) -> xr.Dataset:
    """Orders at which a band of frequencies is modulated.

    signal         (..., time) as `exugear.signal` returns it, at equal steps of time
    band           lowest and highest frequency [Hz], as in `exugear.demodulate`
    highest_order  highest order of the modulation wanted
    revolutions, overlap, window
                   of the windows, as in `exugear.order_tracking`

    Returns the Dataset of `exugear.order_tracking` of the envelope, with mean_amplitude (..., order), the root of the
    mean square over the windows. An amplitude is NaN, and the mean without it, where the order lies beyond the width of
    the band at the speed of the window: the envelope cannot hold it. Raises ValueError as those functions do, and for
    orders beyond that width at all speeds.
    """
    require_signal(signal)
    slowest, width = float(np.abs(signal["speed"].values).min()) / (2 * np.pi), float(np.ptp(band))
    beyond = f"highest_order = {highest_order:g} is {highest_order * slowest:.4g} Hz at the lowest speed"
    remedy = "whose envelope holds frequencies up to that; widen the band"
    require(highest_order * slowest <= width, f"{beyond}, beyond the width of the band of {width:.4g} Hz, {remedy}")
    options = {"revolutions": revolutions, "overlap": overlap, "window": window}
    lines = order_tracking(demodulate(signal, band), highest_order=highest_order, **options)
    held = lines["order"] * np.abs(lines["speed"]) / (2 * np.pi) <= width
    amplitude = lines["amplitude"].where(held)
    mean = (amplitude**2).mean("time") ** 0.5
    return lines.assign(amplitude=amplitude, mean_amplitude=mean.assign_attrs(amplitude.attrs))
