"""Read the results that `doo3d detect` wrote."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..config import Config, load_config
from ..errors import InputError
from ..guard.file_names import check_file_name
from ..guard.guarding import first_line
from ..guard.parsing import read_json
from ..inputs import FrameRef, ReadOptions
from ..types import (
    COORDINATES,
    DEPTH_WORDS,
    SCHEMA,
    Chain,
    ChainEnd,
    Connection,
    Crossing,
    Detection,
    Floats,
    Junction,
    LinearObject,
    Plane,
    SegmentRef,
    View,
)
from . import CONFIG, MANIFEST, SUFFIXES
from .detection_json import read_object


@dataclass(frozen=True)
class Results:
    """The results of a run, to be read frame by frame.

    Attributes
    ----------
    path
        folder of the results.
    manifest
        content of `manifest.json` in that folder.
    frames
        names of the frames that succeeded, in the order of the capture.
    min_confidence
        confidence below which objects are left out when a frame is read; 0 leaves out none.
    """

    path: Path
    manifest: dict[str, Any]
    frames: tuple[str, ...]
    min_confidence: float = 0.0

    def detection(self, frame: str) -> Detection:
        """Return the Detection of one frame.

        Raises
        ------
        InputError
            the file of the frame is missing or damaged.
        """
        return read_detection(self.path / f"{frame}.json").confident(self.min_confidence)

    def detections(self) -> Iterator[Detection]:
        """Yield the Detection of each frame in `frames`, in order, reading one file at a time.

        Raises
        ------
        InputError
            the file of a frame is missing or damaged.
        """
        for name in self.frames:
            yield self.detection(name)

    def config(self) -> Config | None:
        """Return the settings of the run; None if their file is missing; raise ConfigError if it is damaged."""
        path = self.path / CONFIG
        return load_config(path) if path.is_file() else None

    def capture_frames(self, with_masks: bool = True) -> dict[str, FrameRef]:
        """Return name -> frame of the capture that the run was made from.

        with_masks : False leaves out masks that are not part of the capture.

        Raises
        ------
        DooError
            the capture cannot be read now, or is of another format.
        """
        from ..camera.open_rig import open_frames

        source = self.manifest.get("input", {})
        try:
            options = ReadOptions(**source.get("reading", {}))
            masks = source.get("masks") if with_masks or options.cameras else None
            capture = open_frames(source["path"], self.config() or Config(), masks, options)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{self.path / MANIFEST}: its input is damaged ({error})", code="results-damaged") from None
        if capture.format != source.get("format"):
            raise InputError(
                f"{source['path']}: is a capture of another format now; run doo3d detect again", code="input-changed"
            )
        return {frame.name: frame for frame in capture.frames}


def open_results(path: str | Path, min_confidence: float = 0.0) -> Results:
    """Open a folder of results that `doo3d detect` wrote.

    Only the manifest is read; `Results.detections` reads the frames.

    path : the folder. min_confidence : confidence, 0 to 1, below which objects are left out when a frame is read.

    Raises
    ------
    InputError
        the folder has no manifest written by doo3d, or a damaged one.
    """
    path = Path(path)
    try:
        manifest = read_json(path / MANIFEST)
        if not str(manifest["schema"]).startswith("doo3d/manifest/"):
            raise KeyError("schema")
        if not all(isinstance(manifest.get(key, {}), dict) for key in ("input", "versions")):
            raise TypeError("input and versions are objects")
        names = {id(frame): check_file_name(frame["name"], str(path / MANIFEST)) for frame in manifest["frames"]}
        frames = tuple(names[id(frame)] for frame in manifest["frames"] if frame["status"] == "ok")
    except InputError as error:
        if error.code in ("file-missing", "file-unreadable"):
            raise InputError(
                f"{path}: holds no results: no {MANIFEST} that can be read; run doo3d detect first", code="results-missing"
            ) from None
        if error.code == "frame-name-invalid":
            raise
        raise InputError(f"{error}: damaged or not of doo3d", code="results-damaged") from None
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise InputError(f"{path / MANIFEST}: is damaged or not of doo3d ({error!r})", code="results-damaged") from None
    return Results(path, manifest, frames, min_confidence)


def read_detection(path: str | Path) -> Detection:
    """Read the detection in the JSON file of one frame (schema doo3d/detection/2).

    An unknown radius, null in the file, becomes NaN; an unknown timestamp or id becomes None.

    Raises
    ------
    InputError
        the file is missing, is not JSON, has another schema, or is damaged.
    """
    values = read_object(path, (SCHEMA,), "a detection")
    labels = Path(path).with_suffix(SUFFIXES["instances"])
    try:
        detection = _detection(values, labels if labels.is_file() else None)
    except (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, InputError) as error:
        raise InputError(
            f"{path}: a value is missing or invalid ({first_line(error)}); run doo3d detect again", code="results-damaged"
        ) from None
    check_file_name(detection.frame, str(path))
    return detection


def _detection(values: dict[str, Any], labels: Path | None) -> Detection:
    names = {text: key for key, text in COORDINATES.items()}
    dim = {"3d": 3, "2d": 2}[values["mode"]]
    return Detection(
        tuple(_chain(chain, dim) for chain in values["chains"]),
        mode=values["mode"],
        coordinates=names[values["coordinates"]],
        frame=str(values["frame"]),
        timestamp=None if values.get("timestamp") is None else float(values["timestamp"]),
        seconds={stage: float(duration) for stage, duration in values.get("seconds", {}).items()},
        notes=tuple(map(str, values.get("notes", ()))),
        crossings=tuple(_crossing(crossing) for crossing in values.get("crossings", ())),
        plane=_plane(values.get("plane")),
        pose=None if values.get("pose") is None else _finite_array(values["pose"], (4, 4)),
        junctions=tuple(_junction(junction, dim) for junction in values.get("junctions", ())),
        objects=tuple(_object(item) for item in values.get("objects", ())),
        doubtful=tuple(_chain(chain, dim) for chain in values.get("doubtful", ())),
        view=View.from_dict(values["image"], labels, len(values["chains"])) if "image" in values else None,
    )


def _plane(values: dict[str, Any] | None) -> Plane | None:
    return None if values is None else Plane(_finite_array(values["normal"], (3,)), float(values["height"]))


def _finite_array(values: Any, shape: tuple[int, ...]) -> Floats:
    array = np.array(values, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{array.shape} numbers, expected {shape}, finite")
    return array


def _chain(values: dict[str, Any], dim: int) -> Chain:
    joints = np.array(values["joints"], dtype=float)
    if joints.ndim != 2 or joints.shape[1] != dim or not np.isfinite(joints).all():
        raise ValueError(f"joints {joints.shape}, expected (N + 1, {dim}), finite")
    return Chain(
        joints,
        float(values["segment_length"]),
        float("nan") if values["radius"] is None else float(values["radius"]),
        radii=np.array([float("nan") if each is None else each for each in values.get("radii", ())], dtype=float),
        occluded=np.array(values["occluded"], dtype=bool),
        depth_filled=np.array([DEPTH_WORDS.index(word) for word in values.get("depth", ())], dtype=bool),
        from_time=np.array(values.get("from_time", ()), dtype=bool),
        closed=bool(values["closed"]),
        connections=tuple(Connection(int(item["segment"]), float(item["confidence"])) for item in values.get("connections", ())),
        id=_integer(values.get("id")),
        confidence=float(values["confidence"]),
        deviations=_finite_array(values["deviations"], (len(joints), 2)) if values.get("deviations") is not None else None,
    )


def _integer(value: Any) -> int | None:
    if value is None or (isinstance(value, int) and not isinstance(value, bool)):
        return value
    raise ValueError(f"id {value!r}, expected a whole number")


def _crossing(values: dict[str, Any]) -> Crossing:
    upper, lower = (SegmentRef(int(values[side]["chain"]), int(values[side]["segment"])) for side in ("upper", "lower"))
    return Crossing(upper, lower, np.array(values["point"], dtype=float), float(values["confidence"]))


def _junction(values: dict[str, Any], dim: int) -> Junction:
    ends = tuple(ChainEnd(int(end["chain"]), int(end["end"])) for end in values["ends"])
    radii = np.array([float("nan") if each is None else each for each in values["radii"]], dtype=float)
    return Junction(_finite_array(values["position"], (dim,)), ends, radii, float(values["confidence"]))


def _object(values: dict[str, Any]) -> LinearObject:
    return LinearObject(tuple(map(int, values["chains"])), tuple(map(int, values["junctions"])), int(values["trunk"]))
