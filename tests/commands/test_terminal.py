"""Every command that shows progress, in a terminal: what is left on the screen is what a pipe gets, and nothing else."""

import io
import os
import re
import shutil
import subprocess
import sys

import pytest
from builders.paths import SAMPLES
from builders.photos import cross, labelled, painted, save
from builders.runs import break_frame
from builders.terminal import Screen, Shown, in_terminal

from doo3d.commands.messages import wrapped
from doo3d.commands.progress import rate_text
from doo3d.commands.progress_bars import remove_bars, with_progress

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")

BAR = "━"
MODES = {"alone": (), "workers": ("--workers", "2"), "sequence": ("--sequence",)}
WIDTHS = (20, 200)
OTHERS = {
    "report": "report out --no-clouds --force",
    "video": "video out --force",
    "npz": "export out --to npz --force",
    "csv": "export out --to csv --force",
    "recording": "view out --save out.rrd --force",
    "scenes": "evaluate scenes --families straight --seeds 2 --size 320x240",
    "capture": "evaluate capture crossing --truth crossing/truth.json",
    "ablations": "evaluate ablations --data frames --families straight --seeds 2 --size 320x240 --steps necks",
    "sequences": "evaluate sequences --own dragged --seeds 1 --frames 4 --size 320x240",
    "trees": "evaluate trees --families tree --seeds 2 --size 320x240",
    "photos": "evaluate dataset mbest photos",
    "cases": "bench --only cable, --runs 1",
}
"""Name -> a command with a bar."""

PLAIN = {
    "compare": "compare capture",
    "bench": "bench capture --runs 1",
    "tune": "tune capture --force",
    "info": "info capture --contact-sheet sheet.png",
    "explain": "explain capture",
    "results": "evaluate results results --truth crossing/truth.json",
}
"""Name -> a command of many steps that prints lines as it goes, or is done at once."""


@pytest.fixture
def place(capture, tmp_path):
    """A folder with a capture of four frames."""
    capture(frames=4)
    return tmp_path


def detect(place, *options: str, **how) -> Shown:
    return in_terminal("doo3d", "detect", "capture", "-o", "out", *options, folder=place, **how)


def words(text: str) -> list[str]:
    """Return the lines of a text in order of the alphabet, every number as 0, and every run of blanks as one."""
    return sorted(re.sub(r"[+-]?[\d.]+", "0", " ".join(line.split())) for line in text.splitlines() if line.strip())


def is_clean(shown: Shown) -> None:
    """Check that nothing of a bar is left, the cursor is there, and nothing broke."""
    assert "Traceback" not in shown.written, shown.written
    assert not shown.screen.cursor_is_hidden
    assert not [line for line in shown.lines if BAR in line], shown.lines


def piped(place, *command: str) -> str:
    done = subprocess.run(["doo3d", *command], cwd=place, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.stdout


def results(place) -> dict[str, bytes]:
    """Return every file of the run but the journals."""
    return {str(path): path.read_bytes() for path in (place / "out").rglob("*") if path.is_file() and path.suffix != ".jsonl"}


@pytest.mark.parametrize("mode", ["alone", *(pytest.param(name, marks=pytest.mark.slow) for name in ("workers", "sequence"))])
def test_first_run_nothing_left_and_resumed(place, mode):
    options = MODES[mode]
    expected = words(piped(place, "detect", "capture", "-o", "out", *options))
    made = results(place)
    for columns in WIDTHS if mode == "alone" else WIDTHS[:1]:
        shutil.rmtree(place / "out")
        first = detect(place, *options, columns=columns)
        is_clean(first)
        assert first.code == 0
        assert BAR in first.written
        assert words(first.screen.text) == expected
        for remove, sentence in ((None, "4 frames are finished already, nothing is left"), ("000002.jpg", "resuming after them")):
            if remove:
                (place / "out" / remove).unlink()
            again = detect(place, *options, columns=columns)
            is_clean(again)
            assert again.code == 0
            assert again.screen.text.count(sentence) == 1
            assert again.screen.text.count("4 frames, 4 chains -> out") == 1
            assert results(place) == made


@pytest.mark.parametrize(
    ("mode", "moment"),
    [("workers", "0/4"), *(pytest.param(*each, marks=pytest.mark.slow) for each in (("alone", "1/4"), ("sequence", "3/4")))],
)
def test_interrupted_and_then_resumed(place, mode, moment):
    detect(place, *MODES[mode])
    made = results(place)
    shutil.rmtree(place / "out")
    ended = detect(place, *MODES[mode], columns=60, until=lambda written: moment in written)
    is_clean(ended)
    assert ended.code == 130
    assert ended.screen.text.count("doo3d: interrupted") == 1
    for name in ("000000", "000001", "000002", "000003"):
        assert ended.screen.text.count(f"{name}   1 chain") <= 1
    again = detect(place, *MODES[mode], columns=60)
    is_clean(again)
    assert again.code == 0
    assert results(place) == made


@pytest.mark.parametrize("columns", WIDTHS)
def test_failed_frames(place, columns):
    break_frame(place / "capture", "000001")
    shown = detect(place, columns=columns)
    is_clean(shown)
    assert shown.code == 1
    assert shown.screen.text.count("000001   failed: ") == 1
    again = detect(place, "--retry-failed", columns=columns)
    is_clean(again)
    assert again.screen.text.count("000001   failed: ") == 1
    assert again.screen.text.count("note: 1 failed frame is tried again") == 1


@pytest.fixture(scope="module")
def products(tmp_path_factory):
    """A folder with captures, and results of one in it; what the commands of this test make stays in it."""
    folder = tmp_path_factory.mktemp("products")
    shutil.copytree(SAMPLES / "crossing", folder / "crossing")
    for name in ("a", "b"):
        save(folder / "photos" / "S1" / "images" / f"{name}.jpg", painted(labelled(cross())))
        save(folder / "photos" / "S1" / "labels" / f"{name}.png", labelled(cross()))
    shutil.copytree(SAMPLES / "crossing", folder / "capture")
    (folder / "capture" / "truth.json").unlink()
    assert "3 frames" in piped(folder, "detect", "capture", "-o", "out")
    shutil.copytree(folder / "out", folder / "results")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS | PLAIN)
def test_other_commands(products, name):
    command = (OTHERS | PLAIN)[name].split()
    for columns in WIDTHS if name == "report" else WIDTHS[1:]:
        shown = in_terminal("doo3d", *command, folder=products, columns=columns)
        is_clean(shown)
        assert shown.code in (0, 1), shown.written
        assert (BAR in shown.written) == (name in OTHERS)
    assert words(shown.screen.text) == words(piped(products, *command))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["report", "scenes", "npz"])
def test_other_commands_interrupted(products, name):
    shown = in_terminal("doo3d", *OTHERS[name].split(), folder=products, until=lambda written: BAR in written)
    is_clean(shown)
    assert shown.code == 130
    assert shown.screen.text.splitlines() == ["doo3d: interrupted"]


def test_end_of_a_bar_that_the_terminal_threw_away(monkeypatch):
    """Ctrl-C empties what a terminal holds: of a bar that has just ended it may have shown the first drawing alone."""

    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm-256color")
    assert list(with_progress([1, 2, 3])) == [1, 2, 3]
    written = terminal.getvalue()
    remove_bars()
    screen, first = Screen(100), re.search("0/3", written)
    screen.write(written[: first.end()] + "^C")
    assert screen.cursor_is_hidden
    assert BAR in screen.text
    screen.write(terminal.getvalue()[len(written) :])
    assert not screen.cursor_is_hidden
    assert screen.text.strip() == ""


@pytest.mark.parametrize(
    ("frames", "seconds", "text"),
    [(1, 0.1, ""), (2, 0.2, ""), (3, 0.3, "10.0 frames/s"), (3, 3.0, "1.0 frames/s"), (3, 37.5, "12.5 s/frame"), (5, 0.0, "")],
)
def test_a_rate_is_that_of_three_frames_or_more(frames, seconds, text):
    assert rate_text(frames, seconds) == text


def test_notes_wrap_at_words_in_a_terminal_alone(place):
    camera = place / "capture" / "camera_intrinsic.json"
    shutil.move(camera, place / "elsewhere.json")
    shown, narrow = (detect(place, columns=columns) for columns in (70, 20))
    error = piped(place, "detect", "capture", "-o", "out")
    assert len(error) > 140
    assert error.count("\n") == 1
    assert " ".join(shown.screen.text.split()) == error.strip()
    assert len(shown.lines) > 2
    assert all(word in error.split() for line in shown.lines for word in line.split()), "a word is broken"
    assert narrow.screen.text == error


def test_further_lines_begin_below_the_text(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

        def fileno(self) -> int:
            return 1

    monkeypatch.setattr("os.get_terminal_size", lambda file: os.terminal_size((60, 24)))
    lines = wrapped("000001   note: " + "word " * 30 + "end", Terminal(), 15).splitlines()
    assert len(lines) == 4
    assert all(len(line) <= 60 for line in lines)
    assert all(line.startswith(" " * 15 + "word") for line in lines[1:])
    assert wrapped("note: " + "word " * 30, io.StringIO()).count("\n") == 0
