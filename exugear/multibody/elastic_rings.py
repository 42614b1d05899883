"""Elastic rings in Exudyn: a node with the amplitudes of the modes, which the contacts of the planets share."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import carray

from exugear.contact.elastic_ring import Ring, spacings
from exugear.gearbox.elastic_ring import ElasticRing, Waves
from exugear.gearbox.gearbox import Gearbox
from exugear.mesh_force.kernel_records import doubles_at, record_type
from exugear.multibody.addresses import reader
from exugear.multibody.elastic_shafts import add_matrices, further_node
from exugear.multibody.recorder import BodyRecorder
from fem.support.numba_cache import compiled

#: A `Ring`: numbers of its modes and of values around it, addresses of its arrays, and its scalars.
RING = record_type(
    *((name, "i8") for name in ("modes", "points", "table", "masses", "stiffness", "damping")),
    *((name, "i8") for name in ("state", "along", "forces")),
    *((name, "f8") for name in ("start", "pitch", "mobility")),
)
ring_record_at = reader(RING)


@compiled
def ring_at(address):
    """The `Ring` at an address."""
    ring = ring_record_at(address)
    m = ring.modes
    return Ring(
        carray(doubles_at(ring.table), (2, ring.points, m, 2)),
        carray(doubles_at(ring.masses), m),
        carray(doubles_at(ring.stiffness), m),
        carray(doubles_at(ring.damping), m),
        carray(doubles_at(ring.state), 2 * m),
        carray(doubles_at(ring.along), m),
        carray(doubles_at(ring.forces), m),
        ring.start,
        ring.pitch,
        ring.mobility,
    )


@dataclass(frozen=True, eq=False)
class BuiltRing:
    """An elastic ring in a built system.

    elastic    its modes
    node       number of the node with the amplitudes
    number     of the object with their matrices
    recorder   samples of the amplitudes and their rates
    indices    (m,) of the amplitudes among the coordinates of the system
    """

    elastic: ElasticRing
    node: int
    number: int
    recorder: BodyRecorder
    indices: np.ndarray

    def motion(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """(number, m) first recorded amplitudes and their rates."""
        amplitudes, rates = (self.recorder[name][:number].astype(float) for name in self.recorder.names)
        return amplitudes, rates


@dataclass(frozen=True, eq=False)
class RingInMesh:
    """An elastic ring as the contact of a planet sees it.

    node      number of the node with the amplitudes
    record    `RING`
    arrays    whose addresses the record holds
    flanks    of the ring, driving and coast
    """

    node: int
    record: np.record
    arrays: tuple[np.ndarray, ...]
    flanks: tuple[Waves, Waves]


def add_elastic_ring(mbs, elastic: ElasticRing) -> BuiltRing:
    """Add the amplitudes of a ring with their mass, stiffness and damping."""
    m = elastic.number
    node = further_node(mbs, f"{elastic.name} modes", m)
    recorder = BodyRecorder(("amplitudes", "rates"), vector_size=m)
    matrices = np.diag(elastic.masses), np.diag(elastic.stiffness), np.diag(elastic.damping), np.zeros((m, m))
    number = add_matrices(mbs, f"{elastic.name} rim", [node], matrices, (0, np.eye(m)), recorder)
    return BuiltRing(elastic, node, number, recorder, np.zeros(0, int))


def located_ring(mbs, built: BuiltRing) -> BuiltRing:
    """The ring with the indices of its amplitudes in the assembled system."""
    return replace(built, indices=np.array(mbs.systemData.GetObjectLTGODE2(built.number), int))


def ring_in_mesh(rings: Mapping[str, BuiltRing], gearbox: Gearbox, number: int) -> RingInMesh | None:
    """The elastic ring of a stage, by its number, as its contact sees it; None without."""
    stage = gearbox.stages[number]
    if stage.slow.name not in rings:
        return None
    built = rings[stage.slow.name]
    elastic, points = built.elastic, len(built.elastic.flanks[0].values)
    flanks = np.array([np.stack([flank.values, flank.slopes], axis=-1) for flank in elastic.flanks])
    m = elastic.number
    arrays: dict[str, Any] = {"table": np.ascontiguousarray(flanks), "masses": elastic.masses}
    arrays |= {"stiffness": elastic.stiffness, "damping": elastic.damping}
    arrays |= {"state": np.zeros(2 * m), "along": np.zeros(m), "forces": np.zeros(m)}
    record = np.zeros(1, RING)[0]
    record.modes, record.points = m, points
    for name, array in arrays.items():
        record[name] = array.ctypes.data
    pitch = 2 * np.pi / abs(stage.pair.wheel.z)
    record.start = spacings(gearbox.ring_angles[number] - pitch * gearbox.phases[number], points)
    record.pitch = spacings(pitch, points)
    ring = RingInMesh(built.node, record, tuple(arrays.values()), elastic.flanks)
    record.mobility = float(row_on_ring(ring, gearbox.phases[number]) ** 2 @ (1 / elastic.masses))
    return ring


def row_on_ring(ring: RingInMesh, phase: float) -> np.ndarray:
    """(m,) slopes of the deflection of the driving flank by the amplitudes, at a phase."""
    spacing = 2 * np.pi / ring.record.points
    return -ring.flanks[0].at(np.array([ring.record.start + ring.record.pitch * phase]) * spacing)[0]
