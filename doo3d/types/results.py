"""Define the results: chains with their connections, crossings, and the detection that contains them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..guard.limits import current_limits
from ..plugins import DRAWING
from . import arguments, tables
from .arrays import Array, Bools, Floats, set_sealed
from .display import DOUBTFUL_CONFIDENCE, Drawn, Rows, counted, doubtful_text, length_text, radius_text, tree_text
from .pose import Plane, as_pose
from .tree import Junction, LinearObject, kept_trees
from .view import HIDDEN, NO_DEPTH, OUTSIDE, SEEN, View

SCHEMA = "doo3d/detection/2"

DEPTH_WORDS = ("seen", "filled")
"""Words for a segment whose depth was measured, and for one whose depth was interpolated."""

COORDINATES = {
    "camera": "camera optical frame: x right, y down, z forward",
    "cloud": "the frame of the cloud as given",
    "image": "image: x right, y down",
    "world": "the world frame of the camera's poses",
}


DOUBTFUL_LENGTH_RADII = 60.0
"""Length in radii from which on an object below the threshold of confidence is kept as doubtful. An object 30 times as long as
wide is more often a cable than an edge, a finger or a tool, whatever other evidence says."""

MIN_DOUBTFUL_CONFIDENCE = 0.01
"""Least confidence of a doubtful object; with lower ones, four of five frames without a cable would have a doubtful object."""

MODES = ("3d", "2d")
MAX_ID = 2**63
"""Upper bound of ids, exclusive: those of other programs have 64 bits."""


class Connection(NamedTuple):
    """A place along a chain where merging joined two separate pieces.

    Attributes
    ----------
    segment
        index of the chain's segment at that place.
    confidence
        0 to 1, that the two pieces belong together: the increase of the total cost of all connections without this one, divided
        by the largest cost allowed for a connection (`merge.max_cost`). 0 if a solution without it would cost no more.
    """

    segment: int
    confidence: float


@dataclass(frozen=True, repr=False)
class Chain(Drawn):
    """One object as a chain: N cylinders of equal length (the segments), joined end to end by ball joints.

    Attributes
    ----------
    joints
        (N + 1, D) float64, m (px in 2-D), in the frame that `Detection.coordinates` names; neighbors are exactly `segment_length`
        apart.
    segment_length
        length of each segment, m (px in 2-D).
    radius
        radius of the whole chain, m (px in 2-D); NaN if unknown.
    radii
        (N + 1,) m (px in 2-D), radius at each joint, interpolated where it could not be measured. The value of `radius` if not
        given.
    occluded
        (N,) bool, True for a segment that was filled in, not seen. All False if not given.
    depth_filled
        (N,) bool, True for a segment without depth readings, whose depth was interpolated along the strand or over a gap. An
        occluded segment always counts as filled. The values of `occluded` if not given; meaningless in 2-D.
    from_time
        (N,) bool, True for an occluded segment that was filled in from other frames of a sequence. All False if not given.
    closed
        True for a ring, whose last joint repeats the first.
    connections
        the places where pieces were joined to this chain, in order along it.
    id
        number that identifies the object in all frames of a capture; None if frames were not tracked.
    confidence
        probability, 0 to 1, that the chain is right: one whole object and nothing else, in the right order and at the right
        place. If not given, the lowest of the connections' confidences; 1 without connections.
    deviations
        (N + 1, 2) m, standard deviation of each joint's distance from the true axis, across and along the ray from the sensor to
        the joint; the position along the chain is not part of it. If the chain is right, 90 % of the errors are within 1.645 of
        them. None if unknown, and in 2-D.

    Raises
    ------
    InputError : on construction, when shapes do not fit each other or joints are not `segment_length` apart.
    """

    joints: Floats
    segment_length: float
    radius: float = float("nan")
    radii: Floats = field(default_factory=lambda: np.zeros(0))
    occluded: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))
    depth_filled: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool), kw_only=True)
    from_time: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool), kw_only=True)
    closed: bool = False
    connections: tuple[Connection, ...] = ()
    id: int | None = None
    confidence: float = field(default=float("nan"), kw_only=True)
    deviations: Floats | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        joints = arguments.array(self.joints, "joints", "chain-shape")
        if joints.ndim != 2 or joints.shape[1] not in (2, 3) or len(joints) < 2 or joints.dtype.kind not in "biuf":
            raise InputError(
                f"joints have shape {joints.shape} and type {joints.dtype}, expected numbers (N + 1, 2 or 3) with N >= 1",
                code="chain-shape",
            )
        arguments.check_count(len(joints), current_limits().max_points, "joints", "rows")
        joints = joints.astype(float, copy=False)
        for name in ("segment_length", "radius", "confidence"):
            object.__setattr__(self, name, arguments.number(getattr(self, name), name))
        if not np.isfinite(joints).all():
            raise InputError("joints hold a number that is not finite", code="chain-shape")
        offsets = joints[1:] - joints[:-1]
        steps = np.sqrt((offsets * offsets).sum(axis=1))
        if not (np.abs(steps - self.segment_length) <= 1e-6 * self.segment_length).all():
            raise InputError(
                f"joints are {steps.min():.6g} to {steps.max():.6g} apart, expected {self.segment_length:.6g}",
                code="chain-spacing",
            )
        segments = len(joints) - 1
        radii = self._values("radii", np.full(len(joints), self.radius))
        occluded = self._values("occluded", np.zeros(segments, dtype=bool))
        filled = self._values("depth_filled", occluded)
        from_time = self._values("from_time", np.zeros(segments, dtype=bool))
        per_segment = {occluded.shape, filled.shape, from_time.shape}
        if radii.shape != (len(joints),) or per_segment != {(segments,)}:
            raise InputError(
                f"{len(joints)} joints, radii {radii.shape}, occluded {occluded.shape}, depth_filled {filled.shape}: "
                "expected (N + 1,), (N,) and (N,)",
                code="chain-shape",
            )
        if self.deviations is not None:
            set_sealed(self, deviations=arguments.numbers(self.deviations, "deviations", (segments + 1, 2), "chain-shape"))
        set_sealed(
            self, joints=joints, radii=radii, occluded=occluded, depth_filled=occluded | filled, from_time=from_time & occluded
        )
        object.__setattr__(self, "connections", arguments.each(self.connections, Connection, "connections"))
        object.__setattr__(self, "closed", arguments.flag(self.closed, "closed"))
        if self.id is not None:
            object.__setattr__(self, "id", arguments.whole(self.id, "id"))
            if abs(self.id) >= MAX_ID:
                raise InputError(f"id is {str(self.id)[:20]}..., expected less than {MAX_ID}", code="value-out-of-bounds")
        if math.isnan(self.confidence):
            least = min((connection.confidence for connection in self.connections), default=1.0)
            object.__setattr__(self, "confidence", least)
        arguments.probability(self.confidence, "confidence")

    def _values(self, name: str, default: Floats | Bools) -> Any:
        """Return an array attribute in the type of its default, or the default if it is empty."""
        given = arguments.array(getattr(self, name), name, "chain-shape")
        if given.size == 0:
            return default
        if given.ndim != 1 or len(given) > len(default) or given.dtype.kind not in "biuf":
            raise InputError(
                f"{name} has shape {given.shape} and type {given.dtype}, expected ({len(default)},)", code="chain-shape"
            )
        return given.astype(default.dtype, copy=False)

    @property
    def length(self) -> float:
        """The length of the chain, N * segment_length, m (px in 2-D)."""
        return (len(self.joints) - 1) * self.segment_length

    @property
    def is_doubtful(self) -> bool:
        """Whether the chain is more likely wrong than right, by its own confidence: below 0.5. Pictures draw it thin and gray."""
        return self.confidence < DOUBTFUL_CONFIDENCE

    @property
    def depth(self) -> tuple[str, ...]:
        """Whether the depth of each segment was measured: N words, "seen" or "filled"; see `depth_filled`. Empty in 2-D."""
        return tuple(DEPTH_WORDS[int(filled)] for filled in self.depth_filled) if self.joints.shape[1] == 3 else ()

    def at_joints(self, segments: Bools) -> Bools:
        """Return which joints are at the end of a chosen segment, (N + 1,) bool; segments : (N,) bool, the chosen ones."""
        before, after = (segments[-1], segments[0]) if self.closed else (False, False)
        return np.asarray(np.append(segments, after) | np.insert(segments, 0, before))

    def summary(self) -> str:
        """Return the facts of the chain in one short line, such as "108 segments, 1.080 m, radius 3.9 mm, confidence 0.97"."""
        planar = self.joints.shape[1] == 2
        facts = [
            *([] if self.id is None else [f"id {self.id}"]),
            counted(len(self.occluded), "segment"),
            length_text(self.length, planar),
            f"radius {radius_text(self.radius, planar)}",
            *([f"{self.occluded.mean():.0%} occluded"] if self.occluded.any() else []),
            *(["closed"] if self.closed else []),
            f"confidence {self.confidence:.2f}",
        ]
        return ", ".join(facts)

    def nodes(self, count: int) -> Floats:
        """Return evenly spaced points along the chain, first and last joint included.

        count : number of points, at least 2. Returns (count, D), m (px in 2-D).

        Raises
        ------
        InputError : count is below 2.
        """
        count = arguments.whole(count, "count")
        if count < 2:
            raise InputError(f"nodes({str(count)[:20]}): expected at least 2", code="value-out-of-bounds")
        arguments.check_count(count, current_limits().max_points, "a chain as points", "points")
        at = np.linspace(0, len(self.joints) - 1, count)
        index = np.minimum(at.astype(int), len(self.joints) - 2)
        part = (at - index)[:, None]
        return np.asarray(self.joints[index] * (1 - part) + self.joints[index + 1] * part)

    def to_dict(self) -> dict[str, Any]:
        """Return the chain as plain lists and numbers, ready for JSON.

        Keys: "id", "joints", "segment_length", "radius", "radii", "length", "occluded", "depth" ("seen" or "filled" for each
        segment; not in 2-D), "from_time" (if any segment is), "closed", "connections" (each {"segment", "confidence"}),
        "confidence" and "deviations" (if known). Lengths are in m (px in 2-D).
        """
        depth = {"depth": list(self.depth)} if self.joints.shape[1] == 3 else {}
        return {
            "id": self.id,
            "joints": self.joints.tolist(),
            "segment_length": self.segment_length,
            "radius": self.radius,
            "radii": self.radii.tolist(),
            "length": self.length,
            "occluded": self.occluded.tolist(),
            **depth,
            **({"from_time": self.from_time.tolist()} if self.from_time.any() else {}),
            "closed": self.closed,
            "connections": [connection._asdict() for connection in self.connections],
            "confidence": self.confidence,
            **({} if self.deviations is None else {"deviations": self.deviations.tolist()}),
        }


def _left_out_note(chains: Sequence[Chain], min_confidence: float) -> str:
    """Return the note about chains left out for their low confidence, which are not even doubtful."""
    planar = chains[0].joints.shape[1] == 2
    longest = max(chains, key=lambda chain: chain.length)
    size = f"{'the longest is ' if len(chains) > 1 else ''}{length_text(longest.length, planar)} long"
    return (
        f"output: left out {counted(len(chains), 'chain')} ({size}, confidence {longest.confidence:.2f}), below "
        f"output.min_confidence {min_confidence:g}; 0 gives all"
    )


class SegmentRef(NamedTuple):
    """Reference to one segment of one chain in a detection.

    Attributes
    ----------
    chain
        index of the chain in `Detection.chains`.
    segment
        index of the segment in that chain.
    """

    chain: int
    segment: int


@dataclass(frozen=True)
class Crossing:
    """A place where two strands (parts of one chain or of two) cross in the view.

    Attributes
    ----------
    upper
        the segment of the upper strand, which is nearer to the camera and hides the lower strand.
    lower
        the segment of the lower strand.
    point
        (D,) m (px in 2-D), the point on the upper strand's axis where the strands cross in the view.
    confidence
        0 to 1, that `upper` really is the upper one; 0 if neither depth nor color gives evidence.
    """

    upper: SegmentRef
    lower: SegmentRef
    point: Floats
    confidence: float = 1.0

    def __post_init__(self) -> None:
        set_sealed(self, point=np.asarray(self.point, dtype=float))

    def to_dict(self) -> dict[str, Any]:
        """Return the crossing as plain lists and numbers, ready for JSON.

        Keys: "upper" and "lower" (each {"chain", "segment"}), "point" in m (px in 2-D), and "confidence".
        """
        upper, lower = self.upper._asdict(), self.lower._asdict()
        return {"upper": upper, "lower": lower, "point": self.point.tolist(), "confidence": self.confidence}


def kept_crossings(crossings: Sequence[Crossing], place: Mapping[int, int]) -> tuple[Crossing, ...]:
    """Return the crossings whose two chains are kept; place : index of a kept chain in the detection -> its new index."""
    return tuple(
        replace(
            each,
            upper=each.upper._replace(chain=place[each.upper.chain]),
            lower=each.lower._replace(chain=place[each.lower.chain]),
        )
        for each in crossings
        if each.upper.chain in place and each.lower.chain in place
    )


@dataclass(frozen=True, repr=False)
class Detection(Drawn):
    """The objects found in one frame.

    Attributes
    ----------
    chains
        one chain per object, longest first.
    mode
        "3d" (lengths in m) or "2d" (lengths in px).
    coordinates
        the coordinate frame of the joints: "camera" (optical frame: x right, y down, z forward), "cloud" (the frame of the cloud
        as given), "image" (x right, y down) or "world" (the world frame of the camera's poses).
    frame
        name of the frame.
    timestamp
        time of the frame in s, as the capture gives it; None if it gives none.
    seconds
        run time of each stage: name of the stage -> s.
    notes
        messages to the user, one sentence each.
    crossings
        where strands cross in the view, ordered by the first of the two segments: by its chain, then by its index.
    plane
        the plane that the object lies on or above, such as a table, in the coordinates of the joints; None if none was found.
    pose
        (4, 4) m, pose of the camera in the coordinates of the joints, if those are not the camera's (or the cloud's) own:
        (p, 1) = pose @ (p_camera, 1). None otherwise.
    junctions
        where strands of one body meet; found with `merge.branches` only.
    objects
        the connected bodies, the one with the greatest length of chains first: trees of chains and junctions. Empty without
        `merge.branches`, where each chain is an object.
    doubtful
        chains that are probably clutter, but may be cables, longest first. Their confidence is below `output.min_confidence`, and
        they are at least 60 times as long as their radius, or the most probable ones of a frame without chains. Crossings,
        junctions and objects do not refer to them.
    view
        the image that the objects were found in: its size and camera, and the mask, which is not written to files. None for a
        cloud.
    """

    chains: tuple[Chain, ...]
    mode: str = "3d"
    coordinates: str = "camera"
    frame: str = "frame"
    timestamp: float | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    crossings: tuple[Crossing, ...] = ()
    plane: Plane | None = None
    pose: Floats | None = None
    junctions: tuple[Junction, ...] = ()
    objects: tuple[LinearObject, ...] = ()
    doubtful: tuple[Chain, ...] = ()
    view: View | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        kinds = {"chains": Chain, "doubtful": Chain, "crossings": Crossing, "junctions": Junction, "objects": LinearObject}
        for name, kind in (kinds | {"notes": str}).items():
            object.__setattr__(self, name, arguments.each(getattr(self, name), kind, name))
        object.__setattr__(self, "timestamp", arguments.timestamp(self.timestamp))
        arguments.text(self.frame, "frame")
        for name, choices in (("mode", MODES), ("coordinates", COORDINATES)):
            if arguments.text(getattr(self, name), name) not in choices:
                raise InputError(
                    f"{name} is {getattr(self, name)!r:.99}, expected one of {', '.join(choices)}", code="choice-unknown"
                )
        if not isinstance(self.seconds, dict) or not all(isinstance(stage, str) for stage in self.seconds):
            raise arguments.refused(self.seconds, "seconds", "a dictionary, name of the stage -> s")
        if not isinstance(self.plane, Plane | None):
            raise arguments.refused(self.plane, "plane", "a Plane, or None")
        if not isinstance(self.view, View | None):
            raise arguments.refused(self.view, "view", "the view of another detection, or None")
        if self.pose is not None:
            as_pose(self.pose)  # a rigid motion, which has an inverse
            set_sealed(self, pose=arguments.numbers(self.pose, "pose", (4, 4), "pose-invalid"))

    @property
    def confidence(self) -> float | None:
        """The confidence of the detection, 0 to 1: the lowest of its chains, doubtful ones included; None without any."""
        return min((chain.confidence for chain in (*self.chains, *self.doubtful)), default=None)

    def summary(self) -> str:
        """Return the facts of the detection in one short line: frame, number of chains and crossings, length, confidence.

        Doubtful chains are listed with their lengths and confidences. With `merge.branches`, the line also has the numbers of
        objects and junctions.
        """
        sizes = tree_text(len(self.objects), len(self.chains), len(self.junctions))
        planar, facts = self.mode == "2d", [repr(self.frame), sizes if self.objects else counted(len(self.chains), "chain")]
        if self.chains:
            facts.append(
                " + ".join(length_text(chain.length, planar) for chain in self.chains[:4]) + " + ..." * (len(self.chains) > 4)
            )
        if self.crossings:
            facts.append(counted(len(self.crossings), "crossing"))
        if self.doubtful:
            facts.append(doubtful_text([(chain.length, chain.confidence) for chain in self.doubtful], planar))
        return ", ".join([*facts, *([] if self.confidence is None else [f"confidence {self.confidence:.2f}"])])

    def table(self, rows: Rows = "chains") -> tables.Table:
        """Return the detection as a table: name of the column -> list of values, one per row, as pandas.DataFrame takes it.

        The first columns are always "frame" and "timestamp" (s, or None). Lengths are in m (px in 2-D, where there is no z).

        Parameters
        ----------
        rows
            the content of a row. "chains": chain
            (index), id, closed, segments (number), segment_length, length, radius, occluded and
            depth_filled (shares of the segments), confidence; with branched objects looked for, also object (index). "doubtful":
            the same of `doubtful`, whose object is None. "joints":
            chain, id, closed, segment_length, chain_radius, joint (index), x, y, z, radius (at the joint), occluded (bool, of
            the segment that starts there; None at the last joint), depth ("seen" or "filled", of the same segment; not in 2-D),
            from_time (bool, of the same segment), deviation_across and deviation_along (`Chain.deviations`, None if unknown; not
            in 2-D). "crossings": upper_chain, upper_segment, lower_chain, lower_segment, x, y, z,
            confidence. "junctions", a row per chain end that meets at one: junction (index), object, chain, end (0 first joint,
            1 last), radius (of the chain beside it), x, y, z, confidence.

        Raises
        ------
        InputError : `rows` is none of these.

        Examples
        --------
        >>> pandas.concat(pandas.DataFrame(detection.table()) for detection in detections)  # doctest: +SKIP
        """
        if not isinstance(rows, str) or rows not in tables.TABLES:
            raise InputError(f"table({rows!r:.99}): expected one of {', '.join(tables.TABLES)}", code="choice-unknown")
        return tables.TABLES[rows](self)

    def instance_labels(self) -> Array:
        """Return which chain each pixel of the image belongs to: (H, W) uint16, k + 1 for `chains[k]`, 0 for none.

        A pixel of the object, which is the mask that segmentation decided on, belongs to its nearest chain. At a crossing a pixel
        that the upper strand covers belongs to the upper strand. Where cables of distinct colors lie side by side, a pixel
        belongs to the nearest chain of its color. Pixels far from any chain, and those of doubtful chains, belong to none. Each
        chain of a branched object has its own label. The labels are of the camera's image, in whatever frame the joints are.

        Raises
        ------
        InputError : the detection is of a cloud, which has no image, or was read from a file without labels beside it.
        """
        return np.asarray(DRAWING["instances"](self))

    def visibility(self, chain: int) -> tuple[str, ...]:
        """Return for each of the N + 1 joints of a chain whether it is seen, in a word; chain : index of the chain.

        - "outside the view" : its position is not in the image; unknown for clouds.
        - "hidden" : both segments that meet there were filled in (`Chain.occluded`).
        - "no depth" : it is seen, and the depth of both segments was interpolated (`Chain.depth_filled`); not in 2-D.
        - "seen" : any other.

        Raises
        ------
        InputError : there is no such chain.
        """
        if not 0 <= (chain := arguments.whole(chain, "chain")) < len(self.chains):
            raise InputError(f"visibility({str(chain)[:20]}): there are {len(self.chains)} chains", code="value-out-of-bounds")
        shown = self.in_camera().chains[chain]
        outside = np.zeros(len(shown.joints), dtype=bool) if self.view is None else self.view.is_outside(shown.joints)
        seen, measured = shown.at_joints(~shown.occluded), shown.at_joints(~shown.depth_filled) | (self.mode == "2d")
        words = np.select([outside, ~seen, ~measured], [OUTSIDE, HIDDEN, NO_DEPTH], SEEN)
        return tuple(words.tolist())

    def confident(self, min_confidence: float) -> Detection:
        """Return the detection without the objects whose confidence is below a threshold.

        The confidence of an object is that of its most confident chain, so that either all or no chains of a branched object are
        kept. Crossings and junctions of removed objects are removed, too. Removed objects at least 60 times as long as their
        radius become `doubtful`, and so does the most confident one if no chain is left, unless its confidence is below 0.01. A
        note gives the number of the others.

        min_confidence : 0 to 1; 0 keeps all.

        Raises
        ------
        InputError : the threshold is not from 0 to 1.
        """
        min_confidence = arguments.probability(min_confidence, "min_confidence")
        bodies = [item.chains for item in self.objects] or [(k,) for k in range(len(self.chains))]

        def confidence_of(body: tuple[int, ...]) -> float:
            return max(self.chains[k].confidence for k in body)

        kept = sorted(k for body in bodies if confidence_of(body) >= min_confidence for k in body)
        if len(kept) == len(self.chains):
            return self
        low = [body for body in bodies if MIN_DOUBTFUL_CONFIDENCE <= confidence_of(body) < min_confidence]
        best = [max(low, key=confidence_of)] if low and not kept else []
        doubted = {k for body in low if body in best or self._is_long(body) for k in body}
        doubtful = (*self.doubtful, *(self.chains[k] for k in sorted(doubted)))
        rest = [chain for k, chain in enumerate(self.chains) if k not in doubted.union(kept)]
        notes = (*self.notes, *([_left_out_note(rest, min_confidence)] if rest else []))
        return self.kept(kept, doubtful=tuple(sorted(doubtful, key=lambda chain: -chain.length)), notes=notes)

    def kept(self, chains: Sequence[int], **changes: Any) -> Detection:
        """Return the detection with some of its chains, and the crossings, junctions and objects among them.

        Parameters
        ----------
        chains
            indices of the chains, ascending; either all or none of an object.
        changes
            attribute -> new value.
        """
        place = {k: i for i, k in enumerate(chains)}
        junctions, objects = kept_trees(self.junctions, self.objects, place)
        found, crossings = tuple(self.chains[k] for k in chains), kept_crossings(self.crossings, place)
        own = {"view": self.view and self.view.kept(chains)} | changes
        return replace(self, chains=found, crossings=crossings, junctions=junctions, objects=objects, **own)

    def _is_long(self, body: tuple[int, ...]) -> bool:
        """Return whether an object is at least DOUBTFUL_LENGTH_RADII long, in radii of its longest chain."""
        chains = [self.chains[k] for k in body]
        radius = max(chains, key=lambda chain: chain.length).radius
        return sum(chain.length for chain in chains) >= DOUBTFUL_LENGTH_RADII * radius

    def transformed(self, pose: Floats) -> Detection:
        """Return a copy of a 3-D detection after a rigid motion, such as from the camera's coordinates to a robot's base frame.

        Joints, junctions, points of crossings and the plane are transformed, `coordinates` becomes "world", and `pose` is the
        camera's pose there. Lengths, radii and all other values stay.

        pose : (4, 4) m, (p_new, 1) = pose @ (p, 1), with an orthonormal rotation, as `as_pose` makes it.

        Raises
        ------
        InputError : the detection is 2-D.
        """
        if self.mode == "2d":
            raise InputError(f"frame {self.frame} is 2-D, in pixels: a pose moves 3-D results", code="results-2d")
        pose = arguments.numbers(pose, "pose", (4, 4), "pose-invalid")
        rotation, translation = pose[:3, :3], pose[:3, 3]

        def moved(chains: tuple[Chain, ...]) -> tuple[Chain, ...]:
            return tuple(replace(chain, joints=chain.joints @ rotation.T + translation) for chain in chains)

        return replace(
            self,
            coordinates="world",
            chains=moved(self.chains),
            doubtful=moved(self.doubtful),
            crossings=tuple(replace(each, point=rotation @ each.point + translation) for each in self.crossings),
            junctions=tuple(replace(each, position=rotation @ each.position + translation) for each in self.junctions),
            plane=None if self.plane is None else self.plane.transformed(pose),
            pose=pose if self.pose is None else pose @ self.pose,
        )

    def in_camera(self) -> Detection:
        """Return the detection in the coordinates of its camera or cloud; unchanged if `pose` is None."""
        if self.pose is None:
            return self
        return replace(self.transformed(np.linalg.inv(self.pose)), coordinates="camera", pose=None)

    def to_dict(self) -> dict[str, Any]:
        """Return the detection as plain lists, strings and numbers, ready for JSON (schema doo3d/detection/2).

        Keys: "schema", "frame", "timestamp", "mode", "units" ("m" or "px"), "coordinates" (a description of the frame), "chains"
        and "doubtful" (`Chain.to_dict`), "crossings" (`Crossing.to_dict`), "plane" (`Plane.to_dict` or None), "pose" (4x4 or
        None), "image" (`View.to_dict`; not for clouds), "confidence" (None if nothing was found), "seconds" and "notes". With
        branched objects looked for, also "junctions" (`Junction.to_dict`) and "objects" (`LinearObject.to_dict`).
        """
        tree = {"junctions": [each.to_dict() for each in self.junctions], "objects": [each.to_dict() for each in self.objects]}
        return {
            "schema": SCHEMA,
            "frame": self.frame,
            "timestamp": self.timestamp,
            "mode": self.mode,
            "units": "m" if self.mode == "3d" else "px",
            "coordinates": COORDINATES[self.coordinates],
            "chains": [chain.to_dict() for chain in self.chains],
            "doubtful": [chain.to_dict() for chain in self.doubtful],
            "crossings": [crossing.to_dict() for crossing in self.crossings],
            **(tree if self.objects else {}),
            "plane": None if self.plane is None else self.plane.to_dict(),
            "pose": None if self.pose is None else self.pose.tolist(),
            **({} if self.view is None else {"image": self.view.to_dict()}),
            "confidence": self.confidence,
            "seconds": dict(self.seconds),
            "notes": list(self.notes),
        }
