"""The evidence against a chain, and its confidence: a logistic regression.

The log-odds that a chain is right are a constant, minus the weighted sum of each kind of evidence against it. The weights were
fitted to chains in real photographs and captures of many sources, and in rendered scenes; docs/pages/accuracy-scoring.md has the
calibration on sources that the fit did not see.
"""

from dataclasses import dataclass

from scipy.special import expit

WEIGHTS_GIVEN = {
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
"""Weights where the object is given by a mask or a color: `base` is the log-odds of a chain without evidence against it, the
others are subtracted per unit of evidence. Fitted by docs/fit_confidence.py; that of `rivals` is 1, so that the log-odds are the
mean over all interpretations."""

WEIGHTS_AUTO = {
    "base": 8.15,
    "unsupported": 2.30,
    "bend": 0.73,
    "unclaimed": 2.44,
    "mask_ahead": 1.31,
    "stubby": 1.04,
    "uneven": 0.85,
    "flat": 0.61,
    "faint": 1.14,
    "network_doubt": 0.53,
    "small_fragment": 1.03,
    "frame_doubt": 1.49,
}
"""Weights where segmentation searched for strands by their shape alone. Fitted by the same script."""


@dataclass(frozen=True)
class Evidence:
    """The evidence against one chain, by kind; 0 for none.

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
        log-odds of the best interpretation of an uncertain frame minus the mean over all of them.
    mask_ahead
        share of the pixels ahead of the two ends that are in the mask, summed over both ends: there is no tip, since the object
        continues there or the end is at the side of another strand. 0 for a cloud.
    stubby, uneven, flat, faint, network_doubt
        how little the chain looks like a cable by itself, see `ClutterFeatures`; the last three are 0 where the object is given.
    small_fragment
        1 if another object of the frame is five times as long for its radius; else 0.
    frame_doubt
        the sum of the losses of the most certain chain of the frame, where the object is not given: if no chain is certain, there
        may be no object at all.
    is_wide
        whether it is wider than `segment.max_width` where the object is not given: its confidence is 0 then.
    object_given
        whether the user said what the object is; if not, segmentation searched for strands by their shape alone.
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
    network_doubt: float = 0
    small_fragment: float = 0
    frame_doubt: float = 0
    is_wide: bool = False
    object_given: bool = True

    def losses(self) -> dict[str, float]:
        """Return the log-odds that each kind of evidence subtracts, by name."""
        amounts = vars(self)
        return {name: weight * amounts[name] for name, weight in self._weights().items() if name != "base"}

    @property
    def confidence(self) -> float:
        """The probability, 0 to 1, that the chain is right."""
        return 0.0 if self.is_wide else float(expit(self.log_odds))

    @property
    def log_odds(self) -> float:
        """The log-odds that the chain is right: those without evidence, minus all losses."""
        return self._weights()["base"] - sum(self.losses().values())

    def _weights(self) -> dict[str, float]:
        return WEIGHTS_GIVEN if self.object_given else WEIGHTS_AUTO
