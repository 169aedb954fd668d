"""The designer in a terminal: tree, properties, problems or the first minute, and keys for all of it.

Widgets are thin: what may be added is in ``offers``, what may be set in ``properties``, what commands do in
``effects``.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path as FilePath
from typing import ClassVar, TypeVar

from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widgets import Footer, Static

from backbone.errors import Refusal
from backbone.mission.edit import Node, Path
from backbone.spoken import counted
from ui_console.design.catalogue import ClassFacts, TypeEntry, description, entries, stock_classes
from ui_console.design.commands import Command, Move, Remove, SetValue
from ui_console.design.dialogs import CSS as DIALOG_CSS
from ui_console.design.dialogs import Ask, Picker, Sure
from ui_console.design.draft import Draft
from ui_console.design.file import FileChanged, save
from ui_console.design.following import follower
from ui_console.design.lines import key_of, path_of, problem_rows, property_rows, rehearsal_rows, tree_rows
from ui_console.design.offers import Asked, Offer, offers
from ui_console.design.properties import Property, properties
from ui_console.terminal.dialogs import Reading
from ui_console.terminal.ending import EndingApp
from ui_console.terminal.lines import Row
from ui_console.terminal.widgets import Panel

A = TypeVar("A")
LookUp = Callable[[Sequence[str]], Awaitable[dict[str, ClassFacts]]]
FOLDED_AT_FIRST = frozenset({"core", "types"})
"""What is the same in most missions, and filled by what is added elsewhere."""


class PanelName(StrEnum):
    """What the cursor keys move in, in the order in which tab goes through them."""

    TREE = "tree"
    PROPERTIES = "properties"
    PROBLEMS = "problems"


class DesignPanel(Panel):
    """Rows with a cursor that can be put on one."""

    def choose(self, key: str) -> None:
        """Put the cursor on the row of this key, if there is one."""
        self._key = key


class DesignApp(EndingApp):
    """The designer's screen.

    Args:
        draft: What is designed.
        look_up: Asks classes for their documentation and parameters, see ``look_up.look_up``.
    """

    TITLE = "scout-console design"
    ENABLE_COMMAND_PALETTE = False
    CSS = (
        DIALOG_CSS
        + """
    #status { height: 1; background: $panel; color: $text; }
    #body { height: 1fr; }
    #left { width: 4fr; }
    #right { width: 3fr; }
    .panel { border: round $primary; padding: 0 1; }
    #tree { height: 1fr; text-wrap: nowrap; text-overflow: ellipsis; }
    #properties { height: 1fr; text-wrap: nowrap; text-overflow: ellipsis; }
    #meaning { height: 5; padding: 0 2; color: $text-muted; }
    #problems { height: 12; }
    .-chosen { border: round $success; }
    """
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "row(-1)", "up", show=False),
        Binding("down", "row(1)", "down", show=False),
        Binding("pageup", "row(-10)", "page up", show=False),
        Binding("pagedown", "row(10)", "page down", show=False),
        Binding("tab", "panel(1)", "panel", priority=True),
        Binding("shift+tab", "panel(-1)", "panel before", show=False, priority=True),
        Binding("space", "fold", "fold", show=False),
        Binding("a", "add", "add"),
        Binding("enter,e", "edit", "edit"),
        Binding("n", "rename", "name"),
        Binding("x,delete", "remove", "remove"),
        Binding("plus,equals_sign", "priority(1)", "priority +", show=False),
        Binding("minus", "priority(-1)", "priority -", show=False),
        Binding("shift+up,K", "move(-1)", "move up", show=False),
        Binding("shift+down,J", "move(1)", "move down", show=False),
        Binding("greater_than_sign,shift+right", "inwards", "into the one above", show=False),
        Binding("less_than_sign,shift+left", "outwards", "out of its parent", show=False),
        Binding("u,ctrl+z", "undo", "undo"),
        Binding("U,ctrl+y", "redo", "redo", show=False),
        Binding("d", "rehearse", "dry run"),
        Binding("c", "catalogue", "catalogue"),
        Binding("t", "text", "text", show=False),
        Binding("s,ctrl+s", "save", "save"),
        Binding("w", "save_as", "save as", show=False),
        Binding("question_mark,f1", "keys", "keys"),
        Binding("q", "leave", "quit"),
        Binding("ctrl+c,ctrl+q", "leave", "quit", show=False, priority=True),
    ]

    def __init__(self, draft: Draft, look_up: LookUp) -> None:
        super().__init__()
        self.draft = draft
        self.chosen = PanelName.TREE
        self.facts: Mapping[str, ClassFacts] = {}
        self._look_up = look_up
        self._at: Path = ()
        self._shows_rehearsal = False
        self._folded = set(FOLDED_AT_FIRST)

    # ------------------------------------------------------------------ what is shown
    def compose(self) -> ComposeResult:
        """Lay out: tree left, properties and their meaning right, problems below."""
        yield Static(id="status")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield DesignPanel(PanelName.TREE)
            with Vertical(id="right"):
                yield DesignPanel(PanelName.PROPERTIES)
                yield Static(id="meaning")
        yield DesignPanel(PanelName.PROBLEMS)
        yield Footer(compact=True)

    def on_mount(self) -> None:
        """Show the draft, and have the project's classes looked up meanwhile."""
        self.call_after_refresh(self.redraw)
        self._learn(stock_classes())

    def on_resize(self) -> None:
        """Show as much as fits."""
        self.call_after_refresh(self.redraw)

    @property
    def node(self) -> Node:
        """The element the cursor of the tree is on."""
        return self.draft.mission.at(self._at)

    def redraw(self) -> None:
        """Show the draft as it is now."""
        if not self.is_running or not self.screen_stack[0].query("#status"):
            return
        self._show(PanelName.TREE, tree_rows(self.draft, self._folded))
        self._show(PanelName.PROPERTIES, property_rows(self._properties()))
        below = self._panel(PanelName.PROBLEMS)
        if self._shows_rehearsal and self.draft.rehearsal is not None:
            below.border_title = f"the first {self.draft.rehearsal.timetable.end_s:g} s"
            self._show(PanelName.PROBLEMS, rehearsal_rows(self.draft.rehearsal), "nobody asks for anything")
        else:
            below.border_title = "problems"
            self._show(PanelName.PROBLEMS, problem_rows(self.draft.problems), "none: check would say that it is fine")
        row = self._panel(PanelName.PROPERTIES).row
        chosen = next((one for one in self._properties() if row is not None and _key(one) == row.key), None)
        meaning = chosen.doc if chosen is not None else ""
        self.screen_stack[0].query_one("#meaning", Static).update(Text(meaning), layout=False)
        self.screen_stack[0].query_one("#status", Static).update(self._status(), layout=False)

    def _show(self, name: PanelName, rows: list[Row], nothing: str = "nothing") -> None:
        panel = self._panel(name)
        is_chosen = name is self.chosen
        panel.set_class(is_chosen, "-chosen")
        panel.show_rows(rows, is_chosen=is_chosen or name is PanelName.TREE, nothing=nothing)

    def _panel(self, name: PanelName) -> DesignPanel:
        return self.screen_stack[0].query_one(f"#{name}", DesignPanel)

    def _properties(self) -> list[Property]:
        return properties(self.draft.mission, self.node, self.facts)

    def _status(self) -> Text:
        draft = self.draft
        count = len(draft.problems)
        state = Text(f" {draft.source}", style="bold")
        state.append("  changed" if draft.is_changed else "  saved", "yellow" if draft.is_changed else "green")
        state.append(f"  {counted(count, 'problem')}" if count else "  fine", "bold red" if count else "green")
        return state.append(f"  line {self.node.line}", "dim")

    # ------------------------------------------------------------------ moving about
    def action_row(self, steps: int) -> None:
        """Move the cursor of the chosen panel."""
        panel = self._panel(self.chosen)
        panel.move(steps)
        if self.chosen is PanelName.TREE and panel.row is not None:
            self._at = path_of(panel.row.key)
            self._panel(PanelName.PROPERTIES).choose("")
        self.redraw()

    def action_panel(self, steps: int) -> None:
        """Choose another panel."""
        if len(self.screen_stack) > 1:
            return
        names = list(PanelName)
        self.chosen = names[(names.index(self.chosen) + steps) % len(names)]
        self.redraw()

    def action_fold(self) -> None:
        """Show a section of the mission in one line, or all of it again."""
        if not self._at:
            return
        section = self.draft.mission.at(self._at[:1])
        self._folded ^= {section.tag}
        if section.tag in self._folded:
            self._at = section.path
            self._panel(PanelName.TREE).choose(key_of(self._at))
        self.redraw()

    def go_to(self, path: Path) -> None:
        """Put the cursor of the tree on an element; of a parameter, on the element that has it."""
        node = self.draft.mission.at(path)
        self._at = path[:-1] if node.tag == "parameter" else path
        if len(self._at) > 1:
            self._folded.discard(self.draft.mission.at(self._at[:1]).tag)
        self._panel(PanelName.TREE).choose(key_of(self._at))

    # ------------------------------------------------------------------ changing
    async def _answer_to(self, dialog: Screen[A]) -> A | None:
        """Return what was answered; None: it was closed, or never opened as keys in a burst had opened another."""
        if len(self.screen_stack) > 1:
            return None
        answer: A = await self.push_screen_wait(dialog)
        return answer

    def do(self, command: Command) -> bool:
        """Carry out a command and go to what it touched; say so if it is refused."""
        try:
            after = self.draft.do(command)
        except Refusal as refusal:
            self.notify(str(refusal), title="refused", severity="error", markup=False)
            return False
        if after is not self.draft:
            self.draft = after
            self.go_to(after.step.touched)
            self.redraw()
        return True

    @work
    async def action_add(self) -> None:
        """Pick what to add, answer what it needs, add it."""
        found = offers(self.draft.mission, self._at)
        labels = [offer.label for offer in found]
        number = await self._answer_to(Picker("add what?", labels, [self._about(offer) for offer in found]))
        if number is None:
            return
        given = []
        for asked in found[number].asks:
            answer = await self._answer_to(Ask(asked))
            if answer is None:
                return
            given.append(answer)
        try:
            command = found[number].build(given)
        except Refusal as refusal:
            self.notify(str(refusal), title="refused", severity="error", markup=False)
            return
        self.do(command)

    @work
    async def action_edit(self) -> None:
        """Change the property the cursor is on; on the tree go to the properties, on a problem to its element."""
        row = self._panel(self.chosen).row
        if self.chosen is PanelName.TREE:
            self.action_panel(1)
        elif self.chosen is PanelName.PROBLEMS:
            if not self._shows_rehearsal and row is not None and self.draft.problems:
                self.chosen = PanelName.TREE
                self.go_to(self.draft.element_of(self.draft.problems[int(row.key)]))
                self.redraw()
        elif row is not None:
            found = next(one for one in self._properties() if _key(one) == row.key)
            await self._set(found)

    @work
    async def action_rename(self) -> None:
        """Rename the element, and what refers to it."""
        found = next((one for one in self._properties() if one.name == "name" and not one.is_parameter), None)
        if found is None:
            self.notify(f"a <{self.node.tag}> has no name", severity="error", markup=False)
        else:
            await self._set(found)

    async def _set(self, found: Property) -> None:
        path, tag = self._at, self.node.tag
        asked = Asked(found.name, found.doc, found.value or "", found.choices)
        answer = await self._answer_to(Ask(asked))
        if answer is not None:
            self.do(found.command(path, tag, answer.strip()))

    def action_remove(self) -> None:
        """Remove the element; on the properties, leave the value out."""
        row = self._panel(PanelName.PROPERTIES).row
        if self.chosen is not PanelName.PROPERTIES:
            self.do(Remove(self._at))
        elif row is not None:
            found = next(one for one in self._properties() if _key(one) == row.key)
            self.do(found.command(self._at, self.node.tag, ""))

    def action_priority(self, steps: int) -> None:
        """Raise or lower a behavior's or the mission's priority."""
        value = self.node.text("priority")
        if not value.lstrip("-").isdecimal():
            self.notify(f"a <{self.node.tag}> has no priority to change", severity="error", markup=False)
            return
        self.do(SetValue(self._at, "priority", str(int(value) + steps)))

    def action_move(self, steps: int) -> None:
        """Change places with a sibling."""
        if self._at:
            self.do(Move(self._at, self._at[:-1], self._at[-1] + steps))

    def action_inwards(self) -> None:
        """Make it the last child of the sibling above it."""
        if not self._at or self._at[-1] == 0:
            self.notify("nothing stands above it", severity="error")
            return
        above = (*self._at[:-1], self._at[-1] - 1)
        self.do(Move(self._at, above, len(self.draft.mission.at(above).children)))

    def action_outwards(self) -> None:
        """Put it behind its parent."""
        if len(self._at) > 1:
            self.do(Move(self._at, self._at[:-2], self._at[-2] + 1))

    def action_undo(self) -> None:
        """Take the last command back."""
        undone = self.draft
        if self._step(self.draft.undo):
            self.go_to(follower(undone, self.draft)(undone.mission.nearest(undone.step.touched)))
            self.redraw()

    def action_redo(self) -> None:
        """Do again what was taken back."""
        self._step(self.draft.redo)

    def _step(self, step: Callable[[], Draft]) -> bool:
        try:
            self.draft = step()
        except Refusal as refusal:
            self.notify(refusal.detail, severity="warning", markup=False)
            return False
        self.go_to(self.draft.mission.nearest(self.draft.step.touched))
        self.redraw()
        return True

    # ------------------------------------------------------------------ reading
    def action_rehearse(self) -> None:
        """Show the first minute of the schedule instead of the problems, or the problems again."""
        if self.draft.rehearsal is None and not self._shows_rehearsal:
            self.notify("it has problems; a dry run needs a mission that check says is fine", severity="warning")
            return
        self._shows_rehearsal = not self._shows_rehearsal
        self.redraw()

    @work
    async def action_catalogue(self) -> None:
        """Browse all types at hand; enter on one of the file's own looks its class up."""
        found = entries(self.draft.mission)
        labels = [
            f"{entry.role:<9} {entry.name}{'' if entry.is_declared else ' (not declared yet)'}" for entry in found
        ]
        docs = [description(entry, self.facts) for entry in found]
        number = await self._answer_to(Picker("catalogue (enter: read all of it)", labels, docs))
        if number is None:
            return
        entry = found[number]
        if entry.class_path not in self.facts:
            self.facts = {**self.facts, **await self._look_up([entry.class_path])}
        await self._answer_to(Reading(entry.name, description(entry, self.facts)))

    def action_text(self) -> None:
        """Read the file as it would be saved, from the element on."""
        lines = self.draft.text.decode("utf-8-sig").splitlines()
        self.push_screen(Reading(self.draft.source, lines[self.node.line - 1 :]))

    def action_keys(self) -> None:
        """Tell what keys do."""
        self.push_screen(Reading("keys", keys_help()))

    def _about(self, offer: Offer) -> list[str]:
        entry = self._entry(offer)
        return [offer.doc] if entry is None else description(entry, self.facts)

    def _entry(self, offer: Offer) -> TypeEntry | None:
        _, _, name = offer.label.partition(" ")
        return next((entry for entry in entries(self.draft.mission) if entry.name == name), None)

    @work
    async def _learn(self, class_paths: Sequence[str]) -> None:
        self.facts = {**self.facts, **await self._look_up(class_paths)}
        self.redraw()

    # ------------------------------------------------------------------ keeping
    @work
    async def action_save(self) -> None:
        """Save; ask first if somebody else changed the file."""
        await self._save(FilePath(self.draft.source))

    @work
    async def action_save_as(self) -> None:
        """Save under another name, and go on with that."""
        asked = Asked("save as", "The file to write.", self.draft.source)
        answer = await self._answer_to(Ask(asked))
        if answer:
            await self._save(FilePath(answer))

    async def _save(self, path: FilePath) -> None:
        try:
            try:
                self.draft = save(self.draft, path)
            except FileChanged as changed:
                if not await self._answer_to(Sure(f"{changed.detail}. Overwrite it?")):
                    return
                self.draft = save(self.draft, path, overwrite=True)
        except Refusal as refusal:
            self.notify(str(refusal), title="not saved", severity="error", markup=False)
            return
        count = len(self.draft.problems)
        told = f"saved, with {counted(count, 'problem')}" if count else "saved; check says that it is fine"
        self.notify(told, severity="warning" if count else "information", markup=False)
        self.redraw()

    @work
    async def action_leave(self) -> None:
        """End; ask first if something is not saved."""
        if isinstance(self.screen, Sure):
            return
        if self.draft.is_changed:
            is_sure = await self.push_screen_wait(Sure("What you changed is not saved. Leave?"))
            if not is_sure:
                return
        self.exit()


def keys_help() -> list[str]:
    """Return what each key does, a line each."""
    told = [
        (binding.key.replace("plus,equals_sign", "+").replace("minus", "-"), binding.action)
        for binding in DesignApp.BINDINGS
        if isinstance(binding, Binding)
    ]
    names = {
        "question_mark": "?",
        "greater_than_sign": ">",
        "less_than_sign": "<",
    }
    lines = []
    for keys, action in told:
        method = getattr(DesignApp, f"action_{action.partition('(')[0]}")
        doc = (method.__doc__ or "").strip()
        lines.append(f"{', '.join(names.get(key, key) for key in keys.split(',')):<24} {doc}")
    return lines


def _key(one: Property) -> str:
    return ("parameter " if one.is_parameter else "") + one.name
