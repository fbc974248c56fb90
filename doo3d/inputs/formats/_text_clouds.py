"""Read clouds in text files: rows of numbers with or without names and counts (XYZ, PTS, CSV), and Leica's PTX.

In PTX, a scan consists of its numbers of columns and rows, four lines with the position and the axes of the scanner, a 4x4 matrix
for row vectors, and a line x y z intensity [r g b] for each cell, 0 0 0 if the cell has no measurement. Further scans follow.
"""

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...guard.limits import check_points
from ...types import Array
from ._cloud_files import Points, colors_in, damaged

_COMMENTS = ("#", "//")  # beginnings of comment lines
_MAX_LINE = 1000  # letters of a line that counts as one point
_MAX_LETTERS = 1 << 20  # of a line, comments included
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|nan|inf)"
_ROW = re.compile(rf"\s*{_NUMBER}(?:[\s,;]+{_NUMBER}){{2,}}[\s,;]*", re.IGNORECASE)
_COORDINATES, _COLORS = ("x", "y", "z"), ("r", "g", "b")
_ALIASES = {"easting": "x", "northing": "y", "elevation": "z", "red": "r", "green": "g", "blue": "b"}
_ALIASES |= {"points0": "x", "points1": "y", "points2": "z", "rf": "r", "gf": "g", "bf": "b"}  # ParaView, CloudCompare
_PTX_HEAD = 10  # lines of a scan before its cells


class Table(NamedTuple):
    """The rows of numbers in a text file.

    Attributes
    ----------
    first
        number of the line with the first row.
    mark
        character between columns; None for blanks.
    names
        names of the columns in lower case; empty without names.
    announced
        number of rows that the file announces; None if it does not.
    decimal_comma
        whether numbers have a decimal comma.
    is_cloud
        whether the first row begins with three numbers, or has numbers in the columns x, y and z.
    """

    first: int
    mark: str | None
    names: tuple[str, ...]
    announced: int | None
    decimal_comma: bool
    is_cloud: bool


def find_table(lines: Iterable[str]) -> Table | None:
    """Find the table in a text, with the names and the count before its first row; None if there is no row."""
    names, count = tuple[str, ...](), None
    for i, line in enumerate(lines):
        text = line.strip().lstrip("\ufeff")
        mark = next((mark for mark in "\t;," if mark in text), None)
        found = _names_in(text, mark)
        if set(_COORDINATES) <= set(found):
            names = found
        elif text.isdecimal() and count is None:
            count = int(text[:_MAX_LINE])
        elif text and not text.startswith(_COMMENTS):
            comma = mark != "," and "," in text
            cells = (text.replace(",", ".") if comma else text).split(mark)
            is_cloud = _ROW.fullmatch(" ".join(cells)) is not None or (bool(names) and _has_point(cells, names))
            return Table(i, mark, names, count, comma, is_cloud)
    return None


def _names_in(text: str, mark: str | None) -> tuple[str, ...]:
    """Return the names of columns in a line, without units in brackets: //X (m) and "x" become x."""
    words = re.sub(r"[(\[][^)\]]*[)\]]", "", text[:_MAX_LINE].lstrip("#/ ")).lower().split(mark)
    plain = [re.sub(r"[^a-z0-9]", "", word) for word in words]
    return tuple(_ALIASES.get(word, word) for word in plain)


def _has_point(cells: Sequence[str], names: tuple[str, ...]) -> bool:
    columns = [names.index(name) for name in _COORDINATES]
    return max(columns) < len(cells) and all(re.fullmatch(_NUMBER, cells[i].strip(), re.IGNORECASE) for i in columns)


def read_text(path: Path) -> Points:
    """Read a text file with one point per row: x y z in m, and r g b if these are named or the last of 6 or 7 columns.

    Columns are separated by blanks, tabs, commas or semicolons; lines that begin with # or // are comments. A line of names, in a
    comment or not, says which columns are x, y, z, r, g and b; a line with one whole number is a count of rows. Without names,
    columns are colors if there are six or seven, and the last three hold whole numbers from 0 to 255.

    Raises
    ------
    InputError : the file has no rows, or fewer than its count, a row has fewer than three numbers or another number of columns
        than the others, or a value is not a number.
    """
    table = find_table(_lines_of(path))
    if table is None:
        raise InputError(f"{path}: holds no points", code="cloud-empty")
    check_points(count_lines(path), str(path))
    rows: Iterator[str] = islice(_lines_of(path), table.first, None)
    named = [table.names.index(name) for name in (*_COORDINATES, *_COLORS) if name in table.names]
    named = named if len(named) == len(_COORDINATES) + len(_COLORS) else named[: len(_COORDINATES)]
    mark = table.mark if named else None
    if table.announced is not None:  # PTS has a count before each scan
        rows = (line for line in rows if not line.strip().isdecimal())
    marks = {",": "."} if table.decimal_comma else {}
    if table.mark and not named:
        marks[table.mark] = " "
    letters = str.maketrans(marks)
    cells = _numbers(path, (line.translate(letters) for line in rows), mark, named or None)
    if len(cells) < (table.announced or 0):
        raise damaged(path, f"it announces {table.announced} points and holds {len(cells)} rows")
    return Points(cells[:, :3], colors_in(cells, bool(named)))


def _lines_of(path: Path) -> Iterator[str]:
    """Yield the lines of a text file; raise InputError at a line too long for a point."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        while line := file.readline(_MAX_LETTERS + 1):
            if len(line) > _MAX_LETTERS:
                raise damaged(path, f"it has a line of more than {_MAX_LETTERS} letters, expected rows of numbers, x y z first")
            yield line


def count_lines(path: Path) -> int:
    """Return the number of lines of a file; a line of millions of characters counts as many lines."""
    with path.open("rb") as file:
        return max(sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 20), b"")), path.stat().st_size // _MAX_LINE)


def _numbers(path: Path, rows: Iterable[str], mark: str | None = None, columns: Sequence[int] | None = None) -> Array:
    try:
        cells = np.loadtxt(rows, comments=_COMMENTS, delimiter=mark, usecols=columns, ndmin=2)
    except ValueError as error:
        raise damaged(path, f"it is not rows of equally many numbers, x y z first: {error}") from None
    if cells.shape[1] < 3:
        raise InputError(f"{path}: has {cells.shape[1]} columns, expected at least x y z", code="points-shape")
    return np.asarray(cells)


def is_ptx(lines: Sequence[str]) -> bool:
    """Return whether the lines at the beginning of a text are those of a PTX file."""
    widths = [1, 1, 3, 3, 3, 3, 4, 4, 4, 4]
    return [len(line.split()) for line in lines[:_PTX_HEAD]] == widths and all(line.strip().isdecimal() for line in lines[:2])


def read_ptx(path: Path) -> Points:
    """Read all scans of a PTX file into one cloud in the frame of the file; its viewpoint is the scanner's if there is one scan.

    Raises
    ------
    InputError : the file is cut off, or a line does not have the numbers that the format prescribes.
    """
    check_points(count_lines(path), str(path))
    lines, at, scans = (line for line in _lines_of(path) if line.strip()), 0, list[Points]()
    while head := list(islice(lines, _PTX_HEAD)):
        if not is_ptx(head):
            raise damaged(path, f"line {at + 1} does not begin a scan (columns, rows, scanner, matrix)")
        count = int(head[0][:_MAX_LINE]) * int(head[1][:_MAX_LINE])
        rows = list(islice(lines, min(count, sys.maxsize)))
        if len(rows) < count:
            raise damaged(path, f"a scan announces {count} cells, and the file ends before")
        at += _PTX_HEAD + count
        pose = _numbers(path, head[6:])
        cells = _numbers(path, rows) if rows else np.zeros((0, 4))
        cells = cells[(cells[:, :3] != 0).any(axis=1)]
        scans.append(Points(cells[:, :3] @ pose[:3, :3] + pose[3, :3], colors_in(cells, False), pose[3, :3]))
    colors = [scan.colors for scan in scans if scan.colors is not None]
    return Points(
        np.concatenate([scan.points for scan in scans]),
        np.concatenate(colors) if len(colors) == len(scans) else None,
        scans[0].viewpoint if len(scans) == 1 else None,
    )
