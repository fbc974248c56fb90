"""Write a run as a recording for the Rerun viewer: image, cloud, chains and stage products of every frame."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DooError, InputError, require
from ..inputs import FrameRef
from ..outputs.run_reader import Results
from ..pipeline import run_stages
from ..types import Array, Camera, Cloud, Detection, Floats, Frame, Image
from ..types.conversions import as_mode_data
from ..types.display import objects_text
from ..viz import draw
from ..viz.encoding import encode_image
from ..viz.overlay import caption_lines
from ..viz.palette import all_chains
from ..viz.stage_products import Product
from .explain import explain_stages
from .local_viewer import LocalViewer, start_viewer
from .stage_products import merge_table, products

APPLICATION = "doo3d"
MAX_POINTS = 200_000
"""Greatest number of logged points of a frame's cloud; larger clouds are sampled evenly."""


class RerunRecording:
    """The content of a run for the Rerun viewer, sent to the viewer or written to a file frame by frame with `log_frame`.

    Parameters
    ----------
    results
        the results of the run, as `open_results` returns them.
    save
        path of the recording to write (.rrd); None opens the viewer.

    Attributes
    ----------
    warning
        why images, clouds or stage products are missing from the recording; empty if none are.
    viewer
        the viewer that was opened; None for a file.

    Raises
    ------
    MissingDependency : rerun-sdk is not installed.
    InputError : the file cannot be written, or the viewer cannot be opened.
    """

    def __init__(self, results: Results, save: Path | None) -> None:
        self.rr: Any = require("rerun", "view")
        self.results, self.warning = results, ""
        self.config = results.config()
        self.frame_refs = self._open_capture()
        self.recording = self.rr.RecordingStream(APPLICATION)
        self.viewer: LocalViewer | None = None
        try:
            if save is None:
                self.viewer = start_viewer()
                self.recording.connect_grpc(self.viewer.server)
            else:
                self.recording.save(str(save))
        except (OSError, RuntimeError) as error:
            code = "out-unwritable" if save else "viewer-unavailable"
            raise InputError(f"{save or 'the viewer'}: cannot be opened ({error})", code=code) from None
        self.recording.log("world", self.rr.ViewCoordinates.RDF, static=True)

    def log_frame(self, name: str, stages: bool = True) -> None:
        """Add one frame to the recording: image, cloud, chains and merge costs.

        The frame is added at its number in the run and, if it has one, at its timestamp.

        Parameters
        ----------
        name
            name of the frame, one of `results.frames`.
        stages
            True runs the stages again and adds the product of each.

        Raises
        ------
        InputError : the frame's result cannot be read.
        """
        detection = self.results.detection(name).in_camera()
        self.recording.set_time("frame", sequence=self.results.frames.index(name))
        if detection.timestamp is not None:
            self.recording.set_time("time", duration=detection.timestamp)
        for entity in ("world/stages", "world/chains", "world/cloud", "image", "merges"):
            self.recording.log(entity, self.rr.Clear(recursive=True))
        self._log_content(name, detection, stages)
        self.recording.flush()

    def _open_capture(self) -> dict[str, FrameRef]:
        """Return name -> frame of the capture; empty, with a warning, if the capture cannot be read any more."""
        try:
            return self.results.capture_frames()
        except DooError as error:
            self.warning = f"the capture cannot be read any more, so only the chains are shown ({error})"
            return {}

    def _log_content(self, name: str, detection: Detection, stages: bool) -> None:
        log, rr = self.recording.log, self.rr
        trees = [objects_text(detection.objects)] if detection.objects else []
        lines = [name, *trees, *(caption_lines(detection) or ["nothing found"]), *detection.notes]
        log("summary", rr.TextDocument("\n".join(lines)))
        self._log_chains(detection)
        try:
            data, table = self._load(name, stages)
        except DooError as error:
            self.warning = f"some frames cannot be read any more ({error})"
            return
        if data is None:
            return
        if isinstance(data, Frame):
            log("world/camera", _pinhole(rr, data.camera))
        if not isinstance(data, Cloud):
            log("image", rr.EncodedImage(contents=encode_image(draw(data, detection)), media_type="image/png"))
        if detection.mode == "3d":
            points, colors = _points(data)
            log("world/cloud", rr.Points3D(points, colors=colors, radii=rr.Radius.ui_points(1.0)))
        if table:
            log("merges", rr.TextDocument(table, media_type="text/markdown"))

    def _load(self, name: str, stages: bool) -> tuple[Frame | Cloud | Image | None, str]:
        """Load the input of a frame and, if `stages`, log the stage products; return the input and the table of merges."""
        if name not in self.frame_refs or self.config is None:
            return None, ""
        frame = self.frame_refs[name].load()
        if not stages:
            return as_mode_data(frame.data, self.config.mode), ""
        data = as_mode_data(frame.data, self.config.mode)
        stage_data = run_stages(data, self.config, frame.mask_for(self.config))
        explanation = explain_stages(stage_data, self.config)
        for product in products(stage_data, explanation):
            self._log_product(product)
        return data, merge_table(explanation)

    def _log_product(self, product: Product) -> None:
        rr = self.rr
        if product.mask is not None:
            self.recording.log(f"image/stages/{product.name}", rr.SegmentationImage(product.mask.astype(np.uint8)))
        entity, at = f"stages/{product.name}", product.points
        if len(product.edges):
            colors = product.colors[product.edges[:, 0]]
            self._log_shape(f"{entity}/lines", "LineStrips", at[product.edges], colors=colors, radii=rr.Radius.ui_points(2.0))
        if len(at):
            size = rr.Radius.ui_points(2.0 if len(product.edges) else 1.5)
            self._log_shape(f"{entity}/points", "Points", at, colors=product.colors, radii=size)
        if product.labels:
            labels = list(product.labels.values())
            self._log_shape(f"{entity}/labels", "Points", at[list(product.labels)], labels=labels, radii=rr.Radius.ui_points(4.0))

    def _log_shape(self, entity: str, kind: str, points: Array, **style: Any) -> None:
        """Log points or line strips: 2-D ones in the image, 3-D ones in the world."""
        dimensions = points.shape[-1]
        shape = getattr(self.rr, f"{kind}{dimensions}D")(points, **style)
        self.recording.log(f"{'image' if dimensions == 2 else 'world'}/{entity}", shape)

    def _log_chains(self, detection: Detection) -> None:
        """Log the chains: in 3-D as tubes of the object's radius, with junctions as white balls.

        Segments whose depth was filled in are darker, and paler if other frames filled them in. Doubtful chains are thin, gray.
        """
        for i, (chain, style, number) in enumerate(all_chains(detection)):
            color = np.array(style.color)
            dimmed = np.where(chain.depth_filled[:, None], 3 * color // 4, color)
            colors = np.where(chain.occluded[:, None], color // 2, dimmed)
            colors = np.where(chain.from_time[:, None], (color + 255) // 2, colors).astype(np.uint8)
            radius = style.width * chain.radius if np.isfinite(chain.radius) else 0.0
            pairs = np.stack((chain.joints[:-1], chain.joints[1:]), axis=1)
            entity = f"chains/{i}" if number else f"doubtful/{i - len(detection.chains)}"
            self._log_shape(entity, "LineStrips", pairs, colors=colors, radii=radius)
        if detection.junctions:
            at = np.array([junction.position for junction in detection.junctions])
            radii = np.array([2 * np.nanmax([0.0, *junction.radii]) for junction in detection.junctions])
            self._log_shape("chains/junctions", "Points", at, colors=[(255, 255, 255)] * len(at), radii=radii)


def _pinhole(rr: Any, camera: Camera) -> Any:
    matrix = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
    return rr.Pinhole(image_from_camera=matrix, resolution=[camera.width, camera.height], image_plane_distance=0.1)


def _points(data: Frame | Cloud | Image) -> tuple[Floats, Array | None]:
    """Return at most MAX_POINTS points (N, 3) m of the data, and their colors (N, 3) uint8 RGB."""
    if isinstance(data, Cloud):
        step = max(1, len(data.points) // MAX_POINTS)
        return data.points[::step], None if data.colors is None else data.colors[::step]
    if isinstance(data, Image):
        return np.zeros((0, 3)), None
    v, u = np.nonzero(data.depth)
    step = max(1, len(u) // MAX_POINTS)
    v, u = v[::step], u[::step]
    points = data.camera.unproject(np.column_stack((u, v)), data.depth[v, u])
    return points, None if data.color is None else data.color[v, u]


def select_frames(results: Results, wanted: Sequence[str] | None) -> list[str]:
    """Return the names of the wanted frames of a run, in the order of `wanted`.

    Parameters
    ----------
    results
        the results of the run.
    wanted
        names of frames, or their numbers among the successful frames as text: "0" is the first, "-1" the last. Empty or None
        selects all successful frames.

    Raises
    ------
    InputError : no successful frame has one of the names or numbers.
    """
    if not wanted:
        return list(results.frames)
    chosen = []
    for item in wanted:
        try:
            chosen.append(item if item in results.frames else results.frames[int(item)])
        except (ValueError, IndexError):
            count = f"{results.path} has {len(results.frames)} successful frames"
            raise InputError(f"--frame {item}: {count}", code="frame-unknown") from None
    return chosen
