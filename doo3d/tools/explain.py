"""Explain a frame: what each stage made and dropped, and the cost of each connection.

The explanation is derived from the records of the stages; no stage runs again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..config import Config, ConfigLike, as_config
from ..links import LinkCandidate, LinkDecision
from ..pipeline import Stages, run_stages
from ..segment.working_picture import enlarged_points
from ..types import Array, Chain, Cloud, Floats, Frame, Image
from .stage_accounts import Account, accounts_of

SCHEMA = "doo3d/explanation/1"


@dataclass(frozen=True)
class Choice:
    """Two chain ends that were connected or could have been, and the cost of their connection.

    Costs are in cost units, which the weights in section `merge` of the settings define: by default 1 per mm of distance (1 per
    px in 2-D) between the ends, and more for angles and for free space on the path between them.

    Attributes
    ----------
    ends
        names of the two ends, such as ("0 end", "3 start"): index of the chain after pruning, and which of its ends.
    points
        (2, D) m (px in 2-D), positions of the two ends.
    cost
        sum of `terms`; connections above `merge.max_cost` are not made, unless `merge.chains` forces them.
    terms
        name of the term -> cost, such as "distance", "direction", "curvature", "free space", "unknown", "bare surface".
    """

    ends: tuple[str, str]
    points: Floats
    cost: float
    terms: dict[str, float]

    @staticmethod
    def of(candidate: LinkCandidate, scale: int = 1) -> Choice:
        """Return the Choice for two ends that the merge stage considered.

        candidate : the merge stage's record of the two ends. scale : that of the stages. The terms "free space", "unknown" and
        "bare surface", the costs of the path across the gap, come last in `terms`.
        """
        gap = candidate.gap_cost
        terms = {**candidate.terms, "free space": gap.free_space, "unknown": gap.unknown, "bare surface": gap.bare}
        first, second = candidate.ends
        return Choice((str(first), str(second)), enlarged_points(candidate.points, scale), sum(terms.values()), terms)

    def to_dict(self) -> dict[str, Any]:
        """Return {"ends", "points", "cost", "terms"} (the attributes) as plain values for JSON."""
        return {"ends": list(self.ends), "points": self.points.tolist(), "cost": self.cost, "terms": self.terms}


@dataclass(frozen=True)
class Merge:
    """One connection that merging made.

    Attributes
    ----------
    chosen
        the two ends that were connected.
    runner_up
        the cheapest alternative: another connection of one of these two ends; None if no other connection was allowed.
    confidence
        0 to 1, from how much the total cost of all connections would rise without this one; 0 if it would not rise.
    kept
        True if the connection is in a chain of the result, False if that chain was dropped.
    """

    chosen: Choice
    runner_up: Choice | None
    confidence: float
    kept: bool = True

    @staticmethod
    def of(decision: LinkDecision, stages: Stages) -> Merge:
        """Return the Merge for one connection that the merge stage made.

        decision : the merge stage's record of the connection. stages : the products of all stages.
        """
        runner_up = Choice.of(decision.runner_up, stages.observed.scale) if decision.runner_up else None
        place = decision.chosen.points.mean(axis=0)
        kept = decision.kept and _distance(place, stages.chains) <= _distance(place, stages.verdict.unchosen)
        return Merge(Choice.of(decision.chosen, stages.observed.scale), runner_up, decision.confidence, kept)

    def to_dict(self) -> dict[str, Any]:
        """Return {"chosen", "runner_up", "confidence", "kept"} (the attributes) as plain values for JSON.

        "runner_up" is None if there is no alternative.
        """
        runner_up = self.runner_up.to_dict() if self.runner_up else None
        return {"chosen": self.chosen.to_dict(), "runner_up": runner_up, "confidence": self.confidence, "kept": self.kept}


@dataclass(frozen=True)
class Explanation:
    """The explanation of the chains of one frame.

    Attributes
    ----------
    accounts
        what each stage made and dropped, in the order of the stages.
    merges
        the connections that merging made, the cheapest first.
    pruned
        (S, 2, D) m (px in 2-D), first and last joint of each of the S segments that pruning removed.
    """

    accounts: tuple[Account, ...]
    merges: tuple[Merge, ...]
    pruned: Floats

    def to_dict(self) -> dict[str, Any]:
        """Return the explanation as plain values for JSON.

        Keys are "schema" ("doo3d/explanation/1"), "stages" (the accounts), "merges" and "pruned" (lists of joints).
        """
        return {
            "schema": SCHEMA,
            "stages": [account.to_dict() for account in self.accounts],
            "merges": [merge.to_dict() for merge in self.merges],
            "pruned": self.pruned.tolist(),
        }


def explain(data: Frame | Cloud | Image | Array, config: ConfigLike | None = None, mask: Array | None = None) -> Explanation:
    """Run the detection in one frame, and return an explanation of its stages and connections.

    Parameters
    ----------
    data
        a Frame or a Cloud. With a config whose `mode` is 2d: an Image, an array (H, W, 3) uint8 RGB, or a Frame with color.
    config
        settings of the detection, as `doo3d.detect` takes them; None for the preset "default".
    mask
        the caller's own segmentation, True on the object: (H, W) bool for a Frame or an image, (N,) bool for a Cloud made of N
        points, counting those with NaN. None segments as the config says.

    Returns
    -------
    What each stage made and dropped, in words; for each connection of two chain ends, its cost and that of the best alternative;
    and the segments that pruning removed.

    Raises
    ------
    InputError : the data cannot be used.
    """
    config = as_config(config)
    return explain_stages(run_stages(data, config, mask), config)


def explain_stages(stages: Stages, config: Config) -> Explanation:
    """Return the explanation of a frame whose stages have run already.

    stages : the products of all stages. config : the configuration that the stages were run with.
    """
    merges = tuple(Merge.of(decision, stages) for decision in stages.merged.decisions)
    return Explanation(accounts_of(stages, config), merges, enlarged_points(stages.pruned.removed, stages.observed.scale))


def _distance(place: Floats, chains: Sequence[Chain]) -> float:
    """Return the distance from a point (D,) to the nearest joint of any chain, m (px in 2-D); infinite without chains."""
    return min((float(np.linalg.norm(chain.joints - place, axis=1).min()) for chain in chains), default=np.inf)
