"""Life and contact pressure of rolling bearings along runs, and over a duty cycle of several runs."""

from collections.abc import Sequence
from math import inf, pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.rolling_bearing import RollingBearing, pressures
from exugear.operation.load_spectrum import LoadSpectrum
from exugear.running.run_data import stage_data
from exugear.signals.signal import speed_of_shaft
from fem.support.arguments import Numbers, checked
from fem.support.validation import require
from fem.units import mm

#: Number of samples whose pressures are computed at once.
BLOCK = 1024
HOUR = 3600.0
#: Largest share by which the speed or the load of a run may miss that of its load case.
SAME_CASE = 0.02
MISSING = "run must hold bearing_displacement and bearing_tilt; run it on rolling bearings with displacement=True"


@checked
def bearing_life(run: Any, gearbox: Gearbox, *, shares: Numbers | LoadSpectrum | None = None) -> xr.Dataset:
    """Life and largest contact pressure of the rolling bearings of a gearbox along a run or over a duty cycle.

    run       `exugear.Run` with displacement=True, or its data; for a duty cycle a list of runs
    gearbox   of which they are
    shares    (n_run,) shares of the runs in the time of the duty cycle, or the `LoadSpectrum` of which they are the
              load cases, in its order; by default as long as each lasts

    Returns a Dataset over `bearing`:

    life       L_10r [revolutions], after which a tenth of such bearings fails (ISO/TS 16281): each sample wears with
               the loads on its balls and laminae, in proportion to the speed of the ring (Palmgren and Miner)
    hours      the same at the mean speed of the runs [h]
    pressure   largest contact pressure of a ball or roller at either raceway [Pa]

    element_pressure
               likewise of each element, over `element`, the first on the x axis, row after row; NaN beyond their number

    The outer ring stands, in the bearings of planets on pins the inner ring. Both rings of a bearing between shafts
    turn; its life counts their turns against each other, and is NaN where there are none. Elements share the load as in
    statics, with the cage as it stands at the start. Raises ValueError for runs without tilts of rolling bearings, and
    for runs that choose several free speeds, unless they record these (power=True), and for runs that do not reach the
    speed or the load of their load case.
    """
    runs = list(run) if isinstance(run, Sequence) else [run]
    require(len(runs) > 0, "run must be a run or a list of them, got an empty list")
    for each in runs:
        stage_data(each)
    data = [each if isinstance(each, xr.Dataset) else each.data for each in runs]
    require(all("bearing_tilt" in x and x.sizes["time"] > 1 for x in data), MISSING)
    durations = np.array([float(x["time"][-1] - x["time"][0]) for x in data])
    if isinstance(shares, LoadSpectrum):
        _check_cases(data, shares)
        shares = shares.shares
    times = durations if shares is None else np.atleast_1d(np.asarray(shares, float))
    fits = times.shape == durations.shape and bool((times >= 0).all()) and 0 < times.sum() < inf
    require(fits, f"shares must be (n_run,) >= 0 and finite with n_run = {len(runs)}, got {shares}")
    bearings = {
        f"{shaft.name} at {axial / mm:g} mm": (bearing, _rings(gearbox, shaft.name, axial))
        for shaft in gearbox.shafts
        for axial, bearing in shaft.bearings.items()
        if isinstance(bearing, RollingBearing)
    }
    unlike = [label for label in bearings if any(label not in x["bearing"].values for x in data)]
    require(bool(bearings) and not unlike, f"gearbox must be that of the run, which lacks the bearings {unlike}")
    life = {label: _life(label, *bearings[label], data, times / times.sum()) for label in bearings}
    columns = {
        "life": ("revolutions", "basic reference rating life L_10r"),
        "hours": ("h", "basic reference rating life at the mean speed"),
        "pressure": ("Pa", "largest contact pressure"),
    }
    values: dict[str, Any] = {
        name: ("bearing", [x[i] for x in life.values()], {"units": unit, "long_name": long_name})
        for i, (name, (unit, long_name)) in enumerate(columns.items())
    }
    of_elements = np.full((len(life), max(x[3].size for x in life.values())), np.nan)
    for row, (*_, largest) in zip(of_elements, life.values(), strict=True):
        row[: largest.size] = largest
    about = {"units": "Pa", "long_name": "largest contact pressure of an element"}
    values["element_pressure"] = ("bearing", "element"), of_elements, about
    return xr.Dataset(values, {"bearing": list(life)})


def _check_cases(data: Sequence[xr.Dataset], spectrum: LoadSpectrum) -> None:
    """ValueError for runs that do not reach the speed or the load of the load case of which they are."""
    for number, (run, case) in enumerate(zip(data, spectrum, strict=False)):
        for name, value in (("speed", case.speed), ("load_torque", case.load)):
            if name in run:
                low, high = float(run[name].min()), float(run[name].max())
                margin = SAME_CASE * max(abs(value), abs(low), abs(high))
                range_of = f"run {number} has a {name} of {low:.4g} to {high:.4g}, its load case is {case}"
                order = "pass the runs in the order of the load cases"
                require(low - margin <= value <= high + margin, f"{range_of}; {order}")


def _rings(gearbox: Gearbox, name: str, axial: float) -> list[str]:
    """Shafts of the rings of a bearing that turn: its shaft, and that of its seat.

    The seat of a planet's bearing is on its carrier, which bears the pin.
    """
    carrier = gearbox.planets.get(name)
    on, _ = gearbox.between.get((name, axial), (carrier.name if carrier else None, 0.0))
    return [name, on] if on else [name]


def _life(
    label: str, bearing: RollingBearing, rings: list[str], data: Sequence[xr.Dataset], shares: np.ndarray
) -> tuple[float, float, float, np.ndarray]:
    """Life [revolutions] and [h] of a bearing over runs by their shares of the time, largest pressure, of each [Pa]."""
    displacements, rates = [], []
    for run, share in zip(data, shares.tolist(), strict=True):
        at = run.sel(bearing=label)
        displacements.append(np.concatenate([at["bearing_displacement"].values, at["bearing_tilt"].values]).T)
        of_shaft, *of_seat = [speed_of_shaft(run, "shaft", name) for name in rings]
        rates.append(share * np.abs(of_shaft - sum(of_seat)) / (2 * pi * run.sizes["time"]))
    q, revolutions = np.concatenate(displacements), np.concatenate(rates)
    turning = any(np.any(run["speed"].values) for run in data)
    require(turning, "run must turn: bearings that stand have no life in revolutions")
    blocks = [q[first : first + BLOCK] for first in range(0, len(q), BLOCK)]
    largest = [np.max([np.max(pressures(row, block), axis=(0, 1)) for block in blocks], axis=0) for row in bearing.rows]
    of_elements, total = np.concatenate(largest), revolutions.sum()
    life = bearing.life(q, revolutions) if total > 0 else np.nan
    return life, life / total / HOUR if total > 0 else np.nan, float(of_elements.max()), of_elements
