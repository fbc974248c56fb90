"""Runs that resume after any interruption, and refuse results of another input, configuration or version."""

import json
import os

import pytest
from builders.errors import refuses
from builders.runs import break_frame, files_of, read_manifest

from doo3d.config import Config
from doo3d.inputs import ReadOptions, open_capture
from doo3d.outputs import run_folder as results
from doo3d.runs import run as batch

pytestmark = pytest.mark.usefixtures("fake_detection")


class Killed(BaseException):
    """What ends a process at once: nothing catches it to clean up."""


@pytest.fixture
def ended(monkeypatch):
    """A function that runs with a process that ends right before (or after) its nth write to the disk."""

    def run(source, out, at, after=False):
        count = [0]

        def mortal(real):
            def call(*args):
                count[0] += 1
                if count[0] == at and not after:
                    raise Killed
                real(*args)
                if count[0] == at:
                    raise Killed

            return call

        with monkeypatch.context() as patched:
            for owner, name in ((results, "write_bytes"), (results, "write_text"), (results.Journal, "add")):
                patched.setattr(owner, name, mortal(getattr(owner, name)))
            batch.run(open_capture(source), out, Config())

    return run


@pytest.mark.slow
def test_a_run_that_was_ended_anywhere_goes_on_and_repeats_one_frame_at_most(capture, tmp_path, ended):
    folder = capture(frames=4)
    break_frame(folder, "000001")
    batch.run(open_capture(folder), tmp_path / "whole", Config())
    expected = files_of(tmp_path / "whole")
    moments = 0
    for at in range(1, 100):
        for after in (False, True):
            out = tmp_path / f"out{at}{after}"
            try:
                ended(folder, out, at, after)
                break
            except Killed:
                moments += 1
            lines = (out / "progress.jsonl").read_bytes().count(b"\n") if (out / "progress.jsonl").exists() else 0
            before, done = [], []
            batch.run(open_capture(folder), out, Config(), batch.RunOptions(report=done.append, resumed=before.extend))
            assert (len(before), len(done)) == (lines, 4 - lines)
            assert files_of(out) == expected
        else:
            continue
        break
    assert moments == 2 * (2 + 3 * 3 + 1 + 2)  # manifest and config; files and journal of each frame; both at the end


def test_half_a_line_in_the_journal_is_written_over(capture, tmp_path):
    folder, out = capture(frames=3), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    expected, journal = files_of(out), out / "progress.jsonl"
    whole = journal.read_bytes()
    first, second, _ = whole.splitlines(keepends=True)
    for rest, left in ((first + second[:-1], 2), (first + second + b'{"name": \n', 1), (b"", 3), (b"\0" * 900, 3)):
        journal.write_bytes(rest)
        done = []
        batch.run(open_capture(folder), out, Config(), batch.RunOptions(report=done.append))
        assert len(done) == left
        assert [json.loads(line)["name"] for line in journal.read_bytes().splitlines()] == ["000000", "000001", "000002"]
        assert files_of(out) == expected


def test_a_frame_whose_file_is_gone_is_made_again(capture, tmp_path):
    folder, out = capture(frames=3), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    expected = files_of(out)
    (out / "000001.jpg").unlink()
    batch.run(open_capture(folder), out, Config())
    assert files_of(out) == expected


def test_nothing_is_done_again_when_all_is_finished(capture, tmp_path, fake_detection):
    folder, out = capture(frames=2), tmp_path / "out"
    first = batch.run(open_capture(folder), out, Config())
    fake_detection["do"] = None
    again = []
    assert batch.run(open_capture(folder), out, Config(), batch.RunOptions(resumed=again.extend)).counts() == first.counts()
    assert len(again) == 2


@pytest.mark.parametrize("part", ["depth/000001.png", "color/000000.jpg", "camera_intrinsic.json"])
def test_an_input_that_has_changed_is_noticed(capture, tmp_path, part):
    folder, out = capture(frames=2), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    stat = (folder / part).stat()
    os.utime(folder / part, ns=(stat.st_atime_ns, stat.st_mtime_ns + 1_000_000))
    with refuses("input-changed", "restart=True"):
        batch.run(open_capture(folder), out, Config())
    batch.run(open_capture(folder), out, Config(), batch.RunOptions(restart=True))


def test_other_ways_of_reading_are_another_input(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    batch.run(open_capture(folder), out, Config(), batch.RunOptions(reading=ReadOptions()))
    with refuses("out-other-input", "reading", "force=True"):
        batch.run(open_capture(folder), out, Config(), batch.RunOptions(reading=ReadOptions(depth_scale=5000)))


def test_results_of_other_versions_are_not_mixed(capture, tmp_path):
    folder, out = capture(), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    made = read_manifest(out)
    made["versions"]["numpy"] = "0.1"
    (out / "manifest.json").write_text(json.dumps(made))
    with refuses("versions-changed", "numpy 0.1", "restart=True"):
        batch.run(open_capture(folder), out, Config())
