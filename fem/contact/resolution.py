"""How finely a map is solved: FE mesh, slices of the face width, strips or line loads."""

from dataclasses import dataclass, field, replace

import numpy as np

from fem.elasticity.mesh_density import Density
from fem.support.arguments import Finite, checked
from fem.support.representation import short
from fem.support.validation import number, require


@short()
@dataclass(frozen=True)
class Resolution:
    """How finely a map is solved.

    density     of the FE mesh, whose quadratic elements are made of two `paired`; `teeth` come from the contact ratio
    slices      of the face width where gap or lines of contact vary across it; elsewhere half of the width has 3
    resolved    strips along the profile in every slice (True), or one line load, pressed as Hertz says (False): there
                the peak to peak of wide, crowned helical pairs takes 40 slices and more; `accuracy=` tells
    neighbours  teeth up to so many pitches apart move one another, as programs have it that read the next ones only;
                None: all in contact, which are two pitches apart where three pairs are
    """

    density: Density = field(default=Density(width=4))
    slices: int = 20
    resolved: bool = True
    neighbours: int | None = None

    def __post_init__(self):
        if self.neighbours is not None:
            pitches = f"neighbours must be a whole number of pitches >= 0, or None for all teeth, got {self.neighbours}"
            require(number("neighbours", self.neighbours) % 1 == 0 and self.neighbours >= 0, pitches)
            object.__setattr__(self, "neighbours", int(self.neighbours))
        whole = f"slices must be an even number, at least 2, got {self.slices}"
        require(number("slices", self.slices) % 2 == 0 and self.slices >= 2, whole)
        object.__setattr__(self, "slices", int(self.slices))
        mode = f"resolved must be True (strips) or False (one line load), got {self.resolved!r}"
        require(isinstance(self.resolved, bool | np.bool_), mode)
        object.__setattr__(self, "resolved", bool(self.resolved))
        require(
            isinstance(self.density, Density),
            f"density must be a fem.Density, got {self.density!r}",
        )
        self.density.paired()

    def compared(self) -> "Resolution":
        """About two thirds as fine in every direction, or half as fine again where nothing coarser is left in one."""
        coarser = self.scaled(2 / 3)
        left = self.slices > coarser.slices and self.density.flank > coarser.density.flank
        return coarser if left and self.density.width > coarser.density.width else self.finer()

    def finer(self) -> "Resolution":
        """Half as fine again in every direction."""
        return self.scaled(3 / 2)

    def finer_across(self) -> "Resolution":
        """Half as fine again across the width."""
        finer = self.finer()
        return replace(finer, density=replace(self.density, width=finer.density.width))

    def finer_inside(self) -> "Resolution":
        """Half as fine again but for the elements across the width."""
        finer = self.finer()
        return replace(finer, density=replace(finer.density, width=self.density.width))

    @checked
    def scaled(self, factor: Finite) -> "Resolution":
        """Numbers of elements and slices times a factor."""
        slices = max(2, 2 * round(self.slices * factor / 2))
        return replace(self, density=self.density.scaled(factor), slices=slices)
