"""Which files are made, what is refused, and the command."""

import hashlib
import importlib
import json
import os

import mujoco
import numpy as np
import pytest
import trimesh
import yourdfpy
from builders.chains import VIEW, capture, flat, helix
from builders.errors import code_in, refuses
from pxr import Usd, UsdGeom
from rosbags.highlevel import AnyReader

import doo3d
from doo3d import errors
from doo3d.exports import FORMATS, export_class, writer
from doo3d.outputs.detection_json import dumps

pytestmark = pytest.mark.filterwarnings("ignore::doo3d.errors.DooWarning")  # where down is, test_simulators asks

FLAT = {"npz", "csv", "coco", "swc", "graphml"}


def target(folder, name, stem="chains"):
    kind = export_class(name)
    return folder / (stem + (kind.suffixes[0] if kind.suffixes else ""))


def digests(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def results(tmp_path):
    """A folder as `doo3d detect` writes it."""

    def make(frames, name="out"):
        folder = tmp_path / name
        folder.mkdir()
        for frame in frames:
            (folder / f"{frame.frame}.json").write_text(dumps(frame.to_dict()))
        listed = [{"name": frame.frame, "status": "ok"} for frame in frames]
        (folder / "manifest.json").write_text(json.dumps({"schema": "doo3d/manifest/1", "frames": listed}))
        return folder

    return make


def paths_in_bag(path):
    with AnyReader([path]) as bag:
        return sum(connection.msgtype == "nav_msgs/msg/Path" for connection in bag.connections)


def capsules_on_stage(path):
    stage = Usd.Stage.Open(str(path))
    return sum(prim.IsA(UsdGeom.Capsule) for prim in stage.Traverse())


def curves_on_stage(path):
    stage = Usd.Stage.Open(str(path))
    assert stage.GetDefaultPrim().GetName() == "doo3d"
    return sum(prim.IsA(UsdGeom.BasisCurves) for prim in stage.Traverse())


OPENED = {
    "mjcf": lambda path: mujoco.MjModel.from_xml_path(str(path)).nv,
    "mjcf-motion": lambda path: mujoco.MjModel.from_xml_path(str(path)).nv,
    "urdf": lambda path: len(yourdfpy.URDF.load(str(path)).joint_map),
    "usd": curves_on_stage,
    "usd-physics": capsules_on_stage,
    "usd-cable": curves_on_stage,
    "ply": lambda path: len(trimesh.load_scene(path).geometry),
    "glb": lambda path: len(trimesh.load_scene(path).geometry),
    "obj": lambda path: sum(line.startswith("v ") for line in path.read_text().splitlines()),
    "npz": lambda path: len(np.load(path)["joints"]),
    "csv": lambda path: len(path.read_text().splitlines()) - 1,
    "nodes": lambda path: len(np.load(path)),
    "coco": lambda path: len(json.loads(path.read_text())["annotations"]),
    "ros2": paths_in_bag,
    "graphml": lambda path: path.read_text().count("<edge "),
    "swc": lambda path: sum(not line.startswith("#") for line in path.read_text().splitlines()),
}


@pytest.mark.parametrize("name", FORMATS)
def test_a_frame_without_chains_is_an_empty_file(tmp_path, name):
    empty = doo3d.Detection((), frame="empty", timestamp=1.0, view=VIEW)
    path = doo3d.export(empty, name, target(tmp_path, name))[0]
    assert OPENED[name](path) == 0


@pytest.mark.parametrize("name", FORMATS)
def test_one_segment_is_a_chain(tmp_path, name):
    path = doo3d.export(doo3d.Detection((helix(1),), view=VIEW), name, target(tmp_path, name))[0]
    assert OPENED[name](path) > 0


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_bytes_every_time_and_no_temporary_files(tmp_path, name):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        doo3d.export(
            capture(),
            name,
            tmp_path / folder / (target(tmp_path, name).name if export_class(name).file_per == "capture" else "x"),
        )
    first, second = digests(tmp_path / "a"), digests(tmp_path / "b")
    assert first == second
    assert first
    assert not [path for path in os.listdir(tmp_path) if path.startswith(".")]


@pytest.mark.parametrize("name", FORMATS)
def test_pixels_go_to_few_formats(tmp_path, name):
    if name in FLAT:
        assert doo3d.export(flat(), name, target(tmp_path, name))
    else:
        with refuses("results-2d", "photo", name, "npz, csv, coco, swc, graphml"):
            doo3d.export(flat(), name, target(tmp_path, name))
        assert not os.listdir(tmp_path)


@pytest.mark.parametrize("name", FORMATS)
def test_existing_files_are_replaced_with_force_only(tmp_path, name):
    path = target(tmp_path, name)
    doo3d.export(capture()[2], name, path)
    before = digests(tmp_path)
    other = doo3d.Detection((helix(3),), frame="other", view=VIEW)
    with refuses("out-exists", "force=True"):
        doo3d.export(other, name, path)
    assert digests(tmp_path) == before
    doo3d.export(other, name, path, force=True)
    assert digests(tmp_path) != before


@pytest.mark.parametrize("name", FORMATS)
def test_a_cell_of_a_notebook_can_be_run_again(tmp_path, name):
    path, detection = target(tmp_path, name), capture()[2]
    doo3d.export(detection, name, path)
    first = digests(tmp_path)
    writer._exported.clear()  # the kernel was restarted
    doo3d.export(detection, name, path)
    assert digests(tmp_path) == first
    doo3d.export(doo3d.Detection((helix(3),), frame=detection.frame, view=VIEW), name, path)  # other settings
    assert digests(tmp_path) != first
    file = next(file for file in [path, *path.rglob("*")] if file.is_file())
    file.write_bytes(b"mine")
    with refuses("out-exists", "force=True"):
        doo3d.export(detection, name, path)
    assert file.read_bytes() == b"mine"


def test_force_deletes_no_folder_with_other_content(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("all of it")
    for name in ("ros2", "npz"):
        path = tmp_path / "mine" if name == "ros2" else tmp_path / "mine.npz"
        path.mkdir(exist_ok=True)
        with refuses("out-foreign"):
            doo3d.export(capture(), name, path, force=True)
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "all of it"


@pytest.mark.parametrize(("name", "module", "extra"), [("usd", "pxr", "usd"), ("ros2", "rosbags", "bags")])
def test_a_missing_library_is_named_with_its_pip_line(tmp_path, monkeypatch, name, module, extra):
    real = importlib.import_module

    def missing(wanted, *rest):
        if wanted.split(".")[0] == module:
            raise ImportError(f"No module named {wanted!r}")
        return real(wanted, *rest)

    monkeypatch.setattr(errors.importlib, "import_module", missing)
    with refuses("missing-package", f"pip install 'doo3d[{extra}]'", kind=doo3d.MissingDependency):
        doo3d.export(capture(), name, target(tmp_path, name))
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(
    ("call", "code", "part"),
    [
        (("dxf", "a.dxf"), "format-unknown", "mjcf, mjcf-motion, urdf"),
        (("npz", "a.csv"), "out-suffix", ".npz"),
        (("mjcf", "a.urdf"), "out-suffix", ".xml"),
        (("mjcf", "a.xml"), "out-needs-folder", "3 files"),
        (("ply", "plain.txt/meshes"), "out-unwritable", "plain.txt"),
    ],
)
def test_files_that_do_not_fit(tmp_path, call, code, part):
    (tmp_path / "plain.txt").write_text("a file")
    with refuses(code, part, kind=doo3d.ConfigError if call[0] == "dxf" else doo3d.InputError):
        doo3d.export(capture(), call[0], tmp_path / call[1])
    assert os.listdir(tmp_path) == ["plain.txt"]


@pytest.mark.parametrize(
    ("name", "options", "code", "parts"),
    [
        ("npz", {"density": 1}, "key-unknown", ("npz", "density")),
        ("mjcf", {"densty": 1}, "key-unknown", ("mjcf", "densty", "radius, density, segments, rest, bending")),
        ("mjcf", {"density": -1}, "value-out-of-bounds", ("mjcf", "density = -1")),
        ("nodes", {"count": 1}, "value-out-of-bounds", ("nodes", "count = 1")),
        ("urdf", {"axes": 4}, "value-invalid", ("urdf", "axes = 4")),
    ],
)
def test_options_are_checked(tmp_path, name, options, code, parts):
    with refuses(code, *parts, kind=doo3d.ConfigError):
        doo3d.export(capture(), name, target(tmp_path, name), **options)


@pytest.mark.parametrize(
    "name", ["mjcf", "mjcf-motion", "urdf", "usd", "usd-physics", "usd-cable", "ply", "glb", "obj", "ros2", "swc"]
)
def test_a_chain_without_radius_needs_one(tmp_path, name):
    found = doo3d.Detection((doo3d.Chain(helix().joints, helix().segment_length),))
    with refuses("radius-missing"):
        doo3d.export(found, name, target(tmp_path, name))
    assert doo3d.export(found, name, target(tmp_path, name), radius=0.003)


def test_frames_of_one_name_do_not_overwrite_each_other(tmp_path):
    with refuses("frame-names-clash"):
        doo3d.export([doo3d.Detection((helix(),)), doo3d.Detection((helix(),))], "mjcf", tmp_path / "x")


def test_only_detections_are_exported(tmp_path):
    with refuses("argument-type", "Chain"):
        doo3d.export([helix()], "npz", tmp_path / "a.npz")


def test_the_command_takes_results(doo3d, results, tmp_path):
    results(capture())
    assert doo3d("export", "out", "--to", "npz") == (0, f"1 file -> {tmp_path / 'out.npz'}\n", "")
    assert len(np.load("out.npz")["joints"]) == 65
    code, out, err = doo3d("export", "out", "--to", "mjcf", "--set", "ground=true")
    assert (code, out) == (0, f"3 files -> {tmp_path / 'out_mjcf'}\n")
    assert err.startswith("doo3d: note: frame 000000: neither a plane")
    assert "ground" in (tmp_path / "out_mjcf" / "000000.xml").read_text()
    assert doo3d("export", "out", "--to", "nodes", "--frame", "000002", "--count", "9", "-o", "start.npy")[0] == 0
    assert np.load("start.npy").shape == (9, 3)
    assert doo3d("export", "out", "--to", "csv", "--frame", "000002", "--pose", "-1,0,0,0,0,0,1", "-o", "moved.csv")[0] == 0
    assert (tmp_path / "moved.csv").read_text().splitlines()[1].split(",")[8] == repr(0.1 - 1)


@pytest.mark.parametrize(
    ("args", "code", "part"),
    [
        ((), "option-missing", "--to FORMAT"),
        (("out",), "option-missing", "--to FORMAT"),
        (("out", "--to", "dxf"), "format-unknown", "dxf"),
        (("nowhere", "--to", "npz"), "results-missing", "nowhere"),
        (("out", "--to", "npz", "--frame", "9"), "frame-unknown", "000000, 000001, 000002"),
        (("out", "--to", "npz", "--pose", "0,0,0,0,0,0,2"), "pose-invalid", "0,0,0,0,0,0,2"),
        (("out", "--to", "npz", "--count", "3"), "key-unknown", "count"),
        (("out", "--to", "mjcf", "--set", "density"), "override-invalid", "density"),
    ],
)
def test_the_command_refuses_in_a_sentence(doo3d, results, tmp_path, args, code, part):
    results(capture())
    before = sorted(os.listdir(tmp_path))
    status, out, err = doo3d("export", *args)
    assert (status, out) == (2, "")
    assert err.startswith("doo3d: ")
    assert err.count("\n") == 1
    assert code_in(err) == code
    assert part in err
    assert sorted(os.listdir(tmp_path)) == before


def test_the_list_names_every_format_and_option(doo3d):
    code, out, _ = doo3d("export", "--list")
    assert code == 0
    for name in FORMATS:
        kind = export_class(name)
        assert f"{name:<6} {kind.summary}" in out
        assert all(f"  {key}" in out for key in kind.model_fields)
