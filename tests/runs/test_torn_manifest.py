"""A manifest that a power failure left empty, cut off or full of zero bytes."""

import json
import os

import pytest
from builders.errors import refuses
from builders.runs import files_of

from doo3d.config import Config, load_config
from doo3d.inputs import open_capture
from doo3d.outputs import run_folder
from doo3d.outputs.run_identity import identity
from doo3d.outputs.torn_manifest import TORN_NOTE
from doo3d.runs import run as batch

pytestmark = pytest.mark.usefixtures("fake_detection")

TORN = {
    "empty": lambda data: b"",
    "one byte": lambda data: data[:1],
    "in the schema": lambda data: data[:20],
    "in the versions": lambda data: data[:100],
    "half": lambda data: data[: len(data) // 2],
    "all but two": lambda data: data[:-2],
    "zeros": lambda data: bytes(len(data)),
    "zeros behind": lambda data: data[:64] + bytes(len(data) - 64),
}


@pytest.fixture
def made(capture, tmp_path):
    """The capture and the folder of a finished run of three frames, and its files."""
    folder, out = capture(frames=3), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    return folder, out, files_of(out)


def run_again(folder, out, **options):
    """Repeat the run; the notes, and the names of the frames that are done."""
    notes, done = [], []
    values = {"config": Config()} | options
    batch.run(
        open_capture(folder),
        out,
        **values,
        options=batch.RunOptions(note=notes.append, report=lambda record: done.append(record.name)),
    )
    return notes, done


@pytest.mark.parametrize("how", TORN)
@pytest.mark.parametrize("frames", [3, 1, 0])
def test_it_is_written_anew_and_the_finished_frames_are_kept(made, how, frames):
    folder, out, files = made
    (out / "manifest.json").write_bytes(TORN[how](files["manifest.json"]))
    journal = (out / "progress.jsonl").read_bytes().splitlines(keepends=True)
    (out / "progress.jsonl").write_bytes(b"".join(journal[:frames]))
    assert run_again(folder, out) == ([TORN_NOTE], ["000000", "000001", "000002"][frames:])
    assert files_of(out) == files
    assert run_again(folder, out) == ([], [])


@pytest.mark.parametrize("how", TORN)
def test_before_the_first_frame(capture, tmp_path, how):
    folder, out = capture(), tmp_path / "out"
    batch.run(open_capture(folder), tmp_path / "whole", Config())
    out.mkdir()
    (out / "manifest.json").write_bytes(TORN[how]((tmp_path / "whole" / "manifest.json").read_bytes()))
    assert run_again(folder, out) == ([TORN_NOTE], ["000000"])
    assert files_of(out) == files_of(tmp_path / "whole")


def test_whose_results_they_are_is_still_known(made, capture, monkeypatch):
    folder, out, files = made
    torn = files["manifest.json"][:50]
    (out / "manifest.json").write_bytes(torn)
    with refuses("out-other-input", "manifest.json is damaged"):
        run_again(capture("second", frames=3), out)
    monkeypatch.setattr(run_folder, "identity", lambda *args: identity(*args) | {"versions": {"doo3d": "0.0"}})
    with refuses("versions-changed"):
        run_again(folder, out)


def test_results_of_changed_files_or_of_other_settings(made, fake_detection):
    folder, out, files = made
    (out / "manifest.json").write_bytes(files["manifest.json"][:50])
    notes, done = run_again(folder, out, config=load_config("default", {"seed": 3}))
    assert len(done) == 3
    assert notes[0] == TORN_NOTE
    assert "(seed)" in notes[1]
    (out / "manifest.json").write_bytes(b"")
    stat = (folder / "depth" / "000001.png").stat()
    os.utime(folder / "depth" / "000001.png", ns=(stat.st_atime_ns, stat.st_mtime_ns + 1_000_000))
    with refuses("input-changed"):
        run_again(folder, out, config=load_config("default", {"seed": 3}))


@pytest.mark.parametrize("content", [b"{}", b'{"schema": "other"', b"mine", b"[", b'{"name": "other"}'])
def test_the_manifest_of_another_program_is_not_torn(made, content):
    folder, out, _ = made
    (out / "manifest.json").write_bytes(content)
    with refuses("out-foreign"):
        run_again(folder, out)
    assert (out / "manifest.json").read_bytes() == content


def test_an_empty_manifest_beside_other_files_is_not_ours(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    out.mkdir()
    (out / "manifest.json").write_bytes(b"")
    (out / "mine.txt").write_text("keep")
    with refuses("out-foreign"):
        run_again(folder, out)


def test_the_journal_names_the_run_in_every_line(made):
    _, out, _ = made
    lines = [json.loads(line)["run"] for line in (out / "progress.jsonl").read_text().splitlines()]
    assert len(lines) == 3
    assert {tuple(sorted(line)) for line in lines} == {("config", "files", "input", "versions")}
    assert lines[0] == lines[1] == lines[2]


def test_from_the_shell(doo3d, capture, tmp_path):
    folder = capture(frames=2)
    assert doo3d("detect", folder)[0] == 0
    (tmp_path / "out" / "manifest.json").write_bytes(b"")
    code, _, err = doo3d("detect", folder)
    assert (code, err.splitlines()[0]) == (0, f"note: {TORN_NOTE}")
