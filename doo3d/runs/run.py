"""Run the detection in every frame of a capture, and write results and manifest to a folder.

This process or workers process the frames, and a thread of this process writes them in order. A frame that fails does not stop
the run. An interrupted run resumes: call `run` again with the same arguments.
"""

from collections import Counter
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..config import Config
from ..errors import InputError
from ..guard.parsing import read_json
from ..inputs import IMAGE_FORMATS, Capture, ReadOptions
from ..inputs.support.fingerprint import FramePaths, file_states
from ..outputs import SUFFIXES
from ..outputs.folder_checks import check_names
from ..outputs.input_state import InputState
from ..outputs.run_folder import ResultsFolder
from ..track.tracking import Tracker
from ..types.display import Displayed, counted
from .capture_checks import capture_notes, run_notes, thorough_frames
from .chosen_tracker import chosen_tracker
from .executor import Executor
from .frame_record import FAILED, OK, FrameRecord
from .frame_writer import MAX_WAITING, FrameWriter
from .methods import Method, detect_all, detect_alone
from .missing_pictures import draw_missing
from .remaining_frames import remaining_frames
from .run_options import RunOptions
from .select_executor import select_executor
from .serial_executor import SerialExecutor

DEFAULTS = RunOptions()
"""Options of a run in this process that resumes an earlier one."""


@dataclass(frozen=True, repr=False)
class RunSummary(Displayed):
    """The outcome of a run.

    Attributes
    ----------
    records
        a record per frame of the capture, in the capture's order, including frames finished by an earlier run.
    remarks
        sentences about the capture, and about files that an earlier run left.
    """

    records: tuple[FrameRecord, ...] = field(default=())
    remarks: tuple[str, ...] = ()

    @property
    def failed(self) -> int:
        """Number of frames that failed."""
        return sum(record.status == FAILED for record in self.records)

    @property
    def succeeded(self) -> int:
        """Number of frames that did not fail, with or without chains."""
        return len(self.records) - self.failed

    @property
    def doubtful(self) -> int:
        """Number of doubtful chains in all frames together, which are not among the chains."""
        return sum(len(record.doubtful) for record in self.records)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences: the `remarks`, then the implausible data that only the frames together show.

        The notes of single frames are in the records.
        """
        return (*self.remarks, *capture_notes(self.records))

    def summary(self) -> str:
        """Return the outcome in one short line, such as "3 frames, 3 chains, 1 failed"."""
        counts = self.counts()
        failed = f", {counts[FAILED]} failed" if counts[FAILED] else ""
        doubtful = f", {self.doubtful} doubtful" if self.doubtful else ""
        return f"{counted(counts['frames'], 'frame')}, {counted(counts['chains'], 'chain')}{doubtful}{failed}"

    def counts(self) -> dict[str, int]:
        """Return a dict of four numbers: "frames", of these "ok" and "failed", and "chains" in all frames together."""
        chains = sum(len(record.lengths) for record in self.records)
        return {"frames": len(self.records), OK: self.succeeded, FAILED: self.failed, "chains": chains}

    def figures(self) -> dict[str, Any]:
        """Return statistics of the frames that succeeded.

        Returns
        -------
        A dict with these keys; a value is None if there is no chain or frame to compute it from:

        - "frames_by_chains" : dict, number of chains as text -> number of frames with that many chains.
        - "length", "radius" : median length and median radius over all chains of all frames, in "units".
        - "occluded" : mean over the frames with chains of the fraction of occluded segments, 0 to 1.
        - "units" : "m" or "px".
        """
        succeeded = [record for record in self.records if record.status == OK]
        frames = Counter(len(record.lengths) for record in succeeded)
        lengths, radii = ([value for record in succeeded for value in getattr(record, key)] for key in ("lengths", "radii"))
        occluded = [record.occluded for record in succeeded if record.occluded is not None]
        return {
            "frames_by_chains": {str(chains): frames[chains] for chains in sorted(frames)},
            "length": float(np.median(lengths)) if lengths else None,
            "radius": float(np.nanmedian(radii)) if np.isfinite(radii).any() else None,
            "occluded": float(np.mean(occluded)) if occluded else None,
            "units": succeeded[0].units if succeeded else None,
        }


def run(
    capture: Capture,
    out: str | Path,
    config: Config,
    options: RunOptions = DEFAULTS,
    *,
    method: Method = detect_alone,
    extra: dict[str, Any] | None = None,
) -> RunSummary:
    """Run the detection in every frame of a capture, and write the results to a folder.

    A frame that fails does not stop the run. Interrupted runs resume: call `run` again with the same arguments.

    Parameters
    ----------
    capture
        the capture, as returned by `open_capture`.
    out
        folder for `<frame>.json`, `<frame>.jpg`, `config.yaml`, `manifest.json` and `progress.jsonl`; made if missing.
        Frames that an earlier run with the same arguments finished there are not processed again.
    config
        configuration of the detection.
    options
        input options, workers, treatment of earlier results, and progress callbacks.
    method
        the function that finds the chains of a frame; chains are tracked only with `detect_alone`, other methods give the ids.
    extra
        entries of the manifest besides those of every run, such as "sequence"; a run with extra entries of other names differs.

    Returns
    -------
    RunSummary with the record of every frame. If every frame failed, `out` holds no results of this run.

    Raises
    ------
    InputError : `out` cannot be written to, is written to by another run, or holds other files or results of another capture or
        version; two frames have the same name; the capture has images without depth and the config is for 3-D; the scheduler
        cannot be reached; points or a box are given for several photographs, or choose nothing.
    MissingDependency : a scheduler is given and dask.distributed is not installed.
    """
    if (capture.no_depth or capture.format in IMAGE_FORMATS) and config.mode != "2d":
        reason = capture.no_depth or "images alone give no 3-D, which needs depth/ and camera_intrinsic.json"
        raise InputError(
            f"{capture.path}: {reason}",
            code="mode-needs-depth",
            remedy="use a 2-D config, the preset image or paper_2d (-c image)",
        )
    names = [frame.name for frame in capture.frames]
    with open_folder(capture, Path(out), config, options, extra) as folder:
        for sentence in folder.notes:
            options.note(sentence)
        former = folder.done | folder.later
        records = {name: FrameRecord.from_journal(former[name]) for name in names if name in former}
        if records:
            options.resumed(list(records.values()))
        frames = [frame for frame in capture.frames if frame.name not in folder.done]
        tracker = _resume_tracker(capture, config, folder) if method is detect_alone else None
        if (choice := options.choice) is not None:
            method = detect_all if choice.wanted and method is detect_alone else method
            tracker = chosen_tracker(choice, tracker, capture, config, folder, method)
        with _executor(options, len(frames)) as chosen:
            thorough, pictures = thorough_frames(names), options.pictures.of_frames(names)
            for record in draw_missing(capture.frames, pictures, records, chosen, folder, options.note):
                records[record.name] = record
            with FrameWriter(folder) as writer:

                def report(max_waiting: int) -> None:
                    for record in writer.written(max_waiting):
                        records[record.name] = replace(record, stages={})  # kept for every frame of the capture, hence small
                        options.report(record)

                try:
                    for frame in remaining_frames(frames, config, chosen, tracker, writer, method, thorough, pictures):
                        writer.add(*frame)
                        report(MAX_WAITING)
                finally:
                    report(0)
        summary = RunSummary(tuple(records[name] for name in names))
        if summary.succeeded:
            entries = [record.to_dict() for record in summary.records]
            content = {"counts": summary.counts(), "figures": summary.figures(), "notes": list(run_notes(summary.records))}
            folder.finish(content | {"frames": entries} | (extra or {}))
        else:
            folder.abandon()
    return summary


def open_folder(capture: Capture, out: Path, config: Config, options: RunOptions, extra: dict[str, Any] | None) -> ResultsFolder:
    """Open and lock the folder of a run, until it is closed; the parameters are those of `run`.

    Raises
    ------
    InputError : as for `run`.
    """
    check_names(out, [frame.name for frame in capture.frames])
    choice = {} if options.choice is None else {"choice": vars(options.choice)}
    source = _describe_input(capture, options.reading) | choice | ({} if extra is None else {"method": sorted(extra)[0]})
    return ResultsFolder(
        out,
        source,
        config,
        _input_state(capture, options.reading, out),
        restart=options.restart,
        force=options.force,
        retry_failed=options.retry_failed,
        needed=(SUFFIXES["instances"],) if options.pictures.instances else (),
    )


def _executor(options: RunOptions, frames: int) -> AbstractContextManager[Executor]:
    """Return a context manager of the given executor, or of a new one for the workers or the scheduler.

    frames : number of frames to process, for the number of workers "auto".
    """
    if options.executor is not None:
        return nullcontext(options.executor)
    if not frames:
        return closing(SerialExecutor())
    return select_executor(options.workers, options.scheduler, options.time_limit)


def _input_state(capture: Capture, options: ReadOptions | None, out: Path) -> InputState:
    """Return the state of all input files; `out` is the folder of the results, which may be inside the input's folder."""
    paths = [capture.path, *(frame.source for frame in capture.frames)]
    paths += [*([] if capture.masks is None else [capture.masks]), *capture.extra_files]
    if options is not None:
        paths += [file for file in (options.trajectory, options.camera_file, options.color) if file]
    return InputState(file_states(paths, out), FramePaths(capture.frames))


def _describe_input(capture: Capture, options: ReadOptions | None) -> dict[str, Any]:
    """Return the description of the input for the manifest, without the state of its files."""
    source: dict[str, Any] = {"path": str(capture.path.resolve()), "format": capture.format, "frames": len(capture.frames)}
    if capture.masks is not None:
        source["masks"] = str(capture.masks.resolve())
    if options is not None and (changed := options.model_dump(mode="json", exclude_defaults=True)):
        source["reading"] = changed
    if capture.base_pose is not None:
        source["pose"] = capture.base_pose
    if capture.selection is not None:
        source["selection"] = capture.selection
    return source


def _resume_tracker(capture: Capture, config: Config, folder: ResultsFolder) -> Tracker | None:
    """Return a tracker in its state after the frames already finished; None for photographs, which are not a sequence."""
    if capture.format == "photos":
        return None
    succeeded = [name for name, line in folder.done.items() if line["status"] == OK]
    files = (folder.file(name, SUFFIXES["json"]) for name in succeeded)
    return Tracker.resumed(map(read_json, files), config.tracking)
