"""Laws composed of tooth pairs of known stiffness: 2e8 N/m each, over a path of a given number of pitches."""

import numpy as np

from exugear import MeshForce
from exugear.mesh_force.force import composed_law
from exugear.mesh_force.tooth_pairs import INCREMENT_LOADS, ToothPairs
from fem.units import mm, um

PAIR_STIFFNESS = 2e8


def law_of_equal_pairs(pitch_1, pitch_2, pitches: int, contact_ratio: float, **options) -> MeshForce:
    """The law of tooth pairs that are equally stiff all along the path, with pitch deviations [m] of both gears."""
    position = np.arange(3 * 400) / 400 - 1
    reach = np.array([0.0, 400 * um])
    off_path = np.abs(position) > contact_ratio / 2 + 1e-9
    deflection = np.where(off_path, 1 * mm, 0.0)[:, None] + reach
    forces = np.broadcast_to(PAIR_STIFFNESS * reach, (position.size, 2))
    single = MeshForce(position + 1, deflection, forces, pitches=3)
    z_1, z_2 = (np.full(np.size(pitch), -1) for pitch in (pitch_1, pitch_2))
    alike = {"variant_1": z_1, "variant_2": z_2, "increments": np.zeros((0, 9, INCREMENT_LOADS))}
    places = {"coupled_first": -1.0, "coupled_steps": 4.0, "placed_first": -1.0, "placed_steps": 4.0}
    numbers = {"first": -1.0, "last": 1.0, "largest_load": 1e4, "turn": 0.0, "coupling": np.zeros((2, 9))}
    teeth = ToothPairs(single, pitch_1=pitch_1, pitch_2=pitch_2, **alike, **places, **numbers)
    return composed_law(teeth, pitches=pitches, **options)
