"""Trains of equal gears on meshes of constant stiffness, and their runs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scenes import INERTIA, K, linear_law, paper_gear, paper_pair

import exugear
from fem.units import deg

R = paper_pair().pinion.r_b


def law(zeta: float = 0.05) -> exugear.MeshForce:
    """A constant stiffness K, damped by a share of the critical damping of two equal inertias."""
    return replace(linear_law(), damping=2 * zeta * (K * INERTIA / 2) ** 0.5 / R)


def shaft(name: str, inertia: float = INERTIA, *parts) -> exugear.Shaft:
    return exugear.Shaft(name, {0.0: [paper_gear(), *parts]}, inertia=inertia)


def box(*shafts: exugear.Shaft, zeta: float = 0.05) -> exugear.Gearbox:
    """A train of equal gears, each shaft driving the next."""
    stages = [
        exugear.Stage(fast, slow, law(zeta), pair=paper_pair(), angle=i * 60 * deg)
        for i, (fast, slow) in enumerate(pairwise(shafts))
    ]
    return exugear.Gearbox(stages)


def run(model: exugear.Model, duration: float = 0.05, **options) -> exugear.Run:
    return exugear.run(model, duration=duration, progress=False, **{"checks": 0} | options)


def speed_of(result: exugear.Run, name: str = "fast") -> np.ndarray:
    return result.data["shaft_speed"].sel(shaft=name).values
