"""Errors asserted by their code, which is stable, and not by their sentence, which is not."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from doo3d.errors import DooError, InputError


@contextmanager
def refuses(code: str, *parts: str, kind: type[DooError] = InputError) -> Iterator[None]:
    """Expect an error of this kind with this code, whose sentence holds each of the parts: a file's name, a shape, a value."""
    with pytest.raises(kind) as caught:
        yield
    assert caught.value.code == code, f"{caught.value.code}: {caught.value}"
    for part in parts:
        assert part in str(caught.value)


def code_in(said: str) -> str:
    """The code behind the one sentence that the command has said; "" where there is none."""
    found = re.search(r" \[([a-z0-9-]+)\]$", said.rstrip("\n"))
    return found[1] if found else ""
