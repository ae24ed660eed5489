# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node whose endpoints live from configuring to cleaning up."""

from collections.abc import Callable
import functools
import traceback
from typing import Any, cast, TypeVar

from hooc_perception.ros.health.diagnostics import Diagnostics
from hooc_perception.ros.lifecycle.spin import raise_interrupt
from hooc_perception.ros.lifecycle.tolerant import TolerantLifecycleNode
from hooc_perception.ros.qos import overridable, qos
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecyclePublisher
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer

T = TypeVar('T')
# The least pause between two tracebacks in the log.
TRACEBACK_PAUSE_S = 60.0


class EndpointNode(TolerantLifecycleNode):
    """
    Make endpoints with the QoS of the table of topics, and destroy all of them together.

    :ivar diagnostics: the node's Diagnostics, published in every lifecycle state.
    :ivar published: {topic: its row in the table of topics} of the lifecycle publishers.
    """

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Create the node in the namespace /hooc; `kwargs` go to rclpy.node.Node."""
        super().__init__(name, **{'namespace': '/hooc', **kwargs})
        self.diagnostics = Diagnostics(self)
        self._destructors: list[Callable[[], object]] = []
        self.published: dict[str, str] = {}

    def now_ns(self) -> int:
        """Return the node's time (simulated with use_sim_time) in nanoseconds."""
        return self.get_clock().now().nanoseconds

    def publisher(self, kind: type, topic: str, name: str | None = None) -> LifecyclePublisher:
        """Return a lifecycle publisher on `name` with the QoS of the table's row `topic`."""
        # rclpy annotates it as a plain Publisher.
        made = cast(LifecyclePublisher, self.create_lifecycle_publisher(
            kind, name or topic, qos(topic), qos_overriding_options=overridable()))
        self.published[name or topic] = topic
        return self.owned(self.destroy_lifecycle_publisher, made)

    def subscription(self, kind: type, topic: str, callback: Callable[[Any], object],
                     name: str | None = None) -> Subscription:
        """Return a subscription on `name` with the QoS of the table's row `topic`."""
        return self.owned(self.destroy_subscription, self.create_subscription(
            kind, name or topic, self.guarded(callback), qos(topic),
            qos_overriding_options=overridable()))

    def publishers_of(self, topic: str) -> int:
        """
        Return the number of publishers of a topic under the name that it is remapped to.

        :param topic: as it was subscribed; rclpy's count_publishers does not remap it.
        """
        return self.count_publishers(self.resolve_topic_name(topic))

    def create_timer(self, timer_period_sec: float, callback: Callable[[], object],
                     *args: Any, **kwargs: Any) -> Timer:
        """Return a timer as rclpy makes it, whose callback cannot end the node."""
        return super().create_timer(timer_period_sec, self.guarded(
            callback, 'timer', 'it is tried again at the next tick'), *args, **kwargs)

    def service(self, kind: type, name: str, callback: Callable[[Any, Any], Any]) -> Service:
        """
        Offer a service whose responses have `success` and `message`, until clean-up.

        An unexpected exception in the callback fails the call, not the node.
        """
        def answer(request: Any, response: Any) -> Any:
            if not self.guarded(callback, f'service {name}', 'the call fails')(request, response):
                response.success = False
                response.message = 'an unexpected error, which the log of the node shows'
            return response
        return self.owned(self.destroy_service, self.create_service(kind, name, answer))

    def steady_timer(self, seconds: float, callback: Callable[[], object]) -> Timer:
        """Return a timer by the steady clock: simulated time may stop or jump back."""
        return self.owned(self.destroy_timer, self.create_timer(
            seconds, callback, clock=Clock(clock_type=ClockType.STEADY_TIME)))

    def owned(self, destroy: Callable[[T], object], made: T) -> T:
        """Return `made`; `destroy(made)` is called on clean-up, in reverse order of creation."""
        self._destructors.append(functools.partial(destroy, made))
        return made

    def destroy_endpoints(self) -> None:
        """Destroy everything that was made since the last call."""
        self.published.clear()
        while self._destructors:
            self._destructors.pop()()

    def guarded(self, callback: Callable[..., object], thing: str = 'input',
                loss: str = 'the message is dropped') -> Callable[..., Any]:
        """
        Return a callback that survives any exception; it returns whether there was none.

        A node runs for days: an unexpected exception drops one message, is reported and counted,
        and its traceback is logged.

        :param thing: what /diagnostics names.
        :param loss: what the error costs, for the log.
        """
        @functools.wraps(callback)
        def survive(*args: Any) -> bool:
            try:
                callback(*args)
                self.diagnostics.over(thing, 'unexpected')
                return True
            except Exception as error:
                raise_interrupt(error)
                self.diagnostics.error(thing, 'unexpected', (
                    f'unexpected {type(error).__name__}: {error}; {loss}; please report this '
                    'with the traceback'))
                self.get_logger().info(traceback.format_exc(),
                                       throttle_duration_sec=TRACEBACK_PAUSE_S)
                return False
        return survive
