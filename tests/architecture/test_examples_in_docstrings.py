"""The examples in docstrings print what they say."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

from backbone.shipped import PACKAGES

ROOT = Path(__file__).parents[2]
MODULES = [
    path
    for package in sorted(PACKAGES)
    for path in sorted((ROOT / package).rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


@pytest.mark.virtual_limit(3_600.0)  # the example of run_virtual sleeps for an hour
@pytest.mark.parametrize("module", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_examples_of_a_module_are_true(module: Path) -> None:
    """Three of two hundred were not: two showed classes by former names, one a rounded number."""
    name = ".".join(module.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    results = doctest.testmod(importlib.import_module(name))
    assert results.attempted
    assert results.failed == 0
