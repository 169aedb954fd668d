"""The shared judge of schedule traces, which is no part of this project and not in every clone.

The tests use the project's own ``trace_checker``; the judge only shows that the two agree.
"""

from __future__ import annotations

import functools
import importlib.util
import os
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@functools.cache
def judge() -> ModuleType:
    """Return the judge's module; skip the test where it is not at hand."""
    path = Path(os.environ.get("SCOUT_TRACE_CHECK", ROOT.parent / "shared" / "trace" / "trace_check.py"))
    if not path.is_file():
        pytest.skip(f"the shared judge of traces is not at {path}; name it in SCOUT_TRACE_CHECK")
    spec = importlib.util.spec_from_file_location("trace_check", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
