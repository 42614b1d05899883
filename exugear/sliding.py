"""Coulomb friction between the teeth: what the pairs in contact add up to over the mesh cycle, and its kernels.

A pair of teeth that touches at s beyond the pitch point along the line of action slides with (omega_1 - omega_2) s and
rubs with its share w of the force. Together they are a force mu F A along t = z x n in the pitch point, with
A = sum w sign(s), and a moment mu F B with B = sum w |s|: the force does no work where the gears roll, the moment
takes the power mu F B |omega_1 - omega_2|.
"""

STEPS = 512
SLICES = 33
STEADY = 0
