"""Branched objects as trees and graphs: simulators, SWC, GraphML, arrays and tables."""

import csv
import dataclasses
import json
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
import pytest
from builders.drawn_masks import line
from builders.scenes import empty_scene
from builders.simulation import joints_of, mujoco_state

import doo3d
from doo3d.exports.overlaps import CONTACT_FREE_RADII, overlapping_bodies
from doo3d.exports.trees import grown
from doo3d.geometry.equal_segments import equal_segments
from doo3d.links.branches import find_branches
from doo3d.types import Chain, ChainEnd, Detection

STEP = 0.01


def chain(start, end, radius=0.005):
    return Chain(equal_segments(line(start, end), STEP), STEP, radius)


@pytest.fixture
def harness():
    """A trunk with a branch on either side, and a cable of its own."""
    strands = [
        chain([-0.15, 0.0, 0.5], [0.15, 0.0, 0.5]),
        chain([-0.05, 0.012, 0.5], [-0.02, 0.12, 0.5], 0.003),
        chain([0.04, -0.12, 0.5], [0.05, -0.012, 0.5], 0.003),
        chain([-0.1, 0.3, 0.5], [0.1, 0.3, 0.5]),
    ]
    found = find_branches(strands, empty_scene(segment_length=STEP, radius=0.005, merge__branches=True))
    assert [len(each.chains) for each in found.objects] == [5, 1]
    return Detection(tuple(found.chains), coordinates="world", junctions=found.junctions, objects=found.objects)


@pytest.fixture
def acute():
    """A branch that leaves its trunk at 10 degrees, so that both overlap far beyond the junction, and a trunk of 5 m."""
    return found_in([-0.3, 0.0, 0.5], [4.7, 0.0, 0.5], ([0.012, 0.004, 0.5], [0.20, 0.037, 0.5]))


def found_in(start, end, *branches):
    strands = [chain(start, end), *(chain(*branch, 0.004) for branch in branches)]
    found = find_branches(strands, empty_scene(segment_length=STEP, radius=0.005, merge__branches=True))
    assert found.junctions
    return Detection(tuple(found.chains), coordinates="world", junctions=found.junctions, objects=found.objects)


def test_swc_is_a_tree_per_object(harness, tmp_path):
    doo3d.export([harness], "swc", tmp_path / "a.swc")
    rows = np.array([row.split() for row in (tmp_path / "a.swc").read_text().splitlines() if row[0] != "#"], dtype=float)
    assert (rows[:, 6] == -1).sum() == 2
    assert (rows[:, 6] < rows[:, 0]).all()
    parents = rows[rows[:, 6] > 0, 6]
    assert (np.bincount(parents.astype(int)) > 1).sum() == 2
    step = np.linalg.norm(rows[rows[:, 6] > 0, 2:5] - rows[parents.astype(int) - 1, 2:5], axis=1)
    assert step.max() < 1.5 * STEP


def test_graphml(harness, tmp_path):
    doo3d.export([harness], "graphml", tmp_path / "a.graphml")
    space = "{http://graphml.graphdrawing.org/xmlns}"
    root = ElementTree.parse(tmp_path / "a.graphml").getroot()
    kinds = [node.find(f"{space}data[@key='node_kind']").text for node in root.iter(f"{space}node")]
    assert (kinds.count("junction"), kinds.count("tip")) == (2, 6)
    assert len(list(root.iter(f"{space}edge"))) == 6


def test_arrays_and_tables(harness, tmp_path):
    doo3d.export([harness, harness], "npz", tmp_path / "a.npz")
    values = np.load(tmp_path / "a.npz")
    assert values["node_offsets"].tolist() == [0, 8, 16]
    assert values["edges"].shape == (12, 2)
    assert values["edges"][6:].min() == 8
    for row, (first, last) in enumerate(values["edges"]):
        start, stop = values["joint_offsets"][row : row + 2]
        assert np.linalg.norm(values["nodes"][first] - values["joints"][start]) <= STEP / 2
        assert np.linalg.norm(values["nodes"][last] - values["joints"][stop - 1]) <= STEP / 2
    doo3d.export([harness], "csv", tmp_path / "nodes.csv", table="nodes")
    doo3d.export([harness], "csv", tmp_path / "edges.csv", table="edges")
    assert len((tmp_path / "nodes.csv").read_text().splitlines()) == 9
    rows = csv.DictReader((tmp_path / "edges.csv").read_text().splitlines())
    assert {row["object"] for row in rows} == {"0", "1"}


def test_without_branches_arrays_have_no_graph(harness, tmp_path):
    doo3d.export([Detection(harness.chains)], "npz", tmp_path / "a.npz")
    assert "edges" not in np.load(tmp_path / "a.npz")


def test_urdf_is_one_tree(harness, tmp_path):
    with pytest.warns(doo3d.errors.DooWarning, match="74 segments would make 224 joints"):
        doo3d.export([harness], "urdf", tmp_path / "a.urdf")
    root = ElementTree.parse(tmp_path / "a.urdf").getroot()
    links = {link.get("name") for link in root.findall("link")}
    children = [joint.find("child").get("link") for joint in root.findall("joint")]
    assert len(children) == len(set(children)) == len(links) - 1
    fixed = [joint for joint in root.findall("joint") if joint.find("parent").get("link") == "world"]
    assert len(fixed) == 2


@pytest.mark.parametrize("fixed", ["none", "first", "last", "both"])
def test_mujoco_bodies_branch(harness, tmp_path, fixed):
    doo3d.export([harness], "mjcf", tmp_path / "a.xml", fixed=fixed, gravity=(0, 0, -9.81))
    model, data = mujoco_state(tmp_path / "a.xml")
    assert (model.body_parentid[1:] == 0).sum() == 2
    for number, each in enumerate(harness.chains):
        at = [data.body(f"chain{number}_segment{k}").xpos for k in range(len(each.occluded))]
        distance = np.linalg.norm(each.joints[:, None] - np.array(at)[None], axis=2).min(axis=0)
        assert distance.max() < 1e-6


@pytest.mark.parametrize("fixed", ["none", "first", "last", "both"])
def test_mujoco_trees_simulate_without_gaining_energy(harness, tmp_path, fixed):
    doo3d.export([harness], "mjcf", tmp_path / "a.xml", fixed=fixed, gravity=(0, 0, -9.81), ground=False)
    model, start = mujoco_state(tmp_path / "a.xml")
    volume = sum(np.pi * each.radius**2 * each.length for each in harness.chains)
    assert model.body_mass.sum() == pytest.approx(1100 * volume)
    energies, data = stepped(model, 1.0)
    assert max(energies) <= energies[0] + 1e-6
    held = {"none": (), "first": (0,), "last": (1,), "both": (0, 1)}[fixed]
    for side, tip in enumerate(([-0.15, 0.0, 0.5], [0.15, 0.0, 0.5])):
        site = np.linalg.norm(start.site_xpos - tip, axis=1).argmin()
        fallen = start.site_xpos[site, 2] - data.site_xpos[site, 2]
        assert fallen < 0.005 if side in held else fallen > 0.02


def stepped(model, seconds):
    """The energy at every step, and the state at the end."""
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0  # nothing overlaps that may collide
    energies = [float(data.energy.sum())]
    while data.time < seconds:
        mujoco.mj_step(model, data)
        energies.append(float(data.energy.sum()))
    assert not any(warning.number for warning in data.warning)
    return energies, data


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_a_urdf_tree_simulates_without_gaining_energy(harness, tmp_path, base):
    doo3d.export([harness], "urdf", tmp_path / "a.urdf", base=base, segments=6)
    model, _ = mujoco_state(tmp_path / "a.urdf")
    model.opt.timestep = 1e-3
    energies, _ = stepped(model, 0.5)
    assert max(energies) <= energies[0] + 1e-6
    root = ElementTree.parse(tmp_path / "a.urdf").getroot()
    mass = sum(float(each.get("value")) for each in root.iter("mass"))
    assert mass == pytest.approx(1100 * sum(np.pi * each.radius**2 * each.length for each in harness.chains), rel=1e-6)


@pytest.mark.parametrize(("degrees", "radius"), [(10, 0.0051), (20, 0.0052), (25, 0.0102)])
def test_bodies_of_two_chains_overlap_as_far_as_their_axes_are_less_than_two_radii_apart(degrees, radius):
    """Segments k of both are nearest where they begin, after a way of k segments."""
    turn = np.radians(degrees)
    chains = [chain([0, 0, 0.5], [0.3, 0, 0.5]), chain([0, 0, 0.5], [0.3 * np.cos(turn), 0.3 * np.sin(turn), 0.5])]
    pairs = overlapping_bodies(chains, [radius, radius], [[ChainEnd(0, 0), ChainEnd(1, 0)]])
    expected = np.ceil(radius / (STEP * np.sin(turn / 2)))
    assert expected > 1 + CONTACT_FREE_RADII * radius / STEP
    assert [first.segment for first, second in pairs if first.segment == second.segment] == list(range(int(expected)))


def test_a_branch_at_an_acute_angle_does_not_collide_with_its_trunk(acute, tmp_path):
    tree = grown(acute)
    pairs = overlapping_bodies(tree.detection.chains, [each.radius for each in acute.chains], tree.junctions)
    assert max(body.segment for pair in pairs for body in pair if tree.detection.chains[body.chain].length < 0.25) >= 3
    # MuJoCo reads 500 nested elements: the trunk after the junction is a tree of its own, tied to the one before
    doo3d.export([acute], "mjcf", tmp_path / "a.xml", gravity=(0, 0, -9.81), ground=False)
    model, _ = mujoco_state(tmp_path / "a.xml")
    energies, _ = stepped(model, 0.05)
    assert max(energies) <= energies[0] + 1e-6
    doo3d.export([acute], "urdf", tmp_path / "a.urdf", max_joints=None)
    shapes = ElementTree.parse(tmp_path / "a.urdf").getroot().findall("link/collision")
    segments = sum(len(each.occluded) for each in acute.chains)
    assert segments - 30 < len(shapes) < segments


def test_the_motion_of_a_harness_has_every_joint_in_its_place_and_is_held_together(harness, tmp_path):
    rng = np.random.default_rng(0)
    frames = []
    for k in range(4):
        moved = [
            dataclasses.replace(each, joints=each.joints + rng.normal(0, 1e-3, 3), id=number)
            for number, each in enumerate(harness.chains)
        ]
        frames.append(dataclasses.replace(harness, chains=tuple(moved), frame=str(k), timestamp=k / 30))
    frames[2] = dataclasses.replace(frames[2], junctions=(), objects=())  # a junction that one frame does not tell
    doo3d.export(frames, "mjcf-motion", tmp_path / "a.xml", gravity=(0, 0, -9.81))
    model, data = mujoco_state(tmp_path / "a.xml")
    for key, frame in enumerate(frames):
        mujoco.mj_resetDataKeyframe(model, data, key)
        mujoco.mj_forward(model, data)
        for number, each in enumerate(frame.chains):
            at = joints_of(data, each, f"chain{number}")
            np.testing.assert_allclose(at, each.joints, atol=1e-9)
    assert model.neq == sum(len(junction.ends) - 1 for junction in harness.junctions)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    ends = [(f"chain{n}_{side * len(harness.chains[n].occluded)}") for n, side in harness.junctions[0].ends]
    while data.time < 0.5:
        mujoco.mj_step(model, data)
    at = np.array([data.site(end).xpos for end in ends])
    assert np.linalg.norm(at - at[0], axis=1).max() < 1.2 * STEP


def test_usd_bodies_branch(harness, tmp_path):
    pytest.importorskip("pxr")
    from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdValidation

    path = doo3d.export([harness], "usd-physics", tmp_path / "a.usda", fixed=True)[0]
    stage = Usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)] == []
    joints = [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]
    held = [joint for joint in joints if joint.GetPath().name == "held"]
    assert len(held) == 2  # objects, not chains
    branching = [joint for joint in joints if joint.GetPath().name == "joint0"]
    assert len(branching) == 4
    bodies = {joint.GetBody1Rel().GetTargets()[0] for joint in joints}
    assert len(bodies) == len(joints) == sum(len(each.occluded) for each in harness.chains)
    for joint in branching:
        anchors = []
        for body, position, turn in (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        ):
            xform = UsdGeom.Xformable(stage.GetPrimAtPath(body.GetTargets()[0]))
            matrix = Gf.Matrix4d().SetRotate(turn.Get()) * Gf.Matrix4d().SetTranslate(Gf.Vec3d(position.Get()))
            anchors.append(np.array(matrix * xform.ComputeLocalToWorldTransform(Usd.TimeCode.Default())))
        np.testing.assert_allclose(anchors[0], anchors[1], atol=1e-5)
        pair = [rel.GetTargets()[0] for rel in (joint.GetBody0Rel(), joint.GetBody1Rel())]
        prims = [stage.GetPrimAtPath(each) for each in pair]
        filtered = [UsdPhysics.FilteredPairsAPI(prim).GetFilteredPairsRel().GetTargets() for prim in prims]
        assert pair[1] in filtered[0] or pair[0] in filtered[1]


def test_usd_curves_are_grouped_by_object(harness, tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    chains = tuple(dataclasses.replace(each, id=10 + number) for number, each in enumerate(harness.chains))
    frame = dataclasses.replace(harness, chains=chains)
    bare = dataclasses.replace(frame, frame="b", junctions=(), objects=())
    path = doo3d.export([bare, frame, frame], "usd", tmp_path / "a.usda")[0]
    stage = Usd.Stage.Open(str(path))
    paths = {str(prim.GetPath()) for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)}
    assert paths == {*(f"/doo3d/object0/chain{10 + number}" for number in range(5)), "/doo3d/chain15"}
    points = UsdGeom.Points(stage.GetPrimAtPath("/doo3d/object0/junctions"))
    assert len(points.GetPointsAttr().Get(Usd.TimeCode(0))) == 0
    at = np.array(points.GetPointsAttr().Get(Usd.TimeCode(1)))
    np.testing.assert_allclose(at, [each.position for each in harness.junctions], atol=1e-6)
    prim = points.GetPrim()
    assert list(prim.GetAttribute("doo3d:endCounts").Get(Usd.TimeCode(1))) == [3, 3]
    assert set(prim.GetAttribute("doo3d:chains").Get(Usd.TimeCode(1))) == set(range(10, 15))


def test_meshes_close_the_gaps_at_junctions(harness, tmp_path):
    text = doo3d.export([harness], "obj", tmp_path / "a.obj")[0].read_text()
    assert [line for line in text.splitlines() if line.startswith("o junction")] == ["o junction0", "o junction1"]
    import trimesh

    mesh = trimesh.load(doo3d.export([harness], "glb", tmp_path / "a.glb")[0])
    at = mesh.geometry["junction0"].bounds.mean(axis=0)
    assert np.linalg.norm(at - harness.junctions[0].position) < STEP


def test_markers_of_junctions(harness, tmp_path):
    rosbags = pytest.importorskip("rosbags.highlevel")
    from rosbags.typesys import Stores, get_typestore

    folder = doo3d.export([harness], "ros2", tmp_path / "bag")[0]
    with rosbags.AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        messages = {c.topic: reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()}
    spheres = [marker for marker in messages["/doo3d/markers"].markers if marker.ns == "junctions"]
    assert [(marker.type, marker.scale.x == marker.scale.z) for marker in spheres] == [(7, True), (7, True)]
    assert spheres[1].points[0].x == harness.junctions[1].position[0]


def test_nodes_are_those_of_each_chain(harness, tmp_path):
    paths = doo3d.export([harness], "nodes", tmp_path / "nodes", file="json", count=5)
    assert len(paths) == 6
    assert len(json.loads(paths[0].read_text())["nodes"]) == 5
