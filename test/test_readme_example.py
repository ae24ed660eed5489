# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The Python example of the README runs as it stands."""

import os
from pathlib import Path
import re
import subprocess
import sys

import cv2
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.scenes.camera_files import write_cameras
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = re.compile(r'<!-- example: api -->\n```python\n(.*?)```', re.S)


@pytest.mark.slow
def test_the_example_prints_objects_and_draws_a_picture(tmp_path):
    code = EXAMPLE.search((ROOT / 'README.md').read_text())
    assert code and len(code[1].splitlines()) <= 25
    views = BagScene(ROOT / 'bags' / 'demo').depth()
    folder = tmp_path / 'twin' / 'scenes' / '10_1'
    folder.mkdir(parents=True)
    write_cameras(tmp_path / 'twin' / 'cameras.yaml', [view.camera for view in views])
    for view in views:
        millimetres = np.nan_to_num(1000 * view.depth).round().astype(np.uint16)
        cv2.imwrite(str(folder / f'{view.camera.name}.png'), millimetres)
    (tmp_path / 'models').symlink_to(ROOT / 'models')
    done = subprocess.run([sys.executable, '-c', code[1]], cwd=tmp_path, text=True, check=True,
                          capture_output=True,
                          env={**os.environ, 'PYTHONPATH': str(ROOT), 'MPLBACKEND': 'Agg'})
    lines = done.stdout.splitlines()
    assert len(lines) > 5 and any(line.startswith('bottle') for line in lines)
    picture = cv2.imread(str(tmp_path / 'objects.png'))
    assert picture.std() > 10
