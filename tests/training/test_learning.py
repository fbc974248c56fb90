"""Training learns, resumes where it was, and exports what OpenCV runs to the same numbers."""

import sys

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.errors import MissingDependency

pytest.importorskip("torch")
pytest.importorskip("onnx")
pytestmark = pytest.mark.slow

from dataclasses import replace  # noqa: E402

import torch  # noqa: E402

from doo3d.config import OnnxConfig, SegmentConfig  # noqa: E402
from doo3d.segment.methods import network as method  # noqa: E402
from doo3d.training import learning  # noqa: E402
from doo3d.training.learning import Settings, exported, train  # noqa: E402
from doo3d.training.network import Network  # noqa: E402
from doo3d.types import Image  # noqa: E402


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Small images and a small store."""
    for name, value in {"SIZE": 64, "CAPACITY": 40, "FIRST": 12, "CHECK_IMAGES": 4, "AHEAD": 8}.items():
        monkeypatch.setattr(learning, name, value)


def settings(folder, steps) -> Settings:
    return Settings(folder, steps, batch=4, checkpoint_steps=4)


@pytest.fixture
def trained(tmp_path):
    return train(settings(tmp_path / "whole", 8))


def weights(checkpoint):
    return torch.load(checkpoint, weights_only=True)["average"]


def test_training_that_was_interrupted_ends_where_it_ends_without(tmp_path, trained):
    def interrupt(step, loss):
        if step == 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(settings(tmp_path / "pieces", 8), interrupt)
    assert torch.load(tmp_path / "pieces" / "checkpoint.pt", weights_only=True)["step"] == 4
    resumed = train(settings(tmp_path / "pieces", 8))
    lines = (tmp_path / "pieces" / "curve.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in lines] == ["step", "4", "8"]
    for name, values in weights(trained).items():
        torch.testing.assert_close(values, weights(resumed)[name], rtol=0, atol=0)


def test_a_line_of_the_curve_that_was_lost_is_made_up_for(tmp_path, trained, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as during:
        during.setattr(learning, "_log", interrupt)
        with pytest.raises(KeyboardInterrupt):
            train(settings(tmp_path / "pieces", 8))
    train(settings(tmp_path / "pieces", 8))
    whole, pieces = ((tmp_path / name / "curve.csv").read_text().splitlines() for name in ("whole", "pieces"))
    assert [line.split(",")[0] for line in pieces] == ["step", "4", "8"]
    assert [line.split(",")[2:] for line in pieces] == [line.split(",")[2:] for line in whole]


def test_the_first_drawing_is_reported(tmp_path):
    counts = []
    train(settings(tmp_path, 2), drawing=lambda count, total: counts.append((count, total)))
    assert counts == [(count, 14) for count in range(1, 15)]


def test_the_loss_falls(tmp_path):
    losses = []
    train(settings(tmp_path, 24), lambda step, loss: losses.append(loss))
    assert np.mean(losses[-5:]) < np.mean(losses[:5])


def test_another_seed_needs_another_folder(tmp_path, trained):
    with refuses("training-differs", "whole"):
        train(replace(settings(tmp_path / "whole", 12), seed=1))


def test_the_exported_network_gives_the_same_numbers_in_opencv(tmp_path, trained):
    path = tmp_path / "net.onnx"
    path.write_bytes(exported(trained))
    assert path.stat().st_size < 3_000_000
    network = Network()
    network.load_state_dict(weights(trained))
    assert sum(values.numel() for values in network.parameters()) < 1_500_000
    image = np.random.default_rng(0).integers(0, 256, (96, 160, 3), dtype=np.uint8)
    with torch.no_grad():
        expected = torch.sigmoid(network.eval()(torch.from_numpy(image.transpose(2, 0, 1)[None].copy()).float() / 255))[
            0, 0
        ].numpy()
    found = method.object_probability(image, str(path))
    np.testing.assert_allclose(found, expected, atol=0.002)
    selected = method.mask(Image(image), SegmentConfig(method="network", onnx=OnnxConfig(model=str(path))), 0).mask
    assert selected.shape == (96, 160)


def test_images_of_the_user_take_their_share(tmp_path, monkeypatch):
    (tmp_path / "images").mkdir()
    (tmp_path / "masks").mkdir()
    image, mask = np.full((80, 80, 3), 90, np.uint8), np.zeros((80, 80), np.uint8)
    mask[30:40] = 255
    cv2.imwrite(str(tmp_path / "images" / "a.png"), image)
    cv2.imwrite(str(tmp_path / "masks" / "a.png"), mask)
    monkeypatch.setattr(learning, "_own", learning.own_images(tmp_path))
    own = [(learning._made(0, index, 0.5, 64)[..., :3] == 90).all() for index in range(40)]
    assert 10 < sum(own) < 30


def test_without_torch_the_command_names_the_extra(monkeypatch, tmp_path):
    from doo3d.commands.train import train as command

    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingDependency, match=r"doo3d\[train\]"):
        command(tmp_path / "mine.onnx", None, 0.5, 10, 0, None, 1, False)
