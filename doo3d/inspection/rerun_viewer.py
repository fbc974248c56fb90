"""A run in the Rerun viewer: every frame with its image, its cloud, its chains, and what each stage made of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..config import Config, load_config
from ..errors import DooError, InputError, require
from ..inputs import FrameRef, ReadOptions, open_capture
from ..outputs.run_folder import CONFIG
from ..outputs.run_reader import Results, read_detection
from ..pipeline import as_mode_data, run_with_stages
from ..types import Array, Camera, Cloud, Detection, Floats, Frame, Image
from ..viz import draw
from ..viz.overlay import caption_lines
from ..viz.palette import chain_color
from ..viz.png import encode_image
from ..viz.stage_products import Product
from .explain import explain
from .stage_products import merge_table, products

APPLICATION = "doo3d"
CLOUD = 200_000
"""Points of a frame's cloud at most, evenly."""


class Viewing:
    """A recording of a run.

    Parameters
    ----------
    results : of the run. save : the file for the recording; None opens the viewer.

    Raises
    ------
    MissingDependency : rerun-sdk is not installed.
    InputError : the file cannot be written.
    """

    def __init__(self, results: Results, save: Path | None) -> None:
        self.rr: Any = require("rerun", "view")
        self.results, self.said = results, ""
        self.config = _config(results)
        self.entries = self._opened()
        self.stream = self.rr.RecordingStream(APPLICATION)
        try:
            if save is None:
                self.stream.spawn()
            else:
                self.stream.save(str(save))
        except (OSError, RuntimeError) as error:
            code = "out-unwritable" if save else "viewer-unavailable"
            raise InputError(f"{save or 'the viewer'}: cannot be opened ({error})", code=code) from None
        self.stream.log("world", self.rr.ViewCoordinates.RDF, static=True)

    def show(self, name: str, stages: bool = True) -> None:
        """Log a frame that is fine, at its place on the time line; with what the stages made of it, or without.

        Raises
        ------
        InputError : its result cannot be read.
        """
        detection = read_detection(self.results.path / f"{name}.json")
        self.stream.set_time("frame", sequence=self.results.frames.index(name))
        if detection.timestamp is not None:
            self.stream.set_time("time", duration=detection.timestamp)
        for place in ("world/stages", "world/chains", "world/cloud", "image", "merges"):
            self.stream.log(place, self.rr.Clear(recursive=True))
        self._frame(name, detection, stages)
        self.stream.flush()

    def _opened(self) -> dict[str, FrameRef]:
        """The frames of the capture, where it is still there; else `said` has the reason."""
        source = self.results.manifest.get("input", {})
        try:
            flat = self.config is not None and self.config.mode == "2d"
            reading = ReadOptions(**source.get("reading", {}))
            capture = open_capture(source["path"], flat, source.get("masks"), reading)
            if capture.format != source.get("format"):
                raise InputError(f"{source['path']}: is a capture of another format now", code="input-changed")
            return {entry.name: entry for entry in capture.frames}
        except (DooError, KeyError, TypeError, ValueError) as error:
            self.said = f"the capture cannot be read any more, so only the chains are shown ({error})"
            return {}

    def _frame(self, name: str, detection: Detection, stages: bool) -> None:
        log, rr = self.stream.log, self.rr
        log("summary", rr.TextDocument("\n".join([name, *(caption_lines(detection) or ["nothing found"]), *detection.notes])))
        self._chains(detection)
        try:
            data, table = self._data(name, stages)
        except DooError as error:
            self.said = f"some frames cannot be read any more ({error})"
            return
        if data is None:
            return
        if isinstance(data, Frame):
            log("world/camera", _pinhole(rr, data.camera))
        if not isinstance(data, Cloud):
            log("image", rr.EncodedImage(contents=encode_image(draw(data, detection)), media_type="image/png"))
        if detection.mode == "3d":
            points, colors = _cloud(data)
            log("world/cloud", rr.Points3D(points, colors=colors, radii=rr.Radius.ui_points(1.0)))
        if table:
            log("merges", rr.TextDocument(table, media_type="text/markdown"))

    def _data(self, name: str, stages: bool) -> tuple[Frame | Cloud | Image | None, str]:
        """What was detected in, and the table of the merges; the stages' products are logged."""
        if name not in self.entries or self.config is None:
            return None, ""
        shot = self.entries[name].load()
        if not stages:
            return as_mode_data(shot.data, self.config), ""
        data, made = run_with_stages(shot.data, self.config, shot.mask_for(self.config))
        found = explain(made, self.config)
        for product in products(made, found):
            self._product(product)
        return data, merge_table(found)

    def _product(self, product: Product) -> None:
        rr, flat = self.rr, product.points.shape[1] == 2
        if product.mask is not None:
            self.stream.log(f"image/stages/{product.name}", rr.SegmentationImage(product.mask.astype(np.uint8)))
        place = f"{'image' if flat else 'world'}/stages/{product.name}"
        if len(product.edges):
            lines = (rr.LineStrips2D if flat else rr.LineStrips3D)(
                product.points[product.edges], colors=product.colors[product.edges[:, 0]], radii=rr.Radius.ui_points(2.0)
            )
            self.stream.log(f"{place}/lines", lines)
        if len(product.points):
            dots = (rr.Points2D if flat else rr.Points3D)(
                product.points, colors=product.colors, radii=rr.Radius.ui_points(2.0 if len(product.edges) else 1.5)
            )
            self.stream.log(f"{place}/points", dots)
        if product.labels:
            at = product.points[list(product.labels)]
            named = (rr.Points2D if flat else rr.Points3D)(
                at, labels=list(product.labels.values()), radii=rr.Radius.ui_points(4.0)
            )
            self.stream.log(f"{place}/labels", named)

    def _chains(self, detection: Detection) -> None:
        """The chains, tubes as thick as the object in 3-D; what is occluded is darker."""
        rr, flat = self.rr, detection.mode == "2d"
        for i, chain in enumerate(detection.chains):
            color = np.array(chain_color(i if chain.id is None else chain.id))
            colors = np.where(chain.occluded[:, None], color // 2, color).astype(np.uint8)
            radius = chain.radius if np.isfinite(chain.radius) else 0.0
            pairs = np.stack((chain.joints[:-1], chain.joints[1:]), axis=1)
            strips = (rr.LineStrips2D if flat else rr.LineStrips3D)(pairs, colors=colors, radii=radius)
            self.stream.log(f"{'image' if flat else 'world'}/chains/{i}", strips)


def _config(results: Results) -> Config | None:
    path = results.path / CONFIG
    return load_config(path) if path.is_file() else None


def _pinhole(rr: Any, camera: Camera) -> Any:
    matrix = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
    return rr.Pinhole(image_from_camera=matrix, resolution=[camera.width, camera.height], image_plane_distance=0.1)


def _cloud(data: Frame | Cloud | Image) -> tuple[Floats, Array | None]:
    """The points (N, 3) m and their colours (N, 3) uint8, CLOUD of them at most."""
    if isinstance(data, Cloud):
        step = max(1, len(data.points) // CLOUD)
        return data.points[::step], None if data.colors is None else data.colors[::step]
    if isinstance(data, Image):
        return np.zeros((0, 3)), None
    v, u = np.nonzero(data.depth)
    step = max(1, len(u) // CLOUD)
    v, u = v[::step], u[::step]
    points = data.camera.unproject(np.column_stack((u, v)), data.depth[v, u])
    return points, None if data.color is None else data.color[v, u]


def frames_of(results: Results, wanted: Sequence[str] | None) -> list[str]:
    """The names of the frames that are asked for, by name or by number; all without.

    Raises
    ------
    InputError : there is none of that name or number.
    """
    if not wanted:
        return list(results.frames)
    chosen = []
    for item in wanted:
        try:
            chosen.append(item if item in results.frames else results.frames[int(item)])
        except (ValueError, IndexError):
            raise InputError(
                f"--frame {item}: {results.path} has {len(results.frames)} frames that are fine", code="frame-unknown"
            ) from None
    return chosen
