"""Energy stored in a gearbox: kinetic, in bearings, in couplings; that of the meshes is recorded."""

from collections.abc import Mapping

import numpy as np

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.bearing_stiffness import linear_part, radial_table
from exugear.gearbox.shaft import Rotor, Shaft
from exugear.multibody.model import Model
from exugear.running.recorded_motion import ShaftMotion


def kinetic_energy(model: Model, motions: Mapping[str, ShaftMotion]) -> np.ndarray:
    """(n,) kinetic energy of all shafts and rotors [J].

    An Rxyz body turns about its axis by the rate of its spin plus that of the first tilt times the sine of the second.
    """
    return np.sum([_of_shaft(shaft, motions) for shaft in model.gearbox.shafts], axis=0)


def _of_shaft(shaft: Shaft, motions: Mapping[str, ShaftMotion]) -> np.ndarray:
    motion = motions[shaft.name]
    energy, about_axis = np.zeros(motion.speed.size), motion.speed
    if motion.q is not None and motion.q_t is not None:
        x, y, z, a_t, b_t = motion.q_t.T
        b = shaft.offset.tilt_y + motion.q[:, 4]
        about_axis = about_axis + a_t * np.sin(b)
        energy = shaft.mass * (x**2 + y**2 + z**2) + shaft.transverse * ((a_t * np.cos(b)) ** 2 + b_t**2)
    for rotor in shaft.rotors:
        energy = energy + rotor.coupling.inertia * motions[rotor.name].speed ** 2
    return 0.5 * (energy + shaft.inertia * about_axis**2)


def couplings_of(model: Model) -> dict[str, Rotor]:
    """The rotors behind all couplings, by the name of the shaft where it has a single one, else by their own."""
    return {
        shaft.name if len(shaft.rotors) == 1 else rotor.name: rotor
        for shaft in model.gearbox.shafts
        for rotor in shaft.rotors
    }


def coupling_twists(model: Model, motions: Mapping[str, ShaftMotion]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Twists (n,) [rad] of couplings and their rates (n,) [rad/s], named as in `couplings_of`."""
    ends = {name: (motions[rotor.name], motions[rotor.body]) for name, rotor in couplings_of(model).items()}
    return {name: (rotor.spin - body.spin, rotor.speed - body.speed) for name, (rotor, body) in ends.items()}


def coupling_energy(model: Model, motions: Mapping[str, ShaftMotion]) -> np.ndarray:
    """(n,) energy of all couplings [J]."""
    torsion = {name: rotor.coupling.torsion for name, rotor in couplings_of(model).items()}
    twists = coupling_twists(model, motions)
    return np.sum([0.5 * torsion[name] * twist**2 for name, (twist, _) in twists.items()], axis=0)


def bearing_energy(shaft: Shaft, motion: ShaftMotion) -> np.ndarray:
    """(n,) energy of all bearings of a shaft [J]; 0 for a shaft that only spins."""
    if motion.q is None:
        return np.zeros(motion.spin.size)
    energy = np.zeros(motion.spin.size)
    for axial, bearing in shaft.bearings.items():
        stiffness = linear_part(bearing, axial - shaft.centre)[:5, :5]
        energy += 0.5 * np.einsum("ni,ij,nj->n", motion.q, stiffness, motion.q)
        if not bearing.linear:
            energy += _radial_energy(bearing, *radial_motion(motion.q, axial - shaft.centre).T)
    return energy


def radial_motion(q: np.ndarray, lever: float) -> np.ndarray:
    """(n, 2) motion in a bearing at an axial distance from the centre of mass [m], of displacements or rates (n, 5)."""
    return np.stack([q[:, 0] + lever * q[:, 4], q[:, 1] - lever * q[:, 3]], axis=-1)


def _radial_energy(bearing: Bearing, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Work of the radial force of a nonlinear bearing, linear between the points of its table."""
    radii, forces = radial_table(bearing)
    r = np.hypot(x, y)
    i = np.clip(np.searchsorted(radii, r) - 1, 0, radii.size - 2)
    work = np.r_[0.0, np.cumsum(np.diff(radii) * (forces[1:] + forces[:-1]) / 2)]
    step, slope = r - radii[i], np.diff(forces)[i] / np.diff(radii)[i]
    return work[i] + step * (forces[i] + 0.5 * slope * step)
