"""A mesh that excites the gearbox: its force law about its equilibrium, and its phase over the common period."""

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.kernel_records import record_of, record_type, start_of_field
from exugear.steady_state.cycle_kernels import STEADY_MESH
from exugear.steady_state.ring_blocks import PassedRing

#: Times over the common period closer than this are the same.
SAME_TIME = 1e-9


class MeshEquilibrium(NamedTuple):
    """A mesh in equilibrium: force [N], deflection [m], mean stiffness over the mesh cycle [N/m].

    by_phase, by_misalignment   slopes of its potential [N m per pitch, N m]
    lever                       misalignment beside that of the law [rad]
    opening                     of the flanks by the displaced bearings [m]
    side                        of the loaded flank: +1 driving, -1 back flank
    """

    force: float
    deflection: float
    stiffness: float
    by_phase: float = 0.0
    by_misalignment: float = 0.0
    lever: float = 0.0
    opening: float = 0.0
    side: float = 1.0


@dataclass(frozen=True, eq=False)
class ExcitingMesh:
    """A mesh whose force varies over its cycle.

    law           force law without offsets
    equilibrium   in which the states are 0
    phase         of the driving flank at the beginning of the common period of all meshes that excite
    cycles        number of mesh cycles in the common period, a multiple of the pitches of the law
    sense         +1 where the phase rises over time, -1 where it falls, as of planets that a carrier drives
    ring          that vibrates in modes and that the mesh passes, None of others
    """

    law: MeshForce
    equilibrium: MeshEquilibrium
    phase: float = 0.0
    cycles: int = 1
    sense: int = 1
    ring: PassedRing | None = None

    def record(self, mobility: float) -> np.record:
        """`STEADY_MESH` with a mobility along the line of action [1/kg], and its ring behind it."""
        ring = {"ring": self.ring.record} if self.ring else {}
        kind = record_type(("head", STEADY_MESH), *((name, record.dtype) for name, record in ring.items()))
        head = record_of(
            STEADY_MESH,
            **self.equilibrium._asdict(),
            phase=self.phase,
            cycles=self.sense * self.cycles,
            mobility=mobility,
            ring=start_of_field(kind, "ring") if ring else 0,
        )
        return record_of(kind, head=head, **ring)

    @property
    def jumps(self) -> np.ndarray:
        """Times over the common period at which the force of either flank jumps."""
        phases = self.law.jumps
        if isfinite(self.law.backlash):
            coast = phases if self.law.coast is None else self.law.coast.jumps
            phases = np.concatenate([phases, self.law.back_phase - coast])
        pitches = self.law.pitches
        first = (self.sense * (phases - self.phase)) % pitches
        return ((first + np.arange(0, self.cycles, pitches)[:, None]) / self.cycles).ravel()


def times_between_jumps(meshes: tuple[ExcitingMesh, ...]) -> np.ndarray:
    """Rising times from 0 to 1 over the common period, between which no force jumps."""
    times = np.sort(np.concatenate([mesh.jumps for mesh in meshes]))
    inside = times[(times > SAME_TIME) & (times < 1 - SAME_TIME)]
    return np.concatenate([[0.0], inside[np.diff(inside, prepend=0.0) > SAME_TIME], [1.0]])
