"""Message classes are found although a module of the mission cannot be imported here."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import pytest

from backbone.recording.known_messages import GROUP, message_classes
from backbone.recording.translation import Translator
from resource_pool.messages import Frame


@pytest.mark.parametrize(
    "text",
    [
        "import not_installed_here",
        "def half_written(:",
        'raise OSError("libgpu.so.1: cannot open shared object file")',
        "raise SystemExit",
    ],
)
def test_a_module_that_cannot_be_imported_is_skipped_and_logged(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "module_in_work.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with caplog.at_level(logging.WARNING):
        assert message_classes(["module_in_work"]) == message_classes()
    assert "messages of module_in_work are recorded without names" in caplog.text


def test_a_class_without_its_module_is_none_of_the_classes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its fields have types that only the module knows, and ``watch`` ended with a NameError."""
    lines = [
        "from __future__ import annotations",
        "from backbone.ranges import Share",
        "from backbone.wire import Message",
        "class LeakFound(Message, frozen=True):",
        "    share: Share",
        "raise OSError('the pump is off')",
    ]
    (tmp_path / "pump_in_work.py").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    found = message_classes(["pump_in_work"])
    assert "LeakFound/1" not in found
    Translator(found)


def test_a_class_of_ones_own_takes_no_name_from_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    for name, classes in {"a_box": ["Frame", "BoxFound"], "b_box": ["BoxFound", "BoxLost"]}.items():
        lines = [f"class {kind}(Message, frozen=True):\n    {name}_m: float" for kind in classes]
        (tmp_path / f"{name}.py").write_text("\n".join(["from backbone.wire import Message", *lines]))
    monkeypatch.syspath_prepend(tmp_path)
    with caplog.at_level(logging.WARNING):
        found = message_classes(["a_box", "b_box"])
    del sys.modules["a_box"], sys.modules["b_box"]
    assert found["Frame/1"] is Frame
    assert "BoxFound/1" not in found
    assert found["BoxLost/1"].__module__ == "b_box"
    assert "messages of a_box:Frame are recorded without names" in caplog.text
    assert "messages of a_box:BoxFound and b_box:BoxFound are recorded without names" in caplog.text


def test_an_installed_package_that_cannot_be_imported_costs_only_its_own_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    about = tmp_path / "sensors-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: sensors\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[{GROUP}]\nsensors = sensors_in_work\n")
    (tmp_path / "sensors_in_work.py").write_text("\nraise OSError('libsensor.so: cannot open')")
    monkeypatch.syspath_prepend(tmp_path)
    with caplog.at_level(logging.WARNING):
        assert message_classes()["Frame/1"] is Frame
    told = f"OSError: libsensor.so: cannot open ({tmp_path / 'sensors_in_work.py'}, line 2)"
    assert f"messages of sensors_in_work are recorded without names: {told}" in caplog.text
