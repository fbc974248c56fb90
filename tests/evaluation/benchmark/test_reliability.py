"""How many frames of each confidence are right: bins, the most confident part, and the printed table."""

from __future__ import annotations

import json

import numpy as np
import pytest

from doo3d.evaluation.benchmark.tables import json_text
from doo3d.evaluation.metrics.confidence import format_reliability, most_confident_part, reliability
from doo3d.evaluation.metrics.record import Record

CONFIDENCE = (0.0, 0.3, 0.5, 0.85, 0.96, 0.97, 0.98, 1.0)
CORRECT = (False, True, False, True, True, True, True, True)


def row(confidence: float, correct: bool, in_image: bool | None = True) -> Record:
    return Record(family="b", frame="a", counted=False, correct=correct, image_correct=in_image, confidence=confidence, ms=1.0)


ROWS = [row(*each) for each in zip(CONFIDENCE, CORRECT, strict=True)]


def test_every_frame_is_in_one_bin():
    bins = reliability(ROWS)
    assert [each.frames for each in bins] == [2, 1, 1, 0, 2, 2]
    assert [each.correct for each in bins] == [1, 0, 1, 0, 2, 2]
    assert bins[0].confidence == pytest.approx(0.15)
    assert np.isnan(bins[3].confidence)


def test_the_most_confident_part():
    part = most_confident_part(ROWS)
    assert (part.frames, part.correct, part.low) == (6, 5, 0.5)
    assert most_confident_part([]).frames == 0
    unknown = most_confident_part([row(0.9, True, None), row(0.8, False, False)], 1.0)
    assert (unknown.image_frames, unknown.image_correct) == (1, 0)


def test_the_table_and_the_file():
    lines = format_reliability(ROWS).splitlines()
    assert len(lines) == 1 + 5 + 1
    assert lines[1].split()[:4] == ["0.98", "to", "1", "2"]
    assert "5/6 83.3 %" in lines[-1]
    held = json.loads(json_text(ROWS, (), {}))["reliability"]
    assert [each["frames"] for each in held["bins"]] == [2, 1, 1, 0, 2, 2]
    assert held["most_confident"]["correct"] == 5
