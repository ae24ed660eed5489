# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The method in one screen: from depth images to the objects on the table.

`Parser` is the only place that sequences the stages. Commands, nodes, training and evaluation
call it, all at once (`parse`) or stage by stage.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import fspath, PathLike
import time
from typing import Any, TYPE_CHECKING, TypeVar

from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.classification.classify import classify, KIND_PAPER
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import inverse, stage_rng
from hooc_perception.core.incremental.changes import unseen
from hooc_perception.core.incremental.memory import Memory, next_step, Past, Step
from hooc_perception.core.incremental.watch import watch
from hooc_perception.core.parsing.uncertainty import pose_uncertainty
from hooc_perception.core.parsing.verifier import Verifier
from hooc_perception.core.profiles import Profile, with_overrides
from hooc_perception.core.profiles import profile as profile_of
from hooc_perception.core.segment.observe import observe, require_table
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.segment.table import next_table, table_pose
from hooc_perception.core.symmetry import canonical_objects
from hooc_perception.core.types import (
    Candidates,
    DepthView,
    GenericModel,
    Observation,
    ParsedScene,
    PixelProbabilities,
    RectifiedView,
)
from hooc_perception.errors import HoocError
from hooc_perception.scene import Scene, scene_of
import numpy as np

if TYPE_CHECKING:
    from hooc_perception.trained.folder import ModelFolder

T = TypeVar('T')


class Parser:
    """
    Finds the objects of a model's categories in depth images.

    :param models: generic models; class id c is models[c - 1].
    :param classifier: arrays of the pixel classifier and the verifier, as training wrote them.
    :param profile: the method and its parameters.
    :param max_instances: most objects per category, 0 = no limit.
    :param sigmas: whether to estimate the uncertainty of poses.
    :raises HoocError: where the profile sets parameters that the classifier does not have.
    """

    def __init__(self, models: Sequence[GenericModel], classifier: Mapping[str, AnyArray],
                 profile: Profile = Profile(), max_instances: int = 0,
                 sigmas: bool = False) -> None:
        self.models, self.classifier, self.profile = tuple(models), classifier, profile
        self.max_instances, self.sigmas = max_instances, sigmas
        # Whether the background class stands for things of no category as well.
        self._strangers = bool(int(classifier.get('strangers', 0)))
        self._verifier = Verifier.from_arrays(classifier)
        self.method = profile.method(self._verifier)
        _check_classify(classifier, profile)

    @classmethod
    def load(cls, model: 'str | PathLike[str] | ModelFolder', profile: str | None = None, *,
             parameters: Mapping[str, Any] | None = None, max_instances: int | None = None,
             sigmas: bool = True) -> 'Parser':
        """
        Return the Parser of a MODEL folder.

        :param model: folder that `hooc train` wrote, or what `load_model_folder` returned.
        :param profile: `paper`, `best` or `fast`; default the one that it was trained for.
        :param parameters: {'stage.name': value}, changes to the profile (docs/nodes.md).
        :param max_instances: most objects per category, 0 = no limit; default the model's.
        :param sigmas: whether to estimate the uncertainty of poses, which takes longer.
        :raises HoocError: a damaged model, an unknown profile, or a parameter that the profile
            does not have.
        """
        from hooc_perception.trained.folder import load_model_folder, ModelFolder
        folder = model if isinstance(model, ModelFolder) else load_model_folder(fspath(model))
        chosen = with_overrides(profile_of(profile or folder.profile), parameters or {})
        limit = folder.max_instances if max_instances is None else max_instances
        return cls(folder.models, folder.classifier, chosen, limit, sigmas)

    def changed(self, profile: Profile | None = None, sigmas: bool | None = None) -> 'Parser':
        """Return a Parser of the same model with other settings; itself where nothing changes."""
        profile = self.profile if profile is None else profile
        sigmas = self.sigmas if sigmas is None else sigmas
        if (profile, sigmas) == (self.profile, self.sigmas):
            return self
        return Parser(self.models, self.classifier, profile, self.max_instances, sigmas)

    def parse(self, views: Sequence[DepthView], seed: int = 0,
              change_pool: Callable[[Candidates], Candidates] | None = None) -> Scene:
        """
        Return the objects that one frame set shows.

        :param views: one raw depth image per camera.
        :param seed: the same seed and input give the same result, whatever the thread count.
        :param change_pool: applied between stages 3 and 4, for experiments such as setting B of
            the paper.
        :raises HoocError: where the images cannot be used, with the reason.
        """
        lap = _Laps()
        observation = lap('observe', self.observe(views))
        frame = self.frame(observation, lap('classify', self.classify(observation)))
        pool = lap('propose', self.propose(frame, seed))
        if change_pool is not None:
            T = observation.T_target_table
            pool = change_pool(pool.moved(T)).moved(None if T is None else inverse(T))
        return self._scene(self.decide(frame, pool, seed), observation, lap)

    def update(self, views: Sequence[DepthView], previous: Scene | None = None, seed: int = 0,
               full: bool = False) -> Scene:
        """
        Return the objects that one frame set shows, given what was found in the one before.

        While nothing changes, readings are accumulated and the objects stay as they are; what
        changes is decided anew, the rest is held. Where too much has changed, this is `parse`.

        :param views: one raw depth image per camera.
        :param previous: what this function returned for the frame set before, in the same
            target frame; None = this is the first.
        :param full: decide everything anew on what has been accumulated.
        :raises HoocError: where the images cannot be used, with the reason.
        """
        lap, config = _Laps(), self.profile.observe
        past = None if previous is None else previous.past
        rectified = [rectify(view, config) for view in views]
        table = next_table(None if past is None else past.table, rectified, config)
        watched = lap('observe', watch(rectified, None if past is None else past.watched, config,
                                       table.T_target_table))
        observation = require_table(watched.observation)
        step = self.step(None if past is None else past.memory, observation)

        def frame() -> Frame:
            return self.frame(observation, lap('classify', self.classify(observation)))

        parsed = self.follow(step, None if past is None else past.parsed, frame,
                             lambda seen: lap('propose', self.propose(seen, seed)), seed, full)
        return replace(self._scene(parsed, observation, lap),
                       past=Past(watched, table, step.memory, parsed))

    def step(self, memory: Memory | None, observation: Observation) -> Step:
        """Return what a frame set asks for beside the one before, see `next_step`."""
        return next_step(memory, observation, self.profile.observe.accumulate)

    def follow(self, step: Step, before: ParsedScene | None, frame: Callable[[], Frame],
               pool: Callable[[Frame], Candidates], seed: int = 0, full: bool = False,
               ) -> ParsedScene:
        """
        Stage 4 of a frame set that follows another one, in the table frame.

        :param step: of this frame set.
        :param before: the answer to the frame set before; None = there is none.
        :param frame: returns the Frame; not called where nothing has changed.
        :param pool: returns the candidates of stage 3 for it; called for a full parse only.
        :param full: decide everything anew where nothing has changed, too; what is not clearly
            better does not replace the answer.
        """
        if before is None or step.full:
            seen = frame()
            return self.decide(seen, pool(seen), seed)
        if step.region is None and not full:
            return replace(before, seconds={})
        seen, extra, region = frame(), Candidates.empty(), step.region
        if full:
            region = tuple(~unseen(view) for view in seen.observation.views)
            extra = pool(seen)
        assert region is not None
        return self._finished(seen, self.method.revise(
            seen, before, region, seed, self.max_instances, full or step.settled, extra), seed)

    def _scene(self, parsed: ParsedScene, observation: Observation, lap: '_Laps') -> Scene:
        """Return the Scene in the target frame."""
        return scene_of(parsed.moved(observation.T_target_table).timed(**lap.seconds),
                        observation.in_target_frame(), self.models)

    def observe(self, views: Sequence[DepthView | RectifiedView]) -> Observation:
        """
        Stage 1: rectify the views, level them on the support plane, find the foreground.

        :raises HoocError: where no view holds a reading or none shows the table at z = 0.
        """
        config = self.profile.observe
        rectified = [rectify(view, config) if isinstance(view, DepthView) else view
                     for view in views]
        return require_table(observe(rectified, config, table_pose(rectified, config)))

    def classify(self, observation: Observation) -> PixelProbabilities:
        """Stage 2: class probabilities of the foreground pixels."""
        return classify(observation, self.classifier, self.profile.classify)

    def frame(self, observation: Observation, probabilities: PixelProbabilities) -> Frame:
        """Return what stages 3 and 4 take: observation, probabilities and models."""
        weight = self.method.pixels.unknown_weight if self._strangers else 0.0
        return Frame(observation, probabilities, self.models, weight)

    def propose(self, frame: Frame, seed: int = 0) -> Candidates:
        """Stage 3: pose candidates of every category."""
        return self.method.propose(frame, seed)

    def decide(self, frame: Frame, pool: Candidates, seed: int = 0) -> ParsedScene:
        """Stage 4: the subset of candidates that explains the frame, with scores and sigmas."""
        parsed = self.method.parse(frame, pool, seed, self.max_instances)
        return self._finished(frame, self.method.calibrate(frame, parsed), seed)

    def _finished(self, frame: Frame, parsed: ParsedScene, seed: int) -> ParsedScene:
        """Return a ParsedScene with the sigmas that it lacks and things of no category."""
        if self.sigmas:
            parsed = self._with_sigmas(frame, parsed, seed)
        parsed = replace(parsed, objects=canonical_objects(parsed.objects, self.models))
        return self.method.open_world(frame, parsed, self._strangers)

    def _with_sigmas(self, frame: Frame, parsed: ParsedScene, seed: int) -> ParsedScene:
        """Return a ParsedScene with the uncertainty of each pose that has none yet."""
        start = time.monotonic()
        n = len(parsed.objects)
        known = np.zeros(n, bool) if parsed.sigma_t is None else np.isfinite(parsed.sigma_t)
        new = pose_uncertainty(frame, parsed, self.method.pixels, self.method.objects,
                               stage_rng(seed, 'sigmas'), np.flatnonzero(~known))
        old = (parsed.sigma_t, parsed.sigma_r) if known.any() else new
        sigma_t, sigma_r = (np.where(known, a, b) for a, b in zip(old, new))
        return replace(parsed, sigma_t=sigma_t, sigma_r=sigma_r).timed(
            sigmas=time.monotonic() - start)


class _Laps:
    """Wall time of the stages, one after the other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._clock = time.monotonic()

    def __call__(self, stage: str, result: T) -> T:
        now = time.monotonic()
        self.seconds[stage], self._clock = now - self._clock, now
        return result


def _check_classify(classifier: Mapping[str, AnyArray], profile: Profile) -> None:
    """Reject parameters of stage 2 that the classifier of the paper does not have."""
    if not np.array_equal(classifier.get('kind', -1), KIND_PAPER):
        return
    defaults = profile_of(profile.name).classify.values()
    for name, value in profile.classify.values().items():
        if value != defaults[name]:
            raise HoocError(f"parameter classify.{name} has no effect: the model holds the "
                            "paper's forest, which reads every pixel and smooths nothing; leave "
                            'it out or train the model for the profile best')
