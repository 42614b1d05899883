"""Line meshes across the face width, and the extrusion of the section to hexahedra along the helix."""

from math import log, log1p

import numpy as np
from skfem import MeshHex, MeshLine, MeshQuad

from fem.elasticity.face_symmetry import WholeFace
from fem.elasticity.mesh_density import Density
from fem.elasticity.section_mesh import clamped_boundary, rotated, section
from fem.gear.gear import Gear
from fem.support.arguments import checked

#: Width of an element over that of the element before it, where the face is not loaded.
GROWTH = 1.5


def half_face(b: float, loaded: float, n: int, grading: float = 1.3) -> MeshLine:
    """Mesh of [0, b/2] from mid-plane to the end face: n elements up to loaded/2, then elements that grow.

    The first of these is about as wide as the first in mid-plane: what is not loaded adds few elements.
    """
    inner = loaded / 2 * (1 - np.linspace(1, 0, n + 1) ** grading)
    rest = b / 2 - inner[-1]
    if rest <= 1e-9 * b:
        return MeshLine(inner)
    beyond = max(1, round(log1p(rest / inner[1] * (GROWTH - 1)) / log(GROWTH)))
    grown = (GROWTH ** np.arange(1, beyond + 1) - 1) / (GROWTH**beyond - 1)
    return MeshLine(np.concatenate([inner, inner[-1] + rest * grown]))


def both_sides(half: MeshLine) -> MeshLine:
    """Mesh from end face to end face; half is the mesh from mid-plane on."""
    return MeshLine(WholeFace().positions(np.sort(half.p[0])))


@checked
def hexahedra(gear: Gear, density: Density) -> MeshHex:
    """The gear as hexahedra along the helix, 4 `width` of them from end face to end face; boundary as in `section`."""
    line = both_sides(half_face(gear.b, gear.b, 2 * density.width))
    mesh = extruded(section(gear, density), line, gear.twist)
    return mesh.with_boundaries(clamped_boundary(gear, mesh))


def extruded(quads: MeshQuad, line: MeshLine, twist: float = 0.0) -> MeshHex:
    """Prism over quads along line, turned by twist [1/m]; node of section node i and line node j: i * n_line + j."""
    z = line.p[0]
    n = z.size
    x, y = rotated(quads.p[:, :, None], twist * z)
    points = np.stack([x.ravel(), y.ravel(), np.tile(z, quads.p.shape[1])])
    low, high = (quads.t[:, :, None] * n + end[None, None, :] for end in line.t)
    (a, b, c, d), (e, f, g, h) = low.reshape(4, -1), high.reshape(4, -1)
    return MeshHex(points, np.stack([a, e, d, b, h, f, c, g]))
