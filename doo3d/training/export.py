"""Write the network as an ONNX file that OpenCV runs."""

from typing import Any

import numpy as np
from onnx import TensorProto, helper, numpy_helper

from ..types import Array
from .network import Network, Residual

OPSET = 12
"""Version of the ONNX operators; OpenCV 4.8, the oldest supported version, reads it."""


class _Graph:
    """The nodes and the 16-bit weights of an ONNX graph that is being built."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.weights: list[Any] = []

    def add(self, operator: str, inputs: list[str], **attributes: Any) -> str:
        output = f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [output], name=output, **attributes))
        return output

    def constant(self, values: Array, dtype: Any = np.float16) -> str:
        name = f"weight_{len(self.weights)}"
        self.weights.append(numpy_helper.from_array(np.ascontiguousarray(values, dtype), name))
        return name

    def layers(self, module: Any, x: str) -> str:
        """Add a module to the graph, and return the name of its output.

        The module is a convolution with its normalization and activation, a residual block, or a sequence of them. x : name of
        the input.
        """
        if isinstance(module, Residual):
            return self.add("Relu", [self.add("Add", [x, self.layers(module.second, self.layers(module.first, x))])])
        if not hasattr(module[0], "kernel_size"):
            for part in module:
                x = self.layers(part, x)
            return x
        layer, norm = module[0], module[1]
        gain = norm.weight.detach().numpy() / np.sqrt(norm.running_var.numpy() + norm.eps)
        weight = layer.weight.detach().numpy() * gain[:, None, None, None]
        bias = norm.bias.detach().numpy() - norm.running_mean.numpy() * gain
        x = self.add(
            "Conv",
            [x, self.constant(weight), self.constant(bias)],
            kernel_shape=list(layer.kernel_size),
            strides=list(layer.stride),
            dilations=list(layer.dilation),
            pads=list(layer.padding) * 2,
        )
        return self.add("Relu", [x]) if len(module) > 2 else x

    def doubled(self, x: str) -> str:
        scales = self.constant(np.array([1, 1, 2, 2]), np.float32)
        return self.add(
            "Resize", [x, "", scales], mode="nearest", coordinate_transformation_mode="asymmetric", nearest_mode="floor"
        )


def onnx_bytes(network: Network) -> bytes:
    """Return the content of an ONNX file of the network, with folded batch normalization and 16-bit weights.

    The input `image` is (1, 3, H, W) float32, RGB from 0 to 1, H and W multiples of 32. The output `scores` (1, 8, H / 2, W / 2)
    from 0 to 1 holds two images, each with 2 x 2 pixels packed into channels: pixel (row, column) of image i is in channel 4 i +
    2 (row % 2) + column % 2. Image 0 is the probability of the object; image 1 is 1 on the centerline of a strand and 0 at its
    border. The caller unpacks them, since OpenCV 4.8 cannot do it for images of any size.
    """
    graph = _Graph()
    x2 = graph.layers(network.down2, "image")
    x4 = graph.layers(network.down4, x2)
    x8 = graph.layers(network.down8, x4)
    x16 = graph.layers(network.down16, x8)
    y = graph.layers(network.down32, x16)
    levels = (
        (x16, network.up16, network.mix16),
        (x8, network.up8, network.mix8),
        (x4, network.up4, network.mix4),
        (x2, network.up2, network.mix2),
    )
    for fine, up, mix in levels:
        y = graph.layers(mix, graph.add("Add", [fine, graph.doubled(graph.layers(up, y))]))
    head = network.head[0]
    weights = [graph.constant(head.weight.detach().numpy()), graph.constant(head.bias.detach().numpy())]
    y = graph.add("Conv", [y, *weights], kernel_shape=[3, 3], strides=[1, 1], pads=[1, 1, 1, 1])
    graph.nodes.append(helper.make_node("Sigmoid", [y], ["scores"], name="scores"))
    image = helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, "height", "width"])
    scores = helper.make_tensor_value_info("scores", TensorProto.FLOAT, [1, 8, "rows", "columns"])
    made = helper.make_graph(graph.nodes, "doo3d", [image], [scores], graph.weights)
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="doo3d", ir_version=7)
    return bytes(model.SerializeToString())
