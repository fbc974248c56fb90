"""Measure sequences of a moving camera: `python -m doo3d.evaluation.sequences.moving_views`."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from ...config import Config, load_config
from ...track.detect_sequence import combine
from ...types import Floats
from ..benchmark.fused_views import scene_in_view
from ..benchmark.run import print_lines
from ..benchmark.tables import markdown_table
from ..metrics.record import Record, added, amount, number
from ..scenes.model import Print, Scene, Solid, Table, corners, cuboid
from .evaluate import first_pass, variant_rows
from .motions import FRAME_RATE, OWN_MOTIONS
from .scenes import SKIN_COLORS, Sequence, make_sequence

SWING_DEGREES, SHIFT, SECONDS = (14.0, 9.0, 6.0), 0.03, (3.7, 5.3, 4.4)
"""Greatest rotations of the camera about the scene's middle, around its x, y and z axes; its shift in m; period of each rotation
in s."""

CLOTH_SIDE, CLOTH_PIXELS, CLOTH_BLURS = 0.4, 512, ((1.0, 0.12), (6.0, 0.15), (40.0, 0.1))
"""Print of the table cloth: side in m and in px; blur (px) and standard deviation of each noise image that is added to it."""

BOXES = 4
"""Number of boxes on the table around a cable."""

ALONE = "each frame alone"
COLUMNS = (
    amount(("frames", ""), 0, "frames", len),
    amount(("correct", ""), 0, "correct", added("correct")),
    number(("nodes seen,", "median, mm"), 0, "nodes_seen", 1),
    number(("hidden,", "mean, mm"), 0, "nodes_hidden", 1, np.mean),
    number(("ms", "a frame"), 0, "ms", 0, np.mean),
)
"""Columns of the table; see `variant_rows` for the nodes."""


@dataclass(frozen=True)
class MovingView(Sequence):
    """A sequence seen by a moving camera, above a table with a cloth and boxes.

    Attributes
    ----------
    poses
        (T, 4, 4) transforms from the camera to the optical frame of a static camera, in which `motion` is given, m.
    """

    poses: Floats

    def scene(self, index: int) -> Scene:
        """Return the scene of a frame."""
        scene = super().scene(index)
        return scene_in_view(scene, self.poses[index], scene.name)


def moving_view(
    motion: str, seed: int, frames: int = 120, level: str = "hard", speed: float = 1.0, at_rest: bool = False
) -> MovingView:
    """Return a sequence seen by a moving camera; equal arguments give equal sequences.

    Parameters
    ----------
    motion, seed, frames, level
        as for `make_sequence`; only motions on a table.
    speed
        factor of the camera's usual speed; 0 for a static camera.
    at_rest
        whether the cable keeps the shape and place of the first frame.
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
    props = tuple(_boxes(base, table, rng))
    return MovingView(**{**vars(base), "motion": replace(base.motion, table=table), "props": props}, poses=poses)


def _cloth(table: Table, rng: Generator) -> Print:
    """Draw the print of a table cloth."""
    along = np.linalg.svd(table.normal[None])[2][1:]
    picture = np.ones((CLOTH_PIXELS, CLOTH_PIXELS))
    for blur, strength in CLOTH_BLURS:
        cloud = gaussian_filter(rng.normal(size=picture.shape), blur, mode="wrap")
        picture += strength * cloud / cloud.std()
    return Print(table.point, along, CLOTH_SIDE, np.clip(picture, 0.3, 1.5))


def _boxes(base: Sequence, table: Table, rng: Generator) -> Iterator[Solid]:
    """Draw boxes on the table, around the area in which the cable moves."""
    assert table.cloth is not None
    across = table.cloth.axes
    places = (np.concatenate(base.motion.axes) - table.point) @ across.T
    middle = (places.max(axis=0) + places.min(axis=0)) / 2
    reach = np.linalg.norm(places - middle, axis=1).max()
    for k in range(BOXES):
        angle, turn = 2 * np.pi * (k + rng.uniform(-0.2, 0.2)) / BOXES, rng.uniform(0, np.pi)
        size = rng.uniform(0.03, 0.09, 3)
        points = corners(size, (0.5, 0.5, 0.0))
        points[:, :2] = points[:, :2] @ Rotation.from_euler("z", turn).as_matrix()[:2, :2]
        points[:, :2] += middle + (reach + 0.07) * np.array([np.cos(angle), np.sin(angle)])
        yield cuboid(table.point + points[:, :2] @ across + points[:, 2:] * table.normal, SKIN_COLORS[k % len(SKIN_COLORS)])


def measure(view: MovingView, config: Config, sensor: str = "d435") -> list[Record]:
    """Return a record of each frame in each variant: frames alone, and sequences with and without the poses of the camera.

    A record is that of `variant_rows`, with the processor time of its frame (`ms`).
    """
    frames = [first_pass(rendered, config) for rendered in view.frames(sensor)]
    observations, spent = [frame.observation for frame in frames], sum(sum(frame.seconds) for frame in frames)
    posed = [replace(observation, pose=pose) for observation, pose in zip(observations, view.poses, strict=True)]
    rows = variant_rows(ALONE, frames, [each.detection for each in observations], {"ms": 1e3 * spent / len(view)})
    for name, given in (("poses given", posed), ("no poses", observations)):
        start = time.process_time()
        found = list(combine(given, config))
        rows += variant_rows(name, frames, found, {"ms": 1e3 * (spent + time.process_time() - start) / len(view)})
    return rows


def table(seeds: int = 2, frames: int = 120, speed: float = 1.0, at_rest: bool = False) -> Iterator[str]:
    """Yield the lines of a Markdown table: sequences of a moving camera, one line for each use of its poses.

    seeds : number of sequences of each motion. frames : number per sequence, 30 per second. speed : factor of the camera's usual
    speed. at_rest : whether the cables keep the shape and place of the first frame.
    """
    config = load_config("default", {"merge.chains": 1})
    views = [moving_view(motion, seed, frames, speed=speed, at_rest=at_rest) for motion in OWN_MOTIONS for seed in range(seeds)]
    return markdown_table("camera", [row for view in views for row in measure(view, config)], COLUMNS)


if __name__ == "__main__":
    print_lines(table)
