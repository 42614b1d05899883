"""How fine the FE mesh of a gear is: numbers of elements along each part of the section and across the width."""

from dataclasses import dataclass, replace

import numpy as np

from fem.support.arguments import Finite, checked
from fem.support.representation import short
from fem.support.validation import as_floats, increasing, number, require, set_fields

#: Parts of the section of which a density says the numbers of elements.
PARTS = ("flank", "fillet", "land", "tooth", "rim", "body")


@short()
@dataclass(frozen=True)
class Density:
    """Numbers of elements of the section; `refined(q)` divides each element into q, `paired` joins pairs of them.

    flank, fillet, land     along the profile: involute, upper and lower half of the fillet each, root land
    tooth, rim, body        half across the tooth, in the layer below the root, from there to the bore
    width                   quadratic elements over half the face width
    teeth, behind           toothed pitches ahead of tooth 0 (counter-clockwise) and behind it
    rim_power               above 1: rim elements are smaller beside the root, as root stress needs
    tip_power               above 1: flank elements are smaller towards the tip; None: 1.5, of internal gears 1.75, and
                            2.25 of both gears in maps of internal pairs, whose tip corners carry load for longer. On
                            the 1.5 of maps of external pairs te is up to 0.3 % of its mean off while teeth take over,
                            0.6 % with few teeth under heavy load (z 20/33); 2.25 gives 0.15 and 0.4 %, and helical
                            pairs 2 % less peak to peak
    edges                   roll lengths on the flank [m], increasing, with a node at each, smaller elements beside it
                            and thin layers below; None: none, except that `fem.nonlinear` and `fem.dynamic` take those
                            where reliefs begin
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
    tip_power: float | None = None
    edges: tuple[float, ...] | None = None

    def __post_init__(self):
        as_floats(self)
        if self.edges is not None:
            set_fields(self, edges=tuple(increasing("edges", self.edges, least=0).tolist()))
        for name in (*PARTS, "width", "teeth", "behind", "divide"):
            elements, least = number(name, getattr(self, name)), 0 if name in ("teeth", "behind") else 1
            whole = f"{name} must be a whole number of elements >= {least}, got {elements:g}"
            require(elements % 1 == 0 and elements >= least, whole)
            set_fields(self, **{name: int(elements)})
        require(1 <= self.rim_power <= 3, f"rim_power must lie in [1, 3], got {self.rim_power}")
        if self.tip_power is not None:
            require(1 <= self.tip_power <= 3, f"tip_power must lie in [1, 3], got {self.tip_power}")

    @checked
    def refined(self, q: int) -> "Density":
        """Density with each element of the section divided into q along each direction."""
        return replace(self, divide=self.divide * q)

    def paired(self) -> "Density":
        """Density with one element for two: about as many dofs if quadratic. ValueError where flank is odd."""
        require(self.flank % 2 == 0, f"flank must be an even number of elements, got {self.flank}")
        return replace(self, **{name: -(-getattr(self, name) // 2) for name in PARTS})

    @checked
    def scaled(self, factor: Finite) -> "Density":
        """Density with numbers of pairs of elements, and of elements across the width, times a factor; at least 1."""
        numbers = {name: 2 * max(1, round(getattr(self, name) * factor / 2)) for name in PARTS}
        return replace(self, **numbers, width=max(1, round(self.width * factor)))

    @checked
    def with_teeth(self, teeth: int, behind: int) -> "Density":
        """Density with these numbers of toothed pitches ahead of tooth 0 and behind it."""
        return replace(self, teeth=teeth, behind=behind)

    @checked
    def steps(self, name: str) -> np.ndarray:
        """(n + 1,) equidistant stations in [0, 1] along the part called name."""
        require(name in PARTS, f"name must be one of {PARTS}, got {name!r}")
        return np.linspace(0, 1, getattr(self, name) * self.divide + 1)
