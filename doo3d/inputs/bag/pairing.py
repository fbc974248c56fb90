"""How the colour of a bag belongs to its depth: in time, and in space; and where the cameras are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...types import Array, Floats
from . import realsense
from .index import Bag, Found
from .tf import Transforms
from .topics import Stream
from .undistortion import Lens

_SAME = 0.01  # px; cameras whose numbers differ by less are one and the same


def partners_of(path: Path, depth: Found, color: Found, tolerance: float) -> Array:
    """(depth images,) the colour image nearest in time to each, -1 for none within `tolerance` s."""
    stamped = depth.stamped and color.stamped
    given, times = depth.clock(stamped), color.clock(stamped)
    order = np.argsort(times, kind="stable")
    ranks = np.clip(np.searchsorted(times[order], given), 1, max(len(times) - 1, 1))
    before, after = order[ranks - 1], order[np.minimum(ranks, len(times) - 1)]
    near = np.where(np.abs(times[before] - given) <= np.abs(times[after] - given), before, after)
    apart = np.abs(times[near] - given)
    if not (apart <= tolerance * 1e9).any():
        raise InputError(
            f"{path}: no image of {color.topic.name} is within {tolerance} s of one of {depth.topic.name}, the nearest is "
            f"{apart.min() / 1e9:.3f} s off: give --input-option tolerance=..., or read the depth alone, with "
            "--input-option color_topic=none",
            code="times-apart",
        )
    return np.asarray(np.where(apart <= tolerance * 1e9, near, -1))


def relation(
    bag: Bag, index: Mapping[str, Found], depth: Stream, color: Stream, transforms: Transforms, time: int
) -> tuple[Lens, tuple[tuple[float, ...], ...] | None]:
    """The colour camera, and where the depth camera is in it; None where its pixels are those of the depth."""
    assert depth.lens is not None
    frames = (depth.found.frame, color.found.frame)
    registered = "aligned_depth_to_color" in depth.name or "depth_registered" in depth.name
    move: Floats | None
    if realsense.stream_of(depth.name) and realsense.stream_of(color.name):
        move = realsense.extrinsics(bag, index, depth.name, color.name)
    elif registered or (frames[0] == frames[1] and frames[0]):
        move = np.eye(4)
    else:
        move = transforms.between(*frames, time)
        if move is None or not all(frames):
            move = np.eye(4) if color.size == depth.size and (color.lens is None or _same(depth.lens, color.lens)) else None
    if move is None:
        raise InputError(
            f"{bag.path}: {color.name} ({color.size[0]}x{color.size[1]}, frame {frames[1]!r}) is not aligned to {depth.name} "
            f"({depth.size[0]}x{depth.size[1]}, frame {frames[0]!r}), and no transform between the two is in the bag: name a "
            "topic that is aligned, or read the depth alone, with --input-option color_topic=none",
            code="extrinsics-missing",
        )
    together = np.allclose(move, np.eye(4), atol=1e-7)
    if color.lens is None:
        if not together or color.size != depth.size:
            raise InputError(
                f"{bag.path}: there is no CameraInfo for {color.name}, so it cannot be aligned to {depth.name}: "
                "read the depth alone, with --input-option color_topic=none",
                code="intrinsics-missing",
            )
        return depth.lens, None
    if together and _same(depth.lens, color.lens):
        return color.lens, None
    return color.lens, tuple(tuple(row) for row in move.tolist())


def _same(a: Lens, b: Lens) -> bool:
    """Whether two cameras have the same pixels, their lenses aside."""
    numbers = [(c.fx, c.fy, c.cx, c.cy, c.width, c.height) for c in (a.camera, b.camera)]
    return bool(np.allclose(numbers[0], numbers[1], rtol=0, atol=_SAME))


def transforms_of(bag: Bag, index: Mapping[str, Found]) -> Transforms:
    """All of /tf and /tf_static; messages that are damaged are passed over."""
    result = Transforms()
    for found in index.values():
        if not found.topic.kind.lower().endswith("/tfmessage"):
            continue
        static = found.topic.name.endswith("tf_static")
        for at in range(len(found)):
            try:
                message = bag.message(found.topic, found.place(at))
            except InputError:
                continue
            for said in message.transforms:
                move, turn, stamp = said.transform.translation, said.transform.rotation, said.header.stamp
                values = (move.x, move.y, move.z, turn.x, turn.y, turn.z, turn.w)
                result.add(said.header.frame_id, said.child_frame_id, stamp.sec * 10**9 + stamp.nanosec, values, static)
    result.finish()
    return result
