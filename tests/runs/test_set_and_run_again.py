"""Settings that change between two runs into one folder: what doo3d made is replaced, nothing else is."""

import os

import pytest
from builders.errors import code_in, refuses
from builders.runs import files_of, read_manifest

from doo3d.config import Config, load_config
from doo3d.inputs import open_capture
from doo3d.outputs import run_folder
from doo3d.outputs.run_reader import open_results
from doo3d.runs import run as batch


@pytest.mark.usefixtures("fake_detection")
def test_results_with_other_settings_are_replaced_and_other_files_stay(doo3d, capture, tmp_path):
    folder, out = capture(frames=2), tmp_path / "out"
    assert doo3d("detect", folder)[0] == 0
    (out / "mine.txt").write_text("keep")
    settings = ("--set", "merge.chains=2", "--set", "seed=3")
    code, _, err = doo3d("detect", folder, *settings)
    assert (code, err) == (0, "note: out has results with other settings (merge.chains, seed); they are replaced\n")
    assert doo3d("detect", folder, *settings, "-o", "fresh")[0] == 0
    assert files_of(out) == files_of(tmp_path / "fresh") | {"mine.txt": b"keep"}
    assert "finished already" in doo3d("detect", folder, *settings)[2]


@pytest.mark.usefixtures("fake_detection")
def test_results_that_took_long_are_kept_aside(doo3d, capture, tmp_path, monkeypatch):
    folder, out = capture(frames=2), tmp_path / "out"
    doo3d("detect", folder)
    before = files_of(out)
    (tmp_path / "out_1").write_text("mine")
    monkeypatch.setattr(run_folder, "KEPT_SECONDS", 0.0)
    code, _, err = doo3d("detect", folder, "--set", "seed=3")
    assert (code, err) == (0, "note: out has results with other settings (seed); they are kept in out_2\n")
    assert files_of(tmp_path / "out_2") == before
    assert open_results(tmp_path / "out_2").frames == ("000000", "000001")
    doo3d("detect", folder, "--set", "seed=3", "-o", "fresh")
    assert files_of(out) == files_of(tmp_path / "fresh")
    assert "they are replaced" in doo3d("detect", folder, "--set", "seed=4", "--restart")[2]
    assert sorted(os.listdir(tmp_path)) == sorted(["capture", "fresh", "out", "out_1", "out_2"])


@pytest.mark.usefixtures("fake_detection")
def test_an_interrupted_move_aside_is_completed(doo3d, capture, tmp_path, monkeypatch):
    doo3d("detect", capture(frames=2))
    before = files_of(tmp_path / "out")
    (tmp_path / "out_1").mkdir()
    os.rename(tmp_path / "out" / "000000.json", tmp_path / "out_1" / "000000.json")
    monkeypatch.setattr(run_folder, "KEPT_SECONDS", 0.0)
    doo3d("detect", "capture", "--set", "seed=3")
    assert files_of(tmp_path / "out_1") == before


@pytest.mark.usefixtures("fake_detection")
def test_an_interrupted_replacement_goes_on(doo3d, capture, fake_detection, tmp_path):
    folder = capture(frames=3)
    doo3d("detect", folder)
    with fake_detection.failing(KeyboardInterrupt, "000001"):
        assert doo3d("detect", folder, "--set", "seed=3")[0] == 130
    code, _, err = doo3d("detect", folder, "--set", "seed=3")
    assert (code, err) == (0, "1 frame is finished already, resuming after them\n")
    doo3d("detect", folder, "--set", "seed=3", "-o", "fresh")
    assert files_of(tmp_path / "out") == files_of(tmp_path / "fresh")


@pytest.mark.usefixtures("fake_detection")
def test_old_results_stay_if_the_new_settings_fail_everywhere(doo3d, capture, fake_detection, tmp_path):
    folder = capture(frames=2)
    doo3d("detect", folder)
    before = files_of(tmp_path / "out")
    with fake_detection.failing(ValueError("no")):
        assert doo3d("detect", folder, "--set", "seed=3")[0] == 2
    assert files_of(tmp_path / "out") == before


@pytest.mark.usefixtures("fake_detection")
def test_python_and_the_shell_name_their_own_options(doo3d, capture, tmp_path):
    folder, other, out = capture(frames=2), capture("other"), tmp_path / "out"
    batch.run(open_capture(folder), out, Config())
    with refuses("out-other-input", "give another folder, or force=True"):
        batch.run(open_capture(other), out, load_config("default", {"seed": 3}))
    err = doo3d("detect", other)[2]
    assert "give another folder with -o, or --force to write there" in err
    stat = (folder / "depth" / "000000.png").stat()
    os.utime(folder / "depth" / "000000.png", ns=(stat.st_atime_ns, stat.st_mtime_ns + 1_000_000))
    with refuses("input-changed", "give another folder, or restart=True"):
        batch.run(open_capture(folder), out, load_config("default", {"seed": 3}))
    err = doo3d("detect", folder)[2]
    assert "give another folder with -o, or --restart to replace them" in err
    assert code_in(err) == "input-changed"


@pytest.mark.parametrize(("command", "product"), [("report", "out.html"), ("video", "out.webm"), ("export --to npz", "out.npz")])
def test_products_are_replaced_unless_somebody_changed_them(doo3d, capture, tmp_path, command, product):
    folder = capture(frames=2)
    doo3d("detect", folder)
    name, *options = command.split()
    again = (name, "out", *options)
    assert doo3d(*again)[0] == 0
    first = (tmp_path / product).read_bytes()
    assert doo3d("detect", folder, "--set", "fit.segment_length=0.02")[0] == 0
    assert doo3d(*again)[0] == 0
    assert (tmp_path / product).read_bytes() != first
    (tmp_path / product).write_bytes(b"mine")
    code, _, err = doo3d(*again)
    assert (code, code_in(err), "--force" in err) == (2, "out-exists", True)
    assert (tmp_path / product).read_bytes() == b"mine"
    assert doo3d(*again, "--force")[0] == 0
    assert doo3d(*again)[0] == 0
    doo3d("detect", folder, "-o", "second")
    code, _, err = doo3d(name, "second", *options, "-o", product)  # made from other results
    assert (code, code_in(err)) == (2, "out-exists")
    doo3d("detect", capture("other"), "--force")
    assert doo3d(*again)[0] == 2


def test_a_folder_of_models_is_replaced_file_by_file(doo3d, capture, tmp_path):
    doo3d("detect", capture(frames=2))
    assert doo3d("export", "out", "--to", "mjcf")[0] == 0
    (tmp_path / "out_mjcf" / "000001.xml").write_text("mine")
    code, _, err = doo3d("export", "out", "--to", "mjcf")
    assert (code, "000001.xml" in err, (tmp_path / "out_mjcf" / "000001.xml").read_text()) == (2, True, "mine")
    assert doo3d("export", "out", "--to", "mjcf", "--frame", "000000")[0] == 0


def test_a_comparison_of_another_capture_is_refused(doo3d, capture):
    folder, other = capture(), capture("other")
    assert doo3d("compare", folder)[0] in (0, 1)
    assert doo3d("compare", folder, "--set", "seed=2")[0] in (0, 1)
    code, _, err = doo3d("compare", other)
    assert (code, code_in(err)) == (2, "out-other-input")
    assert doo3d("compare", other, "--force")[0] in (0, 1)


def test_a_sequence_is_refused_before_its_first_pass(doo3d, capture, tmp_path):
    doo3d("detect", capture())
    before = sorted(os.listdir("out"))
    code, out, err = doo3d("detect", capture("other", frames=2), "--sequence")
    assert (code, out, code_in(err)) == (2, "", "out-other-input")
    assert sorted(os.listdir("out")) == before
    os.mkdir("mine")
    (tmp_path / "mine" / "file").write_text("")
    assert code_in(doo3d("detect", "capture", "--sequence", "-o", "mine")[2]) == "out-foreign"
    assert os.listdir("mine") == ["file"]


def test_a_sequence_with_other_settings_replaces_both_passes(doo3d, capture, tmp_path):
    folder = capture(frames=3)
    assert doo3d("detect", folder, "--sequence")[0] == 0
    options = ("--sequence", "--set", "fit.segment_length=0.02")
    code, _, err = doo3d("detect", folder, *options)
    assert code == 0
    assert err.count("they are replaced") == 1
    assert doo3d("detect", folder, *options, "-o", "fresh")[0] == 0
    first_pass = ".doo3d-first-pass"
    for one, other in ((tmp_path / "out", tmp_path / "fresh"), (tmp_path / "out" / first_pass, tmp_path / "fresh" / first_pass)):
        files = [{file.name: file.read_bytes() for file in place.iterdir() if file.is_file()} for place in (one, other)]
        for each in files:
            del each["progress.jsonl"]
        assert files[0] == files[1]
    assert read_manifest(tmp_path / "out")["finished"]
