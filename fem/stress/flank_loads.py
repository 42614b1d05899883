"""What a contact presses on the flanks of one gear: pressure on strips, and their share of a section's unknowns.

The gear stands as in `mesh`: tooth 0 along y, teeth counted counter-clockwise, the flank that faces counter-clockwise
loaded. In a cell of a helical gear all is as in its middle section, as in `gap`.
"""

from dataclasses import dataclass

import numpy as np
from skfem import Basis, Mesh

from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import State, ToothContact
from fem.elasticity.mesh_density import Density
from fem.elasticity.section_mesh import rotated
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import ANGLES, Offsets, in_plane_of_action
from fem.pair.pair import GearPair
from fem.ste.inputs import check_offsets_mesh
from fem.ste.map_solver import bodies_of
from fem.support.validation import require, require_kind
from fem.units import deg

#: Of the root to the tooth's centre line; where it is steeper the contact beside it rules rather than bending.
LEAST_INCLINATION = 20 * deg


@dataclass(frozen=True)
class FlankLoad:
    """Pressure on one tooth, constant on strips of the profile; a cell is a slice of the width with its own strips.

    tooth       number of the tooth, counter-clockwise
    edges       (n_cell, n_strip + 1) arc lengths that bound the strips, none below the one before [m]
    low, high   (n_cell,) axial ends of the cells [m]; in a section 0 and 1: per metre
    force       (n_cell, n_strip) normal to the flank [N]
    """

    tooth: int
    edges: np.ndarray
    low: np.ndarray
    high: np.ndarray
    force: np.ndarray

    def __post_init__(self):
        n, got = (self.low.size, self.edges.shape[1] - 1), self.force.shape
        require(got == n, f"force must have the shape (cells, strips) = {n}, got {got}")
        size = np.diff(self.edges, axis=1)
        rising = bool((size >= 0).all() and (size[self.force != 0] > 0).all() and (self.high > self.low).all())
        require(rising, f"edges, and low to high, must increase; sort the strips from root to tip, got {self.edges}")

    @property
    def middle(self) -> np.ndarray:
        """(n_cell, n_strip) arc lengths of the middles of the strips [m]."""
        return (self.edges[:, 1:] + self.edges[:, :-1]) / 2

    def section(self, axial: float) -> "FlankLoad":
        """Line load of the cell at an axial place, if there is one [N/m]."""
        cell = np.flatnonzero((self.low <= axial) & (axial < self.high))[:1]
        line_load = self.force[cell] / (self.high - self.low)[cell, None]
        return FlankLoad(self.tooth, self.edges[cell], np.zeros(cell.size), np.ones(cell.size), line_load)

    @property
    def extent(self) -> np.ndarray:
        """(2,) middle and half-width of the strips that carry load, in arc length [m]."""
        pressed = self.force > 0
        low, high = self.edges[:, :-1][pressed].min(), self.edges[:, 1:][pressed].max()
        return np.array([low + high, high - low]) / 2


def encounters(
    pair: GearPair, phases, offsets: Offsets | None, resolution: Resolution | None
) -> tuple[list[ToothContact], float]:
    """Meetings of the pair at phases, with the compliances that a map has, and their misalignment [rad]."""
    offsets = Offsets() if offsets is None else offsets
    resolution = Resolution() if resolution is None else resolution
    require_kind("offsets", offsets, Offsets)
    require_kind("resolution", resolution, Resolution)
    axes = ", ".join(offsets.axes())
    require(not axes, f"offsets must have one value each, got several of {axes}; take one after the other")
    values = offsets.values(pair)
    check_offsets_mesh(pair, values["a"], values["axial"])
    (pinion, wheel), slices = bodies_of(pair, values, resolution)
    a, axial, misalignment, *errors = (float(values[name][0]) for name in ("a", "axial", *ANGLES))
    meetings = [MeshPosition(pair, a, axial, float(phase)) for phase in phases]
    in_plane = in_plane_of_action(GearPair(pair.pinion, pair.wheel, a=a).alpha_wt, *errors)
    return [ToothContact(meeting, pinion, wheel, slices) for meeting in meetings], misalignment + in_plane


def flank_loads(encounter: ToothContact, state: State) -> tuple[list[FlankLoad], list[FlankLoad]]:
    """What a contact presses on pinion and wheel, over the whole width; only teeth that carry load."""
    cells, meeting = state.cells, encounter.meeting
    found: tuple[list[FlankLoad], list[FlankLoad]] = ([], [])
    if state.strips is None or state.load is None:
        require(not state.force.any(), "state must know its strips; solve the contact with ToothContact.state")
        return found
    for number in np.unique(cells.number[state.force > 0]):
        own = np.flatnonzero((cells.number == number) & (state.force > 0))
        for side, gear in enumerate((meeting.pair.pinion, meeting.pair.wheel)):
            edges, force = _sorted_strips(gear, state.strips.arcs[side, own], state.load[own], state.strips.width[own])
            low, high = (ends[own] - side * meeting.axial for ends in (cells.low, cells.high))
            load = FlankLoad(-int(number) if side else int(number), edges, low, high, force)
            found[side].append(_on_both_halves(load) if encounter.pinion.share < 1 else load)
    return found


def _on_both_halves(load: FlankLoad) -> FlankLoad:
    low, high = np.concatenate([-load.high[::-1], load.low]), np.concatenate([-load.low[::-1], load.high])
    edges, force = (np.concatenate([part[::-1], part]) for part in (load.edges, load.force))
    return FlankLoad(load.tooth, edges, low, high, force)


def with_loaded_teeth(density: Density, loads: list[FlankLoad]) -> Density:
    """Density with all loaded teeth, and one more on either side as neighbours stiffen the rim."""
    teeth = [load.tooth for load in loads]
    return density.with_teeth(max([0, *teeth]) + 1, 1 - min([0, *teeth]))


def _sorted_strips(gear: Gear, arcs: np.ndarray, force: np.ndarray, width) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n, m + 1) of strips around arcs (n, m), no wider than the flank, and their forces, from root to tip.

    Where the tip's corner touches, several strips may lie there: each takes the width (n, m) it has on the mate.
    """
    order = np.argsort(arcs, axis=1)
    arcs, force, width = (np.take_along_axis(x, order, axis=1) for x in (arcs, force, width))
    between = (arcs[:, 1:] + arcs[:, :-1]) / 2
    first, last = 2 * arcs[:, :1] - between[:, :1], 2 * arcs[:, -1:] - between[:, -1:]
    start, end = flank_ends(gear)
    edges = np.clip(np.hstack([first, between, last]), start, end)
    loaded = width * (force > 0)
    edges[:, 1:] = np.maximum(edges[:, 1:], start + np.cumsum(loaded, axis=1))
    edges[:, :-1] = np.minimum(edges[:, :-1], end - np.cumsum(loaded[:, ::-1], axis=1)[:, ::-1])
    return edges, force


def flank_ends(gear: Gear) -> np.ndarray:
    """(2,) arc lengths of root form and tip [m]."""
    return tooth_profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))


def flank_points(gear: Gear, tooth: int, arcs: np.ndarray) -> np.ndarray:
    """(2, n) points of a tooth's loaded flank at arc lengths arcs."""
    return tooth_profile.cartesian(
        tooth_profile.flank(gear, tooth_profile.roll_at(gear, arcs)), 2 * np.pi * tooth / gear.z
    )


def arcs_of(gear: Gear, points: np.ndarray) -> np.ndarray:
    """Arc lengths of points (2, ...) of a flank, which may begin on the base circle; inverse of `flank_points`."""
    return np.maximum((points**2).sum(axis=0) - gear.r_b**2, 0.0) / (2 * gear.r_b)


def push(gear: Gear, tooth: int, arcs: np.ndarray) -> np.ndarray:
    """(3, ...) unit normals into the flank at arc lengths arcs."""
    tangent = np.pi / 2 + gear.psi_b - tooth_profile.roll_at(gear, arcs) / gear.r_b + 2 * np.pi * tooth / gear.z
    across = np.cos(gear.beta_b)
    return np.stack([across * np.sin(tangent), -across * np.cos(tangent), np.sin(gear.beta_b) + 0 * tangent])


def outline(gear: Gear, mesh: Mesh, tooth: int) -> tuple[np.ndarray, np.ndarray]:
    """Boundary facets of a section on the loaded side of a tooth: on its flank, and on the root below it."""
    facets = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, facets]]
    radius, (x, y) = np.hypot(*ends), ends.mean(axis=1)
    angle = (np.arctan2(-x, y) - 2 * np.pi * tooth / gear.z + np.pi) % (2 * np.pi) - np.pi
    steep = np.ptp(radius, axis=0) > 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]))
    beside = (angle > 0) & (angle < np.pi / gear.z)
    above = radius.min(axis=0) > gear.r_form * (1 - 1e-9)
    below = (radius.max(axis=0) < gear.r_form * (1 + 1e-9)) & (radius.min(axis=0) > gear.r_f * (1 - 1e-4))
    order = np.argsort(-angle)
    return facets[order][(beside & above & steep)[order]], facets[order][(beside & below)[order]]


def inclination(gear: Gear, mesh: Mesh, tooth: int) -> np.ndarray:
    """(n,) of the root's facets to the tooth's centre line [rad]; negative where an undercut tooth widens."""
    facets = outline(gear, mesh, tooth)[1]
    start, end = mesh.p[:, mesh.facets[:, facets]].transpose(1, 0, 2)
    x, y = rotated(end - start, -2 * np.pi * tooth / gear.z)
    return np.arctan2(x * np.sign(y), np.abs(y))


def bent_root(gear: Gear, mesh: Mesh, tooth: int) -> np.ndarray:
    """Facets of the root whose stress comes from bending rather than from the contact beside it."""
    return outline(gear, mesh, tooth)[1][inclination(gear, mesh, tooth) >= LEAST_INCLINATION]


def flank_shares(gear: Gear, section: Basis, tooth: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_dofs, n_strip) means of the shape functions of a section over strips low to high of a tooth's flank."""
    mesh, (facets, _) = section.mesh, outline(gear, section.mesh, tooth)
    require(facets.size > 0, f"tooth {tooth} is not on the mesh; raise the density's teeth")
    nodes = mesh.facets[:, facets]
    dofs = [*section.dofs.nodal_dofs[0][nodes]]
    if section.elem.facet_dofs:
        dofs.append(section.dofs.facet_dofs[0][facets])
    return gathered(dofs, strip_means(arcs_of(gear, mesh.p[:, nodes]), low, high, quadratic=len(dofs) == 3), section.N)


def strip_means(ends: np.ndarray, low: np.ndarray, high: np.ndarray, *, quadratic: bool) -> np.ndarray:
    """(n_shape, n_interval, n_strip) means over strips low to high of the shapes on intervals with ends (2, n)."""
    points, weights = np.polynomial.legendre.leggauss(3)
    low = np.maximum(ends.min(axis=0)[:, None], low)
    high = np.maximum(np.minimum(ends.max(axis=0)[:, None], high), low)
    at = (low + high)[..., None] / 2 + (high - low)[..., None] / 2 * points
    t = (at - ends[0][:, None, None]) / (ends[1] - ends[0])[:, None, None]
    shapes = [(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)] if quadratic else [1 - t, t]
    covered = (high - low).sum(axis=0)
    share = np.divide(high - low, covered, out=np.zeros_like(high), where=covered > 0)
    return np.stack([shape @ (weights / 2) * share for shape in shapes])


def gathered(dofs, means: np.ndarray, n: int) -> np.ndarray:
    """(n, n_strip) sums of means that belong to the same of n dofs."""
    shares = np.zeros((n, means.shape[2]))
    for dof, mean in zip(dofs, means, strict=True):
        np.add.at(shares, dof, mean)
    return shares
