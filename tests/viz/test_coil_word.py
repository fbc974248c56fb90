"""The picture of a coil has the word in the middle of its turns."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.judge.notes import COIL
from doo3d.types import Camera, Chain, Detection, Frame
from doo3d.viz import draw

FRAME = Frame(np.full((480, 640, 3), 128, np.uint8), np.full((480, 640), 0.6, np.float32), Camera(600, 600, 320, 240, 640, 480))
NOTE = f"{COIL}: a chain makes 2.0 turns that touch or overlap"


def coil(shift=(0.0, 0.0, 0.6)):
    """A chain that runs twice around a circle of 100 px."""
    angle = np.linspace(0, 4 * np.pi, 101)
    joints = 0.1 * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle)) + shift
    return Chain(joints, float(np.linalg.norm(joints[1] - joints[0])), 0.004)


def words(detection, note=NOTE):
    """Where the note changes the picture: rows and columns."""
    plain = draw(FRAME, detection)
    noted = draw(FRAME, Detection(detection.chains, doubtful=detection.doubtful, notes=(note,)))
    return np.nonzero((plain != noted).any(axis=2))


@pytest.mark.parametrize("doubtful", [False, True])
def test_the_word_stands_in_the_middle(doubtful):
    straight = Chain(np.column_stack((np.linspace(-0.3, 0.3, 61), np.full(61, -0.18), np.full(61, 0.6))), 0.01, 0.004)
    chains = (straight,) if doubtful else (straight, coil())
    rows, columns = words(Detection(chains, doubtful=(coil(),) if doubtful else ()))
    assert len(rows) > 50
    assert abs(rows.mean() - 240) < 30
    assert abs(columns.mean() - 320) < 50


def test_no_word_without_a_coil_in_view():
    assert not len(words(Detection((coil(),)), "branches: chains meet")[0])
    assert not len(words(Detection(()))[0])
    assert not len(words(Detection((coil((2.0, 0.0, 0.6)),)))[0])
