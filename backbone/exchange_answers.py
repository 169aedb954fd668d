"""The answers of one component to requests for exchanges: a lost answer can be asked for again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine

from backbone.exchange import SwapClass, SwapModule, Swapped, UnknownExchange

MOST_KEPT = 16  # chosen: exchanges of one component that people request while one of them waits for its answer


class ExchangeAnswers:
    """Answers each request by its exchange, and a repeated request by the exchange that its id names."""

    def __init__(self) -> None:
        self._exchanges: dict[str, asyncio.Task[Swapped]] = {}

    async def answer(
        self, asked: SwapModule | SwapClass, exchange: Callable[[], Coroutine[object, None, Swapped]]
    ) -> Swapped:
        """Return the answer to this request when its exchange is over.

        Args:
            exchange: Begins the exchange.

        Raises:
            UnknownExchange: The request is repeated, and this process has begun no exchange of its id.
            Refusal: The exchange was refused.
        """
        if asked.is_repeated:
            if asked.exchange_id not in self._exchanges:
                raise UnknownExchange("it was started again meanwhile")
            return await asyncio.shield(self._exchanges[asked.exchange_id])
        going = asyncio.create_task(exchange(), name=f"exchange for {asked.class_path}")
        if asked.exchange_id:
            self._exchanges[asked.exchange_id] = going
            while len(self._exchanges) > MOST_KEPT:
                del self._exchanges[next(iter(self._exchanges))]
        return await going
