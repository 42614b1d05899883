"""The page of a planetary set in the report: members and torques, phases, sharing, orbit, side bands, modes by kind."""

import re

import numpy as np
import pytest
from coupled_sets import ravigneaux, simpson
from planetary_boxes import SUN_PAIR, members, planar_box, planetary, planetary_box, waving_law
from report_pages import table

import exugear
from fem.units import um

OPTIONS = {"progress": False, "checks": 0}


@pytest.fixture(autouse=True)
def without_browser(monkeypatch):
    monkeypatch.setenv("PATH", "")


def test_a_set_on_pins_has_a_page_with_its_sharing_orbit_and_kinds_of_modes(tmp_path):
    """Four planets, of which the first is behind: the shares of exugear.planet_shares, torques in balance."""
    model = exugear.build(planar_box(planets=4, pin_errors=[-20 * um, 0.0, 0.0, 0.0]))
    run = exugear.run_up(model, speed=50.0, load=4000.0, duration=5e-3, displacement=True, **OPTIONS)
    (path,) = exugear.report(run, tmp_path / "run.html", model=model)
    page = path.read_text(encoding="utf-8")
    assert re.search(r"<h2>\d Planetary set on carrier</h2>", page)
    assert "Phasing: planets mesh in sequence 1 with 3, 2 with 4, 1/2 of a pitch apart." in page
    torques = [float(row[-1]) for row in table(page, "Members of the set")[:3]]
    assert torques == pytest.approx([1000, 3000, -4000], rel=1e-3)
    shares = 100 * exugear.planet_shares(run)["mean_share"].values
    phases = table(page, "Phases of the meshes")
    assert [float(row[4]) for row in phases] == pytest.approx(shares.tolist(), abs=1e-3)
    assert [float(row[2]) for row in phases] == [0.0, 0.5, 0.0, 0.5]
    assert f"K_γ {float(exugear.planet_shares(run)['K_gamma']):.4g}; planet 1 carries most" in page
    assert "sun moves up to" in page and "Orbits of the members" in page
    assert {row[3] for row in table(page, "Natural frequencies")} <= {"rotational", "translational", "planet", "mixed"}


def test_a_sun_that_equal_planets_centre_does_not_move(tmp_path):
    """In phase their forces balance: what is left of the orbit is rounding, which is no picture."""
    run = exugear.run_up(
        exugear.build(planar_box()), speed=50.0, load=400.0, duration=5e-3, displacement=True, **OPTIONS
    )
    orbit = exugear.member_orbit(run, "sun")
    assert 0 < float(np.abs(orbit["displacement"]).max()) < 1e-10
    page = exugear.report(run, tmp_path / "run.html")[0].read_text(encoding="utf-8")
    assert "sun does not move on its bearings." in page and "Orbits of the members" not in page
    ax = exugear.plots.plot_orbit(orbit)
    assert ax.get_legend_handles_labels()[1][0] == "sun, which does not move"
    orbit["displacement"].loc["x"] = 1e-3 * np.cos(orbit["angle"])
    exugear.plots.plot_orbit(orbit, ax)
    assert ax.get_xlim()[1] > 900  # um: the range is not that of what stands still


def test_a_sweep_of_a_set_draws_the_meshes_of_equal_planets_once(tmp_path):
    """With sun and with ring; a planet whose pin is behind vibrates in its own way."""
    for errors, words in ((None, "× 3, of equal planets"), ([-5 * um, 0.0, 0.0], "× 2, of equal planets")):
        model = exugear.build(planetary_box(**{} if errors is None else {"pin_errors": errors}))
        run = exugear.run_up(model, speed=(100.0, 300.0), load=400.0, duration=0.05, **OPTIONS)
        page = exugear.report(run, tmp_path / "run.html", model=model)[0].read_text(encoding="utf-8")
        maps = {*re.findall(r"Order map of the DTE of [^:]*", page)}
        assert len(maps) == (2 if errors is None else 4) and sum(words in text for text in maps) == 2
    drawing = exugear.plots.plot_gearbox(model.gearbox)
    assert "planet 1: z 30 (× 3)" in "".join(text.get_text() for text in drawing.texts)


def test_the_page_of_a_steady_run_of_six_turns_lists_side_bands(tmp_path):
    """N = 3 equal planets and 90 teeth: only multiples of 3, of which 90 is the mesh itself."""
    model = exugear.build(planetary_box(law=waving_law(amplitude=0.2)))
    run = exugear.run_up(model, speed=1600.0, load=400.0, duration=0.1, sample=1e-5, **OPTIONS)
    (path,) = exugear.report(run, tmp_path / "run.html")
    lines = table(path.read_text(encoding="utf-8"), "Side bands of the mesh forces")
    strongest = max(lines, key=lambda row: float(row[1]))
    assert strongest[0] == "90" and strongest[3] == "mesh harmonic 1: torque, equal planets add up"
    assert {int(row[0]) % 3 for row in lines} == {0}


def test_a_stage_behind_the_carrier_and_other_gearboxes_have_their_own_sections(tmp_path):
    """The carrier passes its torque on to the stage; a gearbox without a set has no such page."""
    gear = SUN_PAIR.pinion
    carrier = exugear.Shaft("carrier", {0.06: gear}, inertia=0.02)
    stage = exugear.Stage(carrier, exugear.Shaft("out", {0.06: gear}), waving_law(), pair=SUN_PAIR)
    box = exugear.Gearbox([planetary(**members() | {"carrier": carrier}), stage], held="ring")
    run = exugear.run_up(exugear.build(box), speed=50.0, load=100.0, duration=1e-3, **OPTIONS)
    (path,) = exugear.report(run, tmp_path / "run.html")
    rows = {row[0]: row[-1] for row in table(path.read_text(encoding="utf-8"), "Members of the set")}
    assert rows["carrier"] == rows["each planet"] == "none"
    pair = exugear.Gearbox([exugear.Stage(carrier, exugear.Shaft("out", {0.06: gear}), waving_law(), pair=SUN_PAIR)])
    alone = exugear.run_up(exugear.build(pair), speed=50.0, load=100.0, duration=1e-3, **OPTIONS)
    (path,) = exugear.report(alone, tmp_path / "pair.html")
    assert "Planetary set" not in path.read_text(encoding="utf-8")


def test_sets_that_share_their_sun_have_a_page_each_with_their_own_shares(tmp_path):
    """Simpson: planets of both carriers mesh with the sun; the ring of the rear set carries those of the front."""
    box = exugear.Gearbox(simpson(), driving="front ring", held="rear carrier", driven="out")
    run = exugear.run_up(exugear.build(box), speed=50.0, load=300.0, duration=2e-3, **OPTIONS)
    page = exugear.report(run, tmp_path / "set.html")[0].read_text(encoding="utf-8")
    for carrier, name in (("out", "front"), ("rear carrier", "rear")):
        (section,) = re.findall(rf"<h2>\d+ Planetary set on {carrier}</h2>.*?</section>", page, re.DOTALL)
        phases = table(section, "Phases of the meshes")
        assert [row[0] for row in phases] == [f"{name} planet {k}" for k in (1, 2, 3)]
        assert [float(row[4]) for row in phases] == pytest.approx([100 / 3] * 3, abs=0.1)
    with pytest.raises(ValueError, match=r"'sun' meshes with planets of the carriers \['out', 'rear carrier'\], got"):
        exugear.planet_shares(run)
    front, rear = (exugear.planet_shares(run, member="sun", carrier=name) for name in ("out", "rear carrier"))
    assert rear["planet"].values.tolist() == [row[0] for row in phases]
    assert [float(shares["K_gamma"]) for shares in (front, rear)] == pytest.approx([1.0, 1.0], abs=1e-3)
    heard = exugear.force_seen_from_ring(run, ring="out")
    assert heard["speed"].attrs["long_name"] == "speed of the rear carrier relative to out"


def test_a_ravigneaux_set_has_a_page_with_its_members_meshes_and_sharing(tmp_path):
    box = exugear.Gearbox(ravigneaux(), driving="small", held="carrier", driven="ring")
    run = exugear.run_up(exugear.build(box), speed=50.0, load=300.0, duration=2e-3, progress=False, checks=0)
    page = exugear.report(run, tmp_path / "set.html")[0].read_text(encoding="utf-8")
    for words in (
        "Coupled planetary set on carrier",
        "Members of the set",
        "Meshes of the set",
        "inner planet 3-planet 3",
    ):
        assert words in page
    assert "The meshes with large carry no load." in page
    assert "Load sharing at small: K_γ 1" in page
    assert "-105" in page


def test_a_run_that_chooses_two_free_speeds_lists_their_ratio(tmp_path):
    """The carrier at (30 * 10 + 90 * 4) / 120 of sun and ring, not at the nominal (30 * 10 - 90 * 2) / 120."""
    model = exugear.build(exugear.Gearbox([planetary()], speeds={"sun": 1.0, "ring": -0.2}))
    ends = {"drives": {"sun": 10.0, "ring": -4.0}, "loads": {"carrier": 400.0}, "duration": 2e-3}
    page = exugear.report(exugear.run(model, **ends, power=True, **OPTIONS), tmp_path / "run.html")[0]
    rows = {row[0]: row for row in table(page.read_text(encoding="utf-8"), "Members of the set")}
    assert [float(rows[x][3]) for x in ("sun", "ring", "carrier")] == pytest.approx([1.0, 0.4, 0.55], rel=1e-3)
