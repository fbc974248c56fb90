"""What Python users meet first: arguments of any type, short texts in a prompt, tables, drawings."""

from __future__ import annotations

import dataclasses
import pickle
import subprocess
import sys
from importlib import resources

import numpy as np
import pytest
from builders.chains import capture, flat, helix
from builders.drawn_masks import CAMERA, frame_of, wave
from builders.errors import refuses

import doo3d
from doo3d.config import Config, as_config
from doo3d.inputs import FrameData, ReadOptions

FRAME, MASK = frame_of(wave())


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ([1, 2, 3], "doo3d.Frame"),
        (None, "doo3d.Frame"),
        ("capture", "open_capture('capture')"),
        (np.zeros((7, 3)), "7 points: give doo3d.Cloud"),
        (np.zeros((48, 64)), "doo3d.Frame(color, depth, camera)"),
        (FrameData(FRAME), "loaded.data"),
    ],
    ids=["list", "None", "path", "points", "depth", "loaded frame"],
)
def test_data_of_another_type_is_a_type_error_that_says_what_to_give(data, told):
    with pytest.raises(TypeError, match=r"\w") as caught:
        doo3d.detect(data)
    assert told in str(caught.value)
    assert caught.value.code == "data-type"
    assert isinstance(caught.value, doo3d.InputError)
    assert pickle.loads(pickle.dumps(caught.value)).code == "data-type"


def test_a_frame_of_a_capture_is_read_with_its_mask_and_pose(tmp_path):
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    np.savez(
        tmp_path / "a.npz",
        depth=FRAME.depth,
        mask=MASK,
        intrinsics=[[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1]],
    )
    capture = doo3d.open_capture(tmp_path / "a.npz", options=ReadOptions(pose=pose))
    detection, expected = doo3d.detect(capture[0]), doo3d.detect(FRAME, mask=MASK, pose=pose)
    np.testing.assert_array_equal(detection.chains[0].joints, expected.chains[0].joints)
    other = np.zeros_like(MASK)
    other[:, : MASK.shape[1] // 2] = MASK[:, : MASK.shape[1] // 2]
    assert doo3d.detect(capture[0], mask=other).chains[0].length < detection.chains[0].length
    with refuses("data-type", "capture[0]"):
        doo3d.detect(capture)


@pytest.mark.parametrize("size", [(481, 641), (479, 639), (480, 641)])
def test_a_mask_a_pixel_off_is_fitted_with_a_note(size):
    mask = np.zeros(size, np.uint8)
    shown = MASK[: size[0], : size[1]]
    mask[: shown.shape[0], : shown.shape[1]] = shown
    detection = doo3d.detect(FRAME, mask=mask)
    (note,) = [note for note in detection.notes if "cropped or padded" in note]
    assert f"{size[1]}x{size[0]} px and the image 640x480" in note
    np.testing.assert_array_equal(detection.chains[0].joints, doo3d.detect(FRAME, mask=MASK).chains[0].joints)


@pytest.mark.parametrize("config", [3, ["default"], {"merge.chains"}, object()])
def test_settings_of_another_type_are_a_type_error_that_names_the_presets(config):
    with pytest.raises(TypeError, match="paper_2d"):
        doo3d.detect(FRAME, config)
    with pytest.raises(TypeError, match=r"merge\.chains"):
        doo3d.explain(FRAME, config)


def test_settings_are_what_they_stand_for(tmp_path):
    (tmp_path / "mine.yaml").write_text("merge: {chains: 2}\n")
    assert as_config(None) == Config()
    assert as_config("image") == doo3d.load_config("image")
    assert as_config(tmp_path / "mine.yaml") == as_config({"merge.chains": 2}) == as_config({"merge": {"chains": 2}})
    with refuses("key-unknown", "merge.chains", kind=doo3d.ConfigError):
        as_config({"merge.chain": 2})
    with refuses("preset-unknown", "imag", "image", kind=doo3d.ConfigError):
        as_config("imag")


def test_detect_takes_settings_as_a_dictionary():
    assert doo3d.detect(FRAME, {"fit.segment_length": 0.02}, MASK).chains[0].segment_length == 0.02


@pytest.mark.parametrize(
    ("item", "told"),
    [
        (FRAME, "no color, depth 0.4"),
        (doo3d.Frame(None, np.zeros((4, 6), np.float32), doo3d.Camera(9, 9, 3, 2, 6, 4)), "no depth reading"),
        (doo3d.Cloud(np.zeros((0, 3))), "0 points"),
        (doo3d.Cloud(np.random.default_rng(0).random((5000, 3)), name="helix"), "'helix', 5000 points"),
        (doo3d.Image(np.zeros((4, 6, 3), np.uint8)), "6x4"),
        (helix(), "25 segments, 0.250 m, radius 4.0 mm"),
        (capture()[0], "2 chains, 0.250 m + 0.120 m"),
        (capture()[1], "0 chains"),
        (flat(), "40 px"),
        (doo3d.load_config("default", {"merge.chains": 1}), "Config(merge.chains=1)"),
        (doo3d.Detector({"merge.chains": 1}), "merge.chains=1"),
    ],
)
def test_a_prompt_shows_one_short_line(item, told):
    assert told in repr(item)
    assert len(repr(item)) < 130
    assert "\n" not in repr(item)


def test_tables_are_columns_of_one_length_that_pandas_takes():
    first, empty, _ = capture()
    for frame in (first, empty, flat()):
        for rows in ("chains", "joints", "crossings"):
            table = frame.table(rows)
            assert len({len(column) for column in table.values()}) == 1
            assert list(table)[:2] == ["frame", "timestamp"]
    joints = first.table("joints")
    np.testing.assert_array_equal(np.column_stack([joints[axis] for axis in "xyz"])[:26], first.chains[0].joints)
    assert joints["occluded"][25] is None
    assert first.table()["occluded"] == [0.2, pytest.approx(2 / 12)]
    assert "z" not in flat().table("joints")
    assert list(empty.table()) == list(first.table())
    with refuses("choice-unknown", "joints"):
        first.table("rows")


def test_a_notebook_shows_a_table_and_a_drawing():
    text = doo3d.Detection((helix(),), frame="<script>", notes=("a < b",))._repr_html_()
    assert "<script" not in text
    assert "a &lt; b" in text
    assert text.count('stroke-dasharray="3 3"') > 0
    in_time = dataclasses.replace(helix(), from_time=helix().occluded)
    assert in_time._repr_html_().count("8 3 2 3") == helix()._repr_html_().count("3 3") > 0
    assert text.count("<tr>") == 2
    assert "NaN" not in flat()._repr_html_() + helix()._repr_html_() + capture()[1]._repr_html_()


def test_a_figure_has_the_chains_and_the_points():
    detection = doo3d.detect(FRAME, {"merge.chains": 1}, MASK)
    drawn = detection.plot(FRAME)
    assert {"chain 0", "object's points"} <= {trace.name for trace in drawn.data}
    tube = next(trace for trace in drawn.data if trace.type == "mesh3d")
    axis = detection.chains[0].joints
    gap = np.linalg.norm(np.column_stack((tube.x, tube.y, tube.z))[:, None] - axis[None], axis=2).min(axis=1)
    np.testing.assert_allclose(gap, np.repeat(detection.chains[0].radii, 12)[: len(gap)], rtol=1e-6)
    assert max(max(tube.i), max(tube.j), max(tube.k)) == len(tube.x) - 1
    assert drawn.to_json() == detection.plot(FRAME).to_json()


def test_a_figure_of_one_chain_of_a_ring_and_of_2_d():
    assert {trace.name for trace in helix(id=7).plot().data} == {"chain 7"}
    assert "dash" in {trace.line.dash for trace in helix().plot().data if trace.type == "scatter3d" and trace.mode == "lines"}
    in_time = dataclasses.replace(helix(), from_time=helix().occluded)
    assert "longdashdot" in {
        trace.line.dash for trace in in_time.plot().data if trace.type == "scatter3d" and trace.mode == "lines"
    }
    image = np.full((30, 60, 3), 90, np.uint8)
    drawn = flat().plot(image)
    assert drawn.layout.images[0].sizex == 60
    assert drawn.layout.yaxis.range[0] > drawn.layout.yaxis.range[1]
    assert not doo3d.Detection(()).plot(FRAME).layout.images


def test_draw_is_public():
    assert doo3d.draw(FRAME, doo3d.detect(FRAME, mask=MASK)).shape == (*FRAME.depth.shape, 3)


def test_types_are_declared_and_the_import_loads_nothing():
    assert resources.files("doo3d").joinpath("py.typed").is_file()
    code = "import doo3d, sys; assert not {'numpy', 'plotly', 'cv2', 'pydantic'} & set(sys.modules), sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], check=True)
