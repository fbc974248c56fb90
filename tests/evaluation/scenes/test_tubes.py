"""Tubes from a file: the camera sees all of them, and each is scored by itself."""

import numpy as np
import pytest
from builders.errors import refuses

from doo3d.config import Config, load_config
from doo3d.errors import ConfigError
from doo3d.evaluation.benchmark.run import run_cases
from doo3d.evaluation.benchmark.tables import format_table
from doo3d.evaluation.benchmark.tubes import COLUMNS, correct_tubes, tube_benchmark, tube_cases
from doo3d.evaluation.metrics.record import Record
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.evaluation.scenes.tubes import read_tubes
from doo3d.geometry.equal_segments import equal_segments
from doo3d.geometry.polyline import arc_length
from doo3d.types import Chain

LYING = np.array([[-0.2, 0.0, 0.0125], [0.0, 0.02, 0.0125], [0.2, 0.0, 0.0125]])
ACROSS = np.array([[0.03, -0.15, 0.05], [0.01, 0.0, 0.055], [0.02, 0.15, 0.05]])
SMALL = (640, 360)


def write(path, *tubes, radius=0.0125):
    """The tubes' nodes in reverse, as the order of nodes does not count; of the edges only their nodes are right."""
    lines = [str(len(tubes))]
    for number, nodes in enumerate(tubes):
        names = list(range(10, 10 + len(nodes)))
        lines.append(f"{number} {len(nodes)} {len(nodes) - 1}")
        lines += [f"{name} {x} {y} {z} {radius}" for name, (x, y, z) in list(zip(names, nodes, strict=True))[::-1]]
        lines += [f"e_{a}_{a + 1} {a} {a + 1} 1 {radius} 0 0 0 1 0 0 0 0.1" for a in names[:-1]]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def chain_along(truth, low=0.0, high=1.0):
    part = truth.axis[int(low * (len(truth.axis) - 1)) : int(high * (len(truth.axis) - 1)) + 1]
    return Chain(equal_segments(part, 0.01), 0.01, truth.radius)


def test_nodes_come_in_the_order_of_the_edges(tmp_path):
    (nodes, radius), (other, _) = read_tubes(write(tmp_path / "two.txt", LYING, ACROSS))
    assert radius == 0.0125
    np.testing.assert_allclose(nodes, LYING)
    np.testing.assert_allclose(other, ACROSS)
    scene = make_scene(f"tubes:{tmp_path / 'two.txt'}", 0)
    assert scene.name == "tubes_two_000"
    assert [cable.length for cable in scene.cables] == [pytest.approx(arc_length(nodes)[-1]) for nodes in (LYING, ACROSS)]
    height = (scene.cables[1].axis - scene.table.point) @ scene.table.normal
    assert height[[0, -1]].tolist() == pytest.approx([0.05, 0.05])


def test_the_camera_goes_back_until_all_tubes_are_in_view(tmp_path):
    wide = np.array([[-0.9, -0.5, 0.0125], [0.0, 0.3, 0.0125], [0.9, 0.5, 0.0125]])
    scene = make_scene(f"tubes:{write(tmp_path / 'wide.txt', wide)}", 0, SMALL)
    pixels = scene.camera.project(scene.cables[0].axis)
    assert (pixels > 0).all()
    assert (pixels < SMALL).all()
    assert scene.cables[0].axis[:, 2].mean() > 1.2


@pytest.mark.parametrize("text", ["", "2\n0 2 1\n", "1\n0 2 1\n1 0 0 0 r\n", "nonsense"])
def test_what_is_no_tube_configuration_is_refused_by_name(tmp_path, text):
    (tmp_path / "bad.txt").write_text(text, encoding="utf-8")
    with refuses("tubes-invalid", "bad.txt"):
        run_cases(tube_benchmark(Config()).measure, tube_cases(tmp_path, [0]))


def test_a_folder_without_tubes_is_refused(tmp_path):
    with refuses("file-missing", "none.txt"):
        read_tubes(tmp_path / "none.txt")
    with refuses("tubes-missing"):
        tube_cases(tmp_path, [0])


def test_tubes_need_a_config_in_3d():
    with refuses("config-mode", kind=ConfigError):
        tube_benchmark(load_config("image"))


def test_each_tube_is_judged_by_itself(tmp_path):
    truths = make_scene(f"tubes:{write(tmp_path / 'two.txt', LYING, ACROSS)}", 0, SMALL).cables
    whole = [chain_along(truth) for truth in truths]
    assert correct_tubes(whole, truths) == [True, True]
    assert correct_tubes(whole[::-1], truths) == [True, True]
    assert correct_tubes([whole[0], chain_along(truths[1], 0.0, 0.9)], truths) == [True, False]
    assert correct_tubes(whole[1:], truths) == [False, True]
    assert correct_tubes([], truths) == [False, False]
    moved = Chain(whole[0].joints + np.array([0.0, 0.0, 0.1]), 0.01, 0.0125)
    assert correct_tubes([moved, whole[1]], truths) == [False, True]


def test_only_tubes_seen_well_enough_count():
    tubes = (("a", True, True), ("a", True, False), ("b", False, False))
    rows = [Record(family=name, counted=False, counts=counts, correct=correct) for name, counts, correct in tubes]
    lines = format_table(rows, COLUMNS).splitlines()
    assert lines[1].split() == ["a", "2", "2", "1", "50.0%"]
    assert lines[2].split() == ["b", "1", "0", "0", "-"]
    assert lines[4].split() == ["all", "3", "2", "1", "50.0%"]


@pytest.mark.slow
def test_crossed_tubes_are_found_and_counted_by_the_command(tmp_path, doo3d):
    write(tmp_path / "two.txt", LYING, ACROSS)
    code, out, _ = doo3d("evaluate", "dataset", "tubes", tmp_path, "--seeds", 2)
    assert code == 0
    assert out.splitlines()[-1].split() == ["two.txt", "4", "4", "4", "100.0%"]
