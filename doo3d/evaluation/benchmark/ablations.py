"""Measure what each part of the method contributes: the same frames with one part turned off at a time."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from ...config import Config, load_config
from ..metrics.record import Record, Records
from ..metrics.score import COLUMNS
from .cases import Case
from .evaluate import detect_case
from .tables import grouped


@dataclass(frozen=True)
class Ablation:
    """The changes of settings and of constants in the source code that turn one part of the method off.

    Attributes
    ----------
    settings
        dotted key of the config -> value, such as "merge.strategy" -> "greedy".
    constants
        "module:NAME" of a constant in the source code -> value, such as "doo3d.stages.voxelize:USE_FILTERED_POINTS" -> False; for
        parts that no setting turns off.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    constants: Mapping[str, Any] = field(default_factory=dict)


DEFAULT = "everything on"
ABLATIONS: dict[str, Ablation] = {
    DEFAULT: Ablation(),
    "no cost for free space": Ablation({"merge.free_space_weight": 0}),
    "no cost for free or unknown space": Ablation({"merge.free_space_weight": 0, "merge.unknown_weight": 0}),
    "greedy merging": Ablation({"merge.strategy": "greedy"}),
    "end tangents of the last segment": Ablation({"merge.tangent_window_radii": 0}),
    "no curvature persistence": Ablation({"merge.curvature_persistence": 0}),
    "paths not cut back at junctions": Ablation(constants={"doo3d.stages.traverse.traverse:JUNCTION_CLEARANCE_RADII": 0.0}),
    "voxels from the whole strand width": Ablation({"voxelize.core_fraction": 0}),
    "voxels from unfiltered depth": Ablation(
        constants={
            "doo3d.stages.voxelize:USE_FILTERED_POINTS": False,
            "doo3d.stages.segment.depth_filter:MAX_DEPTH_ERROR_RADII": math.inf,
        }
    ),
    "no refinement from surface to axis": Ablation({"refine.iterations": 0}),
    "no smoothing of the axis": Ablation(constants={"doo3d.stages.refine.axis_and_radius:SMOOTHING_RADII": 0.0}),
    "depth weighted as lateral offset": Ablation(constants={"doo3d.stages.refine.axis_and_radius:DEPTH_WEIGHT": 1.0}),
}


@contextmanager
def constants_set(constants: Mapping[str, Any]) -> Iterator[None]:
    """Give constants in the source code other values inside a `with` block, and restore them at its end.

    Parameters
    ----------
    constants
        "module:NAME" -> value, such as "doo3d.stages.voxelize:USE_FILTERED_POINTS" -> False.

    Raises
    ------
    ImportError : there is no such module.
    AttributeError : a module has no such constant.
    """
    places = [(importlib.import_module(module), name) for module, _, name in (key.partition(":") for key in constants)]
    before = [getattr(module, name) for module, name in places]
    try:
        for (module, name), value in zip(places, constants.values(), strict=True):
            setattr(module, name, value)
        yield
    finally:
        for (module, name), value in zip(places, before, strict=True):
            setattr(module, name, value)


def ablated_config(preset: str, overrides: Mapping[str, Any], ablation: Ablation) -> Config:
    """Return a preset's config changed by overrides and then by the settings of an ablation, which take precedence.

    Parameters
    ----------
    preset
        name of a preset, or path of a YAML file.
    overrides
        dotted key -> value, such as "merge.chains" -> 2.
    ablation
        the ablation; its constants are not applied here (see `constants_set`).

    Raises
    ------
    ConfigError : there is no such preset, or a key or value is invalid.
    """
    return load_config(preset, {**overrides, **ablation.settings})


def run_ablations(
    cases: Sequence[Case],
    preset: str = "default",
    overrides: Mapping[str, Any] | None = None,
    report: Callable[[Record], None] = lambda row: None,
) -> dict[str, list[Record]]:
    """Score the detection on the same cases with one part of the method turned off at a time.

    The detection is given the true mask and the true number of cables.

    Parameters
    ----------
    cases
        the frames with known truth; each is rendered or read once.
    preset
        name of a preset, or path of a YAML file: the config that the ablations change.
    overrides
        dotted key -> value, applied to the preset; None for none.
    report
        called for each finished case with its row of the unchanged method ("everything on").

    Returns
    -------
    Name of the ablation -> a row for each case, in the order of `cases`; the unchanged method, "everything on", comes first.

    Raises
    ------
    ConfigError : there is no such preset, or a key or value is invalid.
    """
    configs = {name: ablated_config(preset, overrides or {}, ablation) for name, ablation in ABLATIONS.items()}
    rows: dict[str, list[Record]] = {name: [] for name in ABLATIONS}
    for case in cases:
        known = case.load()
        for name, ablation in ABLATIONS.items():
            with constants_set(ablation.constants):
                rows[name].append(detect_case(case, known, configs[name]))
        report(rows[DEFAULT][-1])
    return rows


def format_ablations(rows: Mapping[str, Records]) -> str:
    """Return a text table with a line for each ablation.

    The columns are, for each ablation:

    - correct frames of all frames, for each family of cases and for all;
    - occlusions passed correctly, of all occlusions;
    - the number of wrong connections;
    - the median RMS distance in mm from the true axis, where the axis is seen and where it is hidden.

    Parameters
    ----------
    rows
        name of the ablation -> its rows, as returned by `run_ablations`.
    """
    families = list(grouped(next(iter(rows.values()))))
    name_width = max(map(len, rows))
    columns = [(name, max(7, len(name))) for name in (*families, "all")]
    columns += [("occlusions", 10), ("wrong", 6), ("RMS seen", 9), ("hidden", 7)]
    lines = [" ".join([" " * name_width, *(f"{name:>{width}s}" for name, width in columns)])]
    for name, group in rows.items():
        total = {key: value for column in COLUMNS for key, value in column.summarize(group).items()}
        cells = [_share([row.correct for row in part]) for part in (*grouped(group).values(), group)]
        cells += [f"{total['occlusions_correct']}/{total['occlusions']}", f"{total['connections_wrong']}"]
        cells += [f"{total['rms_seen']:.2f}", f"{total['rms_hidden']:.2f}"]
        values = zip(cells, columns, strict=True)
        lines.append(" ".join([f"{name:{name_width}s}", *(f"{cell:>{width}s}" for cell, (_, width) in values)]))
    return "\n".join(lines)


def _share(correct: Sequence[bool]) -> str:
    return f"{sum(correct)}/{len(correct)}"
