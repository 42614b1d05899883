"""The plan before and after the model is built."""

import pytest
from bearing_boxes import box_of
from scenes import smooth_box

import exugear


def test_the_built_plan_prints_the_scene_and_then_integrator_step_cost_and_call():
    box = box_of()
    before, after = (str(plan).splitlines() for plan in (exugear.plan(box), exugear.build(box).plan))
    assert after[: len(before) - 1] == before[:-1]
    assert before[-1] == "integrator and step: known once the model is built (build(box).plan)"
    titles = [line.split(":")[0] for line in after[len(before) - 1 :]]
    resonances = [title for title in titles if title.startswith("resonance of")]
    assert resonances == [f"resonance of {label}" for label in box.labels]
    remaining = [title for title in titles if title not in resonances]
    assert remaining == ["integrator", "eigenfrequencies", "largest stable step", "tolerance 1e-3", "contact"]
    assert "; parts of a run with executor=: start 0.13 s early" in str(exugear.build(box).plan)


def test_the_plan_names_the_load_of_its_resonances():
    plan = str(exugear.build(smooth_box()).plan)
    assert "where it is free, at 4000 N m on the pinion, the largest of the map" in plan


def test_the_plan_names_a_stage_without_backlash():
    with_backlash, without = smooth_box(), smooth_box(backlash=0.0)
    missing = "no backlash, coast flanks touch as soon as the teeth part"
    assert missing not in str(exugear.plan(with_backlash))
    assert f"{without.labels[0]}: {missing}" in str(exugear.plan(without))


def test_a_model_is_built_by_the_plan_of_another_model():
    box = smooth_box()
    unreduced = exugear.build(box, plan=exugear.plan(box).with_joints())
    again = exugear.build(box, plan=unreduced.plan)
    assert again.plan.shafts == unreduced.plan.shafts
    assert again.plan.omega == pytest.approx(unreduced.plan.omega)
