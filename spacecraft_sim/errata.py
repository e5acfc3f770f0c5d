"""Misprints of the papers, read from a Markdown file with a section a paper."""

import re
from dataclasses import dataclass

_HEADING = re.compile(r"^# ", re.MULTILINE)
_NAMES = re.compile(r"[^\W\d_][\w’'-]*")
_NO_NAMES = {"Misprints", "Errata", "Errors", "in", "of", "and", "the", "et", "al"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What is known of one paper.

    Attributes:
        heading: Its heading, which names authors and year.
        text: The rest of the section, Markdown.
    """

    heading: str
    text: str

    @property
    def authors(self) -> tuple[str, ...]:
        """Surnames in the heading, in its order."""
        names = [n for n in _NAMES.findall(self.heading) if n not in _NO_NAMES]
        return tuple(name for name in names if name[0].isupper())

    def concerns(self, citation: str) -> bool:
        """Returns whether a text cites the paper: its year and its authors, or the first et al.

        Args:
            citation: The text.
        """
        words, (year, *_) = set(_NAMES.findall(citation)), [*self._years(), ""]
        named = self.authors and set(self.authors) <= words
        first = self.authors and re.search(rf"\b{re.escape(self.authors[0])} et al", citation)
        return bool(named or first) and year in citation

    def _years(self) -> list[str]:
        return re.findall(r"\b(?:19|20)\d\d\b", self.heading)


def sections(text: str) -> list[Section]:
    """Returns the sections of a file.

    Args:
        text: The file: Markdown, a heading of the first order for each paper.
    """
    parts = [part.partition("\n") for part in _HEADING.split(text)[1:]]
    return [Section(heading=heading.strip(), text=body.strip()) for heading, _, body in parts]
