"""A certificate as a page of text, as JSON and as a picture."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from spacecraft_sim import certificate_words
from spacecraft_sim.attack import broken, word
from spacecraft_sim.certificate import AxisCertificate
from spacecraft_sim.certificate_curves import Curves
from spacecraft_sim.certificate_input import Craft
from spacecraft_sim.certificate_words import Fed, accuracy, angle, because, vacuous
from spacecraft_sim.dwell_axes import Accuracy
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.versions import versions

BOUND = "  |theta| at most"  # label of the rows that count


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """A certificate as it is printed and written.

    Attributes:
        title: What was certified.
        holds: Whether it is certified, and no flight passed a bound.
        result: What it comes to, in one sentence; it begins with "guaranteed" if it holds.
        rows: A label and one text an axis.
        sections: Lines under the table, by heading.
    """

    title: str
    holds: bool
    result: str
    rows: tuple[tuple[str, ...], ...]
    sections: dict[str, list[str]]


def page(
    craft: Craft,
    certificates: Sequence[AxisCertificate],
    measured: Sequence[Curves],
    attacks: Mapping[str, Verdict],
    flights: int,
) -> Page:
    """Puts a certificate into words.

    Args:
        craft: What was certified.
        certificates: What is guaranteed about each axis.
        measured: The curves of each axis.
        attacks: The verdict on the worst flight about each axis that was attacked.
        flights: How many were flown about each.
    """
    table, result = rows(certificates, measured), certificate_words.result(certificates, attacks)
    reasons = explanations(certificates)
    shown = "\n".join([result, *reasons, *(cell for row in table for cell in row)])
    return Page(
        title=f"{craft.name}: {craft.title}",
        holds=all(c.holds for c in certificates) and not any(map(broken, attacks.values())),
        result=result,
        rows=tuple(table),
        sections={
            "symbols": certificate_words.glossary(shown),
            "axis by axis": reasons,
            "assumptions": assumptions(certificates),
            "attacked": attacked(attacks, flights),
            "left out": [f"{curve.axis}: {what}" for curve in measured for what in curve.left_out],
        },
    )


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

    def bounds(law: str, fed: Fed) -> None:
        """The terms of a bound and their sum."""

        def cell(c: AxisCertificate, part: Callable[[Accuracy], float]) -> str:
            own = accuracy(c, fed)
            why = vacuous(certificates, c, fed)
            if math.isinf(part(own)):
                return f"vacuous: {why}"
            return _angle(part(own)) if math.isfinite(own.contour) else ""

        for label, part in ((law, _contour), *_TERMS[fed].items(), (BOUND, _total)):
            row(label, lambda c, part=part: cell(c, part))

    row("torque M0", lambda c: f"{c.torque:.6g} N m")
    row("least time between switchings", lambda c: f"{c.dwell:.6g} s")
    row("constant disturbance F = M1/M0", lambda c: f"{c.bias:.4g}")
    row("inertia J", lambda c: f"{c.inertia:.7g} kg m^2")
    row("M_e, printed bound", lambda c: _number(c.moment, "N m", 7, "refused"))
    row("M_e, any switching (L1)", lambda c: f"{c.moment_l1:.7g} N m")
    table.append(("worst case that exists", *(_number(x.here, "N m", 6) for x in measured)))
    table.append(("  flown in MuJoCo", *(_flown(x) for x in measured)))
    row("e, disturbance over thrust", lambda c: f"{c.disturbance:.6g}")
    row("A_m of the worst joint", lambda c: f"{c.deflection:.4g} ({c.joint})")
    bounds("relay on the attitude: p0 u0 dwell^2", "attitude")
    for name in certificates[0].others:
        row(name, lambda c, name=name: _other(c, name))
    bounds("relay on the quasi-rigid angle: p0 u0 dwell^2", "quasi_rigid")
    row("sup |H q'|/J", lambda c: f"{c.sway:.4g} rad/s")
    return table


def _contour(accuracy: Accuracy) -> float:
    return accuracy.contour


def _total(accuracy: Accuracy) -> float:
    return accuracy.total


_SHARED: dict[str, Callable[[Accuracy], float]] = {
    "  late switching: sampling, delay": lambda a: a.sampling,
    "  axes turning each other": lambda a: a.coupling,
}
_TERMS: dict[Fed, dict[str, Callable[[Accuracy], float]]] = {
    "attitude": _SHARED,
    "quasi_rigid": {**_SHARED, "  sup |H q|/J": lambda a: a.lean},
}


def _other(certificate: AxisCertificate, law: str) -> str:
    """The bound of another regulator, or the condition that it misses."""
    missed, _, _ = certificate.refused_others.get(law, "").partition(":")
    return f"vacuous: {missed}" if missed else _angle(certificate.others[law])


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
    """Returns a line on each axis, why what is vacuous is, and what would help.

    Args:
        certificates: What is guaranteed about each axis.
    """
    lines = [f"printed bound refused: {certificates[0].refused}"] if certificates[0].refused else []
    for c in certificates:
        mark = "vacuous on the attitude; " if vacuous(certificates, c, "attitude") else ""
        lines.append(f"{c.axis}: {mark}{c.why}")
        if mark and c.remedy is None:
            lines.append(f"   {because(certificates, [c], 'attitude')}")
        if c.remedy:
            lines.append(f"   {certificate_words.remedy(c.axis, c.remedy)}")
        if vacuous(certificates, c, "quasi_rigid"):
            why = because(certificates, [c], "quasi_rigid")
            lines.append(f"   vacuous on the quasi-rigid angle; {why}")
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
    page: Page,
    certificates: Sequence[AxisCertificate],
    measured: Sequence[Curves],
    attacks: Mapping[str, Verdict],
) -> None:
    """Writes `certificate.md`, `certificate.json` and `certificate.png`.

    Args:
        folder: An existing folder.
        craft: What was certified.
        page: The certificate in words.
        certificates: What is guaranteed about each axis.
        measured: The curves of each axis.
        attacks: The verdict on the worst flight about each axis that was attacked.
    """
    from spacecraft_sim import plots_certificate

    table = {
        "spacecraft": craft.name,
        "holds": page.holds,
        "result": page.result,
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
    (folder / "certificate.md").write_text(_markdown(page), encoding="utf-8")
    plots_certificate.write(
        folder / "certificate.png", page.title, page.result, certificates, measured
    )


def _markdown(page: Page) -> str:
    cells = [("", "x", "y", "z"), ("---",) * 4, *page.rows]
    table = ["| " + " | ".join(c.strip().replace("|", "\\|") for c in row) + " |" for row in cells]
    lines = [f"# {page.title}", "", f"**{page.result}**", "", *table]
    for heading, texts in page.sections.items():
        if texts:
            lines += ["", f"## {heading}", "", *(_item(text) for text in texts)]
    return "\n".join(lines) + "\n"


def _item(text: str) -> str:
    """A line of a list; one that is indented belongs to the line above."""
    return f"  - {text.strip()}" if text.startswith(" ") else f"- {text}"


def _number(value: float, unit: str, digits: int, word: str = "not computed") -> str:
    return f"{value:.{digits}g} {unit}" if math.isfinite(value) else word


def _angle(value: float) -> str:
    """Radians and arc seconds."""
    return f"{value:.4g} rad = {angle(value)}" if value else "0"


def _plain(value: Any) -> Any:
    """JSON has no word for what is not finite: null."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
