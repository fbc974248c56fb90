"""LAS, LAZ and E57, folders of clouds, viewpoints."""

from __future__ import annotations

import pickle
import struct
from pathlib import Path

import laspy
import numpy as np
import pye57
import pytest
from builders.captures import cut
from builders.errors import refused, refuses

from doo3d import errors
from doo3d.errors import InputError, MissingDependency
from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.formats import cloud
from doo3d.inputs.formats._laser_scans import count_e57, read_e57

COUNT = 400
UTM = np.array((450123.25, 5412345.5, 210.125))
TURN = np.array((0.5, 0.5, 0.5, 0.5))  # w x y z: x to y, y to z, z to x


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(0.2, 1.0, (COUNT, 3))


@pytest.fixture
def colors():
    return np.random.default_rng(1).integers(0, 256, (COUNT, 3), dtype=np.uint8)


def write_las(path: Path, points, colors=None, widen=257, step=0.0001, kind=2, version="1.2") -> Path:
    header = laspy.LasHeader(point_format=kind, version=version)
    header.scales, header.offsets = np.full(3, step), np.floor(points.min(axis=0))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    if colors is not None:
        las.red, las.green, las.blue = colors.T.astype(np.uint16) * widen
    las.write(str(path))
    return path


def write_e57(path: Path, *scans) -> Path:
    """Write scans, each (points, colors or None, rotation w x y z, translation)."""
    with pye57.E57(str(path), mode="w") as file:
        for points, colors, rotation, translation in scans:
            data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T, strict=True))
            if colors is not None:
                data |= dict(zip(("colorRed", "colorGreen", "colorBlue"), colors.T, strict=True))
            file.write_scan_raw(data, rotation=np.asarray(rotation), translation=np.asarray(translation))
    return path


def clouds(path: Path) -> dict:
    opened = open_capture(path)
    assert opened.format == "cloud"
    return {frame_ref.name: pickle.loads(pickle.dumps(frame_ref)).load().data for frame_ref in opened.frames}


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize(("kind", "version"), [(2, "1.2"), (3, "1.3"), (7, "1.4")])
def test_las_keeps_large_coordinates_to_its_resolution(tmp_path, points, colors, suffix, kind, version):
    (cloud,) = clouds(write_las(tmp_path / f"a.{suffix}", points + UTM, colors, kind=kind, version=version)).values()
    assert np.abs(cloud.points - (points + UTM)).max() < 0.00005 + 1e-8
    assert np.array_equal(cloud.colors, colors)
    assert cloud.viewpoint is None


@pytest.mark.parametrize("widen", [1, 256, 257])
def test_las_colors_of_every_writer(tmp_path, points, colors, widen):
    (cloud,) = clouds(write_las(tmp_path / "a.las", points, colors, widen)).values()
    assert np.array_equal(cloud.colors, colors)


def test_las_without_colors(tmp_path, points):
    write_las(tmp_path / "a.las", points, kind=0)
    write_las(tmp_path / "b.las", points, kind=2)  # there is room for colors, all zero
    assert all(cloud.colors is None for cloud in clouds(tmp_path).values())


def test_e57_scans_are_frames_transformed_by_their_poses(tmp_path, points, colors):
    path = write_e57(tmp_path / "site.e57", (points, colors, TURN, UTM), (points, None, (1, 0, 0, 0), (0, 0, 2)))
    found = clouds(path)
    assert list(found) == ["site_000", "site_001"]
    first, second = found.values()
    assert np.abs(first.points - (points[:, [2, 0, 1]] + UTM)).max() < 1e-7  # written in single precision
    assert np.array_equal(first.colors, colors)
    assert first.viewpoint.tolist() == UTM.tolist()
    assert np.abs(second.points - points - (0, 0, 2)).max() < 1e-7
    assert second.colors is None
    assert second.viewpoint.tolist() == [0, 0, 2]


def test_e57_with_the_identity_as_pose_has_no_viewpoint(tmp_path, points):
    path = write_e57(tmp_path / "a.e57", (points, None, (1, 0, 0, 0), (0, 0, 0)))
    ((name, cloud),) = clouds(path).items()
    assert name == "a"
    assert cloud.viewpoint is None


def e57_of(path: Path, fields, limits=None) -> Path:
    """Write a scan with any fields: name -> (values, node type, arguments of its prototype)."""
    library = pye57.libe57
    file = pye57.E57(str(path), mode="w")
    image = file.image_file
    scan, prototype = library.StructureNode(image), library.StructureNode(image)
    count = len(next(iter(fields.values()))[0])
    buffers = library.VectorSourceDestBuffer()
    for name, (values, kind, arguments) in fields.items():
        prototype.set(name, getattr(library, kind)(image, *arguments))
        buffers.append(library.SourceDestBuffer(image, name, values, count, True, True))
    if limits:
        node = library.StructureNode(image)
        for end, value in limits.items():
            node.set(f"colorRed{end}", library.IntegerNode(image, value))
        scan.set("colorLimits", node)
    held = library.CompressedVectorNode(image, prototype, library.VectorNode(image, True))
    scan.set("points", held)
    file.data3d.append(scan)
    writer = held.writer(buffers)
    writer.write(count)
    writer.close()
    file.close()
    return path


def test_e57_in_spherical_coordinates_without_invalid_points(tmp_path, points):
    distance = np.linalg.norm(points, axis=1)
    invalid = (np.arange(COUNT) % 7 == 0).astype(np.int8)
    fields = {
        "sphericalRange": (distance, "FloatNode", ()),
        "sphericalAzimuth": (np.arctan2(points[:, 1], points[:, 0]), "FloatNode", ()),
        "sphericalElevation": (np.arcsin(points[:, 2] / distance), "FloatNode", ()),
        "sphericalInvalidState": (invalid, "IntegerNode", (0, 0, 2)),
    }
    (cloud,) = clouds(e57_of(tmp_path / "a.e57", fields)).values()
    assert np.abs(cloud.points - points[invalid == 0]).max() < 1e-12


@pytest.mark.parametrize("limits", [None, {"Minimum": 0, "Maximum": 65535}])
def test_e57_colors_of_16_bits(tmp_path, points, colors, limits):
    fields = {f"cartesian{axis}": (points[:, i].copy(), "FloatNode", ()) for i, axis in enumerate("XYZ")}
    for i, name in enumerate(("Red", "Green", "Blue")):
        fields[f"color{name}"] = (colors[:, i].astype(np.float64) * 257, "IntegerNode", (0, 0, 65535))
    (cloud,) = clouds(e57_of(tmp_path / "a.e57", fields, limits)).values()
    assert np.array_equal(cloud.colors, colors)


def test_an_e57_is_opened_once_for_all_of_its_scans(tmp_path, points, monkeypatch):
    path = tmp_path / "a.e57"
    write_e57(path, *[(points, None, (1, 0, 0, 0), (0, 0, 0))] * 3)
    opened = []
    open_file = pye57.libe57.ImageFile
    monkeypatch.setattr(pye57.libe57, "ImageFile", lambda *args: opened.append(args) or open_file(*args))
    assert count_e57(path) == 3
    assert [len(read_e57(path, scan).points) for scan in range(3)] == [len(points)] * 3
    assert len(opened) == 1


def test_e57_without_scans(tmp_path):
    refused(write_e57(tmp_path / "a.e57"), "file-empty", "a.e57", "no scans")


def test_e57_without_coordinates(tmp_path):
    path = e57_of(tmp_path / "a.e57", {"intensity": (np.ones(3), "FloatNode", ())})
    with refuses("points-missing", "a.e57"):
        clouds(path)


# --- a folder of clouds ------------------------------------------------------------------------------------------------


def test_folder_of_all_formats(tmp_path, points, colors):
    np.savez(tmp_path / "scan10.npz", points=points, colors=colors)
    np.savetxt(tmp_path / "scan9.xyz", points)
    write_las(tmp_path / "scan2.laz", points)
    write_e57(tmp_path / "scan1.e57", (points, None, TURN, UTM), (points, None, TURN, UTM))
    (tmp_path / "truth.json").write_text("{}")
    (tmp_path / ".scan3.xyz").write_text("1 2 3")
    found = clouds(tmp_path)
    assert list(found) == ["scan1_000", "scan1_001", "scan2", "scan9", "scan10"]
    assert all(len(cloud.points) == COUNT for cloud in found.values())
    assert [cloud.name for cloud in found.values()] == list(found)


def test_damaged_file_of_a_folder_fails_alone(tmp_path, points):
    np.savetxt(tmp_path / "1.xyz", points)
    (tmp_path / "2.e57").write_bytes(b"ASTM-E57 and no more")
    (tmp_path / "3.las").write_bytes(b"")
    (tmp_path / "4.ply").write_text("no cloud")
    good, *bad = open_capture(tmp_path).frames
    assert len(good.load().data.points) == COUNT
    assert [frame.name for frame in bad] == ["2", "3", "4"]
    for frame, code, file in zip(bad, ("file-damaged", "file-empty", "file-damaged"), ("2.e57", "3.las", "4.ply"), strict=True):
        with refuses(code, file):
            frame.load()


def test_two_files_of_one_stem(tmp_path, points):
    np.savetxt(tmp_path / "a.xyz", points)
    np.savez(tmp_path / "a.npz", points=points)
    refused(tmp_path, "names-clash", "a.npz, a.xyz")


def test_npz_of_other_formats_make_no_folder_of_clouds(tmp_path):
    np.savez(tmp_path / "a.npz", depth=np.ones((3, 3)))
    refused(tmp_path, "folder-of-captures", "a.npz")


# --- viewpoint of a PCD ------------------------------------------------------------------------------------------------

PCD = """# .PCD v.7
VERSION .7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH 2
HEIGHT 1
{}POINTS 2
DATA ascii
0.1 0.2 0.3
0.4 0.5 0.6
"""


@pytest.mark.parametrize(
    ("line", "viewpoint"),
    [
        ("VIEWPOINT 1 -2.5 3e-1 0.5 0.5 0.5 0.5\n", [1, -2.5, 0.3]),
        ("VIEWPOINT 0 0 0 0 1 0 0\n", [0, 0, 0]),
        ("VIEWPOINT 0 0 0 1 0 0 0\n", None),
        ("", None),
    ],
)
def test_viewpoint_of_a_pcd(tmp_path, line, viewpoint):
    path = tmp_path / "a.pcd"
    path.write_text(PCD.format(line))
    (cloud,) = clouds(path).values()
    assert (None if cloud.viewpoint is None else cloud.viewpoint.tolist()) == viewpoint


@pytest.mark.parametrize("values", ["1 2 3", "a b c d e f g", "nan 0 0 1 0 0 0"])
def test_invalid_viewpoint(tmp_path, values):
    path = tmp_path / "a.pcd"
    path.write_text(PCD.format(f"VIEWPOINT {values}\n"))
    with refuses("viewpoint-invalid", "a.pcd", repr(values)):
        clouds(path)


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kept", [0.0, 0.001, 0.02, 0.1, 0.5, 0.9, 0.998])
@pytest.mark.parametrize("suffix", ["las", "laz", "e57"])
def test_truncated(tmp_path, points, colors, suffix, kept, capfd):
    path = tmp_path / f"a.{suffix}"
    if suffix == "e57":
        write_e57(path, (points, colors, TURN, UTM))
    else:
        write_las(path, points, colors)
    cut(path, kept)
    capfd.readouterr()
    with pytest.raises(InputError) as caught:
        clouds(path)
    assert caught.value.code == ("file-damaged" if path.stat().st_size else "file-empty")
    assert path.name in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_las_truncated_between_two_points(tmp_path, points):
    path = write_las(tmp_path / "a.las", points)
    path.write_bytes(path.read_bytes()[: -10 * 26])
    with refuses("file-damaged", "a.las", f"{COUNT} points", str(COUNT - 10)):
        clouds(path)


@pytest.mark.parametrize(("version", "kind", "at"), [("1.2", 2, 100), ("1.4", 7, 100), ("1.4", 7, 243)])
@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_las_that_declares_billions_of_records(tmp_path, points, suffix, version, kind, at):
    path = write_las(tmp_path / f"a.{suffix}", points, kind=kind, version=version)
    data = bytearray(path.read_bytes())
    data[at : at + 4] = b"\xff" * 4
    path.write_bytes(data)
    with refuses("file-damaged", f"a.{suffix}", "4294967295"):
        clouds(path)


@pytest.mark.parametrize("at", [100, 1500, -300])
def test_a_damaged_e57(tmp_path, points, colors, at):
    path = write_e57(tmp_path / "a.e57", (points, colors, TURN, UTM))
    data = bytearray(path.read_bytes())
    data[at] ^= 0xFF
    path.write_bytes(data)
    with refuses("file-damaged", "a.e57"):
        clouds(path)


def test_a_las_without_points(tmp_path):
    path = write_las(tmp_path / "a.las", np.zeros((1, 3)))
    laspy.LasData(laspy.LasHeader(point_format=2, version="1.2")).write(str(path))
    with refuses("cloud-empty", "a.las"):
        clouds(path)


@pytest.mark.parametrize(("suffix", "module"), [("las", "laspy"), ("laz", "lazrs"), ("e57", "pye57")])
def test_missing_package(tmp_path, points, suffix, module, monkeypatch):
    path = tmp_path / f"a.{suffix}"
    if suffix == "e57":
        write_e57(path, (points, None, TURN, UTM))
    else:
        write_las(path, points)
    found = errors.importlib.import_module

    def refuse(name, *rest):
        if name == module:
            raise ImportError(f"No module named {name!r}")
        return found(name, *rest)

    monkeypatch.setattr(errors.importlib, "import_module", refuse)
    monkeypatch.setattr(cloud, "isolated", lambda function, *args, where: function(*args))
    with pytest.raises(MissingDependency, match=rf"pip install 'doo3d\[{suffix.replace('laz', 'las')}\]'"):
        clouds(path)


FEET = 'PROJCS["ftUS",GEOGCS["NAD83",UNIT["degree",0.0174532925199433]],UNIT["US survey foot",0.304800609601219]]'
HEIGHTS_IN_METRES = f'COMPD_CS["both",{FEET},VERT_CS["NAVD88",UNIT["metre",1.0]]]'
FEET_2 = (
    'PROJCRS["ft",BASEGEOGCRS["a",ELLIPSOID["b",6378137,298,LENGTHUNIT["metre",1]]],CS[Cartesian,2],LENGTHUNIT["foot",0.3048]]'
)
METRES = 'PROJCS["UTM",GEOGCS["WGS 84",UNIT["degree",0.0174532925199433]],UNIT["metre",1]]'


def write_classified(path: Path, points, classes, wkt: str | None = None, unit_key: int | None = None) -> Path:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.0001)
    if wkt is not None:
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
    if unit_key is not None:
        words = struct.pack("<8H", 1, 1, 0, 1, 3076, 0, 1, unit_key)
        header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", words))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.classification = classes
    las.write(str(path))
    return path


@pytest.mark.parametrize(
    ("declared", "units"),
    [
        ({"wkt": FEET}, (1200 / 3937, 1200 / 3937, 1200 / 3937)),
        ({"wkt": HEIGHTS_IN_METRES}, (1200 / 3937, 1200 / 3937, 1)),
        ({"wkt": FEET_2}, (0.3048, 0.3048, 0.3048)),
        ({"unit_key": 9003}, (1200 / 3937, 1200 / 3937, 1200 / 3937)),
        ({"unit_key": 9001}, (1, 1, 1)),
        ({"wkt": METRES}, (1, 1, 1)),
        ({}, (1, 1, 1)),
    ],
)
def test_las_in_the_unit_that_it_declares(tmp_path, points, declared, units):
    path = write_classified(tmp_path / "a.las", points, np.zeros(len(points), np.uint8), **declared)
    data = open_capture(path)[0].load().data
    assert data.points == pytest.approx(points * units, abs=2e-4)
    assert ["foot" in note for note in data.notes] == [True] * (units[0] != 1)
    given = open_capture(path, options=ReadOptions(depth_scale=2))[0].load().data
    assert given.points == pytest.approx(points / 2, abs=2e-4)


def test_las_classes(tmp_path, points):
    classes = np.full(len(points), 2, np.uint8)
    classes[:7], classes[7:9] = 14, 13
    path = write_classified(tmp_path / "a.las", points, classes)

    def read(classification=None):
        return open_capture(path, options=ReadOptions(classification=classification))[0].load().data

    assert len(read().points) == 9
    assert "only the 9 of class 13 and 14, wires, are read" in read().notes[0]
    assert [len(read(each).points) for each in (13, (2, 14))] == [2, len(points) - 2]
    assert read(14).notes == ()
    with pytest.raises(InputError, match="no point is of class 6, only of 2, 13, 14"):
        read(6)
    all_wires = write_classified(tmp_path / "b.las", points, np.full(len(points), 14, np.uint8))
    assert open_capture(all_wires)[0].load().data.notes == ()
