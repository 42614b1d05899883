"""The frame of a contact between two bodies of any kind, of which at least one moves in space.

z of the contact is global z where the axes lie along it, else the pinion's axis in the reference configuration.
"""

from dataclasses import dataclass, replace
from math import hypot, pi

import numpy as np

from exugear.contact.body_motion import angles_of, axes_without_spin
from exugear.contact.reference_configuration import reference_line, spatial_frame
from exugear.contact.rotation import BodyKind, attitude
from exugear.mesh_force.kernel_records import changed
from fem.support.validation import require
from fem.units import mm

#: Largest angle between pinion and wheel, and from global z, that counts as a tilt [rad].
LARGEST_SKEW = 0.05
#: Least angle between the z axis of an Rxyz body and global x [rad].
LEAST_ANGLE_TO_SINGULARITY = 0.1
#: Rounding of components of a unit vector.
ROUNDING = 1e-9
E_Z, ORIGIN = np.array([0.0, 0.0, 1.0]), np.zeros(3)


@dataclass(frozen=True, eq=False)
class GearBody:
    """Body of a gear: kind, reference coordinates of its node, the gear's axis (3) and centre (3) [m] on the body."""

    kind: BodyKind
    reference: np.ndarray
    axis: np.ndarray
    position: np.ndarray

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) attitude in the reference configuration."""
        return np.array(attitude(self.kind.code, tuple(np.append(self.reference[3:], 0.0)[:4])))

    @property
    def direction(self) -> np.ndarray:
        """(3,) direction of the gear's axis in the reference configuration."""
        return self.matrix @ self.axis

    @property
    def gear_axes(self) -> np.ndarray:
        """(3, 3) axes of the gear in the reference configuration, as columns."""
        return self.matrix @ axes_about(self.axis)

    @property
    def counts_turns(self) -> bool:
        """Whether a coordinate is the spin about the gear's axis in any attitude: that of Rxyz about z of the body."""
        return self.kind.counts_turns and bool(abs(self.axis[2]) > 1 - ROUNDING)

    @property
    def axial(self) -> float:
        """Position of the gear's centre along its axis [m]."""
        return float(self.position @ self.axis)

    def along(self, z: np.ndarray) -> "GearBody":
        """The body with its gear's axis reversed where it points against z."""
        return self if self.direction @ z > 0 else replace(self, axis=-self.axis)


def frame_between(pair, phase: float, direction: int, bodies: tuple[GearBody, GearBody]) -> np.record:
    """The contact frame of a pair on two bodies; ValueError where the bodies do not fit the pair."""
    z = E_Z if _is_upright(bodies) else bodies[0].direction
    bodies = bodies[0].along(z), bodies[1].along(z)
    _check_parallel(*bodies)
    axes = _axes_of_contact(bodies)
    check_distance(pair, reference_line([body.axial for body in bodies], [_in_frame(axes, body) for body in bodies]))
    return frame_on(pair, phase, direction, bodies)


def frame_on(pair, phase: float, direction: int, bodies: tuple[GearBody, GearBody], **values) -> np.record:
    """The contact frame of a pair on two bodies, wherever they stand.

    values   fields of the frame as of the pair's nominal positions, instead of those of the bodies' positions
    """
    axes, axial = _axes_of_contact(bodies), [body.axial for body in bodies]
    reference = [_in_frame(axes, body) for body in bodies]
    global_z = bool((axes == np.eye(3)).all())
    if global_z and all(body.kind.counts_turns and body.axis[2] == 1 for body in bodies):
        return spatial_frame(pair, phase, direction, axial, reference, **values)
    between = bodies[1].reference[:3] - bodies[0].reference[:3]
    mesh_axes = np.array(axes_without_spin(tuple(map(tuple, bodies[0].gear_axes))))
    upright = _is_upright(bodies)
    in_mesh = reference if upright else [_in_frame(mesh_axes, body, bodies[0].reference) for body in bodies]
    frame = spatial_frame(pair, phase, direction, axial, in_mesh, **values)
    gears = zip((frame.pinion, frame.wheel), bodies, reference, strict=True)
    pinion, wheel = (_on_body(gear, body, coordinates[3:]) for gear, body, coordinates in gears)
    counted = all(body.counts_turns for body in bodies)
    base_pitch = 0.0 if counted else 2 * pi * pair.pinion.r_b / pair.pinion.z
    return changed(frame, axes=axes, between=between, pinion=pinion, wheel=wheel, base_pitch=base_pitch)


def _is_upright(bodies: tuple[GearBody, GearBody]) -> bool:
    """Whether a body turns about global z, which is then the axis of the contact."""
    return any(body.kind.turns_about_z for body in bodies)


def _axes_of_contact(bodies: tuple[GearBody, GearBody]) -> np.ndarray:
    """(3, 3) axes of the contact as columns: the global ones, or those of the pinion where it does not lie along z."""
    return np.eye(3) if bodies[0].direction @ E_Z > np.cos(LARGEST_SKEW) else bodies[0].gear_axes


def _on_body(gear: np.record, body: GearBody, angles: np.ndarray) -> np.record:
    """The record of a gear with the rotational coordinates of its body and the gear's axes on the body.

    angles   (3,) of the gear in the contact frame
    """
    rotation, axes = np.append(body.reference[3:], 0.0)[:4], axes_about(body.axis)
    return changed(gear, rotation=rotation, axes=axes, angles=angles, spin_factors=_spin_factors(body))


def axes_about(z: np.ndarray) -> np.ndarray:
    """(3, 3) rotation that turns e_z into z; a cyclic permutation where z is a coordinate axis."""
    x = np.eye(3)[(int(np.argmax(np.abs(z))) + 1) % 3]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.c_[x, np.cross(z, x), z]


def check_distance(pair, line: np.ndarray) -> None:
    """Require the pair's centre distance and overlapping face widths; line: (3,) from pinion to wheel [m]."""
    distance, shift = hypot(line[0], line[1]), line[2]
    a = abs(pair.a)
    agree = abs(distance - a) < 1e-6 * a
    remedy = f"the pair's a = {a / mm:.6g} mm; move the bodies or change a"
    require(agree, f"reference distance of the gear centres, {distance / mm:.6g} mm, must be {remedy}")
    apart = f"gear centres are {shift / mm:g} mm apart along z (face width {pair.b / mm:g} mm)"
    require(abs(shift) < pair.b, f"{apart}; move the bodies or localPositions")


def _in_frame(axes: np.ndarray, body: GearBody, origin: np.ndarray = ORIGIN) -> np.ndarray:
    """Reference coordinates (6) of a body as Rxyz body of a frame with these axes (columns) and this origin [m]."""
    angles = angles_of(tuple(map(tuple, axes.T @ body.gear_axes)))
    return np.r_[axes.T @ (body.reference[:3] - origin[:3]), angles]


def _check_parallel(pinion: GearBody, wheel: GearBody) -> None:
    angle = hypot(*np.cross(pinion.direction, wheel.direction))
    configuration = f"in the reference configuration, got {angle:.4g}"
    skew = f"axes of pinion and wheel must be parallel within {LARGEST_SKEW} rad {configuration}"
    remedy = "turn one body by referenceRotationMatrix, or give its gear's axis in localAxes"
    require(bool(angle < LARGEST_SKEW), f"{skew}; {remedy}")


def _spin_factors(body: GearBody) -> tuple[float, float]:
    """Factors of the fourth and sixth coordinate that count a body's turns about the gear's axis; 0 if none does.

    An Rxyz node is singular where its z axis points along global x: no coordinate counts the turns there.
    """
    if not body.kind.counts_turns:
        return 0.0, 0.0
    if body.kind.turns_about_z:
        return 0.0, 1.0
    from_x, from_z = float(body.direction[0]), float(body.axis[2])
    apart = abs(np.arccos(min(abs(from_x), 1)) - np.arccos(min(abs(from_z), 1)))
    lock = "a body on an Rxyz node must not turn its z axis into global x, where the node is singular"
    remedy = "use nodeType=exu.NodeType.RotationRotationVector, or put the gear on another axis of the body"
    example = "for a shaft along x no referenceRotationMatrix and localAxes=[[1, 0, 0], [1, 0, 0]]"
    require(bool(apart > LEAST_ANGLE_TO_SINGULARITY), f"{lock}; {remedy}: {example}")
    return (0.0, float(np.sign(from_z))) if abs(from_z) > abs(from_x) else (float(np.sign(from_x)), 0.0)
