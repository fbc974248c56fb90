"""Texts of many values are refused by their number, before Python has objects for them."""

import json

import pytest
from builders.errors import refuses

from doo3d.guard import parsing
from doo3d.guard.parsing import parse_json, parse_yaml


@pytest.mark.parametrize("text", ["[" + "[]," * 20 + "0]", "[" + '{"a": 1},' * 20 + "0]", "[" + "1," * 20 + "0]"])
def test_a_json_text_of_many_values(text, monkeypatch):
    assert len(parse_json(text, "a.json")) == 21
    monkeypatch.setattr(parsing, "MAX_JSON_VALUES", 20)
    monkeypatch.setattr(json, "loads", None)
    with refuses("json-invalid", "a.json", "more than 20 values"):
        parse_json(text, "a.json")


@pytest.mark.parametrize("text", ["[" + "[]," * 20 + "]", "- {a: 1}\n" * 20, "? [a]\n" * 20])
@pytest.mark.parametrize("ignore_tags", [False, True])
def test_a_yaml_text_of_many_values(text, ignore_tags, monkeypatch):
    monkeypatch.setattr(parsing, "MAX_YAML_VALUES", 20)
    with refuses("yaml-invalid", "a.yaml", "more than 20 values"):
        parse_yaml(text, "a.yaml", ignore_tags=ignore_tags)


def test_the_largest_texts_have_room_for_what_recorders_write():
    """An hour of poses of Record3D at 60 Hz, and the description of a bag of 4000 files."""
    frame = json.dumps({"pose": [0.1] * 7, "intrinsics": [0.1] * 4, "time": 0.1})
    assert sum(map(frame.count, ",[{")) * 3600 * 60 < parsing.MAX_JSON_VALUES
    file = "- path: a.db3\n  starting_time: {nanoseconds_since_epoch: 1}\n  duration: {nanoseconds: 1}\n  message_count: 1\n"
    assert len(parse_yaml(file * 4000, "metadata.yaml")) == 4000
