"""Choose chains by pointing: points on strands or beside them, and a box, in pixels of the image."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import pipeline
from ..config import ConfigLike
from ..errors import InputError, options_of_python
from ..guard.limits import current_limits
from ..types import Array, Cloud, Detection, Frame, Image, View, arguments
from ..types.conversions import FrameReference
from ..types.results import kept_crossings
from ..types.tree import kept_trees
from ..viz.instance_labels import ImageStrand, image_strands

CLICK_SHARE = 0.005
"""Distance beside a strand at which a point still chooses it, as a share of the image's longer side, as larger images are shown
smaller: 3 px of 640, about as well as a hand clicks."""

Points = str | Iterable[Sequence[float]]
"""Points as text, "x,y;-x,y", or as (x, y, True) and (x, y, False); (x, y) alone is as with True."""


class Point(NamedTuple):
    """A pixel of the image, px, and whether the chains through it are wanted (True) or not (False)."""

    x: float
    y: float
    is_wanted: bool


@dataclass(frozen=True)
class Choice:
    """What the user points at in an image.

    Attributes
    ----------
    points
        pixels on chains that are wanted or not wanted. With a wanted one, only chains through such points are wanted.
    box
        (left, top, right, bottom) px: only chains that are mostly inside are wanted. None for the whole image.
    """

    points: tuple[Point, ...] = ()
    box: tuple[float, ...] | None = None

    @staticmethod
    def of(points: Points | None, box: str | ArrayLike | None) -> Choice | None:
        """Return the choice as given in the shell, as text, or in Python; None if there is none.

        Raises
        ------
        InputError : a point or the box is invalid; the message quotes it.
        """
        chosen = _points(() if points is None else points)
        if box is None:
            return Choice(chosen) if chosen else None
        corners = _numbers(box, "--box", (4,), "x0,y0,x1,y1") if isinstance(box, str) else _values(box, "box", (4,))
        (left, right), (top, bottom) = sorted(corners[::2]), sorted(corners[1::2])
        return Choice(chosen, (left, top, right, bottom))

    @property
    def is_pointed(self) -> bool:
        """Whether a chain is pointed at, which is then shown however low its confidence is."""
        return any(point.is_wanted for point in self.points)

    def to_dict(self) -> dict[str, Any]:
        """Return the choice as plain lists, ready for JSON."""
        return {"points": [list(point) for point in self.points], "box": self.box and list(self.box)}

    def applied(self, detection: Detection) -> Detection:
        """Return a detection with the wanted chains only; all chains of a branched object are wanted if one is.

        Raises
        ------
        InputError : the detection has no image, a point or the box is outside of it, or no wanted chain is at a wanted point.
        """
        if detection.view is None:
            raise InputError(
                f"frame {detection.frame}: --points and --box are pixels, and a cloud has no image: leave them out",
                code="place-needs-image",
            )
        self._check_inside(detection.view)
        count = len(detection.chains)
        everything = replace(detection, chains=(*detection.chains, *detection.doubtful), doubtful=())
        strands = image_strands(everything.in_camera())
        bodies = [item.chains for item in detection.objects] or [(k,) for k in range(count)]
        bodies += [(k,) for k in range(count, len(strands))]
        reach = CLICK_SHARE * max(detection.view.width, detection.view.height)
        hits = {point: _hits(strands, point, reach, detection) for point in self.points}
        wanted = [body for body in bodies if not self.is_pointed or any(p.is_wanted and hits[p] & {*body} for p in hits)]
        wanted = [body for body in wanted if not any(hits[p] & {*body} for p in hits if not p.is_wanted)]
        kept = sorted(k for body in wanted if self._holds([strands[k] for k in body], detection.view) for k in body)
        for point in hits:
            if point.is_wanted and not hits[point].intersection(kept):
                raise InputError(
                    f"frame {detection.frame}: the chain at --points {_text(point)} is excluded by --box or by a point with a "
                    "minus: leave out one of them",
                    code="place-missed",
                )
        result = keep(everything, kept)
        shown = len(kept) if self.is_pointed else sum(k < count for k in kept)
        notes = () if kept or not self.box else (f"box: no chain has more than half of its length in {self.box_text}",)
        return replace(result, chains=result.chains[:shown], doubtful=result.chains[shown:], notes=(*result.notes, *notes))

    @property
    def box_text(self) -> str:
        """The box as in the shell."""
        return ",".join(f"{value:g}" for value in self.box or ())

    def _check_inside(self, view: View) -> None:
        """Raise InputError if a point is not in the image, or the box does not overlap it."""
        right, bottom = view.width - 0.5, view.height - 0.5
        outside = [f"--points {_text(p)}" for p in self.points if not (-0.5 <= p.x < right and -0.5 <= p.y < bottom)]
        if self.box and not (self.box[0] < right and self.box[1] < bottom and self.box[2] >= -0.5 and self.box[3] >= -0.5):
            outside.append(f"--box {self.box_text}")
        if outside:
            raise InputError(
                f"{outside[0]} is outside the image of {view.width} x {view.height} pixels: give pixels counted from 0,0, the "
                "upper left one",
                code="place-outside",
            )

    def _holds(self, strands: Sequence[ImageStrand], view: View) -> bool:
        """Return whether the box holds more than half of the visible length of an object; True without a box."""
        if self.box is None:
            return True
        points = np.concatenate([strand.points[~strand.is_hidden] for strand in strands])
        points = points[((points > -0.5) & (points < (view.width - 0.5, view.height - 0.5))).all(axis=1)]
        inside = ((points >= self.box[:2]) & (points <= self.box[2:])).all(axis=1)
        return bool(2 * inside.sum() > len(points))


def detect(
    data: Frame | Cloud | Image | Array | FrameReference,
    config: ConfigLike | None = None,
    mask: Array | None = None,
    pose: ArrayLike | None = None,
    *,
    points: Points | None = None,
    box: str | ArrayLike | None = None,
) -> Detection:
    """Return the deformable linear objects in one frame, cloud or image as chains.

    Parameters
    ----------
    data
        a Frame or a Cloud. With a config whose `mode` is 2d: an Image, an array (H, W, 3) uint8 RGB, or a Frame with color. Or a
        frame of a capture, `capture[0]`, which is read with its mask and its camera's pose in the base frame.
    config
        the settings: a Config, the name of a preset, the path of a YAML file, or settings by dotted key over the defaults, such
        as {"merge.chains": 1}; None for the preset "default".
    mask
        the caller's own segmentation, True on the object, instead of the config's: (H, W) bool for a Frame or an image, (N,)
        bool for a Cloud made of N points, counting those with NaN. None segments as the config says.
    pose
        pose of the camera (of the cloud's frame) in the robot's base frame, m: 4x4, p_base = pose @ p_camera, or the seven
        numbers x y z qx qy qz qw. The detection is then in the base frame. None leaves it in the camera's.
    points
        pixels that choose among the chains: [(x, y, True), ...], px. True keeps the chains that pass through the pixel, False
        removes them; with False alone, all others are kept. A pixel chooses every chain that covers it, or else the nearest one
        within 0.5 % of the image's longer side. A chain that is pointed at is kept however low its confidence is. None keeps all.
    box
        (x0, y0, x1, y1) px, two opposite corners: keeps the chains that have more than half of their visible length inside. With
        `points`, both must hold. None for the whole image.

    Returns
    -------
    Detection with the chains, longest first. If neither the object (by a mask, a color) nor the number of chains is given, those
    whose confidence is below `output.min_confidence` are not among them: `doubtful` has those that may be cables. Joints are in
    m, in the camera's optical frame (x right, y down, z forward) or in the frame of the cloud, or in the base frame of `pose`; in
    2-D in px. If nothing is found, there are no chains, and `notes` say where the object was lost.

    Raises
    ------
    InputError : the data cannot be used; the message says what is wrong, where, and what to do. Or a point with True is on no
        chain; the message has the distance of the nearest one.
    ArgumentError (a TypeError) : an argument is of the wrong type.
    ConfigError : the settings cannot be used.
    """
    with options_of_python():
        choice = Choice.of(points, box)
    detection = pipeline.detect(data, config, mask, pose, choice is not None and choice.is_pointed)
    with options_of_python():
        return detection if choice is None else choice.applied(detection)


def keep(detection: Detection, chains: Sequence[int]) -> Detection:
    """Return a detection with some of its chains, and without the pixels of the others in the mask of its view.

    chains : their indices, ascending; of a branched object all or none.
    """
    if len(chains) == len(detection.chains):
        return detection
    place, view = {k: i for i, k in enumerate(chains)}, detection.view
    if view is not None and view.mask is not None:
        labels = detection.instance_labels()
        view = view.without((labels > 0) & ~np.isin(labels, np.add(chains, 1)))
    junctions, objects = kept_trees(detection.junctions, detection.objects, place)
    return replace(
        detection,
        chains=tuple(detection.chains[k] for k in chains),
        crossings=kept_crossings(detection.crossings, place),
        junctions=junctions,
        objects=objects,
        view=view and view.kept(chains),
    )


def _hits(strands: Sequence[ImageStrand], point: Point, reach: float, detection: Detection) -> set[int]:
    """Return which strands pass through a point: those that cover it, seen ones first, else the nearest within `reach`, px."""
    gaps = [np.linalg.norm(strand.points - point[:2], axis=1) - strand.radii for strand in strands]
    nearest = [float(gap.min(initial=np.inf)) for gap in gaps]
    seen = [float(gap[~strand.is_hidden].min(initial=np.inf)) for gap, strand in zip(gaps, strands, strict=True)]
    for distances in (seen, nearest):
        if covering := {k for k, distance in enumerate(distances) if distance <= 0}:
            return covering
    least = min(nearest, default=np.inf)
    if least <= reach:
        return {nearest.index(least)}
    if not point.is_wanted:
        return set()
    away = f"the nearest is {least:.0f} px away" if np.isfinite(least) else "; ".join(("none was found", *detection.notes))
    raise InputError(
        f"frame {detection.frame}: no chain passes through --points {_text(point)}, {away}: detect without points, and take "
        "pixels on the chains in the picture",
        code="place-missed",
    )


def _text(point: Point) -> str:
    return f"{point.x:g},{point.y:g}"


def _points(given: Points) -> tuple[Point, ...]:
    """Return points from text or from rows of numbers."""
    if isinstance(given, str):
        parts = [part.strip() for part in given.split(";")]
        pixels = [_numbers(part, "--points", (2,), "x,y or -x,y") for part in parts]
        return tuple(Point(x, y, not part.startswith("-")) for (x, y), part in zip(pixels, parts, strict=True))
    if isinstance(given, np.ndarray) and given.ndim:
        arguments.check_count(len(given), current_limits().max_points, "points", "rows")
        given = list(given)
    rows = arguments.each(given, object, "points")
    found = [_values(row, f"points[{number}]", (2, 3)) for number, row in enumerate(rows)]
    for number, row in enumerate(found):
        if row[2:] not in ([], [0.0], [1.0]):
            raise InputError(f"points[{number}] ends in {row[2]:g}, expected True or False", code="place-invalid")
    return tuple(Point(row[0], row[1], row[2:] != [0.0]) for row in found)


def _numbers(text: str, option: str, counts: tuple[int, ...], form: str) -> list[float]:
    """Return the numbers in a part of an option; a minus before a point is not part of its numbers."""
    try:
        return _values([float(value) for value in text.removeprefix("-" if 2 in counts else "").split(",")], option, counts)
    except (ValueError, InputError):
        raise InputError(f"{option}: {text[:40]!r} is invalid, expected {form}, in pixels", code="place-invalid") from None


def _values(given: Any, what: str, counts: tuple[int, ...]) -> list[float]:
    """Return an argument as finite numbers, of which there must be so many."""
    found = arguments.numbers(given, what, (None,), "place-invalid").tolist()
    if len(found) not in counts or not np.isfinite(found).all():
        expected = "x, y, True or False" if 2 in counts else "x0, y0, x1, y1"
        raise InputError(f"{what} is {str(found)[:40]}, expected {expected}, in pixels", code="place-invalid")
    return [float(value) for value in found]
