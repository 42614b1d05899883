"""Runs of stepped planets, Ravigneaux and Simpson sets whose members spin."""

import re
from dataclasses import replace

import numpy as np
import pytest
from coupled_sets import gear, ravigneaux, simpson, stepped
from planetary_boxes import PIN, STIFFNESS

import exugear
from fem.units import mm, um

QUIET = {"progress": False, "checks": 0}


def law(backlash: float = np.inf, amplitude: float = 0.0) -> exugear.MeshForce:
    """A mesh without ripple, or with one, with back flanks where a backlash is given."""
    phase = np.arange(16) / 16
    table = STIFFNESS * np.outer(1 + amplitude * np.cos(2 * np.pi * phase), [0, 1e-3])
    return exugear.MeshForce(phase, np.array([0, 1e-3]), table, damping=1500.0, backlash=backlash)


def torques_about_z(box: exugear.Gearbox, data) -> dict[str, float]:
    """Torques of drives, loads and housing at the end of a run."""
    torques = {}
    for kind, end, sign in (("drive_torque", "drive_end", 1), ("load_torque", "load_end", -1)):
        for name in np.ravel(data[end].values):
            values = data[kind].sel({end: name}) if end in data[kind].dims else data[kind]
            torques[str(name)] = sign * box.directions[str(name)] * float(values[-1])
    for name in np.ravel(data["held_end"].values) if "held_end" in data else ():
        reaction = data["reaction_torque"]
        torques[str(name)] = float((reaction.sel(held_end=name) if "held_end" in reaction.dims else reaction)[-1])
    return torques


@pytest.mark.parametrize(
    ("sets", "ends"),
    [
        (stepped, ("sun", "ring", "carrier")),
        (stepped, ("ring", "carrier", "sun")),
        (ravigneaux, ("small", "carrier", "ring")),
        (ravigneaux, ("small", "large", "ring")),
        (ravigneaux, ("large", "carrier", "ring")),
        (simpson, ("front ring", "rear carrier", "out")),
        (simpson, ("sun", "rear carrier", "out")),
    ],
)
def test_steady_runs_balance_the_torques_of_all_members(sets, ends):
    """T_drive w_drive + T_load w_load = 0 and the sum of all torques is 0, to 1e-10 of the load."""
    driving, held, driven = ends
    members = sets(law(50 * um))
    members = members if isinstance(members, list) else [members]
    box = exugear.Gearbox(members, driving=driving, held=held, driven=driven)
    data = exugear.run_up(exugear.build(box), speed=50.0, load=300.0, duration=2e-3, **QUIET).data
    torques, ratio = torques_about_z(box, data), exugear.exact_ratios(members, driving=driving, held=held)[driven]
    assert abs(sum(torques.values())) < 1e-10 * 300
    assert abs(torques[driving]) == pytest.approx(300.0 * abs(ratio), rel=1e-10)


def test_a_ravigneaux_set_runs_with_both_suns_driven():
    """Two speeds imposed, the carrier free to turn as they say: w_c by Willis; energy is balanced as they change."""
    box = exugear.Gearbox(ravigneaux(law(50 * um, 0.1)), speeds={"small": 1.0, "large": 0.4}, driven="ring")
    speeds = {"small": (100.0, 90.0), "large": (20.0, 60.0)}
    options = {"duration": 0.01, "power": True, **QUIET}
    run = exugear.run(exugear.build(box), drives=speeds, loads={"ring": 200.0}, **options)
    assert run.energy_balance().relative < 1e-8
    w = {str(name): run.data["shaft_speed"].sel(shaft=name).values for name in run.data["shaft"].values}
    carrier = (30 * w["small"] + 42 * w["large"]) / 72
    assert w["carrier"] == pytest.approx(carrier, abs=0.2)
    assert w["ring"] == pytest.approx(carrier + 2 / 7 * (w["small"] - carrier), abs=0.2)


@pytest.mark.parametrize("side", [1, -1])
def test_a_ravigneaux_set_starts_where_inertia_presses_the_flanks_that_the_load_opens(side):
    """A load that drives, against an acceleration: of the suns' meshes the inertia torques turn the force round."""
    box = exugear.Gearbox(ravigneaux(law(50 * um), side), driving="small", held="large", driven="ring")
    pressed = np.sign([box.static_forces(-300.0, acceleration)[0] for acceleration in (0.0, 3e4)])
    assert pressed[0] == -pressed[1]
    options = {"load": -300.0, "duration": 1e-3, "power": True, **QUIET}
    run = exugear.run_up(exugear.build(box), speed=(50.0, 80.0), **options)
    assert run.energy_balance().relative < 1e-8
    assert run.data["mesh_force"].values[:, 0] == pytest.approx(box.static_forces(-300.0, 3e4), rel=0.01)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("ends", [("small", "large", "ring"), ("ring", "large", "small"), ("small", "carrier", "ring")])
def test_a_ravigneaux_set_on_pins_starts_under_light_and_heavy_loads(ends, side):
    """Back flanks push planets outwards, light loads press less than the displacements change the meshes."""
    members = ravigneaux(law(50 * um), side, pin=PIN, inner={"pin": PIN})
    box = exugear.Gearbox(members, **dict(zip(("driving", "held", "driven"), ends, strict=True)))
    model = exugear.build(box)
    for load in (1.0, 300.0):
        data = exugear.run_up(model, speed=50.0, load=load, duration=1e-4, **QUIET).data
        static = np.array(box.static_forces(load))
        assert data["mesh_force"].values[:, 0] == pytest.approx(static, abs=2e-3 * np.abs(static).max())


@pytest.mark.parametrize(
    ("ends", "side", "load", "speed"),
    [(("ring", "large", "small"), 1, 3000.0, 50.0), (("small", "large", "ring"), -1, 300.0, (50.0, 80.0))],
)
def test_a_start_that_pins_jam_says_how_much_backlash_it_takes(ends, side, load, speed):
    """Pins that yield by more than the backlash, by the load or by 3e4 rad/s^2; with what the words ask for it runs."""
    names = dict(zip(("driving", "held", "driven"), ends, strict=True))
    options = {"load": load, "speed": speed, "duration": 1e-3, **QUIET}
    model = exugear.build(exugear.Gearbox(ravigneaux(law(50 * um), side, pin=PIN, inner={"pin": PIN}), **names))
    with pytest.raises(RuntimeError, match="backlash of 50 um is used up, a tooth would touch both flanks") as stopped:
        exugear.run_up(model, **options)
    needed = float(re.search(r"a backlash above ([0-9.]+) um", str(stopped.value))[1]) * um
    ample = ravigneaux(law(1.1 * needed), side, pin=PIN, inner={"pin": PIN})
    run = exugear.run_up(exugear.build(exugear.Gearbox(ample, **names)), power=True, **options)
    assert run.energy_balance().relative < 1e-7


def test_stepped_planets_keep_their_energy_and_their_two_mesh_frequencies():
    run = exugear.run_up(
        exugear.build(exugear.Gearbox([stepped(law(amplitude=0.1))], held="ring")),
        speed=(50.0, 60.0), load=300.0, duration=0.01, power=True, **QUIET,
    )  # fmt: skip
    assert run.energy_balance().relative < 1e-8
    of_sun, of_ring = run.data["mesh_frequency"].values[:2, 0]
    assert of_ring / of_sun == pytest.approx(21 / 36, rel=1e-12)


def test_a_stepped_set_has_the_rotational_modes_of_its_spins():
    """Free: sun, carrier and three planets with the ring held, of which one motion turns and two move planets alone."""
    model = exugear.build(exugear.Gearbox([stepped(law())], held="ring"))
    data = exugear.modes(model, load=300.0, drive="free")
    assert np.count_nonzero(data["frequency"].values < 1e-3) == 1
    assert data["kind"].values.tolist().count("planet") == 2


@pytest.mark.parametrize("thin", [0, 1])
@pytest.mark.parametrize("at", ["sun", "ring"])
def test_a_stepped_planet_with_thinner_teeth_at_either_step_takes_less(at, thin):
    """Sun teeth: F_n - F_m = -k rho g / (1 + rho^2), rho = 36 / 21, of a gap g at the ring (g / rho if at the sun).

    Stages that are written by hand have the same gaps.
    """
    thinner, rho = 20 * um, 36 / 21
    steps = {"sun": gear(36), "ring": gear(21)}
    shafts = []
    for n in range(3):
        gears = steps | ({at: replace(steps[at], s_n=steps[at].s_n - thinner)} if n == thin else {})
        shafts.append(exugear.Shaft(f"planet {n + 1}", {0.0: gears["sun"], 40 * mm: gears["ring"]}))
    boxes = [exugear.Gearbox([stepped(law(), planet=shafts)], held="ring")]
    by_hand = [replace(x, phase=phase) for x, phase in zip(boxes[0].stages, boxes[0].phases, strict=True)]
    boxes.append(exugear.Gearbox(by_hand, held="ring"))
    for box in boxes:
        data = exugear.run_up(exugear.build(box), speed=10.0, load=4000.0, duration=1e-3, **QUIET).data
        of_sun = data["mesh_force"].values[::2, -1]
        gap = thinner / 2 * np.cos(boxes[0].stages[0].pair.alpha_wt) / (rho if at == "sun" else 1)
        less = STIFFNESS * rho * gap / (1 + rho**2)
        assert np.delete(of_sun, thin) - of_sun[thin] == pytest.approx(less, rel=1e-5)
