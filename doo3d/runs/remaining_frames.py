"""Process the frames that an earlier run has not finished, and confirm finished frames after them."""

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
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
    """Yield the record and files of each unfinished frame, in order, and confirm the finished ones in the folder.

    A frame in `folder.later` is finished, but an earlier frame of the capture is not. If tracking gives its chains the same ids
    again, its files are kept. Otherwise this frame and all after it are processed again, so that the results equal those of an
    uninterrupted run.

    Parameters
    ----------
    frames
        the frames that are not in `folder.done`, in the capture's order.
    config
        configuration of the detection.
    executor
        executor of the jobs.
    tracker
        gives chains their ids, in its state after `folder.done`; None for frames that are not a sequence.
    writer
        the writer of the run; the caller passes it each yielded frame before asking for the next.
    method
        the function that finds the chains of a frame.
    thorough
        names of the frames to check thoroughly; see `detect_frame`.
    pictures
        name of a frame -> whether it gets a picture; see `process_frames`.
    """
    folder, position = writer.folder, 0
    while position < len(frames):
        group = list(takewhile(lambda frame: frame.name not in folder.later, frames[position:]))
        yield from process_frames(group, config, executor, tracker, method, thorough, pictures)
        position += len(group)
        while position < len(frames) and frames[position].name in folder.later:
            name = frames[position].name
            if folder.later[name]["status"] == OK and tracker is not None:
                later, same = copy(tracker), _keeps_ids(tracker, folder.file(name, SUFFIXES["json"]))
                if not same:
                    yield from process_frames(frames[position:], config, executor, later, method, thorough, pictures)
                    return
            writer.keep(name)
            position += 1


def _keeps_ids(tracker: Tracker, file: Path) -> bool:
    """Return whether tracking gives the chains in a frame's file the ids and directions that they have."""
    stored = read_detection(file)
    return _ids_and_joints(tracker.update(stored), stored)


def _ids_and_joints(one: Detection, other: Detection) -> bool:
    pairs = zip(one.chains, other.chains, strict=False)
    same = all(first.id == second.id and np.array_equal(first.joints, second.joints) for first, second in pairs)
    return same and len(one.chains) == len(other.chains)
