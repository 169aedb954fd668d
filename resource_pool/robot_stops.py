"""Emergency stops by operators: stop a robot, ask and watch whether it is stopped, lift the stop."""

from __future__ import annotations

from collections.abc import Callable

from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.asking import ask_until_answered
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.printable_text import printable
from backbone.wire import Message
from resource_pool.stop_messages import AskStop, EmergencyStop, LiftStop, StopState

MOST_REASON_CHARACTERS = 400  # chosen: a person reads no more, and their longest escapes fit ``ranges.Line``
REPLY_TIME_S = 1.0  # chosen: after a longer wait an operator has reason to press the emergency stop


async def stop_robot(bus: Bus, robot: str, reason: str, user: str = "", clock: Clock | None = None) -> StopState:
    """Stop a robot, even if an ARC holds it; nothing moves it until ``lift_stop``, and the holder keeps its grant.

    A stop needs neither grant nor ARC nor RC manager; a second stop keeps the first one's author. For operators only.
    The reason is made one printable line of bounded length, because no reason may prevent a stop.

    Args:
        bus: Bus of an operator.
        reason: For people.
        user: Name of the operator, for people.
        clock: The mission's clock, to repeat the stop for ``REPLY_TIME_S`` while no component answers, because the hub
            or the robot's RC may be restarting; None: do not repeat it.

    Raises:
        NotFromYou: The component of ``bus`` is no operator.
        LinkError: The robot's RC did not answer; the outcome is unknown.
    """
    stop, at = EmergencyStop(printable(reason, MOST_REASON_CHARACTERS), user), address(Subsystem.RESOURCE_POOL, robot)
    if clock is None:
        return await bus.ask(at, stop, StopState, within_s=REPLY_TIME_S)
    return await ask_until_answered(bus, clock, at, stop, StopState, each_s=REPLY_TIME_S, within_s=REPLY_TIME_S)


async def lift_stop(bus: Bus, stop: StopState, user: str = "") -> StopState:
    """Lift the stop of a robot.

    Args:
        bus: Bus of an operator.
        stop: The stop that the operator saw.
        user: Name of the operator, for people.

    Raises:
        OtherStop: A newer stop is in force.
        NotFromYou: The component of ``bus`` is no operator.
        LinkError: The robot's RC did not answer.
    """
    return await _ask_robot(bus, stop.rc, LiftStop(stop.number, user))


async def ask_stop(bus: Bus, robot: str) -> StopState:
    """Return whether an operator's stop is in force on the robot.

    Raises:
        LinkError: The robot's RC did not answer.
    """
    return await _ask_robot(bus, robot, AskStop())


def watch_stops(bus: Bus, listener: Callable[[StopState], None], robot: str = "*") -> Subscription:
    """Call the listener whenever this robot (or any robot, if none is named) is stopped or freed."""
    at = f"{Subsystem.RESOURCE_POOL}/{robot}"
    return bus.subscribe(at, Conversation.EVENTS, StopState, lambda heard: listener(heard.body))


async def _ask_robot(bus: Bus, robot: str, question: Message) -> StopState:
    return await bus.ask(address(Subsystem.RESOURCE_POOL, robot), question, StopState, within_s=REPLY_TIME_S)
