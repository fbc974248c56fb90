"""Junctions and objects in pictures, figures, notebooks, tables, the report and the lines of a run."""

import json

import numpy as np
import pytest
from builders.drawn_masks import line
from builders.scenes import empty_scene

from doo3d.commands.messages import frame_line
from doo3d.geometry.equal_segments import equal_segments
from doo3d.links.branches import find_branches
from doo3d.outputs.detection_json import dumps
from doo3d.outputs.run_reader import open_results
from doo3d.runs.frame_record import FrameRecord
from doo3d.tools.explain import explain
from doo3d.types import Camera, Chain, ChainEnd, Cloud, Detection, Frame, Image, Junction, LinearObject
from doo3d.types.display import objects_text
from doo3d.viz import draw
from doo3d.viz.report.page import report_page

CAMERA = Camera(800.0, 800.0, 400.0, 300.0, 800, 600)


def found_in(*strands, step, radius):
    chains = [Chain(equal_segments(line(*strand), step), step, radius) for strand in strands]
    found = find_branches(chains, empty_scene(segment_length=step, radius=radius, merge__branches=True))
    assert found.junctions
    return Detection(tuple(found.chains), junctions=found.junctions, objects=found.objects, frame="f")


@pytest.fixture
def y():
    """A Y and a cable of its own, in space."""
    strands = (
        ([-0.15, 0.0, 0.5], [0.15, 0.0, 0.5]),
        ([0.0, 0.012, 0.5], [0.03, 0.1, 0.5]),
        ([-0.1, -0.08, 0.5], [0.1, -0.08, 0.5]),
    )
    return found_in(*strands, step=0.01, radius=0.005)


def test_lines_and_words(y):
    assert repr(y).startswith("Detection('f', 2 objects, 4 chains, 1 junction, ")
    assert objects_text(y.objects) == "2 objects: one with 3 chains and 1 junction, one without junctions"
    assert objects_text(y.objects[:1]) == "1 object with 3 chains and 1 junction"
    assert objects_text(()) == "0 objects"
    assert objects_text(y.objects[:1] * 5) == (
        "5 objects: " + ", ".join(["one with 3 chains and 1 junction"] * 3) + ", 2 more with junctions"
    )
    assert frame_line("f", [0.3], [0.005], [0.9], 0.0, "m", 0.1, trees=(1, 2)).startswith(
        "f   1 object, 1 chain, 2 junctions   0.300 m"
    )
    assert frame_line("f", [0.3], [0.005], [0.9], 0.0, "m", 0.1).startswith("f   1 chain   0.300 m")


def test_the_manifest_counts_junctions_only_where_they_were_looked_for():
    record = FrameRecord("f", "s", None, "ok", objects=1, junctions=2)
    assert (record.to_dict()["objects"], record.to_dict()["junctions"]) == (1, 2)
    assert FrameRecord.from_journal(json.loads(json.dumps(record.to_journal()))) == record
    assert "objects" not in FrameRecord("f", "s", None, "ok").to_dict()


def test_tables(y):
    table = y.table("junctions")
    assert table["junction"] == [0, 0, 0]
    assert table["object"] == [0, 0, 0]
    assert list(zip(table["chain"], table["end"], strict=True)) == [tuple(end) for end in y.junctions[0].ends]
    assert table["x"][0] == y.junctions[0].position[0]
    assert y.table()["object"] == [0, 0, 0, 1]
    assert "object" not in Detection(y.chains).table()
    assert Detection(y.chains).table("junctions")["chain"] == []


def test_a_picture_marks_junctions_and_counts_them(y):
    frame = Frame(color=np.zeros((600, 800, 3), np.uint8), depth=np.full((600, 800), 0.5), camera=CAMERA)
    picture, without = draw(frame, y), draw(frame, Detection(y.chains))
    u, v = np.rint(CAMERA.project(y.junctions[0].position[None])[0]).astype(int)
    assert (picture[v - 2 : v + 3, u - 2 : u + 3] > 200).all()
    assert (picture != without).any()


def test_figures_and_notebooks(y):
    (trace,) = [trace for trace in y.plot().data if trace.name == "junctions"]
    assert trace.type == "scatter3d"
    np.testing.assert_allclose([trace.x[0], trace.y[0], trace.z[0]], y.junctions[0].position)
    assert all(trace.name != "junctions" for trace in Detection(y.chains).plot().data)
    text = y._repr_html_()
    assert text.count("<rect") == 1
    assert "one with 3 chains and 1 junction" in text


def test_in_an_image():
    ends = ([20.0, 60.0], [220.0, 60.0], [120.0, 120.0])
    chains = tuple(Chain(equal_segments(line([120.0, 60.0], end), 8.0), 8.0, 4.0) for end in ends)
    junction = Junction(np.array([120.0, 60.0]), tuple(ChainEnd(k, 0) for k in range(3)), np.full(3, 4.0))
    objects = (LinearObject((0, 1, 2), (0,), 2),)
    flat = Detection(chains, mode="2d", coordinates="image", frame="f", junctions=(junction,), objects=objects)
    image = Image(np.zeros((140, 240, 3), np.uint8))
    (trace,) = [trace for trace in flat.plot(image).data if trace.name == "junctions"]
    assert trace.type == "scatter"
    assert "<rect" in flat._repr_html_()
    assert draw(image, flat).shape == (140, 240, 3)
    assert "z" not in flat.table("junctions")


def test_the_report_names_objects_and_junctions(y, tmp_path):
    (tmp_path / "f.json").write_text(dumps(y.to_dict()))
    listed = [{"name": "f", "status": "ok"}]
    (tmp_path / "manifest.json").write_text(dumps({"schema": "doo3d/manifest/1", "frames": listed}))
    page = report_page(open_results(tmp_path), clouds=False)
    data = json.loads(page.split('<script type="application/json" id="data">')[1].split("</script>")[0])
    (frame,) = data["frames"]
    assert frame["objects"] == [[0, 1, 2], [3]]
    assert frame["objects_text"].startswith("2 objects")
    assert frame["junctions"][0]["ends"] == [list(end) for end in y.junctions[0].ends]


def test_an_explanation_says_which_chains_meet():
    rng = np.random.default_rng(0)
    arms = [np.linspace([0.0, 0.0, 0.5], end, 3000) for end in ([-0.15, 0.0, 0.5], [0.15, 0.0, 0.5], [0.04, 0.12, 0.5])]
    normals = rng.normal(0, 1, (9000, 3))
    points = np.concatenate(arms) + 0.004 * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    accounts = {each.stage: each.made for each in explain(Cloud(points, segmented=True), "harness").accounts}
    assert accounts["branches"].startswith("1 object, 3 chains, 1 junction: chains 0, 1, 2 (confidence ")
    assert "branches" not in {each.stage for each in explain(Cloud(points, segmented=True)).accounts}
