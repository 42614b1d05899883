"""Load cases of a REXS file: speed and load for a run, all torques and forces, and the share of time."""

from typing import NamedTuple

import numpy as np

from exugear.exchange.rexs_file import Component
from exugear.exchange.rexs_reading import Reading
from exugear.exchange.rexs_shafts import ShaftLayout
from exugear.gearbox.shaft_loads import ExternalForce
from exugear.operation.load_spectrum import LoadCase
from fem.support.validation import require

FORCES = "force_u_direction", "force_v_direction", "force_w_direction"
MOMENTS = "torque_around_v_axis", "torque_around_w_axis"


class RawCase(NamedTuple):
    """What the file holds of a load case: speeds [rad/s] and torques [N m] by shaft, forces and the share of time."""

    name: str
    speeds: dict[str, float]
    torques: dict[str, float]
    powers: dict[str, float]
    forces: dict[str, dict[float, ExternalForce]]
    fraction: float


def raw_cases(reading: Reading, layouts: dict[str, ShaftLayout]) -> list[RawCase]:
    """The load cases of a file, or the load that the components hold themselves."""
    listed: list[dict[str, Component]] = [*reading.file.load_cases] or [{}]
    return [_raw_case(reading, layouts, case, number) for number, case in enumerate(listed, start=1)]


def _raw_case(reading: Reading, layouts: dict[str, ShaftLayout], case: dict[str, Component], number: int) -> RawCase:
    def value(component: Component, name: str, unit: str) -> float | None:
        """Of the load case, or of the component itself."""
        for owner in (case.get(component.id), component):
            if owner is not None and reading.has(owner, name):
                return reading.number(owner, name, unit)
        return None

    raw = RawCase(f"load case {number}", {}, {}, {}, {}, 1.0)
    for unit in reading.file.of_type("gear_unit"):
        reading.use(unit)
        fraction = value(unit, "load_duration_fraction", "1")
        raw = raw if fraction is None else raw._replace(fraction=fraction)
    for layout in layouts.values():
        speed = value(layout.component, "rotational_speed", "rad/s")
        reading.flag(layout.component, "defines_speed")
        if speed is not None:
            raw.speeds[layout.name] = layout.sense * speed
        for load in reading.parts_of(layout.component, "external_load"):
            reading.use(load)
            reading.flag(load, "transmits_torque"), reading.flag(load, "defines_torque")
            axial = layout.axial(reading.number(load, "u_coordinate_on_shaft", "m", 0.0))
            torque, power = value(load, "torque_around_u_axis", "N m"), value(load, "power", "W")
            if torque is not None:
                raw.torques[layout.name] = raw.torques.get(layout.name, 0.0) + layout.sense * torque
            elif power is not None:
                raw.powers[layout.name] = raw.powers.get(layout.name, 0.0) + power
            u, v, w = (value(load, name, "N") or 0.0 for name in FORCES)
            about_v, about_w = (value(load, name, "N m") or 0.0 for name in MOMENTS)
            if np.any([u, v, w, about_v, about_w]):
                z, x, y = [u, v, w] @ layout.axes
                _, about_x, about_y = [0.0, about_v, about_w] @ layout.axes
                force = ExternalForce(*map(float, (x, y, z, about_x, about_y)))
                at = raw.forces.setdefault(layout.name, {})
                at[axial] = _sum(at[axial], force) if axial in at else force
    return raw


def _sum(first: ExternalForce, second: ExternalForce) -> ExternalForce:
    """Both forces together."""
    return ExternalForce(*np.add(first.wrench, second.wrench)[:5].tolist())


def load_case(raw: RawCase, ratios: dict[str, float], driving: str, driven: str) -> LoadCase:
    """The load case of a train with these speeds over that of the driving shaft."""
    speeds = [speed / ratios[name] for name, speed in raw.speeds.items() if ratios.get(name)]
    speed = speeds[0] if speeds else 0.0
    unlike = f"speeds of {raw.name} contradict the ratios: {raw.speeds}; keep that of one shaft"
    require(all(abs(x - speed) <= 1e-3 * abs(speed) for x in speeds), unlike)
    return LoadCase(
        raw.name,
        speed,
        torque_balance(raw, ratios, driving, driven, speed),
        raw.fraction,
        dict(raw.torques),
        raw.forces,
    )


def torque_balance(raw: RawCase, ratios: dict[str, float], driving: str, driven: str, speed: float = 1.0) -> float:
    """Torque on the driven shaft that balances those of the file [N m], > 0 where the driving one is > 0 about z.

    That of the file itself where the file holds none on the driving shaft, which takes the rest.
    """
    torques = all_torques(raw, ratios, speed)
    power = sum(torque * ratios.get(name, 0.0) for name, torque in torques.items() if name != driven)
    if driven in torques and (power == 0 or driving not in torques):
        power = -torques[driven] * ratios[driven]
    return power / abs(ratios[driven]) if ratios[driven] else 0.0


def all_torques(raw: RawCase, ratios: dict[str, float], speed: float) -> dict[str, float]:
    """Torques on the shafts about z [N m], also those that the file holds as powers."""
    torques = dict(raw.torques)
    for name, power in raw.powers.items():
        if ratios.get(name) and speed:
            torques[name] = power / (ratios[name] * speed)
    return torques
