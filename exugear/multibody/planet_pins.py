"""Planets on elastic pins: bodies tied to a point and an axis of their carrier, whose turns they follow.

The pin stands at rho from the carrier's centre, points along n, and both turn with the carrier. With the planet's
centre p and axis z, d = p - c - rho is its deflection and z_n = z - (z . n) n its tilt; d_n = (d . n) n is axial,
d_r = d - d_n radial. The bearing is the same in all directions about n and has the energy

    U = k_r d_r^2 / 2 + k_a d_n^2 / 2 + k_t z_n^2 / 2 + k_c d_r . z_n,

about the planet's centre of mass. The damper acts by the rates in the carrier's frame, w = (p - c)' - omega x (p - c)
and u = z' - omega x z, so that a deflection that turns with the carrier dissipates nothing. Forces follow by virtual
work, and their moments balance. In the plane z and n do not move, and d_r is all that is left.

A rolling bearing has the energy of its law instead, of d and z by their components along the pin's radius e, across it
f and along it n: U(d.e, d.f, d.n, -z.f, z.e). These do not change as all turns with the carrier, so that its moments
balance likewise.

Velocities v of the integrator exceed the true ones by their second derivative times its lag, of an orbit by
-omega^2 lag v: the damper takes (1 + lag omega^2) v. Without that it would brake the orbit.

The pin turns away from its direction in the kept matrix of Newton's iteration: the first call of a step takes its
forces at the expected end of the step (`exugear.multibody.step_ends`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import cos, sin
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from exugear.contact.rotation import RXYZ, angular_velocity, by_angles, moments, times, transposed
from exugear.contact.vectors import cross, dot, scaled, total
from exugear.gearbox.bearing import Bearing, is_isotropic
from exugear.gearbox.bearing_law import potential, tangent_stiffness
from exugear.gearbox.elastic_carrier import SeriesPin
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.kernel_records import record_type
from exugear.multibody.addresses import address_of, reader
from exugear.multibody.direct_call import direct
from exugear.multibody.imposed_motion import spin_of
from exugear.multibody.recorder import BodyRecorder, header_at, sample_of, store
from exugear.multibody.rolling_bearings import law_at
from exugear.multibody.step_ends import StepEnds, at_step_end, for_newton, keep_step_ends
from exugear.rolling_bearings.law import LawRecord, reaction
from fem.support.numba_cache import compiled, kept
from fem.support.validation import require

#: Of the pin on its carrier: position [m], and axes (rows) along its radius, across it and along the pin, on the body
#: of the carrier; vector from the carrier's to the planet's centre in the reference configuration [m]; tilts of both
#: there [rad]. Radial, axial, tilting and coupling stiffness [N/m, N/m, N m/rad, N/rad] and damping, as often times s.
#: Of the carrier: a constant torque about z that acts beside the pin [N m]; inertia that the pin itself accelerates as
#: imposed [kg m^2]; address of the imposed motion (`exugear.multibody.imposed_motion`), 0 without. lag: of the
#: velocities of the integrator [s^2] (`exugear.multibody.velocity_lag`).
#: Addresses of the law of a rolling bearing (`exugear.rolling_bearings.law`), 0 of a linear bearing, and of
#: `STEP_ENDS`.
PIN = record_type(
    *(("position", "f8", 3), ("axes", "f8", (3, 3)), ("between", "f8", 3)),
    *(("carrier_tilts", "f8", 2), ("planet_tilts", "f8", 2), ("stiffness", "f8", 4), ("damping", "f8", 4)),
    *(("torque", "f8"), ("inertia", "f8"), ("imposed", "i8"), ("lag", "f8"), ("law", "i8"), ("ends", "i8")),
)
pin_at = reader(PIN)
#: Deflection along and across the pin's radius, along the pin, and tilts about the first two, in the carrier's frame
#: [m, rad]; displacement and tilts of the carrier [m, rad].
DEFLECTION = "radial", "tangential", "axial", "tilt_radial", "tilt_tangential"
CENTRE = "x", "y", "z", "tilt_x", "tilt_y"
#: Spin [rad] and speed [rad/s] of the carrier, torque of the pin on that spin [N m].
CARRIER_NAMES = "spin", "speed", "torque"
#: Rates have this behind the name; velocities of the planet against the ground this before it.
RATE, PLANET = "_rate", "planet_"


def names_of_samples(components: int) -> tuple[str, ...]:
    """Names of what is recorded of a pin, in order; components: 2 of a planet in the plane, 5 of a planet in space."""
    deflection, centre = DEFLECTION[:components], CENTRE[:components]
    rates = [f"{name}{RATE}" for name in (*deflection, *centre)]
    velocities = [f"{PLANET}{name}{RATE}" for name in centre]
    tilt = [f"{PLANET}tilt_y"] * (components > 2)
    return (*deflection, *rates[:components], *CARRIER_NAMES, *centre, *rates[components:], *velocities, *tilt)


class PinRecorder(BodyRecorder):
    """Samples of a pin, and the motions of planet and carrier in them."""

    @cached_property
    def components(self) -> int:
        """Of the motion: 2 in the plane, 5 in space."""
        return sum(name in DEFLECTION for name in self.names)

    def deflection(self, number: int, rate: bool = False) -> np.ndarray:
        """(number, components) first samples of the planet's deflection from its pin, or of its rates.

        Both as the carrier sees them, along and across the pin's radius and along the pin.
        """
        return self._columns(DEFLECTION, "", RATE * rate, number)

    def centre(self, number: int, rate: bool = False) -> np.ndarray:
        """(number, components) first samples of the carrier's displacement and tilts, or of their rates."""
        return self._columns(CENTRE, "", RATE * rate, number)

    def velocity(self, number: int) -> np.ndarray:
        """(number, components) first samples of the planet's rates against the ground."""
        return self._columns(CENTRE, PLANET, RATE, number)

    def _columns(self, names, before: str, behind: str, number: int) -> np.ndarray:
        names = [f"{before}{name}{behind}" for name in names[: self.components]]
        return np.column_stack([self.samples[name][:number] for name in names])


@dataclass(frozen=True, eq=False)
class Pin:
    """The pin of a planet in a built system.

    planet, carrier   their shafts
    position          (3,) of the planet from the carrier's centre in the reference configuration [m]
    stiffness         (6, 6) of its bearings about the planet's centre of mass
    record            `PIN`, which a run changes
    recorder          samples
    law               of a rolling bearing, to which the record points; else None
    """

    planet: Shaft
    carrier: Shaft
    position: np.ndarray
    stiffness: np.ndarray
    record: np.record
    recorder: PinRecorder
    law: LawRecord | None = None

    @property
    def bearing(self) -> Bearing | RollingBearing:
        """The bearing of the planet on the pin."""
        return next(iter(self.planet.bearings.values()))

    @property
    def lever(self) -> float:
        """Axial distance of a rolling bearing from the planet's centre of mass [m]."""
        return next(iter(self.planet.bearings)) - self.planet.centre

    @cached_property
    def linear_matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """(5, 5) stiffness and damping of a linear bearing over the motion of the planet against its pin."""
        return _about_centre(*self.record.stiffness), _about_centre(*self.record.damping)

    @cached_property
    def arm(self) -> np.ndarray:
        """(2 or 5,) position [m] and tilts [rad] of the planet's centre against the carrier's, as the planet moves."""
        tilts = self.record.planet_tilts - self.record.carrier_tilts
        return np.r_[self.position, tilts][: self.recorder.components]

    @property
    def orbit(self) -> np.ndarray:
        """(2 or 5,) displacement and tilts of the planet's centre per small angle of the carrier [m/rad]."""
        x, y, z = np.cross(self.carrier.offset.axis, self.position)
        a, b = self.record.planet_tilts - self.record.carrier_tilts
        return np.array([x, y, z, -b, a])[: self.recorder.components]


def pin_of(planet: Shaft, carrier: Shaft, poses, components: int, series: SeriesPin | None = None) -> Pin:
    """The pin of a planet; ValueError for bearings that are not the same in all directions.

    poses        reference coordinates (6) of planet and carrier
    components   of the planet's motion beside its spin: 2 or 5
    series       of its linear bearing and a carrier that yields
    """
    stiffness, damping, law = np.zeros((6, 6)), np.zeros((6, 6)), None
    for axial, bearing in planet.bearings.items():
        k = bearing.at(axial - planet.centre)
        k, d = series.at(axial - planet.centre) if series else (k, bearing.damping_time * k)
        stiffness, damping = stiffness + k, damping + d
        law = bearing.record_of_runs(axial - planet.centre) if isinstance(bearing, RollingBearing) else law
    linear = law is not None or all(bearing.linear for bearing in planet.bearings.values())
    turning = f"the pin of {planet.name!r} turns with the carrier: its bearing must be linear and the same in all"
    remedy = "directions; pass Bearing(radial=..., axial=..., tilt=...) or a RollingBearing"
    require(linear and is_isotropic(stiffness), f"{turning} {remedy}")
    on_planet, on_carrier = np.asarray(poses, float)
    between, record = on_planet[:3] - on_carrier[:3], np.zeros(1, PIN)[0]
    into = np.transpose(by_angles((*on_carrier[3:5], 0.0, 0.0)))
    axis = into @ np.array(by_angles((*on_planet[3:5], 0.0, 0.0)))[:, 2]
    record.position = into @ between
    radius = record.position - (record.position @ axis) * axis
    radius /= np.linalg.norm(radius)
    record.axes, record.between = [radius, np.cross(axis, radius), axis], between
    record.planet_tilts, record.carrier_tilts = on_planet[3:5], on_carrier[3:5]
    record.law = address_of(law.record if law else None)
    record.stiffness, record.damping = ([k[0, 0], k[2, 2], k[3, 3], k[0, 4]] for k in (stiffness, damping))
    return Pin(planet, carrier, between, stiffness, record, PinRecorder(names_of_samples(components)), law)


@compiled
def pin_forces(pin, t, recorder, carrier, planet):
    """Forces (3) on the carrier and (3) on the planet in the plane; coordinates (3) and their rates (3) of each."""
    (c_x, c_y, angle), (vc_x, vc_y, omega) = carrier
    spin = spin_of(pin.imposed, t, angle, omega)
    angle, omega = spin.angle, spin.speed
    (p_x, p_y, _), (vp_x, vp_y, _) = planet
    s, c, x, y = sin(angle), cos(angle), pin.position[0], pin.position[1]
    rho_x, rho_y = c * x - s * y, s * x + c * y
    d_x, d_y = p_x - c_x + (x - rho_x), p_y - c_y + (y - rho_y)
    arm_x, arm_y = rho_x + d_x, rho_y + d_y
    true = 1.0 + pin.lag * omega * omega
    w_x, w_y = true * (vp_x - vc_x) + omega * arm_y, true * (vp_y - vc_y) - omega * arm_x
    e_x, e_y = pin.stiffness[0] * d_x, pin.stiffness[0] * d_y
    f_x, f_y = pin.damping[0] * w_x, pin.damping[0] * w_y
    torque = rho_x * e_y - rho_y * e_x + arm_x * f_y - arm_y * f_x
    k = sample_of(recorder, t)
    if k >= 0:
        r = (x * x + y * y) ** 0.5
        u_x, u_y = rho_x / r, rho_y / r
        deflections = d_x * u_x + d_y * u_y, d_y * u_x - d_x * u_y
        rates = w_x * u_x + w_y * u_y, w_y * u_x - w_x * u_y
        motion = angle, omega, torque, c_x, c_y, vc_x, vc_y, vp_x, vp_y
        store(header_at(recorder).samples, k, (*deflections, *rates, *motion))
    on_spin = torque + pin.torque if pin.imposed == 0 else pin.inertia * spin.acceleration
    return (e_x + f_x, e_y + f_y, on_spin), (-e_x - f_x, -e_y - f_y, 0.0)


@compiled
def vector_of(row):
    """A row (3) of a record as vector."""
    return row[0], row[1], row[2]


@compiled
def less(a, b):
    """a - b of vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def bearing_reaction(k, d, z, n):
    """(dU/dd, dU/dz) of the pin's energy with the stiffnesses k (4); also their dissipative likes for rates d and z.

    The part of dU/dz along n, which exerts no moment, is left out.
    """
    axial, z_along = dot(d, n), dot(z, n)
    d_r, z_n = less(d, scaled(axial, n)), less(z, scaled(z_along, n))
    force = total(total(scaled(k[0], d_r), scaled(k[1] * axial, n)), scaled(k[3], z_n))
    return force, total(scaled(k[2], z_n), scaled(k[3], d_r))


@compiled
def attitude_of(tilts, x, v, spin, speed):
    """Angles (4) of an Rxyz body with reference tilts and coordinates x, its matrix and its angular velocity."""
    p = tilts[0] + x[3], tilts[1] + x[4], spin, 0.0
    matrix = by_angles(p)
    return p, matrix, angular_velocity(RXYZ, p, matrix, (v[3], v[4], speed, 0.0))


@compiled
def pin_forces_in_space(pin, t, recorder, carrier, planet):
    """Forces (6) on the carrier and (6) on the planet in space; coordinates (6) and their rates (6) of each."""
    (q_c, v_c), (q_p, v_p) = carrier, planet
    spin = spin_of(pin.imposed, t, q_c[5], v_c[5])
    angles_c, attitude, omega = attitude_of(pin.carrier_tilts, q_c, v_c, spin.angle, spin.speed)
    angles_p, of_planet, omega_p = attitude_of(pin.planet_tilts, q_p, v_p, 0.0, 0.0)
    z = transposed(of_planet)[2]
    rho, n = times(attitude, vector_of(pin.position)), times(attitude, vector_of(pin.axes[2]))
    arm = total(vector_of(pin.between), less(vector_of(q_p), vector_of(q_c)))
    d, turning = less(arm, rho), less(omega_p, omega)
    true = 1.0 + pin.lag * dot(omega, omega)
    w = less(scaled(true, less(vector_of(v_p), vector_of(v_c))), cross(omega, arm))
    u = cross(turning, z)
    along, across = times(attitude, vector_of(pin.axes[0])), times(attitude, vector_of(pin.axes[1]))
    deflections = dot(d, along), dot(d, across), dot(d, n), -dot(z, across), dot(z, along)
    rates = dot(w, along), dot(w, across), dot(w, n), -dot(u, across), dot(u, along)
    if pin.law == 0:
        force, tilting = bearing_reaction(pin.stiffness, d, z, n)
        drag, braking = bearing_reaction(pin.damping, w, u, n)
        pushed, turned = total(force, drag), total(tilting, braking)
    else:
        f_r, f_t, f_n, m_r, m_t, _ = reaction(law_at(pin.law), deflections, rates, 0.0)
        pushed = scaled(-1.0, total(total(scaled(f_r, along), scaled(f_t, across)), scaled(f_n, n)))
        turned = total(scaled(m_r, across), scaled(-m_t, along))
    on_planet = scaled(-1.0, cross(z, turned))
    # The elastic moment on the carrier is rho x force - n x dU/dn, which equals arm x force + z x tilting.
    on_carrier = total(cross(arm, pushed), cross(z, turned))
    a_c, b_c, torque, _ = moments(RXYZ, angles_c, attitude, on_carrier)
    a_p, b_p, _, _ = moments(RXYZ, angles_p, of_planet, on_planet)
    k = sample_of(recorder, t)
    if k >= 0:
        centre = q_c[0], q_c[1], q_c[2], q_c[3], q_c[4], v_c[0], v_c[1], v_c[2], v_c[3], v_c[4]
        velocity = v_p[0], v_p[1], v_p[2], v_p[3], v_p[4], angles_p[1]
        motion = spin.angle, spin.speed, torque
        store(header_at(recorder).samples, k, (*deflections, *rates, *motion, *centre, *velocity))
    on_spin = torque + pin.torque if pin.imposed == 0 else pin.inertia * spin.acceleration
    return (*pushed, a_c, b_c, on_spin), (-pushed[0], -pushed[1], -pushed[2], a_p, b_p, 0.0)


@cache
def pin_kernel(n: int, m: int):
    """The function (record, recorder, t, *coordinates, *velocities) -> forces on a carrier and a planet.

    The first two are addresses: of a `PIN` and of a recorder's header.

    n, m   numbers of coordinates of the carrier, 1 or m, and of the planet, 3 in the plane and 6 in space
    """

    @kept
    def planet_pin(record, recorder, t, *x):
        pin, v = pin_at(record), n + m
        x = at_step_end(pin.ends, t, x)
        if m == 3:
            planet = (x[n], x[n + 1], x[n + 2]), (x[v + n], x[v + n + 1], x[v + n + 2])
            if n == 1:
                on_carrier, on_planet = pin_forces(pin, t, recorder, ((0.0, 0.0, x[0]), (0.0, 0.0, x[v])), planet)
                return for_newton(pin.ends, (on_carrier[2], *on_planet))
            on_carrier, on_planet = pin_forces(
                pin, t, recorder, ((x[0], x[1], x[2]), (x[v], x[v + 1], x[v + 2])), planet
            )
            return for_newton(pin.ends, on_carrier + on_planet)
        q_p = x[n], x[n + 1], x[n + 2], x[n + 3], x[n + 4], x[n + 5]
        v_p = x[v + n], x[v + n + 1], x[v + n + 2], x[v + n + 3], x[v + n + 4], x[v + n + 5]
        if n == 1:
            turn, speed = (0.0, 0.0, 0.0, 0.0, 0.0, x[0]), (0.0, 0.0, 0.0, 0.0, 0.0, x[v])
            on_carrier, on_planet = pin_forces_in_space(pin, t, recorder, (turn, speed), (q_p, v_p))
            return for_newton(pin.ends, (on_carrier[5], *on_planet))
        q_c, v_c = (x[0], x[1], x[2], x[3], x[4], x[5]), (x[v], x[v + 1], x[v + 2], x[v + 3], x[v + 4], x[v + 5])
        on_carrier, on_planet = pin_forces_in_space(pin, t, recorder, (q_c, v_c), (q_p, v_p))
        return for_newton(pin.ends, on_carrier + on_planet)

    return planet_pin


def pin_matrices(pin: Pin, q: Sequence[float], n: int, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """(n + m, n + m) stiffness and damping between the n coordinates of a carrier and the m of a planet.

    q       coordinates (n + m) of both
    angle   of the carrier [rad]

    First order in tilts, without the change of the direction in which the force of the pin acts. A turn of the carrier
    with which the planet orbits strains nothing. Rolling bearings have their tangent.
    """
    slopes = _slopes(pin, q, n)
    stiffness, damping = (_between(pin, slopes, matrix) for matrix in _matrices_of_motion(pin, q, n, angle))
    return stiffness, damping


def newton_matrix(pin: Pin, q: Sequence[float], n: int, angle: float, factors: tuple[float, float]) -> np.ndarray:
    """(n + m, n + m) sum of the `pin_matrices` times these factors, for the matrix of Newton's iteration."""
    stiffness, damping = _matrices_of_motion(pin, q, n, angle)
    return _between(pin, _slopes(pin, q, n), factors[0] * stiffness + factors[1] * damping)


def _matrices_of_motion(pin: Pin, q: Sequence[float], n: int, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """(5, 5) stiffness and damping over the motion of the planet against its pin; arguments as of `pin_matrices`."""
    if pin.law is None:
        return pin.linear_matrices
    tangent = pin_tangent(pin, q, n, angle)
    return tangent, pin.bearing.damping_time * tangent


def steepest_matrix(pin: Pin, q: Sequence[float], n: int) -> np.ndarray:
    """(n + m, n + m) what the steepest stiffness of a rolling bearing adds to its tangent; arguments as above."""
    return _between(pin, _slopes(pin, q, n), pin.stiffness[:5, :5] - pin_tangent(pin, q, n, float(q[n - 1])))


def pin_potential(pin: Pin, q: np.ndarray, n: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Energy [J], gradient (n + m,) and Hessian of a rolling bearing, first order about the reference configuration.

    q   coordinates (n + m) of carrier and planet in space
    """
    slopes = _along_pin(pin, 0.0) @ _slopes(pin, np.zeros(len(q)), n)
    energy, gradient, hessian = potential(pin.bearing, pin.lever, slopes @ q)
    return energy, slopes.T @ gradient, slopes.T @ hessian @ slopes


def _between(pin: Pin, slopes: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(n + m, n + m) matrix between carrier and planet of that (5, 5) over the motion of the planet against its pin."""
    rows = slice(0, pin.recorder.components)
    return slopes.T @ matrix[rows, rows] @ slopes


def _slopes(pin: Pin, q: Sequence[float] | np.ndarray, n: int) -> np.ndarray:
    """(2 or 5, n + m) motion of the planet against its pin, along the global axes, by the coordinates q (n + m)."""
    components = pin.recorder.components
    arm = pin.arm + np.asarray(q[n : n + components])
    slopes = np.zeros((components, n + components + 1))
    slopes[:, n : n + components] = np.eye(components)
    if n > 1:
        arm -= np.asarray(q[:components])
        slopes[:, :components] = -np.eye(components)
    if components == 2:
        slopes[:, n - 1] = arm[1], -arm[0]
        return slopes
    x, y, z, a, b = arm
    if n > 1:
        slopes[:3, 3:5] = [[0.0, -z], [z, 0.0], [-y, x]]
    slopes[:, n - 1] = y, -x, 0.0, b, -a
    return slopes


def _along_pin(pin: Pin, angle: float) -> np.ndarray:
    """(5, 5) displacement and tilts along the axes of a pin by the global ones, at an angle of the carrier [rad]."""
    axes, turn = np.array(by_angles((*pin.record.carrier_tilts, angle, 0.0))) @ pin.record.axes.T, np.zeros((5, 5))
    turn[:3, :3], turn[3:, 3:] = axes.T, axes[:2, :2].T
    return turn


def pin_tangent(pin: Pin, q: Sequence[float], n: int, angle: float) -> np.ndarray:
    """(5, 5) tangent stiffness of a rolling bearing over the motion of a planet in space, along the global axes.

    q       coordinates of its carrier (n) and of the planet (6)
    angle   of the carrier [rad]
    """
    record = pin.record
    on_carrier, on_planet = (np.zeros(6) if n == 1 else np.asarray(q[:6])), np.asarray(q[n : n + 6])
    tilts_c, tilts_p = record.carrier_tilts + on_carrier[3:5], record.planet_tilts + on_planet[3:5]
    attitude = np.array(by_angles((*tilts_c, angle, 0.0)))
    axes = attitude @ record.axes.T
    d = record.between + on_planet[:3] - on_carrier[:3] - attitude @ record.position
    z = np.array(by_angles((*tilts_p, 0.0, 0.0)))[:, 2]
    turn = _along_pin(pin, angle)
    deflection = np.r_[d @ axes, -z @ axes[:, 1], z @ axes[:, 0], 0.0]
    return turn.T @ tangent_stiffness(pin.bearing, pin.lever, deflection)[:5, :5] @ turn


def _about_centre(radial: float, axial: float, tilt: float, coupling: float) -> np.ndarray:
    """(5, 5) matrix over displacements and tilts of a bearing that is the same in all directions."""
    matrix = np.diag([radial, radial, axial, tilt, tilt])
    matrix[0, 4] = matrix[4, 0] = coupling
    matrix[1, 3] = matrix[3, 1] = -coupling
    return matrix


def add_pin(mbs, nodes: tuple[Any, Any], pin: Pin) -> int:
    """Add a pin between the nodes of its carrier and of its planet; returns the number of the object."""
    n, m = (len(mbs.GetNode(node)["referenceCoordinates"]) for node in nodes)
    kernel, addresses = pin_kernel(n, m), (address_of(pin.record), address_of(pin.recorder.header))

    def planet_pin(mbs, t, item, q, q_t):
        return kernel(*addresses, t, *q, *q_t)

    def share_of(t, q, q_t, factors):
        imposed, angle = int(pin.record["imposed"]), q[n - 1]
        if imposed and pin.law is not None:
            angle = spin_of(imposed, t, angle, 0.0).angle
        matrix = newton_matrix(pin, q, n, angle, factors)
        if imposed:
            matrix[n - 1], matrix[:, n - 1] = 0.0, 0.0
        return matrix

    def pin_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        return ends.matrix_for_newton(t, q, q_t, (factor, factor_t))

    ends = StepEnds(n + m, share_of)
    pin.record.ends = ends.address
    keep_step_ends(mbs, [ends])
    function = direct(planet_pin, kernel, (pin.record, pin.recorder.header), n + m, pointed_to=(pin.recorder, ends))
    item: Any = eii.ObjectGenericODE2(
        name=f"{pin.planet.name} pin",
        nodeNumbers=list(nodes),
        forceUserFunction=function,
        jacobianUserFunction=pin_jacobian,
    )
    item.visualization["show"] = False
    ends.item = mbs.AddObject(item)
    return ends.item
