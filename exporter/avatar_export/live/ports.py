"""The UDP ports at which motion arrives."""

from __future__ import annotations

from dataclasses import dataclass

LIVE_LINK_PORT, OSC_PORT = 11111, 39539  # the usual ones of Live Link Face and of VMC


@dataclass(frozen=True)
class Ports:
    """Where motion arrives by UDP; 0 takes a free port."""

    live_link: int = LIVE_LINK_PORT
    osc: int = OSC_PORT
