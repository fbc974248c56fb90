"""Draw what every stage makes of one frame, for docs/how-it-works.md: `python docs/images/stages.py`."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

import doo3d
from doo3d.evaluation.renderer import render
from doo3d.evaluation.scenes import make_scene
from doo3d.pipeline import run_stages
from doo3d.types import Detection
from doo3d.viz.overlay import draw
from doo3d.viz.palette import chain_color

FAMILY, SEED = "crossings", 4
HERE, WIDTH, DIM, FINE = Path(__file__).parent / "stages", 760, 0.35, 4


def main() -> None:
    """One PNG per stage."""
    scene = render(make_scene(FAMILY, SEED))
    frame, config = scene.frame, doo3d.load_config("default", {"merge.chains": len(scene.truths)})
    stages = run_stages(frame, config, scene.mask)
    rows, columns = np.nonzero(scene.mask)
    box = slice(max(rows.min() - 30, 0), rows.max() + 30), slice(max(columns.min() - 30, 0), columns.max() + 30)
    scale = WIDTH / (box[1].stop - box[1].start)
    corner = np.array((box[1].start, box[0].start))
    dark = cv2.resize((frame.color[box] * DIM).astype(np.uint8), None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)

    def places(points):
        return np.round(((frame.camera.project(np.asarray(points)) - corner + 0.5) * scale - 0.5) * 2**FINE).astype(np.int32)

    def dots(picture, points, color, size=2):
        for place in places(points):
            cv2.circle(picture, place.tolist(), size << FINE, color, -1, cv2.LINE_AA, FINE)

    def line(picture, points, color, wide=2):
        cv2.polylines(picture, [places(points)], False, color, wide, cv2.LINE_AA, FINE)

    def save(name, picture):
        HERE.mkdir(exist_ok=True)
        paletted = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
        cv2.imwrite(str(HERE / f"{name}.jpg"), paletted, [cv2.IMWRITE_JPEG_QUALITY, 82])

    picture = cv2.resize(frame.color[box], None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    used = np.zeros(scene.mask.shape, np.uint8)
    used[stages.foreground.pixels[:, 1], stages.foreground.pixels[:, 0]] = 1
    kept = cv2.resize(used[box], None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST) > 0
    picture[~kept] = (picture[~kept] * DIM).astype(np.uint8)
    save("segment", picture)

    depth = stages.grid.centroids[:, 2]
    level = (255 * (depth - depth.min()) / np.ptp(depth)).astype(np.uint8)
    shade = cv2.applyColorMap(level[:, None], cv2.COLORMAP_VIRIDIS)[:, 0, ::-1]
    picture = dark.copy()
    for point, color in zip(stages.grid.centroids, shade, strict=True):
        dots(picture, [point], color.tolist(), 3)
    save("voxelize", picture)

    picture = dark.copy()
    dots(picture, stages.skeleton.points, (255, 255, 255))
    save("thin", picture)

    picture = dark.copy()
    for k, path in enumerate(stages.paths):
        line(picture, path.points, chain_color(k))
        dots(picture, path.points[[0, -1]], chain_color(k), 4)
    save("traverse", picture)

    picture = dark.copy()
    for k, chain in enumerate(stages.pruned):
        line(picture, chain.joints, chain_color(k), 1)
        dots(picture, chain.joints, chain_color(k), 3)
    save("fit", picture)

    picture = dark.copy()
    for k, assembly in enumerate(stages.merged):
        for piece in assembly.pieces:
            line(picture, piece, chain_color(k))
        for one, other in zip(assembly.pieces, assembly.pieces[1:], strict=False):
            line(picture, [one[-1], other[0]], (255, 255, 255), 3)
    save("merge", picture)

    picture = dark.copy()
    for k, path in enumerate(stages.filled):
        line(picture, path.points, chain_color(k))
        for i in np.flatnonzero(path.filled):
            line(picture, path.points[i : i + 2], (255, 255, 255), 3)
    save("fill", picture)

    found = Detection(tuple(stages.chains), crossings=stages.crossings)
    save("refine", cv2.resize(draw(frame, found)[box], None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))


if __name__ == "__main__":
    main()
