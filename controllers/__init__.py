"""Control laws, one file a paper; each `design` returns the law and its guarantees together."""

from collections.abc import Callable

from controllers import (
    efremov,
    efremov_observer,
    ivanova_sokolov,
    ivanova_sokolov_axes,
    manoeuvre,
    phase_plane,
    pwpf,
    schmitt_trigger,
)
from spacecraft_sim.controller import Controller
from spacecraft_sim.guarantee import Guarantee

Design = Callable[..., tuple[Controller, tuple[Guarantee, ...]]]  # (model, thrusters, **parameters)

REGISTRY: dict[str, Design] = {
    "efremov_local": efremov.design_local,
    "efremov_nonlocal": efremov.design_nonlocal,
    "efremov_observed": efremov_observer.design_observed,
    "ivanova_sokolov": ivanova_sokolov.design,
    "ivanova_sokolov_axes": ivanova_sokolov_axes.design,
    "manoeuvre": manoeuvre.design,
    "phase_plane": phase_plane.design,
    "pwpf": pwpf.design,
    "schmitt_trigger": schmitt_trigger.design,
}
