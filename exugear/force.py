"""The mesh force F(phase, deflection, rate) from an STE map or a user's table, as one compiled kernel.

At each phase the secant stiffness k stands over u = (penetration / largest penetration)^(1/4): F = k penetration, so
that the force is exactly 0 without contact and the low loads, where a Hertzian contact softens, keep their resolution:
512 x 64 patches invert a map within 1e-4 of the force, from 3e-6 of the largest on (tests/test_force.py).
Both directions carry values and slopes (bicubic Hermite patches), which is once continuously differentiable and, with
monotone slopes (Fritsch & Carlson 1980), does not ring at jumps between phases.
"""

from dataclasses import dataclass, field
from math import floor, inf, isfinite, nan, sqrt

import numpy as np
from numba import njit
from scipy.interpolate import PchipInterpolator

from fem.gear import require
from fem.ste import PHASE, TORQUE, at_phases, check, compliance_at, over_torque_and_phase, pair_of
from fem.units import um

HEADER = 8
PHASE_STEPS, PENETRATION_STEPS, BACKLASH, DAMPING, RAMP, BACK_PHASE, SIZE = range(7)
PHASES = 512
PENETRATIONS = 64
MANY_PITCHES = 1e12
DAMPING_RAMP = 1 * um


compiled = njit


def kept(function):
    """Compiled and, where a folder can be written, kept on disk with all that it calls: for entry points alone."""
    try:
        return njit(cache=True)(function)
    except RuntimeError:
        return njit(function)


@compiled
def hermite(t, y0, m0, y1, m1):
    """Cubic through y0, y1 with slopes m0, m1 at t = 0, 1."""
    s = 1.0 - t
    return s * s * ((1.0 + 2.0 * t) * y0 + t * m0) + t * t * ((3.0 - 2.0 * t) * y1 - s * m1)


@compiled
def secant(patch, a, b, t, w):
    """Bicubic Hermite interpolation of (k, k_phase, k_u, k_phase_u) from the corners at a (phase i) and b (i + 1)."""
    low = hermite(t, patch[a], patch[a + 1], patch[b], patch[b + 1])
    low_u = hermite(t, patch[a + 2], patch[a + 3], patch[b + 2], patch[b + 3])
    high = hermite(t, patch[a + 4], patch[a + 5], patch[b + 4], patch[b + 5])
    high_u = hermite(t, patch[a + 6], patch[a + 7], patch[b + 6], patch[b + 7])
    return hermite(w, low, low_u, high, high_u)


@compiled
def flank_force(law, phase, deflection, rate):
    """Force >= 0 but for damping [N] of one flank; ValueError(deflection, largest) beyond the table."""
    if not abs(phase) < MANY_PITCHES:
        raise ValueError(nan, nan)
    n, m = int(law[PHASE_STEPS]), int(law[PENETRATION_STEPS])
    x = (phase - floor(phase)) * n
    i = min(int(x), n - 1)
    t = x - i
    following = i + 1 if i + 1 < n else 0
    a, b = HEADER + 4 * i, HEADER + 4 * following
    unloaded = hermite(t, law[a], law[a + 1], law[b], law[b + 1])
    penetration = deflection - unloaded
    if penetration <= 0.0:
        return 0.0
    largest = hermite(t, law[a + 2], law[a + 3], law[b + 2], law[b + 3])
    share = penetration / largest
    if not share <= 1.0 + 1e-9:
        raise ValueError(deflection, unloaded + largest)
    y = sqrt(sqrt(share)) * m
    j = min(int(y), m - 1)
    patches = HEADER + 4 * n
    row = 4 * (m + 1)
    k = secant(law, patches + i * row + 4 * j, patches + following * row + 4 * j, t, y - j)
    r = min(penetration / law[RAMP], 1.0)
    return k * penetration + law[DAMPING] * r * r * (3.0 - 2.0 * r) * rate


@compiled
def mesh_force(law, phase, deflection, rate):
    """Force [N] of both flanks at the nominal centre distance: > 0 on the driving flank, < 0 on the other."""
    if deflection >= -0.5 * law[BACKLASH]:
        return flank_force(law, phase, deflection, rate)
    return -flank_force(law, law[BACK_PHASE] - phase, -(deflection + law[BACKLASH]), -rate)


@kept
def mesh_forces(law, phase, deflection, rate):
    """`mesh_force` of equally long arrays."""
    force = np.empty(phase.size)
    for i in range(phase.size):
        force[i] = mesh_force(law, phase[i], deflection[i], rate[i])
    return force


def beyond_map(deflection: float, largest: float) -> str:
    """What to say when a deflection [m] leaves the map."""
    if not isfinite(deflection):
        return f"deflection must be finite, got {deflection}; use a smaller step"
    return (
        f"deflection {deflection / um:.4g} um lies beyond the map, which ends at {largest / um:.4g} um at this phase; "
        f"extend the map to a larger torque (or the table's deflection), some {1.5 * deflection / largest:.2g} times"
    )


@dataclass(frozen=True, eq=False)
class MeshForce:
    """Force law of one gear mesh; the table holds the driving flank, the other is its mirror image.

    phase        (n_phase,) share of a pitch, increasing in [0, 1); the law is periodic in it
    deflection   (n_defl,) or (n_phase, n_defl) along the line of action [m], increasing
    force_table  (n_phase, n_defl) mesh force [N], 0 in the first column, increasing from the loss of contact on
    damping      viscous damping along the line of action [N s/m]; ramps in over the first 1 um of penetration, so that
                 the force is continuous, and is not clipped: a fast separation may pull for that micrometre
    backlash     play along the line of action [m]; inf: the other flank is never met
    back_phase   phase + phase of the mirrored contact on the other flank (`fem.GearPair.back_phase`)

    Uniform phases i / n are kept, others are resampled. Raises ValueError for what is no such law.
    """

    phase: np.ndarray
    deflection: np.ndarray
    force_table: np.ndarray
    damping: float = field(default=0.0, kw_only=True)
    backlash: float = field(default=inf, kw_only=True)
    back_phase: float = field(default=0.0, kw_only=True)
    law: np.ndarray = field(init=False, repr=False)
    stiffness_max: float = field(init=False)

    def __post_init__(self):
        for name in ("phase", "deflection", "force_table"):
            object.__setattr__(self, name, _frozen(np.array(getattr(self, name), float)))
        _check_scalars(self.damping, self.backlash, self.back_phase)
        _check_table(self.phase, self.deflection, self.force_table)
        law, stiffness_max = _tabulate(self)
        object.__setattr__(self, "law", _frozen(law))
        object.__setattr__(self, "stiffness_max", stiffness_max)

    @classmethod
    def from_ste(cls, ste, *, damping: float = 0.0, backlash: float | None = None) -> "MeshForce":
        """The law whose static deflection is the map; backlash is the pair's unless given.

        ste   Dataset of `fem.ste`: te [m] over torque from 0 [N m] and phase, smooth and periodic in phase.
        Below the lowest torque the compliance grows with -ln F, as that of a Hertzian line contact does.

        Raises ValueError for a map that does not start at torque 0 or whose te does not grow with the torque.
        """
        pair = pair_of(check(ste))
        phase = np.arange(PHASES) / PHASES
        force, deflection = _loaded_deflection(ste, pair.pinion.r_b, phase)
        backlash = pair.backlash if backlash is None else backlash
        force_table = np.broadcast_to(force, deflection.shape)
        return cls(phase, deflection, force_table, damping=damping, backlash=backlash, back_phase=pair.back_phase)

    def __call__(self, phase, deflection, rate=0.0) -> np.ndarray:
        """Mesh force [N] at phase [1], deflection [m] and rate [m/s], broadcast; ValueError beyond the table."""
        phase, deflection, rate = np.broadcast_arrays(*(np.asarray(x, float) for x in (phase, deflection, rate)))
        for name, value in (("phase", phase), ("deflection", deflection), ("rate", rate)):
            require(bool(np.isfinite(value).all()), f"{name} must be finite, got {value}")
        flat = [np.ascontiguousarray(x).ravel() for x in (phase, deflection, rate)]
        try:
            return mesh_forces(self.law, *flat).reshape(phase.shape)
        except ValueError as error:
            raise ValueError(beyond_map(*error.args)) from None

    def deflection_at(self, phase: float, force: float) -> float:
        """Static deflection [m] on the driving flank under force >= 0 [N] (bisection); ValueError beyond the table."""
        low, top = self.unloaded(phase)
        largest = float(self(phase, top))
        remedy = f"must lie in [0, {largest:.4g}] N, the map's range at phase {phase:.4g}, got {force:.4g}"
        require(0 <= force <= largest * (1 + 1e-9), f"force {remedy}; extend the map to a larger torque")
        for _ in range(80):
            middle = (low + top) / 2
            low, top = (middle, top) if float(self(phase, middle)) < force else (low, middle)
        return top

    def unloaded(self, phase: float) -> tuple[float, float]:
        """Deflections at loss of contact and at the end of the map [m]."""
        n = int(self.law[PHASE_STEPS])
        x = (phase % 1.0) * n
        i = min(int(x), n - 1)
        edge = self.law[HEADER : HEADER + 4 * n].reshape(n, 4)
        (y0, m0, s0, d0), (y1, m1, s1, d1) = edge[i], edge[(i + 1) % n]
        start = hermite(x - i, y0, m0, y1, m1)
        return start, start + hermite(x - i, s0, d0, s1, d1)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def _check_scalars(damping: float, backlash: float, back_phase: float) -> None:
    require(0 <= damping < inf, f"damping must be >= 0 N s/m and finite, got {damping}")
    play = f"backlash must be >= 0 m (inf: no other flank), got {backlash}; it is meant on the line of action"
    require(backlash >= 0, play)
    unit = f"backlash must be below 0.01 m, or inf, got {backlash}; pass metres: 0.2*mm"
    require(backlash < 1e-2 or backlash == inf, unit)
    require(isfinite(back_phase), f"back_phase must be finite, a share of a pitch, got {back_phase}")


def _check_table(phase: np.ndarray, deflection: np.ndarray, force: np.ndarray) -> None:
    require(phase.ndim == 1 and phase.size >= 1, f"phase must be (n_phase,) shares of a pitch, got {phase.shape}")
    rising = (np.diff(phase) > 0).all() and phase[0] >= 0 and phase[-1] < 1
    require(bool(rising), f"phase must increase within [0, 1) as share of a pitch, got {phase}")
    shapes = f"got {phase.shape}, {deflection.shape}, {force.shape}"
    fits = force.shape == (phase.size, deflection.shape[-1] if deflection.ndim else 0) and force.shape[1] >= 2
    fits = fits and deflection.shape in (force.shape, force.shape[1:])
    require(fits, f"force_table must be (n_phase, n_defl) over phase (n_phase,) and deflection (n_defl,), {shapes}")
    require(bool(np.isfinite(deflection).all() and (np.diff(deflection) > 0).all()), "deflection must increase [m]")
    size = np.abs(deflection).max()
    require(size < 1e-2, f"deflection must lie within 0.01 m, got {size:g}; pass metres: 20*um")
    require(bool(np.isfinite(force).all()), "force_table must be finite everywhere")
    none = "force_table must be 0 in the first column; begin deflection where no teeth touch (the driving flank alone)"
    require(bool((force[:, 0] == 0).all()), none)
    loaded = force[:, 1:] > 0
    rises = (np.diff(force, axis=1) > 0) == loaded
    grow = "force_table must grow with the deflection once the teeth touch; check its sign and its axes"
    require(bool(rises.all() and loaded[:, -1].all()), grow)


def _loaded_deflection(ste, r_b: float, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n,) from 0 [N] and deflections (n_phase, n) under them [m]."""
    te = over_torque_and_phase(ste).values
    torque, coarse = ste[TORQUE].values, ste[PHASE].values
    require(coarse.size >= 3, f"phase needs at least 3 values as share of a pitch, got {coarse.size}")
    require(torque.size >= 3, f"torque needs 0 and two loads or more, got {torque} N m")
    require(torque[0] == 0, f"torque must start at 0 (unloaded transmission error), got {torque[0]} N m; add it")
    te = at_phases(coarse, te, phase)
    given = torque[1:] / r_b
    rising = (np.diff(te, axis=0) > 0).all()
    require(bool(rising), "te must grow with the torque at every phase; check its sign, or map more phases")
    force = np.r_[given[0] * np.geomspace(1e-4, 1, 41)[:-1], np.geomspace(given[0], given[-1], 161)]
    force[[40, -1]] = given[[0, -1]]
    deflection = te[0] + force[:, None] * compliance_at(given, (te[1:] - te[0]) / given[:, None], force)
    return np.r_[0, force], np.r_[te[:1], deflection].T


def _over_penetration(deflection: np.ndarray, force: np.ndarray) -> tuple[float, float, np.ndarray, np.ndarray]:
    """Unloaded deflection, largest penetration, and k, dk/du at uniform u of one phase."""
    contact = int(np.flatnonzero(force == 0)[-1])
    start, largest = deflection[contact], deflection[-1] - deflection[contact]
    penetration = deflection[contact + 1 :] - start
    k = force[contact + 1 :] / penetration
    u = np.r_[0, (penetration / largest) ** 0.25]
    curve = PchipInterpolator(u, np.r_[k[0], k])
    uniform = np.linspace(0, 1, PENETRATIONS + 1)
    return start, largest, curve(uniform), curve(uniform, 1) / PENETRATIONS


def _periodic(phase: np.ndarray, values: np.ndarray, uniform: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes per step at the uniform phases, monotone between the given ones (axis 0)."""
    wrapped = np.r_[phase - 1, phase, phase + 1]
    curve = PchipInterpolator(wrapped, np.r_[values, values, values])
    return curve(uniform), curve(uniform, 1) / uniform.size


def _tabulate(force: MeshForce) -> tuple[np.ndarray, float]:
    """The kernel's numbers and the largest tangent stiffness [N/m]."""
    phase = force.phase
    deflection = np.broadcast_to(force.deflection, force.force_table.shape)
    rows = [_over_penetration(d, f) for d, f in zip(deflection, force.force_table, strict=True)]
    start, largest, k, k_u = (np.array(column) for column in zip(*rows, strict=True))
    kept = np.allclose(phase, np.arange(phase.size) / phase.size, atol=1e-9)
    n = phase.size if kept else 2 * PHASES
    uniform = np.arange(n) / n
    edge = np.stack([*_periodic(phase, start, uniform), *_periodic(phase, largest, uniform)], axis=-1)
    (k, k_p), (k_u, k_pu) = _periodic(phase, k, uniform), _periodic(phase, k_u, uniform)
    tangent = k + 0.25 * np.arange(PENETRATIONS + 1) * k_u
    jam = -2 * edge[:, 0].min()
    room = f"backlash must be >= {jam:.4g} m, or the unloaded error jams the teeth, got {force.backlash}"
    require(force.backlash >= jam - 1e-9, room)
    patches = np.stack([k, k_p, k_u, k_pu], axis=-1)
    size = HEADER + edge.size + patches.size
    scalars = (force.backlash, force.damping, DAMPING_RAMP, force.back_phase)
    header = np.array([n, PENETRATIONS, *scalars, size, 0], float)
    return np.concatenate([header, edge.ravel(), patches.ravel()]), float(tangent.max())
