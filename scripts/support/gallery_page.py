"""The index of a gallery: a card for each run, with links that stay right where it is moved."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from PIL import Image

from spacecraft_sim import report

COLORS = 96  # of a picture in the index: curves on white need few


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """One run.

    Attributes:
        name: Name of the scenario, of its folder and of its picture.
        title: One line about it.
        description: What it shows.
        facts: Spacecraft, law and the like.
        kept: How many claims hold.
        claims: How many there are.
    """

    name: str
    title: str
    description: str
    facts: tuple[str, ...]
    kept: int
    claims: int


def shrink(source: Path, target: Path) -> None:
    """Writes a picture with few colours, a third of its size.

    Args:
        source: The picture.
        target: The file to write.
    """
    with Image.open(source) as picture:
        few = picture.convert("RGB").quantize(COLORS, dither=Image.Dither.NONE)
        few.save(target, optimize=True)


def page(cards: Sequence[Card], title: str) -> str:
    """Returns the index.

    Args:
        cards: The runs.
        title: Its heading.
    """
    kept = sum(card.kept == card.claims for card in cards)
    body = "".join(map(_card, cards))
    script = (
        "<script>document.documentElement.dataset.theme = "
        "matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';</script>\n"
    )
    return (
        f"{report.head(title)}<body>\n{script}"
        f'<header class="{"holds" if kept == len(cards) else "fails"}"><div>'
        f'<div class="words"><h1>{escape(title)}</h1><p class="soft">Every flight on MuJoCo and on '
        "the reduced model; a report opens in any browser, a recording with "
        f"<code>rerun</code>.</p></div>"
        f'<div class="verdict">{kept} of {len(cards)} runs keep all claims</div></div></header>\n'
        f'<main class="cards">\n{body}</main></body></html>\n'
    )


def _card(card: Card) -> str:
    kind = "holds" if card.kept == card.claims else "fails"
    links = {"report": "report.html", "recording": "recording.rrd", "scenario": "scenario.toml"}
    words = " · ".join(f'<a href="{card.name}/{file}">{name}</a>' for name, file in links.items())
    facts = "".join(f"<span>{escape(fact)}</span>" for fact in card.facts)
    return (
        f'<section class="{kind}"><a href="{card.name}/report.html"><img src="{card.name}.png" '
        f'alt="{escape(card.title)}" loading="lazy"></a><h2>{escape(card.title)}</h2>'
        f'<p>{escape(card.description)}</p><div class="facts">{facts}</div>'
        f'<p><span class="verdict">{report.tally(card.kept, card.claims)}</span> {words}</p>'
        "</section>\n"
    )
