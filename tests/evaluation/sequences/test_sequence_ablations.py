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
