"""Sessions of zenoh: their configuration, opening and close."""

from __future__ import annotations

import asyncio
import json
import logging
from concurrent.futures import Future, ThreadPoolExecutor

import zenoh

from backbone.bus.zenoh_settings import client_settings, hub_settings
from backbone.errors import HubUnreachable

log = logging.getLogger(__name__)


def client_config(endpoint: str, secret: str = "") -> zenoh.Config:
    """Return the configuration of a client; see ``client_settings``."""
    return _config(client_settings(endpoint, secret))


def hub_config(listen: list[str], *, dictionary_file: str = "") -> zenoh.Config:
    """Return the configuration of a hub; see ``hub_settings``."""
    return _config(hub_settings(listen, dictionary_file))


def _config(settings: dict[str, object]) -> zenoh.Config:
    return zenoh.Config.from_json5(json.dumps(settings))


def is_hub(config: zenoh.Config) -> bool:
    """Return whether it is the configuration of a hub."""
    return bool(json.loads(config.get_json("mode")) == "router")


def _unreachable(config: zenoh.Config, error: zenoh.ZError) -> HubUnreachable:
    """Return the error of a session that did not open; zenoh's own text names lines of its source."""
    if is_hub(config):
        return HubUnreachable(str(error))
    return HubUnreachable(f"no hub answers at {', '.join(json.loads(config.get_json('connect/endpoints')))}")


def open_session(config: zenoh.Config) -> zenoh.Session:
    """Return a new session.

    Raises:
        HubUnreachable: No hub listens at the endpoint, or (for a hub) the port is taken.
    """
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise _unreachable(config, error) from error


async def open_when_up(config: zenoh.Config) -> zenoh.Session:
    """Return a new session as soon as the hub listens, without blocking the event loop.

    Raises:
        HubUnreachable: The hub did not listen within ``OPEN_TIMEOUT_MS``.
    """
    pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="zenoh_open")
    opening = pool.submit(zenoh.open, config)
    pool.shutdown(wait=False)
    try:
        return await asyncio.shield(asyncio.wrap_future(opening))
    except asyncio.CancelledError:
        opening.add_done_callback(_close_unwanted)
        raise
    except zenoh.ZError as error:
        raise _unreachable(config, error) from error


async def close_session(session: zenoh.Session) -> None:
    """Close the session; return when its threads have ended, or when zenoh stops waiting for them: after 10 s."""
    await asyncio.get_running_loop().run_in_executor(None, _close, session)


def _close_unwanted(opening: Future[zenoh.Session]) -> None:
    """Close a session that opened after its opener was cancelled, because an open session keeps the process alive."""
    if opening.exception() is None:
        _close(opening.result())


def _close(session: zenoh.Session) -> None:
    try:
        session.close()  # type: ignore[no-untyped-call]
    except zenoh.ZError as error:  # its threads hang: seen once; a component that ends must not fail because of it
        log.warning("a session is left as it is: %s", error)
