"""Choose chains by pointing: points on strands or beside them, and a box, in pixels of the image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .. import pipeline
from ..config import ConfigLike
from ..errors import InputError, options_of_python
from ..types import Array, Cloud, Detection, Frame, Image, View, arguments
from ..types.conversions import FrameReference
from ..viz.instance_labels import ImageStrand, image_strands

CLICK_SHARE = 0.005
"""Distance beside a strand at which a point still chooses it, as a share of the image's longer side, as larger images are shown
smaller: 3 px of 640, about as well as a hand clicks."""


@dataclass(frozen=True)
class Choice:
    """What the user points at in an image, px, as plain lists, since the manifest of a run holds it.

    Attributes
    ----------
    wanted, unwanted
        pixels (x, y). Chains through wanted ones are kept, or all if there are none; those through unwanted ones are not.
    box
        left, top, right and bottom: only chains that are mostly inside are kept. Empty for the whole image.
    """

    wanted: list[list[float]]
    unwanted: list[list[float]]
    box: list[float]

    @staticmethod
    def of(points: str | ArrayLike | None, box: str | ArrayLike | None) -> Choice | None:
        """Return the choice as given in the shell, as text, or in Python; None if there is none.

        Raises
        ------
        InputError : a point or the box is invalid; the message quotes it.
        """
        rows: list[list[float]] = []
        if isinstance(points, str):
            parts = [part.strip() for part in points.split(";")]
            rows = [[*_numbers("--points", part, part.removeprefix("-"), 2), not part.startswith("-")] for part in parts]
        elif points is not None and not (isinstance(points, list | tuple) and not points):
            rows = arguments.numbers(points, "points", (None, 3), "place-invalid").tolist()
        if wrong := {row[2] for row in rows} - {0, 1}:
            raise InputError(f"points: {wrong.pop():g} is neither True nor False", code="place-invalid")
        given = _numbers("--box", box, box, 4) if isinstance(box, str) else box
        corners = np.zeros(0) if given is None else arguments.numbers(given, "box", (4,), "place-invalid")
        sides = np.sort(corners.reshape(-1, 2), axis=0).ravel().tolist()
        wanted, unwanted = ([row[:2] for row in rows if row[2] == kind] for kind in (True, False))
        return Choice(wanted, unwanted, sides) if rows or sides else None

    def applied(self, detection: Detection) -> Detection:
        """Return a detection with the chosen chains only; all chains of a branched object are chosen if one is.

        Raises
        ------
        InputError : the detection has no image, a point or the box is outside of it, or no chosen chain is at a wanted point.
        """
        view, name, count = detection.view, f"frame {detection.frame}", len(detection.chains)
        if view is None:
            raise InputError(f"{name} is a cloud, and --points and --box are pixels: leave them out", code="place-needs-image")
        self._check_inside(view)
        everything = replace(detection, chains=(*detection.chains, *detection.doubtful), doubtful=())
        strands, reach = image_strands(everything.in_camera()), CLICK_SHARE * max(view.width, view.height)
        pointed = [_hits(strands, point, reach) for point in self.wanted]
        removed = {k for point in self.unwanted for k in _hits(strands, point, reach)[0]}
        bodies = [*bodies_of(detection), *({k} for k in range(count, len(strands)))]
        bodies = [body for body in bodies if not body & removed and (not pointed or any(body & hits for hits, _ in pointed))]
        kept = sorted(k for body in bodies if self._holds([strands[k] for k in body], view) for k in body)
        for point, (hits, gap) in zip(self.wanted, pointed, strict=True):
            if not hits.intersection(kept):
                nearest = f"the nearest is {gap:.0f} px away" if strands else "; ".join(("none was found", *detection.notes))
                why = "the chain there is excluded by --box or by a minus" if hits else f"no chain passes there, {nearest}"
                raise InputError(f"{name}, --points {_text(point)}: {why}; point at drawn chains", code="place-missed")
        shown = len(kept) if pointed else sum(k < count for k in kept)
        notes = () if kept or not self.box else (f"box: no chain has more than half of its length in {_text(self.box)}",)
        result = keep(everything, kept)
        return replace(result, chains=result.chains[:shown], doubtful=result.chains[shown:], notes=(*result.notes, *notes))

    def _check_inside(self, view: View) -> None:
        """Raise InputError if a point is not in the image, or the box does not overlap it."""
        right, bottom = view.width - 0.5, view.height - 0.5
        for place in (*self.wanted, *self.unwanted, *([self.box] if self.box else [])):
            if not (place[0] < right and place[1] < bottom and min(place[-2:]) >= -0.5):
                where = f"{'--box' if place is self.box else '--points'} {_text(place)}"
                raise InputError(f"{where} is outside the image of {view.width} x {view.height} pixels", code="place-outside")

    def _holds(self, strands: Sequence[ImageStrand], view: View) -> bool:
        """Return whether the box holds more than half of the visible length of an object; True without a box."""
        if not self.box:
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
    points: str | ArrayLike | None = None,
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
    if points is None and box is None:
        return pipeline.detect(data, config, mask, pose)
    with options_of_python():
        choice = Choice.of(points, box)
    detection = pipeline.detect(data, config, mask, pose, choice is not None and bool(choice.wanted))
    with options_of_python():
        return detection if choice is None else choice.applied(detection)


def bodies_of(detection: Detection) -> list[set[int]]:
    """Return the chains of each object: indices in `detection.chains`."""
    return [{*item.chains} for item in detection.objects] or [{k} for k in range(len(detection.chains))]


def keep(detection: Detection, chains: Sequence[int]) -> Detection:
    """Return `detection.kept(chains)`, without the pixels of the other chains in the mask of the view."""
    if len(chains) == len(detection.chains):
        return detection
    kept = detection.kept(chains)
    if kept.view is None or kept.view.mask is None:
        return kept
    labels = detection.instance_labels()
    return replace(kept, view=kept.view.without((labels > 0) & ~np.isin(labels, np.add(chains, 1))))


def _hits(strands: Sequence[ImageStrand], point: Sequence[float], reach: float) -> tuple[set[int], float]:
    """Return which strands pass through a point, and the distance of the nearest one, px.

    The strands that cover it, seen ones before hidden ones, or else the nearest if it is within `reach` px.
    """
    gaps = [np.linalg.norm(strand.points - point, axis=1) - strand.radii for strand in strands]
    nearest = [float(gap.min(initial=np.inf)) for gap in gaps]
    seen = [float(gap[~strand.is_hidden].min(initial=np.inf)) for gap, strand in zip(gaps, strands, strict=True)]
    least = min(nearest, default=np.inf)
    limits = (seen, 0.0), (nearest, 0.0), (nearest, least if least <= reach else -np.inf)
    found = ({k for k, distance in enumerate(distances) if distance <= limit} for distances, limit in limits)
    return next(filter(None, found), set()), least


def _text(numbers: Sequence[float]) -> str:
    return ",".join(f"{value:g}" for value in numbers)


def _numbers(option: str, part: str, text: str, count: int) -> list[float]:
    """Return the numbers in a part of an option; text : the part without what is not a number."""
    try:
        found = [float(value) for value in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        form = "x,y or -x,y" if count == 2 else "x0,y0,x1,y1"
        raise InputError(f"{option}: {part[:40]!r} is invalid, expected {form} in pixels", code="place-invalid")
    return found
