"""Find the chains of a frame of a run: from the frame alone, or in two passes from the whole capture."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from ..config import Config
from ..inputs import FrameData, FrameRef
from ..outputs import STRANDS
from ..pipeline import detect
from ..types import Cloud, Detection, Frame, as_pose


@dataclass(frozen=True)
class Found:
    """The result of a method in one frame.

    Attributes
    ----------
    detection
        the chains.
    files
        suffix -> content of files of the frame besides its JSON result and its picture.
    """

    detection: Detection
    files: dict[str, bytes] = field(default_factory=dict)


Method = Callable[[FrameData, FrameRef, Config], Found]
"""Function that finds chains, given a frame's data, the frame and the settings; other processes must be able to import it."""


def detect_alone(loaded: FrameData, frame: FrameRef, config: Config) -> Found:
    """Run the detection in a frame by itself."""
    pose = None if config.mode == "2d" else loaded.base_pose
    return Found(detect(loaded.data, config, loaded.mask_for(config), pose))


def detect_all(loaded: FrameData, frame: FrameRef, config: Config) -> Found:
    """Run the detection in a frame by itself, and return also the chains that `output.min_confidence` leaves out."""
    pose = None if config.mode == "2d" else loaded.base_pose
    return Found(detect(loaded.data, config, loaded.mask_for(config), pose, all_chains=True))


def first_pass(loaded: FrameData, frame: FrameRef, config: Config) -> Found:
    """Run the detection in a frame of a sequence by itself, and store its strands for the second pass."""
    from ..outputs.sequence_files import encode_strands
    from ..track.first_pass import observe_frame

    assert isinstance(loaded.data, Frame | Cloud)
    observation = observe_frame(loaded.data, config, loaded.mask_for(config), loaded.pose)
    return Found(observation.detection, {STRANDS: encode_strands(observation)})


@dataclass(frozen=True)
class SecondPass:
    """The method that takes the chains of a frame from the whole sequence.

    Attributes
    ----------
    folder
        the folder that the first pass wrote.
    digest
        digest of the first pass's files; data kept in memory for another digest is not used.
    """

    folder: Path
    digest: str

    def __call__(self, loaded: FrameData, frame: FrameRef, config: Config) -> Found:
        """Return the chains of a frame, in the base frame if it has one."""
        from ..track.tracks import WINDOW

        start = _positions(self)[frame.name] // WINDOW * WINDOW
        detection = _window(self, start)[frame.name]
        return Found(detection if loaded.base_pose is None else detection.transformed(as_pose(loaded.base_pose)))


@lru_cache(maxsize=2)
def _positions(method: SecondPass) -> dict[str, int]:
    """Return name of each frame -> position in the capture."""
    from ..outputs.sequence_files import read_objects

    return {name: position for position, name in enumerate(read_objects(method.folder).frames)}


@lru_cache(maxsize=2)
def _window(method: SecondPass, start: int) -> dict[str, Detection]:
    """Return name -> detection for the frames of a window; the result is cached for the following frames."""
    from ..outputs.sequence_files import read_objects, read_observation
    from ..track.detect_sequence import combine_window, window_bounds

    known = read_objects(method.folder)
    first, last = window_bounds(start, len(known.frames))
    observations = [read_observation(method.folder, name) for name in known.frames[first:last]]
    detections = combine_window(start, observations, known.objects, known.max_gap, known.min_confidence)
    return dict(zip(known.frames[start:], detections, strict=False))
