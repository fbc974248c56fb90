"""The commands. Only this module prints and exits; what is heavy is imported inside the commands."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from . import __version__
from .errors import ConfigError, DooError

if TYPE_CHECKING:
    from .batch import FrameRecord
    from .config import Config
    from .evaluation.photos import Row

SOME_FAILED, NOTHING_DONE = 1, 2  # exit codes


class Commands(TyperGroup):
    """The commands, with what doo3d refuses said in one sentence."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command; a DooError ends it with exit code 2 and no traceback."""
        try:
            return super().invoke(ctx)
        except DooError as error:
            typer.echo(f"doo3d: {error}", err=True)
            raise typer.Exit(NOTHING_DONE) from None


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
evaluate = typer.Typer(no_args_is_help=True, help="How good the detection is, against known truth.", rich_markup_mode=None)
app.add_typer(evaluate, name="evaluate")

Preset = Annotated[str, typer.Option("--config", "-c", help="A preset (see doo3d presets) or a YAML file.")]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set one field, such as merge.chains=2; repeat for more.")
]
MaskOption = Annotated[
    Path | None, typer.Option("--mask", help="The object's pixels, instead of the capture's own: an image, or a folder of them.")
]


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"doo3d {__version__}")
        raise typer.Exit


@app.callback()
def doo3d(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Cables, ropes, hoses and wires as chains of equal segments: 3-D from RGB-D frames and clouds, 2-D from images.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out       a folder with color/, depth/, camera_intrinsic.json
      doo3d detect scan.ply -o out                     one point cloud
      doo3d detect capture --set merge.chains=2        two cables
      doo3d detect photo.jpg -c image --mask mask.png  in 2-D: a photograph, a folder of them, or a video
      doo3d config > mine.yaml                         all settings, to change and give back with -c mine.yaml
      doo3d compare capture                            where 3-D and 2-D differ
      doo3d bench                                      milliseconds per stage on this machine

    Each frame gives OUT/<frame>.json (the chains) and OUT/<frame>.png (the chains over the image).
    """


@app.command()
def detect(
    capture: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="A capture folder or a cloud file (PLY, PCD, XYZ, NPZ); in 2-D images or a video."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder for the results.")] = Path("out"),
    config: Preset = "default",
    overrides: Overrides = None,
    mask: MaskOption = None,
    force: Annotated[bool, typer.Option("--force", help="Write into OUT though it holds something else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Find the chains in every frame of INPUT and write them to OUT.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out
      doo3d detect capture -o out -c mine.yaml --set merge.chains=2 --set fit.segment_length=0.005
      doo3d detect sample_clouds/photos -o out -c image

    Exit code 0: all frames are fine; 1: some failed (see OUT/manifest.json); 2: nothing could be done, nothing was written.
    """
    from .inputs import open_capture

    effective = _config(config, overrides)
    opened = open_capture(capture, effective.mode == "2d", mask)
    from . import batch
    from .outputs.lines import closing_line

    if not quiet:
        _say_compiling()
    names = [entry.name for entry in opened.frames]
    with _reporting(len(names), max(map(len, names), default=0), quiet) as report:
        summary = batch.run(opened, out, effective, force=force, report=report)
    counts = summary.counts()
    if not summary.succeeded:
        if len(names) > 1:
            typer.echo(f"doo3d: all {len(names)} frames failed, nothing was written", err=True)
        raise typer.Exit(NOTHING_DONE)
    if not quiet:
        typer.echo(closing_line(counts["frames"], summary.failed, counts["chains"], str(out)))
    if summary.failed:
        raise typer.Exit(SOME_FAILED)


@app.command()
def compare(
    capture: Annotated[Path, typer.Argument(metavar="INPUT", help="A capture folder with depth.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder for the pictures.")] = Path("compare"),
    config: Preset = "default",
    overrides: Overrides = None,
    flat: Annotated[str, typer.Option("--config-2d", help="The preset or YAML file of the 2-D mode.")] = "image",
    flat_overrides: Annotated[
        list[str] | None, typer.Option("--set-2d", metavar="KEY=VALUE", help="Set one field for the 2-D mode.")
    ] = None,
    mask: MaskOption = None,
    force: Annotated[bool, typer.Option("--force", help="Write into OUT though it holds something else.")] = False,
) -> None:
    """Detect in every frame of INPUT in 3-D and in 2-D, from the same mask, and show where the two differ.

    The 3-D chains, seen in the image, are to lie within 2 px of the 2-D chains, or within half their width where that is
    more, in the same order. A wanted number of chains (merge.chains) counts for both.

    \b
    Example:
      doo3d compare sample_clouds/crossing -o compare

    Exit code 0: both agree in all frames; 1: they differ in some, or a frame failed; 2: nothing could be compared.
    """
    from .config import load_config, parse_overrides
    from .inputs import open_capture

    effective = _config(config, overrides)
    wanted = {} if effective.merge.chains is None else {"merge.chains": effective.merge.chains}
    effective_flat = load_config(flat, wanted | parse_overrides(flat_overrides or []))
    opened = open_capture(capture, masks=mask)
    from .compare import compare_capture

    column = max((len(entry.name) for entry in opened.frames), default=0)
    _say_compiling()
    records = compare_capture(
        *(opened, out, effective, effective_flat),
        force=force,
        report=lambda record: typer.echo("\n".join(record.lines(column)), err=record.comparison is None),
    )
    if not any(record.comparison for record in records):
        raise typer.Exit(NOTHING_DONE)
    agree = sum(record.agrees for record in records)
    typer.echo(f"{agree} of {len(records)} frame{'s' * (len(records) > 1)} agree -> {out}")
    if agree < len(records):
        raise typer.Exit(SOME_FAILED)


@app.command()
def bench(
    captures: Annotated[
        list[Path] | None, typer.Argument(metavar="[INPUT]...", help="Captures, the first frame of each; none: one is rendered.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="How often each frame is run and counted.")] = 20,
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Print the milliseconds of each stage, in one process and one thread."""
    from . import bench as timing

    timing.single_thread()
    for i, result in enumerate(timing.bench(captures or [], _config(config, overrides), runs)):
        typer.echo("\n".join([""] * (i > 0) + result.lines()))


@app.command()
def presets() -> None:
    """List the presets that -c takes by name."""
    from .config import preset_folder, preset_names

    for name in preset_names():
        lines = (preset_folder() / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
        about = [line.removeprefix("#").strip() for line in lines if line.startswith("#")]
        typer.echo(f"{name:<12}  {' '.join(about).partition('. ')[0].rstrip('.')}.")


@app.command("config")
def show_config(
    name: Annotated[str, typer.Argument(help="A preset or a YAML file.")] = "default",
    overrides: Overrides = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the page of the documentation instead.")] = False,
) -> None:
    """Print the effective configuration, each field explained."""
    from .outputs import settings

    typer.echo(settings.markdown() if markdown else settings.annotated_yaml(_config(name, overrides)), nl=False)


@app.command()
def samples(folder: Annotated[Path, typer.Argument(help="Where to; made when it is not there.")]) -> None:
    """Render the sample captures and clouds into FOLDER."""
    from .evaluation.samples import write_samples

    for path in write_samples(folder):
        typer.echo(path)


@evaluate.command("samples")
def evaluate_samples(
    folder: Annotated[Path, typer.Argument(help="Captures and clouds with their truth beside them, such as sample_clouds.")],
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Detect in all captures below FOLDER and score against their truth."""
    from .evaluation import table

    typer.echo(table.format_table(table.evaluate_captures(folder, _config(config, overrides))))


@evaluate.command("scenes")
def evaluate_scenes(
    families: Annotated[str, typer.Option(help="Comma-separated families of scenes, or all.")] = "all",
    seeds: Annotated[int, typer.Option(min=1, help="Scenes of each family.")] = 10,
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Render scenes of known truth, detect in them and score."""
    from .evaluation import table
    from .evaluation.scenes import FAMILIES

    chosen = list(FAMILIES) if families == "all" else [name.strip() for name in families.split(",")]
    if unknown := [name for name in chosen if name not in FAMILIES]:
        raise ConfigError(f"--families {unknown[0]}: there are {', '.join(FAMILIES)}")
    typer.echo(table.format_table(table.evaluate_scenes(chosen, range(seeds), _config(config, overrides))))


Subsets = Annotated[str | None, typer.Option("--subset", metavar="S1,S2", help="Comma-separated subsets; none: all.")]
KnownCount = Annotated[
    bool, typer.Option("--known-count/--chains-from-data", help="Say how many cables there are; else as the config does.")
]
Table = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write a line per image here.")]
Worst = Annotated[int, typer.Option(min=0, help="Name this many of the worst images.")]
Pictures = Annotated[Path | None, typer.Option(metavar="DIR", help="Draw the worst images (5 without --worst) into DIR.")]


@evaluate.command("mbest")
def evaluate_mbest(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="S1, S2, S3 with images/ and labels/ each, or mBEST's checkout.")],
    config: Preset = "image",
    overrides: Overrides = None,
    subsets: Subsets = None,
    masks: Annotated[str, typer.Option(metavar="labels|hsv", help="The labels' foreground, or the cables' colour.")] = "labels",
    known_count: KnownCount = False,
    single: Annotated[bool, typer.Option("--single", help="Each cable alone: is it traced?")] = False,
    table: Table = None,
    worst: Worst = 0,
    pictures: Pictures = None,
) -> None:
    """Detect in mBEST's photographs of one to three cables (S1 to S3) and score against their labels.

    drawn: DICE of the chains drawn with their own width; labelled: of the mask with each pixel given to the nearest chain;
    ordered: the same with pixels that the right chain covers left to it, as the upper cable's at a crossing.
    """
    from . import bench

    bench.single_thread()
    from .evaluation import photos, photos_data

    if single and (masks != "labels" or known_count):
        raise ConfigError("--single goes by each cable's label and wants one chain: leave --masks and --known-count out")
    entries, effective = photos_data.mbest(folder, masks, _split(subsets)), _config(config, overrides)
    rows = photos.evaluate_cables(entries, effective) if single else photos.evaluate_photos(entries, effective, known_count)
    _say_photos(rows, table, worst, pictures)


@evaluate.command("cset")
def evaluate_cset(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="images/, labels/ and masks/, or the checkout of CVF3D-DLO.")],
    config: Preset = "image",
    overrides: Overrides = None,
    subsets: Subsets = None,
    masks: Annotated[str, typer.Option(metavar="labels|network", help="The labels' foreground, or masks/.")] = "labels",
    known_count: KnownCount = False,
    table: Table = None,
    worst: Worst = 0,
    pictures: Pictures = None,
) -> None:
    """Detect in photographs of cables before busy backgrounds (C1 to C3) and score against their labels."""
    from . import bench

    bench.single_thread()
    from .evaluation import photos, photos_data

    entries = photos_data.cset(folder, masks, _split(subsets))
    _say_photos(photos.evaluate_photos(entries, _config(config, overrides), known_count), table, worst, pictures)


def main() -> None:
    """The command `doo3d`."""
    app(prog_name="doo3d")


def _config(name: str, overrides: list[str] | None) -> Config:
    from .config import load_config, parse_overrides

    return load_config(name, parse_overrides(overrides or []))


def _split(names: str | None) -> list[str] | None:
    return None if names is None else [name.strip() for name in names.split(",")]


def _say_photos(rows: list[Row], table: Path | None, worst: int, pictures: Path | None) -> None:
    from .evaluation import photos, photos_pictures
    from .outputs.atomic import write_text

    typer.echo(photos.format_rows(rows))
    chosen = photos.worst(rows, worst or (5 if pictures else 0))
    for row in chosen:
        typer.echo(f"worst: {photos.caption(row)}")
    if table:
        write_text(table, photos.csv_text(rows))
    if pictures:
        for path in photos_pictures.write_pictures(pictures, chosen):
            typer.echo(path)


def _say_compiling() -> None:
    from .kernels import compiled

    if not compiled():
        typer.echo("the first run compiles for some seconds ...", err=True)


@contextmanager
def _reporting(total: int, column: int, quiet: bool) -> Iterator[Callable[[FrameRecord], None]]:
    """What prints a line per frame, with a bar below where there is a terminal and more than one frame."""
    from .outputs.lines import failure_line, frame_line

    def show(record: FrameRecord, say: Callable[..., None]) -> None:
        if record.error is not None:
            say(failure_line(record.name, record.error, column) if total > 1 else f"doo3d: {record.error}", err=True)
        elif not quiet:
            line = frame_line(record.name, record.lengths, record.radii, record.occluded, record.units, record.seconds, column)
            say("\n".join([line, *(f"{'':<{column}}   note: {note}" for note in record.notes)]))

    if quiet or total < 2 or not sys.stderr.isatty():
        yield lambda record: show(record, typer.echo)
        return
    with _bar(total) as (above, step):

        def advance(record: FrameRecord) -> None:
            show(record, above)
            step(record)

        yield advance


@contextmanager
def _bar(total: int) -> Iterator[tuple[Callable[..., None], Callable[[FrameRecord], None]]]:
    """A progress bar on stderr, drawn between frames only; with it, what prints above it and what moves it on."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    tail = TextColumn("{task.fields[chains]} chains, {task.fields[failed]} failed")
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn(), tail)
    console = Console(stderr=True)
    with Progress(*columns, console=console, auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        task = progress.add_task("", total=total, chains=0, failed=0, rate="")
        chains, failed = 0, 0

        def above(text: str, err: bool = False) -> None:
            if err or sys.stdout.isatty():
                console.print(text, markup=False, highlight=False, soft_wrap=True)
            else:
                typer.echo(text)

        def step(record: FrameRecord) -> None:
            nonlocal chains, failed
            chains, failed = chains + len(record.lengths), failed + (record.error is not None)
            speed = progress.tasks[task].speed
            rate = f"{speed:.1f} frames/s" if speed else ""
            progress.update(task, advance=1, refresh=True, rate=rate, chains=chains, failed=failed)

        yield above, step
