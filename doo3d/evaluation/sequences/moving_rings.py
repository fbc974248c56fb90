"""Measure rings in motion: `python -m doo3d.evaluation.sequences.moving_rings`."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...config import load_config
from ...geometry.polyline import arc_length, resample
from ...track.detect_sequence import combine
from ...types import Floats
from ..benchmark.run import print_lines
from ..benchmark.tables import markdown_table
from ..metrics.record import Record, added, amount, number
from ..rendering.renderer import Rendered
from ..scenes.model import Scene, Truth
from ..scenes.stacking import spline_axis
from ..scenes.studio import cable_color, make_studio
from .evaluate import first_pass, variant_rows
from .motions import FRAME_RATE
from .scenes import SKIN_COLORS, Hand, solid_of, timed

HIDDEN_SHARE, LIFT = 0.3, 0.04
"""Fraction of the ring that the hand hides, and height of the ring's waves above the table, m."""

NODES = "nodes_seen nodes_hidden"
COLUMNS = (
    amount(("frames", ""), 0, "frames", len),
    amount(("correct", ""), 0, "correct", added("correct")),
    amount(("closed", ""), 0, "closed", lambda rows: sum(bool(row.nodes_seen or row.nodes_hidden) for row in rows)),
    number(("nodes,", "median, mm"), 0, NODES, 1),
    number(("nodes,", "worst of ten, mm"), 0, NODES, 1, partial(np.percentile, q=90), name="nodes_90"),
    number(("hidden,", "mean, mm"), 0, "nodes_hidden", 1, np.mean),
)
"""Columns of the table; only closed chains have nodes, see `variant_rows`."""


def moving_ring(seed: int, frames: int = 60) -> Iterator[Rendered]:
    """Render a ring that is bent, shifted and turned above a table while a hand passes; equal arguments give equal frames.

    seed, frames : seed and length of the sequence; the ring turns by half a radian in 2 s.
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
        solid = solid_of(hand, cable.axis, index)
        solids = () if solid is None else (solid,)
        scene = Scene(f"{index:04d}", f"ring-{seed}", seed, studio.camera, (cable,), solids, studio.table(), studio.light)
        yield timed(scene, index, "d435")


def _curve(waves: Floats, phases: Floats, time: float) -> Floats:
    """Return points (P, 3) m of a ring of about 0.1 m radius at a time in s, starting at the same material point."""
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    bent = np.ones(len(angles))
    for k in range(len(waves)):
        bent += waves[k] / (k + 1) * (1 + 0.6 * np.sin(2 * time + phases[k + 3])) * np.cos((k + 2) * angles + phases[k])
    turned = angles + 0.25 * time
    lifted = LIFT * (1 + np.cos(2 * angles + 0.5 * time)) / 2
    return np.column_stack((0.1 * bent * np.cos(turned), 0.1 * bent * np.sin(turned), lifted))


def _evenly(points: Floats) -> Floats:
    """Return evenly spaced points of a closed curve, starting at its first, since the material does not stretch."""
    around = np.concatenate((points, points[:1]))
    return resample(around, np.linspace(0.0, arc_length(around)[-1], len(around)))[:-1]


def measure(seed: int, frames: int) -> list[Record]:
    """Return the records of each frame, detected alone ("single") and in a sequence; see `variant_rows`."""
    config = load_config("default", {"merge.chains": 1})
    known = [first_pass(each, config) for each in moving_ring(seed, frames)]
    observations = [frame.observation for frame in known]
    together = list(combine(observations, config))
    return [*variant_rows("single", known, [each.detection for each in observations]), *variant_rows("sequence", known, together)]


def table(seeds: int = 4, frames: int = 60) -> Iterator[str]:
    """Yield the lines of a Markdown table of rings in motion while a hand passes in front.

    seeds : number of sequences. frames : number per sequence, 30 per second.
    """
    return markdown_table("rings", [row for seed in range(seeds) for row in measure(seed, frames)], COLUMNS)


if __name__ == "__main__":
    print_lines(table)
