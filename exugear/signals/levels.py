"""Levels in decibels, and sums of channels by their mean squares."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from fem.support.arguments import Numbers, checked
from fem.support.validation import require

#: Reference values of levels by unit. Source: ISO 1683:2015; sound pressure in air.
REFERENCES = {"m/s^2": 1e-6, "m/s": 1e-9, "m": 1e-12, "N": 1e-6, "Pa": 20e-6}
#: Prefixes of units for values from here on.
PREFIXES = {1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n", 1e-12: "p"}
#: Least ratio to the reference, so that the level of 0 is -200 dB and not minus infinity.
FLOOR = 1e-10


@checked
def level(rms: Numbers, reference: float | None = None) -> xr.DataArray | np.ndarray:
    """Level 20 lg(rms / reference) in dB.

    rms          root mean squares, a DataArray or numbers; that of a sine is its amplitude over sqrt(2)
    reference    in the units of rms; by default that of ISO 1683 for the units of a DataArray: 1 um/s^2, 1 nm/s, 1 pm,
                 1 uN, 20 uPa

    Returns the levels: a DataArray with the reference in its long_name, or an array. Raises ValueError where units
    have no reference value, and for negative values.
    """
    units = rms.attrs.get("units", "1") if isinstance(rms, xr.DataArray) else "1"
    known = f"reference must be given for the units {units!r}; ISO 1683 has {REFERENCES}"
    require(reference is not None or units in REFERENCES, known)
    reference = REFERENCES[units] if reference is None else reference
    require(0 < reference < np.inf, f"reference must be > 0 and finite, got {reference}")
    values = np.asarray(rms, float)
    require(not (values < 0).any(), f"rms must be >= 0, got {values.min(initial=0.0):g}; pass root mean squares")
    levels = 20 * np.log10(np.maximum(values / reference, FLOOR))
    if not isinstance(rms, xr.DataArray):
        return levels
    about = {"units": "dB", "long_name": f"level re {_with_prefix(reference)}{units}"}
    return xr.DataArray(levels, rms.coords, rms.dims, attrs=about)


def _with_prefix(value: float) -> str:
    """A value with the SI prefix of its unit: '1 µ' of 1e-6."""
    factor, prefix = next(((f, p) for f, p in PREFIXES.items() if value >= f * (1 - 1e-9)), (1.0, ""))
    return f"{value / factor:.10g} {prefix}"


@checked
def rms_sum(channels: xr.DataArray, over: str | Sequence[str]) -> xr.DataArray:
    """Root of the sum of squares of channels: the rms or the amplitude of several bearings or directions together.

    channels    amplitudes, complex ones too, or root mean squares
    over        dimensions to sum over, such as "bearing" or ["bearing", "direction"]

    Raises ValueError for dimensions that the channels do not have.
    """
    dims = [over] if isinstance(over, str) else list(over)
    known = bool(dims) and set(dims) <= set(channels.dims) and len(set(dims)) == len(dims)
    require(known, f"over must be different dimensions of the channels, {channels.dims}, got {over!r}")
    return ((abs(channels) ** 2).sum(dims, skipna=False) ** 0.5).assign_attrs(channels.attrs)
