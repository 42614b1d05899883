"""The housing in Exudyn: constant matrices between the bodies of shafts whose bearings stand on its seats.

The bearings are in the system as if they stood on ground; one object adds what the yielding seats change, in stiffness
and damping (`exugear.gearbox.housing`).
"""

from collections.abc import Mapping

import exudyn.itemInterface as eii
import numpy as np

from exugear.gearbox.elastic_shaft import rigid_motion
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.housing import PER_SEAT, SeatCoupling, seat_coupling, seat_label, seat_number
from exugear.gearbox.shaft import Shaft
from exugear.multibody.elastic_shafts import BuiltShaft
from exugear.multibody.exudyn_objects import node_of
from exugear.planning.plan import Plan
from fem.support.validation import require


def coupling_of(gearbox: Gearbox, scene: Plan) -> SeatCoupling | None:
    """Bearings and housing of a gearbox by a plan; None where no shaft moves on a seat, or these have coordinates."""
    if gearbox.housing is None or scene.elastic_housing is not None:
        return None
    on_bearings = [name for name, kind in scene.shafts.items() if kind.on_bearings]
    moving = [name for name, _ in gearbox.housing.seats if name in on_bearings]
    return seat_coupling(gearbox.housing, gearbox.shafts, moving) if moving else None


def add_housing(
    mbs, gearbox: Gearbox, scene: Plan, bodies: Mapping[str, int], elastics: Mapping[str, BuiltShaft]
) -> None:
    """Add the object by which the seats of bearings yield, if there is a housing without coordinates of its own."""
    if gearbox.housing is not None:
        _check_drags(gearbox)
    coupling = coupling_of(gearbox, scene)
    if coupling is None:
        return
    names = [*dict.fromkeys(name for name, _ in coupling.housing.seats if scene.shafts[name].on_bearings)]
    nodes, rows = [], []
    for name in names:
        of_shaft = _rows_of_shaft(gearbox.ends[name], scene, coupling)
        on = mbs.GetObject(elastics[name].number)["nodeNumbers"] if name in elastics else [node_of(mbs, bodies[name])]
        nodes += [*on]
        rows.append(of_shaft)
    over = np.hstack(rows)
    stiffness = over.T @ (coupling.stiffness - coupling.bearings) @ over
    damping = over.T @ (coupling.damping_matrix - coupling.damping) @ over
    item = eii.ObjectGenericODE2(
        name="housing seats", nodeNumbers=nodes, stiffnessMatrix=stiffness, dampingMatrix=damping
    )
    item.visualization["show"] = False
    mbs.AddObject(item)


def _check_drags(gearbox: Gearbox) -> None:
    """Refuse drags that read the load of a bearing as if its seat stood."""
    by_load = [
        seat_label((shaft.name, axial))
        for shaft in gearbox.shafts
        for axial, drag in shaft.drags
        if drag.needs_load and seat_number(gearbox.housing, shaft.name, axial) is not None
    ]
    require(not by_load, f"drags of the bearings {by_load} on seats of the housing need a load; pass load=... [N]")


def _rows_of_shaft(shaft: Shaft, scene: Plan, coupling: SeatCoupling) -> np.ndarray:
    """(6 n, m) motion at the seats by the m coordinates of a shaft in the system; 0 at seats of other shafts."""
    elastic, components = scene.elastic.get(shaft.name), scene.shafts[shaft.name].components
    size = elastic.size if elastic else len(components)
    rows = np.zeros((PER_SEAT * len(coupling.housing.seats), size))
    for i, (name, axial) in enumerate(coupling.housing.seats):
        if name == shaft.name:
            at = elastic.at_bearing(axial) if elastic else rigid_motion(axial - shaft.centre)[:, components]
            rows[PER_SEAT * i : PER_SEAT * (i + 1)] = at
    return rows


def seat_rows(
    gearbox: Gearbox,
    scene: Plan,
    coupling: SeatCoupling,
    spins: Mapping[str, int],
    elastics: Mapping[str, BuiltShaft],
    size: int,
) -> np.ndarray:
    """(6 n, size) motion of the shafts at the seats by all coordinates of the system."""
    rows = np.zeros((PER_SEAT * len(coupling.housing.seats), size))
    for name in dict.fromkeys(name for name, _ in coupling.housing.seats):
        kind = scene.shafts[name]
        if not kind.on_bearings:
            continue
        part = elastics[name].indices if name in elastics else np.arange(spins[name] - kind.spin_index, spins[name] + 1)
        rows[:, part] += _rows_of_shaft(gearbox.ends[name], scene, coupling)
    return rows


def seat_motions(
    coupling: SeatCoupling, motions: Mapping[str, tuple[Shaft, np.ndarray, np.ndarray]], scene: Plan
) -> tuple[np.ndarray, np.ndarray]:
    """Motions and rates (6 n, samples) at the seats by those of the shafts, as in `motions_on_bearings`."""
    samples = len(next(iter(motions.values()))[1])
    moved, rates = (np.zeros((PER_SEAT * len(coupling.housing.seats), samples)) for _ in range(2))
    for i, (name, axial) in enumerate(coupling.housing.seats):
        if name not in motions:
            continue
        shaft, q, q_t = motions[name]
        elastic = scene.elastic.get(name)
        at = elastic.motion_at(axial) if elastic else rigid_motion(axial - shaft.centre)[:, : q.shape[1]]
        part = slice(PER_SEAT * i, PER_SEAT * (i + 1))
        moved[part], rates[part] = at @ q.T, at @ q_t.T
    return moved, rates


def forces_on_seats(coupling: SeatCoupling, moved: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """(6 n, samples) forces and moments of the bearings on their shafts, from motions and rates at the seats."""
    return -(coupling.stiffness @ moved + coupling.damping_matrix @ rates)
