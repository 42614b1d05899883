"""Gearboxes as data: mesh phases of idlers and loops, load sharing, displaced shafts, refusals."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import linear_law, paper_gear, paper_pair, smooth_map
from strategies import floats, without_backlash

import fem
from exugear import Gearbox, Placement, Shaft, Stage
from fem.gear.involute import involute
from fem.units import deg, mm

Z = 57
STIFF = linear_law(reach=9e-3, backlash=2e-4)


def gear(z: int, x: float = 0.0, beta: float = 0.0) -> fem.Gear:
    return fem.Gear(z=z, m_n=2.5 * mm, b=20 * mm, d_bore=15 * mm, x=x, beta=beta)


def loose_pair(pinion: fem.Gear, wheel: fem.Gear) -> fem.GearPair:
    return fem.GearPair(pinion, wheel, a=without_backlash(pinion, wheel) + 0.1 * mm)


def on(name: str, *gears: fem.Gear) -> Shaft:
    """Shaft with gears every 50 mm."""
    return Shaft(name, {i * 50 * mm: gear for i, gear in enumerate(gears)})


def wheels(*names: str) -> list[Shaft]:
    """Shafts with the paper's gear."""
    return [on(name, paper_gear()) for name in names]


def coupled(fast: Shaft, slow: Shaft, angle: float = 0.0, **changes) -> Stage:
    return Stage(fast, slow, STIFF, pair=paper_pair(), angle=angle, **changes)


def square(angle: float = 90 * deg, **changes) -> Gearbox:
    """Rhombus of four equal gears, b and c between a and d."""
    a, b, c, d = wheels("a", "b", "c", "d")
    rhombus = [coupled(a, b, 0.0, **changes), coupled(a, c, angle), coupled(b, d, angle), coupled(c, d, 0.0)]
    return Gearbox(rhombus)


def half_angles(gear: fem.Gear, r: np.ndarray) -> np.ndarray:
    """Half the tooth's angle at radii (n,)."""
    alpha = np.arccos(gear.r_b / r)
    return gear.psi_b - involute(alpha)


def pressed(pair: fem.GearPair, gear: fem.Gear, psi: float, towards: float, side: int) -> tuple[float, float]:
    """Angle [rad] of a tooth of the mate that a gear presses with its flanks of a side (+1: left), and the phase.

    psi is the angle of a tooth of the gear, towards the direction to the mate [rad]. By brute force: all points of the
    gear's flanks are transformed to the mate, where a flank must pass through the point that reaches furthest.
    """
    mate = pair.wheel if gear is pair.pinion else pair.pinion
    line = pair.a * np.sin(pair.alpha_wt)
    roll = np.linspace(max(gear.roll_form, line - mate.roll_tip), gear.roll_tip, 20001)
    r = np.hypot(gear.r_b, roll)
    for k in range(gear.z):
        polar = psi - towards + 2 * np.pi * k / gear.z + side * half_angles(gear, r)
        x, y = pair.a - r * np.cos(polar), r * np.sin(polar)
        r_mate = np.hypot(x, y)
        near = (r_mate > max(mate.r_form, mate.r_b)) & (r_mate < mate.r_a) & (x > 0)
        if not near.any():
            continue
        angle = np.arctan2(-y, x)[near] - side * half_angles(mate, r_mate[near])
        furthest = np.argmin(side * angle)
        if 0 < furthest < near.sum() - 1:
            along = roll[near][furthest]
            pinion_roll = along if gear is pair.pinion else line - along
            return towards + np.pi + angle[furthest], (pinion_roll - pair.roll_pitch) / pair.p_bt
    raise AssertionError("no tooth stands in the path of contact")


def apart(phase_1: float, phase_2: float) -> float:
    """Distance of two phases, in shares of a pitch."""
    return abs((phase_1 - phase_2 + 0.5) % 1.0 - 0.5)


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(*[st.integers(18, 45)] * 3),
    st.tuples(*[floats(-0.2, 0.5)] * 3),
    st.sampled_from([0.0, 12 * deg, -20 * deg]),
    st.tuples(*[floats(-6, 6)] * 2),
    st.booleans(),
)
def test_idler_couples_the_phases_of_its_meshes(teeth, shifts, beta, angles, reverse):
    """Tooth by tooth: a pushes b, whose back flanks touch c; or c, named as pinion, touches b."""
    a, b, c = (gear(z, x, sense * beta) for z, x, sense in zip(teeth, shifts, (1, -1, 1), strict=True))
    first, second = loose_pair(a, b), loose_pair(c, b) if reverse else loose_pair(b, c)
    shafts = [on(name, part) for name, part in zip("abc", (a, b, c), strict=True)]
    ends = shafts[2:0:-1] if reverse else shafts[1:]
    stages = [Stage(*shafts[:2], STIFF, pair=first, angle=angles[0]), Stage(*ends, STIFF, pair=second, angle=angles[1])]
    box = Gearbox(stages)
    r_w = first.a * a.z / (a.z + b.z)
    tooth, phase = pressed(first, a, angles[0] - half_angles(a, r_w), angles[0], +1)
    assert apart(phase, 0) < 2e-4
    _, phase_2 = pressed(second, b, tooth, angles[1] + (np.pi if reverse else 0), +1 if reverse else -1)
    assert box.phases[0] == 0
    assert apart(box.phases[1], phase_2) < 2e-4


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


def test_square_of_equal_gears_assembles():
    box = square()
    assert box.shaft_positions["d"] == pytest.approx((150 * mm, 150 * mm))
    assert box.directions == {"a": 1, "b": -1, "c": -1, "d": 1}
    assert box.static_forces(100.0) == pytest.approx([50 / paper_pair().wheel.r_b] * 4)


@given(st.integers(34, 100))
@settings(deadline=None, max_examples=20)
def test_rhombus_assembles_at_whole_multiples_of_half_a_pitch(n):
    """Turning its sides by delta shifts the teeth by 4 z delta / 2 pi pitches against each other."""
    angle = n * np.pi / (2 * Z)
    square(angle)
    with pytest.raises(ValueError, match=r"miss each other by -?0\.4"):
        square(angle + 0.4 * np.pi / (2 * Z))


def quadrilateral(angles, teeth=(25, 40, 31, 28)) -> list[Stage]:
    """Four unlike gears, b and c between a and d."""
    gears = [gear(z, x) for z, x in zip(teeth, (0.1, 0.0, 0.3, -0.1), strict=True)]
    a, b, c, d = (on(name, part) for name, part in zip("abcd", gears, strict=True))
    ends = [(a, b), (a, c), (b, d), (c, d)]
    pairs = [loose_pair(fast.gears[0.0], slow.gears[0.0]) for fast, slow in ends]
    stages = zip(ends, pairs, angles, strict=True)
    return [Stage(*pair_ends, STIFF, pair=pair, angle=angle) for pair_ends, pair, angle in stages]


def refused_angles(angles) -> tuple[str, list[float]]:
    """The message that refuses a quadrilateral, and the angles that it proposes."""
    with pytest.raises(ValueError, match="angle=") as refused:
        Gearbox(quadrilateral(angles))
    named = {int(i): float(angle) for angle, i in re.findall(r"angle=(\S+) in stage (\d)", str(refused.value))}
    return str(refused.value), [named.get(i, angle) for i, angle in enumerate(angles)]


def pressed_both_ways(angles) -> float:
    """Tooth by tooth from a over b and over c to d: how far the latter puts its teeth ahead, in pitches."""
    pairs = [stage.pair for stage in quadrilateral(angles)]
    a, b, c, d = pairs[0].pinion, pairs[0].wheel, pairs[1].wheel, pairs[3].wheel
    start = angles[0] - half_angles(a, pairs[0].a * a.z / (a.z + b.z))
    ends = []
    for middle, i, j in ((b, 0, 2), (c, 1, 3)):
        tooth, _ = pressed(pairs[i], a, start, angles[i], +1)
        ends.append(pressed(pairs[j], middle, tooth, angles[j], -1)[0])
    return (ends[1] - ends[0]) * d.z / (2 * np.pi)


def test_loop_of_unlike_gears_fits_tooth_by_tooth():
    """The miss of the message is that of the teeth, and 0 at the angles that it names."""
    _, closed = refused_angles([0.2, 1.4, 1.5, 0.0])
    message, fitting = refused_angles(closed)
    miss = float(re.search(r"each other by (\S+) of", message)[1])
    assert apart(pressed_both_ways(closed), miss) < 1e-4
    assert apart(pressed_both_ways(fitting), 0) < 1e-5
    assert Gearbox(quadrilateral(fitting)).phases[0] == 0


def test_loop_that_cannot_close_gets_no_angles():
    with pytest.raises(ValueError, match="no angles nearby fit"):
        Gearbox(quadrilateral([0.0, np.pi, 1.0, 2.0], teeth=(60, 40, 31, 18)))


def test_angles_of_the_messages_close_the_loops():
    """The angles that the messages name are taken, and the box is built."""
    a, b, c, d = wheels("a", "b", "c", "d")
    stages = [coupled(a, b), coupled(a, c, 1.2), coupled(b, d, 1.21), coupled(c, d, 0.01)]
    with pytest.raises(ValueError, match=r"does not close, the gap is .* mm; these angles") as refused:
        Gearbox(stages)
    stages = with_angles(stages, str(refused.value))
    with pytest.raises(ValueError, match=r"miss each other by .* of a pitch .* gear of its own") as refused:
        Gearbox(stages)
    assert len(Gearbox(with_angles(stages, str(refused.value))).phases) == 4


def with_angles(stages: list[Stage], message: str) -> list[Stage]:
    named = {int(i): float(angle) for angle, i in re.findall(r"angle=(\S+) in stage (\d)", message)}
    assert named
    return [coupled(x.fast, x.slow, named.get(i, x.angle)) for i, x in enumerate(stages)]


def test_two_meshes_between_the_same_shafts_share_the_load():
    left, right = gear(25, beta=20 * deg), gear(25, beta=-20 * deg)
    fast, slow = on("fast", left, right), on("slow", right, left)
    stages = [Stage(fast, slow, STIFF, pair=loose_pair(*pair)) for pair in ((left, right), (right, left))]
    box = Gearbox(stages)
    total = 100 / right.r_b
    assert box.static_forces(100.0) == pytest.approx([total / 2] * 2)
    assert box.phases == (0, 0)
    assert box.labels == ("fast-slow at 0 mm", "fast-slow at 50 mm")


def displaced(pinion: Placement, wheel: Placement, direction: int = 1) -> dict[str, float]:
    """Offsets of the stage of a pair whose pinion turns by direction, gears at 50 mm."""
    shafts = [Shaft(name, {50 * mm: paper_gear()}, offset=x) for name, x in (("fast", pinion), ("slow", wheel))]
    if direction == 1:
        box = Gearbox([coupled(*shafts)])
        return box.offsets(box.stages[0])
    first = Shaft("first", {50 * mm: paper_gear()})
    box = Gearbox([coupled(first, shafts[0]), coupled(*shafts)])
    return box.offsets(box.stages[1])


NONE = Placement()


def test_offsets_of_a_displaced_wheel():
    pair = paper_pair()
    assert displaced(NONE, NONE) == pytest.approx({"a": pair.a, "misalignment": 0, "axial": 0}, abs=1e-15)
    moved = displaced(NONE, Placement(x=1e-4, z=2e-4))
    assert moved == pytest.approx({"a": pair.a + 1e-4, "misalignment": 0, "axial": 2e-4}, abs=1e-12)
    parting = displaced(NONE, Placement(tilt_y=1e-3))
    assert parting["a"] == pytest.approx(pair.a + 50 * mm * 1e-3, rel=1e-8)
    assert parting["misalignment"] == pytest.approx(1e-3 * np.sin(pair.alpha_wt), rel=1e-2)


@pytest.mark.parametrize("direction", [1, -1])
def test_wheel_tilted_towards_the_driving_force_opens_the_gap(direction):
    """tilt_x < 0 tilts the axis towards +y, where a pinion that turns counter-clockwise drives the wheel."""
    lean = direction * 1e-3
    leaning = displaced(NONE, Placement(y=-50 * mm * lean, tilt_x=-lean), direction)
    assert leaning["misalignment"] == pytest.approx(1e-3 * np.cos(paper_pair().alpha_wt), rel=1e-5)
    assert leaning["a"] == pytest.approx(paper_pair().a, rel=1e-9)


def test_shafts_displaced_together_keep_their_offsets():
    """A rotation of the whole pair about the pinion's origin; only second-order terms remain."""
    a, tilt_x, tilt_y = paper_pair().a, 1e-3, -2e-3
    pinion = Placement(x=1e-3, y=2e-3, z=-1e-3, tilt_x=tilt_x, tilt_y=tilt_y)
    wheel = replace(pinion, z=pinion.z - a * tilt_y)
    together = displaced(pinion, wheel)
    assert together == pytest.approx({"a": a, "misalignment": 0, "axial": 0}, abs=1e-6)


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


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            speed_increaser,
            r"fast shaft 'fast' carries the pair's wheel, .*GearPair\(wheel, pinion, a=...\), or swap fast and slow",
        ),
        (lambda: square(50 * deg + 0.01), "assembly"),
        (lambda: square(phase=0.25) and square(phase=np.nan), "phase must be finite"),
        (
            reversed_square,
            r"stages \['d-b'\] are driven from their slow shafts; name the shaft of the driving gear fast",
        ),
        (odd_loop, "odd number of meshes turns shaft 'c' in both senses"),
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
