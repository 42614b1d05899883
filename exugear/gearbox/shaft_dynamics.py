"""Static displacement of a shaft, and forces, energies and losses as functions of its motion, for arrays of samples."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from exugear.gearbox.bearing import radial_points
from exugear.gearbox.bearing_law import (
    dissipated_power,
    has_radial_law,
    has_rolling_law,
    linear_part,
    potential,
    radial_motion,
    radial_part,
    radial_reaction,
    radial_secant,
    rolling_reaction,
    strain_energy,
)
from exugear.gearbox.drag import braking_torque
from exugear.gearbox.elastic_shaft import ElasticShaft
from exugear.gearbox.rolling_bearing import RollingBearing, comes_apart, parted
from exugear.gearbox.shaft import Shaft
from exugear.rolling_bearings.statics import NotCarried, equilibrium

#: Iterations for the secant stiffness of nonlinear bearings.
ITERATIONS = 30
#: Newton steps on rolling bearings, share of the slope by which a step must lower the potential, and the change of
#: coordinates that is rounding.
MOST_STEPS, ARMIJO, SMALLEST_STEP = 100, 1e-4, 1e-13
#: Number of samples whose reactions are computed at once: they stay in the processor's cache, which is 5 times as fast.
BLOCK = 4096


@dataclass(frozen=True, eq=False)
class ShaftMotion:
    """Motion of a shaft or of a rotor, over (n,) samples.

    spin, speed   about z [rad, rad/s]
    q, q_t        (n, 5) displacements [m] and tilts [rad] of the centre of mass, and their rates; None for a shaft that
                  only spins; of a planet on a pin along and across the pin's radius, against its carrier
    velocity      (n, 5) of such a planet against the ground; else None
    tilt_y        (n,) tilt of such a planet in space about its tilted y axis, against the ground [rad]; else None
    elastic       the shaft if it is elastic; q and q_t are then (n, 5 + m) with its m elastic coordinates
    twists, twist_rates
                  (n, n_torsion) coordinates of its torsion, and their rates
    beside        (n_torsion, n_torsion) mass over these coordinates beside the inertias of the shaft and its rotors
    twist_damping (n_torsion, n_torsion) damping over these coordinates, without that of couplings
    seats         axial position of each bearing on a seat that moves -> motion (n, 6) of the seat and its rate
    cages         axial position of each bearing whose cage rolls -> spin (n,) that turns it [rad]
    """

    spin: np.ndarray
    speed: np.ndarray
    q: np.ndarray | None = None
    q_t: np.ndarray | None = None
    velocity: np.ndarray | None = None
    tilt_y: np.ndarray | None = None
    elastic: ElasticShaft | None = None
    twists: np.ndarray | None = None
    twist_rates: np.ndarray | None = None
    beside: np.ndarray | None = None
    twist_damping: np.ndarray | None = None
    seats: Mapping[float, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    cages: Mapping[float, np.ndarray] = field(default_factory=dict)

    def in_bearing(self, shaft: Shaft, axial: float) -> tuple[np.ndarray, np.ndarray]:
        """(n, 5) motion of the shaft against the seat of a bearing, and its rate."""
        q, q_t = np.asarray(self.q), np.asarray(self.q_t)
        rows = _motion_at(shaft, axial, q.shape[1], self.elastic)[:5]
        seat, seat_t = self.seats.get(axial, (np.zeros((1, 6)), np.zeros((1, 6))))
        return q @ rows.T - seat[:, :5], q_t @ rows.T - seat_t[:, :5]


@dataclass(frozen=True, eq=False)
class AgainstSeats:
    """The motion of a shaft in its bearings by its coordinates, followed by the motions of its seats, 6 each.

    shaft, elastic   the shaft, and its elastic coordinates if it has any
    components       number of the coordinates of the shaft
    seats            axial positions [m] of the bearings on seats that move, in the order of their motions
    """

    shaft: Shaft
    elastic: ElasticShaft | None
    components: int
    seats: Sequence[float]

    def motion_at(self, axial: float) -> np.ndarray:
        """(6, components + 6 n_seat) motion in a bearing, against its seat."""
        rows = np.zeros((6, self.components + 6 * len(self.seats)))
        rows[:, : self.components] = _motion_at(self.shaft, axial, self.components, self.elastic)
        if axial in self.seats:
            first = self.components + 6 * self.seats.index(axial)
            rows[:, first : first + 6] = -np.eye(6)
        return rows


#: A shaft whose motion at a bearing follows from more coordinates than those of a rigid shaft.
Measured = ElasticShaft | AgainstSeats


def static_displacement(shaft: Shaft, forces: np.ndarray, free: Sequence[int]) -> tuple[np.ndarray, dict[float, float]]:
    """(6,) displacement [m, rad] of a shaft's centre of mass on its bearings, and the radial forces of nonlinear ones.

    forces   (6,) generalized forces on the centre of mass [N, N m], beside external forces and weight of the shaft
    free     numbers of the coordinates that move

    Nonlinear bearings have their secant stiffness under their forces [N], beyond the end of a table that at its end.
    With rolling bearings the displacement is the minimum of the convex potential of all bearings; `NotCarried` where
    they do not carry the forces.
    """
    q, levers = np.zeros(6), {axial: axial - shaft.centre for axial in shaft.bearings}
    if not (shaft.bearings and free):
        return q, {}
    forces = forces + shaft.constant_load
    rolling = {axial: x for axial, x in shaft.bearings.items() if has_rolling_law(x)}
    if rolling:
        q[free] = _of_least_potential(shaft, forces[free], list(free))
        apart = [axial for axial, x in rolling.items() if comes_apart(x, _motion_at(shaft, axial, 5) @ q[:5])]
        if apart:
            raise NotCarried(f"bearings of shaft {shaft.name!r} at {apart} m are pulled apart; press or pair them")
        return q, {}
    nonlinear = {axial: x for axial, x in shaft.bearings.items() if has_radial_law(x)}
    secants = {axial: float(bearing.stiffness[0, 0]) for axial, bearing in nonlinear.items()}
    linear = np.sum([linear_part(b, levers[axial]) for axial, b in shaft.bearings.items()], axis=0)
    part, radial_forces = np.ix_(free, free), dict.fromkeys(secants, 0.0)
    for _ in range(ITERATIONS if secants else 1):
        total = linear + sum((radial_part(k, levers[axial]) for axial, k in secants.items()), np.zeros((6, 6)))
        q[free] = np.linalg.solve(total[part], forces[free])
        for axial, k in secants.items():
            radial_forces[axial] = float(k * np.hypot(*radial_motion(levers[axial], *q[[0, 1, 3, 4]])))
            if radial_forces[axial] > 0:
                secants[axial] = radial_secant(nonlinear[axial], radial_forces[axial])
    return q, radial_forces


def _of_least_potential(shaft: Shaft, forces: np.ndarray, free: list[int]) -> np.ndarray:
    """The coordinates in equilibrium under forces on them; free: their numbers."""

    def of_all_bearings(part: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        q = np.zeros(5)
        q[free] = part
        parts = [potential(bearing, axial - shaft.centre, q) for axial, bearing in shaft.bearings.items()]
        energies, gradients, hessians = zip(*parts, strict=True)
        return sum(energies), np.sum(gradients, axis=0)[free], np.sum(hessians, axis=0)[np.ix_(free, free)]

    positions = [abs(axial - shaft.centre) for axial in shaft.bearings]
    radii = [bearing.rows[0].R for bearing in shaft.bearings.values() if isinstance(bearing, RollingBearing)]
    try:
        return equilibrium(of_all_bearings, forces, max(*positions, *radii))
    except NotCarried as error:
        push = f"{np.array2string(forces[:3], precision=4)} N"
        raise NotCarried(f"bearings of shaft {shaft.name!r} do not carry {push}: {error}") from None


def elastic_displacement(elastic: ElasticShaft, forces: np.ndarray) -> tuple[np.ndarray, dict[float, float]]:
    """`ElasticShaft.static_displacement`, also on rolling bearings: the minimum of the convex potential of all.

    Raises `NotCarried` where the bearings do not carry the forces.
    """
    shaft = elastic.shaft
    if not any(has_rolling_law(bearing) for bearing in shaft.bearings.values()):
        return elastic.static_displacement(forces)
    at_bearings = [(elastic.at_bearing(axial)[:5], bearing) for axial, bearing in shaft.bearings.items()]
    bodies = [slice(6 * i, 6 * i + 6) for i in range(len(shaft.stations))]
    rigid, _ = static_displacement(shaft, np.sum([forces[body] for body in bodies], axis=0), range(5))
    q, free, forces = np.zeros(elastic.size), elastic.moving, forces + elastic.constant_load
    for body in bodies:
        q[body] = rigid

    def of_all(q: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        strained = elastic.stiffness_matrix @ q
        energy, gradient, hessian = 0.5 * float(q @ strained), strained, elastic.stiffness_matrix.copy()
        for rows, bearing in at_bearings:
            of_bearing = potential(bearing, 0.0, rows @ q)
            energy, gradient = energy + of_bearing[0], gradient + rows.T @ of_bearing[1]
            hessian = hessian + rows.T @ of_bearing[2] @ rows
        return energy - float(forces @ q), gradient - forces, hessian

    q = of_least_energy(of_all, q, free)
    fixed = np.setdiff1d(elastic.turning[1:], [] if elastic.end is None else [elastic.end])
    if fixed.size:
        part = np.ix_(fixed, fixed)
        q[fixed] = np.linalg.solve(elastic.stiffness_matrix[part], forces[fixed])
    return q, {}


def of_least_energy(
    potential: Callable[[np.ndarray], tuple[float, np.ndarray, np.ndarray]],
    q: np.ndarray,
    free: np.ndarray,
    solve: Callable[[np.ndarray, np.ndarray], np.ndarray] = np.linalg.solve,
) -> np.ndarray:
    """Coordinates (n,) of least potential: Newton's iteration from q, shortened until the potential falls enough.

    potential   of q: energy [J], gradient (n,), hessian (n, n)
    free        indices of the coordinates that move
    solve       (matrix, right side) -> solution
    """
    energy, gradient, hessian = potential(q)
    for _ in range(MOST_STEPS):
        step = np.zeros(q.size)
        step[free] = solve(hessian[np.ix_(free, free)], -gradient[free])
        slope = float(gradient @ step)
        while potential(q + step)[0] > energy + ARMIJO * slope and np.abs(step).max() > SMALLEST_STEP:
            step, slope = step / 2, slope / 2
        q, (energy, gradient, hessian) = q + step, potential(q + step)
        if np.abs(step).max() <= SMALLEST_STEP:
            break
    return q


def bearing_forces(
    shaft: Shaft,
    q: np.ndarray,
    q_t: np.ndarray,
    forces: np.ndarray,
    elastic: Measured | None = None,
    spins: Mapping[float, np.ndarray] | None = None,
) -> None:
    """Add the forces (n_bearing, 3, n) [N] of all bearings of a shaft on it, in their order.

    With (n_bearing, 5, n) also their moments about x and y [N m].

    q, q_t    displacements [m] of the shaft's centre of mass, (n, 2) in its plane or (n, 5) with its tilts [rad], and
              their rates; of an elastic shaft (n, 5 + m) with its m elastic coordinates
    elastic   the shaft if it is elastic, or on seats that move: q then goes on with the motions of these
    spins     axial position [m] of each bearing whose cage rolls -> (n,) spin that turns it [rad]
    """
    for (axial, bearing), force in zip(shaft.bearings.items(), forces, strict=True):
        motion = _motion_at(shaft, axial, q.shape[1], elastic)
        if has_rolling_law(bearing):
            for first in range(0, len(q), BLOCK):
                block = slice(first, first + BLOCK)
                at_bearing = _with_spin(q[block] @ motion[:5].T, (spins or {}).get(axial), block)
                reaction = rolling_reaction(bearing, 0.0, at_bearing, q_t[block] @ motion[:5].T, len(force))
                force[:, block] += reaction.T
            continue
        stiffness, radial = linear_part(bearing, 0.0)[: len(force)] @ motion, motion[:2]
        directions = np.flatnonzero(stiffness.any(axis=1))
        points = radial_points(bearing) if has_radial_law(bearing) else None
        for first in range(0, len(q), BLOCK):
            block = slice(first, first + BLOCK)
            displacements, rates = q[block].T, q_t[block].T
            strained = displacements + bearing.damping_time * rates
            for i in directions:
                force[i, block] -= stiffness[i] @ strained
            if points is not None:
                moved = *(radial @ displacements), *(radial @ rates)
                force[:2, block] += radial_reaction(points, bearing.damping_time, *moved)


def bearing_displacements(
    shaft: Shaft, q: np.ndarray, at_bearings: np.ndarray, elastic: Measured | None = None
) -> None:
    """Compute the displacements (n_bearing, 3, n) [m] of a shaft at all its bearings, in their order.

    q, elastic   as in `bearing_forces`
    """
    for axial, displacement in zip(shaft.bearings, at_bearings, strict=True):
        displacement[:] = _motion_at(shaft, axial, q.shape[1], elastic)[:3] @ q.T


def bearing_tilts(shaft: Shaft, q: np.ndarray, elastic: Measured | None = None) -> np.ndarray:
    """(n_bearing, 2, n) tilts [rad] of a shaft at its bearings, in their order; q, elastic as in `bearing_forces`."""
    if q.shape[1] < 5:
        return np.zeros((len(shaft.bearings), 2, len(q)))
    return np.array([_motion_at(shaft, axial, q.shape[1], elastic)[3:5] @ q.T for axial in shaft.bearings])


def parted_bearings(
    shaft: Shaft, q: np.ndarray, forces: np.ndarray, elastic: Measured | None = None
) -> dict[float, np.ndarray]:
    """Axial position [m] -> (n,) whether a rolling bearing with a contact angle has lost its axial force.

    Its balls press where the rings have no shoulder, or none of its rows carries anything. Only bearings for which that
    happens.

    forces       (n_bearing, 3, n) on the shaft [N]
    q, elastic   as in `bearing_forces`
    """
    apart = {}
    for (axial, bearing), force in zip(shaft.bearings.items(), forces, strict=True):
        if not isinstance(bearing, RollingBearing) or all(row.alpha == 0 for row in bearing.rows):
            continue
        motion, lost = _motion_at(shaft, axial, q.shape[1], elastic)[:5], ~force[:3].any(axis=0)
        for first in range(0, len(q), BLOCK):
            block = slice(first, first + BLOCK)
            lost[block] |= parted(bearing, q[block] @ motion.T)
        if lost.any():
            apart[axial] = lost
    return apart


def _with_spin(q: np.ndarray, spin: np.ndarray | None, block: slice = slice(None)) -> np.ndarray:
    """Displacements (n, 5) at a bearing, with the spin (n,) that turns its cage as sixth column where that rolls."""
    return q if spin is None else np.column_stack([q, spin[block]])


def _motion_at(shaft: Shaft, axial: float, components: int, elastic: Measured | None = None) -> np.ndarray:
    """(6, components) displacement and rotation of a shaft at an axial position by those of its centre of mass.

    The components of an elastic shaft contain its elastic coordinates.
    """
    if elastic:
        return elastic.motion_at(axial)
    motion = np.eye(6)[:, :5]
    motion[0, 4], motion[1, 3] = axial - shaft.centre, shaft.centre - axial
    return motion[:, :components]


def bearing_energy(shaft: Shaft, motion: ShaftMotion) -> np.ndarray:
    """(n,) energy of all bearings and torque supports of a shaft [J], and of its own strain; 0 where it only spins.

    External forces and weight have their potential in it, which falls as they displace the shaft.
    """
    energy = 0.5 * sum(support.torsion for support in shaft.torque_supports) * np.square(motion.spin, dtype=float)
    if motion.q is not None:
        for axial, bearing in shaft.bearings.items():
            at_bearing, _ = motion.in_bearing(shaft, axial)
            energy += strain_energy(bearing, 0.0, _with_spin(at_bearing, motion.cages.get(axial)))
        load = motion.elastic.load_of_decoupled if motion.elastic else shaft.constant_load
        energy -= motion.q @ load[: motion.q.shape[1]]
        if motion.elastic:
            energy += 0.5 * motion.q[:, 5:] ** 2 @ motion.elastic.stiffness
    if motion.elastic and motion.twists is not None:
        energy += 0.5 * _forms(motion.twists, motion.elastic.torsion.stiffness)
    return energy


def bearing_losses(shaft: Shaft, motion: ShaftMotion) -> dict[float, np.ndarray]:
    """(n,) power [W] that each bearing of a shaft dissipates, by its axial position [m]."""
    if motion.q is None or motion.q_t is None:
        return {}
    losses = {}
    for axial, bearing in shaft.bearings.items():
        at_bearing, rates = motion.in_bearing(shaft, axial)
        losses[axial] = dissipated_power(bearing, 0.0, _with_spin(at_bearing, motion.cages.get(axial)), rates)
    return losses


def elastic_loss(motion: ShaftMotion) -> np.ndarray:
    """(n,) power [W] that the damping of an elastic shaft dissipates, without that of its couplings; 0 of a rigid one.

    What the damper towards a free end takes beyond the share of the modes is negative here: count both together.
    """
    loss = np.zeros(motion.spin.size)
    if motion.elastic and motion.q_t is not None:
        loss += motion.q_t[:, 5:] ** 2 @ motion.elastic.damping
    if motion.elastic and motion.twist_rates is not None and motion.twist_damping is not None:
        loss += _forms(motion.twist_rates, motion.twist_damping)
    return loss


def _forms(vectors: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(n,) quadratic forms of vectors (n, k)."""
    return np.einsum("ni,ij,nj->n", vectors, matrix, vectors)


def braking_torques(
    shaft: Shaft,
    omega: np.ndarray,
    q: np.ndarray | None,
    elastic: ElasticShaft | None = None,
    spins: Mapping[float, np.ndarray] | None = None,
) -> np.ndarray:
    """(n,) torque of all drags of a shaft against its rotation [N m].

    omega               (n,) speed of the shaft [rad/s]
    q, elastic, spins   as in `bearing_forces`; q None where the shaft only spins
    """
    loads: dict[float, np.ndarray] = {}
    if q is not None:
        forces = np.zeros((len(shaft.bearings), 3, omega.size))
        bearing_forces(shaft, q, np.zeros_like(q), forces, elastic, spins)
        loads = {axial: np.hypot(x, y) for axial, (x, y, _) in zip(shaft.bearings, forces, strict=True)}
    torques = [braking_torque(drag.terms, omega, loads.get(axial, 0.0)) for axial, drag in shaft.drags]
    return np.sum(torques, axis=0) if torques else np.zeros_like(omega)


def unbalance_torques(
    shaft: Shaft, spin: np.ndarray, speed: np.ndarray, q_t: np.ndarray, elastic: ElasticShaft | None = None
) -> np.ndarray:
    """(n,) torque about z by which the unbalance of a shaft brakes it [N m].

    spin, speed     (n,) about z [rad, rad/s]
    q_t, elastic    as in `bearing_forces`
    """
    torque = np.zeros(spin.size)
    for axial, unbalance in shaft.unbalances:
        v_x, v_y = (q_t @ _motion_at(shaft, axial, q_t.shape[1], elastic)[:2].T).T
        angle = spin + unbalance.angle
        torque -= unbalance.moment * speed * (v_x * np.cos(angle) + v_y * np.sin(angle))
    return torque


def kinetic_energy(shaft: Shaft, motions: Mapping[str, ShaftMotion], inertia: float) -> np.ndarray:
    """(n,) kinetic energy of a shaft and of its rotors [J], from their motions by name.

    inertia   of the shaft about z [kg m^2], of a carrier with that of its planets on their circle

    An Rxyz body turns about its axis by the rate of its spin plus that of the first tilt times the sine of the second.
    Elastic shafts have constant mass matrices.
    """
    motion = motions[shaft.name]
    energy, about_axis = np.zeros(motion.speed.size), motion.speed
    if motion.elastic and motion.q_t is not None:
        energy = energy + motion.q_t**2 @ motion.elastic.inertia
    elif motion.q is not None and motion.q_t is not None:
        x, y, z, a_t, b_t = (motion.q_t if motion.velocity is None else motion.velocity)[:, :5].T
        b = shaft.offset.tilt_y + motion.q[:, 4] if motion.tilt_y is None else motion.tilt_y
        about_axis = about_axis + a_t * np.sin(b)
        energy = energy + shaft.mass * (x**2 + y**2 + z**2) + shaft.transverse * ((a_t * np.cos(b)) ** 2 + b_t**2)
    if motion.elastic and motion.twist_rates is not None and motion.beside is not None:
        energy = energy + _forms(motion.twist_rates, motion.beside)
    for rotor in shaft.rotors:
        energy = energy + rotor.coupling.inertia * motions[rotor.name].speed ** 2
    return 0.5 * (energy + inertia * about_axis**2)


def coupling_energy(shaft: Shaft, motions: Mapping[str, ShaftMotion]) -> np.ndarray:
    """(n,) energy of all couplings of a shaft [J]."""
    energy = np.zeros(motions[shaft.name].spin.size)
    for rotor in shaft.rotors:
        energy += 0.5 * rotor.coupling.torsion * (motions[rotor.name].spin - motions[rotor.body].spin) ** 2
    return energy


def coupling_losses(shaft: Shaft, motions: Mapping[str, ShaftMotion]) -> dict[str, np.ndarray]:
    """(n,) power [W] that each coupling of a shaft dissipates, by the shaft's name, of several by the rotors' names."""
    rotors = {shaft.name if len(shaft.rotors) == 1 else rotor.name: rotor for rotor in shaft.rotors}
    return {
        name: rotor.coupling.damping * (motions[rotor.name].speed - motions[rotor.body].speed) ** 2
        for name, rotor in rotors.items()
    }
