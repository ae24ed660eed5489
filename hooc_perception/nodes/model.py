# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes take from the MODEL folder."""

from dataclasses import replace
from typing import Any

from hooc_perception.chain import topic_token
from hooc_perception.core.profiles import Profile, profile
from hooc_perception.errors import HoocError
from hooc_perception.parser import Parser
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.trained.folder import load_model_folder, ModelFolder


def model_of(node: StageNode[StageConfig, Any]) -> ModelFolder:
    """
    Return the ModelFolder that a StageNode's parameters name; /diagnostics show which it is.

    :raises HoocError: if it cannot be read.
    """
    if not node.config.model:
        raise HoocError('parameter model is empty; set it to the folder that hooc train wrote')
    model = load_model_folder(node.config.model)
    node.diagnostics.ok('model', name=model.name, profile=node.config.profile or model.profile,
                        categories=', '.join(m.name for m in model.models))
    return model


def parser_of(node: StageNode[StageConfig, Any], model: ModelFolder,
              max_instances: int | None = None, sigmas: bool = False) -> Parser:
    """
    Return the Parser of a model with the node's stage parameters.

    :raises HoocError: if the model's classifier does not have such parameters.
    """
    return Parser(model.models, model.classifier, node_profile(node, model),
                  model.max_instances if max_instances is None else max_instances, sigmas)


def mesh_uris(model: ModelFolder) -> list[list[tuple[str, str]]]:
    """Return (URI, sha256 in hex) of each member of the family of each category."""
    return [[(path.resolve().as_uri(), digest) for path, digest in (
        model.mesh_of(generic.name, k) for k in range(len(generic.members)))]
        for generic in model.models]


def node_profile(node: StageNode[StageConfig, Any], model: ModelFolder) -> Profile:
    """Return the profile of a StageNode, with the parameters of its stages as they are now."""
    chosen = profile(node.config.profile or model.profile)
    return replace(chosen, **{stage: node.parameters[stage] for stage in node.stages})


def camera_names(node: StageNode[StageConfig, Any],
                 model: ModelFolder | None = None) -> tuple[str, ...]:
    """
    Return the camera names of a StageNode's parameters, or else of its model.

    :param model: the node's model if it is loaded already.
    :raises HoocError: if there are none, or topics cannot be named after them.
    """
    names = node.config.cameras or tuple(
        camera.name for camera in (model or model_of(node)).cameras)
    if not names:
        raise HoocError('parameter cameras is empty and the model names none; set cameras')
    if len(set(names)) != len(names):
        raise HoocError(f'parameter cameras names one twice: {", ".join(names)}')
    for name in names:
        # A name may have several tokens, as left/wrist.
        fits = '/'.join(map(topic_token, name.split('/')))
        if name != fits or not all(name.split('/')):
            raise HoocError(f'parameter cameras names {name!r}, but topics are named after it: '
                            'use letters, digits and _, and no digit first'
                            + (f', such as {fits}' if all(fits.split('/')) else ''))
    return names
