"""Vibration of the bearing forces in a steady state, by the whole laws of the bearings at the motion of an orbit."""

from math import pi
from typing import Any

import numpy as np

from exugear.gearbox.shaft_dynamics import bearing_forces
from exugear.multibody.model import Model
from exugear.multibody.shaft_motion import against_seats, replace_forces_on_seats
from exugear.steady_state.branch import Branch
from exugear.steady_state.force_error import Reduction
from exugear.steady_state.periodic_orbit import PeriodicOrbits
from fem.support.validation import require
from fem.units import mm

#: Samples in a cycle of the fastest mesh: twice those that resolve its tenth harmonic.
SAMPLES = 40
DIRECTIONS = "x", "y", "z"


def bearing_vibration(model: Model, reduction: Reduction, branches: list[Branch]) -> dict[str, Any]:
    """Variables of `steady_states`: rms of the vibration of bearing forces over (point, bearing, direction).

    Raises ValueError where no shaft stands on bearings, and for sets on pins, whose frame turns.
    """
    require(not model.pins, "bearing_forces must be False for planets on pins, which are seen in a frame that turns")
    kinds = model.plan.shafts
    shafts = [x for x in model.gearbox.shafts if kinds[x.name].on_bearings and x.bearings]
    require(len(shafts) > 0, "bearing_forces must be False where all shafts only spin: no bearing is modelled")
    rows = [_rms(model, reduction, shafts, branch, point) for branch in branches for point in branch.points]
    labels = [f"{shaft.name} at {axial / mm:g} mm" for shaft in shafts for axial in shaft.bearings]
    about = {"units": "N", "long_name": "rms of the vibration of the bearing force"}
    over = "point", "bearing", "direction"
    return {"bearing_force_rms": (over, np.array(rows), about), "bearing": labels, "direction": [*DIRECTIONS]}


def _rms(model: Model, reduction: Reduction, shafts: list, branch: Branch, point) -> np.ndarray:
    """(n_bearing, 3) rms of the forces about their means over the period of an orbit [N]."""
    system, orbits = reduction.system, PeriodicOrbits(reduction.system, branch.period)
    states, frequency = orbits.states_of(point.unknowns), orbits.frequency_of(point.unknowns)
    number = SAMPLES * max(mesh.cycles for mesh in system.meshes)
    parts = []
    for _ in range(branch.period):
        sampled, _ = system.sampled(states, frequency, np.arange(number) / number)
        parts.append(sampled @ reduction.motions.T)
        states = system.settled(states, frequency, 1)
    motion, period = np.concatenate(parts), branch.period * system.cycles / frequency
    turns = 2j * pi * np.fft.rfftfreq(len(motion), 1 / len(motion))[:, None] / period
    rate = np.fft.irfft(turns * np.fft.rfft(motion, axis=0), len(motion), axis=0)
    q = reduction.coordinates + motion
    motions = {shaft.name: (shaft, *(_motion(model, shaft.name, x) for x in (q, rate))) for shaft in shafts}
    of_housing = (q[:, model.seats.of_housing], rate[:, model.seats.of_housing]) if model.seats else None
    forces = np.zeros((sum(len(shaft.bearings) for shaft in shafts), 3, len(motion)))
    last = 0
    for moved in against_seats(model, motions, of_housing).values():
        first, last = last, last + len(moved.shaft.bearings)
        bearing_forces(moved.shaft, moved.q, moved.q_t, forces[first:last], moved.measured)
    replace_forces_on_seats(model, motions, forces)
    return forces.std(axis=2)


def _motion(model: Model, name: str, q: np.ndarray) -> np.ndarray:
    """(n, k) motion of a shaft on its bearings, as in `bearing_forces`, by the coordinates of the system (n, m)."""
    if built := model.elastics.get(name):
        return q[:, built.indices[built.elastic.moving]] @ built.elastic.from_moving.T
    spin = model.spins[name]
    return q[:, spin - model.plan.shafts[name].spin_index : spin]
