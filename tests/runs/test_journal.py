"""What else may be in the folder of a run: foreign lines in the journal, damaged products, links, leftovers."""

import json
import sys

import pytest
from builders.runs import files_of, finished_frames

from doo3d.config import Config
from doo3d.inputs import open_capture
from doo3d.outputs.atomic import PREFIX
from doo3d.runs import run as batch

pytestmark = pytest.mark.usefixtures("fake_detection")


@pytest.fixture
def made(capture, tmp_path):
    """The capture and the folder of a finished run of three frames, and its files."""
    folder, out = capture(frames=3), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    return folder, out, files_of(out)


def done_again(folder, out):
    done = []
    batch.run(open_capture(folder), out, Config(), batch.RunOptions(report=lambda record: done.append(record.name)))
    return done


FOREIGN = {
    "nothing": {},
    "other": {"a": 1},
    "name": {"name": 3, "status": "ok"},
    "half": {"name": "000001", "status": "ok"},
    "lengths": {"lengths": "abc"},
    "lists": {"radii": [[1]]},
    "huge": {"seconds": 10**400},
    "confidences": {"confidences": ["."]},
    "objects": {"objects": "many"},
    "notes": {"notes": [1]},
    "stages": {"stages": [1]},
    "status": {"status": []},
    "doubtful": {"doubtful": None},
    "evidence": {"evidence": []},
    "files": {"files": None},
}


@pytest.mark.parametrize("key", FOREIGN)
def test_foreign_lines_in_the_journal_are_left_out(made, key):
    folder, out, files = made
    lines = (out / "progress.jsonl").read_text().splitlines()
    whole = json.loads(lines[1]) if key not in ("nothing", "other", "name", "half") else {}
    lines[1] = json.dumps(whole | FOREIGN[key])
    (out / "progress.jsonl").write_text("\n".join(lines) + "\n")
    assert done_again(folder, out) == ["000001"]
    assert files_of(out) == files
    assert finished_frames(out) == 3


@pytest.mark.parametrize("line", [b"[" * 100_000, b"{" + b'"a":{' * 50_000, b"1" * 5000, b"\xff\xfe", b"null", b"[]"])
def test_lines_that_are_no_objects_end_the_journal(made, line):
    folder, out, files = made
    journal = (out / "progress.jsonl").read_bytes().splitlines(keepends=True)
    (out / "progress.jsonl").write_bytes(journal[0] + line + b"\n" + journal[2])
    assert done_again(folder, out) == ["000001", "000002"]
    assert files_of(out) == files


@pytest.mark.parametrize("name", ["000000.jpg", "000001.json", "000002.jpg"])
@pytest.mark.parametrize("how", ["flipped", "cut", "emptied", "longer"])
def test_a_damaged_product_is_made_again(made, name, how):
    folder, out, files = made
    good = files[name]
    flipped = good[:50] + bytes([good[50] ^ 1]) + good[51:]
    (out / name).write_bytes({"flipped": flipped, "cut": good[:-7], "emptied": b"", "longer": good + b" "}[how])
    assert done_again(folder, out) == [name[:6]]
    assert files_of(out) == files


@pytest.mark.skipif(sys.platform == "win32", reason="links")
def test_a_link_in_place_of_the_journal_is_not_written_through(made, tmp_path):
    folder, out, files = made
    victim = tmp_path / "victim"
    (out / "progress.jsonl").rename(victim)
    content = victim.read_bytes()
    (out / "progress.jsonl").symlink_to(victim)
    (out / "000002.jpg").unlink()
    assert done_again(folder, out) == ["000002"]
    assert victim.read_bytes() == content
    assert not (out / "progress.jsonl").is_symlink()
    assert files_of(out) == files


@pytest.mark.skipif(sys.platform == "win32", reason="links")
def test_a_dangling_link_in_place_of_the_journal(made, tmp_path):
    folder, out, files = made
    (out / "progress.jsonl").unlink()
    (out / "progress.jsonl").symlink_to(tmp_path / "nowhere")
    assert len(done_again(folder, out)) == 3
    assert not (tmp_path / "nowhere").exists()
    assert files_of(out) == files


def test_temporary_files_are_swept_even_if_all_frames_are_finished(made):
    folder, out, files = made
    (out / f"{PREFIX}1-ab.tmp").write_bytes(b"half a manifest")
    assert done_again(folder, out) == []
    assert files_of(out) == files
