"""Error of a reduction: forces of the meshes at the motion of an orbit, by their whole laws and by the reduced ones."""

from typing import NamedTuple

import numpy as np

from exugear.modal.mesh_tangents import contact_of
from exugear.multibody.model import Mesh, Model
from exugear.steady_state.steady_system import SteadySystem

#: Samples in a cycle of the fastest mesh.
SAMPLES = 32


class Reduction(NamedTuple):
    """A reduced gearbox.

    system        the meshes that excite in their linear surroundings
    stages        numbers of these meshes
    coordinates   (n_coordinates,) of the gearbox in equilibrium
    motions       (n_coordinates, 2 n) by the states of the system; those of elastic rings count from the unloaded ring
    angle         of the driving shaft at the beginning of the common period [rad]
    """

    system: SteadySystem
    stages: list[int]
    coordinates: np.ndarray
    motions: np.ndarray
    angle: float


def force_error(model: Model, reduction: Reduction, states: np.ndarray, frequency: float) -> float:
    """Largest rms of the error of a mesh force over the common period, over the mean force of the mesh.

    states      [m] at the beginning of the period
    frequency   mesh frequency of the reference mesh [Hz]

    The forces are those without damping. Their directions are taken from the reduction.
    """
    system = reduction.system
    number = SAMPLES * max(mesh.cycles for mesh in system.meshes)
    times = np.arange(number) / number
    sampled, forces = system.sampled(states, frequency, times)
    angles = reduction.angle + system.cycles * times / system.mesh_cycles
    motion = sampled @ reduction.motions.T
    errors = []
    for stage, mesh, reduced in zip(reduction.stages, system.meshes, forces.T, strict=True):
        contact = model.meshes[stage].contact
        whole, bodies = contact_of(model.bare_mbs, contact), model.bare_mbs.systemData.GetObjectLTGODE2(contact)
        turned = angles[:, None] * _turns(model, model.meshes[stage])
        exact = np.array([whole.force(q[bodies]) for q in reduction.coordinates + turned + motion])
        errors.append(np.sqrt(np.mean((exact - reduced) ** 2)) / abs(mesh.equilibrium.force))
    return float(max(errors))


def _turns(model: Model, mesh: Mesh) -> np.ndarray:
    """(n_coordinates,) turns of the spins per turn of the driving shaft, those of a set in the frame of its carrier."""
    ratios, turns = model.gearbox.ratios, np.zeros(model.bare_mbs.systemData.ODE2Size())
    of_carrier = ratios[mesh.stage.carrier.name] if mesh.stage.carrier else 0
    for name, spin in model.spins.items():
        turns[spin] = float(ratios[name] - of_carrier)
    return turns
