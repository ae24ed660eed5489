# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What both later stages derive is derived once, and forgotten with its inputs."""

from dataclasses import replace
import gc
import weakref

from hooc_perception.core.frame.workspace import Workspace, workspace_of
import numpy as np


def test_asked_again_for_the_same_it_is_the_same(desk):
    space = workspace_of(desk.observation, desk.probabilities, desk.models)
    assert workspace_of(desk.observation, desk.probabilities, desk.models) is space


def test_other_inputs_give_another(desk):
    for inputs in ((replace(desk.observation), desk.probabilities, desk.models),
                   (desk.observation, replace(desk.probabilities), desk.models),
                   (desk.observation, desk.probabilities, desk.models[:2])):
        space = workspace_of(desk.observation, desk.probabilities, desk.models)
        other = workspace_of(*inputs)
        assert other is not space
        np.testing.assert_array_equal(other.cloud.points, space.cloud.points)
    assert workspace_of(desk.observation, desk.probabilities, desk.models) is not space


def test_it_does_not_outlive_its_observation(desk):
    observation = replace(desk.observation)
    space = weakref.ref(workspace_of(observation, desk.probabilities, desk.models))
    assert space() is not None
    del observation
    gc.collect()
    assert space() is None


def test_the_death_of_an_older_input_leaves_the_latest_alone(desk):
    older = replace(desk.observation)
    workspace_of(older, desk.probabilities, desk.models)
    latest = workspace_of(desk.observation, desk.probabilities, desk.models)
    del older
    gc.collect()
    assert workspace_of(desk.observation, desk.probabilities, desk.models) is latest


def test_an_empty_table_has_no_field(empty_desk):
    space = Workspace(empty_desk.observation, empty_desk.probabilities, empty_desk.models)
    assert space.field is None
    assert len(space.patch) == 0
    assert not space.evidence.foreground.any()
