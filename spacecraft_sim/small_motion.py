"""Where small, slow motion ends: limits of the linear theory of elastic parts.

The theory drops products of deflections and rates.  Measured on the shipped machines under the
worst switching there is, a deflection of 0.03 rad adds up to 1.1 % to the moment of the elastic
parts, and a bus that turns at a tenth of the slowest decay up to 0.9 %, the Coriolis forces of the
bus against the damping: 2 % together.  Beyond, both grow in proportion: at 0.11 rad 4.8 %, at a
third of the decay 3.1 %.

Source: Sokolov (2004), (12), which asks for small r and r', and, left out there, small omega.
"""

from spacecraft_sim.guarantee import Assumption

SMALL = 0.03  # rad, and share of its distance from the centre of mass for what slides
SLOW = 0.1  # rate of the bus, without its elastic vibration, over the slowest decay
LEFT_OUT = 0.02  # share of the moment that may come on top within these limits


def small_deflection(name: str, share: float) -> Assumption:
    """Returns the assumption that a deflection is small.

    Args:
        name: The elastic coordinate.
        share: Its largest deflection over what it must be small beside, as `SMALL`.
    """
    return Assumption(text=f"small motion: deflection of {name}", value=share, limit=SMALL)


def slow_rotation(rate: float, decay: float) -> Assumption:
    """Returns the assumption that the bus turns slowly.

    Args:
        rate: Largest rate of the bus without its elastic vibration, rad/s.
        decay: sigma of the slowest elastic motion, 1/s.
    """
    text = "slow rotation: rate over the slowest decay"
    return Assumption(text=text, value=rate / decay, limit=SLOW)
