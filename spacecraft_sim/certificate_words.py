"""A certificate in sentences: what is guaranteed, or why nothing is; what would help; symbols."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Literal

from spacecraft_sim.attack import broken
from spacecraft_sim.certificate import AxisCertificate
from spacecraft_sim.dwell_axes import Accuracy
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.remedy import Remedy

Fed = Literal["attitude", "quasi_rigid"]

ARCSEC = math.degrees(1) * 3600  # of a radian
FED: dict[Fed, str] = {"attitude": "attitude", "quasi_rigid": "quasi-rigid angle"}


def accuracy(certificate: AxisCertificate, fed: Fed) -> Accuracy:
    """Returns what the relay guarantees about an axis.

    Args:
        certificate: What is guaranteed about the axis.
        fed: The angle that the relay feeds back.
    """
    return certificate.attitude if fed == "attitude" else certificate.quasi_rigid


def angle(value: float) -> str:
    """Returns an angle in arc seconds, with as many digits wherever it is shown.

    Args:
        value: The angle, rad.
    """
    return f'{value * ARCSEC:.4g}"'


def result(certificates: Sequence[AxisCertificate], attacks: Mapping[str, Verdict]) -> str:
    """Returns what it all comes to, in one sentence.

    Args:
        certificates: What is guaranteed about each axis.
        attacks: The verdict on the worst flight about each axis that was attacked.
    """
    failed = dict.fromkeys(str(a) for c in certificates for a in c.assumptions if not a.holds)
    faults = _nothing(certificates)
    if failed:
        faults.append(f"an assumption does not hold ({'; '.join(failed)})")
    if passed := [axis for axis, verdict in attacks.items() if broken(verdict)]:
        faults.append(f"a flight passed the bound M_e about {listed(passed)}")
    if not faults:
        return (
            f"guaranteed about {_bounds(certificates, 'attitude')} (relay on the attitude); "
            "every assumption holds"
        )
    if not failed and not passed and all(math.isfinite(c.quasi_rigid.total) for c in certificates):
        figures = _bounds(certificates, "quasi_rigid")
        faults.append(f"a relay on the quasi-rigid angle is guaranteed about {figures}")
    return f"not certified: {'; '.join(faults)}"


def promise(certificates: Sequence[AxisCertificate], certificate: AxisCertificate) -> str:
    """Returns what is guaranteed about an axis by either angle, a line each.

    Args:
        certificates: What is guaranteed about each axis.
        certificate: What is guaranteed about this one.
    """
    lines = []
    for fed, words in FED.items():
        short = vacuous(certificates, certificate, fed)
        total = accuracy(certificate, fed).total
        bound = f"vacuous: {short}" if short else f"|theta| <= {angle(total)}"
        lines.append(f"by the {words} {bound}")
    head = f"{certificate.axis}: e = {certificate.disturbance:.3g}; "
    return head + "\n".join(lines)


def vacuous(certificates: Sequence[AxisCertificate], certificate: AxisCertificate, fed: Fed) -> str:
    """Returns why nothing is guaranteed about an axis, in few words; nothing if something is.

    Args:
        certificates: What is guaranteed about each axis.
        certificate: What is guaranteed about this one.
        fed: The angle that the relay feeds back.
    """
    own = accuracy(certificate, fed)
    if math.isfinite(own.total):
        return ""
    if math.isinf(own.contour):
        return "e >= 1 - |F|" if fed == "attitude" else "torques about other axes"
    if loose := _loose(certificates, fed):
        return f"{', '.join(loose)} {'turns' if len(loose) == 1 else 'turn'} it"
    return "axes turn each other"


def because(
    certificates: Sequence[AxisCertificate], axes: Sequence[AxisCertificate], fed: Fed
) -> str:
    """Returns why nothing is guaranteed about axes with the same reason, with figures.

    Args:
        certificates: What is guaranteed about each axis.
        axes: Those about which nothing is, for one reason.
        fed: The angle that the relay feeds back.
    """
    if math.isinf(accuracy(axes[0], fed).contour):
        room = listed(list(dict.fromkeys(f"{1 - abs(c.bias):.4g}" for c in axes)))
        if fed == "quasi_rigid":
            return (
                "the torques about the other axes, which products of inertia bring in, are not "
                f"below 1 - |F| = {room} of the thrust"
            )
        e = listed([f"{c.disturbance:.4g}" for c in axes])
        return f"the disturbance, e = {e} times the thrust, is not below 1 - |F| = {room}"
    if loose := _loose(certificates, fed):
        return f"{listed(loose)}, about which nothing holds the bus, may turn it"
    lengths = ", ".join(
        f"{c.axis} {c.torque / c.inertia * c.dwell**2:.3g} rad" for c in certificates
    )
    return (
        f"the axes turn each other too fast (u0 dwell^2 is {lengths}): weaken the thrust, shorten "
        "the dwell or switch less late"
    )


def listed(words: Sequence[str]) -> str:
    """Returns words as a list with "and".

    Args:
        words: The words.
    """
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def remedy(axis: str, found: Remedy) -> str:
    """Returns what would help an axis, and what would not.

    Args:
        axis: The axis.
        found: What helps.
    """
    tried = [
        (math.isfinite(found.dwell), f"a dwell above {found.dwell:.4g} s", "no dwell is long"),
        (math.isfinite(found.damping), f"{found.damping:.3g} times the damping", "no damping is"),
    ]
    if not math.isnan(found.mass):
        lighter = f"elastic masses times {found.mass:.3g}"
        tried.append((found.mass > 0, lighter, "no elastic mass is small"))
    does = [yes for helps, yes, _ in tried if helps]
    fails = [f"{no} enough" for helps, _, no in tried if not helps]
    would = f"{', or '.join(does) or 'no single change'} would do about {axis}, the rest unchanged"
    return "; ".join([would, *([", ".join(fails)] if fails else [])])


# Symbol, how it is found where it is shown, and what it means; in the order of the table.
_GLOSSARY = (
    ("theta", r"theta", "angle of the bus about the axis from where it is held"),
    ("vacuous", r"vacuous", "no finite bound, so nothing is said"),
    ("F", r"\bF\b", "M1/M0, the constant torque on the bus over the thrust"),
    ("M_e", r"\bM_e\b", "what the elastic parts do to the bus about the axis at most"),
    ("printed bound", r"printed bound", "(27) of Sokolov (2004); falls with the dwell"),
    ("L1", r"\bL1\b", "holds without any dwell, by the integral of the response"),
    (
        "e",
        r"\be\b|\beps\b",
        "eps of the papers: the smaller M_e over M0, and what the torques of the other axes add by "
        "products of inertia",
    ),
    ("A_m", r"\bA_m\b", "how far a joint bends at most, rad (slides: m)"),
    (
        "p0",
        r"\bp0\b",
        "half the width of the band the angle stays in, in units of u0 dwell^2; a function of F "
        "and e",
    ),
    ("u0", r"\bu0\b", "M0/J, the angular acceleration by the thrust"),
    ("dwell", r"\bdwell\b", "least time between switchings"),
    (
        "axes turning each other",
        r"axes turning",
        "what rates about other axes add: gyroscopic torques, and rotations that do not commute",
    ),
    (
        "H q",
        r"H q\b(?!')",
        "H q' is the angular momentum of the bending; the quasi-rigid angle is theta + H q/J, in "
        "whose equation the elastic moment cancels",
    ),
    ("sup", r"\bsup\b", "the largest value at any time"),
    ("mu", r"\bmu\b", "share of the inertia that moves elastically"),
    ("sigma", r"\bsigma\b", "decay rate of the mode that disturbs the axis most"),
)


def glossary(shown: str) -> list[str]:
    """Returns a line on each symbol that is shown.

    Args:
        shown: All that is shown.
    """
    return [f"{symbol}: {text}" for symbol, found, text in _GLOSSARY if re.search(found, shown)]


def _bounds(certificates: Sequence[AxisCertificate], fed: Fed) -> str:
    return ", ".join(f"{c.axis} {angle(accuracy(c, fed).total)}" for c in certificates)


def _loose(certificates: Sequence[AxisCertificate], fed: Fed) -> list[str]:
    """Axes without a contour: they may turn the others at will."""
    return [c.axis for c in certificates if math.isinf(accuracy(c, fed).contour)]


def _nothing(certificates: Sequence[AxisCertificate]) -> list[str]:
    """A clause for each reason why nothing is guaranteed on the attitude, with its axes."""
    reasons: dict[str, list[AxisCertificate]] = {}
    for c in certificates:
        if short := vacuous(certificates, c, "attitude"):
            reasons.setdefault(short, []).append(c)
    return [
        f"about {listed([c.axis for c in axes])} nothing is guaranteed because "
        f"{because(certificates, axes, 'attitude')}"
        for axes in reasons.values()
    ]
