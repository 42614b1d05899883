"""Rolling bearings of drawings and of every kind."""

from collections.abc import Iterator

import numpy as np
import scipy

from exugear import RollingBearing
from fem.units import deg, mm, um

GROOVE = {"Z": 7, "D_w": 11.5 * mm, "D_pw": 43.5 * mm, "r_i": 0.52 * 11.5 * mm, "r_e": 0.53 * 11.5 * mm, "C": 23.4e3}
ANGULAR = {"Z": 14, "D_w": 10 * mm, "D_pw": 55 * mm, "alpha": 25 * deg}
ROLLER = {"Z": 14, "D_w": 10 * mm, "D_pw": 60 * mm, "L_we": 12 * mm}
TAPERED = ROLLER | {"alpha": 15 * deg}


def of_rollers(row) -> bool:
    """Whether a row of a bearing rolls on laminae, not on balls."""
    return hasattr(row, "laminae")


def deep_groove(clearance: float = 0.0, **options) -> RollingBearing:
    """The ball bearing whose displacements and lives are known."""
    return RollingBearing.deep_groove(**GROOVE | options, clearance=clearance)


def every_kind() -> dict[str, RollingBearing]:
    """A bearing of every kind, pairs among them."""
    ball, taper = RollingBearing.angular_contact(**ANGULAR), RollingBearing.tapered_roller(**TAPERED)
    return {
        "deep groove": deep_groove(10 * um),
        "angular contact": ball,
        "O": ball.paired("O", spacing=15 * mm, preload=400.0),
        "X": ball.paired("X", spacing=15 * mm, preload=400.0),
        "tandem": ball.paired("tandem", spacing=15 * mm),
        "cylindrical roller": RollingBearing.cylindrical_roller(**ROLLER, clearance=20 * um),
        "needle": RollingBearing.needle(Z=24, D_w=4 * mm, D_pw=44 * mm, L_we=18 * mm, clearance=20 * um),
        "tapered roller": taper,
        "tapered O": taper.paired("O", spacing=30 * mm, preload=300.0),
    }


def random_displacements(number: int) -> np.ndarray:
    """(number, 5) displacements [m, rad], the same every time."""
    scale = np.array([30 * um, 30 * um, 30 * um, 1e-3, 1e-3])
    return scale * np.random.default_rng(1).normal(size=(number, 5))


def random_bearings(number: int) -> Iterator[tuple[RollingBearing, np.ndarray]]:
    """Bearings with a load (5,) each [N, N m] that they may carry, the same every time."""
    draw = np.random.default_rng(0)
    for _ in range(number):
        Z, D_w = int(draw.integers(6, 24)), draw.uniform(4, 25) * mm
        size = {"Z": Z, "D_w": D_w, "D_pw": D_w * max(Z / np.pi * draw.uniform(1.1, 1.5), 2.5)}
        alpha, play, length = draw.uniform(10, 45) * deg, draw.uniform(-5, 40) * um, D_w * draw.uniform(0.8, 6)
        preload, kind = draw.uniform(0, 2000), draw.integers(6)
        share = draw.uniform(0.001, 0.1) * np.clip(draw.normal(size=5), -1.5, 1.5)
        if kind == 0:
            bearing = RollingBearing.deep_groove(**size, clearance=play)
        elif kind == 1:
            bearing = RollingBearing.angular_contact(**size, alpha=alpha)
            share[2] = abs(share[2]) + 3 * np.abs(share[:2]).sum() + 2 * np.abs(share[3:]).sum()
        elif kind == 2:
            ball = RollingBearing.angular_contact(**size, alpha=alpha)
            bearing = ball.paired("O", spacing=1.5 * D_w, preload=preload)
        elif kind == 3:
            bearing = RollingBearing.cylindrical_roller(**size, L_we=length / 3, clearance=play)
            share[2:] = 0
        elif kind == 4:
            taper = RollingBearing.tapered_roller(**size, alpha=alpha, L_we=length / 3)
            bearing = taper.paired("O", spacing=2 * D_w, preload=preload)
        else:
            bearing = RollingBearing.needle(**size, L_we=length, clearance=play)
            share[2:] = 0
        yield bearing, share * bearing.C * np.array([1, 1, 1, size["D_pw"] / 2, size["D_pw"] / 2])


def any_load(bearing: RollingBearing, draw: np.random.Generator) -> np.ndarray:
    """A load (5,) on a bearing in any direction [N, N m], carried or not; half of those on cylinders are not axial."""
    row = bearing.rows[0]
    arms = np.array([1, 1, 1, row.R, row.R])
    load = draw.uniform(0.001, 0.1) * np.clip(draw.normal(size=5), -1.5, 1.5) * bearing.C * arms
    if of_rollers(row) and draw.integers(2):
        load[2], load[3:] = 0.0, load[3:] * draw.uniform(0, 1) * row.L_we / row.R
    return load


def forces_of_elements(row) -> np.ndarray:
    """(5, n) forces on the shaft by single elements of a row, of whose sums >= 0 all that it can carry consist.

    Cylinders are pressed at an end. Balls are pressed at a tenth of their contact angle, or axially.
    """
    psi = 2 * np.pi * np.arange(row.Z) / row.Z
    c, s, none = np.cos(psi), np.sin(psi), np.zeros(row.Z)
    if of_rollers(row):
        return np.hstack([np.array([c, s, none, -x * s, x * c]) for x in row.slices[[0, -1]]])
    least = np.arcsin(0.1 * np.sin(row.alpha))
    angles = [row.direction * angle for angle in (least, np.pi / 2)]
    axial = [np.sin(angle) + none for angle in angles]
    radial = [np.cos(angle) for angle in angles]
    return np.hstack(
        [np.array([r * c, r * s, a, row.R * a * s, -row.R * a * c]) for r, a in zip(radial, axial, strict=True)]
    )


def ball_forces_by_energy(row, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(Z,) forces of balls [N] under a load (5,), and sines of their contact angles, by minimising their energy."""
    psi = 2 * np.pi * np.arange(row.Z) / row.Z
    c, s, arms = np.cos(psi), np.sin(psi), np.array([1, 1, 1, row.R, row.R])
    unit = row.A / 100

    def of_balls(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = unit * x / arms
        radial = row.A * np.cos(row.alpha) + q[0] * c + q[1] * s
        axial = row.A * np.sin(row.alpha) + row.direction * (q[2] + row.R * (q[3] * s - q[4] * c))
        distance = np.hypot(radial, axial)
        return np.maximum(distance - row.A, 0.0), axial / distance

    scale = np.linalg.norm(load / arms) * unit

    def potential(x: np.ndarray) -> float:
        return (0.4 * row.stiffness * (of_balls(x)[0] ** 2.5).sum() - load @ (unit * x / arms)) / scale

    least = scipy.optimize.minimize(potential, load / arms / np.linalg.norm(load / arms), tol=1e-12)
    approach, sines = of_balls(least.x)
    return row.stiffness * approach**1.5, sines
