"""Measure cases in one or several processes, and resume a run that was interrupted."""

import json
import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import typer

from ...errors import ConfigError, InputError
from ...runs.threads import single_thread
from ...types import Array
from ..metrics.record import Column, Record
from .cases import Case

T = TypeVar("T")
R = TypeVar("R")

JOURNAL = "rows.jsonl"
"""File in the output folder: the first line holds the settings, each further line the records of a measured case."""


@dataclass(frozen=True)
class Benchmark:
    """A kind of evaluation: how a case is measured, and how its records become a table and pictures.

    Attributes
    ----------
    measure
        returns the records of a case, with their detections; must be picklable for measuring in other processes.
    columns
        the columns of the table.
    panels
        draws the detection of a record, and the truth, over the same frame: (H, W, 3) uint8 RGB each.
    caption
        returns a line of text for a record's picture.
    badness
        returns a sort key of a record; the worst record has the greatest.
    """

    measure: Callable[[Case], list[Record]]
    columns: tuple[Column, ...]
    panels: Callable[[Record], tuple[Array, Array]]
    caption: Callable[[Record], str]
    badness: Callable[[Record], Any]


def run_cases(
    measure: Callable[[Case], list[Record]],
    cases: Sequence[Case],
    report: Callable[[Record], None] = lambda row: None,
    workers: int = 1,
    journal: tuple[Path, Mapping[str, Any]] | None = None,
) -> list[Record]:
    """Return the records of all cases, in the order of the cases.

    The first case is measured twice and its first records are discarded, so that measured times exclude the loading of libraries.

    Parameters
    ----------
    measure
        as for `Benchmark`.
    cases
        the frames or sequences with known truth.
    report
        called with each record as soon as its case is done.
    workers
        number of processes.
    journal
        output folder and settings; each measured case is stored there in JOURNAL. Cases that are stored already are not measured
        again.

    Raises
    ------
    ConfigError : the folder has results of other settings.
    InputError : the folder cannot be written to.
    """
    done = {} if journal is None else _open_journal(*journal)
    left = [case for case in cases if (case.family, case.name) not in done]
    for case, rows in zip(left, _measured(measure, left, workers), strict=True):
        done[case.family, case.name] = rows
        if journal is not None:
            _append(journal[0] / JOURNAL, {"case": [case.family, case.name], "records": rows})
        for row in rows:
            report(row)
    result = [(case, row) for case in cases for row in done[case.family, case.name]]
    for case, row in result:
        row.case = case
    return [row for _, row in result]


def _measured(measure: Callable[[Case], list[Record]], cases: Sequence[Case], workers: int) -> Iterator[list[Record]]:
    if cases and cases[0].records == 1:
        measure(cases[0])
    yield from in_processes(measure, cases, workers)


def in_processes(function: Callable[[T], R], items: Sequence[T], workers: int) -> Iterator[R]:
    """Yield the result of a function for each item, in order, computed by `workers` single-threaded processes.

    With one worker, this process computes them.
    """
    if workers < 2 or len(items) < 2:
        yield from map(function, items)
        return
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), single_thread)
    try:
        yield from pool.map(function, items)
    finally:
        pool.shutdown(cancel_futures=True)


def print_lines(table: Callable[..., Iterator[str]]) -> None:
    """Run a function as a command: its parameters become options, and the lines that it yields are printed."""

    @wraps(table)
    def run(*args: Any, **options: Any) -> None:
        for line in table(*args, **options):
            typer.echo(line)

    typer.run(run)


def _open_journal(folder: Path, settings: Mapping[str, Any]) -> dict[tuple[str, str], list[Record]]:
    """Return the records in a folder's journal, by family and name of their case; start a journal if there is none."""
    path, wanted = folder / JOURNAL, json.loads(json.dumps(settings))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            _append(path, wanted)
        first, *lines = path.read_text(encoding="utf-8").split("\n")
    except OSError as error:
        raise InputError(f"{folder}: cannot be written to ({error.strerror})", code="out-unwritable") from None
    try:
        found, entries = json.loads(first), [json.loads(line) for line in lines[:-1]]
        done = {tuple(entry["case"]): [Record(row) for row in entry["records"]] for entry in entries}
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path}: is damaged: delete it, or give another folder", code="results-damaged") from None
    if differing := [name for name in wanted if found.get(name) != wanted[name]]:
        raise ConfigError(
            f"{folder}: has results of another {differing[0]}: give another folder, or the same options", code="options-conflict"
        )
    if lines[-1]:  # the program was ended while it wrote this line
        path.write_text("\n".join([first, *lines[:-1], ""]), encoding="utf-8", newline="\n")
    return done


def _append(path: Path, values: Any) -> None:
    with path.open("a", encoding="utf-8", newline="\n") as file:
        file.write(json.dumps(values) + "\n")
