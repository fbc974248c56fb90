"""The application `doo3d`: assembles the commands of commands/ and turns errors into one sentence and an exit code.

Command modules import only typer and each other at the top; heavy imports stay inside the functions, so that
`doo3d --help` answers within 0.3 s.
"""

import sys
import warnings
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from . import __version__
from .commands import (
    bench,
    compare,
    config,
    detect,
    evaluate,
    explain,
    export,
    info,
    presets,
    report,
    samples,
    train,
    tune,
    video,
    view,
)
from .commands.arguments import with_groups
from .commands.exit_codes import INTERRUPTED, NOTHING_DONE
from .commands.interruption import unmasked_interrupts
from .commands.messages import wrapped
from .commands.progress_bars import remove_bars
from .errors import DooError, DooWarning

COMMANDS: dict[str, tuple[Callable[..., None] | typer.Typer, str | None]] = {
    "detect": (detect.detect, None),
    "info": (info.info, "Print a summary of INPUT, with warnings of likely faults."),
    "tune": (tune.tune, "Propose settings for the object in INPUT, and draw them."),
    "explain": (explain.explain, "Print what each stage made and dropped, and merge costs."),
    "report": (report.report, "Write a run as one HTML page."),
    "video": (video.video, None),
    "view": (view.view, "Show a run in the Rerun viewer."),
    "export": (export.export, "Write the chains in OUT in the formats of other programs."),
    "compare": (compare.compare, "Detect in 3-D and in 2-D, and show where the two differ."),
    "evaluate": (evaluate.app, None),
    "bench": (bench.bench, "Print the time of each stage, in ms and in passes over a frame."),
    "train": (train.train, "Train a network that finds thin objects in images."),
    "presets": (presets.presets, None),
    "config": (config.config, "Print the settings, each explained."),
    "samples": (samples.samples, None),
}
"""Name -> the command (or group of commands) and its line in the help where that is not its first sentence; in help order."""


class CommandGroup(TyperGroup):
    """The group of all commands, in the order of COMMANDS; it prints an error of doo3d as one sentence with its code."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the commands in the order in which the help lists them.

        ctx : click's context; not used.
        """
        return list(COMMANDS)

    def make_context(self, *args: Any, **kwargs: Any) -> Any:
        """Return click's context of the arguments that the shell gave; on Ctrl-C exit as `invoke` does.

        args, kwargs : as click gives them; not looked at.
        """
        try:
            return super().make_context(*args, **kwargs)
        except KeyboardInterrupt:
            _exit_interrupted()

    def invoke(self, ctx: Any) -> Any:
        """Run the command given in the shell, and return what it returns.

        On a DooError, print its message and code on stderr without a traceback, and exit with code 2; on Ctrl-C exit with 130.

        ctx : click's context, with the parsed arguments.
        """
        try:
            with warnings.catch_warnings(), unmasked_interrupts():
                warnings.simplefilter("default", DooWarning)
                warnings.showwarning = partial(_note, warnings.showwarning)
                return super().invoke(ctx)
        except DooError as error:
            typer.echo(wrapped(f"doo3d: {error.in_shell} [{error.code}]", sys.stderr), err=True)
            raise typer.Exit(NOTHING_DONE) from None
        except KeyboardInterrupt:
            _exit_interrupted()


def _note(otherwise: Callable[..., None], message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
    """Print a warning of doo3d as a note; any other as it would be without this function."""
    if issubclass(category, DooWarning):
        typer.echo(wrapped(f"doo3d: note: {message}", sys.stderr), err=True)
    else:
        otherwise(message, category, *place, **more)


def _exit_interrupted() -> NoReturn:
    remove_bars()
    typer.echo("doo3d: interrupted", err=True)
    sys.exit(INTERRUPTED)


HELPER_THREAD = "doo3d.runs.helper_thread"
"""Module that knows the threads left at the end of a run; imported by a run only."""

app = typer.Typer(
    cls=CommandGroup,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)
for _name, (_command, _short_help) in COMMANDS.items():
    if isinstance(_command, typer.Typer):
        app.add_typer(_command, name=_name)
    else:
        app.command(_name, short_help=_short_help)(with_groups(_command))


def _print_version(requested: bool) -> None:
    if requested:
        typer.echo(f"doo3d {__version__}")
        raise typer.Exit


@app.callback()
def doo3d(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Cables, ropes, hoses and wires as chains of equal segments: 3-D from RGB-D frames and clouds, 2-D from images.

    \b
    Examples:
      doo3d detect sample_clouds/crossing -o out       a folder with color/, depth/, camera_intrinsic.json
      doo3d detect scan.ply -o out                     one point cloud
      doo3d detect capture --set merge.chains=2        two cables
      doo3d detect photo.jpg -c image --mask mask.png  in 2-D: a photograph, a folder of them, or a video
      doo3d tune capture                               color ranges and lengths for this camera and object
      doo3d explain capture --frame 0                  why the chains of a frame are what they are
      doo3d info capture --contact-sheet sheet.png     what the capture is, and a sheet of its frames
      doo3d config > mine.yaml                         the basic settings, to edit and pass with -c mine.yaml
      doo3d compare capture                            where 3-D and 2-D differ
      doo3d report out                                 a page with the results; doo3d video out
      doo3d export out --to mjcf                       for a simulator, a tracker, ...: export --list
      doo3d bench                                      milliseconds a frame on this machine

    Each frame gives OUT/<frame>.json (the chains) and OUT/<frame>.jpg (the chains over the image).
    """


def main() -> None:
    """Run the command `doo3d` with the arguments of this process, then exit the process with the exit code of the command."""
    try:
        app(prog_name="doo3d")
    except KeyboardInterrupt:  # before the arguments are read
        _exit_interrupted()


def process() -> None:
    """Run `main` as all that this process does: it ends at once if the command leaves a thread behind that hangs."""
    try:
        main()
    finally:
        if HELPER_THREAD in sys.modules:  # a run has had one
            sys.modules[HELPER_THREAD].end_if_left(sys.exc_info()[1])
