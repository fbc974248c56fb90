"""The confidence of chains: the odds that a frame is right, from every kind of evidence against it.

Each doubtful decision multiplies the odds by a factor below 1, so that the logarithm of the odds is a sum: a constant for a frame
without doubt, less a weight times the amount of each kind of evidence (logistic regression). The weights were fitted to chains in
real photographs and captures of many sources, and in rendered scenes; docs/pages/accuracy.md says how the confidence holds on
sources that a fit did not see.
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.special import expit

GIVEN = {
    "base": 8.34,
    "joins": 1.41,
    "unsupported": 4.64,
    "residual": 1.70,
    "bend": 1.66,
    "unclaimed": 0.50,
    "dropped": 6.89,
    "mask_ahead": 1.96,
    "stubby": 1.73,
    "uneven": 3.32,
    "rivals": 1.00,
}
"""Logarithm of the odds that a chain without any evidence against it is right, and what a unit of each kind of evidence takes
from it, where the object is given, by a mask or a color: fitted by docs/fit_confidence.py; of `rivals` 1, with which the log odds
are the mean over all interpretations."""

AUTO = {
    "base": 8.15,
    "unsupported": 2.30,
    "bend": 0.73,
    "unclaimed": 2.44,
    "mask_ahead": 1.31,
    "stubby": 1.04,
    "uneven": 0.85,
    "flat": 0.61,
    "faint": 1.14,
    "doubted": 0.53,
    "stray": 1.03,
    "unsure": 1.49,
}
"""The same where strands were looked for by their shape alone, in frames, photographs and clouds: fitted by the same script."""


@dataclass(frozen=True)
class Evidence:
    """What speaks against one chain; 0 for nothing.

    Attributes
    ----------
    joins
        log(1 + sum over the chain's connections of 1 - confidence).
    unsupported
        square root of the share of the segments of which less than half is supported by depth readings, occluded ones included.
    residual
        radii, by which the readings differ from the chain, 90th percentile over its segments.
    bend
        radians, the sharpest turn in the view within two radii on either side.
    unclaimed
        square root of the share of the mask that belongs to no chain, the same for all chains of a frame; in one that may hold
        noise of depth, of its connected parts that the chain runs through.
    dropped
        length of the pieces dropped because of the wanted number of chains, 1 for 20 radii or more; the same for all chains.
    rivals
        by how much the mean log odds of all interpretations of an uncertain frame are below those of the best, which is kept.
    mask_ahead
        share of the pixels ahead of the two ends that are in the mask, summed over both ends: there is no tip, since the object
        continues there or the end is at the side of another strand. 0 for a cloud.
    stubby, uneven, flat, faint, doubted
        how little the chain looks like a cable by itself, see `Looks`; the last three are 0 where the object is given.
    stray
        1 if another object of the frame is five times as long for its radius; else 0.
    unsure
        what all this takes from the surest chain of a frame in which the object is not given: where no chain is sure, there may
        be no object at all.
    is_wide
        whether it is wider than `segment.max_width` in a frame where nobody said what the object is: it is none then.
    is_told
        whether somebody said what the object is; if not, strands were looked for by their shape alone.
    """

    joins: float = 0
    unsupported: float = 0
    residual: float = 0
    bend: float = 0
    unclaimed: float = 0
    dropped: float = 0
    rivals: float = 0
    mask_ahead: float = 0
    stubby: float = 0
    uneven: float = 0
    flat: float = 0
    faint: float = 0
    doubted: float = 0
    stray: float = 0
    unsure: float = 0
    is_wide: bool = False
    is_told: bool = True

    def losses(self) -> dict[str, float]:
        """Return what each kind of evidence takes from the logarithm of the odds, by name."""
        amounts = vars(self)
        return {name: weight * amounts[name] for name, weight in self._weights().items() if name != "base"}

    @property
    def confidence(self) -> float:
        """The probability, 0 to 1, that the chain is right."""
        return 0.0 if self.is_wide else float(expit(self.log_odds))

    @property
    def log_odds(self) -> float:
        """The logarithm of the odds that the chain is right: that without any evidence, less all losses."""
        return self._weights()["base"] - sum(self.losses().values())

    def _weights(self) -> dict[str, float]:
        return GIVEN if self.is_told else AUTO
