"""Records of results, and the columns of a table that sum up many records: the interface of all metrics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


class Record(dict[str, Any]):
    """The result for one frame: name of a value -> plain value. A value is an attribute, too.

    Attributes
    ----------
    detection
        the detection; None if it is not at hand, as for records read from disk.
    case
        the case that was measured; None if it is not at hand.
    """

    detection: Any = None
    case: Any = None

    def __getattr__(self, name: str) -> Any:
        """Return the value of this name."""
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def plain(self) -> dict[str, Any]:
        """Return the record with its reasons joined to one string."""
        return {name: "; ".join(value) if name == "reasons" else value for name, value in self.items()}


Records = Sequence[Record]


@dataclass(frozen=True)
class Column:
    """A column of the table: it sums up the records of a group.

    Attributes
    ----------
    title
        two lines.
    width
        characters at least.
    summarize
        returns the values of the JSON file's summary, by name.
    text
        returns the cell, from these values.
    """

    title: tuple[str, str]
    width: int
    summarize: Callable[[Records], dict[str, Any]]
    text: Callable[[Mapping[str, Any]], str]


@dataclass(frozen=True)
class Metric:
    """A metric: `measure` returns its values for one frame by name, and the columns sum them up."""

    measure: Callable[[Any], dict[str, Any]]
    columns: tuple[Column, ...] = ()


def share(
    title: tuple[str, str], width: int, name: str, count: Callable[[Records], tuple[int, int]], form: str = "{}/{} {:.1f} %"
) -> Column:
    """Return a column of a number of right things, of all.

    Parameters
    ----------
    title, width
        as for `Column`.
    name
        of the things; the summary has `<name>`, `<name>_correct`, `<name>_incorrect` and `<name>_accuracy` (0 to 1).
    count
        returns the numbers of all and of right things.
    form
        text of the cell, from the number of right things, of all, and the share in %.
    """

    def summarize(rows: Records) -> dict[str, Any]:
        total, correct = count(rows)
        accuracy = correct / total if total else math.nan
        return {name: total, f"{name}_correct": correct, f"{name}_incorrect": total - correct, f"{name}_accuracy": accuracy}

    def text(values: Mapping[str, Any]) -> str:
        total, correct = values[name], values[f"{name}_correct"]
        return form.format(correct, total, 100 * correct / total) if total else "-"

    return Column(title, width, summarize, text)


def flags(key: str) -> Callable[[Records], tuple[int, int]]:
    """Return a function that counts the records with a true value of a name, of those where the value is known."""

    def count(rows: Records) -> tuple[int, int]:
        known = [row[key] for row in rows if row.get(key) is not None]
        return len(known), sum(map(bool, known))

    return count


def parts(key: str, right: str = "", wrong: str = "") -> Callable[[Records], tuple[int, int]]:
    """Return a function that adds up a number of things, and of the right ones: by their own name or that of the wrong ones."""

    def count(rows: Records) -> tuple[int, int]:
        total = sum(row[key] for row in rows)
        return total, sum(row[right] for row in rows) if right else total - sum(row[wrong] for row in rows)

    return count


def number(
    title: tuple[str, str],
    width: int,
    key: str,
    digits: int,
    average: Callable[[Any], Any] = np.median,
    factor: float = 1.0,
    name: str = "",
) -> Column:
    """Return a column of the average of a value, or of all values of lists, without NaN.

    Parameters
    ----------
    title, width
        as for `Column`.
    key
        name of the value; several, separated by blanks, are taken together.
    digits
        decimals.
    average
        function of an array.
    factor
        of the value that is shown and the value in the summary.
    name
        of the value in the summary; "" for `key`.
    """

    def summarize(rows: Records) -> dict[str, Any]:
        values = [np.atleast_1d(np.asarray(row.get(each, ()), dtype=float)) for row in rows for each in key.split()]
        known = np.concatenate([np.zeros(0), *values])
        known = known[np.isfinite(known)]
        return {name or key: float(average(known)) if len(known) else math.nan}

    return Column(title, width, summarize, lambda values: decimals(factor * values[name or key], digits))


def amount(title: tuple[str, str], width: int, name: str, count: Callable[[Records], int]) -> Column:
    """Return a column of a number of things, as the function counts them."""
    return Column(title, width, lambda rows: {name: count(rows)}, lambda values: str(values[name]))


def added(key: str) -> Callable[[Records], int]:
    """Return a function that adds up a value."""
    return lambda rows: sum(row[key] for row in rows)


def decimals(value: float, digits: int) -> str:
    """Return a number as text; "-" for NaN."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def failures(rows: Records) -> int:
    """Return the number of records with an error."""
    return sum(row.get("error") is not None for row in rows)


TIME = number(("time", "ms"), 6, "ms", 0)
"""Median duration of a detection."""
