"""The tables in the documentation hold every key that the files hold, and the weights of the confidence."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from builders.paths import ROOT

from doo3d.judge.evidence import WEIGHTS_AUTO, WEIGHTS_GIVEN
from doo3d.runs.frame_record import FrameRecord
from doo3d.types import SCHEMA, Chain, ChainEnd, Connection, Crossing, Detection, Junction, LinearObject, SegmentRef, View

PAGES = ROOT / "docs" / "pages"


def documented(page: str, header: str) -> set[str]:
    """Return the keys in the first column of the table of a page that begins with the header."""
    text = (PAGES / page).read_text(encoding="utf-8")
    rows = text[text.index(f"| {header} |") :].split("\n\n")[0]
    return {key for row in re.findall(r"^\| (`.*?) \|", rows, re.MULTILINE) for key in re.findall(r"`(\w+)`", row)}


def detection() -> Detection:
    """Return a detection with a chain of two pieces that crosses itself."""
    joints = np.column_stack((np.arange(4) * 0.01, np.zeros(4), np.ones(4)))
    chain = Chain(joints, 0.01, 0.004, connections=(Connection(1, 0.5),), deviations=np.ones((4, 2)))
    return Detection((chain,), crossings=(Crossing(SegmentRef(0, 0), SegmentRef(0, 2), np.zeros(3)),), view=View(4, 4))


def test_keys_of_a_detection():
    assert documented("results.md", "key | type") == set(detection().to_dict())
    assert SCHEMA in (PAGES / "results.md").read_text(encoding="utf-8")


def test_keys_of_a_junction_and_an_object():
    junction = Junction(np.zeros(3), (ChainEnd(0, 0), ChainEnd(0, 1)), np.ones(2))
    values = replace(detection(), junctions=(junction,), objects=(LinearObject((0,), (0,)),)).to_dict()
    assert documented("results.md", "key of a junction | type") == set(values["junctions"][0])
    assert documented("results.md", "key of an object | type") == set(values["objects"][0])


def test_keys_of_a_chain_and_a_crossing():
    values = detection().to_dict()
    assert documented("results.md", "key of a chain | type") == set(values["chains"][0])
    assert documented("results.md", "key of a crossing | type") == set(values["crossings"][0])


def test_keys_of_a_frame_in_the_manifest():
    record = FrameRecord("000000", "capture", None, "ok")
    assert documented("runs.md", "key of a frame") == set(record.to_dict())


def test_weights_of_the_confidence():
    text = (PAGES / "how-it-works.md").read_text(encoding="utf-8")
    rows = text[text.index("| evidence | amount |") :].split("\n\n")[0].splitlines()[2:]
    columns = zip(*(row.split("|")[3:5] for row in rows), strict=True)
    stated = [sorted(float(cell) for cell in column if cell.strip()) for column in columns]
    assert stated == [sorted(weights.values()) for weights in (WEIGHTS_GIVEN, WEIGHTS_AUTO)]
