"""The confidence of chains: the odds that a frame is right, from every kind of evidence against it.

Each doubtful decision multiplies the odds by a factor below 1, so that the logarithm of the odds is a sum: a constant for a frame
without doubt, less a weight times the amount of each kind of evidence (logistic regression). The weights were fitted on rendered
scenes with known truth; docs/pages/accuracy.md says on which, and how the confidence then held on others.
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.special import expit

TOLD = {
    "base": 5.06,
    "joins": 0.27,
    "unsupported": 0.79,
    "residual": 1.47,
    "bend": 1.83,
    "undecided": 1.77,
    "beside": 2.01,
    "unclaimed": 5.20,
    "dropped": 5.27,
    "rivals": 1.0,
    "stubby": 1.47,
    "stray": 5.19,
    "odd": 2.89,
}
"""Logarithm of the odds that a chain without any evidence against it is right, and what a unit of each kind of evidence takes
from it, where somebody said what the object is: fitted by docs/fit_confidence.py to seeds 0 to 2 of all families of scenes; of
`rivals` 1, with which the log odds are the mean over all interpretations."""

UNTOLD = {
    "base": 8.03,
    "joins": 0.99,
    "residual": 0.59,
    "bend": 0.82,
    "undecided": 1.58,
    "beside": 1.04,
    "unclaimed": 8.46,
    "stubby": 4.16,
    "stray": 3.56,
    "odd": 1.46,
    "uneven": 4.10,
    "flat": 2.78,
    "edge": 1.56,
    "unsure": 1.19,
}
"""The same where strands were looked for in a frame by their shape alone: fitted by docs/fit_untold.py. Right chains count as
much together as wrong ones."""

UNTOLD_CLOUD = {
    "base": 5.12,
    "joins": 0.11,
    "unsupported": 1.63,
    "residual": 0.32,
    "bend": 1.66,
    "undecided": 1.25,
    "beside": 0.13,
    "unclaimed": 3.71,
    "stubby": 3.48,
    "uneven": 7.59,
    "stray": 3.81,
    "odd": 1.42,
}
"""The same in a cloud, of which nobody has a view: fitted, before the weights of frames were fitted by themselves, to automatic
segmentation of seeds 0 and 1 of the same scenes."""

UNTOLD_IMAGE = {
    "base": 3.51,
    "unsupported": 6.27,
    "bend": 2.81,
    "undecided": 0.92,
    "beside": 1.84,
    "unclaimed": 2.40,
    "stubby": 3.33,
    "uneven": 5.31,
}
"""The same in a photograph: fitted to the color images of these scenes and to labelled photographs."""

UNTOLD_NETWORK = {
    "base": 4.87,
    "bend": 0.67,
    "unclaimed": 2.36,
    "stubby": 1.19,
    "uneven": 0.29,
    "edge": 0.65,
    "odd": 2.00,
    "doubted": 0.56,
    "rod": 1.52,
    "unsure": 2.36,
}
"""The same in a photograph whose pixels a network judged: fitted by docs/fit_photographs.py."""


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
    undecided
        sum over the crossings of the chain of 1 - confidence.
    beside
        square root of the share of the chain that runs beside another strand in the view, within two radii.
    unclaimed
        square root of the share of the mask that belongs to no chain, the same for all chains of a frame; in one that may hold
        noise of depth, of its connected parts that the chain runs through.
    dropped
        length of the pieces dropped because of the wanted number of chains, 1 for 20 radii or more; the same for all chains.
    rivals
        by how much the mean log odds of all interpretations of an uncertain frame are below those of the best, which is kept.
    stubby, uneven, flat, edge, doubted, rod
        how little the chain looks like a cable by itself, see `Looks`; 0 where somebody said what the object is, unless `stray`.
    stray
        1 if the number of chains was left to the data and another object is five times as long; else 0.
    odd
        logarithm of the ratio of the two radii, absolute, where `stray` is 1; else 0.
    unsure
        what all this takes from the surest chain where nobody said what the object is: where no chain is sure, there may be no
        object at all.
    is_wide
        whether it is wider than `segment.max_width` in a frame where nobody said what the object is: it is none then.
    is_told
        whether somebody said what the object is; if not, strands were looked for by their shape alone.
    is_in_view
        whether the chain was found in a frame of a camera, and not in a cloud.
    is_planar
        whether the chain was found in an image, without depth.
    is_judged
        whether a network said how probable each pixel is.
    """

    joins: float = 0.0
    unsupported: float = 0.0
    residual: float = 0.0
    bend: float = 0.0
    undecided: float = 0.0
    beside: float = 0.0
    unclaimed: float = 0.0
    dropped: float = 0.0
    rivals: float = 0.0
    stubby: float = 0.0
    uneven: float = 0.0
    flat: float = 0.0
    edge: float = 0.0
    stray: float = 0.0
    odd: float = 0.0
    doubted: float = 0.0
    rod: float = 0.0
    unsure: float = 0.0
    is_wide: bool = False
    is_told: bool = True
    is_in_view: bool = True
    is_planar: bool = False
    is_judged: bool = False

    def amounts(self) -> dict[str, float]:
        """Return the amount of each kind of evidence by name."""
        return {name: value for name, value in vars(self).items() if not name.startswith("is_")}

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
        if self.is_told or not self.is_planar:
            return TOLD if self.is_told else UNTOLD if self.is_in_view else UNTOLD_CLOUD
        return UNTOLD_NETWORK if self.is_judged else UNTOLD_IMAGE
