"""Condition indicators of gears, from averages over the turns of a shaft.

Sources: R. M. Stewart, Univ. of Southampton MHM/R/10/77 (1977): FM0, FM4; H. R. Martin, Proc. 17th Southeastern Conf.
on Theoretical and Applied Mechanics (1989): M6A; J. J. Zakrajsek, D. P. Townsend and H. J. Decker, NASA TM-105950
(1993): NA4; N. Swansson, 10th ICAF Symposium (1980): energy ratio.
"""

from collections.abc import Sequence

import numpy as np
import scipy
import xarray as xr

from exugear.signals.synchronous_average import ANGLE, AVERAGE, check_average, regular_orders, residual_signal, teeth_of
from fem.support.arguments import checked
from fem.support.validation import require

#: Share of an average, its mean included, below which what remains of it is rounding: its shape tells nothing.
ROUNDING = 1e-9
#: Share of the vibration to which the resampling over the angle is right: it errs by 2e-8 to 1e-7 of mesh harmonics.
RESAMPLED = 1e-6
MEANINGS = {
    "rms": "root mean square without the mean",
    "peak_to_peak": "peak to peak",
    "crest_factor": "largest deviation from the mean over the rms",
    "kurtosis": "kurtosis of the average",
    "FM0": "peak to peak over the sum of the amplitudes of the mesh harmonics",
    "FM4": "kurtosis of the difference signal",
    "M6A": "sixth moment of the difference signal over the cube of its variance",
    "NA4": "fourth moment of the residual signal over the square of its mean variance so far",
    "energy_ratio": "rms of the difference signal over that of the regular meshing",
    "side_band_ratio": "sum of the amplitudes of side bands over that of their mesh harmonic",
}


@checked
def condition_indicators(
    average: xr.DataArray,
    mesh_orders: Sequence[int] | None = None,
    *,
    baseline: xr.DataArray | None = None,
    side_bands: int = 3,
) -> xr.Dataset:
    """Numbers that tell damaged teeth from sound ones.

    average       (..., angle) as `exugear.synchronous_average` returns it; with an axis `average`, in the order of time
    mesh_orders   numbers of teeth on the averaged shaft; by default the whole mesh orders of the signal
    baseline      averages of the sound gear, to whose mean variance NA4 refers; by default to that of the averages up
                  to the present one, so that NA4 is the kurtosis of the residual signal in the first average
    side_bands    number of side bands on either side of a harmonic in side_band_ratio

    Returns a Dataset over the further dimensions of the average: rms and peak_to_peak in its units; crest_factor,
    kurtosis, FM0, FM4, M6A, NA4, energy_ratio and, over harmonic, those of the smallest number of teeth,
    side_band_ratio. Noise of a normal distribution has kurtosis, FM4 and NA4 of 3, and M6A of 15. The residual signal
    is without the mesh harmonics and the first two shaft orders, the difference signal without first side bands, too.
    NaN where nothing remains but rounding, or the error of the resampling over the angle. Raises ValueError for a
    baseline of other samples.
    """
    check_average(average)
    teeth = teeth_of(average, mesh_orders)
    centred = average - average.mean(ANGLE)
    rounding = ROUNDING * _rms(average)
    rms = _rms(centred).where(_rms(centred) > rounding, 0.0)
    residual = residual_signal(average, teeth)
    difference = residual_signal(average, teeth, side_bands=1)
    least = np.maximum(rounding, RESAMPLED * rms)
    regular = centred - difference
    amplitude = _amplitudes(average)
    orders = amplitude["order"].values
    harmonic = np.isin(orders, regular_orders(average, teeth, side_bands=0, shaft_orders=0)) & (orders > 0)
    peak_to_peak = average.max(ANGLE) - average.min(ANGLE)
    differs = _rms(difference) > least
    variance = _mean_variance(residual, baseline, teeth)
    values = {
        "rms": rms,
        "peak_to_peak": peak_to_peak,
        "crest_factor": _ratio(abs(centred).max(ANGLE), rms),
        "kurtosis": _ratio((centred**4).mean(ANGLE), rms**4),
        "FM0": _ratio(peak_to_peak, amplitude.isel(order=harmonic).sum("order"), rounding),
        "FM4": _ratio((difference**4).mean(ANGLE), _rms(difference) ** 4).where(differs),
        "M6A": _ratio((difference**6).mean(ANGLE), _rms(difference) ** 6).where(differs),
        "NA4": _ratio((residual**4).mean(ANGLE), variance**2).where(_rms(residual) > least),
        "energy_ratio": _ratio(_rms(difference), _rms(regular), rounding),
        "side_band_ratio": _side_band_ratio(amplitude, teeth[0], side_bands, rounding),
    }
    units = {"rms": average.attrs.get("units", "1"), "peak_to_peak": average.attrs.get("units", "1")}
    about = {name: {"units": units.get(name, "1"), "long_name": words} for name, words in MEANINGS.items()}
    return xr.Dataset({name: value.assign_attrs(about[name]) for name, value in values.items()})


def _rms(values: xr.DataArray) -> xr.DataArray:
    return (values**2).mean(ANGLE) ** 0.5


def _ratio(numerator: xr.DataArray, denominator: xr.DataArray, least: xr.DataArray | float = 0.0) -> xr.DataArray:
    """NaN where the denominator is 0, or at most the least that is no rounding."""
    return numerator / denominator.where(denominator > least)


def _amplitudes(average: xr.DataArray) -> xr.DataArray:
    """Amplitudes (..., order) of the orders of an average."""
    samples, axis = average.sizes[ANGLE], average.get_axis_num(ANGLE)
    lines = np.moveaxis(2 * np.abs(scipy.fft.rfft(average.values, axis=axis)) / samples, axis, -1)
    dims = (*(dim for dim in average.dims if dim != ANGLE), "order")
    others = {name: values for name, values in average.coords.items() if ANGLE not in values.dims}
    return xr.DataArray(lines, others | {"order": np.arange(lines.shape[-1])}, dims)


def _mean_variance(residual: xr.DataArray, baseline: xr.DataArray | None, teeth: list[int]) -> xr.DataArray:
    """Variance of the residual signal that NA4 refers to."""
    variance = (residual**2).mean(ANGLE)
    if baseline is not None:
        check_average(baseline, "baseline")
        sizes = baseline.sizes[ANGLE], residual.sizes[ANGLE]
        require(sizes[0] == sizes[1], f"baseline must have the samples of the average, {sizes[1]}, got {sizes[0]}")
        of_sound = (residual_signal(baseline, teeth) ** 2).mean(ANGLE)
        return of_sound.mean(AVERAGE) if AVERAGE in of_sound.dims else of_sound.drop_vars(["time", "speed"])
    if AVERAGE not in variance.dims:
        return variance
    axis = variance.get_axis_num(AVERAGE)
    number = xr.DataArray(np.arange(1, variance.sizes[AVERAGE] + 1), dims=AVERAGE)  # some averages may be left out
    return variance.copy(data=np.cumsum(variance.values, axis=axis)) / number


def _side_band_ratio(amplitude: xr.DataArray, z: int, side_bands: int, rounding: xr.DataArray) -> xr.DataArray:
    """Sum of side bands over the amplitude of their harmonic, over harmonic; NaN where that is rounding."""
    most = (z - 1) // 2
    require(1 <= side_bands <= most, f"side_bands must lie in [1, {most}], got {side_bands}")
    middles = np.arange(z, amplitude.sizes["order"] - side_bands, z)
    offsets = [x for x in range(-side_bands, side_bands + 1) if x]
    along = xr.DataArray(middles, {"harmonic": np.arange(1, middles.size + 1)}, ("harmonic",))
    sums = sum(amplitude.isel(order=along + offset).drop_vars("order") for offset in offsets)
    return _ratio(sums, amplitude.isel(order=along).drop_vars("order"), rounding)  # type: ignore[arg-type]
