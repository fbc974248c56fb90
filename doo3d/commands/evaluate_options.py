"""Define and check the options shared by the commands of `doo3d evaluate`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ConfigError, InputError
from .arguments import save
from .progress_bars import counting

if TYPE_CHECKING:
    from ..config import Config
    from ..evaluation.benchmark.cases import Case
    from ..evaluation.benchmark.evaluate import Masking
    from ..evaluation.benchmark.run import Benchmark
    from ..evaluation.metrics.record import Record

SENSORS = {"d435": "d435", "d455": "d455", "zivid": "zivid", "stereo": "stereo", "coarse": "coarse", "perfect": "none"}
"""Name of a depth camera in the shell -> its key in the renderer's SENSORS."""


MASKS: dict[str, Masking] = {"given": "mask", "ragged": "ragged", "hsv": "hsv", "auto": "auto"}
"""Choice of --mask -> its name in `doo3d.evaluation`."""

FEW_MASKS = ("given", "ragged", "auto")
"""Choices of --mask for data in which the colors of the cables are unknown."""

DEPTHS = {"own": None, "stereo": None, "simple": "other/depth_simple.png", "d435": "other/depth_simple.png"}
"""Name of the depth of a capture with truth.npz -> its image in the capture's folder; None for the capture's own."""


SELECTING = ("families", "seeds", "start", "set", "motions", "motion", "captures", "subset")
"""Options that select cases without changing the result of a case."""

MIN_RELIABILITY_FRAMES = 20
"""Least number of frames for which a table of the confidence's reliability is meaningful."""

Seeds = Annotated[int, typer.Option(min=1, help="Scenes of each family.")]
Start = Annotated[
    int, typer.Option(min=0, metavar="SEED", help="Seed of the first scene of each family; from 1000 on they are only counted.")
]
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
FewMasks = Annotated[
    str, typer.Option("--mask", metavar="|".join(FEW_MASKS), help="Give the true mask or a spoiled one, or use the config.")
]
Csv = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write a line per frame to FILE.")]
Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the summary and every frame to FILE.")]
Pictures = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Draw the worst frames of each family, and a sheet of the wrong ones, into DIR."),
]
Worst = Annotated[int, typer.Option(min=0, help="Number of frames of each family that are drawn.")]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out", "-o", metavar="DIR", help="Write table, CSV, JSON and pictures to DIR; frames it has already are kept."
    ),
]
Workers = Annotated[int, typer.Option(min=1, help="Number of processes.")]


@dataclass(frozen=True)
class Outputs:
    """The outputs of an evaluation, and the number of processes that measure."""

    table: Csv = None
    document: Json = None
    pictures: Pictures = None
    worst: Worst = 1
    out: Out = None
    workers: Workers = 1


ONE_PICTURE, SIX_PICTURES, NO_PICTURES = Outputs(worst=1), Outputs(worst=6), Outputs(worst=0)
"""Default outputs, the table on the screen only; the names give the number of pictures per family if a folder is given."""


def measure(
    benchmark: Benchmark, cases: Sequence[Case], settings: Mapping[str, Any], outputs: Outputs, config: Config
) -> list[Record]:
    """Measure cases with a progress bar, print the table, and write all outputs; return the records.

    Parameters
    ----------
    benchmark
        the benchmark that measures the cases.
    cases
        the frames or sequences.
    settings
        options that are stored in the JSON file.
    outputs
        the files and folders.
    config
        the complete settings of the detection. Records in the output folder are reused only if these and `settings`, except
        SELECTING, are equal.
    """
    from ..evaluation.benchmark.pictures import UNREADABLE
    from ..evaluation.benchmark.run import run_cases

    identity = {name: value for name, value in settings.items() if name not in SELECTING}
    identity["config"] = config.model_dump(mode="json")
    journal = None if outputs.out is None else (outputs.out, identity)
    with counting(sum(case.records for case in cases)) as report:
        rows = run_cases(benchmark.measure, cases, report, outputs.workers, journal)
    for row in rows:
        if UNREADABLE in row.get("reasons", ()):
            typer.echo(f"{row.frame}   cannot be read: {row.error} [{row.code}]", err=True)
    show(rows, benchmark, settings, outputs)
    return rows


def show(rows: Sequence[Record], benchmark: Benchmark, settings: Mapping[str, Any], outputs: Outputs) -> None:
    """Print the table of records, and write all outputs; the parameters are those of `measure`."""
    from ..evaluation.benchmark.pictures import write_pictures
    from ..evaluation.benchmark.tables import csv_text, format_table, has_confidence, json_text
    from ..evaluation.metrics.confidence import format_reliability

    text = format_table(rows, benchmark.columns)
    if len(rows) >= MIN_RELIABILITY_FRAMES and has_confidence(rows):
        text += "\n\n" + format_reliability(rows)
    typer.echo(text)
    out = outputs.out
    for path in filter(None, (outputs.table, out and out / "rows.csv")):
        save(path, csv_text(rows))
    for path in filter(None, (outputs.document, out and out / "rows.json")):
        save(path, json_text(rows, benchmark.columns, settings))
    if out is not None:
        save(out / "table.txt", text + "\n")
    if folder := outputs.pictures or (out and out / "pictures"):
        try:
            paths = write_pictures(folder, rows, benchmark, outputs.worst)
        except OSError as error:
            raise InputError(f"{folder}: cannot be written to ({error.strerror})", code="out-unwritable") from None
        typer.echo("\n".join(map(str, paths)))


def check_choice(option: str, value: str, choices: Collection[str]) -> str:
    """Return the value of an option unchanged if it is one of the choices.

    Parameters
    ----------
    option
        name of the option, such as "--count", named in the error.
    value
        the value given by the user.
    choices
        the allowed values.

    Raises
    ------
    ConfigError : the value is none of the choices; the message lists them.
    """
    if value not in choices:
        raise ConfigError(f"{option} {value}: there are {', '.join(choices)}", code="choice-unknown")
    return value


def parse_sensor(name: str) -> str:
    """Return the renderer's name of the depth camera given with --sensor.

    It is the given name, "d435", "d455", "zivid", "stereo" or "coarse", or "none" if the given name is "perfect".

    Raises
    ------
    ConfigError : there is no such camera.
    """
    return SENSORS[check_choice("--sensor", name, SENSORS)]


def parse_size(text: str) -> tuple[int, int]:
    """Return (width, height) in px from text such as "1280x720".

    Raises
    ------
    ConfigError : the text has another form, or width or height is below 64.
    """
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) >= 64 and int(height) >= 64):
        raise ConfigError(
            f"--size {text}: expected WIDTHxHEIGHT in pixels, 64x64 at least, such as 1280x720", code="value-invalid"
        )
    return int(width), int(height)


def use_single_thread() -> None:
    """Limit native libraries to one thread in this process, so that measured times can be compared."""
    from ..runs.threads import single_thread

    single_thread()
