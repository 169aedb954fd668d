"""What the reader says of every broken file, beside this program in ``messages.json``; run to record it anew.

The record is what a person has read and found good: a message that changes shows in it.
"""

from __future__ import annotations

import json
from pathlib import Path

from mission_files import faults_of_broken

HERE = Path(__file__).parent
MESSAGES = HERE / "messages.json"


def messages() -> dict[str, list[str]]:
    """Return for each broken file its faults, as ``line:column: message (remedy)``."""
    return {path.stem: messages_of(path) for path in sorted((HERE / "broken").glob("*.xml"))}


def messages_of(path: Path) -> list[str]:
    """Return the faults of one file, without its name."""
    return [str(one).removeprefix(f"{path}:").replace(str(path.parent), ".") for one in faults_of_broken(path)]


if __name__ == "__main__":
    MESSAGES.write_text(json.dumps(messages(), indent=1, ensure_ascii=False) + "\n")
