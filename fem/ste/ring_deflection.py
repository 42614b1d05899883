"""Displacement of a ring on its supports under the force of a mesh: of the outside of its rim, and at other meshes."""

from math import cos, pi

import numpy as np
import xarray as xr

from fem.contact.resolution import Resolution, Slices
from fem.elasticity.flank_compliance import Compliance, flank_compliance
from fem.elasticity.hat_functions import hats, products
from fem.elasticity.rim_bending import RADIAL, TANGENTIAL, RimBending, waves
from fem.gear.tooth_profile import arc_length
from fem.pair.mirror_image import mirror_image
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.map_solver import elastic_gears, width_variation
from fem.ste.ste_map import pair_attributes
from fem.support.arguments import Numbers, checked
from fem.support.validation import numbers, require, require_finite

MESH, AT = "mesh", "at"
#: Positions around the ring at which meshes deflect one another.
POSITIONS = 64


@checked
def ring_deflection(
    pair: GearPair,
    at: Numbers,
    mesh: Numbers = 0.0,
    *,
    side: int = 1,
    resolution: Resolution | Slices | None = None,
) -> xr.Dataset:
    """Displacements of a ring on its supports per unit force of a mesh, over (mesh, at).

    Static and linear: under several meshes the displacements add up, each times its mesh force T / r_b1 [N].

    pair        pinion and ring; the rim on `fem.Bolts` or a `fem.Bush`
    at          (n,) angles on the ring at which it is displaced [rad]
    mesh        (m,) ring angles of the mesh whose force acts [rad], as in a map: 2 pi p / |z| where tooth p of the
                ring touches at the pitch point
    side        1: the mesh force acts on the left flanks, as under torques > 0 of a map, -1: on the right flanks
    resolution  mesh of the finite elements, as for a map

    Angles count in the direction in which the teeth of the ring count, clockwise seen from +z, from the middle of tooth
    0, as those of `fem.Bolts`. At the ring angle 0 the left flank of tooth 0 touches at the pitch point: the line of
    centres is then half a tooth thickness on the working circle further than the middle of this tooth.

    "radial"        displacement of the outside of the rim at the angle `at` [m/N], > 0 outwards
    "tangential"    the same along the circumference [m/N], > 0 towards larger angles
    "deflection"    transmission error that the force causes in another mesh at the ring angle `at`, on the same side
                    [m/N], > 0 as that which it causes in its own mesh: the cross compliance of the meshes by the rim.
                    Its own mesh's compliance is part of the map, which it would count twice

    The force acts at the pitch point on a single tooth, evenly over the face width; load on its neighbours changes
    "radial" and "tangential" little unless the angle lies within a pitch or two of the mesh. The displacement of the
    rim is a sum of harmonics up to 1.25 |z|.

    Raises ValueError for a pair whose rim is clamped or that is external.
    """
    held = "pair must have a ring whose rim is on fem.Bolts or a fem.Bush"
    require(bool(pair.wheel.support), f"{held}, got {pair.wheel}; give the ring a support=")
    require(side in (1, -1), f"side must be 1 for left flanks or -1 for right flanks, got {side}")
    angles, meshes = (np.atleast_1d(numbers(name, values)) for name, values in ((AT, at), (MESH, mesh)))
    for name, values in ((AT, angles), (MESH, meshes)):
        require(values.ndim == 1 and values.size > 0, f"{name} must be an angle or angles (n,), got {values.shape}")
        require_finite(name, values)
    rim_angles, mesh_angles, other_meshes, loaded = angles, meshes, angles, pair
    if side < 0:
        pitch = 2 * pi / abs(pair.wheel.z)
        rim_angles, loaded = pitch - angles, mirror_image(pair)
        mesh_angles, other_meshes = (pitch * pair.back_phase - values for values in (meshes, angles))
    compliance = _ring_compliance(loaded, resolution or Resolution())
    rim: RimBending = compliance.rim  # type: ignore[assignment]
    at_pitch_point = flank_at_pitch_point(loaded, compliance)
    forces = np.stack([rim.displacement(angle) @ at_pitch_point for angle in mesh_angles], axis=1)
    moved = rim.amplitudes(forces)
    cross = np.stack([rim.displacement(angle) @ at_pitch_point for angle in other_meshes]) @ moved
    shapes = waves(rim_angles, len(rim.flank) - 1)
    of_components = moved.reshape(2, -1, meshes.size)
    about = {"units": "m/N"}
    variables = {
        "radial": (shapes @ of_components[RADIAL], "radial displacement of the outside of the rim per mesh force"),
        "tangential": (side * (shapes @ of_components[TANGENTIAL]), "the same along the circumference"),
        "deflection": (cross, "transmission error in another mesh per mesh force"),
    }
    axes = {MESH: (MESH, meshes, {"units": "rad", "long_name": "ring angle of the loaded mesh"})}
    axes[AT] = (AT, angles, {"units": "rad", "long_name": "angle on the ring"})
    named = {name: ((MESH, AT), values.T, about | {"long_name": text}) for name, (values, text) in variables.items()}
    title = {"title": "displacement of the ring per unit mesh force", "side": side}
    return xr.Dataset(named, axes, title | pair_attributes(pair))


def cross_compliance(pair: GearPair, compliance: Compliance) -> np.ndarray:
    """(POSITIONS,) te by a unit mesh force of another mesh, at evenly spaced angles on a supported ring [m/N].

    On left flanks; of all positions of both meshes the one with the largest magnitude. At 0 it is the compliance of a
    flank by the bending of the rim.
    """
    rim: RimBending = compliance.rim  # type: ignore[assignment]
    at_pitch_point, angles = flank_at_pitch_point(pair, compliance), 2 * pi * np.arange(POSITIONS) / POSITIONS
    forces = np.stack([rim.displacement(angle) @ at_pitch_point for angle in angles], axis=1)
    return largest_over_positions(forces.T @ rim.amplitudes(forces))


def largest_over_positions(between: np.ndarray) -> np.ndarray:
    """(n,) values of largest magnitude over the positions of a mesh, by how far ahead of it another one is.

    between   (n, n) of the meshes at evenly spaced positions around a ring
    """
    rows = np.arange(len(between))
    ahead = between[rows, (rows + rows[:, None]) % rows.size]
    return ahead[rows, np.argmax(np.abs(ahead), axis=1)]


def _ring_compliance(pair: GearPair, resolution: Resolution | Slices) -> Compliance:
    """Compliance of the ring as in a map without offsets."""
    offsets = Offsets().values(pair)
    _, whole = width_variation(pair, offsets)
    return flank_compliance(*elastic_gears(pair, offsets, resolution)[1], whole=whole)


def flank_at_pitch_point(pair: GearPair, compliance: Compliance) -> np.ndarray:
    """(n_shape,) displacement of the flank at the pitch point along the line of action, mean over the width."""
    arc = arc_length(pair.wheel, np.array([pair.path_of_contact.on_wheel(pair.roll_pitch)]))
    along = hats(compliance.arcs, arc)[:, 0]
    across = products(compliance.axial).sum(axis=0)
    rim: RimBending = compliance.rim  # type: ignore[assignment]
    return np.einsum("syh,y,h->s", rim.shapes[0], across / across.sum(), along) / cos(pair.beta_b)
