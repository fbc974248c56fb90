"""Remember the files made from a run's results, such as its report, which may be replaced until a user changes them."""

import contextlib
import os
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..guard.parsing import read_json
from .atomic import PREFIX, write_text
from .detection_json import dumps

PRODUCTS = f"{PREFIX}products.json"
"""File in the folder of the results: path of each file made from them, relative to the folder -> size and CRC-32."""

_CHUNK_BYTES = 1 << 20


class Products:
    """The files made from the results in a folder, with checksums that show whether they have changed since.

    Parameters
    ----------
    results
        the folder of the results.
    """

    def __init__(self, results: Path) -> None:
        self._folder = results

    def are_unchanged(self, path: Path) -> bool:
        """Return whether a file, or every file in a folder, was made from these results and is unchanged."""
        made = self._read()
        return path.exists() and all(made.get(self._key(file)) == _check(file) for file in _files(path))

    def add(self, paths: Iterable[Path]) -> None:
        """Remember files, and those in folders, as made from these results; do nothing if the folder is not writable."""
        made = self._read() | {self._key(file): _check(file) for path in paths for file in _files(path)}
        there = {key: check for key, check in made.items() if (self._folder / key).exists()}
        with contextlib.suppress(OSError):
            write_text(self._folder / PRODUCTS, dumps(dict(sorted(there.items()))))

    def forget(self) -> None:
        """Forget all files, when other results replace these."""
        with contextlib.suppress(OSError):
            (self._folder / PRODUCTS).unlink(missing_ok=True)

    def _key(self, file: Path) -> str:
        return Path(os.path.relpath(file.resolve(), self._folder.resolve())).as_posix()

    def _read(self) -> dict[str, Any]:
        try:
            values = read_json(self._folder / PRODUCTS)
        except InputError:
            return {}
        return values if isinstance(values, dict) else {}


def checks(path: Path) -> dict[str, list[int] | None]:
    """Return [size in bytes, CRC-32] of a file, or of each file in a folder by its relative path."""
    return {file.relative_to(path).as_posix(): _check(file) for file in _files(path)}


def _files(path: Path) -> list[Path]:
    return [file for file in path.rglob("*") if not file.is_dir()] if path.is_dir() else [path]


def _check(file: Path) -> list[int] | None:
    """Return [size in bytes, CRC-32] of a file; None if it cannot be read."""
    size = crc = 0
    try:
        with file.open("rb") as opened:
            while chunk := opened.read(_CHUNK_BYTES):
                size, crc = size + len(chunk), zlib.crc32(chunk, crc)
    except OSError:
        return None
    return [size, crc]
