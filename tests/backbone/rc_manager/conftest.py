"""An RC manager with plain RCs and ARCs, for each test of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any

import pytest
from rc_manager_at_work import Pool, a_pool


@pytest.fixture
def pool(local_mission: Any, beside: Any, tmp_path: Path) -> Callable[[], AbstractAsyncContextManager[Pool]]:
    return lambda: a_pool(local_mission, beside, tmp_path / "trace.jsonl")
