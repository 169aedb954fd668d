"""A hub without a component, for the programs in bench/."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from backbone.keys import KEY_OF_HUB


@contextmanager
def bare_hub(config: zenoh.Config) -> Iterator[None]:
    """Be the hub until the block ends, with the token without which clients make their links anew."""
    with zenoh.open(config) as session:
        token = session.liveliness().declare_token(KEY_OF_HUB)
        try:
            yield
        finally:
            token.undeclare()
