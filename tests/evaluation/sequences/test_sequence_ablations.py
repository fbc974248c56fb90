"""The bill of the steps that find objects over time."""

from __future__ import annotations

import importlib

import pytest

from doo3d.evaluation.sequences.ablations import STEPS, table
from doo3d.evaluation.sequences.scenes import make_sequence


@pytest.mark.parametrize("step", STEPS)
def test_each_step_names_places_in_the_source(step):
    for place in STEPS[step]:
        module, _, name = place.partition(":")
        assert hasattr(importlib.import_module(module), name)


def test_every_step_can_be_taken_out():
    head, _, *lines = table([(make_sequence("dragged", 3, (320, 240), frames=4), "d435")], list(STEPS))
    assert head.startswith("| of 4 frames |")
    assert [line.split(" | ")[0] for line in lines] == [f"| {step}" for step in STEPS]


@pytest.mark.slow
def test_hidden_parts_that_are_carried_are_nearer_to_the_truth_than_those_that_are_not():
    head, rule, line = table([(make_sequence("dragged", 3, frames=40), "d435")], ["hidden parts carried"])
    assert rule.count("|") == head.count("|") == line.count("|")
    with_it, without = line.split(" | ")[3].removesuffix(" mm").split(" for ")
    assert float(with_it) < float(without)
