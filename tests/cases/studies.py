"""Functions of sweeps that processes can import."""

import os
import signal
from pathlib import Path

import numpy as np
import xarray as xr


def circle(radius, colour="red"):
    """Perimeter and area, over two sizes."""
    sizes = np.array([1.0, 2.0])
    return {"perimeter": 2 * np.pi * radius, "area": ("size", np.pi * (radius * sizes) ** 2)}


def labelled_circle(radius):
    """The same as a Dataset with units."""
    about = {"units": "m"}
    return xr.Dataset({"perimeter": ((), 2 * np.pi * radius, about)}, attrs={"shape": "circle", "radius_of": radius})


def odd_fails(number):
    """Fails for odd numbers."""
    if number % 2:
        raise ValueError(f"{number} is odd")
    return number


def noisy(level, rng):
    """Draws of its own."""
    return {"drawn": level * rng.standard_normal(), "again": ("k", rng.random(3))}


def counted(number, folder):
    """Leaves a trace of each call."""
    with (Path(folder) / "calls").open("a") as file:
        file.write(f"{number}\n")
    return float(number) ** 2


def dies(number):
    """Takes its process with it."""
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def interrupted(number):
    """Ctrl-C during case 3."""
    if number == 3:
        raise KeyboardInterrupt
    return number


def ishigami(a, b, c):
    """The function of Ishigami and Homma, whose Sobol indices are known."""
    return np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)
