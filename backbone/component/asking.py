"""Repeated questions: a question outlasts a restart of the hub or of its receiver.

Rule: only idempotent questions. The outcome of an unanswered question is unknown, so asking it again must not change
anything more.
"""

from __future__ import annotations

from backbone.bus.interface import Bus, Clock, Reply
from backbone.errors import LinkError
from backbone.wire import Message

PAUSE_FIRST_S, PAUSE_MOST_S, PAUSE_FACTOR = 0.02, 0.25, 1.5  # chosen: like the bus's own search for a lost hub


async def ask_until_answered(
    bus: Bus, clock: Clock, address: str, question: Message, reply: type[Reply], *, each_s: float, within_s: float
) -> Reply:
    """Ask, and after every ``LinkError`` ask again after a growing pause.

    A question counts for at most ``each_s``. So if this process itself was stopped meanwhile, that time does not count
    as silence of the receiver.

    Args:
        question: An idempotent question.
        each_s: Seconds of the machine that one question waits for its answer.
        within_s: Seconds of the machine after which the question is not repeated.

    Raises:
        Refusal: The receiver refused.
        LinkError: No answer arrived in time.
    """
    left_s, pause_s = within_s, PAUSE_FIRST_S
    while True:
        asked_s = clock.now_s()
        try:
            return await bus.ask(address, question, reply, within_s=each_s)
        except LinkError:
            left_s -= min(each_s, (clock.now_s() - asked_s) / clock.rate) + pause_s
            if left_s <= 0:
                raise
        await clock.sleep_s(pause_s * clock.rate)
        pause_s = min(pause_s * PAUSE_FACTOR, PAUSE_MOST_S)
