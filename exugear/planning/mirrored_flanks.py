"""The warning for results in which a coast flank carries load as a mirror image that it is not."""

from collections.abc import Mapping, Sequence

import numpy as np

from fem.support.user_warning import warn_user

#: Share of the mesh force on the coast flank from which on its law matters.
SHARE = 0.01
LAWS, MAP_BOTH = (
    "coast flanks act as mirror images of the driving flanks",
    "map torques < 0 too: torque=[-350, -150, 0, 150, 350]",
)
COMPOSED = "give laws of tooth pairs coast=fem.tooth_pair_map(fem.mirror_image(pair), ...)"


def warn_of_mirrored(
    mirrored: Mapping[str, str],
    labels: Sequence[str],
    forces: np.ndarray,
    what: str = LAWS,
    remedy: str = MAP_BOTH,
) -> None:
    """Warn once of the stages whose coast flank carries more than 1 % of the force, though it is no mirror image.

    mirrored   reason by stage, as `Plan.mirrored`
    labels     of the stages
    forces     (n_stage, ...) mesh forces [N], < 0 on the coast flank
    """
    if not mirrored:
        return
    forces = np.nan_to_num(forces).reshape(len(labels), -1)
    total, coast = np.abs(forces).sum(axis=1), np.maximum(-forces, 0.0).sum(axis=1)
    parts = [
        f"{label} ({part / whole:.2g} of its force), where {mirrored[label]}"
        for label, whole, part in zip(labels, total, coast, strict=True)
        if label in mirrored and part > SHARE * whole
    ]
    if parts:
        warn_user(f"{what} in {'; '.join(parts)}; {remedy}")


def remedy_of(plan) -> str:
    """What gives the stages of `Plan.mirrored` a law of their coast flanks."""
    return COMPOSED if any(plan.laws[label].teeth is not None for label in plan.mirrored) else MAP_BOTH
