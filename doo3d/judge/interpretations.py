"""Keep the most probable interpretation of an uncertain frame, and the most probable chains where a number of them is wanted.

Much is settled before anything tells whether it was right: in coarse voxels two strands are one, and an end cut far back at a
junction points elsewhere. Only of the whole is it known how well the chains explain what was seen. So an uncertain frame is
interpreted in other ways too, and the log odds of the chains decide.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

from scipy.special import logit

from ..config import Config
from ..scene.scene import Scene
from ..types import Chain
from .evidence import Evidence


class Interpretation(NamedTuple):
    """How a frame is interpreted: factors of what the stages use otherwise.

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


USUAL = Interpretation()
"""The interpretation of every frame."""

OTHERS = (Interpretation(voxel=0.5, clearance=0.5), Interpretation(clearance=0.5, free_space=0.25))
"""The interpretations of an uncertain frame beside the usual one. Of 50 changes of settings these two together made most frames
right, and hardly one wrong, in scenes of all families and in tough ones: `doo3d evaluate ablations` has the row."""

CERTAIN = 0.7
"""Confidence of a frame from which on the usual one is enough: between this and 0.85 others made one of 396 frames right."""


def other_interpretations(chains: Sequence[Chain], evidence: Sequence[Evidence], scene: Scene) -> tuple[Interpretation, ...]:
    """Return the other interpretations that a frame needs; none unless it is uncertain.

    Only frames need them whose object somebody told, and whose connections are decided together: for these the evidence was
    weighed.

    Parameters
    ----------
    chains
        the chains of the usual interpretation, with their confidence.
    evidence
        what speaks against each of them.
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
    """Return which interpretation of a frame has the highest log odds, with what the others say against it.

    The log odds of a frame are those of its least probable chain. The others speak against the best interpretation by as much as
    the mean of all is lower.

    Parameters
    ----------
    interpretations
        what speaks against each chain, of each interpretation, the usual one first. Those without chains are passed over,
        and those that leave more of the mask unclaimed than the usual one: chains are easily smooth where a part is left out.
    config
        the settings: strays below `output.min_confidence` do not count.

    Returns
    -------
    The number of the interpretation, of equal ones the first, and what speaks against each of its chains.
    """
    most = interpretations[0][0].unclaimed
    possible = (number for number, evidence in enumerate(interpretations) if evidence and evidence[0].unclaimed <= most)
    odds = {number: _log_odds(interpretations[number], config) for number in possible}
    best = max(odds, key=odds.__getitem__)
    rivals = odds[best] - sum(odds.values()) / len(odds)
    return best, [replace(each, rivals=rivals) for each in interpretations[best]]


def most_probable_chains(chains: Sequence[Chain], count: int) -> list[int]:
    """Return the indices of the most probable chains, in ascending order; of those at CERTAIN (0.7) or above, the longest.

    There, differences in confidence are noise, and a long piece of the object is worth more than a short one.

    chains : the chains of one frame. count : number of chains wanted; all are returned if there are fewer.
    """
    order = sorted(range(len(chains)), key=lambda k: (-min(chains[k].confidence, CERTAIN), -chains[k].length))
    return sorted(order[:count])


def _log_odds(evidence: Sequence[Evidence], config: Config) -> float:
    """Return the log odds of the least probable chain, improbable strays aside; infinite without any."""
    least = config.output.min_confidence
    return min((each.log_odds for each in evidence if not each.stray or each.confidence >= least), default=math.inf)
