import numpy as np
import pytest
from builders.chains import capture, flat
from builders.errors import refuses
from scipy.spatial.transform import Rotation

import doo3d
from doo3d.inputs.support.pose_file import read_pose

TURN = Rotation.from_euler("xyz", [0.3, -1.1, 2.0])
POSE = np.eye(4)
POSE[:3, :3], POSE[:3, 3] = TURN.as_matrix(), (1.0, -2.0, 0.5)
SEVEN = [1.0, -2.0, 0.5, *TURN.as_quat()]


@pytest.fixture(params=["matrix", "nested lists", "seven", "text", "file", "file of seven", "npy", "path"])
def given(request, tmp_path):
    np.savetxt(tmp_path / "pose.txt", POSE)
    np.savetxt(tmp_path / "seven.csv", [SEVEN], delimiter=",")
    np.save(tmp_path / "pose.npy", POSE)
    return {
        "matrix": POSE,
        "nested lists": POSE.tolist(),
        "seven": SEVEN,
        "text": ",".join(map(str, SEVEN)),
        "file": str(tmp_path / "pose.txt"),
        "file of seven": str(tmp_path / "seven.csv"),
        "npy": tmp_path / "pose.npy",
        "path": tmp_path / "pose.txt",
    }[request.param]


def test_however_it_is_written(given):
    np.testing.assert_allclose(read_pose(given), POSE, atol=1e-12)


def test_chains_move_with_it_and_keep_their_segments():
    frame = capture()[0]
    found = frame.transformed(read_pose(POSE))
    assert found.coordinates == "world"
    for before, after in zip(frame.chains, found.chains, strict=True):
        np.testing.assert_allclose(after.joints, before.joints @ POSE[:3, :3].T + POSE[:3, 3], atol=1e-12)
        np.testing.assert_array_equal(after.occluded, before.occluded)
        assert after.id == before.id
    assert found.timestamp == frame.timestamp


def test_a_rotation_with_few_digits_becomes_exact():
    rounded = read_pose(np.round(POSE, 4))
    np.testing.assert_allclose(rounded[:3, :3] @ rounded[:3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(rounded, POSE, atol=2e-4)
    np.testing.assert_allclose(read_pose(np.round(SEVEN, 4)), POSE, atol=3e-4)


@pytest.mark.parametrize(
    ("pose", "code", "parts"),
    [
        (np.diag([1.0, 1, -1, 1]), "pose-invalid", ()),
        (np.diag([2.0, 2, 2, 1]), "pose-invalid", ("2, 2, 2",)),
        (np.diag([1000.0, 1000, 1000, 1]), "pose-invalid", ("1000, 1000, 1000",)),
        (np.zeros((4, 4)), "pose-invalid", ("0.0, 0.0, 0.0, 0.0",)),
        (POSE.T, "pose-invalid", ("0 0 0 1",)),
        ("0,0,0,1,1,0,0", "pose-invalid", ("qx,qy,qz,qw", "1.41421")),
        ("0,0,0,0,0,0,0", "pose-invalid", ("qx,qy,qz,qw", "length 0")),
        ("1,2,3", "pose-invalid", ("3 numbers",)),
        ("1,2,x,0,0,0,1", "pose-invalid", ("1,2,x,0,0,0,1",)),
        ("1,2,nan,0,0,0,1", "pose-invalid", ("1,2,nan,0,0,0,1",)),
        ("nowhere.txt", "file-missing", ("nowhere.txt",)),
        (np.eye(3), "pose-invalid", ("9 numbers",)),
    ],
)
def test_an_invalid_pose_is_refused(pose, code, parts):
    with refuses(code, *parts):
        read_pose(pose)


@pytest.mark.parametrize(
    ("name", "data"), [("a.npy", b"no array"), ("a.txt", b"\xff\xfe\x00"), ("b.txt", b"1 0 0\n"), ("c.npy", b"")]
)
def test_a_broken_file_is_named(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with refuses("pose-invalid", name):
        read_pose(tmp_path / name)


def test_pixels_do_not_move(tmp_path):
    with refuses("results-2d", "photo"):
        doo3d.export(flat(), "csv", tmp_path / "a.csv", pose=np.eye(4))
