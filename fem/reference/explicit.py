"""Transmission error by explicit time integration of both gears: central differences, lumped mass, penalty contact.

    M (u'' + 2 w x u' + w' x r + w x (w x r)) + d M v = -R(u) + contact,        v_(n+1/2) = v_(n-1/2) + h v'_n

with hubs, frames and load of `fem.reference.time_integration`. No system is solved, but the step h must satisfy
h <= 2 / omega_max of the mesh (Courant, Friedrichs, Lewy); nodes too light for a requested step get more mass, which
lowers natural frequencies (mass scaling: Belytschko, Liu, Moran, Nonlinear Finite Elements, 2000).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr
from skfem import ElementQuad1

from fem.elasticity.mesh_density import Density
from fem.pair.pair import GearPair
from fem.reference.deformable_gear import DeformableGear, clamped_pair
from fem.reference.mortar import MatingGears
from fem.reference.penalty_contact import (
    ContactLaw,
    FlankArrays,
    MovingGear,
    RelativePose,
    ToothPair,
    add_contact_forces,
    contact_stiffness_bound,
    flank_arrays,
    tooth_pair_table,
)
from fem.reference.st_venant_kirchhoff import add_plane_force, lumped_mass, stiffness, strain_energy
from fem.reference.time_integration import LoadedRun, RunUp, checked_run
from fem.support.arguments import checked
from fem.support.numba_cache import compiled, fast
from fem.support.progress import bar, shown
from fem.support.validation import as_floats, require, require_kind

__all__ = ["CentralDifferences", "transmission_error"]


def __dir__() -> list[str]:
    """Public names, for help and completion."""
    return __all__


#: Entries of `Motion.work`: by the drive, against load, damping and slip.
DRIVE, LOAD, DAMPING, SLIP = range(4)


@dataclass(frozen=True)
class CentralDifferences:
    """Parameters of the explicit integration.

    step        time step [s]; nodes get the mass that makes it stable, which slows vibrations: the default multiplies
                the mass of gears of 2 to 3 mm modules by 10 to 30, for slow runs only; 4e-8 s adds up to 3 %
    penalty     contact pressure per penetration, and friction per slip [Pa/m]
    friction    Coulomb's coefficient
    """

    step: float = 5e-7
    penalty: float = 1e16
    friction: float = 0.0

    def __post_init__(self):
        as_floats(self)
        require(0 < self.step < np.inf, f"step must be > 0 and finite [s], got {self.step}")
        require(0 < self.penalty < np.inf, f"penalty must be > 0 and finite [Pa/m], got {self.penalty}")
        require(0 <= self.friction < 1, f"friction must lie in [0, 1), got {self.friction}")


@checked
def transmission_error(
    pair: GearPair,
    torque: float,
    run: RunUp | None = None,
    scheme: CentralDifferences | None = None,
    *,
    density: Density | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Results of `fem.dynamic.transmission_error` on linear quadrilaterals (plane strain), with the energy balance.

    torque      pinion torque F r_b1 at full speed [N m]
    run         run-up; its steps are those between two records, alpha has no effect
    density     density of the FE mesh; reliefs add no `edges`, as small elements would shorten the step

    "energy": kinetic, strain and contact energy [J]; "work": by the pinion's hub, against load, damping and slip [J];
    damping acts against the motion relative to steady rotation and does work on gears that turn more slowly.
    attrs["added_mass"]: mass scaling as share of the gears' mass.
    Raises ValueError for bad input, RuntimeError for an unstable integration and gears that separate by the backlash.
    """
    loaded, density = checked_run(pair, torque, run, density, ElementQuad1())
    scheme = CentralDifferences() if scheme is None else scheme
    require_kind("scheme", scheme, CentralDifferences)
    gears = clamped_pair(pair, replace(density, edges=density.edges or ()), ElementQuad1())
    rotors = rotor(gears[0], scheme), rotor(gears[1], scheme)
    with shown(progress):
        records = integrate(loaded, MatingGears(pair, gears, wheel_share=1.0), rotors, scheme)
    scaled = sum((part.mass - gear.masses).sum() for part, gear in zip(rotors, gears, strict=True))
    added = float(scaled / sum(lumped_mass(gear.solid).sum() for gear in gears))
    result = loaded.result(*records[:, :3].T, method="central differences", added_mass=added)
    result["energy"] = ("time", "store"), records[:, 3:6], {"units": "J", "long_name": "energy"}
    result["work"] = ("time", "way"), records[:, 6:], {"units": "J", "long_name": "work"}
    return result.assign_coords(store=["kinetic", "strain", "contact"], way=["drive", "load", "damping", "slip"])


class Rotor(NamedTuple):
    """A gear as arrays: elements of a `Solid`, masses (n_dofs,) [kg], whether nodes are clamped to the hub, flanks."""

    dofs: np.ndarray
    gradients: np.ndarray
    weights: np.ndarray
    lame: tuple[float, float]
    positions: np.ndarray
    mass: np.ndarray
    held: np.ndarray
    flanks: FlankArrays


def rotor(gear: DeformableGear, scheme: CentralDifferences) -> Rotor:
    """Arrays of a gear with the mass that the step needs."""
    solid = gear.solid
    mass = np.maximum(gear.masses, scheme.step**2 / 4 * stiffness_bound(gear, scheme.penalty))
    elements = solid.dofs, solid.gradients, solid.weights, solid.lame
    return Rotor(*elements, solid.positions, mass, gear.held, flank_arrays(gear))


def stiffness_bound(gear: DeformableGear, penalty: float) -> np.ndarray:
    """(n_dofs,) sums of the norms of a node's blocks of the stiffness, and of contact (Gershgorin) [N/m]."""
    matrix = stiffness(gear.solid).tobsr((2, 2))
    bound = np.add.reduceat(np.sqrt((matrix.data**2).sum(axis=(1, 2))), matrix.indptr[:-1])
    return bound + contact_stiffness_bound(gear, penalty)


class Motion(NamedTuple):
    """State of the integration: displacements, velocities (n_dofs, 2) in the hubs' frames, transmission error, works.

    te          (2,) transmission error [m] and its rate [m/s]
    friction    (2, n_tooth, n_hat) friction under the hat functions of each slave tooth [Pa]
    work        (4,) works [J] at the indices DRIVE, LOAD, DAMPING, SLIP
    """

    u: tuple[np.ndarray, np.ndarray]
    v: tuple[np.ndarray, np.ndarray]
    te: np.ndarray
    friction: np.ndarray
    work: np.ndarray


class Drive(NamedTuple):
    """Kinematics and load.

    angles, angles_per_phase    angles of both frames at phase 0 [rad], and their change per phase
    a                           centre distance [m]
    ratio                       speed of the wheel over that of the pinion, < 0
    viscosity, damping          viscous load on the line of action [N s/m]; damping [1/s]
    """

    angles: tuple[float, float]
    angles_per_phase: tuple[float, float]
    a: float
    ratio: float
    viscosity: float
    damping: float


def drive_of(loaded: LoadedRun, mating: MatingGears) -> Drive:
    """Kinematics and load of a run."""
    pair, (pinion, wheel) = loaded.pair, mating.placements(0.0, 0.0)
    angles_per_phase = pair.p_bt / pair.pinion.r_b, -pair.p_bt / pair.wheel.r_b
    speeds = loaded.speed_ratio, loaded.viscosity, loaded.run.damping
    return Drive((pinion.rotation, wheel.rotation), angles_per_phase, pair.a, *speeds)


def at_rest(mating: MatingGears) -> Motion:
    """Undeformed gears without velocity."""
    pinion, wheel = mating.gears
    rest, velocity = ((pinion.undeformed(), wheel.undeformed()) for _ in range(2))
    hats = max(gear.flanks[0].arcs.size for gear in mating.gears)
    return Motion(rest, velocity, np.zeros(2), np.zeros((2, len(pinion.flanks), hats)), np.zeros(4))


def integrate(loaded: LoadedRun, mating: MatingGears, rotors, scheme: CentralDifferences) -> np.ndarray:
    """(n_time, 10) records: transmission error, phase, torque of the load, three energies, four works."""
    times, drive, motion = loaded.times, drive_of(loaded, mating), at_rest(mating)
    interval = times[1] - times[0]
    steps = int(np.ceil(interval / scheme.step))
    law = ContactLaw(scheme.penalty, scheme.friction, interval / steps)
    records = np.zeros((times.size, 10))
    records[0, 1] = loaded.run.start
    for i, t in enumerate(bar(times[:-1], "explicit"), start=1):
        hub = np.array([loaded.motion(t + step * law.step) for step in range(steps)])
        tooth_pairs = tooth_pair_table(mating, float(hub[steps // 2, 0]), motion.te[0])
        kinetic, contact = advance(rotors, motion, drive, law, hub, tooth_pairs)
        strain = sum(strain_energy(gear.solid, u) for gear, u in zip(mating.gears, motion.u, strict=True))
        phase, spin, _ = loaded.motion(times[i])
        torque = loaded.load_torque(spin, motion.te[1])
        records[i] = motion.te[0], phase, torque, kinetic, strain, contact, *motion.work
        if not np.isfinite(records[i]).all():
            raise RuntimeError(f"not stable at phase {phase:g}; reduce step {law.step:g} s or penalty {law.penalty:g}")
        loaded.check_backlash(motion.te[0], phase)
    return records


@fast
def advance(rotors, motion, drive, law, hub, tooth_pairs):
    """Integrate over phase, spin and acceleration of the pinion's hub (n, 3); kinetic and contact energy."""
    kinetic, contact = 0.0, 0.0
    forces = np.zeros_like(motion.u[0]), np.zeros_like(motion.u[1])
    for phase, spin, euler in hub:
        spins = (spin, drive.ratio * spin + motion.te[1] / rotors[1].flanks.r_b)
        for side in range(2):
            gear, force = rotors[side], forces[side]
            force[:] = 0.0
            add_plane_force(motion.u[side], gear.dofs, gear.gradients, gear.weights, gear.lame, force)
            force *= -1.0
        torques, contact = _add_contact(rotors, motion, drive, law, tooth_pairs, forces, (phase, spins))
        kinetic = _step(rotors, motion, drive, law.step, forces, torques, (spin, euler, spins[1]))
    return kinetic, contact


@compiled(fastmath=True)
def _add_contact(rotors, motion, drive, law, tooth_pairs, forces, hub):
    """Add contact forces; torques on both hubs and contact energy."""
    phase, spins = hub
    pinion_angle = drive.angles[0] + phase * drive.angles_per_phase[0]
    wheel_angle = drive.angles[1] + phase * drive.angles_per_phase[1] + motion.te[0] / rotors[1].flanks.r_b
    angles = (pinion_angle, wheel_angle)
    torques, energy = np.zeros(2), 0.0
    for row in tooth_pairs:
        tooth_pair = ToothPair(row[0], row[1], row[2], row[3], row[4])
        s, m = tooth_pair.slave, 1 - tooth_pair.slave
        distance = drive.a if s == 1 else -drive.a
        pose = RelativePose(distance * np.cos(angles[m]), -distance * np.sin(angles[m]), angles[s] - angles[m])
        slave = MovingGear(rotors[s].flanks, motion.u[s], motion.v[s], forces[s], spins[s])
        master = MovingGear(rotors[m].flanks, motion.u[m], motion.v[m], forces[m], spins[m])
        friction = motion.friction[s, tooth_pair.slave_tooth]
        on_slave, on_master, stored, lost_power = add_contact_forces(slave, master, tooth_pair, pose, law, friction)
        torques[s] += on_slave
        torques[m] += on_master
        energy += stored
        motion.work[SLIP] += lost_power * law.step
    return torques, energy


@compiled(fastmath=True)
def _step(rotors, motion, drive, step, forces, torques, hub):
    """Displacements, velocities and works after a step; kinetic energy half a step before."""
    spin, euler, wheel_spin = hub
    r_b = rotors[1].flanks.r_b
    node_torques, inertias, damping_torques = np.zeros(2), np.zeros(2), np.zeros(2)
    for side in range(2):
        relative_spin = side * motion.te[1] / r_b
        node_torques[side], inertias[side], damping_torques[side], power = _add_damping(
            rotors[side], motion.u[side], motion.v[side], forces[side], drive.damping, relative_spin
        )
        steady_spin = spin if side == 0 else drive.ratio * spin
        motion.work[DAMPING] += (power - damping_torques[side] * steady_spin) * step
    load = drive.viscosity * (spin * rotors[0].flanks.r_b - motion.te[1])
    wheel_euler = (torques[1] + damping_torques[1] - node_torques[1] + load * r_b) / inertias[1]
    drive_torque = inertias[0] * euler + node_torques[0] - torques[0] - damping_torques[0]
    motion.work[DRIVE] += drive_torque * spin * step
    motion.work[LOAD] -= load * r_b * wheel_spin * step
    kinetic = _move_nodes(rotors[0], motion.u[0], motion.v[0], forces[0], (spin, euler), step)
    kinetic += _move_nodes(rotors[1], motion.u[1], motion.v[1], forces[1], (wheel_spin, wheel_euler), step)
    motion.te[1] += step * (wheel_euler - drive.ratio * euler) * r_b
    motion.te[0] += step * motion.te[1]
    return kinetic


@compiled(fastmath=True)
def _add_damping(gear, u, v, force, damping, relative_spin):
    """Add damping to force; torque of the free nodes, inertia of the held ones, torque and power of the damping."""
    torque = inertia = damping_torque = power = 0.0
    for i in range(len(u)):
        x, y = gear.positions[i, 0] + u[i, 0], gear.positions[i, 1] + u[i, 1]
        wx, wy, c = v[i, 0] - relative_spin * y, v[i, 1] + relative_spin * x, damping * gear.mass[i]
        damping_torque -= c * (x * wy - y * wx)
        power += c * (wx * wx + wy * wy)
        force[i, 0] -= c * wx
        force[i, 1] -= c * wy
        if gear.held[i]:
            inertia += gear.mass[i] * (x * x + y * y)
        else:
            torque += x * force[i, 1] - y * force[i, 0]
    return torque, inertia, damping_torque, power


@compiled(fastmath=True)
def _move_nodes(gear, u, v, force, hub, step):
    """Central difference of the free nodes in the turning frame; kinetic energy."""
    spin, euler = hub
    kinetic = 0.0
    for i in range(len(u)):
        m, x, y = gear.mass[i], gear.positions[i, 0] + u[i, 0], gear.positions[i, 1] + u[i, 1]
        kinetic += m / 2 * ((v[i, 0] - spin * y) ** 2 + (v[i, 1] + spin * x) ** 2)
        if not gear.held[i]:
            ax = force[i, 0] / m + euler * y + 2 * spin * v[i, 1] + spin * spin * x
            ay = force[i, 1] / m - euler * x - 2 * spin * v[i, 0] + spin * spin * y
            v[i, 0] += step * ax
            v[i, 1] += step * ay
            u[i, 0] += step * v[i, 0]
            u[i, 1] += step * v[i, 1]
    return kinetic
