"""The report: a self-contained page, safe against any names and errors; opened in Chromium if there is one."""

import base64
import json
import os
import re
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders import browser
from builders.errors import code_in, refuses
from builders.paths import SAMPLES

import doo3d
from doo3d.inputs import open_capture
from doo3d.outputs.run_reader import Results, open_results
from doo3d.runs import run as batch
from doo3d.viz.report import report_page
from doo3d.viz.report.packing import pack_picture

HOSTILE_NAME = "<script>document.title='taken'<script><img src=x onerror=document.title='taken'>&amp;"
HOSTILE_REASON = "</script><script>document.title='taken'</script><!--data--><!-- <script>"

needs_chromium = pytest.mark.skipif(
    not sys.platform.startswith("linux") or browser.chromium() is None,
    reason="no Chromium on this machine: apt-get install chromium, or name one in DOO3D_CHROMIUM",
)


def data_of(page: str) -> dict:
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)[1])


def numbers(packed: dict) -> np.ndarray:
    levels = np.frombuffer(base64.b64decode(packed["levels"]), "<i2").reshape(-1, len(packed["center"]))
    return np.array(packed["center"]) + packed["step"] * levels


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """Two frames with one cable, partly occluded."""
    out = tmp_path_factory.mktemp("run") / "out"
    batch.run(open_capture(SAMPLES / "occluder"), out, doo3d.load_config("default"))
    return out


@pytest.fixture(scope="module")
def photos(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("photos") / "out"
    batch.run(open_capture(SAMPLES / "photos", True), out, doo3d.load_config("image"))
    return out


def copied(run: Path, folder: Path, times: int = 1, **change) -> Path:
    """Copy the results `times` times under other names, add a failed frame with a hostile reason, and change the manifest."""
    folder.mkdir()
    manifest = json.loads((run / "manifest.json").read_text())
    frames = []
    for i in range(times):
        for frame in manifest["frames"]:
            name = f"{HOSTILE_NAME.replace('/', '')}{i}-{frame['name']}" if i == 0 else f"{i:04d}-{frame['name']}"
            values = json.loads((run / f"{frame['name']}.json").read_text()) | {"frame": name}
            values["chains"] = (
                [*values["chains"], values["chains"][0] | {"confidence": 0.128, "id": 7}] if i == 0 else values["chains"]
            )
            values["doubtful"] = [values["chains"][0] | {"confidence": 0.136, "id": None}] if i == 0 else []
            (folder / f"{name}.json").write_text(json.dumps(values))
            os.link(run / f"{frame['name']}.jpg", folder / f"{name}.jpg")
            frames.append(frame | {"name": name})
    frames.append({"name": "bad", "status": "failed", "error": HOSTILE_REASON, "timestamp": None})
    (folder / "manifest.json").write_text(json.dumps(manifest | {"frames": frames} | change))
    return folder


@pytest.mark.parametrize("which", ["run", "photos"])
def test_the_page_holds_the_detections(which, request):
    results = open_results(request.getfixturevalue(which))
    held = data_of(report_page(results))
    assert [frame["name"] for frame in held["frames"]] == list(results.frames)
    for frame, found in zip(held["frames"], results.detections(), strict=True):
        assert len(frame["chains"]) == len(found.chains) > 0
        for packed, chain in zip(frame["chains"], found.chains, strict=True):
            extent = np.ptp(chain.joints, axis=0).max()
            np.testing.assert_allclose(numbers(packed["joints"]), chain.joints, atol=extent / 60000)
            np.testing.assert_allclose(numbers(packed["radii"])[:, 0], chain.radii, atol=1e-4 * chain.radius)
            assert [each == "1" for each in packed["occluded"]] == chain.occluded.tolist()
            assert [each == "1" for each in packed["filled"]] == chain.depth_filled.tolist()
        picture = cv2.imdecode(np.frombuffer(base64.b64decode(frame["picture"]), np.uint8), cv2.IMREAD_COLOR)
        assert 100 < picture.shape[1] <= 720
        full = cv2.imread(str(results.path / f"{frame['name']}.jpg"))
        assert (frame["height"], frame["width"]) == full.shape[:2]
        assert frame["seconds"] > 0


def test_doubtful_chains_are_thin_and_gray_and_the_table_says_so(run, tmp_path):
    place = copied(run, tmp_path / "copy")
    (packed,) = data_of(report_page(open_results(place), clouds=False))["frames"][0]["doubtful"]
    assert (packed["color"], packed["width"] < 1, packed["doubt"]) == ("#b0b0b0", True, "doubtful (confidence 0.13)")
    assert len(open_results(place).detection(open_results(place).frames[0]).doubtful) == 1


def test_points_on_the_object_come_first_and_lie_on_its_chain(run):
    (found, *_), held = open_results(run).detections(), data_of(report_page(open_results(run)))
    cloud, axis = held["frames"][0]["cloud"], found.chains[0].nodes(2000)
    points = numbers(cloud)
    distance = np.sqrt(((points[:, None] - axis[None]) ** 2).sum(axis=2)).min(axis=1)
    assert 500 < cloud["on_object"] < len(points) <= 1600
    assert distance[: cloud["on_object"]].max() < 1.4 * found.chains[0].radius
    assert distance[cloud["on_object"] :].min() > 1.2 * found.chains[0].radius
    assert len(base64.b64decode(cloud["rgb"])) == 2 * len(points)


def test_without_the_capture_the_chains_remain(run, tmp_path):
    place = copied(run, tmp_path / "copy", input={"path": str(tmp_path / "gone"), "format": "folder", "frames": 2})
    held = data_of(report_page(open_results(place)))
    assert "cannot be read any more" in held["clouds_warning"]
    assert not any(frame.get("cloud") for frame in held["frames"])
    assert held["frames"][0]["chains"]


def test_without_clouds_the_capture_is_not_read(run):
    held = data_of(report_page(open_results(run), clouds=False))
    assert held["clouds_warning"] == ""
    assert not any(frame.get("cloud") for frame in held["frames"])


def test_the_same_results_give_the_same_page(run):
    assert report_page(open_results(run)) == report_page(open_results(run))


def test_names_and_reasons_stay_text(run, tmp_path):
    place = copied(run, tmp_path / "copy", input={"path": f"/there/{HOSTILE_NAME}", "format": "folder", "frames": 2})
    page = report_page(open_results(place))
    held = data_of(page)
    assert held["frames"][-1]["error"] == HOSTILE_REASON
    assert "<img src=x" not in page
    assert page.count("<script") == page.count("</script>") == 4


@pytest.mark.parametrize("most", [60_000, 10_000, 3_400])
def test_a_thumbnail_takes_no_more_than_its_share(most):
    rng = np.random.default_rng(0)
    scene = cv2.resize(rng.integers(0, 255, (9, 16, 3), dtype=np.uint8), (1280, 720), interpolation=cv2.INTER_CUBIC)
    noisy = np.clip(scene + rng.normal(0, 8, scene.shape), 0, 255).astype(np.uint8)
    held, width, height = pack_picture(noisy, most)
    data = base64.b64decode(held)
    assert (width, height) == (1280, 720)
    assert most / 6 < len(data) <= most
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape[1] >= 110


def test_a_run_without_frames(tmp_path):
    place = tmp_path / "none"
    place.mkdir()
    (place / "manifest.json").write_text(json.dumps({"schema": "doo3d/manifest/1", "finished": True, "frames": []}))
    assert data_of(report_page(open_results(place)))["frames"] == []


def test_a_run_that_is_not_finished_is_refused(tmp_path):
    with refuses("run-unfinished"):
        report_page(Results(tmp_path, {"finished": False, "frames": []}, ()))


def test_a_damaged_manifest_is_named(tmp_path):
    with refuses("results-damaged", "manifest.json"):
        report_page(Results(tmp_path, {"frames": [{"status": "ok"}]}, ()))


def test_the_command(doo3d, run):
    code, out, _ = doo3d("report", run, "-o", "page.html")
    assert code == 0
    assert re.fullmatch(r"2 frames, \d+\.\d MB -> page\.html\n", out)
    page = Path("page.html").read_text(encoding="utf-8")
    assert (Path.cwd() / data_of(page)["pictures"]).resolve() == run.resolve()
    assert doo3d("report", run, "-o", "page.html")[0] == 0  # its own page, as it was written
    Path("page.html").write_text("edited")
    assert doo3d("report", run, "-o", "page.html")[0] == 2
    assert doo3d("report", run, "-o", "page.html", "--force")[0] == 0
    for wrong, code in (
        ((Path("nowhere"), "-o", "a.html"), "results-missing"),
        ((run, "-o", "no/a.html"), "out-folder-missing"),
    ):
        status, _, err = doo3d("report", *wrong)
        assert (status, code_in(err)) == (2, code)
        assert len(err.splitlines()) == 1


@pytest.fixture(scope="module")
def page(run, tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("page")
    path = place / "report.html"
    path.write_text(report_page(open_results(copied(run, place / "copy", times=20)), place), encoding="utf-8")
    return path


READY = "window.Plotly && document.querySelectorAll('#plots .js-plotly-plot .main-svg').length >= 3"
IN_SPACE = "document.querySelector('#view')._fullLayout?.scene?._scene?.glplot"
TRACES = "document.querySelector('#view').data"
TWO_POINTS = """{center: [0, 0, 0], step: 1, levels: btoa("\\0".repeat(12)), rgb: btoa("\\0".repeat(4)), on_object: 1}"""
POINT_MARKS = f"cloudTraces({TWO_POINTS}).map((each) => [each.marker.size, each.marker.opacity])"
EYE = "JSON.stringify(document.querySelector('#view')._fullLayout.scene._scene.getCamera().eye)"


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", [(390, 844), (1280, 800)])
def test_it_opens_without_a_network_and_turns(page, size, dark):
    with browser.Browser(size, dark) as page_view:
        page_view.open(page)
        page_view.wait(READY)
        assert page_view.run("document.querySelectorAll('#frames li').length") == 41
        assert page_view.run("document.querySelector('#failed td:last-child').textContent") == HOSTILE_REASON
        assert page_view.run("document.querySelector('#frames span').textContent") == "bad"
        assert page_view.run("document.documentElement.scrollWidth <= innerWidth"), "wider than the window"
        assert page_view.run("document.querySelectorAll('img[src=x]').length") == 0
        assert "in 3-D" in page_view.run("document.querySelector('#opens').textContent")
        page_view.run("document.querySelectorAll('#frames button')[1].click()")
        page_view.wait(IN_SPACE)
        kinds = page_view.run("document.querySelector('#view').data.map(trace => trace.type).join()")
        assert kinds.count("mesh3d") >= 3, "seen, hidden, seen, and where the depth was filled in"
        assert page_view.run("document.querySelector('#picture').naturalWidth") > 100
        sizes = json.loads(page_view.run(f"JSON.stringify({POINT_MARKS})"))
        assert len(sizes) == 2
        assert all(size <= 1.5 and 0.2 < opacity < 0.8 for size, opacity in sizes), "points hide the chain"
        assert page_view.run("document.querySelector('#chains .doubtful').textContent").startswith("70.12, doubtful")
        assert page_view.run(f"{TRACES}.some((trace) => trace.name === 'chain 7, doubtful (confidence 0.12)')")
        assert page_view.run("[...document.querySelectorAll('#chains .doubtful')].pop().textContent").startswith(
            "–0.13, doubtful"
        )
        assert page_view.run(f"{TRACES}.some((trace) => trace.name === 'doubtful (confidence 0.13)')")
        assert page_view.run("document.querySelectorAll('#frames small')[1].textContent").startswith("2 chains, 1 doubtful")
        if size[0] > 860:
            assert page_view.run(
                "document.querySelector('#chains').scrollWidth <= document.querySelector('#chains').parentElement.clientWidth"
            )
        box = page_view.run("JSON.stringify(document.querySelector('#view').getBoundingClientRect())")
        box, before = json.loads(box), page_view.run(EYE)
        at = box["left"] + box["width"] / 2, box["top"] + box["height"] / 2
        page_view.drag(at, (at[0] + 120, at[1] + 40))
        page_view.wait(f"{EYE} !== '{before}'")
        page_view.run("document.querySelector('#next').click()")
        page_view.wait("document.querySelector('#one-title').textContent.includes('000001')")
        page_view.run("document.querySelector('#close').click()")
        page_view.run("document.querySelectorAll('#frames button')[0].click()")
        assert page_view.run("document.querySelector('#one-notes').textContent") == HOSTILE_REASON
        assert page_view.run("document.title") != "taken"
        assert page_view.problems == []
        assert {address.split(":")[0] for address in page_view.requests} <= {"file", "data", "blob"}
        assert len([address for address in page_view.requests if address.startswith("file:")]) == 1


@pytest.fixture
def sequence(run, tmp_path) -> Path:
    """Forty frames, 20 a second, of a chain with an id that moves; other frames filled in a part of it. The last has lost it."""
    folder = tmp_path / "sequence"
    folder.mkdir()
    manifest, frames = json.loads((run / "manifest.json").read_text()), []
    values = json.loads((run / f"{manifest['frames'][0]['name']}.json").read_text())
    (chain, *_), start = values["chains"], values["chains"][0]["joints"]
    for k in range(40):
        joints = [[x, y + 0.001 * k, z] for x, y, z in start]
        moved = chain | {"id": 0, "joints": joints, "from_time": [hidden and k > 0 for hidden in chain["occluded"]]}
        frame = {"frame": f"{k:03d}", "timestamp": 5 + k / 20, "chains": [moved] if k < 39 else [], "crossings": []}
        (folder / f"{k:03d}.json").write_text(json.dumps(values | frame))
        os.link(run / f"{manifest['frames'][0]['name']}.jpg", folder / f"{k:03d}.jpg")
        frames.append(manifest["frames"][0] | {"name": f"{k:03d}", "timestamp": 5 + k / 20})
    (folder / "manifest.json").write_text(json.dumps(manifest | {"frames": frames}))
    return folder


def test_the_page_holds_what_other_frames_filled_in(sequence):
    held = data_of(report_page(open_results(sequence), clouds=False))["frames"]
    assert "from_time" not in held[0]["chains"][0]
    assert held[1]["chains"][0]["from_time"] == held[1]["chains"][0]["occluded"]
    assert "1" in held[1]["chains"][0]["from_time"]


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
def test_parts_from_other_frames_and_a_trail(sequence, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(report_page(open_results(sequence), clouds=False), encoding="utf-8")
    traces = "document.querySelector('#view').data"
    with browser.Browser() as view:
        view.open(path)
        view.wait(READY)
        view.run("show(30)")
        view.wait(IN_SPACE)
        assert view.run(f"{traces}.filter((trace) => trace.line?.dash === 'longdashdot').length") >= 1
        assert view.run(f"{traces}.filter((trace) => trace.hovertext?.[0]?.endsWith('from other frames')).length") >= 1
        trails = json.loads(
            view.run(f"JSON.stringify({traces}.filter((trace) => trace.name === 'trail').map((trace) => [...trace.y]))")
        )
        assert [len(trail) for trail in trails] == [21] * 3
        np.testing.assert_allclose(np.diff(trails), -0.001, atol=1e-5)
        assert "From other frames" in view.run("document.querySelector('#chains').textContent")
        for number, count in ((0, 0), (1, 3), (39, 0)):
            view.run(f"show({number})")
            view.wait(f"document.querySelector('#one-title').textContent === '{number:03d}'")
            assert view.run(f"{traces}.filter((trace) => trace.name === 'trail').length") == count
        assert view.problems == []


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
def test_in_the_image(photos, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(report_page(open_results(photos)), encoding="utf-8")
    with browser.Browser() as page_view:
        page_view.open(path)
        assert page_view.run("document.querySelector('#opens').textContent").endswith("enlarged.")
        page_view.run("document.querySelectorAll('#frames button')[0].click()")
        page_view.wait("document.querySelector('#view .main-svg .scatterlayer .trace')")
        assert page_view.run("document.querySelector('#view').layout.images.length") == 1
        assert page_view.problems == []


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
def test_many_frames_open_soon(run, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(report_page(open_results(copied(run, tmp_path / "copy", times=60)), clouds=False), encoding="utf-8")
    assert path.stat().st_size < 20e6
    with browser.Browser() as page_view:
        page_view.open(path)
        assert page_view.run("document.querySelectorAll('#frames li').length") == 121
        times = "performance.getEntriesByType('navigation')[0].domContentLoadedEventEnd"
        assert 0 < page_view.run(times) < 6000, "ms, on a machine that may be busy"


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
def test_a_page_without_frames(tmp_path):
    path = tmp_path / "report.html"
    path.write_text(report_page(Results(tmp_path, {"frames": []}, ())), encoding="utf-8")
    with browser.Browser() as page_view:
        page_view.open(path)
        page_view.wait("window.Plotly")
        assert not page_view.run("document.querySelector('#empty').hidden")
        assert page_view.problems == []
