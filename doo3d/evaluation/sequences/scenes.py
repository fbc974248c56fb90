"""Build sequences of scenes: a cable in motion, hands that pass in front of it, and losses of depth."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ...types import Floats
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, Solid, Truth, corners, cuboid
from ..scenes.studio import cable_color
from .motions import FRAME_RATE, MAX_ATTEMPTS, OWN_MOTIONS, Motion, Size, captured_motion, table_below

SKIN_COLORS = ((196, 148, 120), (120, 84, 66), (48, 49, 52))
"""Colors of hands and of a gripper, 8-bit RGB."""

HIDDEN_SHARE, HIDDEN_SECONDS = (0.10, 0.40), (0.3, 2.0)
"""Least and greatest fraction of a cable that a hand hides, and duration, s."""

PASSING_SECONDS = 0.2
"""Time in s in which a hand enters, and in which it leaves."""

MAX_LOST_FRAMES = 4
"""Greatest number of successive frames without any depth."""

EVENT_SECONDS = 2.0
"""Length of a sequence in s per passing hand, and per loss of depth."""

LEVELS = ("rough", "hard", "easy")
"""Levels of difficulty: faster, with hands as wide as half of the cable or at both of its ends, losses of depth, and bars of the
cable's color behind its ends; with passing hands and losses of depth; and without both."""

ROUGH_STRIDES, BOTH_ENDS_SHARE, ROUGH_HIDDEN = (1, 2), 0.5, (0.10, 0.50)
"""At the rough level: how many times as fast a motion is; how often two hands hide both ends at once instead of one that hides a
part; least and greatest fraction of the cable that they hide."""


@dataclass(frozen=True)
class Hand:
    """A solid that passes between the camera and a cable.

    start, end : first and last frame. middle : position of its middle, as a fraction of the cable's length. hidden : fraction of
    the cable's length that it hides. nearness : its distance from the camera as a fraction of the cable's. aside : unit vector
    (2,) in the image plane along which it enters and leaves. color : 8-bit RGB.
    """

    start: float
    end: float
    middle: float
    hidden: float
    nearness: float
    aside: Floats
    color: tuple[int, int, int]


@dataclass(frozen=True)
class Loss:
    """A loss of depth in frames start to end: over a part (from, to) of the cable's length, or in the whole image."""

    start: int
    end: int
    part: tuple[float, float] | None

    def holds(self, index: int) -> bool:
        """Return whether a frame index is within the loss."""
        return self.start <= index < self.end


@dataclass(frozen=True)
class Sequence:
    """A cable in motion, with the hands and the losses of depth that hide it.

    Attributes
    ----------
    name
        name of the motion and the seed.
    seed
        seeds the noise of the sensor.
    motion
        the cable, the camera and the table.
    hands
        the solids that pass in front of the cable.
    losses
        the losses of depth.
    color
        8-bit RGB of the cable.
    props
        solids that rest behind the cable.
    """

    name: str
    seed: int
    motion: Motion
    hands: tuple[Hand, ...]
    losses: tuple[Loss, ...]
    color: tuple[int, int, int]
    props: tuple[Solid, ...]

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.motion.axes)

    def scene(self, index: int) -> Scene:
        """Return the scene of a frame."""
        motion, axis = self.motion, self.motion.axes[index]
        length = float(np.linalg.norm(np.diff(axis, axis=0), axis=1).sum())
        shiny = tuple(
            (loss.part[0] * length, loss.part[1] * length) for loss in self.losses if loss.part is not None and loss.holds(index)
        )
        cable = Truth(axis, motion.radius, color=self.color, shiny=shiny)
        passing = (solid_of(hand, axis, index) for hand in self.hands)
        solids = (*(solid for solid in passing if solid is not None), *self.props)
        return Scene(f"{index:04d}", self.name, self.seed, motion.camera, (cable,), solids, motion.table, motion.light)

    def frame(self, index: int, sensor: str = "d435") -> Rendered:
        """Render a frame; the same arguments give the same frame."""
        return timed(self.scene(index), index, sensor, any(loss.part is None and loss.holds(index) for loss in self.losses))

    def frames(self, sensor: str = "d435") -> Iterator[Rendered]:
        """Render all frames, one after the other."""
        return (self.frame(index, sensor) for index in range(len(self)))


def timed(scene: Scene, index: int, sensor: str, without_depth: bool = False) -> Rendered:
    """Render a scene as a frame with the time of an index at 30 per second; `without_depth` removes all depth."""
    rendered = render(scene, sensor)
    depth = np.zeros_like(rendered.frame.depth) if without_depth else rendered.frame.depth
    return replace(rendered, frame=replace(rendered.frame, depth=depth, timestamp=index / FRAME_RATE))


def solid_of(hand: Hand, axis: Floats, index: int) -> Solid | None:
    """Return the solid of a hand in a frame; None if the hand is absent."""
    passing = PASSING_SECONDS * FRAME_RATE
    if not hand.start - passing < index < hand.end + passing:
        return None
    count = len(axis)
    low, high = (
        int(np.clip(share, 0, 1) * (count - 1)) for share in (hand.middle - hand.hidden / 2, hand.middle + hand.hidden / 2)
    )
    part = axis[low : high + 1] * hand.nearness
    middle = part.mean(axis=0)
    along = part[-1, :2] - part[0, :2]
    angle = float(np.arctan2(along[1], along[0]))
    turn = Rotation.from_euler("z", angle)
    local = turn.inv().apply(part - middle)
    size = np.append(np.ptp(local[:, :2], axis=0) + 0.03, 0.02)
    center = middle + turn.apply(np.append((local[:, :2].max(axis=0) + local[:, :2].min(axis=0)) / 2, 0.0))
    outside = max(hand.start - index, index - hand.end, 0.0) / passing
    center[:2] += hand.aside * outside * (np.hypot(*size[:2]) + 0.1)
    return cuboid(turn.apply(corners(size)) + center, hand.color)


def make_sequence(motion: str | Path, seed: int, size: Size = (640, 480), frames: int = 120, level: str = "hard") -> Sequence:
    """Return a sequence with known truth; the same arguments give the same sequence.

    Parameters
    ----------
    motion
        name of a motion (a key of OWN_MOTIONS), or the path of a file of motion capture.
    seed
        integer, 0 or more.
    size
        (width, height) px of the images.
    frames
        number of frames, 30 per second.
    level
        "hard": hands pass and depth is lost; "easy": neither; "rough": more of both, faster, and with look-alikes behind the
        ends.

    Raises
    ------
    InputError : the file cannot be read as motion capture.
    ValueError : there is no motion of this name, or none could be drawn.
    """
    if level not in LEVELS:
        raise ValueError(f"no level {level!r}: there are {', '.join(LEVELS)}")
    is_file = str(motion) not in OWN_MOTIONS
    name = Path(motion).stem if is_file else str(motion)
    rng = np.random.default_rng([zlib.crc32(name.encode()), seed])
    stride = int(rng.choice(ROUGH_STRIDES)) if level == "rough" else 1
    steps = stride * (frames - 1) + 1
    for _ in range(MAX_ATTEMPTS):
        drawn = captured_motion(Path(motion), rng, size, steps) if is_file else OWN_MOTIONS[str(motion)](rng, size, steps)
        if drawn is not None:
            break
    else:
        raise ValueError(f"no motion {name!r} of {frames} frames was found in {MAX_ATTEMPTS} draws")
    drawn = replace(drawn, axes=drawn.axes[::stride])
    if drawn.table is None and rng.random() < 0.7:
        drawn = replace(drawn, table=table_below(drawn, rng))
    events = max(1, round(frames / FRAME_RATE / EVENT_SECONDS)) if level != "easy" else 0
    slots = np.linspace(0.08 * frames, 0.97 * frames, events + 1)
    if level == "rough":
        hands = tuple(hand for start, end in pairwise(slots) for hand in _rough_hands(rng, float(start), float(end)))
    else:
        hands = tuple(_hand(rng, float(start), float(end)) for start, end in pairwise(slots))
    losses = tuple(_loss(rng, frames) for _ in range(events))
    color = cable_color(rng)
    props = tuple(_look_alike(rng, drawn, end, color) for end in (0, -1)) if level == "rough" else ()
    return Sequence(f"{name}-{seed}", seed, drawn, hands, losses, color, props)


def _rough_hands(rng: Generator, first: float, last: float) -> tuple[Hand, ...]:
    """Draw a hand that passes between two frames and hides up to half of the cable, or two that hide both of its ends."""
    hand = _hand(rng, first, last)
    hidden = rng.uniform(*ROUGH_HIDDEN)
    if rng.random() >= BOTH_ENDS_SHARE:
        return (replace(hand, hidden=hidden),)
    other = replace(hand, middle=1.0, hidden=hidden, nearness=rng.uniform(0.75, 0.92), aside=-hand.aside)
    return replace(hand, middle=0.0, hidden=hidden), other


def _look_alike(rng: Generator, motion: Motion, end: int, color: tuple[int, int, int]) -> Solid:
    """Return a bar of about the color of a cable behind the place where one of its ends is on average; end : 0 or -1."""
    place = np.mean([axis[end] for axis in motion.axes], axis=0) + np.append(rng.uniform(-0.05, 0.05, 2), 0.0)
    size = np.array([rng.uniform(0.05, 0.2), rng.uniform(0.01, 0.04), 0.01])
    turn = Rotation.from_euler("z", rng.uniform(0, np.pi))
    near = np.clip(np.array(color) + rng.integers(-25, 26, 3), 0, 255)
    behind = rng.uniform(1.02, 1.15) if motion.table is None else 1.01
    return cuboid((turn.apply(corners(size)) + place) * behind, (int(near[0]), int(near[1]), int(near[2])))


def _hand(rng: Generator, first: float, last: float) -> Hand:
    """Draw a hand that passes between two frames."""
    passing = 2 * PASSING_SECONDS * FRAME_RATE
    frames = min(rng.uniform(*HIDDEN_SECONDS) * FRAME_RATE, max(last - first - passing, 1.0))
    start = rng.uniform(first + passing / 2, max(last - passing / 2 - frames, first + passing / 2))
    turn = rng.uniform(0, 2 * np.pi)
    return Hand(
        start,
        start + frames,
        rng.uniform(0, 1),
        rng.uniform(*HIDDEN_SHARE),
        rng.uniform(0.75, 0.92),
        np.array([np.cos(turn), np.sin(turn)]),
        SKIN_COLORS[rng.integers(len(SKIN_COLORS))],
    )


def _loss(rng: Generator, frames: int) -> Loss:
    start = int(rng.uniform(0.1, 0.9) * frames)
    if rng.random() < 0.5:
        return Loss(start, start + int(rng.integers(1, MAX_LOST_FRAMES + 1)), None)
    share, first = rng.uniform(0.05, 0.15), rng.random() < 0.5
    return Loss(start, start + int(rng.uniform(0.2, 0.6) * FRAME_RATE), (0.0, share) if first else (1 - share, 1.0))
