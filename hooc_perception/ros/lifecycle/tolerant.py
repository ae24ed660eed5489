# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node that survives a request for an impossible transition."""

from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn


class TolerantLifecycleNode(LifecycleNode):
    """
    Reject a transition that the state does not allow, as nodes of rclcpp do.

    LifecycleNode of rclpy 7.1 raises in the service's callback, which ends the process: a client
    that asks again because an answer was lost would kill the node.
    """

    # LifecycleNode calls its private method through this name and offers no other hook.
    def _LifecycleNodeMixin__change_state(self, transition_id: int) -> TransitionCallbackReturn:
        possible = {number for number, *_ in self._state_machine.available_transitions}
        if transition_id in possible:
            return super()._LifecycleNodeMixin__change_state(  # pyright: ignore[reportAttributeAccessIssue] # noqa: E501
                transition_id)
        self.get_logger().warning(
            f'transition {transition_id} is not possible while '
            f'{self._state_machine.current_state[1]}; nothing is done')
        return TransitionCallbackReturn.FAILURE
