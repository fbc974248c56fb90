"""Measure rings in motion: `python -m doo3d.evaluation.sequences.moving_rings`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...config import load_config
from ...geometry.polyline import arc_length, resample
from ...sequence.detect_sequence import combine
from ...sequence.first_pass import observe_frame
from ...sequence.observations import Observation
from ...sequence.rings import ring_joints
from ...types import Bools, Chain, Detection, Floats, Frame
from ..metrics.nodes import axis_points
from ..metrics.record import Record
from ..metrics.score import score
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, Truth
from ..scenes.stacking import spline_axis
from ..scenes.studio import cable_color, make_studio
from .motions import FRAME_RATE
from .nodes import NODES, measured_nodes
from .scenes import SKIN_COLORS, Hand, solid_of

HIDDEN_SHARE, LIFT = 0.3, 0.04
"""Share of the ring that the hand hides, and m by which the ring's waves rise from the table."""


def moving_ring(seed: int, frames: int = 60, hands: bool = True, sensor: str = "d435") -> Iterator[Rendered]:
    """Render a ring that is bent, shifted and turned above a table while a hand passes; the same arguments give the same.

    seed, frames : of the sequence; its ring turns by half a radian in 2 s. hands : whether the hand passes.
    """
    rng = np.random.default_rng([seed, 5])
    studio, radius = make_studio(rng, (640, 480)), rng.uniform(0.002, 0.0035)
    color, waves, phases = cable_color(rng), rng.uniform(0.08, 0.2, 3), rng.uniform(0, 2 * np.pi, 6)
    hand = Hand(0.35 * frames, 0.6 * frames, rng.uniform(0.2, 0.8), HIDDEN_SHARE, 0.85, np.array([1.0, 0.0]), SKIN_COLORS[0])
    length = 0.0
    for index in range(frames):
        time = index / FRAME_RATE
        points = _curve(waves, phases, time)
        size = float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum())
        length = length or size
        points = points * length / size + (0.03 * np.sin(time), 0.02 * time - 0.02, radius)
        axis = spline_axis(_evenly(points), closed=True)
        cable = Truth(studio.to_camera(axis), radius, closed=True, color=color)
        solid = solid_of(hand, cable.axis, index) if hands else None
        solids = () if solid is None else (solid,)
        scene = Scene(f"{index:04d}", f"ring-{seed}", seed, studio.camera, (cable,), solids, studio.table(), studio.light)
        rendered = render(scene, sensor)
        data = rendered.frame
        frame = Frame(color=data.color, depth=data.depth, camera=data.camera, name=data.name, timestamp=time)
        yield replace(rendered, frame=frame)


def _curve(waves: Floats, phases: Floats, time: float) -> Floats:
    """Return points (P, 3) m of a ring of about 0.1 m radius at a time in s, from the same point of the material on."""
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    bent = np.ones(len(angles))
    for k in range(len(waves)):
        bent += waves[k] / (k + 1) * (1 + 0.6 * np.sin(2 * time + phases[k + 3])) * np.cos((k + 2) * angles + phases[k])
    turned = angles + 0.25 * time
    lifted = LIFT * (1 + np.cos(2 * angles + 0.5 * time)) / 2
    return np.column_stack((0.1 * bent * np.cos(turned), 0.1 * bent * np.sin(turned), lifted))


def _evenly(points: Floats) -> Floats:
    """Return evenly spaced points of a closed curve, from its first on: the material does not stretch along it."""
    around = np.concatenate((points, points[:1]))
    return resample(around, np.linspace(0.0, arc_length(around)[-1], len(around)))[:-1]


def ring_offsets(chains: Sequence[Chain | None], truths: Sequence[Truth], in_each: bool) -> Floats:
    """Return how far the nodes of a ring are from their points of the material, (T, NODES) m; NaN in frames without a chain.

    A detected ring may begin anywhere, and run either way: of all places, those count that fit best in all frames together, or
    `in_each` frame by itself.
    """
    shares = np.linspace(0, 1, NODES + 1)[:-1]
    known = [k for k, chain in enumerate(chains) if chain is not None and chain.closed]
    distances = np.full((2, NODES, len(chains), NODES), np.nan)
    for k in known:
        chain, truth = chains[k], truths[k]
        assert chain is not None
        true = axis_points(truth, shares * truth.length)
        for way in range(2):
            found = ring_joints(chain, bool(way), 0.0, NODES)[:-1]
            for start in range(NODES):
                distances[way, start, k] = np.linalg.norm(np.roll(found, start, axis=0) - true, axis=1)
    flat = distances.reshape(2 * NODES, len(chains), NODES)
    if not known:
        return np.asarray(flat[0])
    means = flat[:, known].mean(axis=2)
    if not in_each:
        return np.asarray(flat[int(means.mean(axis=1).argmin())])
    result: Floats = flat[0].copy()
    result[known] = flat[means.argmin(axis=0), known]
    return result


def measure(seed: int, frames: int) -> dict[str, list[Record]]:
    """Return the scores of each frame, alone and in a sequence, with the distances of its `nodes` and `nodes_hidden`, mm."""
    config = load_config("default", {"merge.chains": 1, "sequence.chains": 1})
    truths, measured, observations = list[Truth](), list[Bools](), list[Observation]()
    for each in moving_ring(seed, frames):
        truths.append(each.truths[0])
        measured.append(measured_nodes(each.truths[0], each.frame.depth))
        observations.append(observe_frame(each.frame, config, each.mask))
    alone = [observation.detection for observation in observations]
    found = {"each frame alone": alone, "sequence": list(combine(observations, config))}
    return {name: list(_rows(name, detections, truths, measured)) for name, detections in found.items()}


def _rows(name: str, detections: Sequence[Detection], truths: Sequence[Truth], measured: Sequence[Bools]) -> Iterator[Record]:
    longest = [max(each.chains, key=lambda chain: chain.length, default=None) for each in detections]
    distances = 1e3 * ring_offsets(longest, truths, in_each=name != "sequence")
    for detection, truth, row, seen in zip(detections, truths, distances, measured, strict=True):
        known = np.isfinite(row)
        extra = {"nodes": row[known].tolist(), "nodes_hidden": row[known & ~seen].tolist()}
        yield Record(score(detection.chains, (truth,)) | extra | {"closed": bool(known.any())})


def table(seeds: int, frames: int) -> Iterator[str]:
    """Yield the lines of a Markdown table of rings in motion."""
    rows: dict[str, list[Record]] = {}
    for seed in range(seeds):
        for name, records in measure(seed, frames).items():
            rows.setdefault(name, []).extend(records)
    yield "| rings | frames | correct | closed | nodes, median | nodes, worst of ten | hidden, mean |"
    yield "|---|---|---|---|---|---|---|"
    for name, records in rows.items():
        nodes, hidden = (np.concatenate([each[key] for each in records]) for key in ("nodes", "nodes_hidden"))
        correct, closed = (sum(bool(each[key]) for each in records) for key in ("correct", "closed"))
        of_hidden = f"{hidden.mean():.1f} mm" if len(hidden) else "-"
        shown = f"{np.median(nodes):.1f} mm | {np.percentile(nodes, 90):.1f} mm | {of_hidden}" if len(nodes) else "- | - | -"
        yield f"| {name} | {len(records)} | {correct} | {closed} | {shown} |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        prog="python -m doo3d.evaluation.sequences.moving_rings", description="Measure rings in motion, with a hand before them."
    )
    parser.add_argument("--seeds", type=int, default=4, help="sequences")
    parser.add_argument("--frames", type=int, default=60, help="frames of each sequence, 30 a second")
    given = parser.parse_args()
    for line in table(given.seeds, given.frames):
        print(line, flush=True)  # noqa: T201
