"""Pointers that `git clone` leaves in place of large files where Git LFS is missing."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError

_POINTER = b"version https://git-lfs.github.com/spec/"


def check_not_pointer(path: Path, head: bytes) -> None:
    """Raise InputError if `head`, the first bytes of the file `path` (40 or more), is a pointer of Git LFS."""
    if head.startswith(_POINTER):
        raise InputError(
            f"{path}: is a pointer of Git LFS and not the file itself: install Git LFS and run git lfs pull in the repository",
            code="file-lfs-pointer",
        )
