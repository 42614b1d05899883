"""Campbell diagram: natural frequencies over speed with mesh and shaft orders, and their crossings."""

from collections.abc import Mapping, Sequence
from math import pi
from typing import Annotated, Any, NamedTuple

import numpy as np
import scipy
import xarray as xr

from exugear.gearbox.constant_loads import given_loads
from exugear.modal.linear_system import LinearSystem, linear_gearbox
from exugear.modal.modes import HELD, check_arguments, energy_shares, load_attributes, modes_of
from exugear.modal.operating_point import in_loaded_equilibrium
from exugear.multibody.model import Model, require_model
from exugear.multibody.turns import in_turn
from exugear.operation.train_motion import HIGHEST_SPEED
from exugear.planning.eigenmodes import tracked
from fem.support.arguments import checked, keywords_after_first
from fem.support.validation import increasing, numbers, require

#: Number of speeds between two given ends, largest number of speeds, and largest harmonic.
SPEEDS, MOST_SPEEDS, HARMONICS = 61, 10_000, 100


class Order(NamedTuple):
    """A harmonic of a mesh or a shaft.

    name      with its harmonic
    ratio     cycles per turn of the driving shaft
    stage     number of the stage of a mesh, None for a shaft
    carrier   name of the carrier of a mesh in a planetary set, else ""
    """

    name: str
    ratio: float
    stage: int | None
    carrier: str = ""


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
        Order(f"{h} x mesh {label}", h * float(ratio), i, carrier.name if (carrier := box.stages[i].carrier) else "")
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


def check_speeds(name: str, value) -> None:
    """ValueError unless the value holds rising speeds."""
    speeds = np.atleast_1d(numbers(name, value))
    many = f"{name} must hold {MOST_SPEEDS} values at most, got {speeds.size}; frequencies are smooth between fewer"
    require(speeds.size <= MOST_SPEEDS, many)
    increasing(name, speeds, least=2)
    in_range = speeds[0] >= 0 and speeds[-1] < HIGHEST_SPEED
    require(bool(in_range), f"{name} must lie in [0, {HIGHEST_SPEED:g}) rad/s, got {value}; pass (0, 3500*rpm)")


@keywords_after_first("load", "speed")
@checked
@in_turn
def campbell(
    model: Model,
    *,
    speed: Annotated[Sequence[float], check_speeds],
    load: float | None = None,
    loads: Mapping[str, float] | None = None,
    harmonics: int = 3,
    phase: float | None = None,
    drive: str = HELD,
) -> xr.Dataset:
    """Natural frequencies of a loaded gearbox over its speed, with mesh and shaft orders and their crossings.

    speed         of the driving shaft [rad/s]: lowest and highest, between which 61 are computed, or more of them
    load, loads   as in `exugear.modes`; the attribute idle_stages names stages whose meshes carry nothing
    harmonics     of each mesh frequency
    phase, drive  as in `exugear.modes`

    Returns a Dataset over `mode`, `speed`, `order` and `crossing`:

    frequency            (mode, speed) [Hz]: the modes are tracked over the speed by their shapes (modal assurance
                         criterion), so that their lines may cross; numbered as they rise at the lowest speed
    damping_ratio        (mode, speed)
    mesh_energy_share    (mode, speed, stage) of the strain energy, in every mesh
    order_ratio          cycles per turn of the driving shaft; the frequency of an order is order_ratio speed / 2 pi
    order_stage          stage of a mesh order, "" for the rotation of a shaft
    order_carrier        carrier of a mesh order of a planetary set, else ""
    crossing_speed       [rad/s], rising, with crossing_frequency [Hz], crossing_order, crossing_mode, and
                         crossing_energy_share: in the mesh of the order, in all meshes for the rotation of a shaft

    A crossing is a resonance only if its order excites the mode: look for a large crossing_energy_share. Stiffness does
    not depend on the speed. The state of the system is restored afterwards. Raises ValueError as `exugear.modes`.
    """
    check_arguments(phase, drive)
    require(1 <= harmonics <= HARMONICS, f"harmonics must lie in [1, {HARMONICS}], got {harmonics}")
    require_model(model)
    torques = given_loads(model.gearbox, load, loads)
    speeds = np.asarray(speed, float)
    speeds = np.linspace(speeds[0], speeds[1], SPEEDS) if speeds.size == 2 else speeds
    with in_loaded_equilibrium(model, torques, drive) as in_equilibrium:
        system = linear_gearbox(in_equilibrium, speeds, phase)
    lines = tracked(system.mass, [modes_of(system, number) for number in range(speeds.size)])
    orders = orders_of(model, harmonics)
    about = load_attributes(load, torques) | {"drive": drive, "idle_stages": system.idle_stages}
    return _dataset(system, speeds, lines, orders).assign_attrs(about)


def _dataset(system: LinearSystem, speeds: np.ndarray, lines: list[Any], orders: list[Order]) -> xr.Dataset:
    """The labelled result, from the modes at each speed."""
    frequency = np.array([modes.omega for modes in lines]).T / (2 * pi)
    shares = np.stack([energy_shares(system, modes) for modes in lines], axis=1)[..., : len(system.stages)]
    stages = [system.stages[order.stage] if order.stage is not None else "" for order in orders]
    met = crossings(orders, speeds, frequency, shares)
    hertz, share = {"units": "Hz", "long_name": "natural frequency"}, {"units": "1"}
    variables: dict[str, tuple] = {
        "frequency": (("mode", "speed"), frequency, hertz),
        "damping_ratio": (
            ("mode", "speed"),
            np.array([modes.damping_ratio for modes in lines]).T,
            share | {"long_name": "damping ratio"},
        ),
        "mesh_energy_share": (("mode", "speed", "stage"), shares, share | {"long_name": "share of the strain energy"}),
        "order_ratio": ("order", [o.ratio for o in orders], {"long_name": "cycles per turn of the drive"} | share),
        "order_stage": ("order", stages, {"long_name": "stage of a mesh order", "units": ""}),
        "order_carrier": ("order", [o.carrier for o in orders], {"long_name": "carrier of a mesh order", "units": ""}),
    }
    coords = {
        "mode": np.arange(1, frequency.shape[0] + 1),
        "speed": ("speed", speeds, {"long_name": "speed of the driving shaft", "units": "rad/s"}),
        "stage": system.stages,
        "order": [order.name for order in orders],
    }
    return xr.Dataset(variables | _table(met, orders), coords)


def _table(met: list[Crossing], orders: list[Order]) -> dict[str, tuple]:
    """The crossings as variables."""
    columns = np.array(met, float).reshape(-1, len(Crossing._fields)).T
    dim, order = ("crossing",), {"long_name": "order", "units": ""}
    return {
        "crossing_speed": (dim, columns[0], {"long_name": "speed of the driving shaft", "units": "rad/s"}),
        "crossing_frequency": (dim, columns[1], {"long_name": "frequency of the crossing", "units": "Hz"}),
        "crossing_order": (dim, np.array([orders[crossing.order].name for crossing in met], str), order),
        "crossing_mode": (dim, columns[3].astype(int) + 1, {"long_name": "number of the mode", "units": "1"}),
        "crossing_energy_share": (dim, columns[4], {"long_name": "share of the strain energy", "units": "1"}),
    }
