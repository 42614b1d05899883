"""Transmission error by explicit time integration of both gears: central differences, lumped mass, penalty contact.

Frames, hubs and load as in `fem.dynamic`. Nothing is solved, but the step must follow every wave through every element:
nodes that a wished step is too long for get the mass it takes (mass scaling), which slows the gears' own vibrations.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr
from skfem import ElementQuad1

from fem.elasticity.extruded_elasticity import lame_parameters
from fem.elasticity.mesh_density import Density
from fem.pair.pair import GearPair
from fem.reference.deformable_gear import Body, clamped_pair
from fem.reference.nonlinear import Meshing
from fem.reference.penalty_contact import Law, Side, Teeth, press, teeth_of
from fem.reference.st_venant_kirchhoff import add_plane_force, lumped_mass, stiffness, strain_energy
from fem.reference.time_integration import RunUp, check_play, checked_run, over_time
from fem.ste.ste_map import pair_attributes
from fem.support.arguments import checked
from fem.support.numba_cache import fast
from fem.support.progress import bar, shown
from fem.support.validation import as_floats, require, require_kind

__all__ = ["CentralDifferences", "transmission_error"]

#: Largest sum of stiffness by a penalty on a node over penalty and area: its own hats, or a mate's splines.
CROWDED = 3.0
DRIVE, LOAD, DAMPED, SLIPPED = range(4)


@dataclass(frozen=True)
class CentralDifferences:
    """How to integrate.

    step        time step [s]; nodes get the mass that it takes to be stable. Slow gears do not feel that; where they
                vibrate take a step so short that attrs["added_mass"] stays below some hundredths
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
    """What `fem.dynamic.transmission_error` gives, on linear quadrilaterals (plane strain), with an account of energy.

    torque      pinion torque F r_b1 at full speed [N m]
    run         run-up; its steps are those between two records, alpha has no meaning here
    density     of the FE mesh; without `edges` unless it has some: the step must follow every small element

    "energy": kinetic, strain and contact energy [J]; "work": done by the pinion's hub, taken by load, damping and slip
    [J]; damping, which acts against steady rotation, gives where the gears lag behind that. attrs["added_mass"]: mass
    scaling as share of the gears' mass.
    Raises ValueError for bad input, RuntimeError where the integration is not stable or the gears part beyond the
    backlash.
    """
    torque, run, density = checked_run(pair, torque, run, density, ElementQuad1())
    scheme = CentralDifferences() if scheme is None else scheme
    require_kind("scheme", scheme, CentralDifferences)
    bodies = clamped_pair(pair, replace(density, edges=density.edges or ()), ElementQuad1())
    gears = tuple(rotor(body, scheme) for body in bodies)
    times = run.times(2 * np.pi / pair.pinion.z)
    with shown(progress):
        records = integrated(pair, bodies, gears, torque / pair.pinion.r_b, times, (run, scheme))
    mass = sum(lumped_mass(body.solid).sum() for body in bodies)
    added = sum(float(gear.mass.sum()) for gear in gears) / mass - 1
    attributes = {**pair_attributes(pair), "torque": torque, "method": "central differences", "added_mass": added}
    return dataset(times, records, attributes)


def dataset(times: np.ndarray, records: np.ndarray, attributes: dict) -> xr.Dataset:
    """Labelled columns: transmission error, phase, torque, three energies, four works."""
    account = {
        "energy": (("time", "store"), records[:, 3:6], {"units": "J"}),
        "work": (("time", "way"), records[:, 6:], {"units": "J"}),
    }
    names = {"store": ["kinetic", "strain", "contact"], "way": ["drive", "load", "damping", "slip"]}
    return over_time(times, *records[:, :3].T).assign(account).assign_coords(names).assign_attrs(attributes)


class Rotor(NamedTuple):
    """A gear in arrays: elements of a `Solid`, masses (n_dofs,), whether the hub holds a node (n_dofs,)."""

    dofs: np.ndarray
    gradients: np.ndarray
    weights: np.ndarray
    lame: tuple[float, float]
    places: np.ndarray
    mass: np.ndarray
    held: np.ndarray
    teeth: Teeth


def rotor(body: Body, scheme: CentralDifferences) -> Rotor:
    """Arrays of a body with the mass that the step takes."""
    solid, held = body.solid, np.ones(body.solid.places.shape, bool)
    held.ravel()[body.free] = False
    mass = np.maximum(lumped_mass(solid), scheme.step**2 / 4 * stiffest(body, scheme.penalty))
    lame = lame_parameters(solid.material)
    return Rotor(solid.dofs, solid.gradients, solid.weights, lame, solid.places, mass, held[:, 0], teeth_of(body))


def stiffest(body: Body, penalty: float) -> np.ndarray:
    """(n_dofs,) bounds of the stiffness that a node's mass must bear, in any orientation (Gershgorin) [N/m]."""
    matrix = stiffness(body.solid).tobsr((2, 2))
    bound = np.add.reduceat(np.sqrt((matrix.data**2).sum(axis=(1, 2))), matrix.indptr[:-1])
    for flank in body.flanks.values():
        size = np.diff(flank.arcs)
        area = flank.gear.b * (np.append(size, 0) + np.append(0, size)) / 2
        bound[flank.nodes[:, 0]] += CROWDED * penalty * area
    return bound


def stable_step(body: Body, penalty: float) -> float:
    """Largest step without mass scaling [s], on the safe side."""
    return float(2 * np.sqrt(lumped_mass(body.solid) / stiffest(body, penalty)).min())


class State(NamedTuple):
    """Displacements and velocities (n_dofs, 2) in the hubs' frames; te and its rate; friction; works.

    stick       (2, n_tooth, n_hat) friction under the hats of a gear's tooth [Pa]
    """

    u: tuple[np.ndarray, np.ndarray]
    v: tuple[np.ndarray, np.ndarray]
    error: np.ndarray
    stick: np.ndarray
    work: np.ndarray


class Drive(NamedTuple):
    """What the gears run under.

    angles, per_phase   angles of both frames at phase 0 [rad], and per phase
    a                   centre distance [m]
    ratio               speed of the wheel over that of the pinion, < 0
    load, damping       viscous load on the line of action [N s/m]; damping [1/s]
    """

    angles: tuple[float, float]
    per_phase: tuple[float, float]
    a: float
    ratio: float
    load: float
    damping: float


def integrated(pair: GearPair, bodies, gears, force: float, times, options) -> np.ndarray:
    """(n_time, 10) records at times [s]: transmission error, phase, torque of the load, energies, works."""
    run, scheme = options
    pitch, meshing = 2 * np.pi / pair.pinion.z, Meshing(pair, bodies, (), (), lag=1.0)  # type: ignore[arg-type]
    load = force / (run.speed * pair.pinion.r_b)
    per_phase = pair.p_bt / pair.pinion.r_b, -pair.p_bt / pair.wheel.r_b
    angles = tuple(place.angle for place in meshing.places(0.0, 0.0))
    drive = Drive(angles, per_phase, pair.a, -pair.pinion.z / pair.wheel.z, load, run.damping)  # type: ignore[arg-type]
    between = int(np.ceil((times[1] - times[0]) / scheme.step))
    law = Law(scheme.penalty, scheme.friction, (times[1] - times[0]) / between)
    rest = [np.zeros_like(gear.places) for gear in gears * 2]
    hats, teeth = max(gear.teeth.arcs.size for gear in gears), len(bodies[0].flanks)
    state = State((rest[0], rest[1]), (rest[2], rest[3]), np.zeros(2), np.zeros((2, teeth, hats)), np.zeros(4))
    records = np.zeros((times.size, 10))
    records[0, 1] = run.start
    for i, t in enumerate(bar(times[:-1], "explicit"), start=1):
        motion = np.array([run.motion(t + k * law.step, pitch) for k in range(between)])
        touches = numbered(meshing, float(motion[between // 2, 0]), state.error[0])
        energies = advance(gears, state, drive, law, motion, touches)
        strain = sum(strain_energy(body.solid, u) for body, u in zip(bodies, state.u, strict=True))
        phase, spin, _ = run.motion(times[i], pitch)
        torque = load * (spin * pair.pinion.r_b - state.error[1]) * pair.pinion.r_b
        records[i] = state.error[0], phase, torque, energies[0], strain, energies[1], *state.work
        if not np.isfinite(records[i]).all():
            raise RuntimeError(f"not stable at phase {phase:g}; take a smaller step or penalty")
        check_play(pair, state.error[0], phase)
    return records


def numbered(meshing: Meshing, phase: float, te: float = 0.0) -> np.ndarray:
    """(n, 5) own gear, its tooth and the mate's among the flanks, first and last hat of all that may touch."""
    found = []
    for touch in meshing.touches(phase, te):
        own, chosen = touch.own, touch.sample.chosen
        teeth = [list(meshing.bodies[side].flanks).index(touch.teeth[side]) for side in (own, 1 - own)]
        found.append((own, *teeth, chosen[0], chosen[-1]))
    return np.array(found, dtype=np.int64).reshape(-1, 5)


@fast
def advance(gears, state, drive, law, motion, touches):
    """Steps through motion (n, 3): phase, spin, acceleration of the pinion's hub; kinetic and contact energy."""
    kinetic, contact = 0.0, 0.0
    first, second = np.zeros_like(state.u[0]), np.zeros_like(state.u[1])
    for phase, spin, euler in motion:
        first[:], second[:] = 0.0, 0.0
        forces = (first, second)
        spins = (spin, drive.ratio * spin + state.error[1] / gears[1].teeth.r_b)
        for side in range(2):
            gear = gears[side]
            add_plane_force(state.u[side], gear.dofs, gear.gradients, gear.weights, gear.lame, forces[side])
            forces[side][:] *= -1.0
        torques, contact = _touch(gears, state, drive, law, touches, forces, (phase, spins))
        kinetic = _move(gears, state, drive, law.step, forces, torques, (spin, euler, spins[1]))
    return kinetic, contact


@fast
def _touch(gears, state, drive, law, touches, forces, now):
    """Adds contact forces; torques on both hubs and contact energy."""
    phase, spins = now
    angles = (
        drive.angles[0] + phase * drive.per_phase[0],
        drive.angles[1] + phase * drive.per_phase[1] + state.error[0] / gears[1].teeth.r_b,
    )
    torques, energy = np.zeros(2), 0.0
    for touch in touches:
        own, mate = touch[0], 1 - touch[0]
        towards = drive.a if own == 1 else -drive.a
        place = (towards * np.cos(angles[mate]), -towards * np.sin(angles[mate]), angles[own] - angles[mate])
        one = Side(gears[own].teeth, state.u[own], state.v[own], forces[own], spins[own])
        other = Side(gears[mate].teeth, state.u[mate], state.v[mate], forces[mate], spins[mate])
        stick = state.stick[own, touch[1]]
        on_own, on_mate, stored, lost = press(one, other, touch, place, law, stick)
        torques[own] += on_own
        torques[mate] += on_mate
        energy += stored
        state.work[SLIPPED] += lost * law.step
    return torques, energy


@fast
def _move(gears, state, drive, step, forces, torques, spins):
    """Displacements, velocities and works after a step; kinetic energy half a step before."""
    spin, euler, spin_2 = spins
    r_b = gears[1].teeth.r_b
    balance, inertia, damped = np.zeros(2), np.zeros(2), np.zeros(2)
    for side in range(2):
        beyond = side * state.error[1] / r_b
        balance[side], inertia[side], damped[side], lost = _balance(
            gears[side], state.u[side], state.v[side], forces[side], drive.damping, beyond
        )
        steady = spin if side == 0 else drive.ratio * spin
        state.work[DAMPED] += (lost - damped[side] * steady) * step
    lag = drive.load * (spin * gears[0].teeth.r_b - state.error[1])
    euler_2 = (torques[1] + damped[1] - balance[1] + lag * r_b) / inertia[1]
    driving = inertia[0] * euler + balance[0] - torques[0] - damped[0]
    state.work[DRIVE] += driving * spin * step
    state.work[LOAD] -= lag * r_b * spin_2 * step
    kinetic = _accelerate(gears[0], state.u[0], state.v[0], forces[0], (spin, euler), step)
    kinetic += _accelerate(gears[1], state.u[1], state.v[1], forces[1], (spin_2, euler_2), step)
    state.error[1] += step * (euler_2 - drive.ratio * euler) * r_b
    state.error[0] += step * state.error[1]
    return kinetic


@fast
def _balance(gear, u, v, force, damping, beyond):
    """Adds damping to force; torque of the forces on free nodes, inertia of the hub, torque of damping, its power."""
    torque = inertia = damped = lost = 0.0
    for i in range(len(u)):
        x, y = gear.places[i, 0] + u[i, 0], gear.places[i, 1] + u[i, 1]
        wx, wy, c = v[i, 0] - beyond * y, v[i, 1] + beyond * x, damping * gear.mass[i]
        damped -= c * (x * wy - y * wx)
        lost += c * (wx * wx + wy * wy)
        force[i, 0] -= c * wx
        force[i, 1] -= c * wy
        if gear.held[i]:
            inertia += gear.mass[i] * (x * x + y * y)
        else:
            torque += x * force[i, 1] - y * force[i, 0]
    return torque, inertia, damped, lost


@fast
def _accelerate(gear, u, v, force, turn, step):
    """Central difference of the free nodes in the frame that turns; kinetic energy."""
    spin, euler = turn
    kinetic = 0.0
    for i in range(len(u)):
        m, x, y = gear.mass[i], gear.places[i, 0] + u[i, 0], gear.places[i, 1] + u[i, 1]
        kinetic += m / 2 * ((v[i, 0] - spin * y) ** 2 + (v[i, 1] + spin * x) ** 2)
        if not gear.held[i]:
            ax = force[i, 0] / m + euler * y + 2 * spin * v[i, 1] + spin * spin * x
            ay = force[i, 1] / m - euler * x - 2 * spin * v[i, 0] + spin * spin * y
            v[i, 0] += step * ax
            v[i, 1] += step * ay
            u[i, 0] += step * v[i, 0]
            u[i, 1] += step * v[i, 1]
    return kinetic
