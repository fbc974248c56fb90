"""`doo3d evaluate`: how good the detection is, against known truth."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ConfigError, InputError
from . import photos
from .arguments import InputOption, MaskOption, Overrides, Preset, config_of, save, split
from .progress import counting, say_compiling

if TYPE_CHECKING:
    from ..evaluation.benchmark.cases import Case
    from ..evaluation.benchmark.evaluate import Masking
    from ..evaluation.benchmark.rows import Row

app = typer.Typer(no_args_is_help=True, help="How good the detection is, against known truth.", rich_markup_mode=None)

MASKS: dict[str, Masking] = {"given": "mask", "hsv": "hsv", "auto": "auto"}
SENSORS = {"d435": "d435", "d455": "d455", "zivid": "zivid", "perfect": "none"}
ABLATED = "crossings,occluded,air,several,tangle,hairpin,knots"

Families = Annotated[str, typer.Option(help="Comma-separated families of scenes, or all.")]
Seeds = Annotated[int, typer.Option(min=1, help="Scenes of each family.")]
Start = Annotated[int, typer.Option(min=0, metavar="SEED", help="The seed of the first scene of each family.")]
Sensor = Annotated[str, typer.Option(metavar="|".join(SENSORS), help="The depth camera.")]
Size = Annotated[str, typer.Option(metavar="WxH", help="Of the image, px.")]
Count = Annotated[str, typer.Option(metavar="given|auto", help="Say how many cables there are, or leave it to the data.")]
Mask = Annotated[
    str, typer.Option(metavar="|".join(MASKS), help="The true mask, boxes round the cables' colours, or as the config does it.")
]
Truth = Annotated[
    Path | None, typer.Option(metavar="FILE", help="What is there; by default truth.json in INPUT, or beside a cloud.")
]
Csv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write a line per frame here.")]
Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the summary and every frame here.")]
Pictures = Annotated[Path | None, typer.Option(metavar="DIR", help="Draw the worst frames of each family into DIR.")]
Worst = Annotated[int, typer.Option(min=1, help="How many of each family are drawn.")]


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
    """Render scenes of known truth, detect in them and score.

    \b
    Examples:
      doo3d evaluate scenes --families all --seeds 20
      doo3d evaluate scenes --families tangle,knots --count auto --mask auto --csv rows.csv --json rows.json
      doo3d evaluate scenes --families thin --sensor zivid --pictures worst --worst 3
    """
    _single_thread()
    from ..evaluation.benchmark import cases

    chosen = cases.scene_cases(_families(families), range(start, start + seeds), _sensor(sensor), _size(size))
    settings = {"families": families, "seeds": seeds, "start": start, "sensor": sensor, "size": size}
    _run(chosen, settings, (config, overrides), (count, mask), (table, document, pictures, worst))


@app.command()
def samples(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Captures and clouds with their truth beside them, such as sample_clouds.")
    ],
    count: Count = "given",
    config: Preset = "default",
    overrides: Overrides = None,
    table: Csv = None,
    document: Json = None,
    pictures: Pictures = None,
    worst: Worst = 1,
) -> None:
    """Detect in all captures below FOLDER and score against their truth."""
    _single_thread()
    from ..evaluation.benchmark import cases

    chosen = cases.folder_cases(folder)
    _run(chosen, {"folder": str(folder)}, (config, overrides), (count, "given"), (table, document, pictures, worst))


@app.command()
def capture(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture folder or a cloud file.")],
    truth: Truth = None,
    mask: MaskOption = None,
    input_options: InputOption = None,
    count: Count = "given",
    config: Preset = "default",
    overrides: Overrides = None,
    table: Csv = None,
    document: Json = None,
    pictures: Pictures = None,
    worst: Worst = 1,
) -> None:
    """Detect in the frames of INPUT of which the truth is known, and score; one that cannot be read counts as wrong.

    \b
    Example:
      doo3d evaluate capture sample_clouds/crossing --truth sample_clouds/crossing/truth.json
    """
    _single_thread()
    from ..evaluation.benchmark import cases
    from ..inputs import ReadOptions

    chosen = cases.capture_cases(capture, truth, masks=mask, options=ReadOptions.from_pairs(input_options or []))
    settings = {
        "capture": str(capture),
        "truth": truth and str(truth),
        "masks": mask and str(mask),
        "input_options": input_options or [],
    }
    _run(chosen, settings, (config, overrides), (count, "given"), (table, document, pictures, worst))


@app.command()
def results(
    folder: Annotated[Path, typer.Argument(metavar="OUT", help="What doo3d detect wrote.")],
    truth: Annotated[Path, typer.Option(metavar="FILE", help="What is there.")],
    table: Csv = None,
    document: Json = None,
) -> None:
    """Score results that are there already.

    \b
    Example:
      doo3d detect sample_clouds/crossing -o out && doo3d evaluate results out --truth sample_clouds/crossing/truth.json
    """
    from ..evaluation.benchmark.stored_results import result_rows

    _say(result_rows(folder, truth), {"results": str(folder), "truth": str(truth)}, table, document)


@app.command()
def ablations(
    families: Families = ABLATED,
    seeds: Seeds = 10,
    start: Start = 0,
    sensor: Sensor = "d435",
    size: Size = "1280x720",
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Render hard scenes and score them with one means of the method turned off at a time."""
    _single_thread()
    from ..config import load_config, parse_overrides
    from ..evaluation.benchmark.ablations import ABLATIONS, ablate, format_ablations
    from ..evaluation.benchmark.cases import scene_cases

    chosen = scene_cases(_families(families), range(start, start + seeds), _sensor(sensor), _size(size))
    own = parse_overrides(overrides or [])
    variants = {name: load_config(config, own | off) for name, off in ABLATIONS.items()}
    say_compiling()
    with counting(len(chosen)) as report:
        rows = ablate(chosen, variants, report)
    typer.echo(format_ablations(rows))


@app.command()
def tubes(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Tube configurations: text files of straight cylinders.")],
    seeds: Seeds = 3,
    start: Start = 0,
    sensor: Sensor = "d435",
    size: Size = "1280x720",
    config: Preset = "tubes",
    overrides: Overrides = None,
) -> None:
    """Render entangled tubes, detect in them with their mask and number given, and count those that are right, tube by tube.

    \b
    Example:
      doo3d evaluate tubes DIR --seeds 5
    """
    _single_thread()
    from ..evaluation.metrics.tubes import evaluate_tubes, format_tubes, tube_cases

    cases = tube_cases(folder, range(start, start + seeds), _sensor(sensor), _size(size))
    say_compiling()
    typer.echo(format_tubes(evaluate_tubes(cases, config_of(config, overrides))))


app.command("mbest")(photos.mbest)
app.command("cset")(photos.cset)


def _run(
    cases: Sequence[Case],
    settings: Mapping[str, Any],
    configured: tuple[str, list[str] | None],
    how: tuple[str, str],
    out: tuple[Path | None, Path | None, Path | None, int],
) -> None:
    """Detect, score, and say and write what comes of it.

    configured : preset and overrides. how : --count and --mask. out : CSV, JSON, pictures and how many.
    """
    from ..evaluation.benchmark.evaluate import evaluate
    from ..evaluation.benchmark.rows import by_family, worst

    count, mask = _one_of("--count", how[0], ("given", "auto")), _one_of("--mask", how[1], MASKS)
    table, document, pictures, drawn = out
    config = config_of(*configured)
    say_compiling()
    with counting(len(cases)) as report:
        rows = evaluate(cases, config, count == "given", MASKS[mask], report)
    for row in rows:
        if row.case is None:
            typer.echo(f"{row.name}   cannot be read: {row.error}", err=True)
    said = {**settings, "count": count, "mask": mask, "config": configured[0], "set": configured[1] or []}
    _say(rows, said, table, document)
    if pictures:
        from ..evaluation.benchmark.pictures import write_pictures

        shown = [row for row in rows if row.case is not None]
        try:
            paths = write_pictures(pictures, [row for own in by_family(shown).values() for row in worst(own, drawn)])
        except OSError as error:
            raise InputError(f"{pictures}: cannot be written to ({error.strerror})", code="out-unwritable") from None
        typer.echo("\n".join(map(str, paths)))


def _say(rows: Sequence[Row], settings: Mapping[str, Any], table: Path | None, document: Path | None) -> None:
    from ..evaluation.benchmark.tables import csv_text, format_table, json_text

    typer.echo(format_table(rows))
    if table:
        save(table, csv_text(rows))
    if document:
        save(document, json_text(rows, settings))


def _single_thread() -> None:
    from ..runs.threads import single_thread

    single_thread()


def _families(names: str) -> list[str]:
    from ..evaluation.scenes.registry import FAMILIES

    chosen = list(FAMILIES) if names == "all" else split(names) or []
    for name in chosen:
        _one_of("--families", name, FAMILIES)
    return chosen


def _sensor(name: str) -> str:
    return SENSORS[_one_of("--sensor", name, SENSORS)]


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) >= 64 and int(height) >= 64):
        raise ConfigError(
            f"--size {text}: expected WIDTHxHEIGHT in pixels, 64x64 at least, such as 1280x720", code="value-invalid"
        )
    return int(width), int(height)


def _one_of(option: str, value: str, choices: Collection[str]) -> str:
    if value not in choices:
        raise ConfigError(f"{option} {value}: there are {', '.join(choices)}", code="choice-unknown")
    return value
