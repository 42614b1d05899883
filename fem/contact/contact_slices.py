"""Slices of tooth pairs at one mesh position: where their flanks are closest, and the gap across them, a parabola."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import cos
from typing import NamedTuple

import numpy as np

from fem.contact.closest_point import Closest, closest_points
from fem.contact.flank_gap import OUT_OF_REACH
from fem.contact.mesh_geometry import PairGeometry, host_changes_at, pair_geometry
from fem.pair import hertz
from fem.pair.mesh_position import MeshPosition
from fem.support.numba_cache import kept_unchecked
from fem.support.validation import set_fields


@dataclass(frozen=True)
class ContactSlices:
    """Slices of tooth pairs: number of the tooth pair, axial ends low and high [m], each (n,).

    te is the transmission error [m], a number or (n,), about which gap and approach are linearized; mesh holds the two
    gears for compiled code, made from the position by default. In a slice gap and load are those of its middle section,
    along the line of contact.
    """

    position: MeshPosition
    number: np.ndarray
    low: np.ndarray
    high: np.ndarray
    te: float | np.ndarray = 0.0
    mesh: PairGeometry = field(default=None, repr=False, compare=False)  # type: ignore[assignment]

    def __post_init__(self):
        if self.mesh is None:
            set_fields(self, mesh=pair_geometry(self.position))

    def __getstate__(self) -> dict:
        """For another process, without the mesh: its keys are those of this process."""
        return {name: value for name, value in self.__dict__.items() if name != "mesh"}

    def __setstate__(self, values: dict) -> None:
        set_fields(self, **values, mesh=pair_geometry(values["position"]))

    def part(self, rows: np.ndarray) -> "ContactSlices":
        """Some of the slices, whose closest points are known."""
        slices = replace(self, number=self.number[rows], low=self.low[rows], high=self.high[rows])
        return slices.closest_at(Closest(*(values[rows] for values in self.closest)))

    def closest_at(self, closest: Closest) -> "ContactSlices":
        """The same slices, whose flanks are known to be closest at some points."""
        slices = replace(self)
        set_fields(slices, closest=closest)
        return slices

    def in_middle(self, te: float) -> "ContactSlices":
        """The slices about another transmission error [m], where flanks are closest in their middle sections."""
        closest = closest_in(self.mesh, self.number, self.middle, self.middle, te)
        return replace(self, te=te).closest_at(Closest(*closest))

    @property
    def middle(self) -> np.ndarray:
        """(n,) axial positions of the middle sections [m]."""
        return (self.low + self.high) / 2

    @property
    def width(self) -> np.ndarray:
        """(n,) axial widths [m]."""
        return self.high - self.low

    @property
    def length(self) -> np.ndarray:
        """(n,) lengths of the line of contact in the slices [m]."""
        return self.width / cos(self.position.pair.beta_b)

    @property
    def pinion_is_host(self) -> np.ndarray:
        """(n,) whether the pinion carries the strips."""
        return self.position.nominal(self.number, self.middle) < host_changes_at(self.position.path)

    @cached_property
    def closest(self) -> Closest:
        """Where the flanks are closest."""
        return Closest(*closest_in(self.mesh, self.number, self.low, self.high, self.te))

    def arcs_at(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Arc lengths on pinion and wheel of points beside where the flanks are closest [m], and tilts there [rad].

        At a tip corner that ends the contact the force, along the normal of the host, is tilted from that of the mate.
        Arc lengths and tilts (2, n, m), the mate's from its tip on.

        distance    (n, m) distances of the points along the profile away from the mate's tip [m]
        """
        gears, host = self.mesh.geometry.gears, np.where(self.pinion_is_host, 0, 1)
        mate_roll = np.minimum(self.closest.foot, gears["roll_tip"][1 - host])
        from_vertex = distance - np.minimum(self.closest.from_edge, 0.0)[:, None]
        tilt = cos(self.position.pair.beta_b) * np.maximum(from_vertex, 0.0) / self.closest.radius[:, None]
        of_host = (self.closest.roll**2 / 2 / gears["r_b"][host])[:, None] + distance
        of_mate = (mate_roll**2 / 2 / gears["r_b"][1 - host])[:, None] - distance
        on_pinion = self.pinion_is_host[:, None]
        arcs = np.where(on_pinion, (of_host, of_mate), (of_mate, of_host))
        return arcs, np.where(on_pinion, (0 * tilt, tilt), (tilt, 0 * tilt))

    @property
    def flattening(self) -> np.ndarray:
        """(n,) flattening of both flanks per force in a slice [m/N]."""
        return self.mesh.geometry.position["flattening"] / self.length

    def half_width(self, line_load: np.ndarray) -> np.ndarray:
        """Hertzian half-widths (n,) [m] under forces per axial length (..., n) [N/m]."""
        return hertz.half_width(line_load, self.closest.radius, self.mesh.geometry.position["flattening"])

    def gap_by(self, misalignment) -> np.ndarray:
        """(..., n) normal gap that misalignments (...) [rad], as in `fem.Offsets`, add [m]."""
        return cos(self.position.pair.beta_b) * np.multiply.outer(misalignment, self.middle)

    def slope_by(self, misalignment) -> np.ndarray:
        """(..., n) difference of the gap between middle and high end that misalignments (...) [rad] add [m]."""
        return cos(self.position.pair.beta_b) * np.multiply.outer(misalignment, self.width / 2)

    def first_touch(self, misalignment) -> np.ndarray:
        """(..., n) transmission errors at which the slices touch without load under misalignments (...) [rad]."""
        return (self.closest.gap + self.gap_by(misalignment)) / self.closest.approach


def closest_in(mesh: PairGeometry, number, low, high, te) -> np.ndarray:
    """(6, n) `Closest` of slices (n,) of tooth pairs, linearized about transmission errors () or (n,) [m]."""
    return mesh.call(closest_points, number, low, high, np.full(low.size, te, float))


class GapAcross(NamedTuple):
    """Gap middle + slope x + bend x^2 [m] of n slices at x from -1, the low, to 1, the high end; each (n,).

    approach    normal approach per transmission error
    """

    middle: np.ndarray
    slope: np.ndarray
    bend: np.ndarray
    approach: np.ndarray

    def misaligned(self, slices: ContactSlices, misalignment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gaps in the middle and slopes (m, n) [m] under misalignments (m,) [rad], as in `fem.Offsets`."""
        return self.middle + slices.gap_by(misalignment), self.slope + slices.slope_by(misalignment)


def gap_across(slices: ContactSlices) -> tuple[ContactSlices, GapAcross]:
    """Slices that adjoin within each tooth pair, closest in their middle sections, and the aligned gap across them."""
    first = np.append(True, np.diff(slices.number) != 0)
    last = np.append(first[1:], True)
    number = np.concatenate([slices.number, slices.number[last], slices.number])
    axial = np.concatenate([slices.low, slices.high[last], slices.middle])
    closest = closest_in(slices.mesh, number, axial, axial, slices.te)
    n, ends = first.size, closest[2, : -first.size]
    high = np.append(ends[1:n], 0.0)
    high[last] = ends[n:]
    slices = slices.closest_at(Closest(*closest[:, -n:]))
    roll, path = slices.position.nominal(slices.number, slices.middle), slices.position.path
    beyond = (roll < path.start) | (roll > path.end)
    middle, slope, bend = parabolas(ends[:n], slices.closest.gap, high, beyond)
    return slices, GapAcross(middle, slope, bend, slices.closest.approach)


@kept_unchecked
def parabolas(low, middle, high, beyond):
    """(3, n) middle, slope and bend of gaps (n,) at the ends and in the middle of slices.

    An end out of reach continues the gap linearly. Slices beyond the path of contact are closest at an end.
    """
    parts = np.empty((3, low.size))
    for i in range(low.size):
        at_low, at_high = low[i], high[i]
        if at_low >= OUT_OF_REACH:
            at_low = 2 * middle[i] - at_high
        elif at_high >= OUT_OF_REACH:
            at_high = 2 * middle[i] - at_low
        slope, bend = (at_high - at_low) / 2, (at_high + at_low) / 2 - middle[i]
        if beyond[i]:
            bend = min(bend, abs(slope) / 2)
        parts[0, i], parts[1, i], parts[2, i] = min(at_low, at_high) + abs(slope) - bend, slope, bend
    return parts


@kept_unchecked
def least_gaps(middle, slope, bend):
    """(m, n) least gaps [m] across slices with gaps and slopes (m, n) and bends (n,)."""
    least = np.empty(middle.shape)
    for k in range(len(middle)):
        for i in range(bend.size):
            least[k, i] = middle[k, i] + bend[i] - abs(slope[k, i])
            if 2 * bend[i] > abs(slope[k, i]):
                least[k, i] = middle[k, i] - slope[k, i] ** 2 / (4 * bend[i])
    return least
