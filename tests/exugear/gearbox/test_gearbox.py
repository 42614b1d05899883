"""Gearboxes as data: mesh phases of idlers and loops, load sharing, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import linear_law, paper_gear, paper_pair, smooth_map
from strategies import floats
from trains import STIFF, apart, coupled, gear, half_angles, loose_pair, on, pressed, square, wheels

from exugear import Gearbox, Shaft, Stage, build, modes
from fem.units import deg, mm


@settings(max_examples=25)
@given(
    st.tuples(*[st.integers(18, 45)] * 3),
    st.tuples(*[floats(-0.2, 0.5)] * 3),
    st.sampled_from([0.0, 12 * deg, -20 * deg]),
    st.tuples(*[floats(-6, 6)] * 2),
    st.booleans(),
    st.tuples(*[floats(-4, 4)] * 3),
)
def test_idler_couples_the_phases_of_its_meshes(teeth, shifts, beta, angles, reverse, beside):
    """Tooth by tooth: a pushes b, whose back flanks touch c; or c, named as pinion, touches b.

    The mid-planes of helical gears lie beside one another: phases count in that of each pinion.
    """
    a, b, c = (gear(z, x, sense * beta) for z, x, sense in zip(teeth, shifts, (1, -1, 1), strict=True))
    first, second = loose_pair(a, b), loose_pair(c, b) if reverse else loose_pair(b, c)
    axial = np.array(beside) * mm
    shafts = [Shaft(name, {z: part}) for name, z, part in zip("abc", axial, (a, b, c), strict=True)]
    ends = shafts[2:0:-1] if reverse else shafts[1:]
    stages = [Stage(*shafts[:2], STIFF, pair=first, angle=angles[0]), Stage(*ends, STIFF, pair=second, angle=angles[1])]
    box = Gearbox(stages)
    r_w = first.a * a.z / (a.z + b.z)
    tooth, phase = pressed(first, a, angles[0] - half_angles(a, r_w), angles[0], +1)
    assert apart(phase, 0) < 2e-4
    _, phase_2 = pressed(second, b, tooth, angles[1] + (np.pi if reverse else 0), +1 if reverse else -1)
    helix = np.sin(beta) / (np.pi * a.m_n) * (axial - axial[0])
    assert box.phases[0] == 0
    assert apart(box.phases[1], phase_2 + (helix[2] if reverse else helix[1])) < 2e-4


def test_gear_turned_by_a_share_of_a_pitch_shifts_all_phases():
    a, b, c, d = wheels("a", "b", "c", "d")
    angles = [0.3, 1.1, -0.4]
    chain = [coupled(*ends, angle) for ends, angle in zip([(a, b), (b, c), (c, d)], angles, strict=True)]
    plain = Gearbox(chain).phases
    for i in range(3):
        given = [replace_phase(stage, plain[i] + 0.3) if i == j else stage for j, stage in enumerate(chain)]
        turned = Gearbox(given).phases
        assert max(apart(x + 0.3, y) for x, y in zip(plain, turned, strict=True)) < 1e-12


def replace_phase(stage: Stage, phase: float) -> Stage:
    return coupled(stage.fast, stage.slow, stage.angle, phase=phase)


def split(first: float, second: float) -> Gearbox:
    """Split path: a drives b and c, both drive d; the gears of b and c are mounted to fit."""
    pinion, wheel = gear(25), gear(40)
    front, rear = loose_pair(pinion, wheel), loose_pair(pinion, wheel)
    a, d = Shaft("a", {0.0: pinion}), Shaft("d", {50 * mm: wheel})
    b, c = (Shaft(name, {0.0: wheel, 50 * mm: pinion}) for name in "bc")
    parts = {"mesh": STIFF, "pair": front}
    stages = [Stage(a, b, angle=first, **parts), Stage(b, d, STIFF, pair=rear, angle=second)]
    return Gearbox([*stages, Stage(a, c, angle=second, **parts), Stage(c, d, STIFF, pair=rear, angle=first)])


def test_gears_with_a_single_mate_are_mounted_so_that_the_flanks_touch():
    """A gear with two mates reaches its second mesh by the angle between them later."""
    box = split(0.3, 1.0)
    assert box.phases[:2] == pytest.approx((0, 0))
    assert apart(box.phases[2], -0.7 * 25 / (2 * np.pi)) < 1e-9
    assert apart(box.phases[3], 0.7 * 40 / (2 * np.pi)) < 1e-9


def test_split_paths_share_the_load():
    box = split(0.3, 1.0)
    forces = np.array(box.static_forces(100.0))
    r_b = box.stages[1].pair.wheel.r_b
    assert forces[[1, 3]] == pytest.approx([50 / r_b] * 2)
    assert forces[[0, 2]] == pytest.approx(forces[1] * gear(25).r_b / gear(40).r_b)
    assert box.ratios == pytest.approx({"a": 1, "b": -25 / 40, "d": (25 / 40) ** 2, "c": -25 / 40})


def test_stiffer_path_carries_more():
    """Two parallel pairs of springs in series: the shares follow 1 / (sum of compliances)."""
    a, b, c, d = wheels("a", "b", "c", "d")
    soft = linear_law((1e8,) * 3, backlash=2e-4)
    half = {"pair": paper_pair(), "angle": 90 * deg}
    stages = [coupled(a, b), Stage(a, c, soft, **half), Stage(b, d, STIFF, **half), coupled(c, d)]
    forces = np.array(Gearbox(stages).static_forces(350.0))
    k = STIFF.stiffness_max
    up, down = 1 / (2 / k), 1 / (1 / k + 1 / soft.stiffness_max)
    total = 350 / paper_pair().wheel.r_b
    assert forces == pytest.approx(total * np.array([up, down, up, down]) / (up + down))


def test_two_meshes_between_the_same_shafts_share_the_load():
    left, right = gear(25, beta=20 * deg), gear(25, beta=-20 * deg)
    fast, slow = on("fast", left, right), on("slow", right, left)
    stages = [Stage(fast, slow, STIFF, pair=loose_pair(*pair)) for pair in ((left, right), (right, left))]
    box = Gearbox(stages)
    total = 100 / right.r_b
    assert box.static_forces(100.0) == pytest.approx([total / 2] * 2)
    assert box.phases == (0, 0)
    assert box.labels == ("fast-slow at 0 mm", "fast-slow at 50 mm")


def reversed_square() -> Gearbox:
    a, b, c, d = wheels("a", "b", "c", "d")
    return Gearbox([coupled(a, b), coupled(a, c, np.pi / 2), coupled(d, b, -np.pi / 2), coupled(c, d)])


def odd_loop() -> Gearbox:
    a, b, c = wheels("a", "b", "c")
    return Gearbox([coupled(a, b), coupled(b, c, 2 * np.pi / 3), coupled(a, c, np.pi / 3)])


def unequal_ratios() -> Gearbox:
    small, large = gear(25), gear(40)
    a, d = on("a", small), Shaft("d", {50 * mm: large})
    b, c = Shaft("b", {0.0: large, 50 * mm: small}), Shaft("c", {0.0: large, 50 * mm: large})
    pair, rear = loose_pair(small, large), loose_pair(large, large)
    stages = [Stage(a, b, STIFF, pair=pair), Stage(b, d, STIFF, pair=pair), Stage(a, c, STIFF, pair=pair)]
    return Gearbox([*stages, Stage(c, d, STIFF, pair=rear)])


def other_hand() -> Stage:
    left, right = gear(25, beta=20 * deg), gear(25, beta=-20 * deg)
    return Stage(on("fast", left), on("slow", left), STIFF, pair=loose_pair(left, right))


def speed_increaser() -> Stage:
    small, large = gear(25), gear(40)
    return Stage(on("fast", large), on("slow", small), STIFF, pair=loose_pair(small, large))


def triangle() -> Gearbox:
    """Three equal gears, each in mesh with the two others, the last stage back to the driving shaft."""
    a, b, c = wheels("a", "b", "c")
    return Gearbox([coupled(a, b, 0.0), coupled(b, c, 120 * deg), coupled(c, a, 240 * deg)])


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            speed_increaser,
            r"fast shaft 'fast' carries the pair's wheel, .*GearPair\(wheel, pinion, a=...\), or swap fast and slow",
        ),
        (lambda: square(50 * deg + 0.01), "cannot be assembled: phase error"),
        (lambda: square(phase=0.25) and square(phase=np.nan), "phase must be finite"),
        (
            reversed_square,
            r"stages \['d-b'\] are driven from their slow shafts; name the shaft of the driving gear fast",
        ),
        (odd_loop, "odd number of meshes turns shaft 'c' in both senses"),
        (triangle, r"a-b, b-c, c-a cannot turn, it jams: an odd number of meshes turns shaft 'a' in both senses"),
        (unequal_ratios, "would turn at 25/64 and at 5/8 of the driving shaft"),
        (lambda: Gearbox([coupled(*wheels("a", "b")), coupled(*wheels("c", "a"))]), "drives and is driven"),
        (other_hand, "does not carry the pair's wheel; .*beta 20 deg instead of -20 deg"),
        (lambda: loose_pair(gear(25, beta=0.2), gear(30, beta=0.2)), "change the hand of one"),
        (
            lambda: Gearbox([coupled(*wheels("a", "b"), phase=0.1), coupled(*wheels("b", "c"), phase=0.1)]),
            "leave it out",
        ),
    ],
)
def test_impossible_gearboxes_are_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_maps_and_laws_give_the_same_scene():
    shafts = wheels("a", "b")
    assert Gearbox([Stage(*shafts, smooth_map())]).shaft_positions == Gearbox([coupled(*shafts)]).shaft_positions


def test_equal_pairs_side_by_side_share_the_load_and_stiffen_the_mesh():
    """At the same inertia two pairs resonate sqrt(2) times as high as a single pair."""
    alone, twice = ([on(name, *[paper_gear()] * n) for name in "ab"] for n in (1, 2))
    twice = [replace(shaft, inertia=alone[0].inertia) for shaft in twice]
    side_by_side = Gearbox([coupled(*twice, axial_position=axial) for axial in (0.0, 50 * mm)])
    single = Gearbox([coupled(*alone)])
    assert side_by_side.phases == (0.0, 0.0)
    assert side_by_side.labels == ("a-b at 0 mm", "a-b at 50 mm")
    assert side_by_side.static_forces(100.0) == pytest.approx(2 * [single.static_forces(50.0)[0]])
    (high,), (low,) = (modes(build(box), load=10.0)["frequency"].values for box in (side_by_side, single))
    assert high == pytest.approx(2**0.5 * low, rel=1e-9)
    with pytest.raises(ValueError, match=r"more than once; pass axial_position, one of \[0.0, 50.0\] mm"):
        coupled(*twice)
    with pytest.raises(ValueError, match=r"axial_position must be one of \[0.0, 50.0\] mm, .* got 60 mm"):
        coupled(*twice, axial_position=60 * mm)
