"""The run over photographs and its tables, with a detection that is known; and the commands."""

import csv

import cv2
import numpy as np
import pytest
from builders.errors import code_in
from builders.paths import DATA
from builders.photos import HEIGHT, WIDTH, cross, labelled, painted, photo_ref, save, strand

from doo3d.config import Config, load_config
from doo3d.evaluation.benchmark.pictures import worst, write_pictures
from doo3d.evaluation.benchmark.run import run_cases
from doo3d.evaluation.benchmark.tables import csv_text, format_table
from doo3d.evaluation.photos.datasets import cset, mbest
from doo3d.evaluation.photos.evaluate import cable_benchmark, caption, name, photo_benchmark, remarks
from doo3d.types import Detection, View

APART = [strand((20, 30), (180, 30)), strand((20, 90), (180, 90))]


class Known:
    """A detector that answers what it was given, or raises it, and keeps what it was asked."""

    def __init__(self, *answers, seconds=0.012):
        self.answers, self.seconds, self.asked = list(answers), seconds, []

    def __call__(self, image, config, mask=None):
        self.asked.append((image, config, mask))
        answer = self.answers[min(len(self.asked), len(self.answers)) - 1]
        if isinstance(answer, Exception):
            raise answer
        seconds = {"thin": self.seconds / 3, "merge": 2 * self.seconds / 3}
        return Detection(tuple(answer), "2d", "image", seconds=seconds, view=View.of(mask, mask.shape))


@pytest.fixture
def evaluate(monkeypatch):
    """Measures photographs with a detection that is known."""

    def run(refs, detect, benchmark):
        monkeypatch.setattr("doo3d.pipeline.detect", detect)
        return run_cases(benchmark.measure, refs)

    return run


def test_the_first_runs_twice_and_counts_once(evaluate):
    detect = Known(APART)
    refs = [photo_ref(APART, "S1"), photo_ref(APART, "S1", "img2"), photo_ref(APART, "S2")]
    rows = evaluate(refs, detect, photo_benchmark(Config()))
    assert [name(row) for row in rows] == ["S1/img0", "S1/img2", "S2/img0"]
    assert len(detect.asked) == 4
    assert all(row.ms == pytest.approx(12) for row in rows)
    image, _, mask = detect.asked[0]
    assert image.shape == (HEIGHT, WIDTH, 3)
    assert (mask == (labelled(APART) > 0)).all()


def test_the_count_is_told_when_asked_for(evaluate):
    for known, wanted in ((False, 7), (True, 2)):
        detect = Known(APART)
        config = load_config("default", {"merge.chains": 7})
        evaluate([photo_ref(APART)], detect, photo_benchmark(config, known))
        assert detect.asked[-1][1].merge.chains == wanted


def test_the_table_has_a_line_per_subset_and_one_for_all(evaluate):
    refs = [photo_ref(APART, "S1"), photo_ref(APART, "S1", "img2"), photo_ref(APART, "S2")]
    benchmark = photo_benchmark(Config())
    rows = evaluate(refs, Known(APART, APART, APART[:1], APART), benchmark)
    lines = format_table(rows, benchmark.columns).splitlines()
    assert [line.split()[0] for line in (*lines[1:3], lines[4])] == ["S1", "S2", "all"]
    assert lines[1].split()[1:] == ["2", "75.00", "75.00", "1/2", "50.0", "%", "12.0", "12.0", "0"]
    assert lines[2].split()[1:4] == ["1", "100.00", "100.00"]
    assert len({len(line) for line in lines}) == 1
    assert remarks(rows) == ["count wrong: S1/img2 1 of 2"]


def test_any_exception_counts_as_nothing_found_and_is_named(evaluate):
    fault, benchmark = ZeroDivisionError("by nothing"), photo_benchmark(Config())
    rows = evaluate([photo_ref(APART), photo_ref(APART, name="img2")], Known(fault, fault, APART), benchmark)
    assert rows[0].drawn == rows[0].instances == 0
    assert np.isnan(rows[0].ms)
    assert remarks(rows) == ["error: ZeroDivisionError: by nothing [unexpected]: S1/img0"]
    line = format_table(rows, benchmark.columns).splitlines()[1]
    assert line.split()[1:5] == ["2", "50.00", "50.00", "1/2"]
    assert line.endswith(" 12.0    12.0      1")
    rows = evaluate([photo_ref(APART)], Known(fault), benchmark)
    assert format_table(rows, benchmark.columns).splitlines()[1].split()[-3:] == ["-", "-", "1"]


def test_each_cable_alone(evaluate):
    below, above = cross()
    short, benchmark = [strand((100, 15), (100, 75))], cable_benchmark(Config())
    detect = Known([below], short, [below], short)
    rows = evaluate([photo_ref([below, above])], detect, benchmark)
    assert [name(row) for row in rows] == ["S1/img0 cable 1", "S1/img0 cable 2"]
    assert [row.traced for row in rows] == [True, False]
    labels = labelled([below, above])
    for (_, config, mask), cable in zip(detect.asked, (1, 2, 1, 2), strict=True):
        assert (mask == (labels == cable)).all()
        assert config.merge.chains == 1
    assert format_table(rows, benchmark.columns).splitlines()[1].split()[:3] == ["S1", "2", "1/2"]
    assert remarks(rows) == ["not traced: S1/img0 cable 2"]
    assert "recall 5" in caption(rows[1])


def test_the_csv_has_all_of_a_row(evaluate):
    refs = [photo_ref(APART), photo_ref(APART, name="img2")]
    rows = evaluate(refs, Known(APART, APART, ValueError("a, b")), photo_benchmark(Config()))
    first, second = csv.DictReader(csv_text(rows).splitlines())
    assert first == first | {"family": "S1", "frame": "img0", "cables": "2", "chains": "2", "drawn": "1.0", "instances": "1.0"}
    assert float(first["ms"]) == pytest.approx(12)
    assert (second["error"], second["code"]) == ("ValueError: a, b", "unexpected")


def test_the_worst_are_pictured(evaluate, tmp_path):
    benchmark = photo_benchmark(Config())
    rows = evaluate([photo_ref(APART), photo_ref(APART, name="img2")], Known(APART, APART, APART[1:]), benchmark)
    chosen = worst(rows, 1, benchmark.badness)
    assert [name(row) for row in chosen] == ["S1/img2"]
    assert caption(chosen[0]) == "S1/img2   drawn 50.0   instances 50.0   1 of 2 chains"
    sheet, path = write_pictures(tmp_path / "worst", rows, benchmark, 1)
    assert (sheet.name, path.name) == ("failures.png", "S1_img2.png")
    assert cv2.imread(str(path)).shape[1] == 2 * WIDTH
    _, beside = benchmark.panels(chosen[0])
    assert tuple(beside[30, 100]) == (128, 128, 128)  # missed
    assert tuple(beside[90, 100]) == (0, 204, 255)  # the color of the first chain


@pytest.fixture
def photographs(tmp_path, monkeypatch):
    """mBEST's layout with two photographs, and the detection that finds all of them."""
    for stem, chains in (("img0", APART), ("img2", cross())):
        save(tmp_path / "photos/S2/images" / f"{stem}.jpg", painted(labelled(chains)))
        save(tmp_path / "photos/S2/labels" / f"{stem}.png", labelled(chains))
    monkeypatch.setattr("doo3d.pipeline.detect", Known(APART, APART, cross()))
    return tmp_path / "photos"


def test_the_command_prints_writes_and_draws(photographs, doo3d, tmp_path):
    table, pictures = tmp_path / "rows.csv", tmp_path / "pictures"
    code, out, err = doo3d(
        "evaluate", "dataset", "mbest", photographs, "-c", "default", "--csv", table, "--worst", 1, "--pictures", pictures
    )
    assert (code, err) == (0, "")
    assert "2/2 100.0 %" in out
    assert "worst: S2/img2 " in out
    assert len(table.read_text().splitlines()) == 3
    assert [path.name for path in pictures.iterdir()] == ["S2_img2.png"]


def test_the_command_takes_cables_alone(photographs, doo3d):
    code, out, _ = doo3d("evaluate", "dataset", "mbest", photographs, "-c", "default", "--single")
    assert code == 0
    assert "traced" in out
    code, _, err = doo3d("evaluate", "dataset", "mbest", photographs, "--single", "--masks", "hsv")
    assert code == 2
    assert code_in(err) == "options-conflict"


def test_the_command_for_busy_backgrounds(tmp_path, doo3d, monkeypatch):
    labels = labelled(cross(), (360, 640))
    for kind in ("images", "labels"):
        save(tmp_path / "set" / kind / "c1_0.png", painted(labels))
    save(tmp_path / "set/masks/c1_0.png", np.where(labels > 0, np.uint8(255), np.uint8(0)))
    monkeypatch.setattr("doo3d.pipeline.detect", Known(cross()))
    for masks in ("labels", "network"):
        code, out, _ = doo3d("evaluate", "dataset", "cset", tmp_path / "set", "-c", "default", "--masks", masks)
        assert code == 0
        assert out.splitlines()[1].startswith("C1 ")
        assert "1/1 100.0 %" in out
    code, _, err = doo3d("evaluate", "dataset", "cset", tmp_path / "set", "--masks", "hsv")
    assert (code, code_in(err)) == (2, "choice-unknown")
    assert "labels, network" in err
    code, _, err = doo3d("evaluate", "dataset", "cset", tmp_path)
    assert code == 2
    assert code_in(err) == "photos-missing"


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason="the public photographs are not beside the checkout")
def test_real_photographs_are_followed():
    refs = [*mbest(DATA / "mbest")[::60], *cset(DATA / "cset")[::30]]
    rows = run_cases(photo_benchmark(load_config("image")).measure, refs)
    assert not [row.error for row in rows if row.error]
    assert np.mean([row.drawn for row in rows]) > 0.9
    assert np.mean([row.instances for row in rows]) > 0.9
