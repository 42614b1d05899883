"""Planets on elastic pins: bodies that move in the plane, each tied to a point of its carrier, whose turns they follow.

The pin stands at rho from the carrier's centre c and turns with it: d = p - c - R(theta) rho is its deflection, p the
planet's centre. The spring has the energy k d^2 / 2; the damper acts by the rate in the carrier's frame,
w = d' - theta' J d with J = [[0, -1], [1, 0]], so that a deflection that turns with the carrier dissipates nothing.
Forces follow by virtual work, and their moments balance.
"""

from dataclasses import dataclass, field
from functools import cache
from math import cos, sin
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from exugear.contact.recorder import HEADER, SAME, header_at, sample_of, store
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.kernel_records import address_of, reader, record_type
from exugear.multibody.direct_call import direct
from exugear.multibody.imposed_motion import spin_of
from fem.support.numba_cache import compiled, kept
from fem.support.validation import require

#: Position of the pin on its carrier [m], stiffness [N/m] and damping [N s/m]. Of the carrier: a constant torque about
#: z that acts beside the pin [N m]; inertia that the pin itself accelerates as imposed [kg m^2]; address of the imposed
#: motion (`exugear.multibody.imposed_motion`), 0 without.
PIN = record_type(
    *((name, "f8") for name in ("x", "y", "stiffness", "damping", "torque", "inertia")),
    ("imposed", "i8"),
)
pin_at = reader(PIN)
#: Along and across the pin's radius, in the carrier's frame: deflection [m], its rate [m/s]; spin [rad] and speed
#: [rad/s] of the carrier. Displacement [m] and velocity [m/s] of the carrier's centre along x and y.
PIN_NAMES = "radial", "tangential", "radial_rate", "tangential_rate", "spin", "speed"
CENTRE_NAMES = "x", "y", "v_x", "v_y"
#: Relative difference of stiffnesses that is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class PinRecorder:
    """Samples of a pin at t = 0, interval, ..., as `exugear.Recorder` samples a contact."""

    header: np.record = field(default_factory=lambda: np.zeros(1, HEADER)[0], init=False, repr=False)
    samples: dict[str, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    def start(self, interval: float, number: int, *, steps: int, first: int = 0) -> None:
        """Allocate a number of samples, 0 until written; arguments as those of `exugear.Recorder.start`."""
        self.samples.update({name: np.zeros(number) for name in (*PIN_NAMES, *CENTRE_NAMES)})
        self.header.interval, self.header.tolerance = interval, SAME / steps
        self.header.number, self.header.first = number, first
        self.header.samples[: len(PIN_NAMES)] = [self.samples[name].ctypes.data for name in PIN_NAMES]
        self.header.powers[: len(CENTRE_NAMES)] = [self.samples[name].ctypes.data for name in CENTRE_NAMES]

    def columns(self, *names: str, number: int) -> np.ndarray:
        """(number, n_name) first samples of quantities."""
        return np.column_stack([self.samples[name][:number] for name in names])


@dataclass(frozen=True, eq=False)
class Pin:
    """The pin of a planet in a built system.

    planet, carrier   their shafts
    position          (2,) of the pin from the carrier's centre in the reference configuration [m]
    bearing           of the pin
    record            `PIN`, which a run changes
    recorder          samples
    """

    planet: Shaft
    carrier: Shaft
    position: np.ndarray
    bearing: Bearing
    record: np.record
    recorder: PinRecorder

    @property
    def orbit(self) -> np.ndarray:
        """(2,) displacement of the planet's centre per small angle of the carrier [m/rad]."""
        return np.array([-self.position[1], self.position[0]])


def pin_of(planet: Shaft, carrier: Shaft, position: np.ndarray) -> Pin:
    """The pin of a planet; ValueError for bearings that are not the same in all directions."""
    bearing, *further = planet.bearings.values()
    if not isinstance(bearing, Bearing):
        raise ValueError(f"the pin of {planet.name!r} must be a Bearing(radial=...), got a {type(bearing).__name__}")
    k = bearing.stiffness
    alike = not further and bearing.linear and abs(k[0, 0] - k[1, 1]) <= ROUNDING * k[0, 0] and not k[0, 1]
    turning = f"the pin of {planet.name!r} turns with the carrier: its bearing must be linear and the same in all"
    require(alike, f"{turning} directions; pass Bearing(radial=..., axial=..., tilt=...)")
    position, stiffness = np.asarray(position, float), float(k[0, 0])
    damping = bearing.damping_time * stiffness
    record = np.zeros(1, PIN)[0]
    record.x, record.y, record.stiffness, record.damping = *position, stiffness, damping
    return Pin(planet, carrier, position, bearing, record, PinRecorder())


@compiled
def pin_forces(pin, t, recorder, carrier, planet):
    """Forces (3) on the carrier and (3) on the planet; coordinates (3) and their rates (3) of each."""
    (c_x, c_y, angle), (vc_x, vc_y, omega) = carrier
    spin = spin_of(pin.imposed, t, angle, omega)
    angle, omega = spin.angle, spin.speed
    (p_x, p_y, _), (vp_x, vp_y, _) = planet
    s, c = sin(angle), cos(angle)
    rho_x, rho_y = c * pin.x - s * pin.y, s * pin.x + c * pin.y
    d_x, d_y = p_x - c_x + (pin.x - rho_x), p_y - c_y + (pin.y - rho_y)
    arm_x, arm_y = rho_x + d_x, rho_y + d_y
    w_x, w_y = vp_x - vc_x + omega * arm_y, vp_y - vc_y - omega * arm_x
    e_x, e_y = pin.stiffness * d_x, pin.stiffness * d_y
    f_x, f_y = pin.damping * w_x, pin.damping * w_y
    moment = rho_x * e_y - rho_y * e_x + arm_x * f_y - arm_y * f_x
    k = sample_of(recorder, t)
    if k >= 0:
        r = (pin.x * pin.x + pin.y * pin.y) ** 0.5
        u_x, u_y = rho_x / r, rho_y / r
        deflections = d_x * u_x + d_y * u_y, d_y * u_x - d_x * u_y
        rates = w_x * u_x + w_y * u_y, w_y * u_x - w_x * u_y
        store(header_at(recorder).samples, k, (*deflections, *rates, angle, omega))
        store(header_at(recorder).powers, k, (c_x, c_y, vc_x, vc_y))
    on_spin = moment + pin.torque if pin.imposed == 0 else pin.inertia * spin.acceleration
    return (e_x + f_x, e_y + f_y, on_spin), (-e_x - f_x, -e_y - f_y, 0.0)


@cache
def pin_kernel(n: int):
    """The function (record, recorder, t, *coordinates, *velocities) -> forces on a carrier of n coordinates and planet.

    The first two are addresses: of a `PIN` and of a recorder's header.
    """

    @kept
    def planet_pin(record, recorder, t, *x):
        pin = pin_at(record)
        planet = (x[n], x[n + 1], x[n + 2]), (x[2 * n + 3], x[2 * n + 4], x[2 * n + 5])
        if n == 1:
            on_carrier, on_planet = pin_forces(pin, t, recorder, ((0.0, 0.0, x[0]), (0.0, 0.0, x[4])), planet)
            return (on_carrier[2], *on_planet)
        carrier = (x[0], x[1], x[2]), (x[6], x[7], x[8])
        on_carrier, on_planet = pin_forces(pin, t, recorder, carrier, planet)
        return on_carrier + on_planet

    return planet_pin


def pin_rows(pin: Pin, angle: float, n: int) -> np.ndarray:
    """(2, n + 3) slopes of the deflection by the n coordinates of a carrier at an angle [rad] and by the planet's."""
    s, c = sin(angle), cos(angle)
    x, y = np.array([[c, -s], [s, c]]) @ pin.position
    by_carrier = np.array([[-1.0, 0.0, y], [0.0, -1.0, -x]])
    return np.column_stack([by_carrier[:, 3 - n :], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])


def add_pin(mbs, nodes: tuple[Any, Any], pin: Pin) -> int:
    """Add a pin between the nodes of its carrier and of its planet; returns the number of the object."""
    n = len(mbs.GetNode(nodes[0])["referenceCoordinates"])
    k, c = float(pin.record.stiffness), float(pin.record.damping)
    kernel, addresses = pin_kernel(n), (address_of(pin.record), address_of(pin.recorder.header))

    def planet_pin(mbs, t, item, q, q_t):
        return kernel(*addresses, t, *q, *q_t)

    def pin_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        rows = pin_rows(pin, q[n - 1], n)
        if pin.record.imposed:
            rows[:, n - 1] = 0.0
        return (factor * k + factor_t * c) * rows.T @ rows

    function = direct(planet_pin, kernel, (pin.record, pin.recorder.header), n + 3, pointed_to=pin.recorder)
    item: Any = eii.ObjectGenericODE2(
        name=f"{pin.planet.name} pin",
        nodeNumbers=list(nodes),
        forceUserFunction=function,
        jacobianUserFunction=pin_jacobian,
    )
    item.visualization["show"] = False
    return mbs.AddObject(item)
