"""Signals of known orders over sweeps of the speed."""

import numpy as np
import xarray as xr

import exugear


def linear_sweep(duration=10.0, rate=40_000.0, start=20.0, slope=20.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], speed [rad/s] and angle [rad] of a shaft that accelerates evenly."""
    time = np.arange(round(duration * rate) + 1) / rate
    return time, start + slope * time, start * time + slope * time**2 / 2


def steep_sweep(revolutions=100, slew=0.03, start=2 * np.pi * 5, rate=50_000.0) -> tuple[np.ndarray, ...]:
    """Time, speed and angle of a shaft whose speed grows by a share of itself in each revolution."""
    growth = slew / (2 * np.pi)
    duration = (1 - np.exp(-slew * revolutions)) / (growth * start)
    time = np.arange(0, duration, 1 / rate)
    speed = start / (1 - growth * start * time)
    return time, speed, np.log(speed / start) / growth


def with_orders(sweep, components: dict, mean: float = 0.0) -> xr.DataArray:
    """A signal of a sweep: order -> (amplitude as function of the speed, phase)."""
    time, speed, angle = sweep
    parts = [amplitude(speed) * np.cos(order * angle + phase) for order, (amplitude, phase) in components.items()]
    return exugear.recorded_signal(time, speed, mean + sum(parts), units="N", long_name="force")


#: Mesh orders of two stages, 0.75 apart; a mode that they excite alike [Hz], its damping ratio.
CLOSE, MODE, DAMPING = (23.0, 23.75), 1000.0, 0.015


def receptance(frequency: np.ndarray, natural: float, damping: float = 0.04) -> np.ndarray:
    ratio = frequency / natural
    return 1 / np.hypot(1 - ratio**2, 2 * damping * ratio)


def swept_by_two_stages(duration: float) -> xr.Dataset:
    """Run-up from 5 to 70 revolutions a second of an oscillator that the first harmonics of two stages excite."""
    time = np.arange(0, duration, 4e-5)
    speed = 5 + 65 * time / duration
    turns = 5 * time + 65 * time**2 / (2 * duration)
    waves = [4e-6 * receptance(order * speed, MODE, DAMPING) * np.cos(2 * np.pi * order * turns) for order in CLOSE]
    rows = {"mesh_frequency": np.outer(CLOSE, speed), "dte": [sum(waves)] * 2, "mesh_force": [0 * time] * 2}
    data = {name: (("stage", "time"), values) for name, values in rows.items()} | {"speed": ("time", 2 * np.pi * speed)}
    return xr.Dataset(data, coords={"time": time, "stage": ["a-b", "b-c"]})
