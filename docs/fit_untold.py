"""Fit what makes a chain in a frame with depth a cable, with nothing given: python docs/fit_untold.py [--cache FOLDER].

Prints UNTOLD of doo3d/stages/confidence/evidence.py, by logistic regression with weights of 0 or more. The frames: all families
of scenes, seeds 0, 1, 40 and 41, by stereo and by the D435; and scenes without a cable, seeds 0 to 9 by the D435 and 0 to 4 by
stereo; each is segmented twice, as `auto` does, by the rules and the network, and by the rules alone. A chain is right by the
strict rule. Right chains together count as much as wrong ones. `--check` seeds of all families by both sensors, and of scenes
without a cable by the D435, are not fitted, but it is printed which of their chains `output.min_confidence` leaves out.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fit_confidence import IMAGE_SHRINKAGE, LEAST_ODDS, UNTOLD_KINDS, rendered
from scipy.optimize import minimize

from doo3d import DooError, load_config
from doo3d.evaluation.benchmark.cases import scene_cases
from doo3d.evaluation.benchmark.evaluate import case_config
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.scenes.registry import GROUPS
from doo3d.pipeline import run_with_stages

FITTED = (
    ("without", "d435", range(10)),
    ("without", "stereo", range(5)),
    *(("all", sensor, (0, 1, 40, 41)) for sensor in ("d435", "stereo")),
)
"""Families, sensors and seeds that are fitted."""

METHODS = ("auto", "strands")
"""Methods that they are segmented by: what the network judges holds less noise of depth than what the rules select alone."""


class Chains(NamedTuple):
    """The chains of a frame: the evidence (C, K) against them, whether each is right, (C,), and the number of cables."""

    evidence: np.ndarray
    right: np.ndarray
    cables: int


def found_in(group: str, sensor: str, seeds: Iterable[int], cache: Path | None, method: str) -> Iterator[Chains]:
    """Yield the chains of each frame, segmented by a method, that are not wider than an object may be."""
    config = load_config("default", {"segment.method": method})
    for case in scene_cases(GROUPS[group], seeds, sensor):
        known = rendered(f"{sensor}_{case.name}", case.load, cache)
        try:
            _, stages = run_with_stages(known.data, case_config(config, known.truths, False, "auto"))
        except DooError:
            continue
        made = [each for each in zip(stages.chains, stages.evidence, strict=True) if not each[1].is_wide]
        right = [any(score((chain,), (truth,)).correct for truth in known.truths) for chain, _ in made]
        evidence = np.array([[each.amounts()[kind] for kind in UNTOLD_KINDS] for _, each in made]).reshape(-1, len(UNTOLD_KINDS))
        yield Chains(evidence, np.array(right, dtype=bool), len(known.truths))


def fit(found: list[Chains]) -> np.ndarray:
    """Return base and weights (K + 2,), `unsure` last, none of the weights below 0."""
    found = [each for each in found if len(each.right)]
    x, right = np.concatenate([each.evidence for each in found]), np.concatenate([each.right for each in found])
    frame = np.repeat(np.arange(len(found)), [len(each.right) for each in found])
    counts = np.where(right, (~right).sum() / right.sum(), 1.0)

    def loss(weights: np.ndarray) -> float:
        losses, least = x @ weights[1:-1], np.full(len(found), np.inf)
        np.minimum.at(least, frame, losses)
        every = np.column_stack((x, least[frame]))
        wrong = np.logaddexp(0, np.where(right, -1, 1) * (weights[0] - every @ weights[1:]))
        return float((counts * wrong).sum() + IMAGE_SHRINKAGE * ((weights[1:] * every.std(axis=0)) ** 2).sum())

    start = np.concatenate(([5.0], np.where(x.std(axis=0) > 0, 1.0, 0.0), [0.5]))
    bounds = [(None, None), *((0, None if spread > 0 else 0) for spread in x.std(axis=0)), (0, None)]
    return np.asarray(minimize(loss, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 3000, "maxfun": 200000}).x)


def print_left_out(label: str, found: list[Chains], weights: np.ndarray) -> None:
    """Print how many frames without a cable show a chain, and which chains of the others are left out."""
    shown = without = lost = right = kept = wrong = 0
    for each in found:
        without += not each.cables
        if not len(each.right):
            continue
        losses = each.evidence @ weights[1:-1]
        low = weights[0] - losses - weights[-1] * losses.min() < LEAST_ODDS
        shown += not each.cables and not low.all()
        if each.cables:
            lost, right = lost + (low & each.right).sum(), right + each.right.sum()
            kept, wrong = kept + (~low & ~each.right).sum(), wrong + (~each.right).sum()
    print(f"# {label}: {shown} of {without} frames without a cable show a chain;")
    print(f"#   of others {lost} of {right} right chains are left out, and {kept} of {wrong} wrong ones are shown")


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, help="folder of rendered frames, kept between calls")
    parser.add_argument("--check", type=int, nargs="*", default=[], help="seeds that are not fitted")
    options = parser.parse_args()
    found = [each for method in METHODS for group in FITTED for each in found_in(*group, options.cache, method)]
    weights = fit(found)
    print("UNTOLD = {")
    for kind, weight in zip(("base", *UNTOLD_KINDS, "unsure"), weights, strict=True):
        if weight >= 0.005:
            print(f'    "{kind}": {weight:.2f},')
    print("}")
    print_left_out("fitted", found, weights)
    groups = (("without", "d435"), ("all", "d435"), ("all", "stereo")) if options.check else ()
    for (group, sensor), method in itertools.product(groups, METHODS):
        checked = list(found_in(group, sensor, options.check, options.cache, method))
        print_left_out(f"{group}, {sensor}, {method}", checked, weights)


if __name__ == "__main__":
    main()
