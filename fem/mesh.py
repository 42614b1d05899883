"""Structured quadrilateral mesh of a gear's transverse section, its extrusion to hexahedra, and the flank's load basis.

Tooth 0 points along y; teeth count counter-clockwise; the flank that faces counter-clockwise carries the load.
"""

from dataclasses import dataclass, replace

import numpy as np
from skfem import MeshHex, MeshLine, MeshQuad

from fem import grading, profile
from fem.checks import as_floats, number, numbers
from fem.gear import Gear, require
from fem.profile import Polar
from fem.representation import short

BORE = "bore"
#: Parts of the section of which a density says the numbers of elements.
PARTS = ("flank", "fillet", "land", "tooth", "rim", "body")


@short()
@dataclass(frozen=True)
class Density:
    """Numbers of elements of the section; `refined(q)` divides each of them into q, `paired` joins two and two.

    flank, fillet, land     along the profile: involute, upper and lower half of the fillet each, root land
    tooth, rim, body        half across the tooth, in the layer below the root, from there to the bore
    width                   quadratic elements over half the face width
    teeth, behind           toothed pitches ahead of tooth 0 (counter-clockwise) and behind it
    rim_power               above 1: rim elements are smaller beside the root, which root stress asks for
    edges                   roll lengths on the flank [m], increasing, where elements are smaller, nodes lie and layers
                            below are thin; None: none, and with `nonlinear` and `dynamic` where reliefs begin
    """

    flank: int = 16
    fillet: int = 3
    land: int = 1
    tooth: int = 4
    rim: int = 4
    body: int = 7
    width: int = 3
    teeth: int = 2
    behind: int = 2
    divide: int = 1
    rim_power: float = 1.0
    edges: tuple[float, ...] | None = None

    def __post_init__(self):
        as_floats(self)
        if self.edges is not None:
            edges = numbers("edges", self.edges)
            rising = edges.ndim == 1 and bool((np.diff(edges) > 0).all())
            require(rising, f"edges must increase; sort them, got {self.edges}")
            object.__setattr__(self, "edges", tuple(edges.tolist()))
        for name in (*PARTS, "width", "teeth", "behind", "divide"):
            elements, least = number(name, getattr(self, name)), 0 if name in ("teeth", "behind") else 1
            whole = f"{name} must be a whole number of elements >= {least}, got {elements:g}"
            require(elements % 1 == 0 and elements >= least, whole)
            object.__setattr__(self, name, int(elements))
        require(1 <= self.rim_power <= 3, f"rim_power must lie in [1, 3], got {self.rim_power}")

    def refined(self, q: int) -> "Density":
        return replace(self, divide=self.divide * q)

    def paired(self) -> "Density":
        """One element instead of two: quadratic ones then have about as many dofs. ValueError where flank is odd."""
        require(self.flank % 2 == 0, f"flank must be an even number of elements, got {self.flank}")
        return replace(self, **{name: -(-getattr(self, name) // 2) for name in PARTS})

    def scaled(self, factor: float) -> "Density":
        """Numbers of pairs of elements, and of those across the width, times a factor, at least one; the same teeth."""
        numbers = {name: 2 * max(1, round(getattr(self, name) * factor / 2)) for name in PARTS}
        return replace(self, **numbers, width=max(1, round(self.width * factor)))

    def with_teeth(self, teeth: int, behind: int) -> "Density":
        return replace(self, teeth=teeth, behind=behind)

    def steps(self, name: str) -> np.ndarray:
        """(n + 1,) equidistant stations in [0, 1] along the part called name."""
        return np.linspace(0, 1, getattr(self, name) * self.divide + 1)


def flank_arcs(gear: Gear, n: int, divide: int = 1) -> np.ndarray:
    """(n divide + 1,) arc lengths of flank nodes from root form to tip [m], closer together near the tip."""
    low, high = profile.arc_length(gear, np.array([gear.roll_form, gear.roll_tip]))
    coarse = high - (high - low) * np.linspace(1, 0, n + 1) ** 1.5
    return divided(coarse, divide)


def flank_places(gear: Gear, density: Density) -> np.ndarray:
    """(n,) arc lengths of flank nodes from root form to tip [m], smaller steps beside the edges of the density."""
    nodes = flank_arcs(gear, density.flank, density.divide)
    if not density.edges:
        return nodes
    low, high = density.edges[0], density.edges[-1]
    ends = f"({gear.roll_form:g}, {gear.roll_tip:g}) m"
    require(
        gear.roll_form < low and high < gear.roll_tip, f"edges must lie in {ends}, on the flank, got {density.edges}"
    )
    return grading.beside(profile.arc_length(gear, np.array(density.edges)), nodes)


def flank_hats(gear: Gear, density: Density) -> np.ndarray:
    """(n,) arc lengths of the tops of the hats along the flank [m]: every other node of the coarse section."""
    return flank_arcs(gear, density.flank)[::2]


def flank_facets(gear: Gear, mesh: MeshQuad, tooth: int) -> np.ndarray:
    """Facets of the involute that faces counter-clockwise on the given tooth."""
    x, y = mesh.p[:, mesh.facets].mean(axis=1)
    angle = np.arctan2(-x, y) - 2 * np.pi * tooth / gear.z
    ends = np.hypot(*mesh.p)[mesh.facets]
    low, high = gear.r_form * (1 - 1e-9), gear.r_a * (1 + 1e-9)
    on_flank = (ends.min(axis=0) > low) & (ends.max(axis=0) < high) & (np.ptp(ends, axis=0) > gear.m_n * 1e-6)
    near = (angle > 0) & (angle < np.pi / gear.z)
    boundary = np.zeros(mesh.facets.shape[1], bool)
    boundary[mesh.boundary_facets()] = True
    return np.flatnonzero(on_flank & near & boundary)


def flank_nodes(gear: Gear, mesh: MeshQuad, tooth: int) -> np.ndarray:
    """(2, n) vertices of the mesh on that flank [m], from root form to tip."""
    nodes = mesh.p[:, np.unique(mesh.facets[:, flank_facets(gear, mesh, tooth)])]
    return nodes[:, np.argsort(np.hypot(*nodes))]


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
        after = np.searchsorted(arcs, profile.arc_length(gear, np.array(density.edges)) * (1 + 1e-9))
        thin = 2 * (arcs[after] - arcs[after - 1]).min() / (gear.m_t * np.pi / 4)
        depths = grading.layers(thin, depths[-1] - depths[-2])
    return np.concatenate([depths / 2, 1 - depths[-2::-1] / 2])


def tooth_blocks(gear: Gear, density: Density) -> list[np.ndarray]:
    """The tooth above the middle of its fillets and the layer below it down to `rim_radius`, as (2, n, m) grids."""
    arcs = flank_places(gear, density)
    across = across_tooth(gear, density, arcs)
    upper, even = density.steps("fillet")[::-1] / 2, np.linspace(0, 1, across.size)
    involute = profile.cartesian(profile.flank(gear, profile.roll_at(gear, arcs)))
    side = np.hstack([profile.cartesian(profile.fillet(gear, upper)), involute[:, 1:]])
    foot = tooth_foot(gear, density)
    base = line(side[:, 0], mirrored(side)[:, 0], even)
    half_tip = float(profile.flank(gear, [gear.roll_tip]).psi[0])
    tip = profile.cartesian(Polar(np.full(even.size, gear.r_a), half_tip * (1 - 2 * even)))
    tooth = grading.along_rows(coons(base, tip, side, mirrored(side)), across)
    tooth[:, :, -1] *= gear.r_a / np.hypot(*tooth[:, :, -1])
    top = np.hstack([foot[:, ::-1], tooth[:, 1:-1, 0], mirrored(foot)])
    return [tooth, rim_block(gear, density, top)]


def tooth_foot(gear: Gear, density: Density) -> np.ndarray:
    """(2, n) outline from the middle of the fillet to the middle of the space, whose land may have no width."""
    n = density.land * density.divide
    if gear.r_f * (np.pi / gear.z - gear.root.psi_f) > 0.02 * gear.m_n:
        lower = profile.fillet(gear, (1 + density.steps("fillet")) / 2)
        return np.hstack([profile.cartesian(lower), profile.cartesian(profile.root_land(gear, n))])
    r, psi = profile.fillet(gear, np.linspace(0.5, 1, density.steps("fillet").size + n))
    return profile.cartesian(Polar(np.append(r[:-1], gear.r_f), np.append(psi[:-1], np.pi / gear.z)))


def rim_radius(gear: Gear) -> float:
    """Radius of the circle that ends the layer below the root [m]."""
    return max(gear.r_f - 1.2 * gear.m_t, (gear.r_f + gear.d_bore / 2) / 2)


def rim_block(gear: Gear, density: Density, top: np.ndarray) -> np.ndarray:
    """Grid between the circle of `rim_radius` and the outline top (2, n) of one pitch."""
    psi = np.linspace(np.pi, -np.pi, top.shape[1]) / gear.z
    bottom = profile.cartesian(Polar(np.full(psi.size, rim_radius(gear)), psi))
    steps = rim_steps(density)
    return coons(bottom, top, line(bottom[:, 0], top[:, 0], steps), line(bottom[:, -1], top[:, -1], steps))


def rim_steps(density: Density) -> np.ndarray:
    """Stations in [0, 1] from `rim_radius` to the outline of the root."""
    return 1 - (1 - density.steps("rim")) ** density.rim_power


def body_radii(gear: Gear, density: Density) -> np.ndarray:
    """Radii from the bore to `rim_radius`, closer together at both [m]."""
    inner, outer = gear.d_bore / 2, rim_radius(gear)
    even = 2 * np.pi * density.steps("body")
    return inner + (outer - inner) * (even - 0.4 * np.sin(even)) / (2 * np.pi)


def ring_angles(gear: Gear, density: Density) -> np.ndarray:
    """Angles of radial lines around the toothless rest of the ring [rad], coarser away from the teeth."""
    start = (density.behind + density.teeth + 1) * np.pi / gear.z
    first, rest = np.pi / gear.z, np.pi - start
    growth = 1.1
    n = max(2, int(np.ceil(np.log1p(rest * (growth - 1) / first) / np.log(growth))))
    half = start + rest * (growth ** np.linspace(0, n, n * density.divide + 1) - 1) / (growth**n - 1)
    return np.concatenate([2 * np.pi - half, half[-2::-1]]) + (density.teeth - density.behind) * np.pi / gear.z


def polar_block(radii: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(2, n_angles, n_radii) grid on circles and radial lines."""
    r, psi = np.meshgrid(radii, angles)
    return np.stack([-r * np.sin(psi), r * np.cos(psi)])


def rotated(block: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Block turned counter-clockwise by angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * block[0] - s * block[1], s * block[0] + c * block[1]])


def section_blocks(gear: Gear, density: Density) -> list[np.ndarray]:
    """All grids of the transverse section: toothed pitches, body below them, toothless rest of the ring."""
    tooth, rim = tooth_blocks(gear, density)
    radii = body_radii(gear, density)
    body = polar_block(radii, np.linspace(np.pi, -np.pi, rim.shape[1]) / gear.z)
    some = density.behind + density.teeth + 1 < gear.z
    pitches = range(-density.behind, density.teeth + 1) if some else range(gear.z)
    blocks = [rotated(block, 2 * np.pi * k / gear.z) for k in pitches for block in (tooth, rim, body)]
    if not some:
        return blocks
    outside = radii[-1] + (gear.r_f - radii[-1]) * rim_steps(density)
    return [*blocks, polar_block(np.concatenate([radii, outside[1:]]), ring_angles(gear, density))]


def section(gear: Gear, density: Density) -> MeshQuad:
    """Transverse section of the whole gear with the boundary "bore"."""
    points, quads, offset = [], [], 0
    for block in section_blocks(gear, density):
        n, m = block.shape[1:]
        index = offset + np.arange(n * m).reshape(n, m)
        quads.append(np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]).reshape(4, -1))
        points.append(block.reshape(2, -1))
        offset += n * m
    mesh = MeshQuad(*merged(np.hstack(points), np.hstack(quads), gear.m_n * 1e-7))
    limit = gear.d_bore / 2 * (1 + 1e-6)
    return mesh.with_boundaries({BORE: lambda x: np.hypot(*x) < limit})


def merged(points: np.ndarray, cells: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (2, n) without duplicates closer than tolerance, and the cells renumbered."""
    keys = np.round(points / tolerance).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    return np.ascontiguousarray(points[:, first]), np.ascontiguousarray(inverse.reshape(-1)[cells])


def half_width(b: float, loaded: float, n: int, grading: float = 1.3) -> MeshLine:
    """Mesh of [0, b/2] from mid-plane to free end face: n elements up to loaded/2, then some beyond."""
    inner = loaded / 2 * (1 - np.linspace(1, 0, n + 1) ** grading)
    rest = b / 2 - inner[-1]
    if rest <= 1e-9 * b:
        return MeshLine(inner)
    beyond = max(1, round(rest / inner[1]))
    return MeshLine(np.concatenate([inner, inner[-1] + rest * np.arange(1, beyond + 1) / beyond]))


def both_sides(half: MeshLine) -> MeshLine:
    """Mesh from end face to end face, of that from mid-plane on."""
    nodes = np.sort(half.p[0])
    return MeshLine(np.concatenate([-nodes[:0:-1], nodes]))


def whole_width(gear: Gear, density: Density) -> MeshLine:
    """Mesh from end face to end face, finer towards both: 4 `width` elements."""
    return both_sides(half_width(gear.b, gear.b, 2 * density.width))


def hexahedra(gear: Gear, density: Density) -> MeshHex:
    """The whole width as hexahedra, along the helix, with the boundary "bore"; for pictures and export."""
    mesh = extruded(section(gear, density), whole_width(gear, density), gear.twist)
    limit = gear.d_bore / 2 * (1 + 1e-6)
    return mesh.with_boundaries({BORE: lambda x: np.hypot(x[0], x[1]) < limit})


def extruded(quads: MeshQuad, line: MeshLine, twist: float = 0.0) -> MeshHex:
    """Prism over quads along line, turned by twist [1/m]; node of section node i and line node j: i * n_line + j."""
    z = line.p[0]
    n = z.size
    x, y = rotated(quads.p[:, :, None], twist * z)
    points = np.stack([x.ravel(), y.ravel(), np.tile(z, quads.p.shape[1])])
    low, high = (quads.t[:, :, None] * n + end[None, None, :] for end in line.t)
    (a, b, c, d), (e, f, g, h) = low.reshape(4, -1), high.reshape(4, -1)
    return MeshHex(points, np.stack([a, e, d, b, h, f, c, g]))
