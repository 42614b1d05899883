"""Constant torques on the shafts of a gearbox at rest: a load on the driven shaft, or loads by the names of shafts."""

from collections.abc import Mapping
from math import isfinite

import numpy as np

from exugear.gearbox.gearbox import Gearbox, forces_of_motion
from fem.support.validation import require

#: Share of the largest mesh force below which a mesh is idle: its force is rounding.
IDLE = 1e-9
NO_LOAD = "without it no mesh carries load"


def given_loads(gearbox: Gearbox, load: float | None, loads: Mapping[str, float] | None) -> dict[str, float]:
    """Torques [N m] against the motion of shafts or rotors at positive speed, by their names, from load= or loads=.

    Raises ValueError unless exactly one of both is given, for shafts that the gearbox lacks, for the driving shaft, and
    for loads that are not finite or all 0.
    """
    require(load is None or loads is None, "load and loads are both given; put all torques into loads={shaft: torque}")
    if loads is None:
        several = "or loads={shaft: torque} of several shafts"
        if load is None:
            raise ValueError(f"load must be the torque on the driven shaft of the gearbox [N m], {several}, got None")
        finite = isfinite(load) and load != 0
        require(finite, f"load must be finite and not 0, got {load:g}; {NO_LOAD}")
        return {gearbox.driven.name: float(load)}
    bodies = gearbox.ends
    unknown = [name for name in loads if name not in bodies]
    require(not unknown, f"loads: no shafts {unknown}; the shafts are {[*bodies]}")
    for name in gearbox.independent:
        driving = f"loads: shaft {name!r} drives, its drive takes the torque that is left; leave it out"
        require(not {name, bodies[name].end} & loads.keys(), driving)
    torques = {name: float(torque) for name, torque in loads.items()}
    finite = all(map(isfinite, torques.values())) and any(torques.values())
    require(finite, f"loads must be finite and not all 0, got {torques}; {NO_LOAD}")
    return torques


def mesh_forces(gearbox: Gearbox, loads: Mapping[str, float]) -> np.ndarray:
    """(n_stage,) static mesh forces [N] under loads against the motion of shafts [N m]."""
    shafts = [shaft.name for shaft in gearbox.shafts]
    torques = np.zeros(len(shafts))
    for name, torque in loads.items():
        shaft = gearbox.ends[name].name
        torques[shafts.index(shaft)] -= gearbox.directions[shaft] * torque
    return forces_of_motion(gearbox, torques, 0.0, gearbox.independent)


def words_of(gearbox: Gearbox, loads: Mapping[str, float]) -> str:
    """Loads in words; the shaft is named unless the driven one alone is loaded."""
    if [*loads] == [gearbox.driven.name]:
        return f"{loads[gearbox.driven.name]:.4g} N m"
    return ", ".join(f"{torque:.4g} N m on {name}" for name, torque in loads.items())


def idle_stages(gearbox: Gearbox, loads: Mapping[str, float]) -> list[str]:
    """Labels of the stages whose meshes carry nothing under `given_loads`: their teeth are open."""
    forces = np.abs(mesh_forces(gearbox, loads))
    idle = forces <= IDLE * forces.max()
    return [label for label, open_mesh in zip(gearbox.labels, idle, strict=True) if open_mesh]
