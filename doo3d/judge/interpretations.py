"""Interpret an uncertain frame in several ways, and keep the most probable interpretation.

Early stages decide without knowing the result: coarse voxels can merge two strands, and an end cut back far from a junction can
point to the wrong continuation. Only the finished chains show how well they explain the data. So the stages run again with other
voxel sizes, clearances and costs of free space where the first result is uncertain, and the log-odds of the chains decide.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple, Protocol, TypeVar

from scipy.special import logit

from ..config import Config
from ..errors import InputError
from ..scene.scene import Scene
from ..types import Chain
from .evidence import Evidence
from .verdict import CERTAIN, Verdict


class Interpretation(NamedTuple):
    """One way to interpret a frame: factors of the values that the stages use otherwise.

    Attributes
    ----------
    voxel
        factor of the edge of a voxel in radii.
    clearance
        factor of the distance from other branches up to which paths are cut back at junctions.
    free_space
        factor of `merge.free_space_weight`.
    """

    voxel: float = 1
    clearance: float = 1
    free_space: float = 1

    def applied(self, config: Config) -> Config:
        """Return the settings with the factor of the cost of free space."""
        if self.free_space == 1:
            return config
        weight = self.free_space * config.merge.free_space_weight
        return config.model_copy(update={"merge": config.merge.model_copy(update={"free_space_weight": weight})})


USUAL = Interpretation()
"""The interpretation that every frame gets first."""

OTHERS = (Interpretation(voxel=0.5, clearance=0.5), Interpretation(clearance=0.5, free_space=0.25))
"""The interpretations of an uncertain frame beside the usual one. Of 50 changes of settings these two together made most frames
right, and hardly one wrong, in scenes of all families and in tough ones: `doo3d evaluate ablations` has the row."""

MAX_UNCERTAIN_PIECES = 100
"""Maximum number of pieces of a frame that is interpreted in other ways, which bounds the time: an object has up to 50."""

NOTE = "merge: the object falls into {} pieces, so it is interpreted in one way only; others are tried up to {}"


class Interpreted(Protocol):
    """A frame interpreted in one way."""

    @property
    def verdict(self) -> Verdict: ...

    @property
    def scene(self) -> Scene: ...

    @property
    def pieces(self) -> int: ...

    @property
    def is_refused(self) -> bool: ...


T = TypeVar("T", bound=Interpreted)


def interpret(walk: Callable[[Interpretation], T]) -> tuple[T, Verdict, tuple[str, ...]]:
    """Interpret a frame, in other ways too if it is uncertain, and return the most probable interpretation.

    Where a wanted number of chains was refused, since the camera sees no object between their ends, no interpretation is looked
    for that joins them nevertheless.

    Parameters
    ----------
    walk
        the stages from voxelization on, interpreted in one way.

    Returns
    -------
    best : the most probable interpretation.
    verdict : its verdict, with the evidence of its rivals.
    notes : messages to the user: that there were too many pieces to try others.
    """
    usual = walk(USUAL)
    verdict, config = usual.verdict, usual.scene.config
    others = () if usual.is_refused else other_interpretations(verdict.chains, verdict.evidence, usual.scene)
    if not others:
        return usual, verdict, ()
    if usual.pieces > MAX_UNCERTAIN_PIECES:
        return usual, verdict, (NOTE.format(usual.pieces, MAX_UNCERTAIN_PIECES),)
    found = [usual]
    for other in others:
        try:
            found.append(walk(other))
        except InputError:  # there are too many of the finer voxels
            continue
    best, evidence = most_probable([each.verdict.evidence for each in found], config)
    return found[best], found[best].verdict.with_evidence(evidence), ()


def other_interpretations(chains: Sequence[Chain], evidence: Sequence[Evidence], scene: Scene) -> tuple[Interpretation, ...]:
    """Return the further interpretations to try; none unless the frame is uncertain.

    They are tried only where the object is given and all connections are decided together: the weights of the evidence were
    fitted to such frames.

    Parameters
    ----------
    chains
        the chains of the usual interpretation, with their confidence.
    evidence
        the evidence against each of them.
    scene
        what was captured, with the settings.
    """
    if min(map(attrgetter("confidence"), chains), default=1.0) >= CERTAIN:
        return ()
    config = scene.config
    if not scene.may_be_reinterpreted or config.merge.strategy == "greedy" or config.merge.branches:
        return ()
    if config.voxelize.split_at_depth_step:  # in piles of tubes the evidence does not tell: 44 of 87 are right, 39 with a choice
        return ()
    return OTHERS if _log_odds(evidence, config) < logit(CERTAIN) else ()


def most_probable(interpretations: Sequence[Sequence[Evidence]], config: Config) -> tuple[int, list[Evidence]]:
    """Return the interpretation of a frame with the highest log-odds, and its evidence with that of its rivals.

    The log-odds of a frame are those of its least probable chain. The evidence `rivals` is the difference between the best
    log-odds and the mean over all interpretations.

    Parameters
    ----------
    interpretations
        the evidence against each chain of each interpretation, the usual one first. Interpretations without chains are skipped,
        and those that leave more of the mask unclaimed than the usual one: chains are smooth where a part is left out.
    config
        the settings: small fragments below `output.min_confidence` do not count.

    Returns
    -------
    The index of the interpretation, of equal ones the first, and the evidence against each of its chains.
    """
    most = interpretations[0][0].unclaimed
    possible = (number for number, evidence in enumerate(interpretations) if evidence and evidence[0].unclaimed <= most)
    odds = {number: _log_odds(interpretations[number], config) for number in possible}
    best = max(odds, key=odds.__getitem__)
    rivals = odds[best] - sum(odds.values()) / len(odds)
    return best, [replace(each, rivals=rivals) for each in interpretations[best]]


def _log_odds(evidence: Sequence[Evidence], config: Config) -> float:
    """Return the log-odds of the least probable chain, except improbable small fragments; infinite without any."""
    least = config.output.min_confidence
    return min((each.log_odds for each in evidence if not each.small_fragment or each.confidence >= least), default=math.inf)
