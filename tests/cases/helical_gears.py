"""The helical gear of the reference cases."""

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
