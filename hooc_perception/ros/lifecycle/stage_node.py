# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the lifecycle nodes share: parameters, transitions that explain failures, endpoints."""

from dataclasses import dataclass
import functools
import json
import os
import time
import traceback

from hooc_perception.chain import PROFILES
from hooc_perception.core.config import Config, param
from hooc_perception.errors import HoocError
from hooc_perception.ros.health.diagnostics import Diagnostics, WARN
from hooc_perception.ros.health.downstream import wait_for_consumers
from hooc_perception.ros.lifecycle.memory import give_back_memory
from hooc_perception.ros.lifecycle.misaddressed import inert, misaddressed
from hooc_perception.ros.lifecycle.parameters import fixed_param, Parameters
from hooc_perception.ros.lifecycle.spin import raise_interrupt
from hooc_perception.ros.lifecycle.tolerant import TolerantLifecycleNode
from hooc_perception.ros.qos import overridable, qos
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

# What a node says last goes with its publishers: so long may its arrival take.
FAREWELL_S = 1.0


@dataclass(frozen=True)
class StageConfig(Config):
    """Parameters of every node of the chain."""

    model: str = param('', 'Folder that `hooc train` wrote.')
    profile: str = fixed_param(
        '', 'Which method: paper, best or fast; empty takes the one that the model was trained '
        'for. Gives the defaults of the stages.', choices=('',) + PROFILES)
    cameras: tuple = param((), 'Names of the cameras, the same order in every node; empty takes '
                           "the model's.")
    target_frame: str = param('table', 'Frame of all results: z up, z = 0 is the table top.')
    seed: int = param(0, 'Seed of every random choice; the stages derive theirs from it.',
                      '', 0, 2 ** 31 - 1)
    warm_up: bool = param(True, 'Try the stage on a made-up scene while configuring, so that the '
                          'first answer does not wait for compiled code.')
    wait_for_stages: bool = param(
        False, 'Activating waits, 30 s at most, until the other stages listen to what this one '
        'publishes: for recordings, of which no frame set comes a second time.')


class StageNode(TolerantLifecycleNode):
    """
    A lifecycle node that explains why a transition fails and cleans up behind itself.

    Sub-classes implement `configure()` (build the core object and the endpoints) and may
    implement `activate()`, `deactivate()` and `cleanup()`; any HoocError there makes the
    transition fail with its sentence in the log.

    :param config: the node's own Config with its defaults.
    :param stages: names of the profile's Configs that the node uses; then `config` is a
        StageConfig.
    """

    def __init__(self, name, config, stages=(), **kwargs):
        """Declare all parameters; `kwargs` go to rclpy.node.Node."""
        super().__init__(name, **{'namespace': '/hooc', **kwargs})
        self.active = False
        self.since = 0.0            # monotonic seconds of the last activation
        self._mine = []
        self._topics = {}           # what is published -> its row in the table of topics
        self._before = set(vars(self)) | {'parameters', 'diagnostics'}
        self.stages = tuple(stages)
        self.parameters = Parameters(self, self.is_unconfigured)
        self.diagnostics = Diagnostics(self)
        self.parameters.declare('', config)
        for stage, default in self._stage_defaults(stages).items():
            self.parameters.declare(stage, default)

    @property
    def config(self):
        """Return the node's own Config as it is now."""
        return self.parameters['']

    def now_ns(self):
        """Return the node's time (simulated with use_sim_time) in nanoseconds."""
        return self.get_clock().now().nanoseconds

    def is_unconfigured(self):
        """Return whether start-up parameters may still change."""
        machine = getattr(self, '_state_machine', None)
        return machine is None or machine.current_state[1] == 'unconfigured'

    def _stage_defaults(self, stages):
        """Return {stage: Config} of the profile that parameters or the model name."""
        if not stages:
            return {}
        from hooc_perception.core.profiles import profile
        name = self.config.profile
        if not name:
            try:
                with open(os.path.join(self.config.model, 'model.json'), encoding='utf-8') as file:
                    name = json.load(file).get('profile')
            except (OSError, ValueError, AttributeError):
                pass    # configuring says what is wrong with the model
        chosen = profile(name if name in PROFILES else 'best')
        return {stage: chosen.stage(stage) for stage in stages}

    # Endpoints, made while configuring and destroyed by cleaning up.

    def publisher(self, kind, topic, name=None):
        """Return a lifecycle publisher on `name` with the QoS of the table's row `topic`."""
        made = self.create_lifecycle_publisher(kind, name or topic, qos(topic),
                                               qos_overriding_options=overridable())
        self._mine.append((self.destroy_lifecycle_publisher, made))
        self._topics[name or topic] = topic
        return made

    def subscription(self, kind, topic, callback, name=None):
        """Return a subscription on `name` with the QoS of the table's row `topic`."""
        made = self.create_subscription(kind, name or topic, self.guarded(callback), qos(topic),
                                        qos_overriding_options=overridable())
        self._mine.append((self.destroy_subscription, made))
        return made

    def owned(self, destroy, made):
        """Have `destroy(made)` called by cleaning up; return `made`."""
        self._mine.append((destroy, made))
        return made

    def steady_timer(self, seconds, callback):
        """Return a timer by the steady clock: simulated time may stand still or be set back."""
        made = self.create_timer(seconds, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
        return self.owned(self.destroy_timer, made)

    def guarded(self, callback, thing='input', loss='the message is dropped'):
        """
        Return a callback that survives whatever happens in it; it returns whether all went well.

        A node runs for days: an error that nobody has thought of costs one message, is said and
        counted, and its traceback logged.

        :param thing, loss: what /diagnostics names, and what the error costs.
        """
        @functools.wraps(callback)
        def survive(*args):
            try:
                callback(*args)
                return True
            except Exception as error:
                raise_interrupt(error)
                self.diagnostics.error(thing, 'unexpected', (
                    f'unexpected {type(error).__name__}: {error}; {loss}; please report this '
                    'with the traceback'))
                self.get_logger().info(traceback.format_exc(), throttle_duration_sec=60.0)
                return False
        return survive

    # Hooks of the sub-classes.

    def configure(self):
        """Build the core object and the endpoints."""

    def activate(self):
        """Start to work."""

    def deactivate(self):
        """Stop to work."""

    def cleanup(self):
        """Forget what was built."""

    # Transitions.

    def on_configure(self, state):
        """Build, or say why not and undo the half of it."""
        self._before = set(vars(self))

        def build():
            self._reject_inert()
            self.configure()
            LifecycleNode.on_configure(self, state)
        if self._attempt('configure', build):
            self._report_misaddressed()
            self._say_inactive('configured')
            return TransitionCallbackReturn.SUCCESS
        self._destroy()
        return TransitionCallbackReturn.FAILURE

    def on_activate(self, state):
        """Let the publishers speak and the callbacks work."""
        def start():
            self.since = time.monotonic()
            LifecycleNode.on_activate(self, state)
            if getattr(self.config, 'wait_for_stages', False):
                wait_for_consumers(self, self._topics)
            self.activate()
            self.active = True
            self.diagnostics.state('node', 'ok', 'ok')
        if self._attempt('activate', start):
            return TransitionCallbackReturn.SUCCESS
        LifecycleNode.on_deactivate(self, state)    # a node that stays inactive is silent
        return TransitionCallbackReturn.FAILURE

    def on_deactivate(self, state):
        """Silence the node; what was built stays."""
        if self._stop():
            self._say_inactive('deactivated')
        return LifecycleNode.on_deactivate(self, state)

    def on_cleanup(self, state):
        """Forget what was built."""
        self._destroy()
        self._say_inactive('cleaned up', 'configure and activate it')
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        """Stop for good."""
        self.leave()
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        """Fall back to unconfigured, from where one can try again."""
        self.leave()
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def leave(self):
        """Do what deactivating does if the node is active, and let it arrive everywhere."""
        if self._stop():
            deadline = time.monotonic() + FAREWELL_S
            for publisher in self.publishers:
                publisher.wait_for_all_acked(Duration(
                    seconds=max(0.0, deadline - time.monotonic())))

    def _stop(self):
        """Deactivate while the publishers still speak; return whether an active node did."""
        was, self.active = self.active, False
        return was and self._attempt('deactivate', self.deactivate)

    def _say_inactive(self, what, mend='activate it'):
        self.diagnostics.state('node', 'not_active', f'{what}, so nothing is done: {mend}', WARN)

    def _attempt(self, what, step):
        """Return whether `step()` went through; log the sentence or the surprise otherwise."""
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

    def _reject_inert(self):
        """Raise HoocError where a parameter was given that the profile's method does not have."""
        wrong = inert(self._parameter_overrides, {stage: self.parameters[stage]
                                                  for stage in self.stages})
        if wrong:
            raise HoocError('; '.join(wrong))

    def _report_misaddressed(self):
        """Say which parameters were given and are taken by nobody."""
        wrong = misaddressed(self._parameter_overrides, self._parameters)
        if wrong:
            self.diagnostics.warn('parameters', 'unknown_parameter', '; '.join(wrong))

    def _destroy(self):
        """Destroy the endpoints, forget what was built and give its memory back."""
        self.cleanup()
        self._topics.clear()
        while self._mine:
            destroy, made = self._mine.pop()
            destroy(made)
            del made
        for name in set(vars(self)) - self._before:
            if not name.startswith('_'):
                delattr(self, name)
        give_back_memory()
