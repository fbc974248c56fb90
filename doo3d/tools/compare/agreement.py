"""Test whether the 3-D and the 2-D mode find the same chains in the image of a frame.

The chains of each mode are aligned with those of the other: each point must have a position there within the tolerance, and
the positions must follow each other, forwards or backwards, without a jump. If only one of two chains continues, or they
continue in different places, one of the two alignments has a jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...types import Array, Camera, Chain, Floats, Frame, Image
from .line_alignment import SAMPLE_SPACING_PX, Line, LineAlignment, align_line, resample_line

if TYPE_CHECKING:
    from ...config import Config

MIN_TOLERANCE_PX = 2.0
"""Least tolerance in px; where the 2-D chain is wider than twice this, the tolerance is half its width."""


@dataclass(frozen=True)
class Difference:
    """A place in the image where the chains of the 3-D and of the 2-D mode differ.

    Attributes
    ----------
    at
        (x, y) px in the image.
    what
        the difference in words, such as "3-D chain 1 runs 7.2 px from the nearest 2-D chain".
    distance
        distance in px from the nearest chain of the other mode, infinite if the other mode has no chain; None if the chains
        continue in different ways instead.
    tolerance
        distance in px that is allowed at `at`.
    """

    at: tuple[float, float]
    what: str
    distance: float | None
    tolerance: float

    def to_dict(self) -> dict[str, Any]:
        """Return the difference as a dict for `comparison.json`: at [x, y] px, what, distance (px or None), tolerance (px)."""
        return {"at": list(self.at), "what": self.what, "distance": self.distance, "tolerance": self.tolerance}


@dataclass(frozen=True)
class Comparison:
    """The chains that the 3-D and the 2-D mode found in one frame, in the image, and the places where they differ.

    Attributes
    ----------
    lines_3d
        (N + 1, 2) px for each 3-D chain of N segments: its joints projected into the image, without those behind the camera.
    lines_2d
        (N + 1, 2) px for each 2-D chain of N segments: its joints.
    max_distance, rms_distance
        greatest and root mean square distance in px of points along the 3-D chains from the 2-D chains; NaN if a mode has no
        chain.
    tolerance
        distance in px that is allowed at the point of greatest distance.
    differences
        the places where the modes differ; empty if they agree.
    """

    lines_3d: tuple[Floats, ...]
    lines_2d: tuple[Floats, ...]
    max_distance: float
    rms_distance: float
    tolerance: float
    differences: tuple[Difference, ...]

    @property
    def agrees(self) -> bool:
        """Whether both modes found the same chains.

        The chains then lie within the tolerance of each other, and continue in the same way at crossings and gaps.
        """
        return not self.differences

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as a dict for `comparison.json`.

        Its keys are agrees (bool), chains_3d and chains_2d (numbers of chains), largest, rms and tolerance (`max_distance`,
        `rms_distance` and `tolerance`, px), and places (a dict for each difference).
        """
        return {
            "agrees": self.agrees,
            "chains_3d": len(self.lines_3d),
            "chains_2d": len(self.lines_2d),
            "largest": self.max_distance,
            "rms": self.rms_distance,
            "tolerance": self.tolerance,
            "places": [difference.to_dict() for difference in self.differences],
        }


def compare(frame: Frame, config: Config, config_2d: Config, mask: Array | None = None) -> Comparison:
    """Run the 3-D and the 2-D mode in a frame with the same mask, and compare their chains in the image.

    Parameters
    ----------
    frame
        a frame with depth; without color, the 2-D mode is given a black image beside the mask.
    config, config_2d
        the configurations of the 3-D mode and of the 2-D mode.
    mask
        (H, W) bool, the pixels of the objects; None for the mask that the 3-D mode finds.

    Returns
    -------
    Comparison
        the chains of both modes in the image, and the places where they differ.

    Raises
    ------
    InputError : nothing can be detected in the frame.
    """
    from ...pipeline import detect, run_stages

    stages = run_stages(frame, config, mask)
    object_mask = stages.scene.mask
    if not object_mask.any():
        raise InputError("; ".join(stages.scene.notes) or "there is no pixel of an object to compare", code="object-missing")
    color = frame.color if frame.color is not None else np.zeros((*frame.depth.shape, 3), np.uint8)
    return compare_chains(stages.chains, frame.camera, detect(Image(color), config_2d, object_mask).chains)


def compare_chains(chains_3d: Sequence[Chain], camera: Camera, chains_2d: Sequence[Chain]) -> Comparison:
    """Compare the 3-D chains of a frame with its 2-D chains, in the image.

    Each 3-D chain, projected into the image, must follow a 2-D chain within the tolerance, and each 2-D chain must follow a 3-D
    chain. The tolerance is 2 px, or half the width of the 2-D chain if that is more. Open chains may differ by one segment in
    length at each end, since every chain is a whole number of segments long.

    Parameters
    ----------
    chains_3d
        the 3-D chains, joints in m, in the camera's optical frame.
    camera
        the intrinsics of the image.
    chains_2d
        the 2-D chains, joints in px, in the same image.

    Returns
    -------
    Comparison
        the chains of both modes in the image, their distances in px, and the places where they differ.
    """
    projected = [_project(chain, camera) for chain in chains_3d]
    lines_3d = [
        resample_line(joints, np.zeros(len(joints)), chain.closed) for joints, chain in zip(projected, chains_3d, strict=True)
    ]
    lines_2d = [resample_line(chain.joints, np.where(chain.radii > 0, chain.radii, 0.0), chain.closed) for chain in chains_2d]
    extension = max([_longest_step(joints) for joints in projected] + [chain.segment_length for chain in chains_2d], default=0.0)
    on_2d = [align_line(line, lines_2d, extension, MIN_TOLERANCE_PX) for line in lines_3d]
    on_3d = [align_line(line, lines_3d, extension, MIN_TOLERANCE_PX) for line in lines_2d]
    distances = np.concatenate([alignment.distance for alignment in on_2d] or [np.zeros(0)])
    tolerances = np.concatenate([alignment.tolerance for alignment in on_2d] or [np.zeros(0)])
    worst = int(np.argmax(distances)) if len(distances) else 0
    measured = bool(len(distances) and np.isfinite(distances).all())
    return Comparison(
        lines_3d=tuple(projected),
        lines_2d=tuple(chain.joints for chain in chains_2d),
        max_distance=float(distances[worst]) if measured else float("nan"),
        rms_distance=float(np.sqrt((distances**2).mean())) if measured else float("nan"),
        tolerance=float(tolerances[worst]) if measured else MIN_TOLERANCE_PX,
        differences=tuple(_all_differences(lines_3d, on_2d, lines_2d, on_3d, extension)),
    )


def _all_differences(
    lines_3d: list[Line], on_2d: list[LineAlignment], lines_2d: list[Line], on_3d: list[LineAlignment], extension: float
) -> list[Difference]:
    """Return the differences of both alignments, merging jumps that are near each other."""
    result = [
        difference
        for i, alignment in enumerate(on_2d)
        for difference in _differences(alignment, lines_3d[i], f"3-D chain {i + 1}", "2-D")
    ]
    jumps = np.array([difference.at for difference in result if difference.distance is None]).reshape(-1, 2)
    for i, alignment in enumerate(on_3d):
        for difference in _differences(alignment, lines_2d[i], f"2-D chain {i + 1}", "3-D"):
            near = np.linalg.norm(jumps - difference.at, axis=1) < extension + 2 * difference.tolerance
            if difference.distance is not None or not near.any():
                result.append(difference)
    return result


def _project(chain: Chain, camera: Camera) -> Floats:
    """Return the joints in the image, (N + 1, 2) px; those that are not in front of the camera are left out."""
    pixels = camera.project(chain.joints)
    return np.asarray(pixels[np.isfinite(pixels).all(axis=1)])


def _longest_step(joints: Floats) -> float:
    """Return the longest distance between successive joints, px."""
    return float(np.linalg.norm(np.diff(joints, axis=0), axis=1).max(initial=0.0))


def _differences(alignment: LineAlignment, line: Line, name: str, other_mode: str) -> list[Difference]:
    """Return the differences of a line: the worst point of each stretch off the other mode's chains, and its jumps.

    Parameters
    ----------
    alignment, line
        the line, and its alignment with the other mode's chains.
    name
        name of its chain, such as "3-D chain 1".
    other_mode
        name of the other mode: "2-D" or "3-D".
    """
    result = []
    outside = np.concatenate(([False], alignment.distance > alignment.tolerance, [False]))
    for start, stop in np.flatnonzero(np.diff(outside.astype(int))).reshape(-1, 2).tolist():
        worst = start + int(np.argmax(alignment.distance[start:stop] / alignment.tolerance[start:stop]))
        distance, tolerance = float(alignment.distance[worst]), float(alignment.tolerance[worst])
        length = max(float(line.arcs[stop - 1] - line.arcs[start]), SAMPLE_SPACING_PX)
        where = f"{distance:.1f} px from the nearest {other_mode} chain"
        if not np.isfinite(distance):
            where = f"where there is no {other_mode} chain"
        what = f"{name} runs {where} ({tolerance:.1f} px are allowed), over {length:.0f} px"
        result.append(Difference(_point(line, worst), what, distance, tolerance))
    for before, after in alignment.jumps:
        start_name, end_name = (
            f"{other_mode} chain {alignment.line[k] + 1} at {max(round(alignment.arc[k]), 0)} px" for k in (before, after)
        )
        middle = (before + after) // 2
        what = f"{name} jumps from {start_name} to {end_name}"
        result.append(Difference(_point(line, middle), what, None, float(alignment.tolerance[middle])))
    return result


def _point(line: Line, index: int) -> tuple[float, float]:
    x, y = line.points[index]
    return float(x), float(y)
