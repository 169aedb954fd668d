"""Launch: the creator's order from which a new process becomes a component."""

from __future__ import annotations

from backbone.naming import Subsystem, address
from backbone.ranges import Line, MachineTime, Mention, Name, NameOrNone, Rate, Values
from backbone.wire import Message


class Launch(Message, frozen=True):
    """Order to become one component.

    Attributes:
        name: Name of the component, unique in the mission.
        type: Component type as named in the mission file.
        class_path: ``package.module:Class``, a ``Component``.
        host: Name of the host it runs on.
        endpoint: Endpoint of the hub. The secret, if any, is in the run directory and never in a launch.
        clock_origin_monotonic_s: This machine's monotonic clock at mission time 0.
        clock_rate: Mission seconds per second of the machine.
        parameters: Values for the class's ``Parameters``.
        requester: Address of the component's owner.
        run_directory: Folder of the mission's files on this host; removed when the mission has ended.
        process: Name of the shared process; empty: a process of its own. Without a class path this is the launch of
            the shared process itself, and ``requester`` is its creator.
        incarnation: Id of this life of the component, ``<host>.<start of the creator>.<number>``, unique in the
            mission.
        order_id: Id of its owner's order, unique in the mission. It is the same in all lives of the component until an
            order stops it. Empty: the placer did not start it.
    """

    mission: Name
    subsystem: Subsystem
    name: Name
    type: Mention
    class_path: Line
    host: Mention
    endpoint: Line
    clock_origin_monotonic_s: MachineTime
    clock_rate: Rate
    parameters: Values = {}
    requester: Mention = ""
    run_directory: Line = ""
    process: NameOrNone = ""
    incarnation: Mention = ""
    order_id: Mention = ""

    @property
    def is_shared_process(self) -> bool:
        """True if this starts an empty shared process, and no component."""
        return bool(self.process) and not self.class_path

    @property
    def address(self) -> str:
        """``<subsystem>/<name>``."""
        return address(self.subsystem, self.name)
