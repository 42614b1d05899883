"""Resonances: the peaks of an amplitude over frequency or speed."""

from typing import NamedTuple

import numpy as np
import scipy

from exugear.signals.columns import check_columns
from fem.support.arguments import Numbers, checked
from fem.support.validation import require

#: Least prominence of a peak as multiple of the scatter of the envelope.
SCATTERS = 6.0


@checked
class Resonances(NamedTuple):
    """Peaks of an envelope, each (n_peak,): place on the abscissa, rising, and height."""

    place: np.ndarray
    height: np.ndarray


@checked
def resonances(place: Numbers, amplitude: Numbers, prominence: float = 0.05) -> Resonances:
    """Peaks of an amplitude over an abscissa.

    place        (n,) abscissa, such as the mesh frequency
    amplitude    (n,)
    prominence   least prominence of a peak, as share of the largest amplitude

    A peak must also exceed the scatter of the amplitudes and lie inside the range: an amplitude that rises up to its
    end has no peak there. Place and height are refined by parabolas through three points. Raises ValueError for NaN
    and for a prominence outside (0, 1).
    """
    place, amplitude = np.asarray(place, float), np.asarray(amplitude, float)
    check_columns(place=place, amplitude=amplitude)
    require(0 < prominence < 1, f"prominence must lie in (0, 1) as share of the largest amplitude, got {prominence}")
    peaks, _ = scipy.signal.find_peaks(amplitude, prominence=max(prominence * amplitude.max(), _scatter(amplitude)))
    before, at, after = amplitude[peaks - 1], amplitude[peaks], amplitude[peaks + 1]
    curvature = 2 * (before - 2 * at + after)
    shift = np.divide(before - after, curvature, out=np.zeros_like(at), where=curvature != 0)
    refined = np.interp(peaks + shift, np.arange(place.size), place)
    rising = np.argsort(refined)
    return Resonances(refined[rising], (at - (before - after) * shift / 4)[rising])


@checked
def superharmonics(peaks: Resonances, divisors: Numbers = (4, 3, 2, 1), within: float = 0.12) -> np.ndarray:
    """Frequencies (n,) of the peaks nearest to the main resonance over divisors (n,); NaN where no peak is near.

    peaks       `Resonances`; the highest peak is the main resonance
    within      largest distance of a peak from the expected frequency, as share of the expected frequency

    Raises ValueError without peaks, and for divisors and shares out of range.
    """
    require(peaks.place.size > 0, "peaks must hold at least one peak, got none; lower the prominence")
    require(0 < within < 1, f"within must lie in (0, 1) as share of the frequency, got {within}")
    ratios = np.atleast_1d(np.asarray(divisors, float))
    require(bool((ratios > 0).all()), f"divisors must be > 0, got {divisors}")
    expected = peaks.place[np.argmax(peaks.height)] / ratios
    nearest = peaks.place[np.abs(peaks.place - expected[:, None]).argmin(axis=1)]
    return np.where(np.abs(nearest / expected - 1) < within, nearest, np.nan)


def _scatter(amplitude: np.ndarray) -> float:
    """Least prominence of a peak, by the scatter of neighbouring values about a smooth curve."""
    return SCATTERS * float(np.median(np.abs(np.diff(amplitude, 2)))) / (0.6745 * np.sqrt(6))
