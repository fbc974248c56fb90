"""NPZ, CSV, SWC and nodes: what is read back is what was found."""

import csv
import dataclasses
import itertools
import json

import numpy as np
import pytest
from builders.chains import capture, flat, helix, ring
from builders.errors import refuses

import doo3d
from doo3d.inputs.support.open3d import open3d


def split(values, offsets):
    return [values[a:b] for a, b in itertools.pairwise(offsets)]


@pytest.mark.parametrize("frames", [capture(), [flat()], [doo3d.Detection((ring(), helix(1)), frame="no stamp")]])
def test_npz_bit_for_bit(tmp_path, frames):
    file = np.load(doo3d.export(frames, "npz", tmp_path / "all.npz")[0])
    chains = [chain for frame in frames for chain in frame.chains]
    assert file["frames"].tolist() == [frame.frame for frame in frames]
    np.testing.assert_array_equal(file["stamps"], [np.nan if f.timestamp is None else f.timestamp for f in frames])
    assert np.diff(file["chain_offsets"]).tolist() == [len(frame.chains) for frame in frames]
    joints, radii = (split(file[name], file["joint_offsets"]) for name in ("joints", "radii"))
    occluded = split(file["occluded"], file["segment_offsets"])
    assert len(joints) == len(occluded) == len(chains)
    assert ("depth_filled" in file) == (frames[0].mode == "3d")
    filled = split(file["depth_filled"] if "depth_filled" in file else file["occluded"], file["segment_offsets"])
    for i, chain in enumerate(chains):
        assert joints[i].tobytes() == chain.joints.tobytes()
        assert radii[i].tobytes() == chain.radii.tobytes()
        assert occluded[i].tolist() == chain.occluded.tolist()
        assert filled[i].tolist() == chain.depth_filled.tolist()
        if chain.deviations is not None:
            first, end = file["joint_offsets"][i : i + 2]
            assert file["deviations"][first:end].tobytes() == chain.deviations.tobytes()
        assert file["ids"][i] == (-1 if chain.id is None else chain.id)
        assert (file["radius"][i], file["segment_length"][i]) == (chain.radius, chain.segment_length)
        assert (file["closed"][i], file["confidence"][i]) == (chain.closed, chain.confidence)
    assert str(file["units"]) == ("px" if frames[0].mode == "2d" else "m")


@pytest.mark.parametrize("frames", [capture(), [flat()], [doo3d.Detection((helix(), ring()), frame='a, "b"')]])
def test_csv_bit_for_bit(tmp_path, frames):
    path = doo3d.export(frames, "csv", tmp_path / "all.csv")[0]
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(chain.joints) for frame in frames for chain in frame.chains)
    for frame in frames:
        for number, chain in enumerate(frame.chains):
            own = [row for row in rows if row["frame"] == frame.frame and row["chain"] == str(number)]
            axes = "xy" if frame.mode == "2d" else "xyz"
            np.testing.assert_array_equal([[float(row[axis]) for axis in axes] for row in own], chain.joints)
            np.testing.assert_array_equal([float(row["radius"]) for row in own], chain.radii)
            assert [row["joint"] for row in own] == [str(k) for k in range(len(own))]
            assert [row["occluded"] for row in own] == [*(str(int(hidden)) for hidden in chain.occluded), ""]
            if frame.mode == "3d":
                assert [row["depth"] for row in own] == [*chain.depth, ""]
                known = [[row[name] for row in own] for name in ("deviation_across", "deviation_along")]
                expected = (
                    [[""] * len(own)] * 2
                    if chain.deviations is None
                    else [list(map(repr, row)) for row in chain.deviations.T.tolist()]
                )
                assert known == expected
            else:
                assert "depth" not in own[0]
            for row in own:
                assert row["id"] == ("" if chain.id is None else str(chain.id))
                assert row["closed"] == str(int(chain.closed))
                assert float(row["segment_length"]) == chain.segment_length
                assert row["timestamp"] == ("" if frame.timestamp is None else repr(frame.timestamp))


def read_swc(path):
    return np.array([line.split() for line in path.read_text().splitlines() if not line.startswith("#")], dtype=float).reshape(
        -1, 7
    )


@pytest.mark.parametrize("frame", [capture()[0], flat(), doo3d.Detection((ring(), helix(1)))])
def test_swc_is_a_tree_per_chain(tmp_path, frame):
    rows = read_swc(doo3d.export(frame, "swc", tmp_path / "skeleton.swc")[0])
    assert rows[:, 0].tolist() == list(range(1, len(rows) + 1))
    assert (rows[:, 6] < rows[:, 0]).all()
    roots = np.flatnonzero(rows[:, 6] == -1)
    assert len(roots) == len(frame.chains)
    for chain, own in zip(frame.chains, np.split(rows, roots[1:]), strict=True):
        at = np.pad(chain.joints, ((0, 0), (0, 3 - chain.joints.shape[1])))
        np.testing.assert_array_equal(own[:, 2:5], at)
        np.testing.assert_array_equal(own[:, 5], chain.radii)
        np.testing.assert_array_equal(own[1:, 6], own[:-1, 0])
        np.testing.assert_array_equal(own[1:, 1] == 5, chain.occluded)


def test_swc_in_micrometres(tmp_path):
    rows = read_swc(doo3d.export(capture()[0], "swc", tmp_path / "skeleton.swc", scale=1e6)[0])
    np.testing.assert_allclose(rows[:26, 2:5], helix().joints * 1e6)
    np.testing.assert_allclose(rows[:26, 5], helix().radii * 1e6)


def test_nodes_of_each_kind_are_the_same_points(tmp_path):
    frames = capture()
    for kind in ("npy", "pcd", "json"):
        paths = doo3d.export(frames, "nodes", tmp_path, count=20, file=kind)
        assert [path.name for path in paths] == [f"{name}.{kind}" for name in ("000000_0", "000000_3", "000001", "000002_0")]
    for stem, chain in (("000000_0", frames[0].chains[0]), ("000000_3", frames[0].chains[1]), ("000002_0", frames[2].chains[0])):
        points = np.load(tmp_path / f"{stem}.npy")
        np.testing.assert_array_equal(points, chain.nodes(20))
        document = json.loads((tmp_path / f"{stem}.json").read_text())
        np.testing.assert_array_equal(document["nodes"], points)
        assert document["edges"] == [[k, k + 1] for k in range(19)]
        cloud = np.asarray(open3d().io.read_point_cloud(str(tmp_path / f"{stem}.pcd")).points)
        np.testing.assert_allclose(cloud, points, atol=1e-7)
    assert np.load(tmp_path / "000001.npy").shape == (0, 3)


def test_nodes_of_one_chain_in_one_file(tmp_path):
    path = doo3d.export(capture()[2], "nodes", tmp_path / "start.npy", count=7)[0]
    np.testing.assert_array_equal(np.load(path), capture()[2].chains[0].nodes(7))
    with refuses("out-needs-folder", "both.npy"):
        doo3d.export(capture()[0], "nodes", tmp_path / "both.npy")


def thrown(stamps):
    """Return frames of a chain that flies on a parabola, at 30 frames/s if there are no stamps."""
    frames = []
    for k, stamp in enumerate(stamps):
        time, chain = k / 30 if stamp is None else stamp, helix(id=0, from_time=np.arange(25) % 5 == 3)
        moved = chain.joints + np.array((1.0, 0.5, 2.0)) * time + np.array((0, 0, -9.81)) * time**2 / 2
        frames.append(doo3d.Detection((dataclasses.replace(chain, joints=moved),), frame=f"{k}", timestamp=stamp))
    return frames


def motions(file):
    return [np.reshape(file[name], (-1, 26, 3)) for name in ("velocities", "accelerations")]


def test_velocity_and_acceleration_over_uneven_times(tmp_path):
    stamps = [0.0, 0.03, 0.08, 0.1, 0.15]
    file = np.load(doo3d.export(thrown(stamps), "npz", tmp_path / "all.npz")[0])
    for values, true in zip(motions(file), ([(1, 0.5, 2 - 9.81 * time) for time in stamps], [(0, 0, -9.81)] * 5), strict=True):
        assert np.isnan(values[[0, -1]]).all()
        np.testing.assert_allclose(values[1:-1], np.broadcast_to(np.array(true)[1:-1, None], (3, 26, 3)), atol=1e-9)
    assert file["from_time"].tolist() == (np.arange(25) % 5 == 3).tolist() * 5


def test_motion_is_unknown_unless_both_neighbors_have_the_chain(tmp_path):
    for k, other in enumerate(({"id": None}, {"id": 1}, "shorter", "missing")):
        frames = thrown([0.0, 0.1, 0.2])
        if isinstance(other, dict):
            chains = (dataclasses.replace(frames[0].chains[0], **other),)
        else:
            chains = (helix(24, id=0),) if other == "shorter" else ()
        frames[0] = dataclasses.replace(frames[0], chains=chains)
        file = np.load(doo3d.export(frames, "npz", tmp_path / f"{k}.npz")[0])
        assert np.isnan(file["velocities"]).all()
        assert file["velocities"].shape == file["joints"].shape
    for k, stamps in enumerate(([0.0, 0.2, 0.2], [0.0, None, 0.2])):
        file = np.load(doo3d.export(thrown(stamps), "npz", tmp_path / f"times{k}.npz")[0])
        assert np.isnan(file["velocities"]).all()
    rings = [doo3d.Detection((dataclasses.replace(ring(), id=0),), frame=f"{k}", timestamp=k / 30) for k in range(3)]
    assert np.isnan(np.load(doo3d.export(rings, "npz", tmp_path / "rings.npz")[0])["velocities"]).all()


def test_rate_stands_in_for_timestamps(tmp_path):
    frames = thrown([None, None, None])
    file = np.load(doo3d.export(frames, "npz", tmp_path / "all.npz", rate=30)[0])
    np.testing.assert_allclose(motions(file)[1][1], np.broadcast_to((0, 0, -9.81), (26, 3)), atol=1e-9)


def test_csv_has_the_motion_too(tmp_path):
    frames = thrown([0.0, 0.03, 0.08])
    file = np.load(doo3d.export(frames, "npz", tmp_path / "all.npz")[0])
    with doo3d.export(frames, "csv", tmp_path / "all.csv")[0].open(newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert {rows[k][name] for k in (0, -1) for name in ("vx", "az")} == {""}
    for letter, name in (("v", "velocities"), ("a", "accelerations")):
        np.testing.assert_array_equal([[float(row[letter + axis]) for axis in "xyz"] for row in rows[26:52]], file[name][26:52])
    assert [row["from_time"] for row in rows[:26]] == [*("01"[k % 5 == 3] for k in range(25)), ""]


@pytest.mark.parametrize("name", ["=cmd", "+1", "-1", "@SUM(A1)", "\tx"])
@pytest.mark.parametrize("table", ["joints", "nodes", "edges"])
def test_no_cell_of_a_csv_is_run_by_a_spreadsheet(tmp_path, name, table):
    path = doo3d.export([dataclasses.replace(flat(), frame=name)], "csv", tmp_path / "all.csv", table=table)[0]
    with path.open(newline="", encoding="utf-8") as file:
        assert {row["frame"] for row in csv.DictReader(file)} == {f"'{name}"}
