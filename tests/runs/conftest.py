"""Fixtures of the tests of runs."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.runs import frame_jobs
from doo3d.types import Chain, Detection


@pytest.fixture
def fake_detection(monkeypatch):
    """A detection without the method, for tests of the run alone; it is made by the function `fake_detection["do"]`."""
    chain = Chain(np.array([[-0.02, 0, 0.5], [-0.01, 0, 0.5], [0, 0, 0.5]]), 0.01, 0.005, occluded=np.array([True, False]))
    fake = {"do": lambda data, config, mask: Detection((chain,), frame="other", notes=("a note",))}
    monkeypatch.setattr(frame_jobs, "detect", lambda data, config, mask=None: fake["do"](data, config, mask))
    return fake
