"""One run: every frame of a capture through the pipeline, results and manifest into a folder.

Frames are worked on by this process or by many, and written by this one, in order. One frame that fails does not stop the
others. A run that was ended, at any moment, goes on where it was when it is started again.
"""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..config import Config
from ..errors import InputError
from ..inputs import IMAGE_FORMATS, Capture, FrameRef, ReadOptions
from ..inputs.support.fingerprint import fingerprint
from ..outputs import SUFFIXES
from ..outputs.run_folder import ResultsFolder
from ..sequence.tracking import Tracker
from .executor import Executor, Future, WorkerLost
from .frame import FAILED, OK, Found, FrameRecord, detect_frame, render_frame
from .local_executor import SerialExecutor, executor


@dataclass(frozen=True)
class Summary:
    """What became of a run: a record per frame, in order."""

    records: tuple[FrameRecord, ...] = field(default=())

    @property
    def failed(self) -> int:
        """How many frames failed."""
        return sum(record.status == FAILED for record in self.records)

    @property
    def succeeded(self) -> int:
        """How many did not."""
        return len(self.records) - self.failed

    def counts(self) -> dict[str, int]:
        """Frames, those that are fine, those that failed, and chains in all."""
        chains = sum(len(record.lengths) for record in self.records)
        return {"frames": len(self.records), OK: self.succeeded, FAILED: self.failed, "chains": chains}

    def figures(self) -> dict[str, Any]:
        """Over the frames that are fine: how many have so many chains; medians of length and radius; mean share occluded."""
        fine = [record for record in self.records if record.status == OK]
        frames = Counter(len(record.lengths) for record in fine)
        lengths, radii = ([value for record in fine for value in getattr(record, key)] for key in ("lengths", "radii"))
        occluded = [record.occluded for record in fine if record.occluded is not None]
        return {
            "frames_by_chains": {str(chains): frames[chains] for chains in sorted(frames)},
            "length": float(np.median(lengths)) if lengths else None,
            "radius": float(np.nanmedian(radii)) if np.isfinite(radii).any() else None,
            "occluded": float(np.mean(occluded)) if occluded else None,
            "units": fine[0].units if fine else None,
        }


def run(
    capture: Capture,
    out: str | Path,
    config: Config,
    *,
    reading: ReadOptions | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    restart: bool = False,
    force: bool = False,
    report: Callable[[FrameRecord], None] = lambda record: None,
    resumed: Callable[[Sequence[FrameRecord]], None] = lambda records: None,
) -> Summary:
    """Detect in every frame of the capture and write what was found.

    Parameters
    ----------
    capture : from `open_capture`.
    out : the folder for `<frame>.json`, `<frame>.png`, `config.yaml`, `manifest.json` and `progress.jsonl`; made when it is
        not there. Frames that an earlier run of the same has finished there are not done again.
    config : what to detect with.
    reading : how the capture was opened, where that was said.
    workers : processes of this machine to work with; 0 for this process alone. They import the calling script: keep what it
        does under `if __name__ == "__main__":`.
    scheduler : the address of a running dask.distributed scheduler whose workers are to be used. They have to see the
        capture at the same path.
    restart : do all frames anew, whatever an earlier run of this input has left.
    force : write into `out` though it holds something else.
    report : called with each frame's record when it is written. resumed : called once, before, with those of the frames that
        were finished already, where there are any.

    Returns
    -------
    Summary. Where every frame failed, nothing has been written.

    Raises
    ------
    InputError : `out` holds something else, or results of the capture as it was before it changed, or cannot be written to;
        two frames have one name; images without depth are given and the config is for 3-D; the scheduler cannot be reached.
    MissingDependency : workers are wanted and dask.distributed is not installed.
    """
    if capture.format in IMAGE_FORMATS and config.mode != "2d":
        raise InputError(
            f"{capture.path}: images alone give no 3-D, which needs depth/ and camera_intrinsic.json: use a 2-D config, the "
            "preset image or paper_2d (-c image)",
            code="mode-needs-depth",
        )
    names = [entry.name for entry in capture.frames]
    folder = ResultsFolder(Path(out), _source(capture, reading), config, names, restart=restart, force=force)
    records = {name: FrameRecord.from_journal(line) for name, line in folder.done.items()}
    if records:
        resumed(list(records.values()))
    left = [entry for entry in capture.frames if entry.name not in records]
    tracker = _tracker(capture, config, folder)
    with executor(workers, scheduler) if left else nullcontext(SerialExecutor()) as team:
        for record, files in _frames(left, config, team, tracker):
            folder.add(record.name, record.to_journal(), files)
            records[record.name] = replace(record, stages={})  # what is held of all frames is to be small
            report(record)
    summary = Summary(tuple(records[name] for name in names))
    if summary.succeeded:
        frames = [record.to_dict() for record in summary.records]
        folder.finish({"counts": summary.counts(), "figures": summary.figures(), "frames": frames})
    else:
        folder.abandon()
    return summary


def _source(capture: Capture, reading: ReadOptions | None) -> dict[str, Any]:
    """What tells this run's input from another's, for the manifest."""
    source: dict[str, Any] = {"path": str(capture.path.resolve()), "format": capture.format, "frames": len(capture.frames)}
    places = [capture.path, *(entry.source for entry in capture.frames)]
    if (masks := getattr(capture, "masks", None)) is not None:
        source["masks"] = str(masks.resolve())
        places.append(masks)
    if reading is not None and (said := reading.model_dump(mode="json", exclude_defaults=True)):
        source["reading"] = said
        places += [reading.trajectory] if reading.trajectory else []
    if (selection := getattr(capture, "selection", None)) is not None:
        source["selection"] = selection
    return source | {"files": fingerprint(places)}


def _tracker(capture: Capture, config: Config, folder: ResultsFolder) -> Tracker | None:
    """What follows the chains from frame to frame, going on after the frames that are finished; None for photographs."""
    if capture.format == "photos":
        return None
    done = [name for name, line in folder.done.items() if line["status"] == OK]
    files = (folder.file(name, SUFFIXES["json"]) for name in done)
    return Tracker.resumed((json.loads(file.read_text(encoding="utf-8")) for file in files), config.tracking)


def _frames(
    entries: Sequence[FrameRef], config: Config, team: Executor, tracker: Tracker | None
) -> Iterator[tuple[FrameRecord, dict[str, bytes] | None]]:
    """The record and the files of each frame, in order; no more frames are under way than the team's window."""
    upcoming = iter(entries)
    finding: deque[tuple[FrameRef, Future]] = deque()
    drawing: deque[tuple[FrameRef, Found, Future | None]] = deque()
    while True:
        while len(finding) + len(drawing) < team.window and (entry := next(upcoming, None)) is not None:
            finding.append((entry, team.submit(detect_frame, entry, config)))
        if finding and len(drawing) < team.workers:
            entry, job = finding.popleft()
            found = _found(entry, job)
            if found.detection is not None and tracker is not None:
                found = replace(found, detection=tracker.update(found.detection))
            drawing.append(
                (entry, found, team.submit(render_frame, entry, found, near=job) if found.detection is not None else None)
            )
        elif drawing:
            yield _drawn(*drawing.popleft())
        else:
            return


def _found(entry: FrameRef, job: Future) -> Found:
    try:
        found: Found = job.result()
        return found
    except WorkerLost as error:
        return Found(FrameRecord.of(entry, str(error), error.code))


def _drawn(entry: FrameRef, found: Found, job: Future | None) -> tuple[FrameRecord, dict[str, bytes] | None]:
    if job is None:
        return found.record, None
    try:
        record, files = job.result()
        return record, files
    except WorkerLost as error:
        return FrameRecord.of(entry, str(error), error.code), None
