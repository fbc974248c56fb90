"""The colors that the strands show at two ends."""

from __future__ import annotations

import math

from ...scene.context import FrameContext
from ...scene.strand_hues import unlike_ends
from ...types import Floats
from ..candidates import Candidates


def appearance(candidates: Candidates, evidence: FrameContext) -> Floats | None:
    """Return how much less likely each pair of ends shows one color, (E, E) cost units; None where no colors were told apart.

    A nat costs as much as a turn by a radian.
    """
    colors, camera = evidence.foreground.colors, evidence.foreground.camera
    if colors is None:
        return None
    lines = candidates.chains if camera is None else candidates.chains.with_points(camera.project(candidates.chains.points))
    window = math.ceil(candidates.window / evidence.segment_length) + 1
    unlike = unlike_ends(colors, list(lines), window)
    return candidates.config.angle_weights[0] * unlike
