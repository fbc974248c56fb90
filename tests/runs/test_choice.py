"""Chains chosen by points and a box, in one frame, and followed by their ids through a capture."""

import json

import numpy as np
import pytest
from builders.captures import save
from builders.drawn_masks import CAMERA, depth_of, frame_of, line
from builders.errors import code_in, refuses
from builders.runs import break_frame, files_of, read_manifest

import doo3d as api
from doo3d.runs import methods

# two cables 18 px wide, and one nearer to the camera that crosses them
NAMES = "upper", "lower", "across"
AXES = [line((-0.15, y, 0.5), (0.15, y, 0.5)) for y in (-0.05, 0.05)] + [line((0.05, -0.1, 0.47), (0.05, 0.1, 0.47))]
FRAME, MASK = frame_of(*AXES)
WHICH = depth_of(AXES, [0.005] * 3)[1]
UPPER, LOWER = (200, 150), (200, 330)
POINT = "200,195"  # on the upper one of the cables of `two`, which are 54 px apart
MATRIX = [CAMERA.fx, 0, 0, 0, CAMERA.fy, 0, CAMERA.cx, CAMERA.cy, 1]


def names(chains):
    middles = [chain.joints.mean(axis=0) for chain in chains]
    return [NAMES[2 if abs(middle[1]) < 0.03 else int(middle[1] > 0)] for middle in middles]


def chosen(**given):
    return api.detect(FRAME, mask=MASK, **given)


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({"points": [(*UPPER, True)]}, "upper"),
        ({"points": np.array([(*UPPER, 1), (*LOWER, 1)])}, "upper lower"),  # a click for each cable
        ({"points": [(*UPPER, False)]}, "lower across"),
        ({"points": " -200,150; -200,330"}, "across"),
        ({"points": [(5, 5, False)]}, "upper lower across"),
        ({"points": "200,150;-200,330"}, "upper"),
        ({"points": [(200, 138.5, True)]}, "upper"),  # beside it, by less than 3.2 px
        ({"box": (0, 100, 640, 200)}, "upper"),  # of the one across a third is inside
        ({"box": "640,400,400,-50"}, "across"),  # corners in any order
        ({"points": [(*UPPER, False)], "box": (0, 0, 640, 200)}, ""),
        ({"points": [], "box": None}, "upper lower across"),
    ],
)
def test_the_chains_that_are_kept(given, kept):
    found = chosen(**given)
    assert sorted(names(found.chains)) == sorted(kept.split())
    assert bool(kept) != any(note.startswith("box: no chain") for note in found.notes)


def test_what_belongs_to_a_chain_is_kept_with_it():
    found = chosen(points=[(*UPPER, True), (415.7, 240, True)], pose=[0, 0, 0, 0, 0, 0, 1])
    (crossing,) = found.crossings
    kept, labels = names(found.chains), found.instance_labels()
    assert [kept[crossing.upper.chain], kept[crossing.lower.chain], found.coordinates] == ["across", "upper", "world"]
    assert all(np.mean((labels == k + 1)[WHICH == NAMES.index(name)]) > 0.95 for k, name in enumerate(kept))
    assert np.mean(labels[WHICH == 1] > 0) < 0.01


def test_a_chain_that_is_pointed_at_is_shown_however_low_its_confidence_is():
    frame, config = frame_of(*AXES, table=0.56)[0], {"segment.method": "plane", "output.min_confidence": 1.0}
    plain, one = api.detect(frame, config), api.detect(frame, config, points=[(*UPPER, True)])
    assert (names(plain.chains), names(plain.doubtful), names(one.chains), one.doubtful) == ([], ["across"], ["upper"], ())
    without = api.detect(frame, config, points=[(415.7, 240, False)])
    assert (without.chains, without.doubtful) == ((), ())


def test_a_branched_object_is_kept_whole():
    fork = [line((0, 0, 0.5), (0.1 * np.cos(a), 0.1 * np.sin(a), 0.5)) for a in np.radians((0, 120, 240))]
    frame, mask = frame_of(*fork, line((-0.15, -0.12, 0.45), (0.15, -0.12, 0.45)))
    kept = api.detect(frame, "harness", mask, points=[(420, 240, True)])
    assert (len(kept.junctions), [item.chains for item in kept.objects]) == (1, [(0, 1, 2)])
    other = api.detect(frame, "harness", mask, points=[(420, 240, False)])
    assert (len(other.junctions), len(other.chains)) == (0, 1)


@pytest.mark.parametrize(
    ("given", "code", "parts"),
    [
        ({"points": [(200, 200, True)]}, "place-missed", ("points=200,200", "the nearest is 41 px away")),
        ({"points": "200,150", "box": (400, 0, 639, 479)}, "place-missed", ("200,150", "excluded by box")),
        ({"points": [(640, 5, True)]}, "place-outside", ("640,5", "640 x 480")),
        ({"points": "nan,1"}, "place-outside", ("nan,1",)),
        ({"box": (-9, -9, -2, 300)}, "place-outside", ("box -9,-9,-2,300",)),
        ({"points": "1,2;x,3"}, "place-invalid", ("'x,3'",)),
        ({"points": "-1,2,3"}, "place-invalid", ("'-1,2,3'",)),
        ({"points": [(1, 2, -1)]}, "place-invalid", ("-1",)),
        ({"box": "1,2,3"}, "place-invalid", ("'1,2,3'",)),
        ({"data": api.Cloud(CAMERA.unproject(np.argwhere(MASK)[:, ::-1], FRAME.depth[MASK])), "points": "1,2"},
         "place-needs-image", ("cloud",)),
    ],
)  # fmt: skip
def test_what_cannot_be(given, code, parts):
    with refuses(code, *parts):
        api.detect(**({"data": FRAME, "mask": MASK} if "data" not in given else {}) | given)


@pytest.fixture
def two(tmp_path):
    """Five frames of two cables that sink, side by side, 3 cm apart; the third shows the lower one only."""
    for k in range(5):
        axes = [line((-0.15, y + 0.004 * k, 0.5), (0.15, y + 0.004 * k, 0.5)) for y in (-0.025, 0.005)]
        frame, mask = frame_of(*axes[k == 2 :])
        save(tmp_path / "two/depth" / f"{k:06d}.png", np.rint(1000 * frame.depth).astype(np.uint16))
        save(tmp_path / "two/mask" / f"{k:06d}.png", mask.astype(np.uint8) * 255)
    camera = {"width": 640, "height": 480, "intrinsic_matrix": MATRIX}
    (tmp_path / "two/camera_intrinsic.json").write_text(json.dumps(camera))
    return tmp_path / "two"


def found_in(out):
    """For each frame of a run the ids and the heights of its chains, cm."""
    frames = [json.loads(file.read_text())["chains"] for file in sorted(out.glob("0*.json"))]
    return [[(each["id"], round(100 * np.mean(each["joints"], axis=0)[1], 1)) for each in chains] for chains in frames]


def test_the_chosen_object_is_followed_and_its_neighbor_never_taken_for_it(two, doo3d, tmp_path):
    command = "detect", two, "-o", "out", "--points", POINT, "--instances"
    assert doo3d(*command)[0] == 0
    (a,), (b,), none, (c,), (d,) = found_in(tmp_path / "out")
    assert (none, {each[0] for each in (a, b, c, d)}) == ([], {a[0]})
    assert [each[1] for each in (a, b, c, d)] == pytest.approx([-2.5, -2.1, -1.3, -0.9], abs=0.15)
    assert read_manifest(tmp_path / "out")["input"]["choice"] == {"wanted": [[200.0, 195.0]], "unwanted": [], "box": []}
    assert "finished already" in doo3d(*command)[2]
    assert "other settings" in doo3d("detect", two, "-o", "out", "--points", f"-{POINT}", "--pictures", "none")[2]
    assert [len(each) for each in found_in(tmp_path / "out")] == [1] * 5
    api.run(two, tmp_path / "python", points=[(200, 195, False)], pictures="none", workers=2)
    assert files_of(tmp_path / "python") == files_of(tmp_path / "out")


@pytest.mark.parametrize("at", ["000001", "000002", "000003"])
def test_an_interrupted_run_ends_with_the_same_bytes(two, tmp_path, monkeypatch, at):
    given, inner = {"points": POINT, "box": (0, 150, 639, 300), "pictures": "none"}, methods.detect

    def interrupted(data, *rest, **named):
        if data.name == at:
            raise KeyboardInterrupt
        return inner(data, *rest, **named)

    api.run(two, tmp_path / "whole", **given)
    monkeypatch.setattr(methods, "detect", interrupted)
    with pytest.raises(KeyboardInterrupt):
        api.run(two, tmp_path / "out", **given)
    monkeypatch.undo()
    api.run(two, tmp_path / "out", **given)
    assert files_of(tmp_path / "out") == files_of(tmp_path / "whole")


def test_a_frame_that_is_tried_again(two, tmp_path):
    api.run(two, tmp_path / "whole", points=POINT, pictures="none")
    content = (two / "depth/000001.png").read_bytes()
    break_frame(two, "000001")
    assert api.run(two, tmp_path / "out", points=POINT, pictures="none").failed == 1
    (two / "depth/000001.png").write_bytes(content)
    assert api.run(two, tmp_path / "out", points=POINT, pictures="none").failed == 0
    assert found_in(tmp_path / "out") == found_in(tmp_path / "whole")


def test_a_sequence(two, tmp_path):
    for name, points in (("all", None), ("out", POINT)):
        api.run(two, tmp_path / name, sequence=True, pictures="none", points=points)
    kept = found_in(tmp_path / "out")
    assert len(kept[0]) == 1
    assert kept == [[each for each in frame if each[0] == kept[0][0][0]] for frame in found_in(tmp_path / "all")]


def test_captures_of_which_nothing_can_be_chosen(two, refused, doo3d, tmp_path):
    assert "no chain is left" in refused(two, "-o", "out", "--points", f"-{POINT};-200,249", code="place-missed")
    assert "5,5" in refused(two, "-o", "out", "--points", "5,5", code="place-missed")
    assert "0,0,20,20" in refused(two, "-o", "out", "--box", "0,0,20,20", code="place-missed")
    refused(two, "-o", "out", "--fuse-views", "--box", "0,0,9,9", code="options-conflict")
    for k in range(2):
        save(tmp_path / "photos" / f"{k}.png", np.full((*MASK.shape, 3), 90, np.uint8))
    refused(tmp_path / "photos", "-o", "out", "-c", "image", "--points", "5,5", code="options-conflict")
    save(tmp_path / "mask.png", MASK.astype(np.uint8) * 255)
    assert doo3d("detect", "photos/0.png", "-o", "one", "--mask", "mask.png", "-c", "image", "--points=-200,150")[0] == 0
    assert len(json.loads((tmp_path / "one/0.json").read_text())["chains"]) == 2
    break_frame(two, "000000")
    code, _, err = doo3d("detect", two, "-o", "out", "--points", POINT)
    assert (code, code_in(err.splitlines()[-1])) == (2, "place-missed")
