"""Fit the weights of the confidence on rendered scenes: python docs/fit_confidence.py [--seeds 3] [--start 0] [--check 3].

Detects in scenes of every family, by stereo with the true and with a ragged mask, and by the simulated D435 with the true mask,
each with the number of cables given and left to the data. Then fits by logistic regression whether the frame is correct to the
evidence against its least confident chain, and prints the constants of doo3d/stages/confidence.py. `--check` seeds that follow
are not fitted, but their likelihood is printed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from doo3d import load_config
from doo3d.evaluation.benchmark.cases import scene_cases
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.registry import FAMILIES, family_rng
from doo3d.pipeline import run_stages
from doo3d.stages.confidence import WEIGHTS

MODES = (
    ("stereo", False, True),
    ("stereo", True, True),
    ("stereo", False, False),
    ("stereo", True, False),
    ("d435", False, True),
    ("d435", False, False),
)
"""Sensor, ragged mask or the true one, number of cables given or left to the data."""

SHRINKAGE = 0.05
"""Weight of the squares of the weights, each in standard deviations of its evidence, beside the logarithm of the likelihood."""

ROUNDS = 6
"""Times that the least confident chain of each frame is chosen with the last weights."""


@dataclass(frozen=True)
class Fitted:
    """One frame: its seed, whether it is correct, and the evidence (C, K) against each of its chains."""

    seed: int
    correct: bool
    evidence: np.ndarray


def collect(seeds: Iterable[int]) -> list[Fitted]:
    """Detect in the scenes of all families, sensors and masks, and return the evidence of each frame with chains."""
    frames = []
    for sensor in dict.fromkeys(mode[0] for mode in MODES):
        for seed in seeds:
            for case in scene_cases(list(FAMILIES), [seed], sensor, (1280, 720)):
                known = case.load()
                for _, ragged, given in (mode for mode in MODES if mode[0] == sensor):
                    config = load_config("default", {"merge.chains": max(len(known.truths), 1) if given else None})
                    mask = ragged_mask(known.mask, family_rng(f"{case.name}/ragged", 0)) if ragged else known.mask
                    stages = run_stages(known.data, config, mask)
                    result = score(stages.chains, known.truths, stages.crossings, known.data.camera)
                    if stages.chains:
                        rows = [[getattr(each, name) for name in WEIGHTS] for each in stages.evidence]
                        frames.append(Fitted(seed, result.correct, np.array(rows)))
    return frames


def fit(frames: list[Fitted]) -> np.ndarray:
    """Return the base log odds and the weights (1 + K,), none of them below 0."""
    correct = np.array([frame.correct for frame in frames])
    weights = np.concatenate(([5.0], np.ones(len(WEIGHTS))))
    for _ in range(ROUNDS):
        x = np.array([least_confident(frame, weights) for frame in frames])
        scale = x.std(axis=0)

        def loss(w: np.ndarray, x: np.ndarray = x, scale: np.ndarray = scale) -> float:
            wrong = np.logaddexp(0, np.where(correct, -1, 1) * (w[0] - x @ w[1:])).sum()
            return float(wrong + SHRINKAGE * ((w[1:] * scale) ** 2).sum())

        weights = minimize(loss, weights, bounds=[(None, None), *[(0, None)] * len(WEIGHTS)]).x
    return weights


def least_confident(frame: Fitted, weights: np.ndarray) -> np.ndarray:
    """Return the evidence (K,) against the chain of a frame that has the lowest odds."""
    return frame.evidence[(frame.evidence @ weights[1:]).argmax()]


def log_likelihood(frames: list[Fitted], weights: np.ndarray) -> float:
    """Return the mean logarithm of the probability that the weights give to what came out."""
    odds = np.array([weights[0] - least_confident(frame, weights) @ weights[1:] for frame in frames])
    return float(-np.logaddexp(0, np.where([frame.correct for frame in frames], -odds, odds)).mean())


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--start", type=int, default=0)
    parser.add_argument("--check", type=int, default=3)
    options = parser.parse_args()
    middle = options.start + options.seeds
    frames = collect(range(options.start, middle + options.check))
    fitted = [frame for frame in frames if frame.seed < middle]
    checked = [frame for frame in frames if frame.seed >= middle]
    weights = fit(fitted)
    print(f"BASE_LOG_ODDS = {weights[0]:.2f}")
    for name, weight in zip(WEIGHTS, weights[1:], strict=True):
        print(f'    "{name}": {weight:.2f},')
    for name, part in (("fitted", fitted), ("checked", checked)):
        if part:
            print(f"{name}: {len(part)} frames, mean log likelihood {log_likelihood(part, weights):.3f}")


if __name__ == "__main__":
    main()
