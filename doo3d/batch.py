"""One run: every frame of a capture through the pipeline, results and manifest into a folder.

One frame that fails does not stop the others. A run of which nothing comes leaves nothing behind: the folder is made
when the first frame has succeeded.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from .config import Config
from .errors import DooError, InputError
from .inputs import FLAT, Capture, Entry, Shot
from .inputs.masks import MaskedCapture
from .outputs.results import ResultsFolder
from .pipeline import detect
from .types import Bools, Cloud, Detection, Frame, Image

OK, FAILED = "ok", "failed"


@dataclass(frozen=True)
class FrameRecord:
    """What became of one frame.

    lengths, radii : of the chains, longest first, m (px in 2-D). occluded : share of all segments, 0 to 1; None without
    chains. units : "m" or "px". seconds : for reading and detecting. error : the reason where status is failed, a sentence.
    """

    name: str
    source: str
    timestamp: float | None
    status: str
    seconds: float
    lengths: tuple[float, ...] = ()
    radii: tuple[float, ...] = ()
    occluded: float | None = None
    units: str = "m"
    notes: tuple[str, ...] = ()
    error: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """What the manifest holds of a frame."""
        return {
            "name": self.name,
            "status": self.status,
            "source": self.source,
            "timestamp": self.timestamp,
            "chains": len(self.lengths),
            "lengths": list(self.lengths),
            "radii": list(self.radii),
            "occluded": self.occluded,
            "units": self.units,
            "seconds": self.seconds,
            "error": self.error,
        }


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


def run(
    capture: Capture,
    out: str | Path,
    config: Config,
    *,
    force: bool = False,
    report: Callable[[FrameRecord], None] = lambda record: None,
) -> Summary:
    """Detect in every frame of the capture and write what was found.

    Parameters
    ----------
    capture : from `open_capture`.
    out : the folder for `<frame>.json`, `<frame>.png`, `config.yaml` and `manifest.json`; made when it is not there.
    config : what to detect with.
    force : write into `out` though it holds something else.
    report : called with each frame's record when it is done.

    Returns
    -------
    Summary. Where every frame failed, nothing has been written.

    Raises
    ------
    InputError : `out` holds something else, or cannot be written to; two frames have one name; images without depth are
        given and the config is for 3-D.
    """
    if capture.format in FLAT and config.mode != "2d":
        raise InputError(
            f"{capture.path}: images alone give no 3-D, which needs depth/ and camera_intrinsic.json: use a 2-D config, the "
            "preset image or paper_2d (-c image)"
        )
    names = [entry.name for entry in capture.frames]
    source = {"path": str(capture.path.resolve()), "format": capture.format, "frames": len(names)}
    if isinstance(capture, MaskedCapture):
        source["masks"] = str(capture.masks.resolve())
    folder = ResultsFolder(Path(out), source, config, names, force=force)
    records = []
    for entry in capture.frames:
        record = _one(entry, config, folder)
        records.append(record)
        report(record)
    summary = Summary(tuple(records))
    if summary.succeeded:
        folder.finish(summary.counts(), [record.to_dict() for record in records])
    return summary


def _one(entry: Entry, config: Config, folder: ResultsFolder) -> FrameRecord:
    record, found = process(entry, config)
    if found is not None:
        try:
            folder.write(entry.name, *found)
            return record
        except DooError:
            raise
        except Exception as error:
            record = replace(record, status=FAILED, lengths=(), radii=(), occluded=None, error=unexpected(error))
    folder.drop(entry.name)
    return record


def process(entry: Entry, config: Config) -> tuple[FrameRecord, tuple[Detection, Frame | Cloud | Image] | None]:
    """Read one frame and detect in it: its record, and what was found and from what, or None where that failed.

    What goes wrong, expected or not, is in the record: it is this frame's matter only.
    """
    start = time.perf_counter()
    record = FrameRecord(entry.name, str(entry.source), entry.timestamp, FAILED, 0.0)
    try:
        shot = entry.load()
        detection = replace(detect(shot.data, config, chosen_mask(shot, config)), frame=entry.name, timestamp=entry.timestamp)
    except DooError as error:
        return replace(record, error=str(error), seconds=time.perf_counter() - start), None
    except Exception as error:
        return replace(record, error=unexpected(error), seconds=time.perf_counter() - start), None
    segments = sum(len(chain.occluded) for chain in detection.chains)
    done = replace(
        record,
        status=OK,
        seconds=time.perf_counter() - start,
        lengths=tuple(chain.length for chain in detection.chains),
        radii=tuple(chain.radius for chain in detection.chains),
        occluded=sum(int(chain.occluded.sum()) for chain in detection.chains) / segments if segments else None,
        units="m" if detection.mode == "3d" else "px",
        notes=detection.notes,
    )
    return done, (detection, shot.data)


def chosen_mask(shot: Shot, config: Config) -> Bools | None:
    """The capture's own mask, unless the config names another way to tell the object."""
    return shot.mask if config.segment.method in ("auto", "mask") else None


def unexpected(error: Exception) -> str:
    """Type, message and place of an error that nobody foresaw."""
    calls = traceback.extract_tb(error.__traceback__)
    own = [call for call in calls if "doo3d" in Path(call.filename).parts] or calls
    at = f"{Path(own[-1].filename).name}:{own[-1].lineno}" if own else "?"
    return f"{type(error).__name__} at {at}: {error} (this is a fault in doo3d, please report it)"
