"""Exchange of a part of a running component: the question, and its answer when the exchange is over.

An operator asks the component that runs the part. It answers when the new part has proved itself, or when the old one
has come back; a refusal has changed nothing.
"""

from __future__ import annotations

from backbone.errors import Refusal
from backbone.ranges import Count, Duration, Line, Mention, Text, Values
from backbone.wire import Message

PROVE_S = 5.0  # chosen: a person sees the outputs of some hundred rounds
READY_WITHIN_S = 10.0  # chosen: a running average of 30 pictures at 5 pictures a second, and half of that again
SILENT_S = 1.0  # chosen: many rounds of a module that robots need, and short enough for a robot without its output


class UnknownModule(Refusal):
    """The mission has no part of this name that can be exchanged."""

    code = "exchange.unknown"
    remedy = "Name a module, behavior or resource of the mission file."


class Silent(Refusal):
    """The component of the part does not answer; nothing was changed."""

    code = "exchange.silent"
    remedy = "Run 'scout-backbone status'. The creator replaces a process that hangs; swap again afterwards."


class UnknownExchange(Refusal):
    """The component has begun no exchange of this id."""

    code = "exchange.unknown_id"
    remedy = "See 'scout-backbone log' for its end, and swap again if the old class is back."


class ExchangeRunning(Refusal):
    """An exchange in this component is not over yet."""

    code = "exchange.running"
    remedy = "Wait until it is over; 'scout-backbone status' shows it in the line of the component."


class NotExchanged(Refusal):
    """A part cannot be exchanged as it is now."""

    code = "exchange.not_now"
    remedy = "Change the mission file, and bring the mission down and up."


class SwapModule(Message, frozen=True):
    """Exchange a module of this unit while it runs; the answer comes when the exchange is over.

    Attributes:
        class_path: ``package.module:Class`` of the new module; its file is read anew.
        parameters: Parameters of the new module; a missing one is as in the old module, if both have it.
        prove_s: Mission time for which the old module is kept after the switch; 0: it is not kept.
        ready_within_s: Mission time after which a new module that is not ready is dropped.
        silent_s: If an output of the old module is missing for this mission time, the old module comes back.
        user: The person who asks.
        exchange_id: Id of this request, unique in the component; empty: it is not repeated.
        is_repeated: True: its answer was lost, so return the answer, and begin no other exchange.
    """

    module: Mention
    class_path: Line
    parameters: Values = {}
    prove_s: Duration = PROVE_S
    ready_within_s: Duration = READY_WITHIN_S
    silent_s: Duration = SILENT_S
    user: Mention = ""
    exchange_id: Mention = ""
    is_repeated: bool = False


class SwapClass(Message, frozen=True):
    """Exchange the class of this behavior, or of this RC's driver; the answer comes when the exchange is over.

    Attributes:
        class_path: ``package.module:Class`` of the new class; for a driver, also the name of a built-in driver.
        parameters: Parameters of the behavior; for a driver, its options. The other attributes are as in
            ``SwapModule``.
    """

    class_path: Line
    parameters: Values = {}
    prove_s: Duration = PROVE_S
    ready_within_s: Duration = READY_WITHIN_S
    user: Mention = ""
    exchange_id: Mention = ""
    is_repeated: bool = False


class Swapped(Message, frozen=True):
    """Answer to ``SwapModule`` and ``SwapClass``.

    Attributes:
        is_proved: True: the new part does the work. False: the old part does.
        cause: Why the old part came back, or could not be kept; empty: the new part has proved itself.
        keeps_state: True if the new part went on with the state of the old one.
        warming_s: Mission time from the start of the exchange to the switch; without a switch, to the end.
        proving_s: Mission time from the switch to the end.
        rounds: Rounds of a module, commands of a behavior or calls of a driver while it proved itself.
        remark: Advice to the operator; empty: none.
    """

    is_proved: bool
    cause: Text
    keeps_state: bool
    warming_s: Duration
    proving_s: Duration
    rounds: Count
    remark: Text = ""
