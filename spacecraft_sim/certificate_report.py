"""A certificate as rows of text, as JSON and as a picture."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from spacecraft_sim.attack import word
from spacecraft_sim.certificate import AxisCertificate
from spacecraft_sim.certificate_curves import Curves
from spacecraft_sim.certificate_input import Craft
from spacecraft_sim.dwell_axes import Accuracy
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.versions import versions

ARCSEC = math.degrees(1) * 3600  # of a radian


def rows(
    certificates: Sequence[AxisCertificate], measured: Sequence[Curves]
) -> list[tuple[str, ...]]:
    """Returns rows of label and one text an axis.

    Args:
        certificates: What is guaranteed about each axis.
        measured: The curves of each axis.
    """
    table: list[tuple[str, ...]] = []

    def row(label: str, text: Callable[[AxisCertificate], str]) -> None:
        table.append((label, *(text(c) for c in certificates)))

    row("torque M0", lambda c: f"{c.torque:.6g} N m")
    row("least time between switchings", lambda c: f"{c.dwell:.6g} s")
    row("constant disturbance F = M1/M0", lambda c: f"{c.bias:.4g}")
    row("inertia J", lambda c: f"{c.inertia:.7g} kg m^2")
    row("M_e, printed bound", lambda c: _number(c.moment, "N m", 7, "refused"))
    row("M_e, any switching (L1)", lambda c: f"{c.moment_l1:.7g} N m")
    table.append(("worst case that exists", *(_number(x.here, "N m", 6) for x in measured)))
    table.append(("  flown in MuJoCo", *(_flown(x) for x in measured)))
    row("eps0 = M_e/M0", lambda c: f"{c.disturbance:.6g}")
    row("A_m of the worst joint", lambda c: f"{c.deflection:.4g} ({c.joint})")
    row("two-level relay on the attitude: p0 u0 dwell^2", lambda c: _angle(c.attitude.contour))
    for label, part in _TERMS.items():
        row(f"  {label}", lambda c, part=part: _term(part(c.attitude), c.attitude.contour))
    row("[bold]  |theta| at most[/]", lambda c: f"[bold]{_angle(c.attitude.total)}[/]")
    for name in certificates[0].others:
        row(name, lambda c, name=name: _angle(c.others[name]))
    row("relay on the quasi-rigid angle: p0 u0 dwell^2", lambda c: _angle(c.quasi_rigid.contour))
    for label, part in _TERMS.items():
        row(f"  {label}", lambda c, part=part: _angle(part(c.quasi_rigid)))
    row("  sup |H q|/J", lambda c: _angle(c.quasi_rigid.lean))
    row("[bold]  |theta| at most[/]", lambda c: f"[bold]{_angle(c.quasi_rigid.total)}[/]")
    row("sup |H q'|/J", lambda c: f"{c.sway:.4g} rad/s")
    return table


_TERMS: dict[str, Callable[[Accuracy], float]] = {
    "late switching: sampling, delay": lambda a: a.sampling,
    "axes turning each other": lambda a: a.coupling,
}


def _flown(curve: Curves) -> str:
    """The largest moment in the flight of the worst schedule at the certified dwell."""
    if not curve.here:
        return ""
    here = [row for row in curve.measured.tolist() if row[0] == curve.dwell]
    if not here:
        return "not flown"
    _, peak, small = here[0]
    return f"{peak:.6g} N m" + ("" if small else ", beyond small motion")


def attacked(attacks: Mapping[str, Verdict], flights: int) -> list[str]:
    """Returns a line on each axis that was attacked.

    Args:
        attacks: The verdict on the worst flight about each axis.
        flights: How many were flown about each.
    """
    return [
        f"{axis}: the worst of {flights} flights reaches {v.measured:.6g} N m, "
        f"{v.measured / v.bound:.1%} of M_e and what small motion leaves out: {word(v)}"
        for axis, v in attacks.items()
    ]


def explanations(certificates: Sequence[AxisCertificate]) -> list[str]:
    """Returns a line on each axis, and on each that is vacuous what would help.

    Args:
        certificates: What is guaranteed about each axis.
    """
    lines = [f"printed bound refused: {certificates[0].refused}"] if certificates[0].refused else []
    for c in certificates:
        lines.append(f"{c.axis}: {'vacuous on the attitude; ' if c.remedy else ''}{c.why}")
        if c.remedy is None:
            continue
        helps = [
            f"a dwell above {c.remedy.dwell:.4g} s"
            if math.isfinite(c.remedy.dwell)
            else "no dwell",
            f"{c.remedy.damping:.3g} times the damping"
            if math.isfinite(c.remedy.damping)
            else "no damping",
        ]
        if not math.isnan(c.remedy.mass):
            mass = f"elastic masses of {c.remedy.mass:.3g} times their own"
            helps.append(mass if c.remedy.mass else "no elastic mass")
        lines.append(f"   what would do, the rest unchanged: {', or '.join(helps)}")
    return lines


def assumptions(certificates: Sequence[AxisCertificate]) -> list[str]:
    """Returns each assumption once, with its numbers.

    Args:
        certificates: What is guaranteed about each axis.
    """
    return list(dict.fromkeys(str(a) for c in certificates for a in c.assumptions))


def write(
    folder: Path,
    craft: Craft,
    certificates: Sequence[AxisCertificate],
    measured: Sequence[Curves],
    attacks: Mapping[str, Verdict],
) -> None:
    """Writes `certificate.json` and `certificate.png`.

    Args:
        folder: An existing folder.
        craft: What was certified.
        certificates: What is guaranteed about each axis.
        measured: The curves of each axis.
        attacks: The verdict on the worst flight about each axis that was attacked.
    """
    from spacecraft_sim import plots_certificate

    table = {
        "spacecraft": craft.name,
        "holds": all(c.holds for c in certificates),
        "axes": [
            {
                **asdict(c),
                "attitude": {**asdict(c.attitude), "total": c.attitude.total},
                "quasi_rigid": {**asdict(c.quasi_rigid), "total": c.quasi_rigid.total},
                "assumptions": [{**asdict(a), "holds": a.holds} for a in c.assumptions],
                "why": c.why,
                "holds": c.holds,
                "exact_worst_case": curve.here,
                "curves": {
                    "bound": curve.bound.tolist(),
                    "worst_case": curve.worst.tolist(),
                    "measured": curve.measured.tolist(),
                    "left_out": curve.left_out,
                },
            }
            for c, curve in zip(certificates, measured, strict=True)
        ],
        "attacks": {axis: {"word": word(v), **asdict(v)} for axis, v in attacks.items()},
        "versions": versions(),
    }
    text = json.dumps(_plain(table), indent=2, allow_nan=False, ensure_ascii=False)
    (folder / "certificate.json").write_text(text + "\n", encoding="utf-8")
    plots_certificate.write(folder / "certificate.png", craft.title, certificates, measured)


def _number(value: float, unit: str, digits: int, word: str = "not computed") -> str:
    return f"{value:.{digits}g} {unit}" if math.isfinite(value) else word


def _angle(value: float) -> str:
    """Radians and arc seconds."""
    if math.isinf(value):
        return "vacuous"
    return f'{value:.4g} rad = {value * ARCSEC:.4g}"' if value else "0"


def _term(value: float, first: float) -> str:
    """A further term; nothing is said of it where the first is infinite."""
    if math.isinf(first):
        return ""
    return _angle(value) if math.isfinite(value) else "unbounded"


def _plain(value: Any) -> Any:
    """JSON has no word for what is not finite: null."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
