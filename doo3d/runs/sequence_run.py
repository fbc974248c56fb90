"""Run the detection in all frames of a capture together, in two passes, each of which is a run."""

import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from ..config import Config
from ..errors import InputError
from ..inputs import Capture
from ..outputs import MANIFEST
from ..outputs.atomic import PREFIX, write_text, writing
from ..outputs.sequence_files import SequenceFile, read_observation, summary, write_objects
from ..track.detect_sequence import gap_frames
from ..track.first_pass import check_mode
from ..track.objects import find_objects
from ..track.sequence_notes import sequence_notes
from ..track.world_frame import in_world
from .frame_record import FrameRecord
from .methods import SecondPass, first_pass
from .pictures import NO_PICTURES
from .run import DEFAULTS, RunSummary, open_folder, run
from .run_options import Progress, RunOptions

FIRST_PASS = f"{PREFIX}first-pass"
"""Subfolder of the results that the first pass writes and the second reads; an interrupted run resumes from it."""

BEGUN = "second-pass"
"""File in this subfolder with the digest of the first pass's files when the second pass began."""

TO_RESUME = "; repeat the same command to resume"


def run_sequence(
    capture: Capture,
    out: str | Path,
    config: Config,
    passes: Callable[[str], AbstractContextManager[Progress]],
    options: RunOptions = DEFAULTS,
) -> RunSummary:
    """Run the detection in all frames of a capture together, and write the results to a folder.

    An interrupted run resumes in the pass in which it was interrupted. If frames were added or repaired, the objects are found
    again, and the second pass starts over.

    Parameters
    ----------
    capture, out, config
        as for `run`.
    passes
        called with the name of each pass, "first pass" and "second pass"; returns a context manager of its Progress.
    options
        as for `run`, for both passes; its progress callbacks have no effect.

    Raises
    ------
    InputError : as for `run`; or the config is for images.
    """
    check_mode(config)
    # before the first pass, which takes long: whether the second may write there; what has changed is its own question
    anew = replace(options, restart=True, retry_failed=False)
    open_folder(capture, Path(out), config, anew, {"sequence": None}).close()
    folder = Path(out) / FIRST_PASS
    with passes("first pass") as reporter:
        first = run(
            capture,
            folder,
            config,
            replace(options.with_progress(reporter), pictures=NO_PICTURES, choice=None),
            method=first_pass,
            extra={"sequence": "first pass"},
        )
    names = [frame.name for frame in capture.frames]
    if not first.succeeded:
        return first
    observations = [read_observation(folder, name) for name in names]
    objects = find_objects(in_world(observations), config)
    max_gap = gap_frames(observations, config)
    least = 0.0 if options.choice and options.choice.wanted else config.output.min_confidence
    known = SequenceFile(tuple(names), max_gap, least, tuple(objects))
    with writing(folder, TO_RESUME):
        write_objects(folder, known)
    notes = sequence_notes(observations, objects, config)
    del observations
    digest = _digest(folder)
    begun = folder / BEGUN
    is_other = begun.exists() and _read(begun) != digest.encode()
    with passes("second pass") as reporter:
        for note in notes:
            reporter.note(note)

        def report(record: FrameRecord) -> None:
            if is_other or not begun.exists():
                with writing(folder, TO_RESUME):
                    write_text(begun, digest)
            reporter(record)

        return run(
            capture,
            out,
            config,
            replace(options.with_progress(reporter), report=report, restart=options.restart or is_other),
            method=SecondPass(folder.resolve(), digest),
            extra={"sequence": {"objects": summary(objects, len(names))}},
        )


def _read(file: Path) -> bytes:
    """Read a file that the first pass wrote."""
    try:
        return file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error})", code="file-unreadable") from None


def _digest(folder: Path) -> str:
    """Return a digest of all files that the first pass wrote for the second."""
    result = hashlib.sha256()
    for file in sorted(folder.glob("*.json")):
        if file.name != MANIFEST:
            result.update(file.name.encode() + _read(file))
    return result.hexdigest()
