"""Measure sequences before a camera that moves: `python -m doo3d.evaluation.sequences.moving_views`."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from ...config import Config, load_config
from ...sequence.camera_motion import CameraMotion
from ...sequence.detect_sequence import combine, motion_of, with_poses
from ...sequence.first_pass import observe_frame
from ...types import Bools, Detection, Floats, Frame
from ..benchmark.fused_views import scene_in_view
from ..metrics.record import Record
from ..metrics.score import score
from ..rendering.renderer import Rendered, render
from ..scenes.model import Print, Solid, Table, Truth, cuboid_triangles
from .motions import FRAME_RATE, OWN_MOTIONS
from .nodes import measured_nodes, node_offsets
from .scenes import SKIN_COLORS, make_sequence
from .scenes import Sequence as TrueSequence

SWING_DEGREES, SHIFT, SECONDS = (14.0, 9.0, 6.0), 0.03, (3.7, 5.3, 4.4)
"""Greatest turns of the camera about the scene's middle, round its x, y and z axes, and m that it is shifted besides; s that each
turn takes there and back."""

CLOTH_SIDE, CLOTH_PIXELS, CLOTH_BLURS = 0.4, 512, ((1.0, 0.12), (6.0, 0.15), (40.0, 0.1))
"""m and pixels of a side of the table cloth's print; blur (px) and standard deviation of each of the clouds it is made of."""

BOXES = 4
"""Boxes that stand on the table round a cable."""


@dataclass(frozen=True)
class MovingView:
    """A sequence as a camera sees it that moves round it, above a table with a cloth and boxes.

    Attributes
    ----------
    base
        the sequence before a camera that stands still.
    poses
        (T, 4, 4) m, from the camera to the frame of the camera that stands still.
    table
        the table with its cloth.
    boxes
        the boxes on it.
    """

    base: TrueSequence
    poses: Floats
    table: Table
    boxes: tuple[Solid, ...]

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.poses)

    def frame(self, index: int, sensor: str = "d435") -> Rendered:
        """Render a frame; the same arguments give the same frame."""
        scene = self.base.scene(index)
        scene = replace(scene, table=self.table, occluders=(*scene.occluders, *self.boxes))
        rendered = render(scene_in_view(scene, self.poses[index], scene.name), sensor)
        data = rendered.frame
        is_lost = any(loss.part is None and loss.start <= index < loss.end for loss in self.base.losses)
        depth = np.zeros_like(data.depth) if is_lost else data.depth
        frame = Frame(color=data.color, depth=depth, camera=data.camera, name=data.name, timestamp=index / FRAME_RATE)
        return replace(rendered, frame=frame)


def moving_view(
    motion: str, seed: int, frames: int = 120, level: str = "hard", speed: float = 1.0, at_rest: bool = False
) -> MovingView:
    """Return a sequence seen by a camera that moves; the same arguments give the same.

    Parameters
    ----------
    motion, seed, frames, level
        as for `make_sequence`, of a motion on a table.
    speed
        how many times as fast as usual the camera moves; 0: it stands still.
    at_rest
        whether the cable stays as it is in the first frame.
    """
    base = make_sequence(motion, seed, frames=frames, level=level)
    if at_rest:
        base = replace(base, motion=replace(base.motion, axes=base.motion.axes[:1] * frames))
    assert base.motion.table is not None
    rng = np.random.default_rng([seed, frames])
    middle = np.concatenate(base.motion.axes).mean(axis=0)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    phases = 2 * np.pi * (speed * np.arange(frames)[:, None] / FRAME_RATE / np.array(SECONDS) + rng.uniform(size=3))
    poses[:, :3, :3] = Rotation.from_rotvec(np.radians(SWING_DEGREES) * np.sin(phases)).as_matrix()
    poses[:, :3, 3] = middle - poses[:, :3, :3] @ middle + SHIFT * np.cos(phases[:, ::-1])
    table = replace(base.motion.table, cloth=_cloth(base.motion.table, rng))
    return MovingView(base, poses, table, tuple(_boxes(base, table, rng)))


def _cloth(table: Table, rng: Generator) -> Print:
    """Return the print of a table cloth."""
    along = np.linalg.svd(table.normal[None])[2][1:]
    picture = np.ones((CLOTH_PIXELS, CLOTH_PIXELS))
    for blur, strength in CLOTH_BLURS:
        cloud = gaussian_filter(rng.normal(size=picture.shape), blur, mode="wrap")
        picture += strength * cloud / cloud.std()
    return Print(table.point, along, CLOTH_SIDE, np.clip(picture, 0.3, 1.5))


def _boxes(base: TrueSequence, table: Table, rng: Generator) -> Iterator[Solid]:
    """Yield boxes on the table, round the place where the cable moves."""
    assert table.cloth is not None
    across = table.cloth.axes
    places = (np.concatenate(base.motion.axes) - table.point) @ across.T
    middle = (places.max(axis=0) + places.min(axis=0)) / 2
    reach = np.linalg.norm(places - middle, axis=1).max()
    for k in range(BOXES):
        angle, turn = 2 * np.pi * (k + rng.uniform(-0.2, 0.2)) / BOXES, rng.uniform(0, np.pi)
        size = rng.uniform(0.03, 0.09, 3)
        corners = (np.array(list(np.ndindex(2, 2, 2))) - (0.5, 0.5, 0.0)) * size
        corners[:, :2] = corners[:, :2] @ Rotation.from_euler("z", turn).as_matrix()[:2, :2]
        corners[:, :2] += middle + (reach + 0.07) * np.array([np.cos(angle), np.sin(angle)])
        yield Solid(
            table.point + corners[:, :2] @ across + corners[:, 2:] * table.normal,
            cuboid_triangles(),
            SKIN_COLORS[k % len(SKIN_COLORS)],
        )


def measure(view: MovingView, config: Config, sensor: str = "d435") -> dict[str, list[Record]]:
    """Return a record of each frame for each variant: every frame alone, and sequences with each of the `camera_poses`.

    A record has the scores, the distances of the nodes of the chain from their points of the material (`nodes_seen` and
    `nodes_hidden`, mm), the error of the camera's pose (mm at the middle of the scene) and the processor time of its frame (ms).
    """
    rendered, observations, spent = [], [], 0.0
    for index in range(len(view)):
        each = view.frame(index, sensor)
        start = time.process_time()
        observations.append(observe_frame(each.frame, config, each.mask))
        spent += time.process_time() - start
        rendered.append((each.truths[0], measured_nodes(each.truths[0], each.frame.depth)))
    detections: dict[str, tuple[list[Detection], Floats | None, float]] = {
        "each frame alone": ([observation.detection for observation in observations], None, 0.0)
    }
    for name in ("true poses", "estimated poses", "taken to stand still"):
        start = time.process_time()
        motion = CameraMotion()
        if name == "true poses":
            motion = CameraMotion(np.linalg.inv(view.poses[0]) @ view.poses)
        elif name == "estimated poses":
            motion = motion_of(observations, config, lambda k: observations[k].background)
        found = list(combine(with_poses(observations, motion), config))
        detections[name] = found, motion.poses, time.process_time() - start
    middle = np.append(np.concatenate([truth.axis for truth, _ in rendered]).mean(axis=0), 1.0)
    true = np.linalg.inv(view.poses[0]) @ view.poses
    result = {}
    for name, (found, poses, seconds) in detections.items():
        errors = 1e3 * np.linalg.norm((((np.eye(4) if poses is None else poses) - true) @ middle)[:, :3], axis=1)
        ms = 1e3 * (spent + seconds) / len(view)
        result[name] = [
            Record(row | {"pose_error": error, "ms": ms})
            for row, error in zip(_rows(found, rendered), errors.tolist(), strict=True)
        ]
    return result


def _rows(detections: Sequence[Detection], rendered: Sequence[tuple[Truth, Bools]]) -> Iterator[Record]:
    """Yield the scores of each frame, and how far the nodes of its longest chain are from their points of the material, mm."""
    chains = [max(each.chains, key=lambda chain: chain.length, default=None) for each in detections]
    offsets = node_offsets(chains, [truth for truth, _ in rendered], keeps_direction=True)
    distances = 1e3 * np.linalg.norm(offsets, axis=2)
    for detection, row, (truth, measured) in zip(detections, distances, rendered, strict=True):
        seen, hidden = (row[np.isfinite(row) & each].tolist() for each in (measured, ~measured))
        yield Record(score(detection.chains, (truth,)) | {"nodes_seen": seen, "nodes_hidden": hidden})


def table(seeds: int, frames: int, speed: float = 1.0, at_rest: bool = False) -> Iterator[str]:
    """Yield the lines of a Markdown table: sequences before a camera that moves, by what is known of its poses."""
    config = load_config("default", {"merge.chains": 1, "sequence.chains": 1})
    rows: dict[str, list[Record]] = {}
    for motion in OWN_MOTIONS:
        for seed in range(seeds):
            for name, records in measure(moving_view(motion, seed, frames, speed=speed, at_rest=at_rest), config).items():
                rows.setdefault(name, []).extend(records)
    yield "| camera | frames | correct | nodes seen, median | hidden, mean | error of the pose, median (worst) | ms a frame |"
    yield "|---|---|---|---|---|---|---|"
    for name, records in rows.items():
        seen, hidden = (np.concatenate([each[key] for each in records]) for key in ("nodes_seen", "nodes_hidden"))
        errors = [each["pose_error"] for each in records]
        of_pose = f"{np.median(errors):.2f} mm ({max(errors):.2f} mm)" if name == "estimated poses" else "-"
        correct, ms = sum(bool(each["correct"]) for each in records), np.mean([each["ms"] for each in records])
        shown = f"{correct} | {np.median(seen):.1f} mm | {hidden.mean():.1f} mm | {of_pose} | {ms:.0f}"
        yield f"| {name} | {len(records)} | {shown} |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        prog="python -m doo3d.evaluation.sequences.moving_views", description="Measure sequences before a camera that moves."
    )
    parser.add_argument("--seeds", type=int, default=2, help="sequences of each motion")
    parser.add_argument("--frames", type=int, default=120, help="frames of each sequence, 30 a second")
    parser.add_argument("--speed", type=float, default=1.0, help="how many times as fast as usual the camera moves")
    parser.add_argument("--at-rest", action="store_true", help="the cables stay as they are in the first frame")
    given = parser.parse_args()
    for line in table(given.seeds, given.frames, given.speed, given.at_rest):
        print(line, flush=True)  # noqa: T201
