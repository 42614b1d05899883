"""Static equilibrium of shafts, bearings and meshes: the minimum of their convex potential.

A mesh is a row of springs over the face, one for each part of it, which press but do not pull:

    U = q K q / 2 + sum U_bearing(q) + sum c dz max(r q - gap, 0)^2 / 2 - f q

with the stiffness K of the shafts, the rows r by which their coordinates q bring the flanks together, and the loads f:
torques, external forces and weight of shafts. Each term is convex, and so is U: Newton's method with a line search
finds its minimum, also where bearings have clearance and where a part of the face carries no load.

The coordinates of a planet are its motion on its pin. The pin follows its carrier as a rigid body from the axis of the
carrier at the axial position of the pin on; where the carrier yields (`Planetary.carrier_stiffness`), its seats have
coordinates s against this rigid motion, with its stiffness.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import atan2, cos, sin
from typing import NamedTuple

import numpy as np
import scipy

from exugear.contact.reference_configuration import spatial_frame, spatial_row
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_law import potential
from exugear.gearbox.constant_loads import IDLE, mesh_forces
from exugear.gearbox.elastic_shaft import rigid_motion
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.housing import PER_SEAT, Housing, Seat, seat_label, seat_number
from exugear.gearbox.rolling_bearing import RollingBearing, comes_apart
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.gearbox.static_offsets import placed_on, stage_offsets
from exugear.gearbox.static_shaft import AXIAL, SPIN, StaticShaft, static_shaft
from exugear.mesh_force.ring_pair import RingPair
from exugear.planning.coordinates import pose
from exugear.rolling_bearings.statics import NotCarried
from fem.pair.pair import GearPair
from fem.support.blas_threads import one_thread
from fem.support.validation import require

#: Newton steps, halvings of a step, and share of the slope that a step must gain (Armijo).
STEPS, HALVINGS, LEAST_GAIN = 200, 60, 1e-4
#: Share of the stiffness at the start by which Newton's matrix is raised: it stays regular where nothing touches.
RAISED = 1e-9
#: Work of a step over the energy that counts as 0, and that which rounding may leave.
CONVERGED, ROUNDING = 1e-22, 1e-12
#: Smallest relative difference of two numbers.
EPSILON = float(np.finfo(float).eps)
#: Largest displacement of a bearing [m].
LARGEST = 5e-3


@dataclass(frozen=True, eq=False)
class FaceMesh:
    """A mesh as springs over the face width common to both gears, which is divided into n equal parts.

    stage         the stage
    pair          its pair
    side          1 where the driving flanks carry, -1 where the back flanks do
    force         mesh force [N] by the torques alone, >= 0
    direction     sense about z in which the loaded flank of the pinion pushes
    axial         (n,) middles of the parts [m], along z from the mid-plane of the pinion
    part          width of a part [m]
    rows          (n, n_coordinate) approach of the flanks by the coordinates, in the transverse section
    misalignment  of the displaced shafts [rad], by which the gap opens along z
    offset        axial position of the wheel's mid-plane from the pinion's [m]
    a             centre distance [m]
    gap           of the unloaded flanks of a planet [m], by displaced pins and members and by teeth of other thickness
    ring_angle    position of the mesh on a ring [rad]
    """

    stage: Stage
    pair: GearPair | RingPair
    side: int
    force: float
    direction: int
    axial: np.ndarray
    part: float
    rows: np.ndarray
    misalignment: float
    offset: float
    a: float
    gap: float = 0.0
    ring_angle: float = 0.0

    @property
    def width(self) -> float:
        """Face width common to both gears [m]."""
        return self.part * self.axial.size


@dataclass(frozen=True, eq=False)
class Support:
    """A bearing between its shaft and a seat on ground, in the housing or on a shaft, or of a planet on its pin.

    rows    (5, n_coordinate) motion of one against the other, along the axes of the bearing
    axes    (5, 5) components along these axes by the global ones: of a pin along its radius and across
    """

    shaft: Shaft
    axial: float
    bearing: Bearing | RollingBearing
    rows: np.ndarray
    axes: np.ndarray

    @property
    def label(self) -> str:
        """Name of the bearing in data."""
        return bearing_label(self.shaft, self.axial)


class Pin(NamedTuple):
    """Where a planet stands on its carrier: axial position and position (x, y) from the carrier's axis [m].

    seat   first coordinate of its seat on a carrier that yields, else None
    """

    carrier: str
    axial: float
    arm: tuple[float, float]
    seat: int | None = None

    @property
    def angle(self) -> float:
        """Direction of the pin's radius from x [rad]."""
        return atan2(self.arm[1], self.arm[0])

    def carried(self, axial: float) -> np.ndarray:
        """(6, 6) motion of the pin's axis at an axial position [m] by that of the carrier's axis at the pin."""
        x, y = self.arm
        motion = rigid_motion(axial - self.axial)
        motion[0, 5], motion[1, 5] = -y, x
        motion[2, 3], motion[2, 4] = y, -x
        return motion

    def yielding(self, axial: float, n: int) -> np.ndarray:
        """(6, n) motion of the pin's axis at an axial position [m] against the carrier, by all n coordinates."""
        return np.zeros((6, n)) if self.seat is None else _over_all(n, self.seat, rigid_motion(axial - self.axial))


@dataclass(frozen=True, eq=False)
class ElasticTrain:
    """A gearbox in statics: its shafts, bearings and meshes over common coordinates.

    shafts      by their names
    first       first coordinate of each shaft
    stiffness   (n, n) of shafts, torque supports and housing
    load        (n,) torques of loads, external forces and weight on the coordinates
    supports    the bearings
    meshes      the meshes
    free        (n,) whether a coordinate moves
    pins        of the planets
    seats       first coordinate of each seat in the housing and on carriers that yield
    """

    shafts: Mapping[str, StaticShaft]
    first: Mapping[str, int]
    stiffness: np.ndarray
    load: np.ndarray
    supports: Sequence[Support]
    meshes: Sequence[FaceMesh]
    free: np.ndarray
    pins: Mapping[str, Pin]
    seats: Mapping[Seat, int]

    def rows_at(self, shaft: str, axial: float) -> np.ndarray:
        """(6, n) motion of a shaft at an axial position [m] by all coordinates, of a planet with its carrier."""
        rows = _over_all(self.load.size, self.first[shaft], self.shafts[shaft].motion_at(axial))
        if pin := self.pins.get(shaft):
            rows += pin.carried(axial) @ self.rows_at(pin.carrier, pin.axial) + pin.yielding(axial, self.load.size)
        return rows

    def motion_of(self, shaft: str, q: np.ndarray) -> np.ndarray:
        """(n_node, 6) motion of the nodes of a shaft at the coordinates q, of a planet with its carrier."""
        static = self.shafts[shaft]
        first = self.first[shaft]
        motion = static.motions @ q[first : first + static.free.size]
        if pin := self.pins.get(shaft):
            of_carrier = self.rows_at(pin.carrier, pin.axial) @ q
            motion = motion + np.array([pin.carried(float(axial)) @ of_carrier for axial in static.nodes])
            motion = motion + np.array([pin.yielding(float(axial), q.size) @ q for axial in static.nodes])
        return motion

    def energies(self, q: np.ndarray) -> tuple[float, list[float]]:
        """Energy of shafts and housing, and of each bearing [J]."""
        bearings = [potential(support.bearing, 0.0, support.rows @ q)[0] for support in self.supports]
        return 0.5 * float(q @ self.stiffness @ q), bearings

    @cached_property
    def at_start(self) -> np.ndarray:
        """(n, n) stiffness with all bearings at their largest tangent."""
        total = self.stiffness.copy()
        for support in self.supports:
            total += support.rows.T @ support.bearing.stiffness[:5, :5] @ support.rows
        return total


def bearing_label(shaft: Shaft, axial: float) -> str:
    """Name of a bearing in data, as in those of runs."""
    return seat_label((shaft.name, axial))


def elastic_train(gearbox: Gearbox, loads: Mapping[str, float], parts: int) -> ElasticTrain:
    """The gearbox under loads against the motion of shafts [N m], with faces of the gears in equal parts."""
    forces = mesh_forces(gearbox, loads)
    idle = np.abs(forces) <= IDLE * np.abs(forces).max()
    faces = [
        face_of(gearbox, stage, -1 if f < 0 else 1, parts) for stage, f in zip(gearbox.stages, forces, strict=True)
    ]
    pins, of_carriers = pins_of(gearbox), gearbox.elastic_carriers
    points: dict[str, list[float]] = {shaft.name: [] for shaft in gearbox.shafts}
    for stage, face in zip(gearbox.stages, faces, strict=True):
        for (name, position), offset in zip(stage.ends, (0.0, face.offset), strict=True):
            points[name] += (position + face.axial - offset).tolist()
    for on, position in gearbox.between.values():
        points[on].append(position)
    for pin in pins.values():
        points[pin.carrier].append(pin.axial)
    statics = {shaft.name: static_shaft(shaft, points[shaft.name]) for shaft in gearbox.shafts}
    sizes = [static.free.size for static in statics.values()]
    first = dict(zip(statics, np.r_[0, np.cumsum(sizes)[:-1]].tolist(), strict=True))
    housings = [*([gearbox.housing] if gearbox.housing else []), *of_carriers.values()]
    seats, n = seats_behind(sum(sizes), housings)
    stiffness, load, free = np.zeros((n, n)), np.zeros(n), np.zeros(n, bool)
    supports = []
    for housing in housings:
        moves = seats[housing.seats[0]] + np.flatnonzero(housing.over_six.ravel())
        stiffness[np.ix_(moves, moves)], free[moves] = housing.seat_stiffness, True
    pins = {name: pin._replace(seat=seat_on(gearbox, seats, name, pin.axial)) for name, pin in pins.items()}
    held = {*gearbox.independent, *gearbox.held}
    for shaft in gearbox.shafts:
        static, part = statics[shaft.name], slice(first[shaft.name], first[shaft.name] + statics[shaft.name].free.size)
        stiffness[part, part], load[part] = static.stiffness, static.load
        free[part] = static.free
        turned = static.turned[SPIN]
        stiffness[part, part] += sum(x.torsion for x in shaft.torque_supports) * np.outer(turned, turned)
        for name, torque in loads.items():
            if gearbox.ends[name].name == shaft.name:
                load[part] -= gearbox.directions[shaft.name] * torque * turned
        if shaft.name in held:
            free[part] &= turned == 0
        axes = _along(pins[shaft.name].angle) if shaft.name in pins else np.eye(5)
        for axial, bearing in shaft.bearings.items():
            rows = axes @ _over_all(n, first[shaft.name], static.motion_at(axial)[:5])
            seat = seat_on(gearbox, seats, shaft.name, axial)
            if seat is not None and shaft.name not in pins:
                rows[:, seat : seat + 5] += np.eye(5) if shaft.name in of_carriers else -np.eye(5)
            if (shaft.name, axial) in gearbox.between:
                on, at = gearbox.between[shaft.name, axial]
                rows -= axes @ _over_all(n, first[on], statics[on].motion_at(at)[:5])
            supports.append(Support(shaft, axial, bearing, rows, axes))
    train = ElasticTrain(statics, first, stiffness, load, supports, [], free, pins, seats)
    meshes = []
    numbered = zip(faces, forces, idle, gearbox.gaps, gearbox.ring_angles, strict=True)
    for face, force, open_mesh, of_teeth, ring_angle in numbered:
        rows = np.zeros((parts, n))
        for i, row in enumerate(rows):
            for (name, axial), of_gear in _rows_at(gearbox, face, float(face.axial[i])).items():
                row += of_gear @ train.rows_at(name, axial)
        carried = 0.0 if open_mesh else abs(float(force))
        gap = of_teeth + _gap_by_displacement(gearbox, face)
        meshes.append(replace(face, rows=rows, force=carried, gap=gap, ring_angle=ring_angle))
    return replace(train, meshes=meshes)


def seats_behind(first: int, housings: Sequence[Housing]) -> tuple[dict[Seat, int], int]:
    """First coordinate of each seat of several housings, from a coordinate on, and the number of all coordinates."""
    every = [seat for housing in housings for seat in housing.seats]
    return {seat: first + PER_SEAT * i for i, seat in enumerate(every)}, first + PER_SEAT * len(every)


def seat_on(gearbox: Gearbox, seats: Mapping[Seat, int], shaft: str, axial: float) -> int | None:
    """First coordinate of the seat of a bearing; None where it stands on ground, or its pin follows rigidly."""
    carrier = gearbox.planets.get(shaft, gearbox.ends[shaft]).name
    housing = gearbox.elastic_carriers.get(carrier, gearbox.housing)
    number = seat_number(housing, shaft, axial)
    return None if number is None or housing is None else seats[housing.seats[number]]


def pins_of(gearbox: Gearbox) -> dict[str, Pin]:
    """The pins of the planets by their names, at the middle of their bearings, else of their gears."""
    pins, at = {}, gearbox.shaft_positions
    for shaft in gearbox.shafts:
        if carrier := gearbox.planets.get(shaft.name):
            x, y = np.subtract(at[shaft.name], at[carrier.name]).tolist()
            pins[shaft.name] = Pin(carrier.name, float(np.mean([*(shaft.bearings or shaft.gears)])), (x, y))
    return pins


def _along(angle: float) -> np.ndarray:
    """(5, 5) displacement and tilts along axes at an angle about z [rad] by the global ones."""
    axes, turn = np.eye(5), np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
    axes[:2, :2] = axes[3:, 3:] = turn
    return axes


def _gap_by_displacement(gearbox: Gearbox, face: FaceMesh) -> float:
    """Gap of the flanks [m] of a stage on a carrier in the mid-plane of its pinion, as its shafts are displaced."""
    stage = face.stage
    if stage.carrier is None:
        return 0.0
    shafts, gap, positions = {shaft.name: shaft for shaft in _gears(stage)}, 0.0, gearbox.shaft_positions
    for (name, axial), row in _rows_at(gearbox, face, 0.0).items():
        point, tilts = placed_on(shafts[name], gearbox.planets.get(name), axial, positions)
        gap -= float(row @ np.r_[point - np.array([*positions[name], axial]), tilts, 0.0])
    return gap


def _over_all(n: int, first: int, motion: np.ndarray) -> np.ndarray:
    """(k, n) rows from those over the coordinates from the first on."""
    rows = np.zeros((len(motion), n))
    rows[:, first : first + motion.shape[1]] = motion
    return rows


def face_of(gearbox: Gearbox, stage: Stage, side: int, parts: int) -> FaceMesh:
    """The parts of the face of a stage, without rows."""
    direction = side * gearbox.direction_of(stage)
    offsets = stage_offsets(stage, gearbox.shaft_positions, direction)
    offset, (pinion, wheel) = offsets["axial"], (stage.pair.pinion.b / 2, stage.pair.wheel.b / 2)
    ends = np.linspace(max(-pinion, offset - wheel), min(pinion, offset + wheel), parts + 1)
    axial, part = (ends[1:] + ends[:-1]) / 2, float(ends[-1] - ends[0]) / parts
    placed = offsets["misalignment"], offset, offsets["a"]
    return FaceMesh(stage, stage.pair, side, 0.0, direction, axial, part, np.zeros((parts, 0)), *placed)


def _rows_at(gearbox: Gearbox, face: FaceMesh, axial: float) -> dict[tuple[str, float], np.ndarray]:
    """(6,) approach of the flanks at a position on the face [m] by the motion of each shaft at that position.

    By shaft and axial position on it. The force acts at the pitch point of that section, along the line of action.
    """
    stage, offsets = face.stage, (0.0, face.offset)
    at = [(x, s + axial - offset) for x, s, offset in zip(_gears(stage), stage.axial_positions, offsets, strict=True)]
    levers = [position - shaft.centre for shaft, position in at]
    poses = [pose(gearbox, shaft) for shaft, _ in at]
    rows = np.split(spatial_row(spatial_frame(stage.pair, 0.0, face.direction, levers, poses)), 2)
    return {
        (shaft.name, position): row @ rigid_motion(-lever)
        for (shaft, position), row, lever in zip(at, rows, levers, strict=True)
    }


def _gears(stage: Stage) -> tuple[Shaft, Shaft]:
    return stage.fast, stage.slow


def solve(train: ElasticTrain, stiffness: Sequence[float], gaps: Sequence[np.ndarray]) -> np.ndarray:
    """(n,) coordinates in equilibrium.

    stiffness   of each mesh over its face width [N/m^2]
    gaps        (n_part,) of each mesh [m]

    Raises `NotCarried` where the bearings do not carry the load, RuntimeError where Newton's method does not end.
    """
    with one_thread():
        q = _solve(train, stiffness, gaps)
    _check_carried(train, q)
    return q


def _solve(train: ElasticTrain, stiffness: Sequence[float], gaps: Sequence[np.ndarray]) -> np.ndarray:
    """`solve` on one thread, which suits matrices of this size, without the check of the bearings."""
    free = np.flatnonzero(train.free)
    rows = np.vstack([mesh.rows for mesh in train.meshes])[:, free]
    springs = np.concatenate([np.full(m.axial.size, c * m.part) for m, c in zip(train.meshes, stiffness, strict=True)])
    gap, part = np.concatenate(list(gaps)), np.ix_(free, free)
    supports = [(support, support.rows[:, free]) for support in train.supports]
    load, of_shafts = train.load[free], train.stiffness[part]
    magnitudes = np.abs(of_shafts)
    at_start = train.at_start[part] + rows.T @ (springs[:, None] * rows)

    def evaluate(q: np.ndarray) -> tuple[float, np.ndarray]:
        """Potential and its slope."""
        pressed, strained = np.maximum(rows @ q - gap, 0.0), of_shafts @ q
        energy = 0.5 * float(q @ strained) + 0.5 * float(springs @ pressed**2) - float(load @ q)
        slope = strained + rows.T @ (springs * pressed) - load
        for support, of_bearing in supports:
            u, gradient, _ = potential(support.bearing, 0.0, of_bearing @ q)
            energy, slope = energy + u, slope + of_bearing.T @ gradient
        return energy, slope

    def rounding(q: np.ndarray) -> float:
        """Error of the potential [J] that rounding leaves: short sections are stiff, their rigid motion cancels."""
        return EPSILON * float(np.abs(q) @ magnitudes @ np.abs(q))

    def tangent(q: np.ndarray) -> np.ndarray:
        touching = springs * (rows @ q > gap)
        total = of_shafts + rows.T @ (touching[:, None] * rows) + RAISED * at_start
        for support, of_bearing in supports:
            total += of_bearing.T @ potential(support.bearing, 0.0, of_bearing @ q)[2] @ of_bearing
        return total

    q = _solved(at_start, load + rows.T @ (springs * gap))
    energy, slope = evaluate(q)
    for _ in range(STEPS):
        step = _solved(tangent(q), -slope)
        work = -float(slope @ step)
        if work <= CONVERGED * (abs(energy) + abs(float(load @ q))):
            break
        share = 1.0
        for _ in range(HALVINGS):
            at_step, slope_there = evaluate(q + share * step)
            flatter = abs(float(slope_there @ step)) < 0.5 * work and work < rounding(q)
            if at_step <= energy - LEAST_GAIN * share * work or flatter:
                break
            share /= 2
        else:
            break
        q, energy, slope = q + share * step, at_step, slope_there
    left = -float(slope @ _solved(tangent(q), -slope)) if slope.any() else 0.0
    moved = np.zeros(train.free.size)
    moved[free] = q
    balanced = abs(left) <= ROUNDING * (abs(energy) + abs(float(load @ q)))
    if not balanced:
        raise RuntimeError("static equilibrium was not found; try a larger load, or bearings with less clearance")
    return moved


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of a symmetric positive definite system, scaled to a unit diagonal."""
    scale = 1 / np.sqrt(np.diagonal(matrix))
    factor = scipy.linalg.cho_factor(matrix * np.outer(scale, scale), check_finite=False)
    return scale * scipy.linalg.cho_solve(factor, scale * right, check_finite=False)


def _check_carried(train: ElasticTrain, q: np.ndarray) -> None:
    """Raise `NotCarried` for bearings that are displaced too far, or whose rings come apart."""
    for support in train.supports:
        at = support.rows @ q
        apart = isinstance(support.bearing, RollingBearing) and comes_apart(support.bearing, at)
        if np.abs(at[: AXIAL + 1]).max() > LARGEST or apart:
            how = "its rings come apart" if apart else f"it is displaced by {np.abs(at[:3]).max():.3g} m"
            remedy = "press or pair the bearings against the load, or make them stiffer"
            raise NotCarried(f"bearing {support.label} does not carry the load: {how}; {remedy}")
        if isinstance(support.bearing, Bearing) and support.bearing.table is not None:
            radial = float(np.hypot(*at[:2]))
            beyond = f"bearing {support.label} is displaced by {radial:.3g} m, beyond its table; extend the table"
            require(radial <= support.bearing.reach, beyond)
