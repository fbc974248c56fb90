"""A pseudo-terminal: what a command shows a user there, and Ctrl-C from its keyboard."""

from __future__ import annotations

import os
import re
import select
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

CTRL_C = b"\x03"
_PARTS = re.compile(r"\x1b\[([?\d;]*)([A-Za-z])|\x1b\][^\x07\x1b]*(?:\x07|\x1b\\)|([\r\n\b\x07])|([^\x1b\r\n\b\x07]+)", re.DOTALL)


@dataclass
class Screen:
    """The lines of a terminal, those scrolled off included, after all that was written to it.

    Attributes
    ----------
    columns
        number of characters per line; a longer line goes on in the next.
    """

    columns: int
    lines: list[str] = field(default_factory=lambda: [""])
    cursor_is_hidden: bool = False
    _wrapped: set[int] = field(default_factory=set)
    _row: int = 0
    _column: int = 0

    @property
    def text(self) -> str:
        """What is on the screen, with lines as they were written, be they longer than the screen is wide."""
        breaks = ["" if row in self._wrapped else "\n" for row in range(len(self.lines))]
        return "".join(end + line for end, line in zip(breaks, self.lines, strict=True)).strip("\n") + "\n"

    def write(self, text: str) -> None:
        """Take in what a program writes."""
        position = 0
        while match := _PARTS.match(text, position):
            position = match.end()
            numbers, command, control, letters = match.groups()
            if letters is not None:
                self._put(letters)
            elif control is not None:
                self._control(control)
            elif command is not None:
                self._command(numbers, command)
        assert position == len(text), text[position : position + 20]

    def _put(self, letters: str) -> None:
        for letter in letters:
            if self._column == self.columns:
                self._move(self._row + 1, 0)
                self._wrapped.add(self._row)
            line = self.lines[self._row].ljust(self._column)
            self.lines[self._row] = line[: self._column] + letter + line[self._column + 1 :]
            self._column += 1

    def _control(self, letter: str) -> None:
        if letter == "\n":
            self._move(self._row + 1, self._column)
        elif letter == "\r":
            self._column = 0
        elif letter == "\b":
            self._column = max(0, self._column - 1)

    def _command(self, numbers: str, command: str) -> None:
        if command in "lh" and numbers == "?25":
            self.cursor_is_hidden = command == "l"
        elif command == "A":
            self._move(max(0, self._row - int(numbers or 1)), self._column)
        elif command == "K":
            self.lines[self._row] = "" if numbers == "2" else self.lines[self._row][: self._column]
            self._wrapped.discard(self._row)
        else:
            assert command == "m", (numbers, command)

    def _move(self, row: int, column: int) -> None:
        self.lines += [""] * (row + 1 - len(self.lines))
        self._row, self._column = row, column


@dataclass
class Shown:
    """What a command showed, and how it ended: exit code, all that it wrote, and the screen after it."""

    code: int
    written: str
    screen: Screen

    @property
    def lines(self) -> list[str]:
        """The lines left on the screen, without blank ones."""
        return [line.rstrip() for line in self.screen.lines if line.strip()]


def in_terminal(
    *command: object, folder: Path, columns: int = 100, until: Callable[[str], bool] | None = None, seconds: float = 120
) -> Shown:
    """Run a command with a terminal as its input and output.

    Parameters
    ----------
    command
        the program and its arguments.
    folder
        its working directory.
    columns
        width of the terminal.
    until
        called with all that was written so far; Ctrl-C is pressed once it returns True. None: never.
    seconds
        after which the command is killed, and the test fails.
    """
    import fcntl
    import termios

    mine, its = os.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    hidden = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_INTERACTIVE", "TTY_COMPATIBLE")
    env = {key: value for key, value in os.environ.items() if key not in hidden} | {"PATH": path, "TERM": "xterm-256color"}
    process = subprocess.Popen(
        list(map(str, command)),
        cwd=folder,
        env=env,
        stdin=its,
        stdout=its,
        stderr=its,
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # Ctrl-C reaches all its processes
    )
    os.close(its)
    written, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if select.select([mine], [], [], 0.1)[0]:
            try:
                part = os.read(mine, 1 << 16)
            except OSError:  # Linux, once the other side is closed
                part = b""
            if not part:
                break
            written += part
        if until is not None and until(written.decode(errors="ignore")):
            os.write(mine, CTRL_C)
            until = None
    else:
        process.kill()
    code = process.wait()
    os.close(mine)
    text = written.decode()
    assert until is None, f"never came to where it was to be interrupted\n{text}"
    screen = Screen(columns)
    screen.write(text)
    return Shown(code, text, screen)
