"""Fit and measure the confidence on many sources: python docs/fit_confidence.py [--data DIR] [--cache DIR] [--measure].

DIR holds the public data sets that docs/confidence_frames.py lists; those that are absent are left out. Printed are, for each
source, by the packaged weights and by a fit that saw nothing of its group (leave one source out):

- chains, and the right ones among them;
- AUC: how well the confidence ranks right chains over wrong ones;
- hidden: right chains that are neither shown nor doubtful;
- sure, wrong: chains of a confidence of 0.95 and more, and the wrong ones among them;
- nothing: frames with a cable that show neither a chain nor a doubtful one;
- empty: frames without a cable that show a chain, and that show a doubtful one.

Then WEIGHTS_GIVEN and WEIGHTS_AUTO of doo3d/judge/evidence.py: a logistic regression each, with weights of 0 or more. Each source
counts with the square root of the number of its chains. `--measure` prints the table by the packaged weights alone.
"""

from __future__ import annotations

import argparse
import pickle
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from confidence_frames import Source, sources
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import rankdata

from doo3d import DooError, Image, load_config
from doo3d.judge.evidence import WEIGHTS_AUTO, WEIGHTS_GIVEN
from doo3d.pipeline import detect_with_stages
from doo3d.types.results import DOUBTFUL_LENGTH_RADII, MIN_DOUBTFUL_CONFIDENCE

UNSURE = "frame_doubt"
"""Kind of evidence that follows from the others: what they take from the surest chain of a frame."""

EMPTY_TIMES = 1.5
"""How much the chains of sources without a cable count, times those of others: with 1, six of 36 rendered frames without a cable
show a chain, with 1.5 and more three, and the more they count, the worse right chains of bundles rank."""

SHRINKAGE = 0.0002
"""Cost of a weight squared, times the variance of its evidence, per chain: keeps weights of rare evidence small."""

MIN_CONFIDENCE, SURE = load_config("default").output.min_confidence, 0.95
"""Confidence below which a chain is not shown where nothing is given, and from which on it is sure."""


class Found(NamedTuple):
    """A chain that was found: frame of its source, amount of each kind of evidence, whether it is right, length in radii."""

    frame: int
    amounts: dict[str, float]
    is_right: bool
    radii: float


@dataclass(frozen=True)
class Measured:
    """A source with the number of cables in each of its frames, and the chains found there."""

    source: Source
    cables: list[int]
    chains: list[Found]


def measure(source: Source) -> Measured:
    """Detect in all frames of a source, with nothing or with its mask given."""
    cables, chains = list[int](), list[Found]()
    for _, load in source.frames:
        known = load()
        if known is None:
            continue
        cables.append(known.cables)
        try:
            preset = "image" if isinstance(known.data, Image) else "default"
            settings = {"merge.chains": known.cables} if known.is_counted else {}
            detection, stages = detect_with_stages(known.data, load_config(preset, settings), known.mask)
        except DooError:
            continue
        for chain, evidence, is_right in zip(detection.chains, stages.evidence, known.judge(detection.chains), strict=True):
            amounts = {name: float(value) for name, value in vars(evidence).items()}
            chains.append(Found(len(cables) - 1, amounts, is_right, chain.length / chain.radius if chain.radius > 0 else 0.0))
    return Measured(source, cables, chains)


def amounts_of(chains: Iterable[Found], kinds: Sequence[str]) -> np.ndarray:
    """Return the evidence (N, K) against chains, but for what the surest chain of a frame makes of it."""
    return np.array([[each.amounts[kind] for kind in kinds if kind != UNSURE] for each in chains]).reshape(
        -1, len(set(kinds) - {UNSURE})
    )


def surest(losses: np.ndarray, frame: np.ndarray, wide: np.ndarray) -> np.ndarray:
    """Return for each chain (N,) the index of the surest chain of its frame, which no wide one is unless all are."""
    order = np.lexsort((losses, wide, frame))
    first = np.append(True, np.diff(frame[order]) > 0)
    index = np.empty(len(frame), dtype=int)
    index[order] = order[first][np.cumsum(first) - 1]
    return index


def fit(measured: Sequence[Measured], kinds: Sequence[str]) -> np.ndarray:
    """Return base and weights (1 + K,) by logistic regression, none of the weights below 0; that of UNSURE is the last."""
    some = [each for each in measured if each.chains]
    evidence = np.concatenate([amounts_of(each.chains, kinds) for each in some])
    right = np.array([chain.is_right for each in some for chain in each.chains])
    wide = np.array([chain.amounts["is_wide"] for each in some for chain in each.chains])
    frame = np.concatenate([1_000_000 * k + np.array([chain.frame for chain in each.chains]) for k, each in enumerate(some)])
    share = np.concatenate(
        [np.full(len(each.chains), len(each.chains) ** -0.5 * (1 if any(each.cables) else EMPTY_TIMES)) for each in some]
    )
    share, variance, count = share / share.sum(), evidence.var(axis=0), evidence.shape[1]

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        losses, frame_doubt = evidence @ weights[1 : count + 1], weights[-1] if UNSURE in kinds else 0.0
        best = surest(losses, frame, wide)
        odds = weights[0] - losses - frame_doubt * losses[best]
        off = share * expit(np.where(right, -odds, odds)) * np.where(right, -1, 1)
        slope = -(off @ evidence) - frame_doubt * (off @ evidence[best]) + 2 * SHRINKAGE * variance * weights[1 : count + 1]
        value = share @ np.logaddexp(0, np.where(right, -odds, odds)) + SHRINKAGE * variance @ weights[1 : count + 1] ** 2
        return float(value), np.concatenate(([off.sum()], slope, [-(off @ losses[best])] * (UNSURE in kinds)))

    bounds = [(None, None), *((0, None if each > 0 else 0) for each in variance), *[(0, None)] * (UNSURE in kinds)]
    start = np.concatenate(([5.0], np.ones(len(kinds))))
    return np.asarray(minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 5000}).x)


def area(confidence: np.ndarray, right: np.ndarray) -> float:
    """Return the area under the receiver operating characteristic; NaN where all chains are right, or none is."""
    count = int(right.sum())
    if count in (0, len(right)):
        return float("nan")
    ranks = rankdata(confidence)
    return float((ranks[right].sum() - count * (count + 1) / 2) / (count * (len(right) - count)))


def row(each: Measured, kinds: Sequence[str], weights: np.ndarray) -> str:
    """Return the cells of the table for one source by these weights."""
    right, radii = np.array([c.is_right for c in each.chains], dtype=bool), np.array([c.radii for c in each.chains])
    frame, wide = (np.array([f(c) for c in each.chains]) for f in (lambda c: c.frame, lambda c: c.amounts["is_wide"]))
    evidence = amounts_of(each.chains, kinds)
    losses = evidence @ weights[1 : evidence.shape[1] + 1]
    if UNSURE in kinds and len(losses):
        losses = losses + weights[-1] * losses[surest(losses, frame, wide)]
    confidence = np.where(wide > 0, 0.0, expit(weights[0] - losses))
    shown = np.full(len(right), True) if each.source.is_given else confidence >= MIN_CONFIDENCE
    may_be = ~shown & (confidence >= MIN_DOUBTFUL_CONFIDENCE)
    doubtful = may_be & (radii >= DOUBTFUL_LENGTH_RADII)
    for k in set(frame[may_be].tolist()) - set(frame[shown].tolist()):
        doubtful[np.flatnonzero(frame == k)[confidence[frame == k].argmax()]] = True
    frames = np.arange(len(each.cables))
    has_shown, has_doubtful = np.isin(frames, frame[shown]), np.isin(frames, frame[doubtful])
    with_cable = np.array(each.cables, dtype=int) > 0
    sure = confidence >= SURE
    return (
        f"{len(right):5d} {right.sum():5d}  {area(confidence, right):4.2f} {(right & ~shown & ~doubtful).sum():5d}  "
        f"{sure.sum():5d} {(sure & ~right).sum():4d}  "
        f"{(with_cable & ~has_shown & ~has_doubtful).sum():3d}/{with_cable.sum():3d}  "
        f"{(~with_cable & has_shown).sum():3d} {(~with_cable & has_doubtful).sum():3d}/{(~with_cable).sum():3d}"
    )


def collect(data: Path, cache: Path, workers: int) -> list[Measured]:
    """Measure all sources, or read what was measured by the same command before."""
    file = cache / "measured.pkl"
    if file.exists():
        return pickle.loads(file.read_bytes())
    listed = list(sources(data, cache))
    names = [source.name for source in listed]
    with ProcessPoolExecutor(workers) as pool:
        measured = list(pool.map(_measure_source, [data] * len(names), [cache] * len(names), range(len(names))))
    measured = [
        Measured(Source(s.name, s.group, s.is_given, []), m.cables, m.chains) for s, m in zip(listed, measured, strict=True)
    ]
    cache.mkdir(parents=True, exist_ok=True)
    file.write_bytes(pickle.dumps(measured))
    return measured


def _measure_source(data: Path, cache: Path, number: int) -> Measured:
    source = list(sources(data, cache))[number]
    made = measure(source)
    print(f"# {source.name}: {len(made.cables)} frames, {len(made.chains)} chains", flush=True)
    return Measured(Source(source.name, source.group, source.is_given, []), made.cables, made.chains)


def main() -> None:
    """Measure, print and fit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("data"), help="folder of the data sets")
    parser.add_argument(
        "--cache", type=Path, default=Path("confidence-cache"), help="folder of rendered frames and of what was measured"
    )
    parser.add_argument("--measure", action="store_true", help="print the table by the packaged weights alone")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    measured = collect(options.data, options.cache, options.workers)
    columns = "   chains right   AUC hidden  sure wrong  nothing   empty"
    for name, packaged, is_given in (("WEIGHTS_GIVEN", WEIGHTS_GIVEN, True), ("WEIGHTS_AUTO", WEIGHTS_AUTO, False)):
        some = [each for each in measured if each.source.is_given == is_given and each.cables]
        kinds = [kind for kind in packaged if kind not in ("base", "rivals")]
        weights = np.array([packaged["base"], *(packaged[kind] for kind in kinds)])
        print(f"{name:44s}{columns}" + ("" if options.measure else f"   without its group:{columns}"))
        for each in some:
            others = [other for other in some if other.source.group != each.source.group]
            cells = row(each, kinds, weights) + ("" if options.measure else "   |   " + row(each, kinds, fit(others, kinds)))
            print(f"{each.source.name:44s}  {cells}")
        if options.measure:
            continue
        print(f"{name} = {{")
        for kind, weight in zip(("base", *kinds), fit(some, kinds), strict=True):
            print(f'    "{kind}": {weight:.2f},')
        print("}")


if __name__ == "__main__":
    main()
