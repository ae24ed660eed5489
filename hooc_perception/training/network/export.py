# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""From a trained PointNetwork to the arrays of a model."""

import io
import warnings

from hooc_perception.core.arrays import AnyArray, Float32Array
from hooc_perception.core.classification.table_network import (
    CHANNELS,
    FEWEST_CELLS,
    LEVELS,
    PREFIX,
    with_digest,
)
from hooc_perception.training.network.model import PointNetwork
import numpy as np
import torch  # pyright: ignore[reportMissingImports]

# Operations that OpenCV 4.6 knows.
OPSET = 12


def exported(network: PointNetwork) -> dict[str, AnyArray]:
    """
    Return the arrays that `table_network.from_arrays` reads.

    Weights are rounded to the 16 bits of a bfloat16: the network was trained with these, and a
    compressed file is half as large.
    """
    network = network.eval()
    with torch.no_grad():
        for parameter in network.levels.parameters():
            parameter.copy_(parameter.bfloat16().float())
    half = torch.zeros(1, 4 * CHANNELS, FEWEST_CELLS // 2, FEWEST_CELLS // 2)
    names = [f'level{k}' for k in range(LEVELS)]
    file = io.BytesIO()
    with warnings.catch_warnings():
        # The newer exporter writes operations that OpenCV 4.6 does not know.
        warnings.simplefilter('ignore')
        torch.onnx.export(network.levels, (half,), file, dynamo=False, opset_version=OPSET,
                          input_names=['map'], output_names=names,
                          dynamic_axes={name: {2: 'x', 3: 'y'} for name in ('map', *names)})
    arrays: dict[str, AnyArray] = {
        PREFIX + 'net': np.frombuffer(file.getvalue(), np.uint8)}
    for k, layer in enumerate(network.linear_layers()):
        arrays[f'{PREFIX}weight{k}'] = _numbers(layer.weight)
        arrays[f'{PREFIX}bias{k}'] = _numbers(layer.bias)
    return with_digest(arrays)


def _numbers(parameter: torch.Tensor) -> Float32Array:
    """Return a parameter as float32."""
    return parameter.detach().numpy().astype(np.float32)
