"""Implement `doo3d evaluate`: measure the detection against known truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import evaluate_options as shared
from .arguments import DEFAULT_READING, DEFAULT_SETTINGS, Reading, Settings, split, with_groups
from .evaluate_ablations import ablations
from .evaluate_dataset import dataset
from .evaluate_predictions import predictions, sets
from .evaluate_sequences import sequences
from .evaluate_trees import trees

if TYPE_CHECKING:
    from ..evaluation.benchmark.cases import Case

app = typer.Typer(no_args_is_help=True, help="Measure the detection against known truth.", rich_markup_mode=None)


Families = Annotated[
    str, typer.Option(help="Comma-separated families, or all; basic and more are halves of all; without: no cables; tough: hard.")
]
Truth = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Truth file; by default truth.json in INPUT, or beside a cloud.")
]


@app.command()
@with_groups
def scenes(
    families: Families = "all",
    seeds: shared.Seeds = 10,
    start: shared.Start = 0,
    sensor: shared.Sensor = "d435",
    size: shared.Size = "1280x720",
    count: shared.Count = "given",
    mask: shared.Mask = "given",
    settings: Settings = DEFAULT_SETTINGS,
    outputs: shared.Outputs = shared.ONE_PICTURE,
) -> None:
    """Render scenes with known cables, detect in them, and compare the chains with the truth.

    Prints a table with a line of scores per family of scenes, and how many of the frames of each confidence are right.

    \b
    Examples:
      doo3d evaluate scenes --families all --seeds 20
      doo3d evaluate scenes --families tangle,knots --count auto --mask auto --csv rows.csv --json rows.json
      doo3d evaluate scenes --families thin --sensor zivid --pictures worst --worst 3
      doo3d evaluate scenes --sensor stereo --mask ragged --size 848x480
      doo3d evaluate scenes --families without --seeds 20
      doo3d evaluate scenes --families without --seeds 20 -c image
    """
    shared.use_single_thread()
    from ..evaluation.benchmark import cases

    camera, pixels = shared.parse_sensor(sensor), shared.parse_size(size)
    chosen = cases.scene_cases(_families(families), range(start, start + seeds), camera, pixels)
    chosen_by = {"families": families, "seeds": seeds, "start": start, "sensor": sensor, "size": size}
    _run(chosen, chosen_by, settings, (count, mask), outputs)


@app.command()
@with_groups
def samples(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Captures and clouds with truth files beside them, such as sample_clouds.")
    ],
    sensor: Annotated[
        str,
        typer.Option(
            metavar="|".join(shared.DEPTHS),
            help="Depth of a capture with truth.npz: its own (stereo), or other/depth_simple.png.",
        ),
    ] = "own",
    count: shared.Count = "given",
    mask: shared.FewMasks = "given",
    settings: Settings = DEFAULT_SETTINGS,
    outputs: shared.Outputs = shared.ONE_PICTURE,
) -> None:
    """Detect in all captures and clouds below FOLDER that have a truth file, and compare the chains with the truth.

    Prints a table of scores.

    \b
    Examples:
      doo3d evaluate samples sample_clouds
      doo3d evaluate samples FOLDER --sensor simple --mask ragged
    """
    shared.use_single_thread()
    from ..evaluation.benchmark import cases

    chosen = cases.folder_cases(folder, shared.DEPTHS[shared.check_choice("--sensor", sensor, shared.DEPTHS)])
    shared.check_choice("--mask", mask, shared.FEW_MASKS)
    chosen_by = {"folder": str(folder), "sensor": sensor}
    _run(chosen, chosen_by, settings, (count, mask), outputs)


@app.command()
@with_groups
def capture(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture folder or a cloud file.")],
    truth: Truth = None,
    reading: Reading = DEFAULT_READING,
    count: shared.Count = "given",
    settings: Settings = DEFAULT_SETTINGS,
    outputs: shared.Outputs = shared.ONE_PICTURE,
) -> None:
    """Detect in the frames of INPUT that the truth file names, and compare the chains with the truth.

    Prints a table of scores. A frame that cannot be read counts as wrong.

    \b
    Example:
      doo3d evaluate capture sample_clouds/crossing --truth sample_clouds/crossing/truth.json
    """
    shared.use_single_thread()
    from ..evaluation.benchmark import cases

    chosen = cases.capture_cases(capture, truth, masks=reading.mask, options=reading.options())
    chosen_by = {
        "capture": str(capture),
        "truth": truth and str(truth),
        "masks": reading.mask and str(reading.mask),
        "input_options": [*(reading.input_options or []), *([f"camera_file={reading.camera}"] if reading.camera else [])],
    }
    _run(chosen, chosen_by, settings, (count, "given"), outputs)


@app.command()
def results(
    folder: Annotated[Path, typer.Argument(metavar="OUT", help="Folder written by doo3d detect.")],
    truth: Annotated[Path, typer.Option(metavar="FILE", help="Truth file.")],
    table: shared.Csv = None,
    document: shared.Json = None,
) -> None:
    """Compare the results that doo3d detect wrote to OUT with a truth file.

    Prints a table of scores.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d evaluate results out --truth sample_clouds/crossing/truth.json
    """
    from ..config import Config
    from ..evaluation.benchmark.evaluate import frame_benchmark, result_rows

    settings = {"results": str(folder), "truth": str(truth)}
    shared.show(result_rows(folder, truth), frame_benchmark(Config()), settings, shared.Outputs(table, document))


app.command()(ablations)
app.command()(sequences)
app.command()(dataset)
app.command()(trees)
app.command()(predictions)
app.command()(sets)


def _run(
    cases: Sequence[Case],
    chosen_by: Mapping[str, Any],
    settings: Settings,
    count_and_mask: tuple[str, str],
    outputs: shared.Outputs,
) -> None:
    """Run the detection in frames and score them; print and write the result.

    Parameters
    ----------
    cases
        the frames.
    chosen_by
        options that are stored in the JSON file.
    settings, count_and_mask
        as given to the command.
    outputs
        files and folders that are written.
    """
    from ..evaluation.benchmark.evaluate import frame_benchmark

    count = shared.check_choice("--count", count_and_mask[0], ("given", "auto"))
    mask = shared.check_choice("--mask", count_and_mask[1], shared.MASKS)
    config = settings.load()
    effective = {**chosen_by, "count": count, "mask": mask, "config": settings.config, "set": settings.overrides or []}
    shared.measure(frame_benchmark(config, count == "given", shared.MASKS[mask]), cases, effective, outputs, config)


def _families(names: str) -> list[str]:
    """Return the families named in a comma-separated list, with names of groups replaced by their families."""
    from ..evaluation.scenes.registry import FAMILIES, GROUPS, TOUGH, WITHOUT

    chosen: list[str] = []
    for name in split(names) or []:
        shared.check_choice("--families", name, [*FAMILIES, *WITHOUT, *TOUGH, *GROUPS])
        chosen += GROUPS.get(name, (name,))
    return list(dict.fromkeys(chosen))
