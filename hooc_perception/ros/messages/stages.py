# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The results of the stages as messages and back: probabilities, candidates, objects."""

from collections.abc import Iterable, Sequence
import json

from geometry_msgs.msg import PoseArray
from hooc_perception.core.arrays import AnyArray, UInt8Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.types import (
    Candidates,
    GenericModel,
    Observation,
    ParsedScene,
    PixelProbabilities,
)
from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import pose_array_message, poses_from_message
from hooc_perception.ros.messages.point_clouds import cloud_message, cloud_rows, row_dtype
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

PIXEL_COLUMNS = (('camera', 'u1'), ('u', 'u2'), ('v', 'u2'), ('x', 'f4'), ('y', 'f4'),
                 ('z', 'f4'))
CANDIDATE_COLUMNS = (('x', 'f4'), ('y', 'f4'), ('z', 'f4'), ('score', 'f4'), ('size_x', 'f4'),
                     ('size_y', 'f4'), ('size_z', 'f4'), ('category', 'u2'), ('member', 'u2'))
OBJECT_COLUMNS = tuple((name, 'f4') for name in (
    'x', 'y', 'z', 'qx', 'qy', 'qz', 'qw', 'score', 'size_x', 'size_y', 'size_z',
    'visible_ratio', 'residual_m', 'energy_delta', 'sigma_t', 'sigma_r', 'age_s')) + (
        ('id', 'u4'), ('category', 'u2'), ('n_views', 'u1'), ('flags', 'u1'), ('member', 'u2'))
SIZE = ('size_x', 'size_y', 'size_z')

# (URI, sha256 in hex) of each member of a category's family.
Meshes = Sequence[tuple[str, str]]

# Bits of `flags`.
FLAG_SEARCH_STOPPED = 1     # a deadline ended the search before it converged
FLAG_ONE_VIEW = 2           # only one camera sees the object
FLAG_TURNED = 4             # rotated by half a turn it would fit the images about as well
FLAG_HIDDEN = 8             # the robot hides it: it is as it was last seen, age_s ago


def probabilities_message(probabilities: PixelProbabilities, observation: Observation,
                          names: Sequence[str], head: Header) -> PointCloud2:
    """
    Return the PointCloud2 of PixelProbabilities, one row per listed pixel.

    :param observation: gives x, y, z of the pixels, world frame, metres (NaN = no reading).
    :param names: names of the classes 1..N; after z come one column for the background and one
        per name.
    :raises HoocError: if the number of classes differs.
    """
    classes = [('p_background', 'u1')] + [(f'p_{name}', 'u1') for name in names]
    if probabilities.p.shape[1] != len(classes):
        raise HoocError(f'the classifier knows {probabilities.p.shape[1] - 1} categories, but '
                        f'the model has {len(names)}; train the model again')
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


def probabilities_from_message(message: PointCloud2, observation: Observation | None = None,
                               n_models: int | None = None) -> PixelProbabilities:
    """
    Return the PixelProbabilities of a PointCloud2; class columns in the order of the message.

    :param observation: its views must have the pixels; compiled code relies on valid indices.
    :param n_models: the number of categories that the message must have.
    :raises HoocError: if a column is missing, or if the message belongs to other cameras or to
        another model.
    """
    known = [name for name, _ in PIXEL_COLUMNS]
    rows = cloud_rows(message, known)
    classes = [name for name in rows.dtype.names or () if name not in known]
    p = np.empty((len(rows), len(classes)), np.uint8)
    for c, name in enumerate(classes):
        p[:, c] = rows[name]
    camera, uv = rows['camera'].astype(np.int64), np.stack([rows['u'], rows['v']], -1)
    if observation is not None:
        sizes = np.array([view.depth.shape[::-1] for view in observation.views])
        if len(rows) and (camera.max() >= len(sizes) or (uv >= sizes[camera]).any()):
            raise HoocError('pixels/probabilities refers to pixels outside of the views; set the '
                            'parameter cameras to the same list in all nodes')
    if n_models is not None and len(classes) != n_models + 1:
        raise HoocError(f'pixels/probabilities has {len(classes) - 1} categories, but the model '
                        f'has {n_models}; set the parameter model to the same folder in all nodes')
    return PixelProbabilities(camera.astype(np.uint8), uv.astype(np.uint16), p)


def label_images(probabilities: PixelProbabilities, observation: Observation) -> list[UInt8Array]:
    """Return one (H, W) uint8 image per view: most likely class id, 0 = background."""
    images = [np.zeros(view.depth.shape, np.uint8) for view in observation.views]
    best = probabilities.p.argmax(1).astype(np.uint8)
    for i, image in enumerate(images):
        mine = probabilities.camera == i
        image[probabilities.uv[mine, 1], probabilities.uv[mine, 0]] = best[mine]
    return images


def candidates_messages(candidates: Candidates, head: Header) -> tuple[PoseArray, PointCloud2]:
    """Return (PoseArray, PointCloud2) of Candidates; row i belongs to pose i."""
    rows = np.zeros(len(candidates), row_dtype(CANDIDATE_COLUMNS))
    rows['x'], rows['y'], rows['z'] = candidates.translation.T
    rows['score'], rows['category'] = candidates.score, candidates.category
    rows['member'] = candidates.member
    for axis, name in enumerate(SIZE):
        rows[name] = candidates.size[:, axis]
    return (pose_array_message(candidates.translation, candidates.rotation_xyzw, head),
            cloud_message(rows, head))


def candidates_from_messages(poses: PoseArray, attributes: PointCloud2,
                             families: Sequence[int] | None = None) -> Candidates:
    """
    Return the Candidates of their two messages, exactly as they were sent.

    Objects have the same columns and more, so this also reads `objects/*`. Messages without the
    column `member` are of the generic meshes.

    :param families: the number of meshes of each category; compiled code relies on valid ids.
    :raises HoocError: if the messages do not belong together, or hold invalid candidates.
    """
    translation, rotation = poses_from_message(poses)
    rows = cloud_rows(attributes, [name for name, _ in CANDIDATE_COLUMNS if name != 'member'])
    if len(rows) != len(translation) or attributes.header.stamp != poses.header.stamp:
        raise HoocError(f'{len(translation)} poses came with {len(rows)} rows of attributes; two '
                        'nodes publish on the same topics: stop one of them')
    category, size = rows['category'], np.stack([rows[name] for name in SIZE], -1)
    known = 'member' in (rows.dtype.names or ())
    member = rows['member'] if known else np.zeros(len(rows), np.uint16)
    if families is not None and len(rows):
        n_models = len(families)
        if not (category.min() >= 1 and category.max() <= n_models):
            raise HoocError(f'candidates have a category outside of the {n_models} of the model; '
                            'set the parameter model to the same folder in all nodes')
        most = np.asarray(families)[category.astype(np.int64) - 1]
        if not ((member >= 0) & (member < most)).all():
            raise HoocError("candidates have a member outside of their category's family in the "
                            'model; set the parameter model to the same folder in all nodes')
        if not (np.isfinite(translation).all() and np.isfinite(size).all() and (size > 0).all()
                and (np.abs(np.linalg.norm(rotation, axis=1) - 1) < 1e-3).all()):
            raise HoocError('candidates have invalid poses or sizes; check whether another node '
                            'publishes on their topics')
    return Candidates(category.astype(np.uint16), translation, rotation, size.astype(np.float32),
                      rows['score'].astype(np.float32), member.astype(np.uint16))


def objects_messages(parsed: ParsedScene, ids: Sequence[int] | AnyArray, age_s: float,
                     head: Header) -> tuple[PoseArray, PointCloud2]:
    """
    Return (PoseArray, PointCloud2) of a ParsedScene: `objects/poses` and `objects/attributes`.

    :param ids: (n,) uint32 instance ids.
    :param age_s: seconds from the stamp of the frame set to now; hidden objects are older.
    """
    objects = parsed.objects
    rows = np.zeros(len(objects), row_dtype(OBJECT_COLUMNS))
    rows['x'], rows['y'], rows['z'] = objects.translation.T
    for axis, name in enumerate(('qx', 'qy', 'qz', 'qw')):
        rows[name] = objects.rotation_xyzw[:, axis]
    for axis, name in enumerate(SIZE):
        rows[name] = objects.size[:, axis]
    rows['score'], rows['category'], rows['id'] = objects.score, objects.category, ids
    rows['member'] = objects.member
    rows['visible_ratio'], rows['residual_m'] = parsed.visible_ratio, parsed.residual_m
    rows['energy_delta'], rows['n_views'] = parsed.energy_delta, parsed.n_views
    # NaN where it was not estimated: a zero would claim perfection.
    rows['sigma_t'] = np.nan if parsed.sigma_t is None else parsed.sigma_t
    rows['sigma_r'] = np.nan if parsed.sigma_r is None else parsed.sigma_r
    hidden_s = np.zeros(len(objects)) if parsed.hidden_s is None else parsed.hidden_s
    rows['age_s'] = age_s + hidden_s
    rows['flags'] = (0 if parsed.converged else FLAG_SEARCH_STOPPED) | np.where(
        parsed.n_views == 1, FLAG_ONE_VIEW, 0) | np.where(
        rows['sigma_r'] > 3.1, FLAG_TURNED, 0) | np.where(hidden_s > 0, FLAG_HIDDEN, 0)
    return (pose_array_message(objects.translation, objects.rotation_xyzw, head),
            cloud_message(rows, head))


def points_message(points: AnyArray, head: Header, **bytes_of: AnyArray) -> PointCloud2:
    """Return the PointCloud2 of (n, 3) points, with a column of bytes for each further (n,)."""
    columns = [('x', 'f4'), ('y', 'f4'), ('z', 'f4'), *((name, 'u1') for name in bytes_of)]
    rows = np.zeros(len(points), row_dtype(columns))
    rows['x'], rows['y'], rows['z'] = np.asarray(points).reshape(-1, 3).T
    for name, values in bytes_of.items():
        rows[name] = values
    return cloud_message(rows, head)


def labels_json(models: Sequence[GenericModel], meshes: Sequence[Meshes],
                ids: Iterable[int] = (), objects: Candidates = Candidates.empty()) -> str:
    """
    Return the text of `objects/labels`, the meaning of class ids and instance ids.

    :param models: class id c is models[c - 1].
    :param meshes: Meshes of each.
    :param ids: instance ids of the latest objects.
    :param objects: these objects.
    """
    classes = {}
    for c, (model, family) in enumerate(zip(models, meshes), 1):
        members = [{'mesh': uri, 'sha256': digest,
                    'extents_m': [round(float(x), 6) for x in shape.extents],
                    'symmetry': [int(order) for order in shape.symmetry]}
                   for shape, (uri, digest) in zip(model.members, family)]
        classes[str(c)] = {'name': model.name, **members[0], 'members': members}
    found = {}
    for i, c, member in zip(ids, objects.category.tolist(), objects.member.tolist()):
        uri, digest = meshes[c - 1][member]
        found[str(int(i))] = {'category': models[c - 1].name, 'class_id': c, 'member': member,
                              'mesh': uri, 'sha256': digest}
    return json.dumps({'format': 'hooc-labels/1', 'classes': classes, 'objects': found})
