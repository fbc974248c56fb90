"""Measure cases: one after the other or in several processes, and go on where an earlier run ended."""

from __future__ import annotations

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
"""File of an output folder: a line with the settings, then one for each case that was measured, with its records."""


@dataclass(frozen=True)
class Benchmark:
    """One way of measuring: from a case to its records, their table, and their pictures.

    Attributes
    ----------
    measure
        returns the records of a case, with their detections; can be pickled if other processes have to measure.
    columns
        the columns of the table.
    panels
        draws the detection of a record, and the truth, over the same frame: (H, W, 3) uint8 RGB each.
    caption
        returns a line of text for a record's picture.
    badness
        returns a value by which records are ordered; the greatest is that of the worst.
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

    The first case is measured once more before, so that no time is that of loading the program.

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
        folder where cases are noted as they are done, and the settings. Cases that the folder has already are not measured again.

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
    """Yield the result of a function for each item, in order, computed in so many processes of one thread; in this one for 1."""
    if workers < 2 or len(items) < 2:
        yield from map(function, items)
        return
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), single_thread)
    try:
        yield from pool.map(function, items)
    finally:
        pool.shutdown(cancel_futures=True)


def print_lines(table: Callable[..., Iterator[str]]) -> None:
    """Print the lines that a function returns; its arguments are options of the command line."""

    @wraps(table)
    def run(*args: Any, **options: Any) -> None:
        for line in table(*args, **options):
            typer.echo(line)

    typer.run(run)


def _open_journal(folder: Path, settings: Mapping[str, Any]) -> dict[tuple[str, str], list[Record]]:
    """Return the records in a folder's journal, by family and name of their case; a new journal begins with the settings."""
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
