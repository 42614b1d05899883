"""Structured quadrilateral mesh of a gear's transverse section, with the nodes and facets of its flanks.

Tooth 0 points along y; teeth count counter-clockwise; the left flank, which faces counter-clockwise, carries the load.
Tooth 0 of an internal gear lies at -y and points along y too; with the signs of `fem.gear.tooth_profile` its section
is built by the same steps, from the clamped outside of the rim to the tip.
"""

from itertools import pairwise

import numpy as np
from skfem import Basis, Mesh, MeshQuad

from fem.elasticity.mesh_density import Density
from fem.gear import tooth_profile
from fem.gear.gear import Gear
from fem.gear.tooth_profile import Polar
from fem.support.arguments import checked
from fem.support.validation import require

BORE, RIM = "bore", "rim"
#: Exponent by which flank nodes lie closer together near the tip: those of an internal gear, whose tips carry load
#: over a wider contact, need more. Nodes lie on the clamped circle within this share of its radius.
TOWARDS_TIP, TOWARDS_TIP_INTERNAL, ON_CIRCLE = 1.5, 1.75, 1e-6


def flank_arcs(gear: Gear, n: int, divide: int = 1, power: float | None = None) -> np.ndarray:
    """(n divide + 1,) arc lengths of flank nodes from root form to tip [m], closer together near the tip.

    power       `Density.tip_power`
    """
    low, high = tooth_profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))
    usual = TOWARDS_TIP_INTERNAL if gear.internal else TOWARDS_TIP
    coarse = high - (high - low) * np.linspace(1, 0, n + 1) ** (usual if power is None else power)
    return divided(coarse, divide)


def flank_node_arcs(gear: Gear, density: Density) -> np.ndarray:
    """(n,) arc lengths of flank nodes from root form to tip [m], with smaller steps beside the edges of the density."""
    nodes = flank_arcs(gear, density.flank, density.divide, density.tip_power)
    if not density.edges:
        return nodes
    low, high = density.edges[0], density.edges[-1]
    ends = f"({gear.roll_form:g}, {gear.roll_tip:g}) m"
    require(
        gear.roll_form < low and high < gear.roll_tip, f"edges must lie in {ends}, on the flank, got {density.edges}"
    )
    return refined_at_edges(tooth_profile.arc_length(gear, np.array(density.edges)), nodes)


def flank_hats(gear: Gear, density: Density) -> np.ndarray:
    """(n,) arc lengths of the tops of the hats along the flank [m]: every other node of the coarse section."""
    return flank_arcs(gear, density.flank, power=density.tip_power)[::2]


def flank_facets(gear: Gear, mesh: MeshQuad, tooth: int) -> np.ndarray:
    """Facets of the involute of the left flank of the given tooth."""
    angle = tooth_profile.polar(gear, mesh.p[:, mesh.facets].mean(axis=1)).psi * gear.z - 2 * np.pi * tooth
    ends = tooth_profile.polar(gear, mesh.p).r[mesh.facets]
    rounding = 1e-9 * abs(gear.r_a)
    low, high = gear.r_form - rounding, gear.r_a + rounding
    on_flank = (ends.min(axis=0) > low) & (ends.max(axis=0) < high) & (np.ptp(ends, axis=0) > gear.m_n * 1e-6)
    near = (angle > 0) & (angle < np.pi)
    boundary = np.zeros(mesh.facets.shape[1], bool)
    boundary[mesh.boundary_facets()] = True
    return np.flatnonzero(on_flank & near & boundary)


def flank_nodes(gear: Gear, mesh: MeshQuad, tooth: int) -> np.ndarray:
    """(2, n) vertices of the mesh on the flank of `flank_facets` [m], from root form to tip."""
    nodes = mesh.p[:, np.unique(mesh.facets[:, flank_facets(gear, mesh, tooth)])]
    return nodes[:, np.argsort(tooth_profile.polar(gear, nodes).r)]


def divided(nodes: np.ndarray, q: int) -> np.ndarray:
    """Each interval of nodes (..., n) cut into q equal ones."""
    n = nodes.shape[-1] - 1
    return np.apply_along_axis(lambda row: np.interp(np.linspace(0, n, n * q + 1), np.arange(n + 1), row), -1, nodes)


def coons(bottom, top, left, right) -> np.ndarray:
    """(2, n, m) grid between four edges: bottom and top (2, n), left and right (2, m) (transfinite interpolation)."""
    u = np.linspace(0, 1, bottom.shape[1])[:, None]
    v = np.linspace(0, 1, left.shape[1])[None, :]
    ruled = bottom[:, :, None] * (1 - v) + top[:, :, None] * v + left[:, None, :] * (1 - u) + right[:, None, :] * u
    corners = (1 - u) * ((1 - v) * bottom[:, :1, None] + v * top[:, :1, None])
    corners = corners + u * ((1 - v) * bottom[:, -1:, None] + v * top[:, -1:, None])
    return ruled - corners


def line(start, end, stations) -> np.ndarray:
    """(2, n) points on the straight line from start to end at stations in [0, 1]."""
    return np.asarray(start)[:, None] * (1 - stations) + np.asarray(end)[:, None] * stations


def mirrored(points: np.ndarray) -> np.ndarray:
    """Points reflected at the tooth's centre line."""
    return points * np.array([[-1.0], [1.0]])


def across_tooth(gear: Gear, density: Density, arcs: np.ndarray) -> np.ndarray:
    """Stations in [0, 1] across the tooth, closer together at both flanks, whose nodes lie at arcs (n,) [m].

    Beside edges of the density the layer below the flank is twice as thick as the steps along it.
    """
    depths = density.steps("tooth") ** 1.5
    if density.edges:
        after = np.searchsorted(arcs, tooth_profile.arc_length(gear, np.array(density.edges)) * (1 + 1e-9))
        thin = 2 * (arcs[after] - arcs[after - 1]).min() / (gear.m_t * np.pi / 4)
        depths = layers(thin, depths[-1] - depths[-2])
    return np.concatenate([depths / 2, 1 - depths[-2::-1] / 2])


def tooth_blocks(gear: Gear, density: Density) -> list[np.ndarray]:
    """The tooth above the middle of its fillets and the layer below it down to `rim_radius`, as (2, n, m) grids."""
    arcs = flank_node_arcs(gear, density)
    across = across_tooth(gear, density, arcs)
    upper, even = density.steps("fillet")[::-1] / 2, np.linspace(0, 1, across.size)
    involute = tooth_profile.cartesian(tooth_profile.flank(gear, tooth_profile.roll_at(gear, arcs)))
    side = np.hstack([tooth_profile.cartesian(tooth_profile.fillet(gear, upper)), involute[:, 1:]])
    foot = tooth_foot(gear, density)
    base = line(side[:, 0], mirrored(side)[:, 0], even)
    half_tip = float(tooth_profile.flank(gear, [gear.roll_tip]).psi[0])
    tip = tooth_profile.cartesian(Polar(np.full(even.size, gear.r_a), half_tip * (1 - 2 * even)))
    tooth = along_rows(coons(base, tip, side, mirrored(side)), across)
    tooth[:, :, -1] *= abs(gear.r_a) / np.hypot(*tooth[:, :, -1])
    top = np.hstack([foot[:, ::-1], tooth[:, 1:-1, 0], mirrored(foot)])
    return [tooth, rim_block(gear, density, top)]


def tooth_foot(gear: Gear, density: Density) -> np.ndarray:
    """(2, n) outline from the middle of the fillet to the middle of the space; the root land may have no width."""
    n = density.land * density.divide
    if gear.r_f * (np.pi / gear.z - gear.root.psi_f) > 0.02 * gear.m_n:
        lower = tooth_profile.fillet(gear, (1 + density.steps("fillet")) / 2)
        return np.hstack([tooth_profile.cartesian(lower), tooth_profile.cartesian(tooth_profile.root_land(gear, n))])
    r, psi = tooth_profile.fillet(gear, np.linspace(0.5, 1, density.steps("fillet").size + n))
    return tooth_profile.cartesian(Polar(np.append(r[:-1], gear.r_f), np.append(psi[:-1], np.pi / gear.z)))


def rim_radius(gear: Gear) -> float:
    """Radius of the circle that ends the layer below the root [m]."""
    return max(gear.r_f - 1.2 * gear.m_t, (gear.r_f + gear.r_clamp) / 2)


def rim_block(gear: Gear, density: Density, top: np.ndarray) -> np.ndarray:
    """Grid between the circle of `rim_radius` and the outline top (2, n) of one pitch."""
    psi = np.linspace(np.pi, -np.pi, top.shape[1]) / gear.z
    bottom = tooth_profile.cartesian(Polar(np.full(psi.size, rim_radius(gear)), psi))
    steps = rim_steps(density)
    return coons(bottom, top, line(bottom[:, 0], top[:, 0], steps), line(bottom[:, -1], top[:, -1], steps))


def rim_steps(density: Density) -> np.ndarray:
    """Stations in [0, 1] from `rim_radius` to the outline of the root."""
    return 1 - (1 - density.steps("rim")) ** density.rim_power


def body_radii(gear: Gear, density: Density) -> np.ndarray:
    """Radii from the clamped circle to `rim_radius` [m], closer together at both ends."""
    even = 2 * np.pi * density.steps("body")
    return gear.r_clamp + (rim_radius(gear) - gear.r_clamp) * (even - 0.4 * np.sin(even)) / (2 * np.pi)


def ring_angles(gear: Gear, density: Density) -> np.ndarray:
    """Angles of radial lines around the toothless rest of the section [rad], coarser away from the teeth."""
    start, half_turn = (density.behind + density.teeth + 1) * np.pi / gear.z, gear.sign * np.pi
    first, rest = np.pi / gear.z, half_turn - start
    growth = 1.1
    n = max(2, int(np.ceil(np.log1p(rest * (growth - 1) / first) / np.log(growth))))
    half = start + rest * (growth ** np.linspace(0, n, n * density.divide + 1) - 1) / (growth**n - 1)
    return np.concatenate([2 * half_turn - half, half[-2::-1]]) + (density.teeth - density.behind) * np.pi / gear.z


def polar_block(radii: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(2, n_angles, n_radii) grid on circles and radial lines."""
    r, psi = np.meshgrid(radii, angles)
    return np.stack([-r * np.sin(psi), r * np.cos(psi)])


def rotated(block: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Block turned counter-clockwise by angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * block[0] - s * block[1], s * block[0] + c * block[1]])


def pitch_blocks(gear: Gear, density: Density) -> list[np.ndarray]:
    """Grids of the pitch of tooth 0: tooth, layer below it, body down to the clamped circle."""
    tooth, rim = tooth_blocks(gear, density)
    return [tooth, rim, polar_block(body_radii(gear, density), np.linspace(np.pi, -np.pi, rim.shape[1]) / gear.z)]


def toothed_pitches(gear: Gear, density: Density) -> range:
    """Numbers of the pitches that have a tooth: all, or those of the density where a toothless rest is left."""
    if density.behind + density.teeth + 1 < abs(gear.z):
        return range(-density.behind, density.teeth + 1)
    return range(abs(gear.z))


def rest_blocks(gear: Gear, density: Density) -> list[np.ndarray]:
    """Grid of the toothless rest of the section, if there is one."""
    if len(toothed_pitches(gear, density)) == abs(gear.z):
        return []
    radii = body_radii(gear, density)
    outside = radii[-1] + (gear.r_f - radii[-1]) * rim_steps(density)
    return [polar_block(np.concatenate([radii, outside[1:]]), ring_angles(gear, density))]


@checked
def section(gear: Gear, density: Density) -> MeshQuad:
    """Transverse section of the whole gear: quadrilaterals of scikit-fem with the boundary "bore", or "rim" of a ring.

    density    numbers of elements along its parts, such as `fem.Resolution().density`
    """
    angles, blocks = 2 * np.pi / gear.z * np.array(toothed_pitches(gear, density)), pitch_blocks(gear, density)
    toothed = [rotated(block, angle) for angle in angles for block in blocks]
    return mesh_of(gear, toothed + rest_blocks(gear, density))


def mesh_of(gear: Gear, blocks: list[np.ndarray]) -> MeshQuad:
    """Mesh of grids (2, n, m) whose common nodes are joined, with the boundary "bore", or "rim" of a ring."""
    points, quads, offset = [], [], 0
    for block in blocks:
        n, m = block.shape[1:]
        index = offset + np.arange(n * m).reshape(n, m)
        quads.append(np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]).reshape(4, -1))
        points.append(block.reshape(2, -1))
        offset += n * m
    mesh = MeshQuad(*merged(np.hstack(points), np.hstack(quads), gear.m_n * 1e-7))
    return mesh.with_boundaries(clamped_boundary(gear, mesh))


def clamped_boundary(gear: Gear, mesh: Mesh) -> dict[str, np.ndarray]:
    """Facets where the gear is clamped, by the name of the boundary."""
    return {RIM if gear.internal else BORE: clamped_facets(gear, mesh)}


def clamped_facets(gear: Gear, mesh: Mesh) -> np.ndarray:
    """Boundary facets of a section, or of hexahedra, whose vertices lie on the circle where the gear is clamped.

    Nodes in the middle of straight facets lie inside the circle: those of a rim are not told by their radius.
    """
    on_circle = gear.sign * np.hypot(*mesh.p[:2]) < gear.r_clamp + ON_CIRCLE * abs(gear.r_clamp)
    facets = mesh.boundary_facets()
    return facets[on_circle[mesh.facets[:, facets]].all(axis=0)]


def on_hub(gear: Gear, section: Basis) -> np.ndarray:
    """(n_dofs,) whether a dof of a section lies on the circle where the gear is clamped."""
    held = np.zeros(section.N, bool)
    held[section.get_dofs(clamped_facets(gear, section.mesh)).flatten()] = True
    return held


def tiles(blocks: list[np.ndarray], size: int) -> np.ndarray:
    """(n_element,) numbers of tiles of up to size x size elements of `mesh_of` these grids."""
    numbers, count = [], 0
    for block in blocks:
        n, m = block.shape[1] - 1, block.shape[2] - 1
        rows, columns = np.arange(n) // size, np.arange(m) // size
        numbers.append((count + rows[:, None] * (columns[-1] + 1) + columns).ravel())
        count = numbers[-1][-1] + 1
    return np.concatenate(numbers)


def merged(points: np.ndarray, quads: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (2, n) without duplicates closer than tolerance [m], and the quadrilaterals (4, n) renumbered."""
    keys = np.round(points / tolerance).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    return np.ascontiguousarray(points[:, first]), np.ascontiguousarray(inverse.reshape(-1)[quads])


#: Elements beside an edge are smaller by this factor, and grow by this share of their distance from it: te then changes
#: smoothly while the contact passes the edge.
CLOSER, GROWTH = 4, 0.1
#: Each layer is thicker than the last by this factor.
THICKER = 1.5
#: Positions at which element sizes are evaluated: far more than there are nodes.
SAMPLES = 100_001


def refined_at_edges(edges, nodes: np.ndarray) -> np.ndarray:
    """Nodes spaced as nodes (n,), with edges (m,), increasing, among them and smaller elements beside each."""
    positions = np.linspace(nodes[0], nodes[-1], SAMPLES)
    usual = np.interp(positions, (nodes[1:] + nodes[:-1]) / 2, np.diff(nodes))
    size = usual
    for edge in edges:
        size = np.minimum(size, np.interp(edge, positions, usual) / CLOSER + GROWTH * np.abs(positions - edge))
    count = np.append(0.0, np.cumsum(np.diff(positions) * 2 / (size[1:] + size[:-1])))
    parts = []
    for start, end in pairwise(np.interp([nodes[0], *edges, nodes[-1]], positions, count)):
        stops = np.linspace(start, end, max(1, round(end - start)) + 1)
        parts.append(np.interp(stops[:-1], count, positions))
    return np.append(np.concatenate(parts), nodes[-1])


def layers(first: float, thickest: float) -> np.ndarray:
    """(n,) depths from 0 to 1 of layers: about `first` at 0, growing up to about `thickest`."""
    depths = [0.0, first]
    while depths[-1] < 1:
        depths.append(depths[-1] + min(THICKER * (depths[-1] - depths[-2]), thickest))
    return np.array(depths) / depths[-1]


def along_rows(grid: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(2, k, m) points of a grid (2, n, m) spaced along its m rows to shares (k,) of their lengths."""
    spaced = np.empty((2, shares.size, grid.shape[2]))
    for row, points in enumerate(np.moveaxis(grid, 2, 0)):
        length = np.append(0.0, np.cumsum(np.hypot(*np.diff(points))))
        spaced[:, :, row] = [np.interp(shares * length[-1], length, part) for part in points]
    return spaced
