"""Draw what every stage makes of one frame, for docs/pages/how-it-works.md: `python docs/figures/stages.py`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

import doo3d
from doo3d.evaluation.rendering.renderer import Rendered, render
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.pipeline import Stages, run_stages
from doo3d.types import Detection
from doo3d.viz.overlay import draw
from doo3d.viz.palette import chain_color

FAMILY, SEED = "crossings", 4
FOLDER = Path(__file__).parents[1] / "pages" / "images" / "stages"
WIDTH, DIM, FINE = 760, 0.35, 4
WHITE = (255, 255, 255)
Color = Sequence[int]


class Page:
    """The object's part of a frame, to draw on: dimmed, or an image of the same size given."""

    def __init__(self, scene: Rendered, image: np.ndarray | None = None) -> None:
        rows, columns = np.nonzero(scene.mask)
        self.camera, self.corner = scene.frame.camera, np.array((max(columns.min() - 30, 0), max(rows.min() - 30, 0)))
        self.box = slice(self.corner[1], rows.max() + 30), slice(self.corner[0], columns.max() + 30)
        self.scale = WIDTH / (self.box[1].stop - self.box[1].start)
        image = (scene.frame.color * DIM).astype(np.uint8) if image is None else image
        self.picture = cv2.resize(image[self.box], None, fx=self.scale, fy=self.scale, interpolation=cv2.INTER_CUBIC)

    def places(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) m as OpenCV draws them."""
        flat = (self.camera.project(np.asarray(points)) - self.corner + 0.5) * self.scale - 0.5
        return np.round(flat * 2**FINE).astype(np.int32)

    def dots(self, points: np.ndarray, color: Color, size: int = 2) -> None:
        """A disc at each."""
        for place in self.places(points):
            cv2.circle(self.picture, place.tolist(), size << FINE, color, -1, cv2.LINE_AA, FINE)

    def line(self, points: np.ndarray, color: Color, wide: int = 2) -> None:
        """A polyline."""
        cv2.polylines(self.picture, [self.places(points)], False, color, wide, cv2.LINE_AA, FINE)

    def save(self, name: str) -> None:
        """To the folder of pictures."""
        FOLDER.mkdir(exist_ok=True)
        cv2.imwrite(str(FOLDER / f"{name}.jpg"), self.picture[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 82])


def before_fitting(scene: Rendered, stages: Stages) -> None:
    """From the mask to paths."""
    used = np.zeros((*scene.mask.shape, 1), bool)
    used[stages.scene.pixels[:, 1], stages.scene.pixels[:, 0]] = True
    Page(scene, np.where(used, scene.frame.color, scene.frame.color * DIM).astype(np.uint8)).save("segment")

    page, depth = Page(scene), stages.graph.grid.centroids[:, 2]
    level = (255 * (depth - depth.min()) / np.ptp(depth)).astype(np.uint8)
    for point, color in zip(
        stages.graph.grid.centroids, cv2.applyColorMap(level[:, None], cv2.COLORMAP_VIRIDIS)[:, 0, ::-1], strict=True
    ):
        page.dots([point], color.tolist(), 3)
    page.save("voxelize")

    page = Page(scene)
    page.dots(stages.graph.skeleton.points, WHITE)
    page.save("thin")

    page = Page(scene)
    for k, path in enumerate(stages.graph.paths):
        page.line(path.points, chain_color(k))
        page.dots(path.points[[0, -1]], chain_color(k), 4)
    page.save("traverse")


def from_fitting_on(scene: Rendered, stages: Stages) -> None:
    """From segments to the chain."""
    page = Page(scene)
    for k, chain in enumerate(stages.pruned.chains):
        page.line(chain, chain_color(k), 1)
        page.dots(chain, chain_color(k), 3)
    page.save("fit")

    page = Page(scene)
    for k, assembly in enumerate(stages.merged.assemblies):
        for piece in assembly.pieces:
            page.line(piece, chain_color(k))
        for one, other in zip(assembly.pieces, assembly.pieces[1:], strict=False):
            page.line([one[-1], other[0]], WHITE, 3)
    page.save("merge")

    page = Page(scene)
    for k, path in enumerate(stages.filled):
        page.line(path.points, chain_color(k))
        for i in np.flatnonzero(path.filled):
            page.line(path.points[i : i + 2], WHITE, 3)
    page.save("fill")

    Page(scene, draw(scene.frame, Detection(tuple(stages.chains), crossings=stages.crossings))).save("refine")


if __name__ == "__main__":
    rendered = render(make_scene(FAMILY, SEED))
    found = run_stages(rendered.frame, doo3d.load_config("default", {"merge.chains": len(rendered.truths)}), rendered.mask)
    before_fitting(rendered, found)
    from_fitting_on(rendered, found)
