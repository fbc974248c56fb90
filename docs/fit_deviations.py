"""Fit and check the standard deviations of joints on rendered scenes.

python docs/fit_deviations.py [--cache FOLDER] [--joints FILE] [--check]

Prints the constants FRAME_WEIGHTS and CLOUD_WEIGHTS of doo3d/judge/deviations.py, and WEIGHTS of
doo3d/track/deviations.py, by quantile regression:
the pinball loss at 0.92 of the logarithms of the errors, over the joints of right chains, is least where 92 % of them
are within 1.645 deviations: 90 % then are in other scenes. Fitted are seeds 0 and 1 of every family by stereo and by
the simulated D435, and seed 0 by the Zivid and by the coarse sensor, with the true and with a ragged mask; and, as
clouds, the points of the true masks. Joints that are hidden, or whose depth was filled in, are few: kinds count by the
square root of their number, and so do sensors.

Then prints how many of the errors of seed 2, which is not fitted, are within 1.645 deviations; with `--check`, by the
weights that doo3d has.
"""

from __future__ import annotations

import argparse
import itertools
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from confidence_frames import rendered
from scipy.optimize import minimize

from doo3d import Cloud, DooError, load_config
from doo3d.evaluation.benchmark.cases import scene_cases
from doo3d.evaluation.benchmark.evaluate import case_config
from doo3d.evaluation.metrics.distances import joint_errors
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.registry import FAMILIES, family_rng
from doo3d.evaluation.sequences.motions import OWN_MOTIONS
from doo3d.evaluation.sequences.scenes import make_sequence
from doo3d.geometry.curves import Curves
from doo3d.judge.deviations import FRAME_WEIGHTS, IN_CLOUD, IN_FRAME, deviations_of
from doo3d.pipeline import run_stages
from doo3d.track import detect_sequence
from doo3d.track.deviations import WEIGHTS, deviation_terms
from doo3d.track.first_pass import observe_frame

SEEDS = {"stereo": (0, 1, 2), "d435": (0, 1, 2), "zivid": (0, 2), "coarse": (0, 2), "d455": (2,)}
CHECKED_SEED = 2
KINDS = ("seen", "filled", "hidden")
SHARE, DEVIATIONS, LEAST = 0.92, 1.645, 1e-5
"""Share of the fitted errors within so many deviations, so that 90 % are in other scenes; and m below which an error counts as
that."""


class Joints(NamedTuple):
    """J joints of a right chain: their squared terms (J, 8) m², errors (J, 2) m, and kinds (J,), indices of KINDS."""

    sensor: str
    mask: str
    seed: int
    terms: np.ndarray
    errors: np.ndarray
    kinds: np.ndarray


def collect(cache: Path | None, seeds: dict[str, tuple[int, ...]]) -> Iterator[Joints]:
    """Detect in the scenes of all families and sensors, and yield the joints of right chains."""
    for sensor, numbers in seeds.items():
        for case in scene_cases(list(FAMILIES), list(numbers), sensor, (1280, 720)):
            known, seed = rendered(case, cache), int(case.name.rpartition("_")[2])
            ragged = ragged_mask(known.mask, family_rng(f"{case.name}/ragged", 0))
            for name, mask in (("true", known.mask), ("ragged", ragged)):
                yield from joints_of(known.data, mask, known.truths, (sensor, name, seed))
            rows, columns = np.nonzero(known.mask & (known.data.depth > 0))
            points = known.data.camera.unproject(np.column_stack((columns, rows)), known.data.depth[rows, columns])
            if len(points):
                cloud = Cloud(points, viewpoint=np.zeros(3))
                yield from joints_of(cloud, None, known.truths, (sensor, "cloud", seed))


def joints_of(data, mask, truths, of: tuple[str, str, int]) -> Iterator[Joints]:
    """Yield the joints of the right chains of one frame."""
    method = "everything" if mask is None else "mask"
    try:
        stages = run_stages(data, case_config(load_config("default"), truths, True, method), mask)
    except DooError:
        return
    chains = stages.chains
    if not chains:
        return
    curves, scene = Curves.of([chain.joints for chain in chains]), stages.scene
    support = scene.depth_support(curves, [chain.radius for chain in chains])
    terms = [each**2 for each in deviations_of(curves, chains, support, scene, np.eye(8))]
    kinds = [np.append(chain.occluded, 0) + np.append(chain.depth_filled, 0) for chain in chains]
    beside = [np.maximum(kind, np.append(0, kind[:-1])) for kind in kinds]
    for chain, squares, kind in zip(chains, terms, beside, strict=True):
        if any(score((chain,), (truth,)).correct for truth in truths):
            errors = joint_errors(chain, truths)
            known = np.isfinite(errors[:, 0])
            yield Joints(*of, squares[known], errors[known], kind[known])


def collect_sequences(seeds: tuple[int, ...]) -> Iterator[Joints]:
    """Detect in cables in motion as sequences, and yield the joints of right chains; their terms are (J, 2, 2)."""
    config = load_config("default", {"merge.chains": 1})
    of_window, kept = detect_sequence.with_deviations, []
    detect_sequence.with_deviations = lambda *given: kept.append(deviation_terms(*given)) or of_window(*given)
    for sensor, motion, seed in itertools.product(("d435", "stereo"), OWN_MOTIONS, seeds):
        rendered_frames = list(make_sequence(motion, seed, frames=60).frames(sensor))
        observations = [observe_frame(each.frame, config, each.mask) for each in rendered_frames]
        kept.clear()
        detections = list(detect_sequence.combine(observations, config))
        for k, (detection, each) in enumerate(zip(detections, rendered_frames, strict=True)):
            if len(detection.chains) == len(kept) == 1 and score(detection.chains, each.truths).correct:
                chain = detection.chains[0]
                errors = joint_errors(chain, each.truths)
                known = np.isfinite(errors[:, 0])
                kinds = 2 * (np.append(chain.occluded, False) | np.append(False, chain.occluded))
                yield Joints(sensor, motion, seed, kept[0][k][known] ** 2, errors[known], kinds[known])


def fit(frames: list[Joints]) -> np.ndarray:
    """Return the weights (8, 2) of the terms, none below 0."""
    terms, errors, kinds = (np.concatenate([getattr(frame, name) for frame in frames]) for name in ("terms", "errors", "kinds"))
    sensors = np.concatenate([[list(SEEDS).index(frame.sensor)] * len(frame.kinds) for frame in frames])
    count = np.bincount(kinds, minlength=3)[kinds] * np.bincount(sensors)[sensors]
    share = count**-0.5 / (count**-0.5).sum()
    wanted = np.log(np.maximum(errors, LEAST) / DEVIATIONS)
    return np.column_stack([_fit_one(terms if terms.ndim == 2 else terms[:, :, k], wanted[:, k], share) for k in (0, 1)])


def _fit_one(terms: np.ndarray, wanted: np.ndarray, share: np.ndarray) -> np.ndarray:
    def loss(logs: np.ndarray) -> tuple[float, np.ndarray]:
        parts = terms * np.exp(2 * logs)
        variance = parts.sum(axis=1) + 1e-14
        missed = wanted - np.log(variance) / 2
        slope = share * np.where(missed > 0, SHARE, SHARE - 1)
        return float((slope * missed).sum() + 1e-6 * logs @ logs), -(slope / variance) @ parts + 2e-6 * logs

    best = []
    for start in (-1.5, -3.0):
        logs = np.full(terms.shape[1], start)
        for _ in range(3):
            found = minimize(loss, logs, jac=True, method="L-BFGS-B", bounds=[(-7, 3)] * len(logs), options={"maxiter": 400})
            logs = found.x
        best.append((found.fun, logs))
    logs = min(best, key=lambda each: each[0])[1]
    return np.where((logs > -4.5) & (terms > 0).any(axis=0), np.exp(logs), 0.0)


def print_weights(name: str, weights: np.ndarray) -> None:
    """Print one of the constants."""
    print(f"{name} = {{")
    for term, pair in zip(
        FRAME_WEIGHTS if len(weights) == len(FRAME_WEIGHTS) else ("own", "hidden"), weights.tolist(), strict=True
    ):
        if any(pair):
            print(f'    "{term}": ({pair[0]:.3g}, {pair[1]:.3g}),')
    print("}")


def print_table(frames: list[Joints], weights: dict[str, np.ndarray]) -> None:
    """Print a row for each sensor and mask, and for each kind of joint: how many errors are within 1.645 deviations."""
    print("| | joints | within, across | along | median deviation across, mm | along |\n|---|---|---|---|---|---|")
    names = {"frames": ("true", "ragged"), "clouds": ("cloud",), "sequences": tuple(OWN_MOTIONS)}
    for sensor in SEEDS:
        for mask in itertools.chain(*names.values()):
            _print_row(f"{sensor}, {mask}", [each for each in frames if (each.sensor, each.mask) == (sensor, mask)], weights)
    for name, masks in names.items():
        of = [each for each in frames if each.mask in masks]
        for number, kind in enumerate(KINDS if name == "frames" else ("seen", "", "hidden")):
            part = [
                each._replace(terms=each.terms[each.kinds == number], errors=each.errors[each.kinds == number]) for each in of
            ]
            if kind:
                _print_row(f"all {name}: {kind}", part, weights)
        _print_row(f"all {name}", of, weights)


def _print_row(label: str, frames: list[Joints], weights: dict[str, np.ndarray]) -> None:
    if not sum(len(each.errors) for each in frames):
        return
    errors = np.concatenate([each.errors for each in frames])
    deviations = np.concatenate([_deviations(each, weights) for each in frames])
    across, along = (errors <= DEVIATIONS * deviations).mean(axis=0)
    first, second = 1e3 * np.median(deviations, axis=0)
    print(f"| {label} | {len(errors):,} | {across:.1%} | {along:.1%} | {first:.2f} | {second:.2f} |")


def _deviations(of: Joints, weights: dict[str, np.ndarray]) -> np.ndarray:
    """Return the deviations (J, 2) of joints."""
    if of.mask in OWN_MOTIONS:
        return np.sqrt((of.terms * weights["sequence"] ** 2).sum(axis=1))
    return np.sqrt(of.terms @ weights["cloud" if of.mask == "cloud" else "frame"] ** 2)


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, help="folder of rendered frames, kept between calls")
    parser.add_argument("--check", action="store_true", help="fit nothing, and check the weights of doo3d")
    parser.add_argument("--joints", type=Path, help="file that keeps what was detected between calls")
    options = parser.parse_args()
    if options.joints and options.joints.exists():
        frames = [Joints(*each) for each in pickle.loads(options.joints.read_bytes())]
    else:
        seeds = {sensor: tuple(s for s in own if s == CHECKED_SEED or not options.check) for sensor, own in SEEDS.items()}
        frames = [*collect(options.cache, seeds), *collect_sequences(seeds["d435"])]
        if options.joints:
            options.joints.write_bytes(pickle.dumps([tuple(each) for each in frames]))
    weights = {"frame": IN_FRAME, "cloud": IN_CLOUD, "sequence": WEIGHTS}
    if not options.check:
        fitted = [each for each in frames if each.seed != CHECKED_SEED]
        for name, constant, masks in (
            ("frame", "FRAME_WEIGHTS", ("true", "ragged")),
            ("cloud", "CLOUD_WEIGHTS", ("cloud",)),
            ("sequence", "WEIGHTS", OWN_MOTIONS),
        ):
            weights[name] = fit([each for each in fitted if each.mask in masks])
            print_weights(constant, weights[name])
    print_table([each for each in frames if each.seed == CHECKED_SEED], weights)


if __name__ == "__main__":
    main()
