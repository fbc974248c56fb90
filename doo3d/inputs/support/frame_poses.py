"""Files with the pose of one frame each: `pose/0.txt` as ScanNet's exporter, `frame-000000.pose.txt` as 7-Scenes has them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...guard.guarding import read_bytes
from ...types import Floats
from .depth_frames import check_pose

_FOLDERS = ("pose", "poses")
_MAX_BYTES = 1 << 12  # a 4x4 matrix as text


def find_frame_poses(root: Path, names: Iterable[str]) -> dict[str, Path]:
    """Return the pose file of each frame, frame name -> path; frames without one are left out."""
    folder = next((root / name for name in _FOLDERS if (root / name).is_dir()), None)
    found = {}
    for name in names:
        places = [root / f"{name}.pose.txt", *([folder / f"{name}.txt"] if folder else [])]
        file = next((place for place in places if place.is_file()), None)
        if file is not None:
            found[name] = file
    return found


def read_frame_pose(file: Path) -> Floats | None:
    """Return the pose, (4, 4) camera to world, m; None if it is not finite, as those that tracking lost are.

    Raises
    ------
    InputError : the file cannot be read, or holds no pose.
    """
    words = read_bytes(file, _MAX_BYTES).decode("utf-8", "replace").split()
    try:
        values = np.array(words, dtype=float)
    except ValueError:
        raise InputError(f"{file}: expected a 4x4 matrix, camera to world", code="pose-invalid") from None
    return None if values.size == 16 and not np.isfinite(values).all() else check_pose(values, str(file))
