"""Interruptions delayed until a call into a library with Python callbacks has returned."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def delayed_signals() -> Iterator[None]:
    """Delay SIGINT and SIGTERM to the end of the block.

    Their handlers raise an exception wherever Python code runs. In a callback of ctypes it would be printed and lost:
    the callback's result is missing, and the signal has no effect. Only the main thread runs handlers.
    """
    handlers = {number: handler for number in _SIGNALS if callable(handler := signal.getsignal(number))}
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    for number in handlers:
        signal.signal(number, lambda got, _: received.append(got))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if received:
            signal.raise_signal(received[0])
