"""What the tests share: small captures written to disk the way recorders write them."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from builders.captures import write_capture

from doo3d.cli import main


def pytest_configure() -> None:
    """Bound the examples of Hypothesis, and let commands be interrupted where tests run in the background of a script.

    A shell starts such jobs with SIGINT ignored, and commands inherit that.
    """
    with suppress(ImportError):  # some environments of the continuous integration have pytest alone
        from hypothesis import settings

        settings.register_profile("doo3d", max_examples=40, deadline=None, derandomize=True)
        settings.load_profile("doo3d")
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def capture(tmp_path: Path) -> Callable[..., Path]:
    """A function that writes a folder capture: `capture(name, frames=2, color=True, mask=False, intrinsics={...})`."""
    return lambda name="capture", **contents: write_capture(tmp_path / name, **contents)


@pytest.fixture
def doo3d(monkeypatch, capfd, tmp_path):
    """A function that runs the command line in an empty folder: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*args: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["doo3d", *map(str, args)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        said = capfd.readouterr()
        return ended.value.code or 0, said.out, said.err

    return run


@pytest.fixture
def refused(doo3d, tmp_path):
    """A function that runs `detect`, which is to end with exit code 2, one sentence, and nothing written; the sentence.

    `refused(*args, code="mask-shape")` checks the error's code as well; wording is asserted only where it names a file or value.
    """

    def run(*args, code: str | None = None) -> str:
        before = sorted(os.listdir(tmp_path))
        status, out, err = doo3d("detect", *args)
        assert status == 2
        assert out == ""
        assert sorted(os.listdir(tmp_path)) == before
        lines = err.splitlines()
        assert len(lines) == 1, err
        assert lines[0].startswith("doo3d: ")
        assert code is None or lines[0].endswith(f" [{code}]"), lines[0]
        return lines[0]

    return run
