"""Truth in arrays that another renderer wrote, with other depth and masks beside it."""

import numpy as np
import pytest
from builders.errors import refuses
from builders.photos import save, write_capture

from doo3d.evaluation.benchmark.cases import folder_cases
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import make_scene

SIMPLE = "other/depth_simple.png"


@pytest.fixture
def rendered(tmp_path):
    """A rendered scene and its capture, hook_3."""
    result = render(make_scene("occluded", 1, (320, 180)), "none")
    folder = write_capture(tmp_path / "hook_3", [result])
    save(folder / SIMPLE, np.full((180, 320), 7000, np.uint16))
    save(folder / "other" / "mask_ragged.png", 255 * (~result.mask).astype(np.uint8))
    axes = {f"axis_{k}": truth.axis.astype(np.float32) for k, truth in enumerate(result.truths)}
    radii = [truth.radius for truth in result.truths]
    closed = [truth.closed for truth in result.truths]
    labels = np.where(result.labels == 255, 0, result.labels)
    np.savez(folder / "truth.npz", **axes, radii=radii, closed=closed, labels=labels)
    return result, folder


def test_the_truth_and_what_is_seen_of_it_are_those_of_the_renderer(rendered, tmp_path):
    result, _ = rendered
    (case,) = folder_cases(tmp_path)
    assert (case.name, case.family) == ("hook_3", "hook")
    known = case.load()
    assert [truth.radius for truth in known.truths] == [truth.radius for truth in result.truths]
    for truth, true in zip(known.truths, result.truths, strict=True):
        assert np.abs(truth.axis - true.axis).max() < 1e-6
        assert (truth.seen == true.seen).mean() > 0.95
        assert not true.seen.all()
    assert np.abs(known.data.depth - result.frame.depth).max() < 1e-4
    assert (known.mask == result.mask).all()
    assert (known.ragged == ~result.mask).all()


def test_another_depth_is_chosen_by_its_file(rendered, tmp_path):
    (case,) = folder_cases(tmp_path, SIMPLE)
    assert np.unique(case.load().data.depth).tolist() == [pytest.approx(0.7)]
    (rendered[1] / SIMPLE).write_bytes(b"no image")
    with refuses("image-unreadable", "depth_simple.png"):
        case.load()
    (rendered[1] / SIMPLE).unlink()
    with refuses("truth-missing"):
        folder_cases(tmp_path, SIMPLE)


def test_a_cable_in_motion_has_a_case_for_each_frame(rendered, tmp_path):
    result, folder = rendered
    axis = result.truths[0].axis
    np.savez(folder / "truth.npz", curves=axis[None], radius=0.004)
    (case,) = folder_cases(tmp_path)
    assert case.truths[0].radius == 0.004
    np.savez(folder / "truth.npz", curves=np.stack((axis, axis)), radius=0.004)
    with refuses("truth-invalid", "2 frames"):
        folder_cases(tmp_path)


@pytest.mark.parametrize("values", [{"radii": [0.1]}, {"radii": [0.1], "axis_0": np.zeros((3, 2))}, {"radius": 1}])
def test_other_arrays_are_refused(rendered, tmp_path, values):
    np.savez(rendered[1] / "truth.npz", **values)
    with refuses("truth-invalid", "truth.npz"):
        folder_cases(tmp_path)


def test_the_command_takes_the_depth_and_the_mask_by_name(rendered, tmp_path, doo3d):
    code, out, err = doo3d("evaluate", "samples", tmp_path, "--sensor", "stereo", "--mask", "ragged", "--json", "a.json")
    assert code == 0, err
    assert out.splitlines()[-1].startswith("hook ")
    assert doo3d("evaluate", "samples", tmp_path, "--sensor", "eye")[0] == 2
