"""Export the motion of a whole capture as keyframes of one MuJoCo model."""

import itertools
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..errors import DooWarning, InputError
from ..types import Chain, Detection, Floats
from .base import ChainBodies, times
from .link_frames import link_frames, relative_rotations
from .mjcf import HINGES, MAX_NESTED_BODIES, Mjcf
from .motion import same_chain
from .trees import Grown, grown
from .xml import tag

MAX_LENGTH_ERROR = 1e-6  # relative: chains of a sequence have one length in all frames, to rounding


class MjcfMotion(Mjcf):
    """Export format MJCF for a whole capture: one model, and a keyframe with the positions of all joints for every frame."""

    summary: ClassVar[str] = "MuJoCo: one model of the capture, a keyframe per frame"
    file_per: ClassVar[Any] = "capture"

    fixed: Literal["none"] = Field("none", description="all ends are free, as keyframes move them")
    rate: float = Field(30.0, gt=0, description="frames/s, for captures without timestamps")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the frame with the most chains as an MJCF model (XML), in m, with a keyframe for each frame that has them all.

        The chains of a branched object are separate trees of bodies, which a `connect` holds together at each junction, so that a
        keyframe can put every joint at its detected position. A keyframe has the name of the frame, the time since the first
        keyframe in s, and the model's `qpos`. Frames that lack a chain, or have it with another number or length of segments,
        have no keyframe, with a warning.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set, the option `ground` is set and gravity is zero,
            or two frames have the same name.
        """
        model = max(frames, key=lambda frame: (len(frame.chains), len(frame.junctions)), default=Detection(()))
        shown = [(frame, time) for frame, time in zip(frames, times(frames, self.rate), strict=True) if _has_all(frame, model)]
        _check(frames, [frame for frame, _ in shown], model)
        scene = self._scene([_only(frame, model) for frame, _ in shown] or [model])
        shown = list(zip(scene.frames, (time for _, time in shown), strict=False))
        *lines, end = self._lines(scene)
        text = itertools.chain(lines, ["<keyframe>"] if shown else [], self._keys(shown), ["</keyframe>"] if shown else [], [end])
        path.write_text("\n".join(text) + "\n", encoding="utf-8")

    def _tree(self, detection: Detection) -> Grown:
        """Return the chains unchanged, each with its own root."""
        junctions = tuple(junction.ends for junction in detection.junctions)
        alone = grown(replace(detection, junctions=(), objects=()))
        return replace(alone, junctions=junctions)

    def _ties(self, chains: list[ChainBodies], tree: Grown) -> Iterator[str]:
        """Yield the constraints that hold chains together at junctions, placed at the end of the first chain of each."""
        for number, (first, *others) in enumerate(tree.junctions):
            anchor = (0, 0, first.end * chains[first.chain].chain.segment_length)
            for other in others:
                bodies = [chains[end.chain].body(end.end * (len(chains[end.chain].chain.occluded) - 1)) for end in (first, other)]
                name = f"junction{number}_{chains[other.chain].name}"
                yield tag("connect", name=name, body1=bodies[0], body2=bodies[1], anchor=anchor, **self._stiff())

    def _keys(self, shown: Sequence[tuple[Detection, float]]) -> Iterator[str]:
        """Yield a keyframe for each frame with its time in s; all frames have the chains of the first, which is the model's."""
        rest: list[Floats] = []
        before: list[Floats] = []
        for frame, time in shown:
            chains = [bodies.chain for bodies in self.bodies_of(frame)]
            start = [np.eye(3)] * len(chains) if not before else [links[0] for links in before]  # no twist from frame to frame
            links = [link_frames(chain.joints, first) for chain, first in zip(chains, start, strict=True)]
            rest = rest or links
            has_hinges = self.is_straight(self.bending)
            triples = zip((chain.joints for chain in chains), links, rest, strict=True)
            qpos = [_qpos(*triple, has_hinges) for triple in triples]
            yield tag("key", name=frame.frame, time=time - shown[0][1], qpos=np.concatenate([np.zeros(0), *qpos]))
            before = links


def _qpos(joints: Floats, links: Floats, rest: Floats, has_hinges: bool) -> Floats:
    """Return the part of `qpos` of one chain: position and quaternion of a tree's first body, turns of the others.

    Parameters
    ----------
    joints
        (N + 1, 3) m.
    links
        (N, 3, 3) orientation of each segment.
    rest
        (N, 3, 3) orientation of each segment in the model, where all joints are at zero.
    has_hinges
        whether a turn is the angles of three hinges instead of a quaternion.
    """
    turns = relative_rotations(rest).inv() * relative_rotations(links)
    values = turns.as_euler(HINGES) if has_hinges else np.roll(turns.as_quat(canonical=True), 1, axis=1)  # MuJoCo: w first
    parts = []
    for k, turn in enumerate(values):
        if k % MAX_NESTED_BODIES == 0:
            parts += [joints[k], np.roll(relative_rotations(links[k : k + 1]).as_quat(canonical=True)[0], 1)]  # MuJoCo: w first
        else:
            parts.append(turn)
    return np.concatenate(parts)


def _same(chain: Chain, frame: Detection, model: Detection) -> Chain | None:
    """Return the chain of a frame that matches a chain of the model, with equal segments; None if there is none."""
    other = chain if frame is model else same_chain(chain, model, frame)
    is_as_long = other is not None and abs(other.segment_length / chain.segment_length - 1) <= MAX_LENGTH_ERROR
    return other if is_as_long else None


def _has_all(frame: Detection, model: Detection) -> bool:
    return all(_same(chain, frame, model) is not None for chain in model.chains)


def _only(frame: Detection, model: Detection) -> Detection:
    """Return a frame with only the chains of the model, in the order of the model."""
    chains = tuple(same for chain in model.chains if (same := _same(chain, frame, model)) is not None)
    kept = replace(frame, chains=chains, crossings=(), junctions=(), objects=())
    return replace(kept, junctions=model.junctions) if len(chains) == len(model.chains) else kept


def _check(frames: Sequence[Detection], shown: Sequence[Detection], model: Detection) -> None:
    if len({frame.frame for frame in shown}) < len(shown):
        raise InputError("several frames have the same name, which keyframes cannot", code="frame-names-clash")
    if len(shown) < len(frames):
        warnings.warn(
            f"{len(frames) - len(shown)} of {len(frames)} frames have no keyframe: not all chains of frame {model.frame} are in "
            "them with as many segments of the same length, as they are in the results of doo3d detect --sequence",
            DooWarning,
            stacklevel=2,
        )
