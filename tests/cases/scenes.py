"""Scenes shared by the tests: a smooth map with the data of the paper's pair, and oscillators with known solutions."""

from functools import cache

import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RotXYZ2RotationMatrix
from paper_gears import paper_gear, paper_pair

import exugear
from fem import ste_map
from fem.units import mm, rpm

K, INERTIA = 4.2e8, 8.550e-3
TORQUES = (0, 1, 5, 20, 50, 100, 150, 250, 350, 500, 1000, 2000, 4000)


def smooth_map(torque=TORQUES, phases: int = 30):
    """Compliance between that of one and of two tooth pairs, softer at low load; double contact grows with the load."""
    pair, load = paper_pair(), np.array(torque, float)[:, None]
    force = np.maximum(load, 1e-9) / pair.pinion.r_b
    phase = np.arange(phases) / phases
    half = (pair.eps_alpha - 1) / 2 + 3e-5 * load
    double = 0.5 + 0.5 * np.tanh(1.5 * (half - abs(phase - 0.5)) / (0.03 + 6e-5 * load))
    te = force * (1 + 0.03 * np.log(2155 / force)) * (4.05e-9 - 1.45e-9 * double)
    return ste_map(pair, np.array(torque, float), phase, np.where(load > 0, te, 0))


@cache
def smooth_law(**options: float) -> exugear.MeshForce:
    """The law of the smooth map; made once for all options, as it takes longer than most of what is asked of it."""
    return exugear.MeshForce.from_ste(smooth_map(), **options)


def smooth_stage(fast: exugear.Shaft, slow: exugear.Shaft, **options) -> exugear.Stage:
    """A stage of the paper's pair with that law, and the options of a stage."""
    if "damping_ratio" in options:
        return exugear.Stage(fast, slow, smooth_map(), **options)
    of_law = {name: options.pop(name) for name in ("damping", "damping_ramp", "backlash") if name in options}
    return exugear.Stage(fast, slow, smooth_law(**of_law), pair=paper_pair(), **options)


def smooth_box(part=None, parts=None, **stage) -> exugear.Gearbox:
    """The paper's pair, free to spin or with the same bearing, or further parts, on both shafts."""
    return free_pair() if part is None and parts is None and not stage else _smooth_box(part, parts, **stage)


@cache
def free_pair() -> exugear.Gearbox:
    """The paper's pair, free to spin."""
    return _smooth_box(None, None)


def _smooth_box(part, parts, **stage) -> exugear.Gearbox:
    parts = {30 * mm: paper_gear()} | ({} if part is None else {0.0: part}) | (parts or {})
    fast, slow = exugear.Shaft("fast", parts), exugear.Shaft("slow", parts)
    return exugear.Gearbox([smooth_stage(fast, slow, **{"damping": 2700.0} | stage)])


@cache
def two_stages(angle: float = 0.0) -> exugear.Gearbox:
    """The paper's pair twice, the second at an angle behind the first; a middle shaft with two gears."""
    middle = exugear.Shaft("middle", {30 * mm: paper_gear(), 80 * mm: paper_gear()})
    fast, slow = (exugear.Shaft(name, {s * mm: paper_gear()}) for name, s in (("fast", 30), ("slow", 80)))
    first = smooth_stage(fast, middle, damping=2700.0)
    return exugear.Gearbox([first, smooth_stage(middle, slow, damping=2700.0, angle=angle)])


class Oscillator:
    """Deflection y of a wheel against a pinion of given speed, damped by a damper of Exudyn.

    Natural frequency sqrt(K / m), m = INERTIA / r_b^2; y'' + 2 zeta omega y' + force(y) / m = push(t) / m.
    """

    def __init__(self, law: exugear.MeshForce, zeta: float = 0.05):
        pair, self.law = paper_pair(), law
        shafts = [exugear.Shaft(name, {0.0: paper_gear()}, inertia=INERTIA) for name in ("fast", "slow")]
        self.model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)]))
        self.r, self.teeth = pair.pinion.r_b, pair.pinion.z
        self.omega = (K * self.r**2 / INERTIA) ** 0.5
        self.c = 2 * zeta * K / self.omega
        nodes = [self.model.mbs.GetObject(body)["nodeNumber"] for body in self.model.bodies.values()]
        matrix = self.c * self.r**2 * np.ones((2, 2))
        self.model.mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, dampingMatrix=matrix))

    def run(self, frequency, push, periods: float, steps: int = 200, **options):
        """Deflection samples (n,) and their times in natural periods; frequency and push at the periods x.

        frequency   function of x, or x and its values there (2, n); push: function of x
        """
        period = 2 * np.pi / self.omega
        spin = lambda t: frequency(t / period) * self.omega / self.teeth  # noqa: E731
        if not callable(frequency):
            spin = frequency[0] * period, frequency[1] * self.omega / self.teeth
        load = lambda t: push(t / period) * self.r  # noqa: E731
        step = period / steps
        options = {"step": step, "sample": step, "progress": False} | options
        run = exugear.run_up(self.model, speed=spin, duration=periods * period, load=load, **options)
        return run.data["dte"].values[0], run.data["time"].values / period


def linear_law(k=(K, K, K), phase=(0.0, 1 / 3, 2 / 3), backlash: float = np.inf, reach: float = 1e-4):
    """F = k deflection at each phase."""
    table = np.outer(k, [0.0, reach])
    return exugear.MeshForce(np.array(phase), np.array([0.0, reach]), table, damping=0.0, backlash=backlash)


def rectangular_law(n: int = 1000, reach: float = 1e-4) -> exugear.MeshForce:
    """Two tooth pairs during 0.45 of the cycle, single over double 0.6, mean K."""
    phase = np.arange(n) / n
    double = K / (0.45 + 0.55 * 0.6)
    return linear_law(np.where(phase < 0.45, double, 0.6 * double), phase, reach=reach)


def swept(start: float, end: float, periods: float, until: float) -> np.ndarray:
    """A ramp from start to end over a number of periods, then constant (2, n): as a function it has a costly corner."""
    x = np.r_[np.linspace(0.0, periods, 201), until]
    return np.array([x, np.interp(x, [0.0, periods], [start, end])])


def wrench(reference, q, forces) -> np.ndarray:
    """Force and moment about the origin (6) of the generalized forces on an Rxyz body."""
    a, b = reference[3] + q[3], reference[4] + q[4]
    g = np.c_[[1, 0, 0], [0, np.cos(a), np.sin(a)], RotXYZ2RotationMatrix([a, b, 0])[:, 2]]
    push, turn = np.array(forces[:3]), np.linalg.solve(g.T, forces[3:])
    return np.r_[push, turn + np.cross(reference[:3] + q[:3], push)]


def ran(model: exugear.Model, **changes):
    """Data of a run at 1000 rpm and 150 N m but for changes, all of them finite."""
    options = {"speed": 1000 * rpm, "load": 150.0, "duration": 0.2, "progress": False} | changes
    data = exugear.run_up(model, **options).data
    for name, values in data.data_vars.items():
        assert np.isfinite(values).all(), name
    return data


def rms(data, parts: int = 10) -> np.ndarray:
    """rms of the DTE about its mean in equal parts of a run."""
    return np.array([part.std() for part in np.array_split(data["dte"].values[0, :-1], parts)])
