"""The examples compute what they say; the code of the documents is in test_documents.py."""

import sys
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
import xarray as xr

import exugear
import fem
from fem.units import mm, rpm, um

EXAMPLES = Path(__file__).parents[1] / "examples"
sys.path.insert(0, str(EXAMPLES))
import bearings_misalignment  # noqa: E402
import korta_pair  # noqa: E402
import korta_run_up  # noqa: E402
import korta_two_laws  # noqa: E402
import planetary  # noqa: E402
import planetary_load_sharing  # noqa: E402
import planetary_set  # noqa: E402
import two_stage_helical  # noqa: E402


def superharmonics(run: exugear.Run) -> np.ndarray:
    """Peaks at 1/4, 1/3, 1/2 and all of the main resonance [Hz]."""
    return exugear.spectrum.superharmonics(korta_pair.envelope_peaks(run))


@pytest.fixture(scope="module")
def short():
    """A tenth of the main job."""
    ste = fem.static_transmission_error(korta_pair.paper_pair(), (0, 5, 50, 150, 350, 1500), 30, progress=False)
    box = korta_pair.gearbox(ste)
    return ste, box, korta_pair.run_ups(box, 7.0)


def test_run_ups_side_by_side_are_those_of_one_process(short):
    _, box, runs = short
    xr.testing.assert_identical(korta_pair.run(box, 350.0, 7.0).data, runs[350.0].data)


def test_resonances_lie_where_stiffness_and_inertia_put_them(short):
    ste, box, runs = short
    for load, result in runs.items():
        natural = np.sqrt(korta_pair.mean_stiffness(ste, load) / box.driven.inertia) * 69.63e-3 / 2 / np.pi
        *_, half, main = superharmonics(result)
        assert half == pytest.approx(natural / 2, rel=0.03)
        assert 0.85 * natural < main < 1.02 * natural


@pytest.mark.slow
def test_superharmonics_are_excited_by_the_second_third_and_fourth_mesh_harmonic(short):
    """Their vibrations have the natural frequency of the loaded pair; the main resonance leans below it."""
    ste, box, runs = short
    for load, result in runs.items():
        natural = np.sqrt(korta_pair.mean_stiffness(ste, load) / box.driven.inertia) * 69.63e-3 / 2 / np.pi
        table = exugear.resonances(result).sel(peak=slice(-4, None)).set_index(peak="harmonic").sortby("peak")
        assert table["peak"].values.tolist() == [1, 2, 3, 4]
        shares = superharmonics(result)
        assert table["mesh_frequency"].values == pytest.approx(shares[::-1])
        assert table["response_frequency"].values[1:] == pytest.approx(natural, rel=0.05)


def test_fitted_inertia_moves_the_main_resonance_to_the_papers(short):
    _, box, runs = short
    inertia = korta_run_up.fitted_inertia(box, korta_pair.envelope_peaks(runs[150.0]))
    main = superharmonics(runs[150.0])[-1]
    assert main * np.sqrt(box.driven.inertia / inertia) == pytest.approx(1804)


def test_report_and_figures(short, tmp_path):
    ste, box, runs = short
    curves, full = ste.sel(torque=[150, 350]), ste.interp(torque=[20, 50, 150, 350, 750, 1500])
    korta_run_up.draw(tmp_path, curves, full, runs)
    assert {path.name for path in tmp_path.iterdir()} == {"ste.png", "run_up.png", "orders.png"}
    text = korta_run_up.report(curves, box, runs, False, {"STE curves": 2.0})
    assert "1804" in text and "nothing is fitted" in text and "resonances" in text


@pytest.fixture(scope="module")
def tilted(tmp_path_factory):
    return bearings_misalignment.main(tmp_path_factory.mktemp("figures"), quick=True)


def test_forces_and_moments_balance_on_the_tilted_shaft(tilted):
    """At the start: both bearings carry the mesh force, which acts at the centroid."""
    half = bearings_misalignment.LENGTH / 2
    for run in tilted.values():
        start = run.data.isel(time=0, stage=0)
        torque = 150.0 + run.data.attrs["driven_inertia"] * float(run.data["speed"].differentiate("time")[0])
        force = torque / korta_pair.paper_pair().wheel.r_b
        near, far = (start["bearing_force"].sel(bearing=f"driven at {z} mm").values for z in (0, 60))
        assert np.linalg.norm(near + far) == pytest.approx(force, rel=1e-3)
        lever = half * (np.linalg.norm(far) - np.linalg.norm(near)) / force
        assert lever == pytest.approx(float(start["centroid"]), abs=0.02 * mm)


def test_tilts_of_either_sign_are_mirror_images(tilted):
    below, none, above = (run.data.isel(stage=0) for run in tilted.values())
    alpha = korta_pair.paper_pair().alpha_wt
    given = above["misalignment"][0] / (max(tilted) * np.cos(alpha))
    assert 0.85 < given < 0.95
    assert float(below["misalignment"][0]) == pytest.approx(-float(above["misalignment"][0]), rel=1e-6)
    assert float(none["misalignment"][0]) == pytest.approx(0, abs=1e-9)
    means = [float(data["centroid"].mean()) for data in (below, none, above)]
    assert means == pytest.approx([-means[2], 0, means[2]], rel=1e-3, abs=1e-3 * mm)
    assert means[2] < -2 * mm
    assert float(below["dte"].std()) == pytest.approx(float(above["dte"].std()), rel=1e-3)


@pytest.fixture(scope="module")
def stages(tmp_path_factory):
    return two_stage_helical.main(tmp_path_factory.mktemp("figures"), quick=True)


def test_bearings_take_the_axial_forces_of_the_helical_gears(stages):
    model, opposed, run = stages
    by_load = two_stage_helical.axial_forces(model.gearbox, run.data)
    by_tilts = 1e-4 * float(np.abs(run.data["mesh_force"][:, 0]).max())
    assert two_stage_helical.axial_reactions(run.data) == pytest.approx(by_load, rel=1e-3, abs=by_tilts)
    assert sum(by_load.values()) == pytest.approx(0, abs=1e-9 * by_load["input"])
    with_opposite_hands = two_stage_helical.axial_forces(opposed, run.data)
    assert abs(by_load["middle"]) == pytest.approx(abs(by_load["output"]) - abs(by_load["input"]))
    assert abs(with_opposite_hands["middle"]) == pytest.approx(abs(by_load["output"]) + abs(by_load["input"]))


def test_radial_forces_of_both_meshes_balance_on_the_middle_shaft(stages):
    model, _, run = stages
    start = run.data["bearing_force"].isel(time=0)
    total = {name: sum(start.sel(bearing=f"{name} at {z} mm").values for z in (0, 150)) for name in model.bodies}
    assert sum(total.values()) == pytest.approx(np.zeros(3), abs=0.1)
    forces = two_stage_helical.starting_forces(model.gearbox, run.data)
    force = dict(zip(("first", "second"), forces, strict=True))
    assert np.linalg.norm(total["input"][:2]) == pytest.approx(force["first"], rel=1e-3)
    assert np.linalg.norm(total["output"][:2]) == pytest.approx(force["second"], rel=1e-3)


def test_shuttling_alone_shakes_the_bearings_of_a_slow_helical_stage(stages):
    """The force centroid moves along the face width, and the force to and fro between the bearings."""
    model, *_ = stages
    slow = exugear.run_up(model, speed=100 * rpm, duration=0.15, load=600.0, progress=False).data
    slow = slow.isel(time=slice(slow["time"].size // 5, None))
    wander = 600.0 / model.gearbox.stages[1].pair.wheel.r_b * float(slow["centroid"][1].std()) / 0.15
    for axial in (0, 150):
        radial = slow["bearing_force"].sel(bearing=f"output at {axial} mm", direction=["x", "y"])
        assert np.linalg.norm(radial.std("time")) == pytest.approx(wander, rel=0.1)


@pytest.fixture(scope="module")
def planets(tmp_path_factory):
    return planetary_load_sharing.main(
        tmp_path_factory.mktemp("figures"), errors=(-20 * um, 0.0, 20 * um), duration=0.05
    )


def test_planets_share_the_load_in_statics_as_at_the_end_of_the_ramp(planets):
    faces = exugear.load_distribution(
        planetary_load_sharing.gearbox(pin_errors=(-20 * um, 0.0, 0.0)), 2500.0, mesh_stiffness=20e9
    )
    shares = exugear.planet_shares(planets["-20 µm"])["share"].isel(time=-1).values
    assert faces["K_gamma"].values[::2] / 3 == pytest.approx(shares, abs=2e-3)
    assert shares[0] > 0.34


def lin_and_parker(planets: int) -> np.ndarray:
    """Frequencies [Hz] of the 1999 model: sun, ring, carrier (x, y, u), and planets (radial, tangential, u)."""
    p, alpha, size = planetary_set, np.radians(24.6), 9 + 3 * planets
    mass = [x for m, i in (p.SUN, p.RING, p.CARRIER, *[p.PLANET] * planets) for x in (m, m, i)]
    springs = [(p.BEARING, {k: 1}) for k in (0, 1, 3, 4, 6, 7)] + [(p.RING_TORSION, {5: 1})]
    for k in range(planets):
        at, i = 2 * np.pi * k / planets, 9 + 3 * k
        for body, turn in ((0, -1), (3, 1)):
            along = {body: -np.sin(at + turn * alpha), body + 1: np.cos(at + turn * alpha), body + 2: 1}
            springs += [(p.MESH, along | {i: turn * np.sin(alpha), i + 1: -np.cos(alpha), i + 2: -turn})]
        springs += [(p.BEARING, {6: np.cos(at), 7: np.sin(at), i: -1})]
        springs += [(p.BEARING, {6: -np.sin(at), 7: np.cos(at), 8: 1, i + 1: -1})]
    rows = np.zeros((len(springs), size))
    for row, (stiffness, entries) in zip(rows, springs, strict=True):
        row[list(entries)] = np.sqrt(stiffness) * np.array(list(entries.values()))
    scaled = rows / np.sqrt(mass)
    return np.sqrt(np.abs(np.linalg.eigvalsh(scaled.T @ scaled))) / (2 * np.pi)


FOUR = (727.0, 727.0, 1091.0, 1091.0, 1536.6, 1808.2, 1892.8, 1892.8, 1970.6, 2342.5, 2342.5, 2625.7, 5963.8)
STIFF = (6986.3, 6986.3, 7462.8, 9647.9, 9647.9, 11775.3)


def test_natural_frequencies_of_the_planetary_set_are_the_published_ones(tmp_path):
    """With four planets the lowest are 0.04 % off what the paper's own equations give from its rounded data."""
    frequencies = planetary.main(tmp_path)
    assert frequencies[0] == 0.0
    assert frequencies[1:] == pytest.approx((*planetary.PUBLISHED[1:], *STIFF), rel=5e-5)
    assert planetary.modes(planets=4)["frequency"].values[1:14] == pytest.approx(FOUR, rel=4e-4)


@pytest.mark.parametrize("load", [0.1, 10.0])
@pytest.mark.parametrize("number", [3, 4])
def test_a_light_load_does_not_move_natural_frequencies(number, load):
    exact = lin_and_parker(number)[1:]
    assert planetary.modes(number, load)["frequency"].values[1:] == pytest.approx(exact, rel=3e-5)


def test_planets_share_the_load_by_the_position_of_their_pins(planets):
    """The force that a displaced pin shifts is linear in it and independent of the load; a floating sun evens out."""
    moved = []
    for run in planets.values():
        forces = run.data["mesh_force"].values[::2]
        excess = forces[0] - forces.mean(axis=0)
        assert excess[-1] == pytest.approx(excess[0], rel=0.03, abs=5)
        assert forces[1] == pytest.approx(forces[2], rel=0.02)
        moved.append(excess[0])
    behind, none, ahead, floating = moved
    assert (behind, none) == pytest.approx((-ahead, 0), rel=1e-2, abs=1)
    assert behind > 100
    assert abs(floating) < 0.1 * behind


def test_two_laws_stand_on_the_same_map(short):
    """Slow: all follow the STE at the nominal torque. With the pinion's speed imposed, dU/dphase changes no DTE."""
    ste, *_ = short
    static = ste["te"].sel(torque=150).values
    dte = {}
    two_cycles = {"speed": 20 * np.pi / 57, "duration": 0.2, "load": 150.0, "progress": False}
    for name, law_of in korta_two_laws.laws(150.0).items():
        model = exugear.build(korta_pair.gearbox(ste, law_of=law_of))
        dte[name] = exugear.run_up(model, **two_cycles).data["dte"].values[0]
        assert dte[name].mean() == pytest.approx(static.mean(), rel=5e-3)
        assert np.ptp(dte[name]) == pytest.approx(np.ptp(static), rel=5e-2)
    assert dte["without dU/dphase"] == pytest.approx(dte["whole map"], rel=1e-3)


def test_table_of_resonances_rises_with_the_load(short):
    _, _, runs = short
    ours, published = (line for line in korta_pair.resonance_table({"exugear": runs}).splitlines() if line[-1] == "%")
    assert published.split()[-2] == "8.54"
    assert 3 < float(ours.split()[-2]) < 8


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_examples_say_how_they_are_run(path):
    text = path.read_text(encoding="utf-8")
    if '__name__ == "__main__"' in text:
        assert len(text.splitlines()) >= 40
        assert f"python examples/{path.name}" in text.split('"""')[1]


def test_a_set_as_data_shares_its_load_as_one_built_by_hand():
    """Bodies, gear contacts and springs of Exudyn, in static equilibrium; the first pin lies 20 um behind."""
    gears = planetary_set.build(error=-20 * um)
    gears.mbs.CreateCoordinateConstraint(itemNumbers=[None, gears.bodies["sun"]], coordinates=[None, 2])
    gears.mbs.AddLoad(eii.LoadCoordinate(markerNumber=gears.coordinate("carrier", 2), load=-500.0))
    gears.mbs.Assemble()
    planetary_set.put_into_mesh(gears)
    recorders = [recorder for meshes in zip(gears.sun, gears.ring, strict=True) for recorder in meshes]
    for recorder in recorders:
        recorder.start(1.0, 2)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    gears.mbs.SolveStatic(settings, updateInitialValues=True)
    model = exugear.build(planetary_load_sharing.gearbox(pin_errors=(-20 * um, 0.0, 0.0)))
    run = exugear.run_up(model, speed=1e-3, load=500.0, duration=1e-4, progress=False, checks=0)
    assert run.data["mesh_force"].values[:, 0] == pytest.approx([recorder.force[1] for recorder in recorders], rel=1e-4)
