"""Message classes are found although a module of the mission cannot be imported here."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from backbone.recording.known_messages import message_classes


@pytest.mark.parametrize(
    "text",
    ["import not_installed_here", "def half_written(:", 'raise OSError("libgpu.so.1: cannot open shared object file")'],
)
def test_a_module_that_cannot_be_imported_is_skipped_and_logged(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "module_in_work.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with caplog.at_level(logging.WARNING):
        assert message_classes(["module_in_work"]) == message_classes()
    assert "messages of module_in_work are recorded without names" in caplog.text
