"""The energy balance of a run over any window of time."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import numpy as np
import scipy
import xarray as xr

from fem.support.arguments import Finite, checked
from fem.support.validation import require

#: Powers of a run that dissipate energy, and energies that it stores.
LOSSES = ("mesh_loss", "bearing_loss", "coupling_loss", "friction_loss", "drag_loss")
ENERGIES = ("kinetic_energy", "strain_energy")
#: Samples beside a window that the splines through the powers use.
BESIDE = 8


def efficiency_of(work_in: float, work_out: float, stored: float = 0.0) -> float:
    """Work that leaves a gearbox over work that enters it less what it stores; a load < 0 drives. NaN without."""
    entering = max(work_in, 0.0) + max(-work_out, 0.0) - stored
    leaving = max(work_out, 0.0) + max(-work_in, 0.0)
    return leaving / entering if entering else nan


@checked
@dataclass(frozen=True)
class EnergyBalance:
    """Work and energy of a run over a window of time; print it.

    start, end   of the window [s]
    work_in      by the drives [J]
    work_out     by the gearbox on its loads [J]
    losses       energy dissipated, by the name of the variable of the run [J]
    stored       increase of kinetic and strain energy [J]
    throughput   mean of the magnitudes of the works in and out [J]
    """

    start: Finite
    end: Finite
    work_in: Finite
    work_out: Finite
    losses: Mapping[str, float]
    stored: Finite
    throughput: Finite

    @property
    def residual(self) -> float:
        """Work in less work out, losses and increase of stored energy [J]: 0 but for the error of the integration."""
        return self.work_in - self.work_out - sum(self.losses.values()) - self.stored

    @property
    def relative(self) -> float:
        """Magnitude of the residual over the throughput."""
        return abs(self.residual) / self.throughput if self.throughput else 0.0

    @property
    def efficiency(self) -> float:
        """Work that leaves the gearbox over work that enters it less the increase of stored energy; a load < 0 drives.

        NaN where nothing enters.
        """
        return efficiency_of(self.work_in, self.work_out, self.stored)

    def __str__(self) -> str:
        rows = {"work in": self.work_in, "work out": -self.work_out}
        rows |= {name.replace("_", " "): -loss for name, loss in self.losses.items()}
        rows |= {"released from storage": -self.stored, "residual": self.residual}
        lines = [f"{name:>26}  {value:14.6g} J" for name, value in rows.items()]
        return "\n".join([f"energy from {self.start:.6g} to {self.end:.6g} s", *lines])


def energy_balance(data: xr.Dataset, start: float | None = None, end: float | None = None) -> EnergyBalance:
    """The balance of a run's data between two times [s], by default over the whole run; ValueError without powers."""
    time = data["time"].values
    missing = "the run has no powers; run it with power=True"
    require("kinetic_energy" in data, missing)
    first, last = (time[0] if start is None else start), (time[-1] if end is None else end)
    window = f"start and end must lie within [{time[0]:g}, {time[-1]:g}] s, start first, got {first:g} and {last:g}"
    half_a_sample = float(np.diff(time[:2]).sum()) / 2
    require(bool(time[0] - half_a_sample <= first < last <= time[-1] + half_a_sample), window)
    first, last = np.clip([first, last], time[0], time[-1])
    near = slice(*np.searchsorted(time, [first, last], side="right") + np.array([-BESIDE - 1, BESIDE]).clip(-time.size))
    near = slice(max(near.start, 0), near.stop)
    part = data.isel(time=near)

    def work(name: str, of=lambda x: x) -> float:
        rows = _rows(part, name)
        return float(sum(_spline(part, of(rows)).integrate(first, last))) if rows.size else 0.0

    losses = {name: work(name) for name in LOSSES if name in data}
    stored = sum(float(np.diff(_spline(part, part[name].values)([first, last]))[0]) for name in ENERGIES)
    throughput = work("power_in", np.abs) + work("power_out", np.abs)
    return EnergyBalance(float(first), float(last), work("power_in"), work("power_out"), losses, stored, throughput / 2)


def _rows(data: xr.Dataset, name: str) -> np.ndarray:
    """(n, n_time) rows of a variable; none where the data lack it."""
    size = data["time"].size
    return data[name].transpose(..., "time").values.reshape(-1, size) if name in data else np.zeros((0, size))


def _spline(data: xr.Dataset, values: np.ndarray):
    """Cubic spline through values (..., n_time) over time."""
    return scipy.interpolate.CubicSpline(data["time"].values, values, axis=-1)
