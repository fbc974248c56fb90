"""The report of a run in which something went wrong: notes to check, failed frames, a slow first frame."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from builders import browser
from builders.paths import SAMPLES

import doo3d
from doo3d.inputs import open_capture
from doo3d.outputs.run_reader import open_results
from doo3d.runs import run as batch
from doo3d.viz.report import report_page

NOTE = "check the registration: <script>document.title='taken'</script>"
SECONDS = (9.0, 0.3, 0.001, 0.31, 0.29)  # of the frames; the third fails
needs_chromium = pytest.mark.skipif(
    not sys.platform.startswith("linux") or browser.chromium() is None,
    reason="no Chromium on this machine: apt-get install chromium, or name one in DOO3D_CHROMIUM",
)


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    """One cable in four of five frames."""
    folder = tmp_path_factory.mktemp("doubts")
    out = folder / "out"
    batch.run(open_capture(SAMPLES / "occluder"), folder / "made", doo3d.load_config("default"))
    out.mkdir()
    manifest = json.loads((folder / "made/manifest.json").read_text())
    lines = [json.loads(line) for line in (folder / "made/progress.jsonl").read_text().splitlines()]
    frames, journal = [], []
    for i, seconds in enumerate(SECONDS):
        name = f"{i:06d}"
        bad = {"status": "failed", "error": "cut off", "code": "image-damaged"} if i == 2 else {}
        frames.append(manifest["frames"][i % 2] | bad | {"name": name})
        journal.append(lines[i % 2] | bad | {"name": name, "seconds": seconds})
        if not bad:
            values = json.loads((folder / f"made/{i % 2:06d}.json").read_text())
            (out / f"{name}.json").write_text(json.dumps(values | {"frame": name}))
            shutil.copy(folder / f"made/{i % 2:06d}.jpg", out / f"{name}.jpg")
    (out / "manifest.json").write_text(json.dumps(manifest | {"frames": frames, "notes": [NOTE, 7]}))
    (out / "progress.jsonl").write_text("".join(json.dumps(line) + "\n" for line in journal))
    path = folder / "report.html"
    path.write_text(report_page(open_results(out), clouds=False), encoding="utf-8")
    return path


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
def test_failed_frames_are_gaps_and_the_first_frame_flattens_nothing(page):
    with browser.Browser() as view:
        view.open(page)
        view.wait("window.Plotly && document.querySelectorAll('#plots .js-plotly-plot .main-svg').length >= 3")
        trace = "document.querySelectorAll('#plots .plot')[1].data[0]"
        assert view.run(f"JSON.stringify({trace}.y)") == "[341,300,null,310,290]"
        assert view.run(f"{trace}.marker.symbol.slice(0, 2).join()") == "triangle-up,circle"
        assert view.run(f"{trace}.text[0]").startswith("000000<br>9000 ms")
        titles = json.loads(
            view.run("JSON.stringify([...document.querySelectorAll('#plots figcaption')].map((e) => e.textContent))")
        )
        assert titles[1] == "Time, ms (first frame: 9000 ms, drawn at the top)"
        shares = json.loads(view.run("JSON.stringify(document.querySelectorAll('#plots .plot')[2].data.map((trace) => trace.y))"))
        assert [values[2] for values in shares] == [None, None]
        labels, values = (
            json.loads(view.run(f"JSON.stringify([...document.querySelectorAll('#figures {tag}')].map((e) => e.textContent))"))
            for tag in ("dt", "dd")
        )
        figures = dict(zip(labels, values, strict=True))
        assert (figures["Cables"], figures["Frames with chains"], figures["Failed"]) == ("1", "4 of 5", "1")
        assert (figures["Time, first frame"], figures["Time, longest of the others"]) == ("9000 ms", "310 ms")
        assert view.problems == []


@pytest.mark.browser
@pytest.mark.slow
@needs_chromium
def test_notes_of_the_run_come_first(page):
    with browser.Browser() as view:
        view.open(page)
        assert not view.run("document.querySelector('#doubts').hidden")
        assert view.run("document.querySelector('#doubts li').textContent") == NOTE
        assert view.run("document.querySelectorAll('#doubts li').length") == 1
        assert view.run("document.title") != "taken"
