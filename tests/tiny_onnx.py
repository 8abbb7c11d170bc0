"""Writes an ONNX file of the shape of a YOLO-v8 detector, without the onnx package.

It is a single convolution that sees red: one image (1, 3, height, width) in, (1, 5, anchors) out.
"""

import struct

import numpy as np

STRIDE = 8
BOX = 160  # pixels: so large that all which see the same red thing agree


def _varint(n):
    out = bytearray()
    while n > 127:
        out.append(n & 127 | 128)
        n >>= 7
    return bytes([*out, n])


def _field(number, value):
    """A field of a protocol buffer: an integer, a float, text, or bytes of another message."""
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    if isinstance(value, float):
        return _varint(number << 3 | 5) + struct.pack("<f", value)
    value = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(value)) + value


def _tensor(name, array):
    kind = {"float32": 1, "int64": 7}[array.dtype.name]
    dims = b"".join(_field(1, size) for size in array.shape)
    return dims + _field(2, kind) + _field(8, name) + _field(9, array.tobytes())


def _attribute(name, value):
    if isinstance(value, int):
        return _field(1, name) + _field(3, value) + _field(20, 2)
    return _field(1, name) + b"".join(_field(8, v) for v in value) + _field(20, 7)


def _node(kind, inputs, output, **attributes):
    parts = [_field(1, name) for name in inputs] + [_field(2, output), _field(4, kind)]
    return b"".join(parts + [_field(5, _attribute(*item)) for item in attributes.items()])


def _value(name, shape):
    dims = (_field(2, s) if isinstance(s, str) else _field(1, s) for s in shape)
    shape = b"".join(_field(1, dim) for dim in dims)
    return _field(1, name) + _field(2, _field(1, _field(1, 1) + _field(2, shape)))


def write_red_detector(path, size, batch=1, rows=5):
    """A detector of red things, for images of one size (width, height)."""
    width, height = size
    n = (width // STRIDE) * (height // STRIDE)
    weight = np.ones((1, 3, STRIDE, STRIDE), np.float32) * 20 / STRIDE**2
    weight[0, 1:] *= -0.5  # red, green, blue: the more red than other
    v, u = np.mgrid[STRIDE / 2 : height : STRIDE, STRIDE / 2 : width : STRIDE].reshape(2, n)
    boxes = np.stack([u, v, *np.full((rows - 3, n), BOX)])[None, : rows - 1].astype(np.float32)
    constants = {
        "weight": weight,
        "bias": np.array([-5], np.float32),
        "boxes": boxes,
        "shape": np.array([1, 1, n]),
    }
    square = [STRIDE] * 2
    nodes = [
        _node("Conv", ["images", "weight", "bias"], "red", strides=square, kernel_shape=square),
        _node("Sigmoid", ["red"], "sure"),
        _node("Reshape", ["sure", "shape"], "confidence"),
        _node("Concat", ["boxes", "confidence"], "output0", axis=1),
    ]
    graph = b"".join(_field(1, node) for node in nodes) + _field(2, "red")
    graph += b"".join(_field(5, _tensor(*item)) for item in constants.items())
    graph += _field(11, _value("images", (batch, 3, height, width)))
    graph += _field(12, _value("output0", (1, rows, n)))
    path.write_bytes(_field(1, 8) + _field(8, _field(2, 13)) + _field(7, graph))
    return path
