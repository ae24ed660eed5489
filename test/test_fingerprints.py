# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The bundled scene gives the objects that it always gave, to the bit.

Whoever changes results on purpose records them anew, and says so in the changelog:

    python test/test_fingerprints.py
"""

import hashlib
import json
from pathlib import Path
import platform

from hooc_perception import Parser
from hooc_perception.chain import PROFILES
from hooc_perception.io.bags.reader import BagScene
import llvmlite.binding
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / 'test' / 'data' / 'fingerprints.json'
COLUMNS = ('category', 'translation', 'rotation_xyzw', 'size', 'score')
EVIDENCE = ('visible_ratio', 'residual_m', 'energy_delta', 'n_views', 'sigma_t', 'sigma_r')


def machine():
    """Return what decides on the last bits: processor, compiler, linear algebra."""
    blas = np.show_config('dicts')['Build Dependencies']['blas']
    return {'processor': f'{platform.machine()} {llvmlite.binding.get_host_cpu_name()}',
            'llvmlite': llvmlite.__version__, 'numpy': np.__version__,
            'blas': f'{blas["name"]} {blas["version"]}'}


def arrays_of(parsed):
    """Yield every array of a ParsedScene, candidates included."""
    for candidates in (parsed.objects, parsed.pool):
        yield from (getattr(candidates, name) for name in COLUMNS)
    yield from (getattr(parsed, name) for name in EVIDENCE)
    e = parsed.energy
    yield np.array([e.depth, e.probability, e.overlap])


def fingerprint(name):
    """Return digest and objects of the bundled scene, parsed by the profile `name`."""
    parser = Parser.load(ROOT / 'models' / 'demo', name, max_instances=1)
    scene = parser.parse(BagScene(ROOT / 'bags' / 'demo').views())
    digest = hashlib.sha256()
    for array in arrays_of(scene.parsed):
        digest.update(f'{array.dtype} {array.shape}'.encode() + array.tobytes())
    return {'sha256': digest.hexdigest(),
            'objects': [[o.category, *np.round(o.translation, 4).tolist()]
                        for o in scene.objects]}


@pytest.mark.parametrize('name', PROFILES)
def test_the_bundled_scene_gives_the_same_objects(name):
    record = json.loads(RECORD.read_text())
    found, known = fingerprint(name), record['profiles'][name]
    if machine() == record['machine']:
        assert found == known
        return
    # Another processor or compiler rounds otherwise, and a search may then end elsewhere: most
    # objects are the same all the same.
    theirs = {category: np.array(at) for category, *at in known['objects']}
    near = [category for category, *at in found['objects']
            if category in theirs and np.linalg.norm(theirs[category] - at) < 0.02]
    assert len(near) >= 0.8 * len(theirs) and len(found['objects']) <= 1.2 * len(theirs)


if __name__ == '__main__':
    RECORD.write_text(json.dumps({'machine': machine(), 'profiles': {
        name: fingerprint(name) for name in PROFILES}}, indent=1) + '\n')
