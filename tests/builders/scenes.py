"""Scenes for tests of one stage: an image, a frame or a cloud without its segmentation, with settings by name."""

from __future__ import annotations

import numpy as np

from doo3d.config import Config, load_config
from doo3d.scene.cloud import CloudScene
from doo3d.scene.cloud_facts import CloudFacts
from doo3d.scene.frame import FrameScene
from doo3d.scene.frame_facts import FrameFacts
from doo3d.scene.image import ImageScene
from doo3d.scene.masked import NO_COLOR
from doo3d.types import Array, Bools, CloudSampling, Floats, Frame, Plane

SHORT = {"radius": "voxelize.radius", "voxel": "voxelize.size", "segment_length": "fit.segment_length"}


def config_of(**settings: object) -> Config:
    """Return the default settings but for some: by a name in SHORT, or with two underscores in place of the dot."""
    return load_config("default", {SHORT.get(name, name.replace("__", ".")): value for name, value in settings.items()})


class EmptyScene(CloudScene):
    """A scene without points, in which nothing is known of the space between chains, nor of surfaces."""

    max_turn, shows_surface = np.pi, False


def empty_scene(dim: int = 3, **settings: object) -> EmptyScene:
    """Return a scene of which the radius and the edge of a voxel alone are known: 1 unless they are set."""
    none, config = np.zeros((0, dim)), config_of(**({"radius": 1.0, "voxel": 1.0} | settings))
    return EmptyScene(points=none, filtered=none, config=config)


def cloud_scene(points: Floats, sensor: Floats | None = None, spacing: float = 0.0, **settings: object) -> CloudScene:
    """Return a cloud of points (N, 3) m that nothing was averaged in; spacing : as measured by segmentation, m."""
    facts, sampling = CloudFacts(points), CloudSampling(spacing)
    config = config_of(**settings)
    return CloudScene(points=points, filtered=points, facts=facts, sensor=sensor, sampling=sampling, config=config)


def frame_scene(frame: Frame, mask: Bools, plane: Plane | None = None, **settings: object) -> FrameScene:
    """Return a frame with all readings in a mask, none of them smoothed."""
    facts = FrameFacts(mask, frame.depth)
    u, v = facts.pixels.T
    pixels = facts.pixels[frame.depth[v, u] > 0]
    points = frame.camera.unproject(pixels, frame.depth[pixels[:, 1], pixels[:, 0]])
    color = NO_COLOR if frame.color is None else frame.color
    own = {"facts": facts, "pixels": pixels, "color": color, "camera": frame.camera, "plane": plane}
    return FrameScene(points=points, filtered=points, config=config_of(**settings), **own)


def image_scene(mask: Bools, color: Array = NO_COLOR, **settings: object) -> ImageScene:
    """Return an image with a mask, with its colors or without."""
    facts, config = FrameFacts(mask), config_of(**{"mode": "2d"} | settings)
    return ImageScene(points=facts.pixels.astype(float), pixels=facts.pixels, facts=facts, color=color, config=config)
