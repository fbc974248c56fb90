"""From one frame, and perhaps places on the object, to a configuration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from ..config import Config, HsvRange, SegmentConfig
from ..errors import InputError
from ..geometry.mask import mask_radius
from ..stages.segment import segment
from ..stages.segment.methods import resolve_method
from ..stages.segment.methods.hsv import in_ranges
from ..stages.voxelize import SIZE_OVER_RADIUS, SIZE_OVER_SPACING
from ..types import Array, Bools, Cloud, Frame, Image
from .hsv_range import fit_range, whole
from .thin_object import Thin, at_pick, by_itself, thin_part

WORK = 1_500_000
"""Pixels of the image in which the thing is looked for; larger ones are made smaller for that."""

ALIKE = 0.5
"""Share of the pixels of a range that are not the thing, from which on its colour does not tell it."""

SEGMENT = 2.5
"""Radii of a segment: short enough for the bends of a cable, long enough for its direction to be known."""

ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)

UNEVEN = 1.7
"""Times its narrow part that a mask is wide, from which on strands lie side by side in it."""

NARROW = 3.0
"""px; what is less wide is found by luck."""

OTHERWISE = (
    "tell it in another way: segment.method=plane where it stands off a surface in the depth, background with an image "
    "without it (segment.reference), or a mask of your own (doo3d detect --mask)"
)


@dataclass(frozen=True)
class Tuned:
    """What is proposed for a frame.

    config : the configuration. mask : (H, W) bool, what detection takes with it.
    thing : (H, W) bool, the thin thing as tuning saw it; None where there is no colour and nothing to compare with.
    taken : 0 to 1, share of the thing that is taken; besides : 0 to 1, share of what is taken that is not the thing; both None
    without a thing. width : px; metres : the same in m, None without depth. reasons : dotted key -> why it is as it is.
    advice : what to do next, a sentence each.
    """

    config: Config
    mask: Bools
    thing: Bools | None
    taken: float | None
    besides: float | None
    width: float
    metres: float | None
    reasons: dict[str, str] = field(default_factory=dict)
    advice: tuple[str, ...] = ()


def tune(
    data: Frame | Cloud | Image,
    config: Config,
    picks: Sequence[tuple[int, int]] = (),
    box: tuple[int, int, int, int] | None = None,
) -> Tuned:
    """Colour ranges, voxel size and segment length for one frame.

    Parameters
    ----------
    config : what is not proposed stays as it is there.
    picks : (x, y) px, places on the object; where its colours differ, one on each. box : (x, y, w, h) px that it lies in. Without
        both it is the longest thin thing that has a colour of its own.

    Raises
    ------
    InputError : a place is outside the image; nothing thin is found there, or no range of colours tells it from the rest; the
        data is a cloud.
    """
    if isinstance(data, Cloud):
        raise InputError(
            "tuning looks at pictures, and a cloud is none: give a frame with depth, or a photograph", code="mode-needs-image"
        )
    if isinstance(data, Frame) and config.mode == "2d" and data.color is not None:
        data = Image(data.color, data.name, data.timestamp)
    things: list[Bools] = []
    if data.color is None:
        if picks or box:
            raise InputError(
                "the frame has no colour that a place in it could tell: leave out --pick and --box", code="method-needs-color"
            )
        way = resolve_method(data, config.segment)
        found = config.segment.model_copy(update={"method": way})
        reasons = {"segment.method": "there is no colour, and this is what the depth calls for"}
    else:
        things, ranges = _by_colour(data.color, picks, box)
        found = config.segment.model_copy(update={"method": "hsv", "ranges": ranges})
        seen = f"the colours of {len(things)} places" if len(things) > 1 else "the colour of the thin thing"
        reasons = {
            "segment.method": "the object has a colour of its own",
            "segment.ranges": f"{seen} from shadow to highlight, as far as the background does not have them too",
        }
    return _measured(data, config, found, things, reasons)


def _by_colour(
    color: Array, picks: Sequence[tuple[int, int]], box: tuple[int, int, int, int] | None
) -> tuple[list[Bools], tuple[HsvRange, ...]]:
    """The things (H, W) and the ranges that take them."""
    height, width = color.shape[:2]
    for x, y in picks:
        if not (0 <= x < width and 0 <= y < height):
            raise InputError(f"--pick {x},{y}: is outside the image, which is {width}x{height} px", code="place-outside")
    if box and not (0 <= box[0] < box[0] + box[2] <= width and 0 <= box[1] < box[1] + box[3] <= height):
        raise InputError(
            f"--box {','.join(map(str, box))}: is not inside the image, which is {width}x{height} px", code="place-outside"
        )
    scale = min(1.0, math.sqrt(WORK / (height * width)))
    small = color if scale == 1 else cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    found = _found(small, [(int(x * scale), int(y * scale)) for x, y in picks], _scaled(box, scale))
    things = [Thin(whole(small, thing), thing.share, thing.length, thing.half) for thing in found]
    ranges = []
    for i, thing in enumerate(things):
        others = np.zeros_like(thing.mask)
        for other in things[:i] + things[i + 1 :]:
            others |= other.mask
        ranges.append(fit_range(small, thing, others))
    taken, together = in_ranges(small, tuple(ranges)), np.logical_or.reduce([thing.mask for thing in things])
    if (taken & ~together).sum() > ALIKE * taken.sum():
        raise InputError(
            f"no range of colours tells the thin thing from the rest, {np.mean(taken & ~together):.0%} of the image has its "
            f"colours too: {OTHERWISE}",
            code="color-not-distinct",
        )
    full = [cv2.resize(thing.mask.view(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST) > 0 for thing in things]
    return full, tuple(ranges)


def _scaled(box: tuple[int, int, int, int] | None, scale: float) -> tuple[int, int, int, int] | None:
    if box is None:
        return None
    x, y, w, h = (int(part * scale) for part in box)
    return x, y, max(w, 1), max(h, 1)


def _found(color: Array, picks: Sequence[tuple[int, int]], box: tuple[int, int, int, int] | None) -> list[Thin]:
    """The things at the picks, each once; or the one in the box or the image."""
    if not picks:
        thing = by_itself(color, box)
        if thing is None:
            where = "in the box" if box else "in the image"
            raise InputError(
                f"nothing thin and long {where} has a colour of its own: show it with --pick X,Y, or {OTHERWISE}",
                code="object-missing",
            )
        return [thing]
    things: list[Thin] = []
    for x, y in picks:
        if any(thing.mask[y, x] for thing in things):
            continue
        at = at_pick(color, (x, y))
        if at is None:
            raise InputError(
                f"what has the colour at the pick {x},{y} of the image is nothing thin and long: if the pick lies on the "
                f"background, pick the middle of the object; if not, the background has its colour, so {OTHERWISE}",
                code="pick-not-thin",
            )
        things.append(at)
    return things


def _measured(data: Frame | Image, config: Config, found: SegmentConfig, things: list[Bools], reasons: dict[str, str]) -> Tuned:
    """What detection makes of it, and the lengths that go with the width of that."""
    thing = np.logical_or.reduce(things) if things else None
    if thing is not None and isinstance(data, Frame) and (metres := 2 * mask_radius(thing, data.depth, data.camera.fx)):
        if metres > 0.6 * found.max_width:
            found = found.model_copy(update={"max_width": round(2 * metres, 3)})
            reasons["segment.max_width"] = f"the object is {1000 * metres:.0f} mm wide"
    foreground = segment(data, found, None, config.seed).foreground
    if foreground.mask is None or not foreground.mask.any():
        raise InputError(f"segment: nothing is left of what was found: {OTHERWISE}", code="object-missing")
    mask = foreground.mask
    if isinstance(data, Frame):
        radius = mask_radius(mask, data.depth, data.camera.fx)
        unit, apart = "m", float(np.median(foreground.points[:, 2])) / data.camera.fx
    else:
        radius, unit, apart = mask_radius(mask), "px", 1.0
    length = segment_length(radius, apart)
    reasons["fit.segment_length"] = f"{length / radius:.1f} radii of what is {_said(2 * radius, unit)} wide"
    size, reasons["voxelize.size"] = _voxel(mask, radius, apart, config, unit)
    changed = config.model_copy(
        update={
            "segment": found,
            "fit": config.fit.model_copy(update={"segment_length": length}),
            "voxelize": config.voxelize.model_copy(update={"size": size}),
        }
    )
    taken = float(np.mean(mask[thing])) if thing is not None else None
    besides = float(np.mean(~thing[mask])) if thing is not None else None
    width = 2 * mask_radius(mask)
    advice = _advice(data, mask, width, taken, besides)
    return Tuned(changed, mask, thing, taken, besides, width, 2 * radius if unit == "m" else None, reasons, advice)


def segment_length(radius: float, apart: float) -> float:
    """SEGMENT radii in a round number, and not less than six readings, which are `apart` from each other."""
    wanted = max(SEGMENT * radius, 6 * apart)
    power = 10.0 ** math.floor(math.log10(wanted))
    return float(f"{min((step * power for step in ROUND), key=lambda step: abs(math.log(step / wanted))):.6g}")


def _said(length: float, unit: str) -> str:
    return f"{1000 * length:.1f} mm" if unit == "m" else f"{length:.1f} px"


def _voxel(mask: Bools, radius: float, apart: float, config: Config, unit: str) -> tuple[float | None, str]:
    """The size of voxels and why; None where detection chooses well by itself."""
    if unit == "px":
        return None, "in 2-D the pixels are the grid"
    pixels = mask_radius(mask)
    narrow = float(np.min([thin_part(mask).half or pixels, pixels]))
    by_radius, by_spacing = SIZE_OVER_RADIUS * radius, SIZE_OVER_SPACING * apart
    if pixels > UNEVEN * narrow:
        size = round(max(by_radius * narrow / pixels, by_spacing), 5)
        return size, "strands lie side by side in the mask: by the width of single ones, which its own width does not tell"
    why = "half of the radius" if by_radius >= by_spacing else "the pixels lie too far apart for half of the radius"
    return None, f"detection chooses {_said(max(by_radius, by_spacing), unit)} here, and as it fits in other frames: {why}"


def _advice(data: Frame | Image, mask: Bools, width: float, taken: float | None, besides: float | None) -> tuple[str, ...]:
    said = []
    if taken is not None and taken < 0.85:
        said.append("some of it is missed (red in the picture): show a place there with one more --pick")
    if besides is not None and besides > 0.15:
        said.append("other things have its colour too (yellow in the picture): keep them out with masks, or out of the view")
    if width < NARROW:
        said.append(f"it is only {width:.1f} px wide: go nearer with the camera, or take a higher resolution")
    if isinstance(data, Frame) and (missing := float(np.mean(data.depth[mask] <= 0))) > 0.3:
        said.append(f"{missing:.0%} of it has no depth: the way over that is interpolated, light or distance may help")
    return tuple(said)
