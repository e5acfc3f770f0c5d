"""Control laws, one file a paper; each `design` returns the law and its guarantees together."""

from collections.abc import Callable

from controllers import (
    burkov,
    dwell_relay,
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
    "burkov_position": burkov.position,
    "burkov_path": burkov.path,
    "burkov_flexible_joint": burkov.flexible_joint,
    "burkov_body_vectors": burkov.body_vectors,
    "burkov_permanent_rotation": burkov.permanent_rotation,
    "burkov_two_torques": burkov.two_torques,
    "dwell_relay": dwell_relay.design,
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
