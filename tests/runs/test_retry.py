"""Failed frames are tried again when their files have changed, or on demand; the results are those of a run in one go."""

import json
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from builders.errors import refuses
from builders.runs import break_frame, files_of, finished_frames, read_manifest

from doo3d.config import Config
from doo3d.inputs import FrameRef, open_capture
from doo3d.inputs.support.fingerprint import frame_paths
from doo3d.runs import run as batch
from doo3d.types import Chain, Detection


def detected(folder, out, **options):
    """Run; the names of the frames that were done, and the sentences about earlier runs."""
    done, notes = [], []
    batch.run(
        open_capture(folder),
        out,
        Config(),
        batch.RunOptions(report=lambda record: done.append(record.name), note=notes.append, **options),
    )
    return done, notes


@pytest.mark.parametrize("part", ["depth", "color"])
def test_a_frame_that_is_there_again_is_tried_again(doo3d, capture, tmp_path, part):
    folder = capture(frames=4)
    whole, *_ = doo3d("detect", folder, "-o", "whole")
    file = next((folder / part).glob("000001.*"))
    file.rename(tmp_path / "away")
    code, _, err = doo3d("detect", folder)
    assert (whole, code) == (0, 1)
    assert "000001   failed" in err
    (tmp_path / "away").rename(file)
    code, out, err = doo3d("detect", folder)
    assert (code, [line.split()[0] for line in out.splitlines()]) == (0, ["000001", "4"])
    assert "note: 1 failed frame is tried again: files of the input have changed" in err
    assert files_of(tmp_path / "out") == files_of(tmp_path / "whole")
    assert finished_frames(tmp_path / "out") == 4
    journal = (tmp_path / "out" / "progress.jsonl").read_text().splitlines()
    assert [json.loads(line)["name"] for line in journal] == ["000000", "000001", "000002", "000003"]


def test_a_frame_whose_file_was_mended_is_tried_again(capture, tmp_path, fake_detection):
    folder, out = capture(frames=3), tmp_path / "out"
    good = (folder / "depth" / "000002.png").read_bytes()
    break_frame(folder, "000000")
    break_frame(folder, "000002")
    assert detected(folder, out)[0] == ["000000", "000001", "000002"]
    assert detected(folder, out) == ([], [])
    (folder / "depth" / "000002.png").write_bytes(good)
    assert detected(folder, out)[0] == ["000002"]
    assert [frame["status"] for frame in read_manifest(out)["frames"]] == ["failed", "ok", "ok"]
    assert detected(folder, out) == ([], [])


def test_other_changes_of_the_input_are_refused_as_before(capture, tmp_path, fake_detection):
    folder, out = capture(frames=3), tmp_path / "out"
    break_frame(folder, "000000")
    detected(folder, out)
    shutil.copy(folder / "depth" / "000001.png", folder / "depth" / "000000.png")
    (folder / "depth" / "000002.png").touch()
    with refuses("input-changed"):
        detected(folder, out)


def test_retry_failed_tries_all_failures_again(doo3d, capture, tmp_path, monkeypatch, fake_detection):
    folder = capture(frames=3)
    with fake_detection.failing(MemoryError, "000001"):
        assert doo3d("detect", folder)[0] == 1
    code, out, err = doo3d("detect", folder)
    assert (code, out) == (1, "2 of 3 frames, 2 chains -> out\n")
    code, out, err = doo3d("detect", folder, "--retry-failed")
    assert code == 0
    assert out.splitlines()[0].startswith("000001   1 chain")
    assert "note: 1 failed frame is tried again" in err
    doo3d("detect", folder, "-o", "whole")
    assert files_of(tmp_path / "out") == files_of(tmp_path / "whole")


def test_ids_after_a_frame_that_is_tried_again_are_those_of_a_run_in_one_go(capture, tmp_path, fake_detection):
    """Each frame shows another cable: with one frame less, the ids of the later ones are one less."""
    folder, out = capture(frames=4), tmp_path / "out"

    def far_apart(data, config, mask):
        x = 10 * int(data.name)
        return Detection((Chain(np.array([[x, 0, 1.0], [x + 0.01, 0, 1.0]]), 0.01, 0.001, occluded=np.array([False])),))

    fake_detection["do"] = far_apart
    detected(folder, tmp_path / "whole")
    (folder / "depth" / "000001.png").rename(tmp_path / "away")
    detected(folder, out)
    assert json.loads((out / "000002.json").read_text())["chains"][0]["id"] == 1
    (tmp_path / "away").rename(folder / "depth" / "000001.png")
    assert detected(folder, out)[0] == ["000001", "000002", "000003"]
    assert files_of(out) == files_of(tmp_path / "whole")


def test_a_retry_that_is_killed_goes_on(capture, tmp_path, fake_detection):
    folder, out = capture(frames=4), tmp_path / "out"
    detected(folder, tmp_path / "whole")
    (folder / "depth" / "000000.png").rename(tmp_path / "away")
    detected(folder, out)
    (tmp_path / "away").rename(folder / "depth" / "000000.png")

    class Killed(BaseException):
        pass

    def dies(record):
        raise Killed

    with pytest.raises(Killed):
        batch.run(open_capture(folder), out, Config(), batch.RunOptions(report=dies))
    assert read_manifest(out)["finished"] is False
    assert detected(folder, out)[0] == []
    assert files_of(out) == files_of(tmp_path / "whole")


def test_the_files_of_a_frame_are_found_behind_its_loader(capture):
    folder = capture(frames=2, mask=True)
    first = open_capture(folder).frames[0]
    names = [path.removeprefix(str(folder)) for path in frame_paths(replace(first, loader=partial(FrameRef.load, first)))]
    assert names == ["/color/000000.jpg", "/depth/000000.png", "/mask/000000.png"]
