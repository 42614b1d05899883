"""Cost of a map before it is solved: its number of states, less the cached finite elements."""

import pytest
from paper_gears import few_teeth, paper_pair

import fem
from fem.units import deg, mm

QUICK = fem.Slices()
TILTED = fem.Offsets(misalignment=(-1e-4, 0.0, 1e-4), axial=(0.0, 1 * mm))


@pytest.fixture
def cold(monkeypatch, tmp_path):
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))


def test_states_are_those_of_the_map(paper_pair):
    cost = fem.map_cost(paper_pair, [0, 50, 150], 5, offsets=TILTED, resolution=QUICK)
    ste = fem.static_transmission_error(paper_pair, [0, 50, 150], 5, offsets=TILTED, resolution=QUICK, progress=False)
    assert cost.states == ste["te"].size == 90 and cost.checks == 0 and not cost.at_least
    memory = sum(values.nbytes for values in ste.values() if values.size >= ste["te"].size)
    assert cost.memory == pytest.approx(memory, rel=0.3)


def test_what_is_cached_costs_nothing(cold, paper_pair):
    before = fem.map_cost(paper_pair, [0, 50], 4)
    fem.static_transmission_error(paper_pair, [0, 50], 4, progress=False)
    after = fem.map_cost(paper_pair, [0, 50], 4)
    assert before.compliances > 0 == after.compliances
    assert before.contact == after.contact and before.seconds > after.seconds
    assert "compliances in the cache: about" in str(after)
    wider = fem.map_cost(paper_pair, [0, 50], 4, offsets=fem.Offsets(misalignment=1e-4))
    assert 0 < wider.compliances < before.compliances


def test_more_costs_more(cold, paper_pair):
    helical = fem.GearPair(few_teeth(beta=15 * deg), few_teeth(beta=-15 * deg, z=41))
    default = fem.map_cost(helical, [0, 50], 30)
    assert fem.map_cost(helical, [0, 20, 50], 30).contact == pytest.approx(1.5 * default.contact)
    assert fem.map_cost(helical, [0, 50], 30, resolution=QUICK).contact < 0.5 * default.contact
    assert fem.map_cost(helical, [0, 50], 30, resolution=fem.Resolution().finer()).seconds > 2 * default.seconds
    assert fem.map_cost(paper_pair, [0, 50], 30).seconds < default.seconds
    unlike = fem.GearPair(few_teeth(), few_teeth(z=41))
    alike = fem.GearPair(few_teeth(), few_teeth())
    assert fem.map_cost(unlike, [50]).compliances == pytest.approx(2 * fem.map_cost(alike, [50]).compliances)


def test_an_accuracy_costs_at_least_its_coarsest_level(cold, paper_pair):
    chosen = fem.map_cost(paper_pair, fem.UpTo(350), phases=None, accuracy=0.02)
    assert chosen.at_least and chosen.checks > chosen.states
    assert chosen.seconds > fem.map_cost(paper_pair, [0, 5, 20, 90, 350], 12, resolution=QUICK).seconds
    assert "to estimate errors" in str(chosen) and ": at least " in str(chosen)


def test_a_cost_prints_states_compliances_time_and_memory(cold, paper_pair):
    cost = fem.map_cost(paper_pair, [0, 50, 150], 30)
    assert str(cost).startswith("90 states of 0.6 ms, compliances ")
    assert ": about " in str(cost) and str(cost).endswith(" MB of map")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"torque": fem.UpTo(50)}, "need an accuracy"),
        ({"torque": [50, 20]}, "torque must increase"),
        ({"torque": [50], "accuracy": 3.0}, "accuracy must lie"),
        ({"torque": [0], "accuracy": 0.01}, "needs a torque > 0"),
        ({"torque": fem.UpTo(1e6), "accuracy": 0.01}, "Hertz pressure passes"),
        ({"torque": [50], "accuracy": fem.Slices()}, r"pass resolution=fem\.Slices"),
        ({"torque": [50], "accuracy": 0.01, "resolution": fem.Slices()}, "leave out accuracy or resolution"),
        ({"torque": [50], "offsets": 0.1}, "offsets must be a"),
        ({"torque": [50], "phases": 2}, "phases must be"),
    ],
)
def test_bad_input_is_refused_before_anything_is_solved(arguments, named):
    with pytest.raises(ValueError, match=named):
        fem.map_cost(paper_pair(), **arguments)
