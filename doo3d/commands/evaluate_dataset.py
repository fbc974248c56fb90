"""Implement `doo3d evaluate dataset`: measure the detection on public data sets of other projects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ConfigError
from . import evaluate_options as shared
from .arguments import Overrides, config_of, split, with_groups

if TYPE_CHECKING:
    from ..config import Config
    from ..evaluation.benchmark.cases import Case
    from ..evaluation.benchmark.run import Benchmark
    from ..evaluation.metrics.record import Record

DEFAULT_WORST = 5
"""Number of images that --pictures draws without --worst."""


@dataclass(frozen=True)
class _Request:
    """The data set's folder, the config, and the given options by name."""

    folder: Path
    config: Config
    options: dict[str, Any]
    outputs: shared.Outputs

    def measure(self, benchmark: Benchmark, cases: list[Case]) -> list[Record]:
        """Measure the cases; see `evaluate_options.measure`."""
        settings = {"folder": str(self.folder)} | {option.strip("-"): value for option, value in self.options.items()}
        outputs = replace(self.outputs, worst=self.outputs.worst or DEFAULT_WORST)
        return shared.measure(benchmark, cases, settings, outputs, self.config)

    def get(self, option: str, default: Any = None) -> Any:
        """Return the value of an option such as "--masks"; `default` if the user did not give the option."""
        return self.options.get(option, default)


@with_groups
def dataset(
    name: Annotated[str, typer.Argument(metavar="NAME", help="mbest, cset or tubes.")],
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The data set, or the checkout of its repository.")],
    config: Annotated[
        str | None, typer.Option("--config", "-c", help="A preset or a YAML file. Default: image; tubes for tubes.")
    ] = None,
    overrides: Overrides = None,
    subsets: Annotated[
        str | None, typer.Option("--subset", metavar="S1,S2", help="mbest, cset: comma-separated subsets. Default: all.")
    ] = None,
    masks: Annotated[
        str | None,
        typer.Option(
            metavar="labels|hsv|network|auto",
            help="mbest, cset: the labels' foreground, the cables' colors (mbest) or masks/ (cset); "
            "auto gives none. Default: labels.",
        ),
    ] = None,
    known_count: Annotated[
        bool | None,
        typer.Option(
            "--known-count/--chains-from-data",
            help="mbest, cset: give the number of cables; the default leaves it to the config.",
        ),
    ] = None,
    single: Annotated[bool | None, typer.Option("--single", help="mbest: detect and trace each cable alone.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="tubes: views of each configuration. Default: 3.")] = None,
    start: Annotated[int | None, typer.Option(min=0, metavar="SEED", help="tubes: seed of the first view. Default: 0.")] = None,
    sensor: Annotated[str | None, typer.Option(metavar="|".join(shared.SENSORS), help="tubes: camera. Default: d435.")] = None,
    size: Annotated[str | None, typer.Option(metavar="WxH", help="tubes: size of the image, px. Default: 1280x720.")] = None,
    outputs: shared.Outputs = shared.NO_PICTURES,
) -> None:
    """Detect in a public data set and score against its labels.

    Prints a table of scores.

    mbest: photographs of one to three cables; FOLDER holds S1, S2, S3 with images/ and labels/ each. cset: photographs of cables
    before busy backgrounds (C1 to C3); FOLDER holds images/, labels/ and masks/. Both are in 2-D. Their two scores are DICE
    coefficients, in %, between the labelled pixels of a cable and the pixels of the chain matched with it. drawn: those that it
    covers when drawn with its own width. instances: those that the instance labels (detect --instances) give it.

    tubes: configurations of entangled tubes (text files of straight cylinders). They are rendered, and the detection is given
    their mask and number. Each tube is scored by itself.

    \b
    Examples:
      doo3d evaluate dataset mbest mBEST --single
      doo3d evaluate dataset cset CVF3D-DLO --masks network
      doo3d evaluate dataset cset CVF3D-DLO --masks auto
      doo3d evaluate dataset tubes TUBES --seeds 5
    """
    options = {
        "--subset": subsets,
        "--masks": masks,
        "--known-count": known_count,
        "--single": single,
        "--seeds": seeds,
        "--start": start,
        "--sensor": sensor,
        "--size": size,
    }
    given = {option: value for option, value in options.items() if value is not None}
    run, allowed = DATASETS[shared.check_choice("dataset", name, DATASETS)]
    if conflicts := [option for option in given if option not in allowed]:
        raise ConfigError(
            f"{conflicts[0]}: does not apply to the data set {name}, which has {', '.join(allowed)}: leave it out",
            code="options-conflict",
        )
    shared.use_single_thread()
    run(_Request(folder, config_of(config or ("tubes" if name == "tubes" else "image"), overrides), given, outputs))


def _mbest(request: _Request) -> None:
    from ..evaluation.photos import datasets
    from ..evaluation.photos.evaluate import cable_benchmark

    masks, single = request.get("--masks", "labels"), request.get("--single")
    if single and (masks != "labels" or request.get("--known-count")):
        raise ConfigError(
            "--single takes each cable's label as the mask and wants one chain: leave --masks and --known-count out",
            code="options-conflict",
        )
    refs = datasets.mbest(request.folder, _given(masks), split(request.get("--subset")))
    _photos(refs, request, cable_benchmark(request.config) if single else None)


def _cset(request: _Request) -> None:
    from ..evaluation.photos import datasets

    masks = request.get("--masks", "labels")
    _photos(datasets.cset(request.folder, _given(masks), split(request.get("--subset"))), request)


def _given(masks: str) -> str:
    """Return the masks to read: those named, or "labels" for "auto", where the detection is given none."""
    return "labels" if masks == "auto" else masks


def _tubes(request: _Request) -> None:
    from ..evaluation.benchmark.tubes import tube_benchmark, tube_cases

    start = request.get("--start", 0)
    seeds = range(start, start + request.get("--seeds", 3))
    sensor, size = shared.parse_sensor(request.get("--sensor", "d435")), shared.parse_size(request.get("--size", "1280x720"))
    cases = tube_cases(request.folder, seeds, sensor, size)
    request.measure(tube_benchmark(request.config), cases)


def _photos(cases: list[Case], request: _Request, benchmark: Benchmark | None = None) -> None:
    """Measure photographs, and print the table and remarks; `benchmark` None measures whole photographs."""
    from ..evaluation.benchmark.pictures import worst
    from ..evaluation.photos.evaluate import photo_benchmark, remarks

    known_count, give_mask = request.get("--known-count", False), request.get("--masks", "labels") != "auto"
    benchmark = benchmark or photo_benchmark(request.config, known_count, give_mask)
    rows = request.measure(benchmark, cases)
    chosen = worst(rows, request.outputs.worst or (DEFAULT_WORST if request.outputs.pictures else 0), benchmark.badness)
    for line in [*remarks(rows), *(f"worst: {benchmark.caption(row)}" for row in chosen)]:
        typer.echo(line)


_PHOTO_OPTIONS = ("--subset", "--masks", "--known-count")
DATASETS: dict[str, tuple[Callable[[_Request], None], tuple[str, ...]]] = {
    "mbest": (_mbest, (*_PHOTO_OPTIONS, "--single")),
    "cset": (_cset, _PHOTO_OPTIONS),
    "tubes": (_tubes, ("--seeds", "--start", "--sensor", "--size")),
}
"""Name of a data set -> function that evaluates it, and the options that apply to it."""
