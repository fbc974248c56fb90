"""Fixtures of the tests of runs."""

import shutil
from contextlib import contextmanager

import numpy as np
import pytest
from builders.paths import SAMPLES
from builders.runs import files_of

from doo3d.config import Config
from doo3d.inputs import ReadOptions, open_capture
from doo3d.runs import methods
from doo3d.runs import run as batch
from doo3d.runs.process_frames import JobSize
from doo3d.types import Chain, Detection


class FakeDetection(dict):
    """The function "do" that stands in for the method."""

    @contextmanager
    def failing(self, error, frame=None):
        """Let the detection of a frame, or of all, raise an error."""
        inner = self["do"]

        def do(data, config, mask):
            if frame in (None, data.name):
                raise error
            return inner(data, config, mask)

        self["do"] = do
        yield
        self["do"] = inner


@pytest.fixture
def fake_detection(monkeypatch):
    """A detection without the method, for tests of the run alone; it is made by the function `fake_detection["do"]`."""
    chain = Chain(np.array([[-0.02, 0, 0.5], [-0.01, 0, 0.5], [0, 0, 0.5]]), 0.01, 0.005, occluded=np.array([True, False]))
    fake = FakeDetection(do=lambda data, config, mask: Detection((chain,), frame="other", notes=("a note",)))
    monkeypatch.setattr(methods, "detect", lambda data, config, mask=None, pose=None: fake["do"](data, config, mask))
    return fake


@pytest.fixture(scope="session")
def frames(tmp_path_factory):
    """A capture of eight frames: the sample's three, again and again, and one that cannot be read."""
    folder, sample = tmp_path_factory.mktemp("runs") / "capture", SAMPLES / "crossing"
    for part, suffix in (("color", "jpg"), ("depth", "png")):
        (folder / part).mkdir(parents=True)
        for i in range(8):
            shutil.copy(sample / part / f"{i % 3:06d}.{suffix}", folder / part / f"{i:06d}.{suffix}")
    shutil.copy(sample / "camera_intrinsic.json", folder)
    (folder / "depth" / "000004.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    return folder


@pytest.fixture(scope="session")
def expected(frames, tmp_path_factory):
    """The files of a run of `frames` by one process."""
    out = tmp_path_factory.mktemp("expected") / "out"
    batch.run(open_capture(frames), out, Config(), batch.RunOptions(reading=ReadOptions()))
    return files_of(out)


@pytest.fixture
def in_groups(monkeypatch):
    """Jobs of three frames from the start, however few frames the capture has."""
    monkeypatch.setattr(JobSize, "frames", lambda self, remaining: 3)
