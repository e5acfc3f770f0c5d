"""What a smooth law is apart from its sampling: a formula, and first-order filters of readings."""

from collections.abc import Sequence
from typing import Protocol

Numbers = tuple[float, ...]


class Filter(Protocol):
    """A bank of first-order filters w' = -K w + z'."""

    @property
    def cutoffs(self) -> Numbers:
        """K, one a channel, 1/s."""
        ...

    def coefficients(self, period: float) -> tuple[Numbers, Numbers]:
        """Returns a and b of w_k = a w_{k-1} + b (z_k - z_{k-1}), each one a channel.

        Args:
            period: Sampling period, s.
        """
        ...


class Formula(Protocol):
    """A law in continuous time."""

    def filtered(self, t: float, y: Sequence[float]) -> Sequence[float]:
        """Returns z, what is filtered.

        Args:
            t: Time, s.
            y: Readings, in the order of the law's sensors.
        """
        ...

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> Sequence[float]:
        """Returns the torques, N m.

        Args:
            t: Time, s.
            y: Readings, in the order of the law's sensors.
            w: Filtered rates of z.
        """
        ...


class FilteredLaw(Protocol):
    """A law whose memory is that of its filter alone."""

    @property
    def formula(self) -> Formula:
        """The law in continuous time."""
        ...

    @property
    def filter(self) -> Filter:
        """Its filter."""
        ...

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the readings."""
        ...

    @property
    def thrusters(self) -> tuple[str, ...]:
        """Names of the channels."""
        ...
