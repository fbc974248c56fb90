"""Which frames of a run get a picture, and of which format; pictures that are drawn later."""

import json
from dataclasses import replace

import cv2
import pytest
from builders.errors import refuses
from builders.runs import files_of, read_manifest

import doo3d
from doo3d.config import Config
from doo3d.inputs import open_capture
from doo3d.outputs.run_reader import open_results
from doo3d.runs import run as batch
from doo3d.runs.pictures import Pictures
from doo3d.types import Detection
from doo3d.viz.video import write_video

pytestmark = pytest.mark.usefixtures("fake_detection")


@pytest.fixture
def mixed(capture, fake_detection):
    """A capture of six frames: fine, with a note, unsure, without chains, with a doubtful chain, fine."""
    (chain,) = fake_detection["do"](None, None, None).chains
    by_name = {
        "000001": Detection((chain,), notes=("the depth is noisy",)),
        "000002": Detection((replace(chain, confidence=0.3),)),
        "000003": Detection(()),
        "000004": Detection((replace(chain, confidence=0.9),), doubtful=(replace(chain, confidence=0.1),)),
    }
    fine = Detection((replace(chain, confidence=0.9),))
    fake_detection["do"] = lambda data, config, mask: by_name.get(data.name, fine)
    return capture(frames=6)


def made(source, out, *choice, **options):
    """Run, and return the names of the frames done, the notes, and the names of the pictures in the folder."""
    done, notes = [], []
    told = {"report": lambda record: done.append(record.name), "note": notes.append}
    batch.run(open_capture(source), out, Config(), batch.RunOptions(pictures=Pictures.of(*choice), **told, **options))
    return done, notes, sorted(file.name for file in out.iterdir() if file.suffix in (".jpg", ".png"))


@pytest.mark.parametrize(
    ("choice", "drawn"),
    [
        ("all", "012345"),
        ("none", ""),
        ("failed", "1234"),
        ("every:2", "024"),
        ("every:4", "04"),
        ("every:1", "012345"),
        ("every:100", "0"),
    ],
)
def test_the_frames_that_get_a_picture(mixed, tmp_path, choice, drawn):
    out = tmp_path / "out"
    _, _, pictures = made(mixed, out, choice)
    assert pictures == [f"00000{number}.jpg" for number in drawn]
    entries = {frame["name"]: frame["picture"] for frame in read_manifest(out)["frames"]}
    assert entries == {f"00000{i}": "jpg" if str(i) in drawn else None for i in range(6)}


@pytest.mark.parametrize("choice", ["none", "failed", "every:3"])
def test_everything_else_is_the_same_whatever_is_drawn(mixed, tmp_path, choice):
    made(mixed, tmp_path / "all", "all")
    made(mixed, tmp_path / "some", choice)
    everything, some = files_of(tmp_path / "all"), files_of(tmp_path / "some")
    assert some.keys() == everything.keys() - {f"00000{i}.jpg" for i in range(6) if f"00000{i}.jpg" not in some}
    assert {name: some[name] for name in some if name != "manifest.json"}.items() <= everything.items()
    kept = {key: value for key, value in read_manifest(tmp_path / "some").items() if key != "frames"}
    assert kept.items() <= read_manifest(tmp_path / "all").items()


@pytest.mark.parametrize(
    ("choice", "code"),
    [("some", "choice-unknown"), ("every:0", "choice-unknown"), ("every", "choice-unknown"), ("", "choice-unknown")],
)
def test_another_choice_is_refused(choice, code):
    with refuses(code, "every:N"):
        Pictures.of(choice)


def test_a_picture_is_a_jpeg_or_on_request_a_png(mixed, tmp_path):
    made(mixed, tmp_path / "jpg", "every:6")
    made(mixed, tmp_path / "png", "every:6", "png")
    jpeg, png = ((tmp_path / kind / f"000000.{kind}").read_bytes() for kind in ("jpg", "png"))
    assert (jpeg[:3], png[:4]) == (b"\xff\xd8\xff", b"\x89PNG")
    one, other = (cv2.imread(str(tmp_path / kind / f"000000.{kind}")).astype(int) for kind in ("jpg", "png"))
    assert one.shape == other.shape
    assert abs(one - other).mean() < 3
    with refuses("choice-unknown", "jpg, png"):
        Pictures.of("all", "gif")


@pytest.mark.parametrize("first", ["none", "every:2", "failed"])
def test_missing_pictures_are_drawn_later_without_detecting_again(mixed, tmp_path, fake_detection, first):
    made(mixed, tmp_path / "whole", "all")
    out = tmp_path / "out"
    made(mixed, out, first)
    fake_detection["do"] = None
    done, (note,), pictures = made(mixed, out, "all")
    assert done == []
    assert "pictures of finished frames are drawn from the results" in note
    assert len(pictures) == 6
    assert files_of(out) == files_of(tmp_path / "whole")
    names = [json.loads(line)["name"] for line in (out / "progress.jsonl").read_text().splitlines()]
    assert names == [f"00000{i}" for i in range(6)]
    assert made(mixed, out, "all")[:2] == ([], [])


def test_pictures_that_are_there_stay(mixed, tmp_path):
    out = tmp_path / "out"
    made(mixed, out, "all")
    before = files_of(out)
    for choice in (("none",), ("every:3",), ("all", "png")):
        assert made(mixed, out, *choice)[:2] == ([], [])
        assert files_of(out) == before


def test_a_run_resumes_with_another_choice(mixed, tmp_path, fake_detection):
    out = tmp_path / "out"
    made(mixed, tmp_path / "whole", "all")
    with fake_detection.failing(KeyboardInterrupt, "000003"), pytest.raises(KeyboardInterrupt):
        made(mixed, out, "none")
    done, _, pictures = made(mixed, out, "all")
    assert done == ["000003", "000004", "000005"]
    assert len(pictures) == 6
    assert files_of(out) == files_of(tmp_path / "whole")


def test_a_picture_that_cannot_be_drawn_later_is_noted(mixed, tmp_path, monkeypatch):
    from doo3d.runs import frame_files

    def draws(detection, data):
        raise ValueError("no ink")

    out = tmp_path / "out"
    made(mixed, out, "none")
    monkeypatch.setitem(frame_files.ENCODERS, "jpg", draws)
    _, notes, pictures = made(mixed, out, "every:4")
    assert pictures == []
    assert any("000004: its picture cannot be drawn" in note and "no ink" in note for note in notes)


def test_a_frame_done_again_has_one_picture(mixed, tmp_path):
    out = tmp_path / "out"
    made(mixed, out, "all", "png")
    assert len(made(mixed, out, "all", restart=True)[2]) == 6


def test_a_video_leaves_out_frames_without_a_picture(mixed, tmp_path, doo3d):
    made(mixed, tmp_path / "some", "every:2")
    code, said, _ = doo3d("video", tmp_path / "some", "-o", "some.mp4")
    assert code == 0
    assert "3 frames (3 without a picture left out)" in said
    made(mixed, tmp_path / "none", "none")
    with refuses("picture-missing", "none were drawn"):
        write_video(open_results(tmp_path / "none"), tmp_path / "none.mp4")
    code, _, err = doo3d("video", tmp_path / "none", "-o", "none.mp4")
    assert (code, err.count("\n")) == (2, 1)
    assert "--pictures all" in err


def test_the_shell_and_python_have_the_options(mixed, tmp_path):
    doo3d.run(mixed, tmp_path / "python", pictures="every:5", picture_format="png")
    assert sorted(file.name for file in (tmp_path / "python").glob("*.png")) == ["000000.png", "000005.png"]
    with refuses("choice-unknown", "pictures some"):
        doo3d.run(mixed, tmp_path / "other", pictures="some")


def test_the_command_has_the_options(mixed, doo3d):
    assert doo3d("detect", mixed, "-o", "out", "--pictures", "every:5", "--picture-format", "png")[0] == 0
    assert doo3d("detect", mixed, "-o", "out", "--pictures", "often")[0] == 2
