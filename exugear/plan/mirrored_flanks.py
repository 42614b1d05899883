"""The warning for results in which a coast flank carries load as a mirror image that it is not."""

import warnings
from collections.abc import Mapping

import numpy as np

#: Share of the mesh force on the coast flank from which on its law matters.
SHARE = 0.01


def warn_of_mirrored(mirrored: Mapping[str, str], labels: tuple[str, ...], forces: np.ndarray, stacklevel: int) -> None:
    """Warn once of the stages whose coast flank, by `Plan.mirrored` no mirror image, carries 1 % of the force or more.

    labels   of the stages
    forces   (n_stage, ...) mesh forces [N], < 0 on the coast flank
    """
    forces = np.nan_to_num(forces).reshape(len(labels), -1)
    total, coast = np.abs(forces).sum(axis=1), np.maximum(-forces, 0.0).sum(axis=1)
    shares = {
        name: part / whole for name, whole, part in zip(labels, total, coast, strict=True) if part > SHARE * whole
    }
    parts = [
        f"{name} ({shares[name]:.2g} of its force), where {mirrored[name]}"
        for name in labels
        if name in mirrored.keys() & shares
    ]
    if parts:
        taken = f"coast flanks were taken as mirror images of the driving flanks in {'; '.join(parts)}"
        warnings.warn(f"{taken}; map torques < 0 too: torque=[-350, -150, 0, 150, 350]", stacklevel=stacklevel)
