"""Helical gears of the reference cases."""

import numpy as np
from paper_gears import paper_gear

import fem
from fem.units import deg, mm


def helical(hand: int, **changes) -> fem.Gear:
    """The paper's transverse section with a helix of 15 deg.

    All but the tip of its rack, an ellipse as wide as the paper's circle: roots are within 1.8 um of the paper's.
    """
    inclined = np.cos(15 * deg)
    normal = {"m_n": 2.6 * mm * inclined, "s_n": 3.78 * mm * inclined, "rho_f": 0.38 * 2.6 * mm * inclined}
    return paper_gear(beta=hand * 15 * deg, alpha_n=np.arctan(np.tan(20 * deg) * inclined), **normal | changes)


def published_pair() -> fem.GearPair:
    """A published pair: z 20/30, m_n 3.5 mm, beta 15 deg, eps_alpha 1.4599, eps_beta 0.5414."""
    data = {"m_n": 3.5 * mm, "b": 23 * mm, "d_bore": 20 * mm}
    pinion = fem.Gear(z=20, beta=15 * deg, x=0.1809, d_a=2 * 40.336 * mm, **data)
    wheel = fem.Gear(z=30, beta=-15 * deg, x=0.0891, d_a=2 * 58.132 * mm, **data)
    return fem.GearPair(pinion, wheel, a=91.5 * mm)
