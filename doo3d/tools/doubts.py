"""What speaks against the chains of a frame, in words."""

from __future__ import annotations

from ..pipeline import Stages
from ..types.display import length_text

WORDS = {
    "joins": "doubtful joins",
    "unsupported": "depth missing, torn or hidden",
    "residual": "readings beside the chain",
    "bend": "a sharp bend",
    "unclaimed": "parts of the mask in no chain",
    "dropped": "pieces dropped for merge.chains",
    "rivals": "other interpretations of the frame",
    "mask_ahead": "the mask continues beyond its end",
    "stubby": "short for its width",
    "uneven": "its width changes",
    "flat": "not raised on both sides",
    "faint": "hardly differs in color from what lies beside it",
    "small_fragment": "short beside the longest object",
    "network_doubt": "the network doubts it",
    "frame_doubt": "no chain of the frame is sure",
}
"""Kind of evidence -> what it says against a chain."""

MIN_LOSS = 0.5
"""Logarithm of the odds that a kind of evidence takes from which on it is named: 0.92 instead of 0.95 at the most."""


def doubts(stages: Stages) -> tuple[str, ...]:
    """Return a sentence for each chain that something speaks against: its confidence, and the reasons, the strongest first."""
    sentences = []
    for number, (chain, evidence) in enumerate(zip(stages.chains, stages.evidence, strict=True)):
        losses = sorted(evidence.losses().items(), key=lambda item: -item[1])
        reasons = [f"{WORDS[name]} (-{loss:.1f})" for name, loss in losses if loss >= MIN_LOSS]
        if evidence.is_wide:
            reasons = ["wider than segment.max_width"]
        if reasons:
            length = length_text(stages.observed.scale * chain.length, chain.joints.shape[1] == 2)
            sentences.append(f"chain {number}, {length}: confidence {chain.confidence:.2f}: {', '.join(reasons)}")
    return tuple(sentences)
