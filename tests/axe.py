"""What axe-core finds on a page."""

from __future__ import annotations

from importlib import resources
from typing import Any

import pytest

GRAVE = ("serious", "critical")


async def serious_findings(page: Any) -> list[str]:
    """Return the faults for people who use a screen reader, zoom or keys, of level serious and above."""
    package = pytest.importorskip("axe_playwright_python", reason="axe-core is not installed")
    if not await page.evaluate("() => 'axe' in window"):
        await page.evaluate(resources.files(package).joinpath("axe.min.js").read_text())  # past the page's policy
    found = await page.evaluate("() => axe.run({ resultTypes: ['violations'] })")  # of the others only one each
    return [
        f"{one['id']}: {node['html'][:120]} {node['failureSummary']}"
        for one in found["violations"]
        if one["impact"] in GRAVE
        for node in one["nodes"]
    ]
