# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the stages hand on, as messages: probabilities, candidates, objects; there and back."""

import json

from hooc_perception.core.geometry import back_project
from hooc_perception.core.types import Candidates, PixelProbabilities
from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import pose_array_message, poses_from_message
from hooc_perception.ros.messages.point_clouds import cloud_message, cloud_rows, row_dtype
import numpy as np

PIXEL_COLUMNS = (('camera', 'u1'), ('u', 'u2'), ('v', 'u2'), ('x', 'f4'), ('y', 'f4'),
                 ('z', 'f4'))
CANDIDATE_COLUMNS = (('x', 'f4'), ('y', 'f4'), ('z', 'f4'), ('score', 'f4'), ('size_x', 'f4'),
                     ('size_y', 'f4'), ('size_z', 'f4'), ('category', 'u2'))
OBJECT_COLUMNS = tuple((name, 'f4') for name in (
    'x', 'y', 'z', 'qx', 'qy', 'qz', 'qw', 'score', 'size_x', 'size_y', 'size_z',
    'visible_ratio', 'residual_m', 'energy_delta', 'sigma_t', 'sigma_r', 'age_s')) + (
        ('id', 'u4'), ('category', 'u2'), ('n_views', 'u1'), ('flags', 'u1'))
SIZE = ('size_x', 'size_y', 'size_z')

# Bits of `flags`.
FLAG_SEARCH_STOPPED = 1     # a deadline ended the search before it converged
FLAG_ONE_VIEW = 2           # only one camera shows the object
FLAG_TURNED = 4             # turned by half a turn it would explain the images about as well


def probabilities_message(probabilities, observation, names, head):
    """
    Return the PointCloud2 of PixelProbabilities, one row a listed pixel.

    :param observation: gives x, y, z of the pixels, world frame, metres (NaN without reading).
    :param names: class names 1..N; the columns after z are background and these.
    """
    classes = [('p_background', 'u1')] + [(f'p_{name}', 'u1') for name in names]
    if probabilities.p.shape[1] != len(classes):
        raise HoocError(f'the classifier knows {probabilities.p.shape[1] - 1} categories but the '
                        f'model {len(names)}; train the model again')
    rows = np.zeros(len(probabilities.camera), row_dtype(PIXEL_COLUMNS + tuple(classes)))
    rows['camera'] = probabilities.camera
    rows['u'], rows['v'] = probabilities.uv[:, 0], probabilities.uv[:, 1]
    for c, (column, _) in enumerate(classes):
        rows[column] = probabilities.p[:, c]
    for i, view in enumerate(observation.views):
        mine = probabilities.camera == i
        points = back_project(view.depth, view.camera)[rows['v'][mine], rows['u'][mine]]
        rows['x'][mine], rows['y'][mine], rows['z'][mine] = points.T
    return cloud_message(rows, head)


def probabilities_from_message(message, observation=None, n_models=None):
    """
    Return the PixelProbabilities of their PointCloud2; class columns in message order.

    :param observation, n_models: what they must fit; compiled code trusts their indices.
    :raises HoocError: where a column is missing, or they are those of other cameras or models.
    """
    known = [name for name, _ in PIXEL_COLUMNS]
    rows = cloud_rows(message, known)
    classes = [name for name in rows.dtype.names if name not in known]
    p = np.empty((len(rows), len(classes)), np.uint8)
    for c, name in enumerate(classes):
        p[:, c] = rows[name]
    camera, uv = rows['camera'].astype(np.int64), np.stack([rows['u'], rows['v']], -1)
    if observation is not None:
        sizes = np.array([view.depth.shape[::-1] for view in observation.views])
        if len(rows) and (camera.max() >= len(sizes) or (uv >= sizes[camera]).any()):
            raise HoocError('pixels/probabilities names pixels that the views do not have; give '
                            'all nodes the same parameter cameras')
    if n_models is not None and len(classes) != n_models + 1:
        raise HoocError(f'pixels/probabilities has {len(classes) - 1} categories, but the model '
                        f'{n_models}; give all nodes the same parameter model')
    return PixelProbabilities(camera.astype(np.uint8), uv.astype(np.uint16), p)


def label_images(probabilities, observation):
    """Return one (H, W) uint8 image a view: most likely class id, 0 background."""
    images = [np.zeros(view.depth.shape, np.uint8) for view in observation.views]
    best = probabilities.p.argmax(1).astype(np.uint8)
    for i, image in enumerate(images):
        mine = probabilities.camera == i
        image[probabilities.uv[mine, 1], probabilities.uv[mine, 0]] = best[mine]
    return images


def candidates_messages(candidates, head):
    """Return (PoseArray, PointCloud2) of Candidates; row i belongs to pose i."""
    rows = np.zeros(len(candidates), row_dtype(CANDIDATE_COLUMNS))
    rows['x'], rows['y'], rows['z'] = candidates.translation.T
    rows['score'], rows['category'] = candidates.score, candidates.category
    for axis, name in enumerate(SIZE):
        rows[name] = candidates.size[:, axis]
    return (pose_array_message(candidates.translation, candidates.rotation_xyzw, head),
            cloud_message(rows, head))


def candidates_from_messages(poses, attributes, n_models=None):
    """
    Return the Candidates of their two messages, exactly.

    Objects carry the same columns and more, so this reads `objects/*` as well.

    :param n_models: how many categories there are; compiled code trusts the class ids.
    :raises HoocError: where the two do not belong together, or are no candidates.
    """
    translation, rotation = poses_from_message(poses)
    rows = cloud_rows(attributes, [name for name, _ in CANDIDATE_COLUMNS])
    if len(rows) != len(translation) or attributes.header.stamp != poses.header.stamp:
        raise HoocError(f'{len(translation)} poses came with {len(rows)} rows of attributes; two '
                        'nodes are publishing on the same topics')
    category, size = rows['category'], np.stack([rows[name] for name in SIZE], -1)
    if n_models is not None and len(rows):
        if category.min() < 1 or category.max() > n_models:
            raise HoocError(f'candidates of a category that the model with its {n_models} does '
                            'not have; give all nodes the same parameter model')
        if not (np.isfinite(translation).all() and np.isfinite(size).all() and (size > 0).all()
                and (np.abs(np.linalg.norm(rotation, axis=1) - 1) < 1e-3).all()):
            raise HoocError('candidates whose poses or sizes are none; is another node '
                            'publishing on their topics?')
    return Candidates(category.astype(np.uint16), translation, rotation, size.astype(np.float32),
                      rows['score'].astype(np.float32))


def objects_messages(parsed, ids, age_s, head):
    """
    Return (PoseArray, PointCloud2) of a ParsedScene: `objects/poses` and `objects/attributes`.

    :param ids: (n,) uint32 instance ids.
    :param age_s: seconds from the frame set's stamp to now.
    """
    objects = parsed.objects
    rows = np.zeros(len(objects), row_dtype(OBJECT_COLUMNS))
    rows['x'], rows['y'], rows['z'] = objects.translation.T
    for axis, name in enumerate(('qx', 'qy', 'qz', 'qw')):
        rows[name] = objects.rotation_xyzw[:, axis]
    for axis, name in enumerate(SIZE):
        rows[name] = objects.size[:, axis]
    rows['score'], rows['category'], rows['id'] = objects.score, objects.category, ids
    for name in ('visible_ratio', 'residual_m', 'energy_delta', 'n_views'):
        rows[name] = getattr(parsed, name)
    for name in ('sigma_t', 'sigma_r'):
        sigma = getattr(parsed, name)
        # Where nobody asked, a zero would claim perfection.
        rows[name] = np.nan if sigma is None else sigma
    rows['age_s'] = age_s
    rows['flags'] = (0 if parsed.converged else FLAG_SEARCH_STOPPED) | np.where(
        parsed.n_views == 1, FLAG_ONE_VIEW, 0) | np.where(
        rows['sigma_r'] > 3.1, FLAG_TURNED, 0)
    return (pose_array_message(objects.translation, objects.rotation_xyzw, head),
            cloud_message(rows, head))


def points_message(points, head, camera=None):
    """Return the PointCloud2 of (n, 3) points, with column `camera` where (n,) is given."""
    columns = [('x', 'f4'), ('y', 'f4'), ('z', 'f4')] + ([('camera', 'u1')] if camera is not None
                                                         else [])
    rows = np.zeros(len(points), row_dtype(columns))
    rows['x'], rows['y'], rows['z'] = np.asarray(points).reshape(-1, 3).T
    if camera is not None:
        rows['camera'] = camera
    return cloud_message(rows, head)


def labels_json(models, meshes, ids=(), categories=()):
    """
    Return the text of `objects/labels`: what a class id and an instance id mean.

    :param models: tuple of GenericModel; class id c is models[c - 1].
    :param meshes: one (URI, sha256 in hex) a model.
    :param ids, categories: instance ids and class ids of the latest objects.
    """
    classes = {str(c): {'name': model.name, 'mesh': uri, 'sha256': digest,
                        'extents_m': [round(float(x), 6) for x in model.extents],
                        'symmetry': [int(order) for order in model.symmetry]}
               for c, (model, (uri, digest)) in enumerate(zip(models, meshes), 1)}
    objects = {str(int(i)): {'category': models[int(c) - 1].name, 'class_id': int(c)}
               for i, c in zip(ids, categories)}
    return json.dumps({'format': 'hooc-labels/1', 'classes': classes, 'objects': objects})
