"""A data set of LeRobot with depth as video, written by PyAV."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import numpy as np

DEPTH, COLOR = "observation.images.top_depth", "observation.images.top"
CODING = {"depth_min": 0.01, "depth_max": 10.0, "shift": 0.1, "use_log": True}
FPS = 30


def encode(file: Path, images, pixels: str, kind: str) -> None:
    """Write images as lossless HEVC, with frames that refer to later ones."""
    import av

    file.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(file), "w") as container:
        # of two frames the muxer refuses the order that x265 gives them
        order = ":bframes=0" if len(images) < 3 else ""
        stream = container.add_stream("libx265", rate=FPS, options={"x265-params": f"lossless=1:keyint=4:log-level=none{order}"})
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt, stream.time_base = kind, Fraction(1, FPS)
        for number, image in enumerate(images):
            frame = av.VideoFrame(image.shape[1], image.shape[0], pixels)
            plane = frame.planes[0]
            rows = np.zeros((plane.height, plane.line_size), np.uint8)
            data = image.view(np.uint8).reshape(len(image), -1)
            rows[:, : data.shape[1]] = data
            plane.update(rows.tobytes())
            frame.pts, frame.time_base = number, stream.time_base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def write(folder: Path, depth, color=None, prefix="video.", **changes):
    """Write a data set of version 3: two episodes, the depth in two files, the color in one."""
    coding = {prefix + key: value for key, value in (CODING | changes).items() if value is not None}
    features = {DEPTH: {"dtype": "video", "info": {prefix + "is_depth_map": True} | coding}}
    half = len(depth) // 2
    for number, images in enumerate((depth[:half], depth[half:])):
        encode(folder / "videos" / DEPTH / "chunk-000" / f"file-{number:03d}.mp4", images, "gray12le", "gray12le")
    if color is not None:
        features[COLOR] = {"dtype": "video", "info": {"video.is_depth_map": False}}
        encode(folder / "videos" / COLOR / "chunk-000" / "file-000.mp4", color, "rgb24", "gbrp")
    (folder / "meta").mkdir()
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "fps": FPS, "features": features}))
    return folder


def ramps(count=6):
    """Return images of codes, each another, with pixels of code 0."""
    rows = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64)
    return [np.where(rows % 7 == 0, 0, 1000 + (rows + 50 * i) % 1500).astype(np.uint16) for i in range(count)]
