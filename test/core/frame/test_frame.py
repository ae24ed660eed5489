# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The frame: everything derived once, on demand, and nothing kept elsewhere."""

from dataclasses import replace
import gc
import weakref

from hooc_perception.core.frame.frame import Frame
import numpy as np


def test_what_is_derived_is_derived_once(desk):
    for name in ('cloud', 'patch', 'field', 'evidence', 'coarse', 'coarsest'):
        assert getattr(desk.frame, name) is getattr(desk.frame, name)


def test_equal_inputs_give_equal_frames(desk):
    for inputs in ((replace(desk.observation), desk.probabilities, desk.models),
                   (desk.observation, replace(desk.probabilities), desk.models),
                   (desk.observation, desk.probabilities, desk.models[:2])):
        other = Frame(*inputs)
        assert other.cloud is not desk.frame.cloud
        np.testing.assert_array_equal(other.cloud.points, desk.frame.cloud.points)


def test_nothing_outlives_it(desk):
    observation = replace(desk.observation)
    frame = Frame(observation, desk.probabilities, desk.models)
    evidence, alive = weakref.ref(frame.evidence), weakref.ref(observation)
    del observation
    assert alive() is not None and evidence() is not None
    del frame
    gc.collect()
    assert evidence() is None and alive() is None


def test_an_empty_table_has_no_field(empty_desk):
    assert empty_desk.frame.field is None
    assert len(empty_desk.frame.patch) == 0
    assert not empty_desk.frame.evidence.views.foreground.any()
