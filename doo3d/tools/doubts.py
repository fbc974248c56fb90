"""Describe in words the evidence against the chains of a frame."""

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
    "frame_doubt": "doubts about the best chain of the frame",
}
"""Kind of evidence -> words for it."""

MIN_LOSS = 0.5
"""Least loss of log-odds for which a kind of evidence is named; this lowers a confidence of 0.95 to 0.92."""


def doubts(stages: Stages) -> tuple[str, ...]:
    """Return a sentence for each chain with evidence against it: its confidence and the reasons, strongest first."""
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
