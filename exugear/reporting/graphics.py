"""Gears and shafts for Exudyn's viewer: closed surfaces of triangles with outward normals.

A gear turns about the z axis of its body; the middle of its tooth 0 lies at the angle phase_angle about z from x, in
mid-plane. Let theta be the direction from pinion to wheel. The driving flanks touch at the pitch point where tooth 0
lies at theta - gamma on the pinion and at theta + pi - gamma on the wheel, gamma = thickness(r_w) / (2 r_w) of each
gear, if the pinion drives counter-clockwise (+ gamma if clockwise): `meshing_angles`, of `fem.pair.placement`.
"""

from collections.abc import Sequence
from math import ceil, pi
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import graphics

from exugear.contact.rotation import SPATIAL
from exugear.multibody.elastic_shafts import graphics_body
from exugear.multibody.exudyn_objects import kind_of, object_of
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.pair.placement import meshing_angles
from fem.support.arguments import Finite, checked
from fem.support.validation import require
from fem.units import mm

__all__ = ["add_gear_graphics", "gear_graphics", "gear_outline", "meshing_angles", "shaft_graphics"]

STEEL_GREY, EDGE = (0.55, 0.58, 0.62, 1.0), (0.2, 0.2, 0.2, 1.0)
#: Largest twist of one layer of a helical gear [rad].
TWIST = 0.02
#: Corners of a bore.
BORE_CORNERS = 120


@checked
def gear_graphics(
    gear: Gear,
    *,
    phase_angle: Finite = 0.0,
    axial: Finite = 0.0,
    color: Sequence[float] = STEEL_GREY,
    points_per_tooth: int = 24,
) -> dict[str, Any]:
    """Exudyn's GraphicsData of a toothed gear with a bore, or of a ring, tooth 0 at phase_angle [rad].

    axial              position of the mid-plane [m]
    points_per_tooth   on the outline of one pitch, even, at least 8; the outline's corners lie on the true one
    """
    outline, bore = pitch_section(gear, _even(points_per_tooth))
    number = abs(gear.z)
    pitch, sizes = gear.sign * np.r_[outline, bore], (number, outline.size, bore.size)
    layers = max(1, ceil(gear.b * abs(gear.twist) / TWIST))
    heights = np.linspace(-gear.b / 2, gear.b / 2, layers + 1)[:, None]
    teeth = np.repeat(2 * pi / gear.z * np.arange(number), pitch.size)
    turned = np.tile(pitch, number) * np.exp(1j * (phase_angle + gear.twist * heights + teeth))
    points = np.stack([turned.real, turned.imag, np.broadcast_to(axial + heights, turned.shape)], axis=-1)
    data = graphics.FromPointsAndTrigs(points.reshape(-1, 3), gear_triangles(*sizes, layers), list(color))
    rim = np.c_[loops(*sizes)[0], np.roll(loops(*sizes)[0], -1)]
    return data | {"edges": np.concatenate([rim, layers * teeth.size + rim]), "edgeColor": np.array(EDGE)}


@checked
def shaft_graphics(
    length: float,
    d: float,
    *,
    axial: Finite = 0.0,
    d_bore: float = 0.0,
    color: Sequence[float] = STEEL_GREY,
    tiles: int = 48,
):
    """GraphicsData of a cylinder about z, centred at axial [m]; d and d_bore are diameters [m]."""
    require(length > 0, f"length must be > 0 m, got {length}")
    require(0 <= d_bore < d, f"d_bore must lie in [0, d = {d / mm:g} mm), got {d_bore / mm:g} mm")
    hollow = {"radiusInner": d_bore / 2} if d_bore > 0 else {}
    start, along = [0, 0, axial - length / 2], [0, 0, length]
    return graphics.Cylinder(start, along, d / 2, color=list(color), nTiles=tiles, **hollow)


@checked
def add_gear_graphics(mbs: exu.MainSystem, body: int, gear: Gear, **options) -> None:
    """Add a gear to the graphics of a body of a hand-built model; options as those of `gear_graphics`."""
    add_graphics(mbs, body, gear_graphics(gear, **options))


@checked
def add_graphics(mbs: exu.MainSystem, body: int, data: dict[str, Any]) -> None:
    """Add graphics data to those of a body; ValueError for an object that cannot carry graphics."""
    known = object_of(mbs, "body", body, addGraphicsData=True)
    if "VgraphicsData" not in known:
        words = f"object {body} cannot carry graphics; pass a rigid body or an ObjectRotationalMass1D"
        require(len(known.get("nodeNumbers", ())) == 1 and kind_of(mbs, body) == SPATIAL, words)
        body = graphics_body(mbs, body)
    present = mbs.GetObject(body, addGraphicsData=True)["VgraphicsData"]
    mbs.SetObjectParameter(body, "VgraphicsData", [*present, data])


@checked
def gear_outline(gear: Gear, *, phase_angle: Finite = 0.0, points_per_tooth: int = 24) -> np.ndarray:
    """Closed outline (2, n) of a gear in its mid-plane [m], tooth 0 at phase_angle [rad]; other options as of
    `gear_graphics`."""
    pitch, _ = pitch_section(gear, _even(points_per_tooth))
    turns = gear.sign * np.exp(1j * (phase_angle + 2 * pi / gear.z * np.arange(abs(gear.z))))
    points = np.outer(turns, pitch).ravel()
    return np.array([points.real, points.imag])[:, np.r_[: points.size, 0]]


def _even(points_per_tooth: int) -> int:
    """The points on the outline of a pitch; ValueError for an odd number or less than 8."""
    enough = f"points_per_tooth must be an even number of at least 8, got {points_per_tooth}"
    require(points_per_tooth % 2 == 0 and points_per_tooth >= 8, enough)
    return points_per_tooth


def half_outline(gear: Gear, n: int) -> tooth_profile.Polar:
    """n points of half a tooth from where its root begins up to the tip, each on the true outline."""
    below = max(2, n // 3)
    root = tooth_profile.fillet(gear, np.linspace(1, 0, below, endpoint=False))
    low, high = tooth_profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))
    involute = tooth_profile.flank(gear, tooth_profile.roll_at(gear, np.linspace(low, high, n - below)))
    return tooth_profile.Polar(np.append(root.r, involute.r), np.append(root.psi, involute.psi))


def pitch_section(gear: Gear, points_per_tooth: int) -> tuple[np.ndarray, np.ndarray]:
    """Outline and bore, or rim, of one pitch about the x axis as points x + iy, counter-clockwise.

    Each begins at the middle of the tooth space; the outline runs up the right flank and down the left flank. A tooth
    of a ring lies about -x, and is passed clockwise: seen with the tip up, as that of an external gear.
    """
    half = half_outline(gear, points_per_tooth // 2)
    foot = gear.sign * min(abs(half.psi[0]), (1 - 1e-3) * pi / abs(gear.z))
    psi = np.r_[-pi / gear.z, -foot, -half.psi[1:], half.psi[:0:-1], foot]
    parts = 3 * ceil(BORE_CORNERS / (3 * abs(gear.z)))
    bore = np.interp(np.arange(parts) * 3 / parts, range(4), [-pi / gear.z, -foot, foot, pi / gear.z])
    return np.r_[gear.r_f, half.r, half.r[::-1]] * np.exp(1j * psi), gear.r_clamp * np.exp(1j * bore)


def loops(z: int, n_outline: int, n_bore: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of a layer's points on the whole outline and on the bore, counter-clockwise."""
    numbers = np.arange(z * (n_outline + n_bore)).reshape(z, -1)
    return numbers[:, :n_outline].ravel(), numbers[:, n_outline:].ravel()


def gear_triangles(z: int, n_outline: int, n_bore: int, layers: int) -> np.ndarray:
    """(n, 3) points of both end faces, the toothed mantle and the bore, counter-clockwise seen from outside."""
    face, layer = face_triangles(z, n_outline, n_bore), z * (n_outline + n_bore)
    outline, bore = loops(z, n_outline, n_bore)
    walls = [i * layer + wall(loop, layer) for i in range(layers) for loop in (outline, bore[::-1])]
    return np.concatenate([face[:, ::-1], layers * layer + face, *walls])


def wall(loop: np.ndarray, layer: int) -> np.ndarray:
    """Triangles between a closed loop of points and the same loop a layer above."""
    around = np.append(loop, loop[0])
    return strip(around, around + layer)


def face_triangles(z: int, n_outline: int, n_bore: int) -> np.ndarray:
    """Triangles of an end face seen from +z: each tooth in strips of equal radius, and the ring below its foot."""
    size, half = n_outline + n_bore, np.arange((n_outline - 1) // 2)
    tooth = strip(1 + half, n_outline - 1 - half)
    foot = np.array([0, 1, n_outline - 1, size])[(3 * np.arange(n_bore + 1) + n_bore // 2) // n_bore]
    bore = n_outline + np.append(np.arange(n_bore), size)
    pitch = np.concatenate([tooth, strip(foot, bore)])
    return (np.arange(z)[:, None, None] * size + pitch).reshape(-1, 3) % (z * size)


def strip(right: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Triangles between two lines of equally many points, counter-clockwise where the second line is on the left."""
    a, b, c, d = right[:-1], right[1:], left[1:], left[:-1]
    return np.concatenate([np.c_[a, b, c][a != b], np.c_[a, c, d][c != d]])


def __dir__() -> list[str]:
    return __all__
