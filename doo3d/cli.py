"""The commands. Only this module and commands/ print and exit; what is heavy is imported inside the commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from . import __version__
from .commands import evaluate, explain, export, report, tune, video, view
from .commands.arguments import (
    EndOption,
    EveryOption,
    FramesOption,
    InputOption,
    MaskOption,
    Overrides,
    Preset,
    StartOption,
    config_of,
)
from .commands.debug_frame import StagesOption, keep_stages, staged
from .commands.info import info
from .commands.progress import reporting, say_compiling
from .errors import DooError

SOME_FAILED, NOTHING_DONE = 1, 2  # exit codes
ORDER = ("detect", "info", "tune", "explain", "report", "video", "view", "export", "compare", "evaluate", "bench")  # in the help


class Commands(TyperGroup):
    """The commands in the order of their use, with what doo3d refuses said in one sentence."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Those of ORDER first."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))

    def invoke(self, ctx: Any) -> Any:
        """Run the command; a DooError ends it with exit code 2 and no traceback."""
        try:
            return super().invoke(ctx)
        except DooError as error:
            typer.echo(f"doo3d: {error} [{error.code}]", err=True)
            raise typer.Exit(NOTHING_DONE) from None


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)
app.add_typer(evaluate.app, name="evaluate")
app.command("tune", short_help="Propose settings for the object in INPUT, and draw them.")(tune.tune)
app.command("explain", short_help="Say why the chains of a frame are what they are.")(explain.explain)
app.command("view", short_help="Show a run in the Rerun viewer.")(view.view)
app.command("info", short_help="Say what INPUT is, and what looks wrong with it.")(info)
app.command("export", short_help="Write the chains in OUT for other programs.")(export.export)
app.command("report", short_help="Make one page of HTML of what was found.")(report.report)
app.command("video")(video.video)


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
      doo3d tune capture                               colour ranges and lengths for this camera and object
      doo3d explain capture --frame 0                  why the chains of a frame are what they are
      doo3d info capture --contact-sheet sheet.png     what the capture is, and a sheet of its frames
      doo3d config > mine.yaml                         all settings, to change and give back with -c mine.yaml
      doo3d compare capture                            where 3-D and 2-D differ
      doo3d report out                                 a page to look at what was found; doo3d video out
      doo3d export out --to mjcf                       for a simulator, a tracker, ...: export --list
      doo3d bench                                      milliseconds per stage on this machine

    Each frame gives OUT/<frame>.json (the chains) and OUT/<frame>.png (the chains over the image).
    """


@app.command()
def detect(
    capture: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="A folder of frames, a bag, a cloud, a folder of clouds; in 2-D images or a video."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder for the results.")] = Path("out"),
    config: Preset = "default",
    overrides: Overrides = None,
    mask: MaskOption = None,
    input_options: InputOption = None,
    every: EveryOption = 1,
    start: StartOption = None,
    end: EndOption = None,
    frames: FramesOption = None,
    workers: Annotated[
        int, typer.Option(min=0, help="Processes to work with, one frame each at a time; 0: this one alone, without dask.")
    ] = 0,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Use the workers of a dask scheduler, such as tcp://host:8786.")
    ] = None,
    fuse_views: Annotated[
        bool, typer.Option("--fuse-views", help="A thing at rest and a camera of known poses: all frames are fused to one cloud.")
    ] = False,
    stages: StagesOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="Do all frames again, even those that are finished in OUT.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Write into OUT though it holds something else.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Find the chains in every frame of INPUT and write them to OUT.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out
      doo3d detect capture -o out -c mine.yaml --set merge.chains=2 --set fit.segment_length=0.005
      doo3d detect sample_clouds/photos -o out -c image
      doo3d detect capture -o out --workers 4
      doo3d detect sample_clouds/crossing -o out --stages 0
      doo3d detect capture -o out --fuse-views --input-option trajectory=poses.txt

    A run that was ended, however that was, goes on where it was when the same command is given again.

    Exit code 0: all frames are fine; 1: some failed (see OUT/manifest.json); 2: nothing could be done, or the run ended early.
    """
    from .runs.threads import single_thread

    single_thread()
    from .inputs import ReadOptions, open_capture
    from .inputs.frame_selection import Selection, selected

    effective = config_of(config, overrides)
    reading = ReadOptions.from_pairs(input_options or [])
    opened = open_capture(capture, effective.mode == "2d", mask, reading)
    opened = selected(opened, Selection(every, start, end, frames))
    if fuse_views:
        from .sequence.fusion import FusedCapture

        opened = FusedCapture(opened, effective)
    looked_into = staged(opened, stages)
    from .commands.messages import closing_line
    from .runs import run as batch

    if not quiet:
        say_compiling()
    names = [entry.name for entry in opened.frames]
    with reporting(len(names), max(map(len, names), default=0), quiet) as report:
        summary = batch.run(
            *(opened, out, effective),
            reading=reading,
            workers=workers,
            scheduler=scheduler,
            restart=restart,
            force=force,
            report=report,
            resumed=report.resumed,
        )
    counts = summary.counts()
    if not summary.succeeded:
        if len(names) > 1:
            typer.echo(f"doo3d: all {len(names)} frames failed, nothing was written", err=True)
        raise typer.Exit(NOTHING_DONE)
    if not quiet:
        typer.echo(closing_line(counts["frames"], summary.failed, counts["chains"], str(out)))
    keep_stages(out, looked_into, effective)
    if summary.failed:
        raise typer.Exit(SOME_FAILED)


@app.command(short_help="Detect in 3-D and in 2-D, and show where the two differ.")
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
    input_options: InputOption = None,
    every: EveryOption = 1,
    start: StartOption = None,
    end: EndOption = None,
    frames: FramesOption = None,
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
    from .inputs import ReadOptions, open_capture
    from .inputs.frame_selection import Selection, selected

    effective = config_of(config, overrides)
    wanted = {} if effective.merge.chains is None else {"merge.chains": effective.merge.chains}
    effective_flat = load_config(flat, wanted | parse_overrides(flat_overrides or []))
    opened = open_capture(capture, masks=mask, options=ReadOptions.from_pairs(input_options or []))
    opened = selected(opened, Selection(every, start, end, frames))
    from .compare import compare_capture

    column = max((len(entry.name) for entry in opened.frames), default=0)
    say_compiling()
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


@app.command(short_help="Print the milliseconds of each stage.")
def bench(
    captures: Annotated[
        list[Path] | None, typer.Argument(metavar="INPUT", help="Captures, the first frame of each; none: one is rendered.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="How often each frame is run and counted.")] = 20,
    config: Preset = "default",
    overrides: Overrides = None,
) -> None:
    """Print the milliseconds of each stage, in one process and one thread."""
    from .inspection import benchmark as timing

    timing.single_thread()
    for i, result in enumerate(timing.bench(captures or [], config_of(config, overrides), runs)):
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
    name: Annotated[str, typer.Argument(metavar="NAME", help="A preset or a YAML file.")] = "default",
    overrides: Overrides = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the page of the documentation instead.")] = False,
) -> None:
    """Print the effective configuration, each field explained."""
    from .config import documentation as settings

    typer.echo(settings.markdown() if markdown else settings.annotated_yaml(config_of(name, overrides)), nl=False)


@app.command()
def samples(folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Where to; made when it is not there.")]) -> None:
    """Render the sample captures and clouds into FOLDER."""
    from .evaluation.sample_captures import write_samples

    for path in write_samples(folder):
        typer.echo(path)


def main() -> None:
    """The command `doo3d`."""
    app(prog_name="doo3d")
