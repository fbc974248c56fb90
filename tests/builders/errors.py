"""Assertions on errors by their stable code instead of their sentence, which may change."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from doo3d.errors import DooError, InputError
from doo3d.inputs import open_capture


@contextmanager
def refuses(code: str, *parts: str, kind: type[DooError] = InputError) -> Iterator[pytest.ExceptionInfo[DooError]]:
    """Expect an error of type `kind` with this code, whose sentence contains each of the parts (file name, shape, value)."""
    with pytest.raises(kind) as caught:
        yield caught
    assert caught.value.code == code, f"{caught.value.code}: {caught.value}"
    for part in parts:
        assert part in str(caught.value)


def refused(path: str | Path, code: str, *parts: str, index: int | None = None, **how: Any) -> None:
    """Assert that opening a capture, or with an index loading that frame, fails as `refuses` says; `how` goes to open_capture."""
    if index is None:
        with refuses(code, *parts):
            open_capture(path, **how)
    else:
        frame = open_capture(path, **how).frames[index]
        with refuses(code, *parts):
            frame.load()


def code_in(sentence: str) -> str:
    """Return the code in brackets at the end of the command's error; "" if there is none."""
    match = re.search(r" \[([a-z0-9-]+)\]$", sentence.rstrip("\n"))
    return match[1] if match else ""
