"""The modelled part of the face width: all of it, or the half above mid-plane where symmetry gives the other half.

Axial positions count from mid-plane. The two classes hold all that depends on the symmetry: the displacements that it
clamps, the positions of the mirrored forces, and the extension of results from the modelled part to the whole face.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fem.gear.gear import Gear

#: Nodes lie on mid-plane within this share of the face width.
ON_MID_PLANE = 1e-9


@dataclass(frozen=True)
class WholeFace:
    """Both halves of the face width are modelled."""

    name: ClassVar[str] = "whole"
    #: Share of the load that acts on the modelled part.
    share: ClassVar[float] = 1.0
    #: Relative distance from mid-plane at which the modelled part begins; -1 and 1: the end faces.
    start: ClassVar[float] = -1.0
    #: Displacement components that vanish in mid-plane.
    clamped_in_mid_plane: ClassVar[tuple[int, ...]] = ()
    antisymmetric: ClassVar[bool] = False

    def positions(self, upper: np.ndarray) -> np.ndarray:
        """Axial positions on the modelled part; upper (n,) are those from mid-plane on, increasing from 0 [m]."""
        return np.concatenate([-upper[:0:-1], upper])

    def ends(self, low: float, high: float) -> tuple[float, float]:
        """Axial ends of the modelled part; low and high are those of the whole face [m]."""
        return low, high

    def images(self, axial: np.ndarray) -> list[np.ndarray]:
        """Axial positions of the forces on the model and of their mirror images [m]."""
        return [axial]

    def slices(self, number: int) -> int:
        """Number of slices of the modelled part; number is that of the whole face."""
        return number

    def unfolded(self, low: np.ndarray, high: np.ndarray, *values: np.ndarray) -> tuple[np.ndarray, ...]:
        """Ends (n,) of slices and values (n, ...) on them, over the whole face."""
        return low, high, *values


@dataclass(frozen=True)
class HalfFace:
    """The half above mid-plane is modelled; the forces on both halves are equal, or opposite if antisymmetric."""

    antisymmetric: bool = False
    share: ClassVar[float] = 0.5
    start: ClassVar[float] = 0.0

    @property
    def name(self) -> str:
        return "odd" if self.antisymmetric else "even"

    @property
    def clamped_in_mid_plane(self) -> tuple[int, ...]:
        """Equal forces do not move mid-plane along the axis, opposite ones do not move it in the transverse section."""
        return (0, 1) if self.antisymmetric else (2,)

    def positions(self, upper: np.ndarray) -> np.ndarray:
        """As in `WholeFace`."""
        return upper

    def ends(self, low: float, high: float) -> tuple[float, float]:
        """As in `WholeFace`."""
        return 0.0, high

    def images(self, axial: np.ndarray) -> list[np.ndarray]:
        """As in `WholeFace`, for equal forces."""
        return [axial, -axial]

    def slices(self, number: int) -> int:
        """As in `WholeFace`."""
        return number // 2

    def unfolded(self, low: np.ndarray, high: np.ndarray, *values: np.ndarray) -> tuple[np.ndarray, ...]:
        """As in `WholeFace`."""
        ends = np.concatenate([-high[::-1], low]), np.concatenate([-low[::-1], high])
        return *ends, *(np.concatenate([value[::-1], value]) for value in values)


Face = WholeFace | HalfFace


def clamped(gear: Gear, held: np.ndarray, points: np.ndarray, components: int, face: Face) -> np.ndarray:
    """(components, ...) whether a displacement vanishes: all do on the rigid hub, some in the plane of symmetry.

    held        (...) whether a point lies on the hub; broadcasts
    points      (2, ...) in the transverse section, or (3, ...) in space [m]
    """
    vanish = np.zeros((components, *points.shape[1:]), bool)
    vanish |= held
    if len(points) == 3:
        for component in face.clamped_in_mid_plane:
            vanish[component] |= np.abs(points[2]) < ON_MID_PLANE * gear.b
    return vanish
