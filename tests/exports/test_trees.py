"""Branched objects as trees and graphs: simulators, SWC, GraphML, arrays and tables."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from builders.contexts import context_of
from builders.drawn_masks import line

import doo3d
from doo3d.config import MergeConfig
from doo3d.geometry.equal_segments import equal_segments
from doo3d.stages.branches import find_branches
from doo3d.types import Chain, Detection

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
    found = find_branches(strands, context_of(segment_length=STEP, radius=0.005), MergeConfig(branches=True))
    assert [len(each.chains) for each in found.objects] == [5, 1]
    return Detection(tuple(found.chains), junctions=found.junctions, objects=found.objects)


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
    doo3d.export([harness], "urdf", tmp_path / "a.urdf")
    root = ElementTree.parse(tmp_path / "a.urdf").getroot()
    links = {link.get("name") for link in root.findall("link")}
    children = [joint.find("child").get("link") for joint in root.findall("joint")]
    assert len(children) == len(set(children)) == len(links) - 1
    fixed = [joint for joint in root.findall("joint") if joint.find("parent").get("link") == "world"]
    assert len(fixed) == 2


@pytest.mark.parametrize("fixed", ["none", "first", "last", "both"])
def test_mujoco_bodies_branch(harness, tmp_path, fixed):
    mujoco = pytest.importorskip("mujoco")
    doo3d.export([harness], "mjcf", tmp_path / "a.xml", fixed=fixed, gravity=(0, 0, -9.81))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "a.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert (model.body_parentid[1:] == 0).sum() == 2
    for number, each in enumerate(harness.chains):
        at = [data.body(f"chain{number}_segment{k}").xpos for k in range(len(each.occluded))]
        distance = np.linalg.norm(each.joints[:, None] - np.array(at)[None], axis=2).min(axis=0)
        assert distance.max() < 1e-6
