"""A network inside one process whose buses encode and decode each message, as buses between processes do.

The messages themselves are handed over, so listeners share their objects. What could not cross the bus between
processes is refused at its sender.
"""

from __future__ import annotations

from backbone.bus.inbox import reader_of
from backbone.bus.interface import Answer, Clock, Reply
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.wire import MAX_MESSAGE_BYTES, WIRE_VERSION, Envelope, Message, Refused, UnwritableMessage, write


class EncodingNetwork(LocalNetwork):
    """The network of the buses of one process, which encode all messages."""

    def join(self, source: str, clock: Clock) -> EncodingBus:
        """Return a new bus of the component ``source`` on this network."""
        return EncodingBus(self, source, clock)


class EncodingBus(LocalBus):
    """One component's bus, which refuses each message of its component that no other process could read."""

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer; see ``Bus.ask``.

        Raises:
            Refusal: The question cannot be sent, or the component refuses it.
        """
        check_sendable(question)
        return await super().ask(address, question, reply, within_s=within_s)

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all subscribers; see ``Bus.publish``.

        Raises:
            Refusal: The message cannot be sent.
        """
        if not self.closed:
            quality = self.quality(address, conversation)
            check_sendable(message, max(quality.most_bytes, quality.most_bytes_on_host))
        super().publish(address, conversation, message)

    async def reply_to(self, question: Envelope[Message], answer: Answer) -> Envelope[Message] | None:
        """Return the reply in an envelope, or the refusal of a reply that cannot be sent."""
        replied = await super().reply_to(question, answer)
        if replied is None:
            return None
        try:
            check_sendable(replied.body)
        except Refusal as refusal:
            return self.envelope(Refused.of(refusal))
        return replied


def check_sendable(message: Message, most_bytes: int = MAX_MESSAGE_BYTES) -> None:
    """Return if another process could read this message.

    Raises:
        OversizedMessage: It is longer than ``most_bytes``.
        UnwritableMessage: A part of it cannot be encoded.
        MalformedMessage: Its reader would refuse it.
    """
    try:
        raw = write(Envelope(WIRE_VERSION, "kit/kit", 0, 0.0, "", message), most_bytes)
    except (TypeError, BufferError) as error:  # a field of a class that no message may have; memory with gaps
        told = f"{type(message).__name__} cannot be sent: {error}"
        raise UnwritableMessage(told, remedy="Give fields of the declared types, and memory without gaps.") from error
    reader_of(type(message)).read(raw, most_bytes)
