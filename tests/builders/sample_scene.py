"""A rendered frame of a cable that crosses itself, at 640x480, for tests that write it in other formats."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

import doo3d
from builders.paths import SAMPLES
from doo3d.inputs import FrameData, open_capture

SAMPLE = SAMPLES / "crossing"
LENGTH = 1.08  # m, of the cable
QUATERNION, POSITION = (0.5, -0.5, 0.5, 0.5), (0.1, -2.0, 3.0)
POSE = np.array([[0, -1, 0, 0.1], [0, 0, -1, -2.0], [1, 0, 0, 3.0], [0, 0, 0, 1.0]])  # the same as a matrix
LINE = "0.1 -2.0 3.0 0.5 -0.5 0.5 0.5"  # and as TUM writes it


class Scene(NamedTuple):
    """color : (480, 640, 3) uint8 RGB. depth : (480, 640) m, 0 = none. pinhole : fx, fy, cx, cy. mask : the cable."""

    color: np.ndarray
    depth: np.ndarray
    pinhole: tuple[float, float, float, float]
    mask: np.ndarray


@lru_cache(maxsize=1)
def scene() -> Scene:
    """Return every second pixel of the sample's first frame, with empty rows above and below."""
    frame = open_capture(SAMPLE).frames[0].load().data
    rows = ((60, 60), (0, 0))
    color = np.pad(frame.color[::2, ::2], (*rows, (0, 0)), mode="edge")
    depth = np.pad(frame.depth[::2, ::2], rows)
    camera = frame.camera
    pinhole = (camera.fx / 2, camera.fy / 2, camera.cx / 2, camera.cy / 2 + 60)
    from doo3d.segment import segment

    config = doo3d.load_config("default")
    whole = doo3d.Frame(color, depth.astype(np.float32), doo3d.Camera(*pinhole, width=640, height=480))
    return Scene(color, depth, pinhole, np.asarray(segment(whole, config.segment, None, config.seed).scene.mask))


def put(path: Path, image: np.ndarray) -> Path:
    """Write an image, color given as RGB."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image = image.astype(np.uint8) * 255 if image.dtype == bool else image
    image = image[..., ::-1] if image.ndim == 3 else image
    path.write_bytes(cv2.imencode(path.suffix, image)[1].tobytes())
    return path


def units(scale: float) -> np.ndarray:
    """Return the scene's depth as a 16-bit image of `scale` units per metre."""
    return np.rint(scene().depth * scale).astype(np.uint16)


def check(loaded: FrameData, step: float, pinhole: tuple[float, ...] | None = None, color: float = 0) -> None:
    """Assert that a frame is the scene: depth within half a step (m), color within a mean difference, these intrinsics."""
    assert isinstance(loaded.data, doo3d.Frame)
    assert np.abs(loaded.data.depth - scene().depth).max() <= step / 2 + 1e-6
    assert np.abs(loaded.data.color.astype(int) - scene().color).mean() <= color
    camera = loaded.data.camera
    assert np.allclose((camera.fx, camera.fy, camera.cx, camera.cy), pinhole or scene().pinhole)
    assert (camera.width, camera.height) == (640, 480)


def assert_detected(loaded: FrameData, tolerance: float = 0.03) -> None:
    """Assert that the cable is detected as one chain, its length within the tolerance (m)."""
    chains = doo3d.detect(loaded.data, doo3d.load_config("default"), mask=loaded.mask).chains
    assert len(chains) == 1
    assert abs(chains[0].length - LENGTH) < tolerance
