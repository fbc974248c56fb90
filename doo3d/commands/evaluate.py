"""`doo3d evaluate`: measure the detection against known truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .arguments import CameraOption, InputOption, MaskOption, Overrides, Preset, config_of, save, split
from .evaluate_dataset import dataset
from .evaluate_options import SENSORS, check_choice, parse_sensor, parse_size, use_single_thread
from .evaluate_sequences import sequences
from .evaluate_trees import trees
from .progress_bars import counting

if TYPE_CHECKING:
    from ..evaluation.benchmark.cases import Case
    from ..evaluation.benchmark.evaluate import Masking
    from ..evaluation.benchmark.rows import Row

app = typer.Typer(no_args_is_help=True, help="Measure the detection against known truth.", rich_markup_mode=None)

MASKS: dict[str, Masking] = {"given": "mask", "ragged": "ragged", "hsv": "hsv", "auto": "auto"}
MIN_RELIABILITY_FRAMES = 20
"""Frames from which on a table of the reliability of the confidence says something."""

ABLATION_FAMILIES = "crossings,occluded,air,several,tangle,hairpin,knots"

Families = Annotated[
    str, typer.Option(help="Comma-separated families, or all; basic and more are halves of all; without: no cables; tough: hard.")
]
Seeds = Annotated[int, typer.Option(min=1, help="Scenes of each family.")]
Start = Annotated[int, typer.Option(min=0, metavar="SEED", help="Seed of the first scene of each family.")]
Sensor = Annotated[str, typer.Option(metavar="|".join(SENSORS), help="Simulated depth camera.")]
Size = Annotated[str, typer.Option(metavar="WxH", help="Size of the image, px.")]
Count = Annotated[str, typer.Option(metavar="given|auto", help="Give the number of cables, or decide it from the data.")]
Mask = Annotated[
    str,
    typer.Option(
        metavar="|".join(MASKS),
        help="Give the true mask, a spoiled one, or boxes round the cables' colors; or use the config.",
    ),
]
Truth = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Truth file; by default truth.json in INPUT, or beside a cloud."),
]
Csv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write a line per frame to FILE.")]
Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the summary and every frame to FILE.")]
Pictures = Annotated[Path | None, typer.Option(metavar="DIR", help="Draw the worst frames of each family into DIR.")]
Worst = Annotated[int, typer.Option(min=1, help="Number of frames of each family that are drawn.")]


@app.command()
def scenes(
    families: Families = "all",
    seeds: Seeds = 10,
    start: Start = 0,
    sensor: Sensor = "d435",
    size: Size = "1280x720",
    count: Count = "given",
    mask: Mask = "given",
    config: Preset = "default",
    overrides: Overrides = None,
    table: Csv = None,
    document: Json = None,
    pictures: Pictures = None,
    worst: Worst = 1,
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
    use_single_thread()
    from ..evaluation.benchmark import cases

    chosen = cases.scene_cases(_families(families), range(start, start + seeds), parse_sensor(sensor), parse_size(size))
    settings = {"families": families, "seeds": seeds, "start": start, "sensor": sensor, "size": size}
    _run(chosen, settings, (config, overrides), (count, mask), (table, document, pictures, worst))


@app.command()
def samples(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Captures and clouds with truth files beside them, such as sample_clouds.")
    ],
    count: Count = "given",
    config: Preset = "default",
    overrides: Overrides = None,
    table: Csv = None,
    document: Json = None,
    pictures: Pictures = None,
    worst: Worst = 1,
) -> None:
    """Detect in all captures and clouds below FOLDER that have a truth file, and compare the chains with the truth.

    Prints a table of scores.

    \b
    Example:
      doo3d evaluate samples sample_clouds
    """
    use_single_thread()
    from ..evaluation.benchmark import cases

    chosen = cases.folder_cases(folder)
    _run(chosen, {"folder": str(folder)}, (config, overrides), (count, "given"), (table, document, pictures, worst))


@app.command()
def capture(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture folder or a cloud file.")],
    truth: Truth = None,
    mask: MaskOption = None,
    input_options: InputOption = None,
    camera: CameraOption = None,
    count: Count = "given",
    config: Preset = "default",
    overrides: Overrides = None,
    table: Csv = None,
    document: Json = None,
    pictures: Pictures = None,
    worst: Worst = 1,
) -> None:
    """Detect in the frames of INPUT that the truth file names, and compare the chains with the truth.

    Prints a table of scores. A frame that cannot be read counts as wrong.

    \b
    Example:
      doo3d evaluate capture sample_clouds/crossing --truth sample_clouds/crossing/truth.json
    """
    use_single_thread()
    from ..evaluation.benchmark import cases
    from ..inputs import ReadOptions

    chosen = cases.capture_cases(capture, truth, masks=mask, options=ReadOptions.from_pairs(input_options, camera))
    settings = {
        "capture": str(capture),
        "truth": truth and str(truth),
        "masks": mask and str(mask),
        "input_options": [*(input_options or []), *([f"camera_file={camera}"] if camera else [])],
    }
    _run(chosen, settings, (config, overrides), (count, "given"), (table, document, pictures, worst))


@app.command()
def results(
    folder: Annotated[Path, typer.Argument(metavar="OUT", help="Folder written by doo3d detect.")],
    truth: Annotated[Path, typer.Option(metavar="FILE", help="Truth file.")],
    table: Csv = None,
    document: Json = None,
) -> None:
    """Compare the results that doo3d detect wrote to OUT with a truth file.

    Prints a table of scores.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d evaluate results out --truth sample_clouds/crossing/truth.json
    """
    from ..evaluation.benchmark.stored_results import result_rows

    _report(result_rows(folder, truth), {"results": str(folder), "truth": str(truth)}, table, document)


@app.command()
def ablations(
    families: Families = ABLATION_FAMILIES,
    seeds: Seeds = 10,
    start: Start = 0,
    sensor: Sensor = "d435",
    size: Size = "1280x720",
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Detect in hard rendered scenes with one part of the method turned off at a time, and compare with the truth.

    Prints a table with a line of scores per part that was turned off.

    \b
    Example:
      doo3d evaluate ablations --families knots --seeds 5
    """
    use_single_thread()
    from ..config import parse_overrides
    from ..evaluation.benchmark.ablations import format_ablations, run_ablations
    from ..evaluation.benchmark.cases import scene_cases

    chosen = scene_cases(_families(families), range(start, start + seeds), parse_sensor(sensor), parse_size(size))
    with counting(len(chosen)) as report:
        rows = run_ablations(chosen, config, parse_overrides(overrides or []), report)
    typer.echo(format_ablations(rows))


app.command()(sequences)
app.command()(dataset)
app.command()(trees)


def _run(
    cases: Sequence[Case],
    settings: Mapping[str, Any],
    preset_and_overrides: tuple[str, list[str] | None],
    count_and_mask: tuple[str, str],
    outputs: tuple[Path | None, Path | None, Path | None, int],
) -> None:
    """Detect and score; print and write the result.

    Parameters
    ----------
    cases
        the frames.
    settings
        options that the JSON file repeats.
    preset_and_overrides, count_and_mask
        as given to the command.
    outputs
        CSV file, JSON file, folder of pictures, and their number per family.
    """
    from ..evaluation.benchmark.evaluate import evaluate
    from ..evaluation.benchmark.rows import by_family, worst

    count, mask = check_choice("--count", count_and_mask[0], ("given", "auto")), check_choice("--mask", count_and_mask[1], MASKS)
    table, document, pictures, drawn = outputs
    preset, overrides = preset_and_overrides
    config = config_of(preset, overrides)
    with counting(len(cases)) as report:
        rows = evaluate(cases, config, count == "given", MASKS[mask], report)
    for row in rows:
        if row.case is None:
            typer.echo(f"{row.name}   cannot be read: {row.error} [{row.code}]", err=True)
    effective = {**settings, "count": count, "mask": mask, "config": preset, "set": overrides or []}
    _report(rows, effective, table, document)
    if pictures:
        from ..evaluation.benchmark.pictures import write_pictures

        families = by_family([row for row in rows if row.case is not None])
        try:
            paths = write_pictures(pictures, [row for family in families.values() for row in worst(family, drawn)])
        except OSError as error:
            raise InputError(f"{pictures}: cannot be written to ({error.strerror})", code="out-unwritable") from None
        typer.echo("\n".join(map(str, paths)))


def _report(rows: Sequence[Row], settings: Mapping[str, Any], table: Path | None, document: Path | None) -> None:
    """Print the tables of scores and of the reliability of the confidence, and write the CSV and the JSON file."""
    from ..evaluation.benchmark.tables import csv_text, format_reliability, format_table, json_text

    typer.echo(format_table(rows))
    if len(rows) >= MIN_RELIABILITY_FRAMES:
        typer.echo("\n" + format_reliability(rows))
    if table:
        save(table, csv_text(rows))
    if document:
        save(document, json_text(rows, settings))


def _families(names: str) -> list[str]:
    """Return the families of a comma-separated list."""
    from ..evaluation.scenes.registry import FAMILIES, GROUPS, TOUGH, WITHOUT

    chosen: list[str] = []
    for name in split(names) or []:
        check_choice("--families", name, [*FAMILIES, *WITHOUT, *TOUGH, *GROUPS])
        chosen += GROUPS.get(name, (name,))
    return list(dict.fromkeys(chosen))
