"""Orders of a gearbox over the speed of its driving shaft, and where they cross the frequencies of its modes."""

from math import pi
from typing import NamedTuple

import numpy as np
import scipy

from exugear.multibody.model import Model


class Order(NamedTuple):
    """A harmonic of a mesh or a shaft.

    name    with its harmonic
    ratio   cycles per turn of the driving shaft
    stage   number of the stage of a mesh, None for a shaft
    """

    name: str
    ratio: float
    stage: int | None


class Crossing(NamedTuple):
    """Where the frequency of an order equals that of a mode.

    speed          of the driving shaft [rad/s]
    frequency      [Hz]
    order, mode    their numbers
    energy_share   of the mode's strain energy in the mesh of the order, in all meshes for an order of a shaft
    """

    speed: float
    frequency: float
    order: int
    mode: int
    energy_share: float


def orders_of(model: Model, harmonics: int) -> list[Order]:
    """Mesh orders up to a harmonic, stage by stage, then the rotation of each shaft; of equal shafts the first."""
    box = model.gearbox
    of_stages = list(zip(box.labels, 2 * pi * model.mesh_cycles, strict=True))
    meshes = [
        Order(f"{h} x mesh {label}", h * float(ratio), i)
        for i, (label, ratio) in enumerate(of_stages)
        for h in range(1, harmonics + 1)
    ]
    return meshes + [Order(f"shaft {name}", abs(ratio), None) for name, ratio in box.ratios.items()]


def crossings(orders: list[Order], speed: np.ndarray, frequency: np.ndarray, mesh_share: np.ndarray) -> list[Crossing]:
    """Crossings in rising order of the speed.

    speed        (n_speed,) of the driving shaft [rad/s], rising
    frequency    (n_mode, n_speed) of the modes [Hz]
    mesh_share   (n_mode, n_speed, n_stage) share of strain energy in each mesh
    """
    met = []
    for mode, line in enumerate(frequency):
        for number, order in enumerate(orders):
            distance = scipy.interpolate.PchipInterpolator(speed, line - order.ratio * speed / (2 * pi))
            share = mesh_share[mode].sum(axis=-1) if order.stage is None else mesh_share[mode, :, order.stage]
            for root in distance.roots(discontinuity=False, extrapolate=False) if line.any() else ():
                if root > 0:
                    at = float(np.interp(root, speed, share))
                    met.append(Crossing(float(root), order.ratio * float(root) / (2 * pi), number, mode, at))
    return sorted(met)
