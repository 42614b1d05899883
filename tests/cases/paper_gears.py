"""The paper's gear and pair with some changes, and a small gear without undercut."""

import fem
from fem.units import deg, mm


def paper_gear(**changes) -> fem.Gear:
    """Gear of the paper's Table I with some changes."""
    data = {"z": 57, "m_n": 2.6 * mm, "b": 23 * mm, "alpha_n": 20 * deg, "d_bore": 60 * mm}
    return fem.Gear(**data | {"d_a": 154.5 * mm, "d_f": 141.7 * mm, "s_n": 3.78 * mm} | changes)


def few_teeth(**changes) -> fem.Gear:
    """Spur gear without undercut, root from the rack unless a fillet is given."""
    return fem.Gear(**{"z": 20, "m_n": 2 * mm, "b": 20 * mm, "d_bore": 20 * mm, "x": 0.3} | changes)


def paper_pair() -> fem.GearPair:
    return fem.GearPair(paper_gear(), paper_gear(), a=150 * mm)
