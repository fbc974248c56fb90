"""Tiny segmentation networks as the bytes of ONNX files, written without the package onnx."""

from __future__ import annotations

import numpy as np


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def _field(number: int, value: int | bytes | str) -> bytes:
    """Return one field of a protobuf message: an integer, or bytes with their length."""
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    content = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _tensor(name: str, values: np.ndarray) -> bytes:
    sizes = b"".join(_field(1, size) for size in values.shape)
    is_whole = values.dtype.kind == "i"
    return (
        sizes
        + _field(2, 7 if is_whole else 1)
        + _field(8, name)
        + _field(9, values.astype("<i8" if is_whole else "<f4").tobytes())
    )


def _value(name: str, shape: tuple[int, ...]) -> bytes:
    sizes = b"".join(_field(1, _field(1, size)) for size in shape)
    return _field(1, name) + _field(2, _field(1, _field(1, 1) + _field(2, sizes)))


def convolution(weights: np.ndarray, bias: np.ndarray, size: tuple[int, int]) -> bytes:
    """Return a model whose C classes score weights @ color + bias at each pixel.

    weights : (C, 3). bias : (C,). size : (height, width) of input and output.
    """
    classes = len(weights)
    node = _field(1, "image") + _field(1, "weights") + _field(1, "bias") + _field(2, "scores") + _field(4, "Conv")
    kernel = _field(1, "kernel_shape") + _field(8, 1) + _field(8, 1) + _field(20, 7)
    node += _field(5, kernel)
    tensors = {"weights": weights.reshape(classes, 3, 1, 1), "bias": bias}
    return _model([node], tensors, (1, 3, *size), (1, classes, *size))


def at_half_size(weights: np.ndarray, bias: float, size: tuple[int, int]) -> bytes:
    """Return a model of the shape of doo3d's network: 8 channels at half the size of the image, two classes of 2 x 2 pixels.

    Class 0 is sigmoid(weights @ color + bias) at each pixel, class 1 the same.

    weights : (3,). size : (height, width) of the input, both even.
    """
    kernel = np.zeros((8, 3, 2, 2))
    for channel in range(8):
        kernel[channel, :, channel % 4 // 2, channel % 2] = weights
    nodes = [
        _node("Conv", ["image", "kernel", "bias"], "a", kernel_shape=[2, 2], strides=[2, 2]),
        _node("Sigmoid", ["a"], "scores"),
    ]
    shape = (1, 8, size[0] // 2, size[1] // 2)
    return _model(nodes, {"kernel": kernel, "bias": np.full(8, bias)}, (1, 3, *size), shape)


def mixed(size: tuple[int, int]) -> bytes:
    """Return a model of one class with operators of several kinds: strides, pooling, reshaping, joining, resizing.

    size : (height, width) of input and output, both even.
    """
    height, width = size
    tensors = {
        "first": np.full((4, 3, 3, 3), 0.1),
        "last": np.full((1, 8, 1, 1), 0.1),
        "flat": np.array([1, 4, -1]),
        "back": np.array([1, 4, height // 2, width // 2]),
        "scales": np.array([1.0, 1.0, 2.0, 2.0]),
    }
    nodes = [
        _node("Conv", ["image", "first"], "a", kernel_shape=[3, 3], pads=[1, 1, 1, 1], strides=[1, 1], group=1),
        _node("Relu", ["a"], "b"),
        _node("MaxPool", ["b"], "c", kernel_shape=[2, 2], strides=[2, 2]),
        _node("Reshape", ["c", "flat"], "d"),
        _node("Softmax", ["d"], "e", axis=1),
        _node("Reshape", ["e", "back"], "f"),
        _node("Concat", ["c", "f"], "g", axis=1),
        _node("Conv", ["g", "last"], "h", kernel_shape=[1, 1]),
        _node("Resize", ["h", "", "scales"], "scores", mode="nearest"),
    ]
    return _model(nodes, tensors, (1, 3, *size), (1, 1, *size))


def _node(kind: str, inputs: list[str], output: str, **attributes: int | str | list[int]) -> bytes:
    node = b"".join(_field(1, name) for name in inputs) + _field(2, output) + _field(4, kind)
    for name, value in attributes.items():
        if isinstance(value, list):
            content = b"".join(_field(8, number) for number in value) + _field(20, 7)
        else:
            content = _field(3, value) + _field(20, 2) if isinstance(value, int) else _field(4, value) + _field(20, 3)
        node += _field(5, _field(1, name) + content)
    return node


def _model(
    nodes: list[bytes], tensors: dict[str, np.ndarray], input_shape: tuple[int, ...], output_shape: tuple[int, ...]
) -> bytes:
    graph = b"".join(_field(1, node) for node in nodes) + _field(2, "tiny")
    graph += b"".join(_field(5, _tensor(name, values)) for name, values in tensors.items())
    graph += _field(11, _value("image", input_shape)) + _field(12, _value("scores", output_shape))
    return _field(1, 8) + _field(7, graph) + _field(8, _field(1, "") + _field(2, 13))
