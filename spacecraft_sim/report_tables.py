"""The words and tables of a report as HTML: verdicts, assumptions, parameters, errata, commands."""

import re
from collections.abc import Iterable, Sequence
from html import escape

from spacecraft_sim.compare import Comparison, Difference
from spacecraft_sim.errata import Section
from spacecraft_sim.guarantee import Assumption, Verdict

Row = Sequence[str]


def table(heads: Sequence[str], rows: Iterable[tuple[str, Row]], numbers: str = "") -> str:
    """Returns a table.

    Args:
        heads: Head of each column.
        rows: Class and cells of each row; the cells are HTML.
        numbers: A letter a column; `n` where figures stand, which are set to the right.
    """

    def cell(tag: str, k: int, text: str) -> str:
        kind = {"n": ' class="number"', "m": ' class="mark"'}.get(numbers[k : k + 1], "")
        return f"<{tag}{kind}>{text}</{tag}>"

    head = "".join(cell("th", k, text) for k, text in enumerate(heads))
    body = "".join(
        f'<tr class="{name}">{"".join(cell("td", k, text) for k, text in enumerate(cells))}</tr>\n'
        for name, cells in rows
    )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead>\n{body}</table></div>'


def verdicts(comparison: Comparison) -> str:
    """Returns the verdicts on the full plant, numbered.

    Args:
        comparison: How a run came out.
    """
    rows = [
        ("holds" if v.holds else "fails", _verdict(k, v, reduced))
        for k, (v, reduced) in enumerate(
            zip(comparison.verdicts, comparison.reduced, strict=True), start=1
        )
    ]
    heads = ("verdict", "#", "claim", "predicted", "reduced", "MuJoCo", "bound", "margin left")
    return table((*heads, "worst at"), rows, "mn-nnnnnn")


def _verdict(number: int, v: Verdict, reduced: Verdict) -> Row:
    source = f'<span class="note">{escape(v.source)}</span>'
    failed = "".join(
        f'<span class="note bad">assumption fails: {escape(str(a))}</span>' for a in v.failed
    )
    share = min(max(v.margin, 0.0), 1.0) if v.margin == v.margin else 0.0
    bar = f'<span class="bar"><i style="width:{100 * share:.1f}%"></i></span>'
    worst = (
        "" if v.t_worst is None else f'<button data-time="{v.t_worst!r}">{v.t_worst:.2f} s</button>'
    )
    return (
        v.outcome,
        str(number),
        f"{escape(v.claim)}{source}{failed}",
        "" if v.predicted is None else amount(v.predicted, v.unit),
        amount(reduced.measured, v.unit),
        amount(v.measured, v.unit),
        f"{'±' if v.kind == 'within' else '≤ '}{amount(v.bound, v.unit)}",
        f"{100 * v.margin:.1f} %{bar}" if not v.margin < -1 else f"{1 - v.margin:.4g} × the bound",
        worst,
    )


def assumptions(found: Sequence[Verdict]) -> str:
    """Returns every assumption once, with its numbers and the claims that rest on it.

    Args:
        found: The verdicts, in the order in which they are numbered.
    """
    claims: dict[Assumption, list[int]] = {}
    for k, verdict in enumerate(found, start=1):
        for assumption in verdict.assumptions:
            claims.setdefault(assumption, []).append(k)
    if not claims:
        return "<p>The claims rest on no assumption.</p>"
    rows = [
        (
            "holds" if a.holds else "fails",
            (
                "holds" if a.holds else "fails",
                escape(a.text),
                f"{a.value:.6g}",
                escape({"<=": "≤", ">=": "≥"}.get(a.relation, a.relation)),
                f"{a.limit:.6g}",
                escape(a.unit),
                ", ".join(map(str, numbers)),
            ),
        )
        for a, numbers in sorted(claims.items(), key=lambda item: item[0].holds)
    ]
    heads = ("", "assumption", "value", "", "limit", "unit", "claims")
    return table(heads, rows, "m-n-n--")


def differences(found: Sequence[Difference]) -> str:
    """Returns how far the two plants are apart, signal by signal.

    Args:
        found: The differences.
    """
    rows = [
        ("", (escape(d.signal), amount(d.max_error, d.unit), amount(d.rms_error, d.unit)))
        for d in found
    ]
    return table(("signal", "largest difference", "root mean square"), rows, "-nn")


def parameters(groups: Sequence[tuple[str, Sequence[Row]]]) -> str:
    """Returns the parameters of a scenario, its spacecraft and its law, folded.

    Args:
        groups: Heading and rows of name, value, default, unit and description.
    """
    heads = ("parameter", "value", "default", "unit", "what")
    return "".join(
        f"<details><summary>{escape(heading)}</summary>"
        + table(heads, [("", [*map(escape, row)]) for row in rows])
        + "</details>"
        for heading, rows in groups
    )


def errata(found: Sequence[Section]) -> str:
    """Returns what is known of the papers behind a law.

    Args:
        found: Sections of the errata.
    """
    if not found:
        return "<p>No misprints are listed for the sources of this law.</p>"
    return "".join(f"<h3>{_inline(s.heading)}</h3>{markdown(s.text)}" for s in found)


def commands(lines: Sequence[tuple[str, str]]) -> str:
    """Returns shell commands, each with what it does and a button that copies it.

    Args:
        lines: What it does, and the command.
    """
    rows = [
        (
            "",
            (
                escape(what),
                f"<code>{escape(line)}</code>",
                f'<button data-copy="{escape(line)}">copy</button>',
            ),
        )
        for what, line in lines
    ]
    return table(("to", "run in this folder", ""), rows)


def amount(value: float, unit: str) -> str:
    """Returns a figure with its unit, all digits in its tip.

    Args:
        value: The figure.
        unit: Its unit.
    """
    return f'<span title="{value!r} {escape(unit)}">{value:.4g} {escape(unit)}</span>'


def markdown(text: str) -> str:
    """Returns paragraphs, headings and tables of a Markdown text as HTML.

    Args:
        text: The text; of inline marks it may have code, stress and escaped bars.
    """
    return "".join(_block(block.strip()) for block in re.split(r"\n\s*\n", text) if block.strip())


def _block(block: str) -> str:
    if block.startswith("|"):
        lines = [_cells(line) for line in block.splitlines()]
        return table(lines[0], [("", cells) for cells in lines[2:]])
    if block.startswith("#"):
        return f"<h3>{_inline(block.lstrip('# '))}</h3>"
    return f"<p>{_inline(' '.join(block.split()))}</p>"


def _cells(line: str) -> list[str]:
    cells = re.split(r"(?<!\\)\|", line.strip().removeprefix("|").removesuffix("|"))
    return [_inline(cell.strip().replace(r"\|", "|")) for cell in cells]


def _inline(text: str) -> str:
    pieces = re.split(r"`([^`]*)`", text)
    for k in range(0, len(pieces), 2):
        words = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", escape(pieces[k]))
        pieces[k] = re.sub(r"\*(\S.*?)\*", r"<em>\1</em>", words)
    for k in range(1, len(pieces), 2):
        pieces[k] = f"<code>{escape(pieces[k])}</code>"
    return "".join(pieces)
