"""Tuning: the proposed ranges segment the object with high recall and precision, and detection with them finds the chain."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders.captures import save
from builders.errors import code_in, refuses
from builders.paths import DATA

from doo3d import Chain, Cloud, Frame, Image, detect
from doo3d.config import load_config
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.evaluation.scenes.studio import CABLE_COLORS
from doo3d.tools.tuning import tune
from doo3d.tools.tuning.hsv_range import fit_range
from doo3d.tools.tuning.propose import segment_length
from doo3d.tools.tuning.strands import drawn, lost_strands
from doo3d.tools.tuning.thin_object import ThinObject, thin_components

ROPE = DATA / "rope_d435"
LIGHTS = {"above": (0.0, 0.0, -1.0), "left": (-0.6, 0.1, -0.79), "low": (0.2, 0.85, -0.49)}
COLORS = [*CABLE_COLORS, (18, 18, 20)]


def rendered(color, light, family="crossing", seed=3, table=(150, 152, 154)):
    scene = make_scene(family, seed, (640, 360))
    cables = tuple(replace(cable, color=color) for cable in scene.cables)
    assert scene.table is not None
    return render(replace(scene, cables=cables, light=light, table=replace(scene.table, color=table)))


def several(seed):
    """A scene of several cables, each of another color."""
    scene = make_scene("several", seed, (640, 360))
    colored = [replace(cable, color=COLORS[i]) for i, cable in enumerate(scene.cables)]
    return render(replace(scene, cables=tuple(colored)))


def iou(a, b):
    return np.sum(a & b) / np.sum(a | b)


@pytest.fixture(scope="module")
def lit():
    """A scene of each color, the lights in turn."""
    lights = list(LIGHTS.values())
    return [rendered(color, lights[i % len(lights)]) for i, color in enumerate(COLORS)]


@pytest.mark.slow
def test_the_mask_is_the_object_and_the_chain_is_right(lit):
    good, right = [], []
    for scene in lit:
        tuned = tune(scene.frame, load_config("default"))
        good.append(iou(tuned.mask, scene.mask))
        found = detect(scene.frame, tuned.config)
        right.append(score(found.chains, scene.truths, found.crossings).correct)
        assert tuned.width_m == pytest.approx(2 * scene.truths[0].radius, rel=0.3)
    assert np.mean(np.array(good) > 0.8) >= 0.85, good
    assert np.mean(right) >= 0.85, (good, right)


@pytest.mark.slow
def test_a_pick_does_as_well(lit):
    good = []
    for scene in lit:
        v, u = np.nonzero(cv2.erode(scene.mask.astype(np.uint8), np.ones((3, 3), np.uint8)))
        pick = (int(u[len(u) // 3]), int(v[len(v) // 3]))
        good.append(iou(tune(scene.frame, load_config("default"), [pick]).mask, scene.mask))
    assert np.mean(np.array(good) > 0.8) >= 0.85, good


@pytest.mark.slow
def test_red_wraps_round(lit):
    box = tune(lit[0].frame, load_config("default")).config.segment.ranges[0]
    assert box.low[0] > 160
    assert box.high[0] < 20


@pytest.mark.slow
def test_several_colors_need_a_pick_each():
    scene = several(1)
    picks = []
    for label in range(1, len(scene.truths) + 1):
        v, u = np.nonzero(scene.labels == label)
        picks.append((int(u[len(u) // 2]), int(v[len(v) // 2])))
    alone = tune(scene.frame, load_config("default"), picks[:1])
    tuned = tune(scene.frame, load_config("default"), picks)
    assert iou(tuned.mask, scene.mask) > 0.8 > iou(alone.mask, scene.mask)
    assert len(tuned.config.segment.ranges) > 1


@pytest.mark.slow
def test_all_strands_that_detection_finds_get_ranges():
    scene = several(2)
    whole = tune(scene.frame, load_config("default"))
    assert len(whole.strands) == len(scene.truths)
    assert all(strand.endswith(": found with color ranges") for strand in whole.strands)
    assert iou(whole.mask, scene.mask) > 0.8
    assert len(detect(scene.frame, whole.config).chains) == len(scene.truths)


@pytest.mark.parametrize(("ends", "count"), [((30, 290), 0), ((30, 200), 1), ((-20, 310), 0)])
def test_a_strand_is_lost_if_no_chain_follows_it_from_end_to_end(ends, count):
    image = Image(np.zeros((200, 320, 3), np.uint8))

    def strand(start, end):
        return drawn(Chain(np.column_stack((np.linspace(start, end, 30), np.full(30, 90.0))), (end - start) / 29, 4.0), image)

    assert len(lost_strands([strand(30, 290)], [strand(*ends)])) == count
    assert lost_strands([], [strand(*ends)]) == []
    assert len(lost_strands([strand(30, 290)], [])) == 1


def test_a_photograph_and_a_box(lit):
    scene = lit[2]
    image = Image(scene.frame.color)
    v, u = np.nonzero(scene.mask)
    box = (int(u.min()), int(v.min()), int(np.ptp(u)) + 1, int(np.ptp(v)) + 1)
    tuned = tune(image, load_config("image"), box=box)
    assert iou(tuned.mask, scene.mask) > 0.8
    assert tuned.width_m is None
    assert tuned.config.voxelize.size is None
    assert len(detect(image, tuned.config).chains) == 1


def test_the_background_and_what_looks_like_it(lit):
    frame = lit[0].frame
    with refuses("pick-not-thin", "8,8", "segment.method=plane"):
        tune(frame, load_config("default"), [(8, 8)])
    grey = rendered((150, 152, 154), LIGHTS["above"])
    kept = tune(grey.frame, load_config("default"))
    assert kept.config.segment == load_config("default").segment, (
        "ranges of its color would lose the cable that is found by depth"
    )
    assert kept.reasons["segment.method"] == "kept, since color ranges lose 1 strand of 1"
    assert "lost with color ranges" in kept.strands[0]
    assert len(detect(grey.frame, kept.config).chains) == 1
    empty = replace(grey.frame, color=np.full_like(grey.frame.color, 120), depth=np.full_like(grey.frame.depth, 0.7))
    with refuses("object-missing", "segment.method=plane"):
        tune(empty, load_config("default"))
    v, u = np.nonzero(grey.mask)
    with refuses("pick-not-thin"):
        tune(grey.frame, load_config("default"), [(int(u[0]), int(v[0]))])


def test_bad_places(lit):
    frame = lit[0].frame
    with refuses("place-outside", "--pick 700,5", "640x360"):
        tune(frame, load_config("default"), [(700, 5)])
    with refuses("place-outside", "--box 600,0,100,50"):
        tune(frame, load_config("default"), box=(600, 0, 100, 50))
    with refuses("mode-needs-image"):
        tune(Cloud(np.zeros((3, 3))), load_config("default"))
    with refuses("method-needs-color"):
        tune(Frame(None, frame.depth, frame.camera), load_config("default"), [(3, 3)])


def test_the_box_contains_the_colors_of_the_object_only():
    """A strip of known colors on a ground of known ones: every pixel of the one, none of the other."""
    color = np.full((60, 200, 3), (120, 130, 140), np.uint8)
    mask = np.zeros((60, 200), dtype=bool)
    mask[28:33, 10:190] = True
    color[mask] = (200, 30, 30)
    color[28, 10:190] = (70, 12, 12)
    color[32, 10:190] = (240, 110, 110)
    box = fit_range(color, ThinObject(mask, 1.0, 180.0, 2.5))
    from doo3d.segment.methods.hsv import in_ranges

    np.testing.assert_array_equal(in_ranges(color, (box,)), mask)


def test_thin_components_are_long_and_not_broad():
    mask = np.zeros((300, 400), dtype=bool)
    mask[100:106, 20:380] = True
    mask[150:290, 50:200] = True
    mask[20:24, 20:24] = True
    found = thin_components(mask)
    assert found.mask[103, 200]
    assert not found.mask[200, 100]
    assert not found.mask[22, 22]
    assert found.half_width == pytest.approx(3, abs=0.6)
    assert found.length == pytest.approx(360, rel=0.25)  # the middle of an even width lies between pixels


@pytest.mark.parametrize(("radius", "apart", "length"), [(0.004, 0.0006, 0.01), (0.0005, 0.0006, 0.004), (3.0, 1.0, 8.0)])
def test_segments_are_round_numbers(radius, apart, length):
    assert segment_length(radius, apart) == length


def test_from_the_shell(doo3d, capture, tmp_path):
    folder = capture()
    code, out, err = doo3d("tune", folder, "-o", "mine.yaml")
    assert code == 0, err
    words = {line.split()[0] for line in out.splitlines()}
    assert {"object", "recall", "precision", "color", "segments", "voxels", "next"} <= words
    assert "(through red)" in out
    assert cv2.imread("mine.png").shape == (240, 320, 3)
    text = (tmp_path / "mine.yaml").read_text()
    assert "# HERE: the object has a color of its own" in text
    assert load_config("mine.yaml").segment.method == "hsv"
    code, out, err = doo3d("detect", folder, "-c", "mine.yaml")
    assert code == 0, err
    assert out.startswith("000000   1 chain")
    assert doo3d("tune", folder, "-o", "mine.yaml", "--frame", "-1")[0] == 0  # nobody has changed what it wrote
    made = (tmp_path / "mine.yaml").read_text()
    shutil.copytree(folder, "other")
    for path, change in (("mine.yaml", made.replace("hsv", "plane")), ("mine.png", "a picture of mine"), (None, None)):
        if path:
            (tmp_path / path).write_text(change)
        code, _, err = doo3d("tune", folder if path else "other", "-o", "mine.yaml")
        assert (code, code_in(err)) == (2, "out-exists")
        assert path is None or (tmp_path / path).read_text() == change
        assert doo3d("tune", folder, "-o", "mine.yaml", "--force")[0] == 0


@pytest.mark.parametrize(
    ("options", "code", "part"),
    [
        (("--pick", "12"), "value-invalid", "--pick 12: "),
        (("--box", "1,2,x,4"), "value-invalid", "--box 1,2,x,4: "),
        (("--pick", "160,120", "--box", "1,2,3,4"), "options-conflict", "--pick"),
        (("-o", "mine.txt"), "out-suffix", "mine.txt"),
        (("--frame", "7"), "frame-unknown", "--frame 7: "),
        (("--pick", "5,5"), "pick-not-thin", "5,5"),
    ],
)
def test_invalid_options_are_refused(doo3d, capture, tmp_path, options, code, part):
    status, out, err = doo3d("tune", capture(), *options)
    assert (status, out) == (2, "")
    assert code_in(err) == code
    assert part in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["capture"]


def test_the_picture_shows_hits_misses_and_false_hits():
    from doo3d.viz.tuning_preview import MISSED, OTHER, SEGMENTED, draw_tuning

    image = np.full((40, 40, 3), 100, np.uint8)
    object_mask, mask = np.zeros((2, 40, 40), dtype=bool)
    object_mask[10:20], mask[15:25] = True, True
    picture = draw_tuning(image, mask, object_mask).astype(int)
    for row, color in ((12, MISSED), (17, SEGMENTED), (22, OTHER)):
        assert np.abs(picture[row, 5] - np.array(color)).sum() < np.abs(picture[row, 5] - 100).sum()
    assert len(np.unique(picture[30])) == 1


@pytest.mark.skipif(not ROPE.is_dir(), reason="the real frames are not here")
def test_real_depth_without_color(doo3d, tmp_path):
    values = json.loads((ROPE / "camera.json").read_text())
    matrix = [values["fx"], 0, 0, 0, values["fy"], 0, values["cx"], values["cy"], 1]
    (tmp_path / "rope").mkdir()
    intrinsics = {"width": values["width"], "height": values["height"], "intrinsic_matrix": matrix, "depth_scale": 1000.0}
    (tmp_path / "rope" / "camera_intrinsic.json").write_text(json.dumps(intrinsics))
    for name in ("000", "008"):
        save(tmp_path / "rope" / "depth" / f"{name}.png", cv2.imread(str(ROPE / f"{name}_depth.png"), cv2.IMREAD_UNCHANGED))
    code, out, err = doo3d("tune", "rope")
    assert code == 0, err
    assert "everything: there is no color" in out
    code, out, err = doo3d("detect", "rope", "-c", "tuned.yaml")
    assert code == 0, err
    assert [line.split()[1] for line in out.splitlines()[:2]] == ["1", "1"]
