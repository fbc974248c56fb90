"""Define records of results, and the table columns that summarize them: the interface of all metrics."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


class Record(dict[str, Any]):
    """The result for one frame: name of a value -> plain value. Values can be read as attributes, too.

    Attributes
    ----------
    detection
        the detection; None if the record was read from disk.
    case
        the measured case; None if it is unknown.
    """

    detection: Any = None
    case: Any = None

    def __getattr__(self, name: str) -> Any:
        """Return the value with this name."""
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def plain(self) -> dict[str, Any]:
        """Return the values as a dict, with the reasons joined to one string."""
        return {name: "; ".join(value) if name == "reasons" else value for name, value in self.items()}


Records = Sequence[Record]


@dataclass(frozen=True)
class Column:
    """A column of the table, which summarizes the records of a group.

    Attributes
    ----------
    title
        the two lines of the title.
    width
        least width in characters.
    summarize
        returns the summary of records: name of a value in the JSON file -> value.
    text
        returns the text of the cell, from the summary.
    """

    title: tuple[str, str]
    width: int
    summarize: Callable[[Records], dict[str, Any]]
    text: Callable[[Mapping[str, Any]], str]


@dataclass(frozen=True)
class Metric:
    """A metric: `measure` returns its values for one frame by name, and `columns` summarize them."""

    measure: Callable[[Any], dict[str, Any]]
    columns: tuple[Column, ...] = ()


def share(
    title: tuple[str, str], width: int, name: str, count: Callable[[Records], tuple[int, int]], form: str = "{}/{} {:.1f} %"
) -> Column:
    """Return a column with the number of right items, the number of all, and the share in %.

    Parameters
    ----------
    title, width
        as for `Column`.
    name
        name of the items; the summary has `<name>`, `<name>_correct`, `<name>_incorrect` and `<name>_accuracy` (0 to 1).
    count
        returns the numbers of all and of right items.
    form
        format of the cell, filled with the number of right items, the number of all, and the share in %.
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
    """Return a function that counts the records in which a value is known, and those in which it is true."""

    def count(rows: Records) -> tuple[int, int]:
        known = [row[key] for row in rows if row.get(key) is not None]
        return len(known), sum(map(bool, known))

    return count


def parts(key: str, right: str = "", wrong: str = "") -> Callable[[Records], tuple[int, int]]:
    """Return a function that sums the number of items, and of right ones, over records.

    key, right, wrong : names of the numbers of all, right and wrong items; one of the last two is given.
    """

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
    """Return a column with the average of a value over records, without NaN; values of lists count one by one.

    Parameters
    ----------
    title, width
        as for `Column`.
    key
        name of the value; several names, separated by blanks, are averaged together.
    digits
        number of decimals.
    average
        function from an array to its average.
    factor
        multiplies the average, for another unit.
    name
        name of the average in the summary; "" for `key`.
    """

    def summarize(rows: Records) -> dict[str, Any]:
        values = [np.atleast_1d(np.asarray(row.get(each, ()), dtype=float)) for row in rows for each in key.split()]
        known = np.concatenate([np.zeros(0), *values])
        known = known[np.isfinite(known)]
        return {name or key: float(average(known)) if len(known) else math.nan}

    return Column(title, width, summarize, lambda values: decimals(factor * values[name or key], digits))


def amount(title: tuple[str, str], width: int, name: str, count: Callable[[Records], int]) -> Column:
    """Return a column with a number of items, counted by a function of the records."""
    return Column(title, width, lambda rows: {name: count(rows)}, lambda values: str(values[name]))


def added(key: str) -> Callable[[Records], int]:
    """Return a function that sums a value over records."""
    return lambda rows: sum(row[key] for row in rows)


def decimals(value: float, digits: int) -> str:
    """Return a number as text with the given decimals; "-" for NaN."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def failures(rows: Records) -> int:
    """Return the number of records with an error."""
    return sum(row.get("error") is not None for row in rows)


TIME = number(("time", "ms"), 6, "ms", 0)
"""Column of the median duration of a detection, ms."""
