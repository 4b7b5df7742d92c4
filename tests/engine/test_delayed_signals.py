"""A signal during a callback of a library takes effect after the call, and is not lost."""

from __future__ import annotations

import ctypes
import signal
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import pytest

from vdyn_cli.engine.delayed_signals import delayed_signals


class TerminatedError(BaseException):
    """What the handler raises."""


def _raise(number: int, frame: object) -> None:
    raise TerminatedError


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(("block", "lost"), [(nullcontext, True), (delayed_signals, False)])
def test_a_signal_within_a_callback_is_delayed(block: Callable[[], AbstractContextManager[None]], lost: bool) -> None:
    done: list[int] = []

    def interrupted() -> None:
        signal.raise_signal(signal.SIGTERM)
        done.append(1)

    call = ctypes.CFUNCTYPE(None)(interrupted)
    before = signal.signal(signal.SIGTERM, _raise)
    try:
        if lost:
            with block():
                call()
        else:
            with pytest.raises(TerminatedError), block():
                call()
        assert signal.getsignal(signal.SIGTERM) is _raise
    finally:
        signal.signal(signal.SIGTERM, before)
    assert len(done) == (not lost)
