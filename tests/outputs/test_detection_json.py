"""The JSON of a detection: schema, units, values kept, bytes the same every time."""

import json
from dataclasses import replace

import numpy as np

from doo3d.outputs.detection_json import dumps, encode
from doo3d.outputs.run_reader import read_detection
from doo3d.types import Chain, Cloud, Detection

CLOUD = Cloud(np.zeros((1, 3)))


def detection(**changes) -> Detection:
    joints = np.array([[0, 0, 0.6], [0.01, 0, 0.6], [0.02, 0, 0.6]]) + 1 / 3
    chain = Chain(joints, 0.01, 0.0042, occluded=np.array([False, True]))
    return Detection((chain,), **({"frame": "Bild é", "timestamp": 12.345, "seconds": {"segment": 0.003}} | changes))


def test_what_the_file_holds():
    found = detection()
    data = encode(found, CLOUD)
    assert data.endswith(b"}\n")
    assert "Bild é".encode() in data
    read = json.loads(data)
    assert read == found.to_dict()
    about = ["schema", "frame", "timestamp", "mode", "units", "coordinates"]
    assert list(read) == [*about, "chains", "doubtful", "crossings", "plane", "pose", "confidence", "seconds", "notes"]
    of_chain = ["id", "joints", "segment_length", "radius", "radii", "length", "occluded", "depth", "closed", "connections"]
    of_chain += ["confidence"]
    assert list(read["chains"][0]) == of_chain
    assert (read["schema"], read["units"], read["mode"]) == ("doo3d/detection/2", "m", "3d")
    assert np.array_equal(read["chains"][0]["joints"], found.chains[0].joints)


def test_the_same_bytes_every_time():
    assert encode(detection(), CLOUD) == encode(detection(), CLOUD)


def test_one_line_per_joint():
    lines = dumps(detection().to_dict()).splitlines()
    assert sum(line.count("[0.3") + line.count("[0.34") > 0 and line.strip().startswith("[") for line in lines) == 3


def test_text_that_looks_like_a_list_stays_as_it_is():
    note = "[\n 1,\n 2\n] a [b] {c}"
    assert json.loads(dumps({"notes": [note], "empty": [], "deep": [[], [1]]})) == {
        "notes": [note],
        "empty": [],
        "deep": [[], [1]],
    }


def test_what_json_has_no_number_for_is_null():
    chain = Chain(np.array([[0.0, 0, 1], [0.01, 0, 1]]), 0.01)
    text = dumps(Detection((chain,)).to_dict())
    assert "NaN" not in text
    assert json.loads(text)["chains"][0]["radius"] is None
    assert json.loads(dumps({"a": [float("inf")]})) == {"a": [None]}


def test_no_chains():
    read = json.loads(dumps(Detection(()).to_dict()))
    assert (read["chains"], read["doubtful"], read["confidence"]) == ([], [], None)


def test_doubtful_chains_are_read_back_and_older_files_have_none(tmp_path):
    (chain,) = detection().chains
    found = detection(doubtful=(replace(chain, confidence=0.13),))
    values, file = json.loads(encode(found, CLOUD)), tmp_path / "a.json"
    assert values["doubtful"] == [found.doubtful[0].to_dict()]
    assert values["confidence"] == 0.13
    file.write_text(json.dumps(values | {"frame": "a"}), encoding="utf-8")
    assert read_detection(file).to_dict() == found.to_dict() | {"frame": "a"}
    del values["doubtful"]
    file.write_text(json.dumps(values | {"frame": "a"}), encoding="utf-8")
    assert read_detection(file).doubtful == ()
    assert read_detection(file).confidence == 1.0
