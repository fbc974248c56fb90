"""The frames that an earlier run has not finished, and those that it has finished after them."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path

import numpy as np

from ..config import Config
from ..inputs import FrameRef
from ..outputs import SUFFIXES
from ..outputs.run_reader import read_detection
from ..track.tracking import Tracker
from ..types import Detection
from .executor import Executor
from .frame_record import OK, FrameRecord
from .frame_writer import FrameWriter
from .methods import Method, detect_alone
from .pictures import Pictures
from .process_frames import EVERYTHING, process_frames


def remaining_frames(
    frames: Sequence[FrameRef],
    config: Config,
    executor: Executor,
    tracker: Tracker | None,
    writer: FrameWriter,
    method: Method = detect_alone,
    thorough: frozenset[str] = frozenset(),
    pictures: Mapping[str, Pictures] = EVERYTHING,
) -> Iterator[tuple[FrameRecord, dict[str, bytes] | None]]:
    """Yield the record and the files of each frame that is to be done, in order; the others are confirmed in the folder.

    A frame in `folder.later` was finished before a frame that precedes it in the capture and is done now. Its chains keep their
    ids if tracking gives the same ids once more. Otherwise this frame and all after it are done again, so that the results are
    those of a run in one go.

    Parameters
    ----------
    frames
        the frames that are not in `folder.done`, in the capture's order.
    config
        configuration of the detection.
    executor
        does the jobs.
    tracker
        gives chains their ids, in its state after `folder.done`; None for frames that are not a sequence.
    writer
        the writer of the run, which writes what is yielded before the next frame is asked for.
    method
        how the chains of a frame are found.
    thorough
        names of the frames to look at thoroughly; see `detect_frame`.
    pictures
        whether pictures are drawn; see `process_frames`.
    """
    folder, position = writer.folder, 0
    while position < len(frames):
        group = list(takewhile(lambda frame: frame.name not in folder.later, frames[position:]))
        yield from process_frames(group, config, executor, tracker, method, thorough, pictures)
        position += len(group)
        while position < len(frames) and frames[position].name in folder.later:
            name = frames[position].name
            if folder.later[name]["status"] == OK and tracker is not None:
                state, same = tracker.state, _keeps_ids(tracker, folder.file(name, SUFFIXES["json"]))
                if not same:
                    later = Tracker(config.tracking, state)
                    yield from process_frames(frames[position:], config, executor, later, method, thorough, pictures)
                    return
            writer.keep(name)
            position += 1


def _keeps_ids(tracker: Tracker, file: Path) -> bool:
    """Return whether tracking leaves ids and directions of the chains in a frame's file as they are."""
    stored = read_detection(file)
    return _ids_and_joints(tracker.update(stored), stored)


def _ids_and_joints(one: Detection, other: Detection) -> bool:
    pairs = zip(one.chains, other.chains, strict=True)
    return all(first.id == second.id and np.array_equal(first.joints, second.joints) for first, second in pairs)
