"""The documents of a recording: verdicts, scenario, what is drawn; Markdown as plain text.

Words, not marks: the viewer panics on a glyph that its font lacks, as the cross.
"""

from collections import Counter
from collections.abc import Sequence

from spacecraft_sim.guarantee import Verdict


def verdict_page(title: str, verdicts: Sequence[Verdict], notes: Sequence[str]) -> str:
    """Returns what became of the claims, as Markdown.

    Args:
        title: Title of the scenario.
        verdicts: The verdicts.
        notes: What is to be said of the recording itself.
    """
    outcomes = Counter(v.outcome for v in verdicts)
    words = {"FAILS": "FAIL", "not guaranteed": "not guaranteed", "not judged": "not judged"}
    others = [f", **{outcomes[x]} {word}**" for x, word in words.items() if outcomes[x]]
    heading = f"# {outcomes['holds']} of {len(verdicts)} claims hold{''.join(others)}"
    head = [heading, f"{title}", ""]
    return "\n".join([*head, *verdict_table(verdicts), *_failed(verdicts), "", *notes])


def unjudged_page(title: str, notes: Sequence[str]) -> str:
    """Returns what stands in place of the verdicts until a flight has come to its end.

    Args:
        title: Title of the scenario.
        notes: What is to be said of the recording itself.
    """
    text = "The flight has not come to its end: nothing is judged."
    return "\n".join(["# Not judged", title, "", text, "", *notes])


def verdict_table(verdicts: Sequence[Verdict]) -> list[str]:
    """Returns the lines of a Markdown table of verdicts.

    Args:
        verdicts: The verdicts.
    """
    lines = ["|  | margin | claim | measured | bound | predicted | worst at | source |"]
    lines.append("|:-:|--:|:--|--:|--:|--:|--:|:--|")
    for v in verdicts:
        word = "holds" if v.holds else f"**{v.outcome}**"
        expected = "" if v.predicted is None else f"{v.predicted:.4g}"
        bound = f"{'±' if v.kind == 'within' else '≤ '}{v.bound:.3g} {v.unit}"
        worst = "" if v.t_worst is None else f"{v.t_worst:.2f} s"
        judged = v.outcome != "not judged"
        found, margin = (f"{v.measured:.4g}", f"{100 * v.margin:.3g} %") if judged else ("", "")
        figures = f"{found} | {bound} | {expected} | {worst}"
        lines.append(f"| {word} | {margin} | {cell(v.claim)} | {figures} | {cell(v.source)} |")
    return lines


def scenario_page(toml: str) -> str:
    """Returns a scenario as Markdown.

    Args:
        toml: The scenario, as text.
    """
    return f"```toml\n{toml.strip()}\n```"


def cell(text: str) -> str:
    """Returns a text as it may stand in a cell of a Markdown table.

    Args:
        text: The text.
    """
    return text.replace("|", "\\|")


def _failed(verdicts: Sequence[Verdict]) -> list[str]:
    failed = sorted({str(assumption) for v in verdicts for assumption in v.failed})
    heading = ["", "**Assumptions that do not hold**", ""]
    return [*heading, *(f"- `{text}`" for text in failed)] if failed else []
