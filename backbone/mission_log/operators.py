"""Actions of operators: one event for each, with the user's name, for consoles and logs."""

from __future__ import annotations

import getpass
import os
from enum import StrEnum

from backbone.bus.interface import Bus, Clock
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.printable_text import printable
from backbone.ranges import LONGEST_MENTION, Instant, Mention, Text
from backbone.wire import Message


class OperatorAction(StrEnum):
    """An action of a person on a mission."""

    ATTACH = "attach"  # sat down at a console
    DETACH = "detach"  # left it in good order; a dead console is a lost component
    TAKE = "take"  # asked for a robot
    RELEASE = "release"  # gave it back
    DRIVE_BEGIN = "drive_begin"  # the first command of a drive was applied
    DRIVE_END = "drive_end"  # the drive ended, or the robot was lost or given back
    COMMAND = "command"  # gave a command that is none of driving
    ORDER = "order"  # told a robot to do something by itself
    ORDER_END = "order_end"  # the order was done, failed, or was ended by its operator
    STOP_ROBOT = "stop_robot"  # emergency stop
    STOP_ALL = "stop_all"
    LIFT_STOP = "lift_stop"
    ASK_LIFT = "ask_lift"  # asked the operator who stopped a robot whether it may move again
    LET_LIFT = "let_lift"  # let another operator lift the stop
    KEEP_STOPPED = "keep_stopped"
    SET_PARAMETER = "set_parameter"
    ACKNOWLEDGE = "acknowledge"  # saw an alarm
    ASK_CONSENT = "ask_consent"  # asked an equal for a robot
    CONSENT = "consent"  # let them have it
    DECLINE = "decline"
    START_MISSION = "start_mission"
    STOP_MISSION = "stop_mission"
    START_COMPONENT = "start_component"
    STOP_COMPONENT = "stop_component"
    CHANGE_TREE = "change_tree"
    INJECT = "inject"  # said something on the bus in a component's place
    SWAP = "swap"  # asked for another class in a module's place


_SENTENCES = {
    OperatorAction.ATTACH: "{user} sat down",
    OperatorAction.DETACH: "{user} left",
    OperatorAction.TAKE: "is asked for by {user}",
    OperatorAction.RELEASE: "was given back by {user}",
    OperatorAction.DRIVE_BEGIN: "is driven by {user}",
    OperatorAction.DRIVE_END: "is no longer driven by {user}",
    OperatorAction.COMMAND: "{user} commands it",
    OperatorAction.ORDER: "{user} orders it",
    OperatorAction.ORDER_END: "{user}'s order is over",
    OperatorAction.STOP_ROBOT: "{user} stops it",
    OperatorAction.STOP_ALL: "{user} stops all",
    OperatorAction.LIFT_STOP: "{user} lifts its stop",
    OperatorAction.ASK_LIFT: "{user} asks whether it may move again",
    OperatorAction.LET_LIFT: "{user} says that it may move again",
    OperatorAction.KEEP_STOPPED: "{user} keeps it stopped",
    OperatorAction.SET_PARAMETER: "{user} changes it",
    OperatorAction.ACKNOWLEDGE: "{user} has seen it",
    OperatorAction.ASK_CONSENT: "{user} asks for it",
    OperatorAction.CONSENT: "{user} lets it go",
    OperatorAction.DECLINE: "{user} keeps it",
    OperatorAction.START_MISSION: "{user} started it",
    OperatorAction.STOP_MISSION: "{user} ends it",
    OperatorAction.START_COMPONENT: "{user} started it",
    OperatorAction.STOP_COMPONENT: "{user} stopped it",
    OperatorAction.CHANGE_TREE: "{user} changes the behavior tree",
    OperatorAction.INJECT: "{user} injects a message",
    OperatorAction.SWAP: "{user} exchanges it",
}


_LEVELS = {
    OperatorAction.STOP_ROBOT: LogLevel.ALARM,
    OperatorAction.STOP_ALL: LogLevel.ALARM,
    OperatorAction.ACKNOWLEDGE: LogLevel.INFO,
}


class OperatorActed(Message, frozen=True):
    """Published by the console or command through which a person acted, under ``Conversation.OPERATORS``.

    Attributes:
        subject: Name of the robot, component or alarm.
        detail: Manner, reason or outcome, for people.
    """

    user: Mention
    action: OperatorAction
    subject: Mention
    detail: Text
    at_s: Instant

    @property
    def sentence(self) -> str:
        """The action as a sentence about the subject, for people.

        Example:
            >>> OperatorActed("anna", OperatorAction.STOP_ROBOT, "scout1", "child in the room", 2.0).sentence
            'anna stops it: child in the room'
        """
        said = _SENTENCES[self.action].format(user=self.user)
        return f"{said}: {self.detail}" if self.detail else said

    def event(self, where: str, cause: str = "") -> StoryEvent:
        """Return the action as an event of the log.

        Args:
            where: Address of the console or command.
        """
        level = _LEVELS.get(self.action, LogLevel.NOTICE)
        return StoryEvent(self.at_s, where, self.sentence, self.subject, cause, level, self.user)


def login_name() -> str:
    """Return the name of the logged-in user, if the system knows it, as a text that every message can contain."""
    try:
        return printable(getpass.getuser())[:LONGEST_MENTION]
    except (OSError, KeyError):  # the user has no name, as in a container
        return f"uid-{os.getuid()}"


def publish_action(bus: Bus, clock: Clock, action: OperatorAction, subject: str, detail: str = "") -> None:
    """Publish an action of the logged-in user to the mission.

    Args:
        subject: Name of the robot, component or alarm.
        detail: Manner, reason or outcome, for people.
    """
    bus.publish(bus.source, Conversation.OPERATORS, OperatorActed(login_name(), action, subject, detail, clock.now_s()))
