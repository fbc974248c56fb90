"""Write and read the files of a sequence's first pass: strands of each frame, and objects of the capture."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from ..errors import InputError
from ..track.background import BackgroundView
from ..track.objects import SequenceObject
from ..track.observations import Observation, ObservedStrand
from ..types import Detection, View
from . import STRANDS
from .atomic import write_text
from .detection_json import dumps, read_object
from .run_reader import read_detection

STRANDS_SCHEMA, OBJECTS_SCHEMA = "doo3d/strands/4", "doo3d/sequence/2"

_OBJECT = TypeAdapter(SequenceObject)

OBJECTS = "objects.json"
"""Name of the file of the objects, in the folder of the first pass."""


@dataclass(frozen=True)
class SequenceFile:
    """The knowledge about a whole capture, for the second pass.

    Attributes
    ----------
    frames
        names of all frames, in order.
    max_gap
        greatest number of frames without a strand of an object in which the object is filled in.
    min_confidence
        confidence below which chains are left out that the other frames do not confirm.
    objects
        the objects.
    """

    frames: tuple[str, ...]
    max_gap: int
    min_confidence: float
    objects: tuple[SequenceObject, ...]


def encode_strands(observation: Observation) -> bytes:
    """Encode the strands of a frame as JSON, UTF-8 bytes."""
    strands = [
        {name: value.tolist() or None if isinstance(value, np.ndarray) else value for name, value in vars(strand).items()}
        for strand in observation.strands
    ]
    pose = None if observation.pose is None else observation.pose.tolist()
    view = observation.background
    background = None if view is None else view.to_dict()
    values = {"schema": STRANDS_SCHEMA, "strands": strands, "pose": pose, "background": background}
    values |= {"is_given": observation.is_given, "object_given": observation.object_given}
    values["image"] = None if observation.detection.view is None else observation.detection.view.to_dict(with_mask=True)
    return dumps(values).encode("utf-8")


def read_observation(folder: Path, frame: str) -> Observation:
    """Read the observation of a frame from the first pass; empty for a failed frame.

    Raises
    ------
    InputError : a file is damaged.
    """
    file = folder / f"{frame}.json"
    if not file.exists():
        return Observation(Detection(chains=(), frame=frame), ())
    path = folder / f"{frame}{STRANDS}"
    values = read_object(path, (STRANDS_SCHEMA,), "the strands of a frame")
    try:
        strands = tuple(_strand(item) for item in values["strands"])
        pose = None if values.get("pose") is None else np.array(values["pose"], dtype=float).reshape(4, 4)
        background, given = _background(values), (values["is_given"] is True, values["object_given"] is True)
        view = None if values["image"] is None else View.from_dict(values["image"])
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(path, error) from None
    return Observation(replace(read_detection(file), view=view), strands, pose, background, *given)


def _background(values: dict[str, Any]) -> BackgroundView | None:
    return None if values.get("background") is None else BackgroundView.from_dict(values["background"])


def _strand(values: dict[str, Any]) -> ObservedStrand:
    points, arcs = np.array(values["points"], dtype=float), np.array(values["arcs"], dtype=float)
    if points.shape != (len(arcs), 3) or not len(arcs):
        raise ValueError(f"points {points.shape}, arcs {arcs.shape}")
    start, end = values["tips"]
    sight, joined = (np.array(values.get(name) or (), dtype=float) for name in ("sight", "joined"))
    sight, joined = sight.reshape(points.shape if len(sight) else (0, 3)), joined.reshape(arcs.shape if len(joined) else 0)
    return ObservedStrand(points, arcs, float(values["length"]), (float(start), float(end)), int(values["chain"]), sight, joined)


def write_objects(folder: Path, known: SequenceFile) -> None:
    """Write the objects file of a capture."""
    objects = [asdict(item) for item in known.objects]
    values = {"schema": OBJECTS_SCHEMA, "frames": known.frames, "max_gap": known.max_gap}
    values |= {"min_confidence": known.min_confidence, "objects": objects}
    write_text(folder / OBJECTS, dumps(values))


def read_objects(folder: Path) -> SequenceFile:
    """Read the objects file of a capture, the inverse of `write_objects`.

    Raises
    ------
    InputError : the file is missing or damaged.
    """
    path = folder / OBJECTS
    values = read_object(path, (OBJECTS_SCHEMA,), "the objects of a sequence")
    try:
        objects = tuple(_object(item) for item in values["objects"])
        frames, min_confidence = tuple(map(str, values["frames"])), float(values.get("min_confidence", 0.0))
        return SequenceFile(frames, int(values["max_gap"]), min_confidence, objects)
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(path, error) from None


def _object(values: dict[str, Any]) -> SequenceObject:
    radius = float("nan") if values["radius"] is None else values["radius"]
    return _OBJECT.validate_python(values | {"radius": radius})


def _damaged(path: Path, error: Exception) -> InputError:
    return InputError(
        f"{path}: a value is missing or invalid ({error!r})", code="results-damaged", remedy="start over with --restart"
    )


def summary(objects: Sequence[SequenceObject], frames: int) -> list[dict[str, Any]]:
    """Return the objects for the manifest: id, length, radius, number of segments, and frames that show them completely.

    Objects that belong to a tree also have "junctions", the numbers of the junctions at their ends, null for a tip.
    """
    keys = ("id", "length", "radius", "segments")
    return [
        {key: getattr(item, key) for key in keys}
        | {"whole_frames": len(item.anchors), "frames": frames}
        | ({"junctions": [node and node.junction for node in item.nodes]} if item.nodes != (None, None) else {})
        for item in objects
    ]
