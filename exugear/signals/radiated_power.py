"""Sound power that a housing radiates by its motion in a run, or under the bearing forces of one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.housing import seat_label
from exugear.running.housing_variables import RATE
from exugear.running.run_data import stage_data
from fem.housing.reduced_housing import PER_SEAT, ReducedHousing
from fem.support.arguments import Finite, checked
from fem.support.validation import require, require_kind

__all__ = ["radiated_power"]

#: Power of 0 dB [W]; mean square of Hann's window; share of the highest frequency of the modes up to which they tell.
REFERENCE_POWER, HANN, TOLD = 1e-12, 3 / 8, 2 / 3


@checked
def radiated_power(
    run: Any,
    reduced: ReducedHousing,
    seats: Sequence[tuple[str, float]],
    *,
    resolution: Finite = 20.0,
    highest: Finite | None = None,
    damping_ratio: Finite = 0.02,
) -> xr.Dataset:
    """Equivalent radiated power of a housing over frequency, by its motion in a run or under the bearing forces of one.

    run            `exugear.Run` or its data, with bearing_force
    reduced        `fem.reduce_housing` of the housing's mesh, its axes those of the gearbox
    seats          (name of the shaft, axial position [m]) of its bearings, in the order of the reduction
    resolution     distance of the frequencies [Hz]: spectra are means over parts of 1/resolution, by half overlapping
    highest        frequency [Hz], by default two thirds of that of the highest mode of the reduction
    damping_ratio  of the housing, where its motion follows from forces; else that of the run holds

    Where the housing vibrates in the run (`Housing.from_reduction` of the same reduction, with modes by the plan), the
    surface moves as in the run. Else one way: the surface follows from the forces and moments of the bearings, which
    know a housing that is rigid or static stiffness; moments are in runs with a housing or with displacement=True. Mean
    values are left out. Returns a Dataset over `frequency` [Hz]: power [W], mean in a band of
    resolution, and level [dB over 1e-12 W], and in the attributes total_level and method.

    Raises ValueError for runs without bearing forces at the seats, and for those shorter than two parts.
    """
    stage_data(run)
    data = run if isinstance(run, xr.Dataset) else run.data
    require_kind("reduced", reduced, ReducedHousing)
    require("bearing_force" in data, "run must have bearing_force: its shafts have no bearings")
    number = len(reduced.centres)
    require(len(seats) == number, f"seats must name the {number} seats of the reduction, got {len(seats)}")
    labels = [seat_label((str(name), float(axial))) for name, axial in seats]
    missing = [label for label in labels if label not in data["bearing"].values]
    require(not missing, f"seats: the run has no bearings {missing}, it has {data['bearing'].values.tolist()}")
    require(0 < resolution < np.inf, f"resolution must be > 0 Hz, got {resolution:g}")
    time = data["time"].values
    step = float(time[-1] - time[0]) / (time.size - 1)
    length = round(1 / (resolution * step))
    short = f"run must last 2 / resolution = {2 / resolution:g} s or longer, it lasts {time[-1] - time[0]:.4g} s"
    require(time.size >= 2 * length >= 16, f"{short}; take a larger resolution")
    last = TOLD * reduced.highest_mode if highest is None else highest
    require(last > 0, f"highest must be > 0 Hz, got {last:g}")
    frequency = np.fft.rfftfreq(length, step)
    chosen = np.flatnonzero((frequency > 0) & (frequency <= last))
    require(chosen.size > 0, f"highest must lie above the resolution of {resolution:g} Hz, got {last:g}")
    if RATE in data:
        method, signals = "motion of the housing in the run", _rates(data, reduced, labels)
    else:
        method, signals = _forces(data, labels)
    window = np.hanning(length + 1)[:-1]
    powers = []
    for first in range(0, time.size - length + 1, length // 2):
        part = signals[:, first : first + length]
        lines = 2 / length * np.fft.rfft((part - part.mean(axis=-1, keepdims=True)) * window)[:, chosen]
        amplitudes = lines.T / np.sqrt(HANN)
        if RATE in data:
            powers.append(reduced.power_of_motion(amplitudes))
        else:
            powers.append(reduced.radiated_power(frequency[chosen], amplitudes, damping_ratio=damping_ratio))
    power = np.mean(powers, axis=0)
    with np.errstate(divide="ignore"):
        level, total = 10 * np.log10(power / REFERENCE_POWER), 10 * np.log10(power.sum() / REFERENCE_POWER)
    about = {"units": "Hz", "long_name": "frequency"}
    return xr.Dataset(
        {
            "power": ("frequency", power, {"units": "W", "long_name": "equivalent radiated power"}),
            "level": ("frequency", level, {"units": "dB", "long_name": "level of the radiated power over 1e-12 W"}),
        },
        {"frequency": ("frequency", frequency[chosen], about)},
        {"title": "radiated power", "total_level": float(total), "method": method},
    )


def _rates(data: xr.Dataset, reduced: ReducedHousing, labels: list[str]) -> np.ndarray:
    """(6 n + m, samples) rates of the coordinates of a reduction; ValueError for runs on another one."""
    at_seats = data["seat"].values.tolist()
    other = f"seats must be those of the housing of the run in its order, {at_seats}, got {labels}"
    require(labels == at_seats, other)
    sizes = data.sizes["housing_coordinate"], len(reduced.stiffness)
    apart = (
        f"reduced has {sizes[1]} coordinates, the housing of the run {sizes[0]}; pass the reduction it was made from"
    )
    require(sizes[0] == sizes[1], apart)
    return data[RATE].values.astype(float)


def _forces(data: xr.Dataset, labels: list[str]) -> tuple[str, np.ndarray]:
    """What is known of the loads on the seats, in words, and these loads (6 n, samples)."""
    on_seats = np.zeros((len(labels), PER_SEAT, data.sizes["time"]))
    on_seats[:, :3] = -data["bearing_force"].sel(bearing=labels).values
    known = "forces of the bearings, their moments left out: run with displacement=True"
    if "bearing_moment" in data:
        known = "forces and moments of the bearings"
        on_seats[:, 3:5] = -data["bearing_moment"].sel(bearing=labels).values
    return known, on_seats.reshape(-1, data.sizes["time"])
