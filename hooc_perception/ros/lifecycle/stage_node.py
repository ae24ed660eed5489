# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What all lifecycle nodes share: parameters, and transitions that explain their failures."""

from collections.abc import Callable
import json
import os
import time
from typing import Any, cast, Generic, TypeVar

from hooc_perception.chain import PROFILES, STAGES_OF
from hooc_perception.core.config import Config
from hooc_perception.errors import HoocError
from hooc_perception.ros.health.diagnostics import WARN
from hooc_perception.ros.health.downstream import wait_for_consumers
from hooc_perception.ros.lifecycle.autostart import Autostart
from hooc_perception.ros.lifecycle.endpoints import EndpointNode
from hooc_perception.ros.lifecycle.memory import give_back_memory
from hooc_perception.ros.lifecycle.misaddressed import inert, misaddressed
from hooc_perception.ros.lifecycle.parameters import Parameters
from hooc_perception.ros.lifecycle.spin import raise_interrupt
from hooc_perception.ros.lifecycle.stage_config import NodeConfig, StageConfig
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

# The last messages of a node vanish with its publishers: they get this long to arrive.
FAREWELL_S = 1.0

ConfigT = TypeVar('ConfigT', bound=NodeConfig, covariant=True)
WorkT = TypeVar('WorkT', covariant=True)


class StageNode(EndpointNode, Generic[ConfigT, WorkT]):
    """
    A lifecycle node that explains why a transition fails and cleans up after itself.

    Sub-classes name their CONFIG and implement `configure()`, which builds the object that does
    the work together with its endpoints; they may implement `activate()`, `deactivate()` and
    `cleanup()`. A HoocError there makes the transition fail with its sentence in the log.

    :cvar CONFIG: class of the node's own parameters.
    :ivar stages: the stages whose parameters the node has.
    :ivar parameters: the declared Parameters, those of the stages included.
    :ivar active: whether the node is active.
    :ivar since: monotonic seconds of the last activation.
    """

    CONFIG: type[NodeConfig] = StageConfig

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Declare all parameters; `kwargs` go to rclpy.node.Node."""
        super().__init__(name, **kwargs)
        self.active, self.since = False, 0.0
        self._work: WorkT | None = None
        self.stages = STAGES_OF.get(name, ())
        self.parameters = Parameters(self, self.is_unconfigured)
        self.parameters.declare('', self.CONFIG())
        for stage, default in self._stage_defaults().items():
            self.parameters.declare(stage, default)
        if self.parameters.get('', NodeConfig).autostart:
            Autostart(self)

    @property
    def config(self) -> ConfigT:
        """Return the node's own Config as it is now."""
        return cast(ConfigT, self.parameters[''])

    @property
    def work(self) -> WorkT:
        """Return what `configure` built; RuntimeError while there is nothing."""
        if self._work is None:
            raise RuntimeError(f'{self.get_name()} is not configured')
        return self._work

    def is_unconfigured(self) -> bool:
        """Return whether start-up parameters may still change."""
        machine = getattr(self, '_state_machine', None)
        return machine is None or machine.current_state[1] == 'unconfigured'

    def is_inactive(self) -> bool:
        """Return whether the node is configured, but not active."""
        return self._state_machine.current_state[1] == 'inactive'

    def _stage_defaults(self) -> dict[str, Config]:
        """Return {stage: Config} of the profile that parameters or the model name."""
        if not self.stages:
            return {}
        from hooc_perception.core.profiles import profile
        config = cast(StageConfig, self.config)
        name = config.profile
        if not name:
            try:
                with open(os.path.join(config.model, 'model.json'), encoding='utf-8') as file:
                    name = json.load(file).get('profile')
            except (OSError, ValueError, AttributeError):
                pass    # configuring reports what is wrong with the model
        chosen = profile(name if name in PROFILES else 'best')
        return {stage: chosen.stage(stage) for stage in self.stages}

    # Hooks of the sub-classes.

    def configure(self) -> WorkT:
        """Build and return the object that does the work, with its endpoints."""
        raise NotImplementedError

    def activate(self) -> None:
        """Start to work."""

    def deactivate(self) -> None:
        """Stop working."""

    def cleanup(self) -> None:
        """Forget what outlives `work`."""

    # Transitions.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build everything, or report why not and undo what was built."""
        def build() -> None:
            self._reject_inert()
            self._work = self.configure()
            LifecycleNode.on_configure(self, state)
        if self._attempt('configure', build):
            self._report_misaddressed()
            self._say_inactive('configured')
            return TransitionCallbackReturn.SUCCESS
        self._destroy()
        return TransitionCallbackReturn.FAILURE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the publishers publish and the callbacks work."""
        def start() -> None:
            self.since = time.monotonic()
            LifecycleNode.on_activate(self, state)
            if self.config.wait_for_stages:
                wait_for_consumers(self, self.published)
            self.activate()
            self.active = True
            self.diagnostics.state('node', 'ok', 'ok')
        if self._attempt('activate', start):
            return TransitionCallbackReturn.SUCCESS
        LifecycleNode.on_deactivate(self, state)    # a node that stays inactive is silent
        return TransitionCallbackReturn.FAILURE

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Silence the node; what was built stays."""
        if self._stop():
            self._say_inactive('deactivated')
        return LifecycleNode.on_deactivate(self, state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget what was built."""
        self._destroy()
        self._say_inactive('cleaned up', 'configure and activate it')
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop for good."""
        self.leave()
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Fall back to unconfigured, from where one can try again."""
        self.leave()
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def leave(self) -> None:
        """Deactivate the node if it is active, and let its last messages arrive everywhere."""
        if self._stop():
            deadline = time.monotonic() + FAREWELL_S
            for publisher in self.publishers:
                publisher.wait_for_all_acked(Duration(
                    seconds=max(0.0, deadline - time.monotonic())))

    def _stop(self) -> bool:
        """Deactivate while the publishers still publish; return whether an active node did."""
        was, self.active = self.active, False
        return was and self._attempt('deactivate', self.deactivate)

    def _say_inactive(self, what: str, fix: str = 'activate it') -> None:
        self.diagnostics.state('node', 'not_active', f'{what}, so nothing is done: {fix}', WARN)

    def _attempt(self, what: str, step: Callable[[], object]) -> bool:
        """Return whether `step()` succeeded; log why otherwise."""
        try:
            step()
            return True
        except HoocError as error:
            self.diagnostics.failed(f'{what}_failed', str(error))
        except Exception as error:
            raise_interrupt(error)
            # rclpy would swallow it, and the transition would fail without a word.
            self.diagnostics.failed(f'{what}_failed',
                                    f'unexpected {type(error).__name__}: {error}')
        return False

    def _reject_inert(self) -> None:
        """Raise HoocError if a parameter was given that the profile's method does not have."""
        wrong = inert(self._parameter_overrides, {stage: self.parameters[stage]
                                                  for stage in self.stages})
        if wrong:
            raise HoocError('; '.join(wrong))

    def _report_misaddressed(self) -> None:
        """Report parameters that were given and that no node knows."""
        wrong = misaddressed(self._parameter_overrides, self._parameters)
        if wrong:
            self.diagnostics.warn('parameters', 'unknown_parameter', '; '.join(wrong))

    def _destroy(self) -> None:
        """Destroy the endpoints, drop what was built and give its memory back."""
        self.cleanup()
        self.destroy_endpoints()
        self._work = None
        give_back_memory()
