"""Friction between the teeth as data: the classical loss, shares of a map, refusals."""

import numpy as np
import pytest
from friction_cases import MU, SPUR, N, friction_for, unlike_pair
from scenes import smooth_box, smooth_map
from spatial_meshes import PAIRS

import exugear
import fem
from fem.units import deg


def with_shares(pair, share, numbers, phases: int = 40):
    """A map with load_share(position in pitches) at two loads."""
    phase = np.arange(phases) / phases
    ste = fem.ste_map(pair, [0, 10.0, 300.0], phase, np.outer([0, 1e-6, 9e-6], np.ones(phases)))
    shares = share(phase[:, None] + np.array(numbers))
    shares = shares / shares.sum(axis=1, keepdims=True)
    return ste.assign(
        load_share=(("torque", "phase", "pair"), np.array([0 * shares, shares, shares])), pair=("pair", numbers)
    )


def parts(pair) -> tuple[float, float]:
    """Contact ratios before and behind the pitch point."""
    return (pair.roll_pitch - pair.roll_start) / pair.p_bt, (pair.roll_end - pair.roll_pitch) / pair.p_bt


@pytest.mark.parametrize("pair", [SPUR, unlike_pair(), unlike_pair(12 * deg), PAIRS["helical"]])
def test_loss_of_equal_shares_is_ohlendorfs(pair):
    """H_v holds for equal shares of one or two pairs, the pitch point in single contact."""
    u, eps_1, eps_2 = pair.wheel.z / pair.pinion.z, *parts(pair)
    assert max(eps_1, eps_2) < 1 < pair.eps_alpha < 2
    h_v = np.pi * (u + 1) / (pair.pinion.z * u * np.cos(pair.beta_b)) * (1 - pair.eps_alpha + eps_1**2 + eps_2**2)
    assert exugear.MeshFriction.of_pair(pair, MU).loss(pair) == pytest.approx(MU * h_v, rel=1e-6)


@pytest.mark.parametrize("pair", [SPUR, unlike_pair(12 * deg)])
def test_friction_follows_the_load_shares_of_a_map(pair):
    """Smooth shares against a sum over slices of the width; a tooth pair beyond the path rubs at its end."""
    before, behind = parts(pair)
    low, high = -before - 0.1 - pair.eps_beta / 2, behind + 0.1 + pair.eps_beta / 2
    hill = lambda x: np.where((x > low) & (x < high), np.sin(np.pi * (x - low) / (high - low)) ** 2, 0)  # noqa: E731
    numbers = np.arange(-3, 4)
    friction = exugear.MeshFriction.from_ste(with_shares(pair, hill, numbers, phases=200), MU, torque=150.0)
    position = numbers[:, None, None] + np.arange(N)[:, None] / N
    slices = position + (np.arange(1001) / 1000 - 0.5) * max(pair.eps_beta, 1 / N)
    weight = ((-before <= slices) & (slices <= behind)) + 1e-9
    weight *= hill(position) / hill(position).sum(axis=0) / weight.sum(axis=2, keepdims=True)
    slices = np.clip(slices, -before, behind)
    assert friction.pull == pytest.approx((weight * np.sign(slices)).sum(axis=(0, 2)), abs=5e-3)
    assert friction.lever == pytest.approx((weight * abs(slices)).sum(axis=(0, 2)) * pair.p_bt, abs=2e-3 * pair.p_bt)


@pytest.mark.parametrize("beta", [0.0, 5 * deg, 30 * deg])
def test_equal_shares_against_a_sum_over_sections(beta):
    pair = unlike_pair(beta)
    friction, (before, behind) = friction_for(pair), parts(pair)
    across = (np.arange(2001) / 2000 - 0.5) * max(pair.eps_beta, 1 / N)
    position = np.arange(-4, 5)[:, None, None] + np.arange(0, N, 8)[:, None] / N + across
    on = (-before <= position) & (position <= behind)
    weight = on / on.sum(axis=0) / across.size
    assert friction.pull[::8] == pytest.approx((weight * np.sign(position)).sum(axis=(0, 2)), abs=2e-3)
    assert friction.lever[::8] == pytest.approx((weight * abs(position)).sum(axis=(0, 2)) * pair.p_bt, rel=1e-2)


def test_equal_shares_of_a_map_are_those_of_the_pair():
    low, high = -parts(SPUR)[0], parts(SPUR)[1]
    even = with_shares(SPUR, lambda x: ((low <= x) & (x <= high)).astype(float), range(-2, 3), phases=2000)
    mapped, expected = exugear.MeshFriction.from_ste(even, MU, torque=300.0), friction_for(SPUR)
    assert mapped.loss(SPUR) == pytest.approx(expected.loss(SPUR), rel=1e-3)
    assert np.abs(mapped.pull - expected.pull).mean() < 1e-2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: friction_for(SPUR, 1.5), r"coefficient must lie in \[0, 1\), say 0.05, got 1.5"),
        (lambda: friction_for(SPUR, np.nan), "coefficient must lie in"),
        (lambda: friction_for(SPUR, speed=0.0), "speed must be at least 0.01 rad/s"),
        (lambda: exugear.MeshFriction.of_pair(PAIRS["ring"], MU), "a ring has no path of contact: pass the tables"),
        (lambda: exugear.MeshFriction(MU, [0.0, 1.0], [1e-3]), "over the same phases"),
        (lambda: exugear.MeshFriction(MU, [0.0, 2.0], [1e-3, 0]), "pull must lie in"),
        (lambda: exugear.MeshFriction(MU, [0.0, 1.0], [5.0, 0]), "pass metres"),
        (lambda: exugear.MeshFriction(MU, [0.0, np.nan], [5e-3, 0]), "pull must lie in"),
        (lambda: exugear.MeshFriction.from_ste(smooth_map(), MU, torque=150), "the map must have load_share"),
        (lambda: exugear.MeshFriction.from_ste(shared(), MU, torque=1e4), r"torque must lie in \(0, 300\] N m"),
        (lambda: exugear.MeshFriction.from_ste(shared(), MU, torque=0), "torque must lie in"),
        (lambda: exugear.MeshFriction.of_pair(unlike_pair(), MU).loss(SPUR), "to which the friction belongs, got"),
        (
            lambda: smooth_box(friction=exugear.MeshFriction.of_pair(unlike_pair(), MU)),
            "to which the friction belongs, got",
        ),
    ],
)
def test_bad_friction_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def shared():
    return with_shares(SPUR, np.ones_like, range(2))
