"""How much of a cable comes into view, and how exactly, as more views of it are fused: `python -m doo3d.evaluation.fused`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ...config import Config, load_config
from ...inputs import FrameData, FrameRef
from ...pipeline import detect
from ...sequence.fusion import fuse
from ...types import Bools, Floats
from ..metrics.score import FrameScore, score
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, Solid, Table
from ..scenes.registry import make_scene

SCENES = (("open", 1), ("crossing", 3), ("crossings", 2), ("several", 6), ("occluded", 5))
VIEWS = (1, 2, 4, 8, 16)
SLANT = 30.0  # degrees that the cameras lean from the middle one
SIZE = (640, 480)
BLOCK, ABOVE = (0.06, 0.05, 0.02), 0.05  # m: edges of what hides a part from each view, along, across and up; height of it


@dataclass(frozen=True)
class View:
    """A frame that was rendered, and its camera's pose (4, 4) in the frame of the scene."""

    rendered: Rendered
    pose: Floats

    def entry(self) -> FrameRef:
        """As a capture would give it."""
        shot = FrameData(self.rendered.frame, self.rendered.mask, self.pose)
        return FrameRef(self.rendered.frame.name, Path(self.rendered.frame.name), partial(_same, shot))


def _same(shot: FrameData) -> FrameData:
    return shot


def with_block(scene: Scene) -> Scene:
    """The scene with one block, instead of what hides anything in it, above the middle of its first cable."""
    axis, k = scene.cables[0].axis, len(scene.cables[0].axis) // 2
    up = scene.table.normal if scene.table is not None else np.array((0.0, 0.0, -1.0))
    along = axis[k + 1] - axis[k]
    along = along - (along @ up) * up
    along /= np.linalg.norm(along)
    turn = np.array((along, np.cross(up, along), up))
    corners = axis[k] + ABOVE * up + ((np.array(list(np.ndindex(2, 2, 2))) - 0.5) * BLOCK) @ turn
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    return replace(scene, occluders=(Solid(corners, np.array([*faces, (1, 5, 7), (1, 7, 3)], dtype=np.int64)),))


def seen_at(scene: Scene, pose: Floats, name: str) -> Scene:
    """The scene in the frame of a camera whose pose (4, 4) in the scene's own frame is given."""
    turn, place = pose[:3, :3], pose[:3, 3]

    def moved(points: Floats) -> Floats:
        return np.asarray((points - place) @ turn)

    table = scene.table
    return replace(
        scene,
        name=name,
        cables=tuple(replace(cable, axis=moved(cable.axis)) for cable in scene.cables),
        occluders=tuple(Solid(moved(solid.vertices), solid.triangles, solid.color) for solid in scene.occluders),
        table=None if table is None else Table(moved(table.point[None])[0], table.normal @ turn, table.color),
        light=tuple((np.asarray(scene.light) @ turn).tolist()),
    )


def views_round(scene: Scene, count: int, slant: float = SLANT, sensor: str = "d435") -> list[View]:
    """Views from a circle of cameras that lean by `slant` degrees round the direction of the scene's own, at its distance."""
    middle = np.vstack([cable.axis for cable in scene.cables]).mean(axis=0) * (0, 0, 1)
    views = []
    for k in range(count):
        around = 2 * np.pi * k / count
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(np.radians(slant) * np.array((np.cos(around), np.sin(around), 0))).as_matrix()
        pose[:3, 3] = middle - pose[:3, :3] @ middle
        views.append(View(render(seen_at(scene, pose, f"{scene.name}/{k}"), sensor), pose))
    return views


def fused_score(scene: Scene, views: list[View], config: Config) -> FrameScore:
    """What is found in the views together; in one alone, where there is but one. What any of them shows counts as seen."""
    if len(views) == 1:
        rendered = views[0].rendered
        return score(detect(rendered.frame, config, rendered.mask).chains, rendered.truths)
    truths = [replace(cable, seen=seen) for cable, seen in zip(scene.cables, _seen(views), strict=True)]
    return score(detect(fuse([view.entry() for view in views], config), config).chains, truths)


def _seen(views: list[View]) -> list[Bools]:
    """Per cable (P,) bool, where at least one view shows it."""
    each = zip(*([truth.seen for truth in view.rendered.truths] for view in views), strict=True)
    return [np.asarray(np.any(np.array(seen), axis=0)) for seen in each]


def shown(views: list[View]) -> float:
    """The share of the cables that at least one view shows."""
    return float(np.mean(np.concatenate(_seen(views))))


def table(sensor: str = "d435") -> Iterator[str]:
    """A line per number of views, over SCENES: what is in view, what is right, how exact."""
    config = load_config("default")
    yield "| views | in view | correct | covered, least | RMS seen, mm | RMS hidden, mm | radius, found/true |"
    yield "|---|---|---|---|---|---|---|"
    scenes = [with_block(make_scene(family, seed, SIZE)) for family, seed in SCENES]
    for count in VIEWS:
        views = [views_round(scene, count, sensor=sensor) for scene in scenes]
        scores = [fused_score(scene, own, config) for scene, own in zip(scenes, views, strict=True)]
        hidden = [found.rms_hidden for found in scores if np.isfinite(found.rms_hidden)]
        right = sum(found.correct for found in scores)
        yield (
            f"| {count} | {np.mean([shown(own) for own in views]):.1%} | {right} of {len(scores)} "
            f"| {min(found.coverage for found in scores):.0%} | {np.mean([found.rms_seen for found in scores]):.2f} "
            f"| {f'{np.mean(hidden):.2f}' if hidden else '-'} "
            f"| {np.mean([found.radius_ratio for found in scores]):.3f} |"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m doo3d.evaluation.fused", description="Number of views against coverage.")
    parser.add_argument("--sensor", default="d435", help="what renders the depth; none: exact")
    for line in table(parser.parse_args().sensor):
        print(line, flush=True)  # noqa: T201
