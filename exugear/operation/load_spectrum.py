"""Load cases and duty cycles: speed, load and share of the time of each operating point."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, pi
from typing import Annotated

import numpy as np
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.shaft_loads import ExternalForce
from exugear.gearbox.stage import stage_number
from fem.support.arguments import FilePath, checked
from fem.support.representation import quantity
from fem.support.tables import read_table
from fem.support.validation import number, require, set_fields, text_of

#: Seconds of an hour; difference of the sum of shares from 1 that is rounding in a table.
HOUR, ROUNDING = 3600.0, 0.01
#: Columns of a table of load cases and their SI units.
COLUMNS = {"speed": "rad/s", "torque": "N m", "load": "N m", "share": "1", "time": "s"}
FLANKS = {"left": 1, "right": -1}
#: Powers of an efficiency over speed and load, which are linear in both but for a small loss.
POWERS = "power_in", "power_out"


def check_torques(name: str, value) -> None:
    """ValueError unless the value maps names of shafts to finite torques."""
    named = isinstance(value, Mapping) and all(isinstance(shaft, str) for shaft in value)
    require(named, f"{name} must map names of shafts to torques [N m], got {text_of(value)}")
    for shaft, torque in value.items():
        number(f"{name} of {shaft!r}", torque)


def check_forces(name: str, value) -> None:
    """ValueError unless the value maps names of shafts to external forces by axial position [m]."""
    by_shaft = isinstance(value, Mapping) and all(isinstance(at, Mapping) for at in value.values())
    forces = by_shaft and all(isinstance(force, ExternalForce) for at in value.values() for force in at.values())
    require(forces, f"{name} must map shafts to {{axial position: ExternalForce(...)}}, got {text_of(value)}")


@checked
@dataclass(frozen=True)
class LoadCase:
    """A load case: `exugear.run_up(model, speed=(0, case.speed), load=case.load, ...)`.

    name       of the load case
    speed      of the driving shaft [rad/s]
    load       torque on the driven shaft, against its motion at positive speed [N m]
    share      of the time, or any number in proportion to the time
    torques    on the shafts as a file holds them, by name, about z [N m]
    forces     external forces by the name of the shaft and the axial position [m]

    Raises ValueError for values that are not finite, and for a share < 0.
    """

    name: str
    speed: float
    load: float
    share: float = 1.0
    torques: Annotated[Mapping[str, float], check_torques] = field(default_factory=dict)
    forces: Annotated[Mapping[str, Mapping[float, ExternalForce]], check_forces] = field(default_factory=dict)

    def __post_init__(self):
        values = f"speed and load of {self.name!r} must be finite, got {self.speed} rad/s and {self.load} N m"
        require(isfinite(self.speed) and isfinite(self.load), values)
        require(0 <= self.share < inf, f"share of {self.name!r} must be >= 0 and finite, got {self.share}")

    def __str__(self) -> str:
        speed = quantity(self.speed * 30 / pi, "rpm")
        return f"{self.name}: {speed}, {quantity(self.load, 'N m')}, {quantity(100 * self.share, '%')} of the time"


@checked
@dataclass(frozen=True)
class LoadSpectrum:
    """A duty cycle: load cases with their shares of the time.

    cases   list of `LoadCase`; iteration yields them
    time    of the whole duty cycle [s]; None where it is not known

    Derived: `shares` (n,) of the time, which sum to 1, and `table`, a Dataset over `load_case`.
    Raises ValueError without a case, and for shares that are all 0.
    """

    cases: Sequence[LoadCase]
    time: float | None = None

    def __post_init__(self):
        listed = isinstance(self.cases, list | tuple) and all(isinstance(x, LoadCase) for x in self.cases)
        require(listed and len(self.cases) > 0, f"cases must be a list of LoadCase, got {text_of(self.cases)}")
        require(sum(case.share for case in self.cases) > 0, "shares of the load cases must not all be 0")
        require(self.time is None or 0 < self.time < inf, f"time must be > 0 s and finite, got {self.time}; or None")
        set_fields(self, cases=tuple(self.cases))

    def __iter__(self) -> Iterator[LoadCase]:
        return iter(self.cases)

    def __len__(self) -> int:
        return len(self.cases)

    def __str__(self) -> str:
        return "\n".join(map(str, self.cases))

    @classmethod
    @checked
    def from_table(cls, path: FilePath, gearbox: Gearbox | None = None) -> "LoadSpectrum":
        """A duty cycle by a table with a line for each load case.

        path      text file (CSV, or separated by blanks) under the header speed [rpm], load [N m], share [%]: speed of
                  the driving shaft, torque on the driven shaft, share of the time. Instead of load the column torque,
                  on the driving shaft; instead of share the column time [h]. Other units are converted
        gearbox   whose ratio turns torque into load; only needed for that column

        Raises FileNotFoundError, and ValueError for a unit that is missing or unknown, NaN, a missing column, a second
        header, with the line of the file, for both columns of a choice, times < 0 and shares that do not sum to 1.
        """
        table = read_table(path, COLUMNS, optional=("torque", "load", "share", "time"))
        for choice in (("load", "torque"), ("share", "time")):
            given = [name for name in choice if name in table]
            units = " or ".join(f"{name} [{COLUMNS[name]}]" for name in choice)
            require(len(given) == 1, f"{path} must hold one of the columns {units}, got {given or 'none'}")
        if "torque" in table:
            needed = f"{path} holds the torque on the driving shaft; pass gearbox=, whose ratio gives the load"
            require(gearbox is not None, needed)
            table["load"] = table["torque"] / _transmission(gearbox)  # type: ignore[arg-type]
        shares = table["share"] if "share" in table else table["time"]
        total = float(shares.sum())
        negative = f"{path} holds a share or time of {shares.min():g}; times are >= 0"
        require(bool(shares.min() >= 0 and total > 0), negative)
        if "share" in table:
            sums = f"shares of {path} sum to {100 * total:.4g} %; complete the load cases, or pass the column time [h]"
            require(abs(total - 1) < ROUNDING, sums)
        rows = zip(table["speed"].tolist(), table["load"].tolist(), (shares / total).tolist(), strict=True)
        cases = [LoadCase(f"load case {number}", *row) for number, row in enumerate(rows, start=1)]
        return cls(cases, total if "time" in table else None)

    @property
    def shares(self) -> np.ndarray:
        """(n,) shares of the load cases in the time, which sum to 1."""
        shares = np.array([case.share for case in self.cases])
        return shares / shares.sum()

    @property
    def table(self) -> xr.Dataset:
        """Dataset over load_case: speed [rad/s], load [N m], share, and time [s] where it is known."""
        columns = {
            "speed": ([case.speed for case in self.cases], "rad/s", "speed of the driving shaft"),
            "load": ([case.load for case in self.cases], "N m", "torque on the driven shaft"),
            "share": (self.shares, "1", "share of the time"),
        }
        if self.time is not None:
            columns["time"] = self.time * self.shares, "s", "time"
        data = {
            name: ("load_case", values, {"units": unit, "long_name": words})
            for name, (values, unit, words) in columns.items()
        }
        return xr.Dataset(data, {"load_case": [case.name for case in self.cases]})

    @checked
    def on_pinion(
        self, gearbox: Gearbox, stage: int | str = 0, *, hours: float | None = None, flank: str = "left"
    ) -> dict[str, np.ndarray]:
        """The load cases on the pinion of a stage: `exugear.tooth_damage(roots, **spectrum.on_pinion(box), ...)`.

        gearbox   whose ratios turn speed and load into those of the pinion, without losses
        stage     number or label of the stage
        hours     of the whole duty cycle [h]; by default its time
        flank     "left", which carries torques > 0, those of the driving flanks; "right", with the map of
                  `fem.mirror_image(pair)`. A case that loads the other flank has the torque 0

        Returns torque (n,) >= 0 [N m], speed (n,) [rad/s], on a carrier against it, and hours (n,) [h]. Raises
        ValueError for stages that the gearbox lacks, other flanks, torques on more than two shafts, and where neither
        time nor hours is known.
        """
        index, total = stage_number(gearbox.labels, stage), hours
        for case in self.cases:
            loaded = [shaft for shaft, torque in case.torques.items() if torque]
            several = f"torques of {case.name!r} act on {loaded}; the torque of a pinion follows from load alone"
            require(len(loaded) <= 2, f"{several}, with one driving and one driven shaft")
        require(flank in FLANKS, f"flank must be 'left' or 'right', got {flank!r}")
        if total is None:
            total = None if self.time is None else self.time / HOUR
        if total is None:
            raise ValueError("hours of the duty cycle must be given, its table holds shares alone: hours=5000")
        require(0 < total < inf, f"hours must be > 0 and finite, got {total}")
        pinion = gearbox.stages[index].pair.pinion
        forces = np.array([gearbox.static_forces(case.load)[index] if case.load else 0.0 for case in self.cases])
        turns = float(gearbox.cycles[index] @ gearbox.nominal_ratios) * 2 * pi / pinion.z
        speeds = np.array([case.speed for case in self.cases])
        torque = np.maximum(FLANKS[flank] * forces * pinion.r_b, 0.0)
        return {"torque": torque, "speed": turns * speeds, "hours": total * self.shares}

    @checked
    def efficiency(self, data: xr.Dataset) -> xr.Dataset:
        """Efficiency over the duty cycle: energy that leaves the gearbox over energy that enters it.

        data   over speed and load, as `exugear.efficiency` returns it. Its powers are interpolated linearly between the
               four points around each load case, and not beyond them

        Returns efficiency of the whole cycle, and over `load_case` power_in by the drive and power_out on the load [W].
        A load < 0 drives. Cases at rest have no power. Raises ValueError for other data, for cases beyond the speeds
        and loads of the map or between a load < 0 and one > 0, and beside points that were not solved.
        """
        fits = {*POWERS, "speed", "load"} <= {*data.variables} and {*data["power_in"].dims} == {"speed", "load"}
        require(fits, "data must have power_in and power_out over speed and load; pass what exugear.efficiency returns")
        powers = np.array([_powers(data, case) for case in self.cases]).T
        entering, leaving = powers * self.shares, -powers * self.shares
        gone = np.maximum(entering[1], 0).sum() + np.maximum(leaving[0], 0).sum()
        come = np.maximum(entering[0], 0).sum() + np.maximum(leaving[1], 0).sum()
        require(come > 0, "cases of the duty cycle must have power: all stand still")
        columns = zip(POWERS, powers, ("mean power of the drive", "mean power on the load"), strict=True)
        values = {name: ("load_case", power, {"units": "W", "long_name": words}) for name, power, words in columns}
        whole = {"units": "1", "long_name": "energy that leaves the gearbox over energy that enters it"}
        names = [case.name for case in self.cases]
        return xr.Dataset({"efficiency": ((), gone / come, whole)} | values, {"load_case": names})


def _transmission(gearbox: Gearbox) -> float:
    """Speed of the driven shaft per speed of the driving shaft > 0, with free ones at 0, by which torques balance."""
    driving, imposed = gearbox.driving.name, gearbox.independent
    follows = f"driving shaft {driving!r} follows the imposed speeds of {[*imposed]}, its torque tells no load"
    require(driving in imposed, f"{follows}; give the column load")
    driven = [shaft.name for shaft in gearbox.shafts].index(gearbox.driven.name)
    return abs(float(gearbox.motions[imposed.index(driving), driven]))


def _powers(data: xr.Dataset, case: LoadCase) -> list[float]:
    """Interpolated powers of the drive and on the load [W] in a load case; 0 at rest."""
    if case.speed == 0:
        return [0.0, 0.0]
    weights, part = _around(data, case)
    around = [data[name].isel(part).transpose(*weights.dims).values for name in POWERS]
    powers = [float((weights.values * values).sum()) for values in around]
    beside = f"data were not solved beside {case}; map other speeds and loads, `stopped` tells the reason"
    require(bool(np.isfinite(powers).all()), beside)
    return powers


def _around(data: xr.Dataset, case: LoadCase) -> tuple[xr.DataArray, dict[str, slice]]:
    """Weights of linear interpolation over the points of data around a load case, and these points."""
    weights, part = xr.DataArray(1.0), {}
    for axis, value in (("speed", case.speed), ("load", case.load)):
        points = data[axis].values
        low, high = float(points[0]), float(points[-1])
        span = f"data must reach {case}: its {axis} lies beyond {low:g} to {high:g} {COLUMNS[axis]}"
        require(low <= value <= high, f"{span}; compute exugear.efficiency up to it")
        last = int(np.searchsorted(points, value))
        first = last if points[last] == value else last - 1
        signs = f"data have no load between {points[first]:g} and {points[last]:g} N m, within which {case} lies"
        require(axis == "speed" or points[first] * points[last] > 0, f"{signs}; compute smaller loads")
        share = (value - points[first]) / (points[last] - points[first]) if first < last else 0.0
        part[axis] = slice(first, last + 1)
        weights = weights * xr.DataArray([1 - share, share][: last - first + 1], dims=axis)
    return weights.transpose("speed", "load"), part
