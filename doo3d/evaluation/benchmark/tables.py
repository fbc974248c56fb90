"""Format records as a text table, as CSV and as JSON."""

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from ...outputs.detection_json import dumps
from ...types.tables import cell
from ..metrics.confidence import most_confident_part, ratio, reliability
from ..metrics.correct import COUNTED, FRAMES, LOOKED_AT
from ..metrics.record import Column, Record, Records

SCHEMA = "doo3d/evaluation/3"


def label(row: Record) -> str:
    """Return the name of a record's group: its family, and its variant if it has one."""
    return f"{row.family} {row.variant}" if "variant" in row else str(row.family)


def grouped(rows: Records, name: Callable[[Record], str] = label) -> dict[str, list[Record]]:
    """Group records: name of the group -> its records, in the order in which groups first appear."""
    groups: dict[str, list[Record]] = {}
    for row in rows:
        groups.setdefault(name(row), []).append(row)
    return groups


def _overall(rows: Records) -> dict[str, list[Record]]:
    """Return "all" -> all records; of records with variants, those of each variant."""
    return grouped(rows, lambda row: f"all {row.variant}" if "variant" in row else "all")


def format_table(rows: Records, columns: Sequence[Column]) -> str:
    """Return a text table with a line for each group of records and one for all.

    An unknown value is shown as "-". If some of the records are marked as counted only, the shares of correct frames among these
    and among the others have a column each. If there are frames without a cable, a last line gives the number of them without a
    chain.
    """
    families, overall = grouped(rows), _overall(rows)
    if FRAMES in columns and len({row.counted for row in rows}) > 1:
        columns = [*columns[:1], LOOKED_AT, COUNTED, *columns[1:]]
    table = {name: [column.text(column.summarize(group)) for column in columns] for name, group in (families | overall).items()}
    widths = [max(column.width, *(len(cells[k]) for cells in table.values())) for k, column in enumerate(columns)]
    name_width = max(map(len, table))

    def line(name: str, cells: Sequence[str]) -> str:
        return " ".join([f"{name:{name_width}s}", *(f"{cell:>{width}s}" for cell, width in zip(cells, widths, strict=True))])

    titles = [[column.title[k] for column in columns] for k in (0, 1)]
    lines = [line("", title) for title in titles if any(title)]
    lines += [line(name, table[name]) for name in families]
    if len(families) > len(overall):
        lines += ["-" * len(lines[0]), *(line(name, table[name]) for name in overall)]
    empty = [row.chains == 0 for row in rows if row.get("objects") == 0 and row.get("error") is None and "chains" in row]
    if empty:
        lines.append(f"no chain in {ratio(sum(empty), len(empty))} of the frames without a cable")
    return "\n".join(lines)


def markdown_table(name: str, rows: Records, columns: Sequence[Column]) -> Iterator[str]:
    """Yield the lines of a Markdown table with a row for each variant of the records; `name` is the title of the first column."""
    titles = [" ".join(filter(None, column.title)) for column in columns]
    yield f"| {' | '.join([name, *titles])} |"
    yield "|---" * (len(columns) + 1) + "|"
    for variant, group in grouped(rows, lambda row: str(row.variant)).items():
        yield f"| {' | '.join([variant, *(column.text(column.summarize(group)) for column in columns)])} |"


def csv_text(rows: Records) -> str:
    """Return the records as CSV text: a line of column names and a line for each record.

    Unknown values (None, NaN) are empty; lists of numbers are left out. Without records, the text is empty.
    """
    plain = [row.plain() for row in rows]
    names = [
        name for name in dict.fromkeys(name for row in plain for name in row) if not any(_is_list(row.get(name)) for row in plain)
    ]
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    if rows:
        table.writerow(names)
    for row in plain:
        table.writerow(["" if _is_unknown(row.get(name)) else cell(row[name]) for name in names])
    return file.getvalue()


def json_text(rows: Records, columns: Sequence[Column], settings: Mapping[str, Any]) -> str:
    """Return the results of an evaluation as JSON text (schema doo3d/evaluation/3).

    It holds the settings, the summary of each group and of "all" by the columns, the reliability of the confidence if frames have
    one (see `reliability`: each bin, then the 75 % most confident frames), and all records. Unknown values are null.

    Parameters
    ----------
    rows
        the records.
    columns
        the columns of the table.
    settings
        settings of the evaluation, such as families, seeds and sensor; stored as given.
    """
    summaries = {
        name: {key: value for column in columns for key, value in column.summarize(group).items()}
        for name, group in (grouped(rows) | _overall(rows)).items()
    }
    document = {"schema": SCHEMA, "settings": dict(settings), "summary": summaries}
    if has_confidence(rows):
        document["reliability"] = {"bins": reliability(rows), "most_confident": most_confident_part(rows)}
    return dumps(document | {"frames": [row.plain() for row in rows]})


def has_confidence(rows: Records) -> bool:
    """Return whether the records are of frames, each with a confidence."""
    return bool(rows) and all("confidence" in row and "image_correct" in row and "variant" not in row for row in rows)


def _is_unknown(value: Any) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple))
