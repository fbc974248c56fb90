"""Implement `doo3d evaluate sequences`: measure moving cables, in single frames and in whole sequences."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ConfigError, InputError
from . import evaluate_options as shared
from .arguments import DEFAULT_SETTINGS, Settings, split, with_groups

if TYPE_CHECKING:
    from ..evaluation.sequences.scenes import Sequence


@with_groups
def sequences(
    motions: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE|FOLDER",
            help="Motion capture of real cables: .npy files of (T, K, 3) m, K markers from tip to tip, 100 times a second, z up; "
            "or a folder of them. Repeat for more.",
        ),
    ] = None,
    captures: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", help="Captures of moving cables with truth.npz, or a folder of them. Repeat for more."),
    ] = None,
    own: Annotated[
        str, typer.Option(metavar="NAMES", help="Comma-separated motions that need no file: dragged, knot; all; or none.")
    ] = "all",
    seeds: Annotated[int, typer.Option(min=1, help="Sequences of each motion.")] = 1,
    start: shared.Start = 0,
    frames: Annotated[int, typer.Option(min=3, help="Frames of a sequence, 30 a second.")] = 120,
    level: Annotated[
        str,
        typer.Option(
            metavar="rough|hard|easy",
            help="hard: hands pass in front of the cable, and depth is lost; easy: neither; rough: faster, with wider hands, or "
            "one at each end, and things of the cable's color behind the ends.",
        ),
    ] = "hard",
    sensor: shared.Sensor = "d435",
    size: shared.Size = "640x480",
    count: shared.Count = "given",
    settings: Settings = DEFAULT_SETTINGS,
    outputs: shared.Outputs = shared.SIX_PICTURES,
) -> None:
    """Render cables in motion, detect in them in three variants, and compare the chains with the truth.

    Prints a table with five lines per sequence. single: each frame for itself. forward: with earlier frames only, as a
    tracker. sequence: with earlier and later frames, as doo3d detect --sequence. The detection is given the true mask.
    oracle-past, oracle-both: what a perfect estimator would reach that knows the cable where the camera measured it, in
    earlier frames, or in later ones, too.

    \b
    Examples:
      doo3d evaluate sequences
      doo3d evaluate sequences --own knot --seeds 3 --pictures hard --csv rows.csv
      doo3d evaluate sequences --own none --captures FOLDER --out results --workers 2
      doo3d evaluate sequences --motions motion/DLO1_101.npy --own none --level easy
    """
    shared.use_single_thread()
    from ..evaluation.sequences.evaluate import sequence_benchmark, sequence_case
    from ..evaluation.sequences.recorded import recorded_sequences
    from ..evaluation.sequences.scenes import LEVELS

    shared.check_choice("--level", level, LEVELS)
    shared.check_choice("--count", count, ("given", "auto"))
    effective, depth_camera = _motions(motions or [], own, bool(captures)), shared.parse_sensor(sensor)
    config = settings.load()
    if config.mode == "2d":
        from ..track.first_pass import check_mode

        check_mode(config)
    chosen = _sequences(effective, range(start, start + seeds), shared.parse_size(size), frames, level, motions or [])
    recorded = recorded_sequences(captures or [], frames)
    stored: dict[str, Any] = {"captures": [str(folder) for folder in captures or []]}
    stored |= {"motions": [str(motion) for motion in effective], "seeds": seeds, "start": start, "frames": frames}
    stored |= {
        "level": level,
        "sensor": sensor,
        "size": size,
        "count": count,
        "config": settings.config,
        "set": settings.overrides or [],
    }
    cases = [*(sequence_case(sequence, depth_camera) for sequence in chosen), *(sequence_case(each, "") for each in recorded)]
    shared.measure(sequence_benchmark(config, count == "given"), cases, stored, outputs, config)


def _motions(paths: list[Path], own: str, has_captures: bool) -> list[str | Path]:
    """Return the names of the built-in motions, and the files of motion capture.

    Raises
    ------
    ConfigError : a motion is unknown, or there are neither motions nor captures.
    InputError : there is no such file.
    """
    from ..evaluation.sequences.motions import OWN_MOTIONS, motion_files

    names = {"all": list(OWN_MOTIONS), "none": []}.get(own, split(own) or [])
    for name in names:
        shared.check_choice("--own", name, [*OWN_MOTIONS, "all", "none"])
    chosen: list[str | Path] = [*dict.fromkeys(names), *motion_files(paths)]
    if not chosen and not has_captures:
        raise ConfigError("--own none: no motion is left: give --motions FILE, or leave it out", code="options-conflict")
    return chosen


def _sequences(
    motions: Iterable[str | Path], seeds: range, size: tuple[int, int], frames: int, level: str, given: Collection[Path]
) -> list[Sequence]:
    """Return the sequences of all motions and seeds.

    A file that cannot be used is left out with a note if it was found in a given folder and other motions are left.

    Raises
    ------
    ConfigError : no motion with this number of frames fits into the image.
    InputError : a file cannot be used.
    """
    from ..evaluation.sequences.scenes import make_sequence

    result: list[Sequence] = []
    failed: InputError | None = None
    for motion in motions:
        try:
            result += [make_sequence(motion, seed, size, frames, level) for seed in seeds]
        except ValueError as error:
            raise ConfigError(f"--frames {frames}, --size {size[0]}x{size[1]}: {error}", code="value-invalid") from None
        except InputError as error:
            if not isinstance(motion, Path) or motion in given:
                raise
            failed = error
            typer.echo(f"note: left out: {error}", err=True)
    if not result and failed is not None:
        raise failed
    return result
