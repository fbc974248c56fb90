"""Detect chains in every frame of a capture: the function `doo3d.run`, as the command `doo3d detect`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from os import PathLike
from typing import Any

from numpy.typing import ArrayLike

from ..camera.open_rig import open_frames
from ..config import Config, ConfigLike, as_config
from ..errors import ArgumentError, ConfigError, options_of_python
from ..fusion.fused_capture import fused_capture
from ..inputs import Capture, ReadOptions
from ..inputs.frame_selection import Selection, select_frames
from ..inputs.support.pose_file import PoseLike
from ..types.arguments import each, file_path, flag, number, refused, text, whole
from .choice import Choice
from .frame_record import FrameRecord
from .option_checks import check_use
from .pictures import Pictures
from .run import RunSummary
from .run import run as run_capture
from .run_options import RunOptions
from .sequence_run import run_sequence
from .time_limit import DEFAULT_SECONDS
from .worker_count import AUTO, worker_count

MAX_WORKERS = 1024
"""Greatest number of worker processes, above the number of processors of any machine."""


def run(
    capture: Capture | str | PathLike[str],
    out: str | PathLike[str] = "out",
    config: ConfigLike | None = None,
    *,
    mask: str | PathLike[str] | None = None,
    input_options: ReadOptions | Mapping[str, Any] | None = None,
    pose: PoseLike | None = None,
    camera: str | PathLike[str] | None = None,
    cameras: str | PathLike[str] | None = None,
    every: int = 1,
    start: int | str | None = None,
    end: int | str | None = None,
    frames: str | Sequence[int] | None = None,
    workers: int | str = 0,
    scheduler: str | None = None,
    fuse_views: bool = False,
    sequence: bool = False,
    restart: bool = False,
    retry_failed: bool = False,
    time_limit: float | None = DEFAULT_SECONDS,
    pictures: str = "all",
    picture_format: str = "jpg",
    instances: bool = False,
    points: str | ArrayLike | None = None,
    box: str | ArrayLike | None = None,
    force: bool = False,
    progress: Callable[[FrameRecord], None] | None = None,
) -> RunSummary:
    """Run the detection in every frame of a capture, and write the results to a folder, like `doo3d detect`.

    A frame that fails does not stop the run. Interrupted runs resume: call `run` again with the same arguments, or repeat the
    command. Nothing is printed.

    Parameters
    ----------
    capture
        path of a capture, or a capture as `open_capture` returns it, or a slice of one.
    out
        folder for `<frame>.json`, `<frame>.jpg`, `config.yaml` and `manifest.json`; made if missing.
    config
        the settings, as `detect` takes them.
    mask
        masks of the object, replacing the capture's own: an image, or a folder of images named like the frames.
    input_options
        options for reading the capture: a ReadOptions, or its fields as a dictionary, such as {"depth_scale": 5000}.
    pose
        pose of the camera in the robot's base frame; the results are then in the base frame. A 4x4 matrix, the numbers x y z qx
        qy qz qw, a file, "capture" (the capture's own poses), or "tf:FRAME" of a bag.
    camera
        file with the intrinsics of the depth images.
    cameras
        file of a rig of several cameras, or calibration of a stereo pair, as `open_rig` takes it.
    every, start, end, frames
        the frames to use, as `doo3d detect --help` says: every Nth; first and last as a number from 0, -1 the last, or as a time
        such as "12.5s"; a list such as "3,7,10-20" or [3, 7].
    workers
        number of worker processes; 0 works in this process alone, "auto" takes as many as processors, memory and the number of
        frames allow. Workers do not import the calling script.
    scheduler
        address of a dask scheduler, whose workers to use instead.
    fuse_views
        fuse all frames to one cloud and detect in that; needs an object at rest and known camera poses.
    sequence
        find the same objects in all frames together.
    restart
        process all frames again, also those already finished in `out`.
    retry_failed
        process frames again that failed in an earlier run.
    time_limit
        time in s after which a frame fails; None for no limit.
    pictures
        frames that get a picture: "all"; "failed", those without a chain, with a chain whose confidence is below 0.5, or with a
        note; "none"; or "every:10", the first and every tenth after it. If an earlier run finished a
        frame without its picture, the picture is drawn from the results.
    picture_format
        "jpg" or "png", which takes ten times as long to write.
    instances
        write `<frame>.instances.png`, too, an image of 16 bits: k + 1 at the pixels of chain k, 0 elsewhere. Finished frames of
        an earlier run without it are processed again.
    points, box
        pixels of the first frame that choose the objects, as `detect` takes them; the objects are then followed by their ids. Of
        several photographs, which are no sequence, none can be chosen.
    force
        write into `out` even if it holds something else.
    progress
        called with the record of each frame once its files are written; has `name`, `status` and `lengths`, for example.

    Returns
    -------
    RunSummary : `records` (one per frame), `failed`, `counts()`, `figures()` and `notes`. If all frames failed, `out` holds no
        results of this run.

    Raises
    ------
    InputError : the capture cannot be opened; or `out` cannot be written to, or holds other files or other results.
    ConfigError : the settings cannot be used, or arguments exclude each other.
    MissingDependency : a format or the scheduler needs a package that is not installed.

    Examples
    --------
    >>> summary = doo3d.run("sample_clouds/crossing", "out", {"merge.chains": 1}, workers=2)  # doctest: +SKIP
    """
    with options_of_python():
        settings = as_config(config)
        folder = file_path(out, "out")
        switches = {
            "fuse_views": fuse_views,
            "sequence": sequence,
            "restart": restart,
            "retry_failed": retry_failed,
            "force": force,
            "instances": instances,
        }
        fuse_views, sequence, restart, retry_failed, force, instances = (flag(value, name) for name, value in switches.items())
        if time_limit is not None and not number(time_limit, "time_limit") > 0:
            raise ConfigError(f"time_limit={time_limit}: expected seconds above 0, or None", code="value-out-of-bounds")
        workers = workers if isinstance(workers, str) else whole(workers, "workers")
        if (not isinstance(workers, str) and workers < 0) or worker_count(workers, 0) > MAX_WORKERS:
            raise ConfigError(f"workers={str(workers)[:20]}: expected 0 to {MAX_WORKERS}", code="value-out-of-bounds")
        if not isinstance(scheduler, str | None):
            raise refused(scheduler, "scheduler", "an address, such as tcp://host:8786")
        drawn = Pictures.of(text(pictures, "pictures"), text(picture_format, "picture_format"), instances)
        if not (progress is None or callable(progress)):
            raise refused(progress, "progress", "a function of a frame's record")
        choice = Choice.of(points, box)
        opened = _opened(capture, settings, mask, _read_options(input_options, pose, camera, cameras))
        check_use(opened.options, settings, fuse_views, sequence, instances, choice is not None)
        chosen = select_frames(opened, _selection(every, start, end, frames))
        remarks = _Remarks(list(chosen.notes), progress)
        if fuse_views:
            chosen = fused_capture(chosen, settings)
        options = RunOptions(
            reading=opened.options,
            workers=0 if scheduler and workers == AUTO else worker_count(workers, len(chosen)),
            scheduler=scheduler,
            restart=restart,
            force=force,
            retry_failed=retry_failed,
            time_limit=time_limit,
            pictures=drawn,
            choice=choice,
        )
        if sequence:
            summary = run_sequence(chosen, folder, settings, remarks.of_pass, options)
        else:
            summary = run_capture(chosen, folder, settings, options.with_progress(remarks))
        return replace(summary, remarks=tuple(remarks.notes))


def _selection(every: int, start: int | str | None, end: int | str | None, frames: str | Sequence[int] | None) -> Selection:
    """Return the selection of frames in the form of the command."""
    first, last = (
        position if position is None or isinstance(position, str) else str(whole(position, name))
        for name, position in (("start", start), ("end", end))
    )
    listed = frames if frames is None or isinstance(frames, str) else ",".join(map(str, each(frames, int, "frames")))
    return Selection(whole(every, "every"), first, last, listed)


class _Remarks:
    """Collects the notes of a run, and calls the caller's progress function for each frame."""

    def __init__(self, notes: Sequence[str], progress: Callable[[FrameRecord], None] | None) -> None:
        self.notes, self._progress = list(notes), progress

    def __call__(self, record: FrameRecord) -> None:
        if self._progress is not None:
            self._progress(record)

    def note(self, sentence: str) -> None:
        self.notes.append(sentence)

    def resumed(self, records: Sequence[FrameRecord]) -> None:
        """Ignore the frames of an earlier run, which are in the summary."""

    @contextmanager
    def of_pass(self, name: str) -> Iterator[_Remarks]:
        """Yield the observer of a pass of a sequence; only the second pass, whose frames are results, calls `progress`."""
        silent = _Remarks((), None)
        silent.notes = self.notes
        yield self if name == "second pass" else silent


def _read_options(
    given: ReadOptions | Mapping[str, Any] | None,
    pose: PoseLike | None,
    camera: str | PathLike[str] | None,
    cameras: str | PathLike[str] | None,
) -> ReadOptions | None:
    """Return the options for reading a capture; None if none are given."""
    if given is not None and not isinstance(given, ReadOptions | Mapping):
        raise ArgumentError(
            f"input_options is a {type(given).__name__}, expected a ReadOptions, or its fields as a dictionary",
            code="argument-type",
        )
    values = given.model_dump(exclude_unset=True) if isinstance(given, ReadOptions) else dict(given or {})
    values |= {} if pose is None else {"pose": pose}
    values |= {} if camera is None else {"camera_file": file_path(camera, "camera").absolute()}
    values |= {} if cameras is None else {"cameras": file_path(cameras, "cameras").absolute()}
    return ReadOptions.of(values, "input_options") if values else None


def _opened(
    capture: Capture | str | PathLike[str], config: Config, mask: str | PathLike[str] | None, options: ReadOptions | None
) -> Capture:
    if isinstance(capture, str | PathLike):
        masks = None if mask is None else file_path(mask, "mask")
        return open_frames(file_path(capture, "capture"), config, masks, options or ReadOptions())
    if not all(hasattr(capture, name) for name in ("path", "format", "frames")):
        raise ArgumentError(
            f"run was given a {type(capture).__name__}, expected the path of a capture, or a capture as doo3d.open_capture "
            "returns it",
            code="argument-type",
        )
    if mask is not None or options is not None:
        raise ConfigError(
            "mask, input_options, pose, camera and cameras are for a path: give them to doo3d.open_capture or doo3d.open_rig",
            code="options-conflict",
        )
    return Capture.of(capture)
