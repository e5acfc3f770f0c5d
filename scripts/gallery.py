"""Flies the shipped scenarios and makes a gallery of them.

    python scripts/gallery.py
    python scripts/gallery.py efremov-local efremov-observed --duration 60

Each gets the folder of a run, with summary, report and recording; `index.html` shows them all, and
`<scenario>.png` beside it is the summary in few colours.
"""

import argparse
import sys
from pathlib import Path

from spacecraft_sim import library, mission, run_folder
from support import gallery_flight, gallery_page


def main(argv: list[str] | None = None) -> int:
    """Makes the gallery; returns 0, or 3 if a flight diverged and is left out.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenarios; all if left out")
    parser.add_argument("--duration", type=float, help="of each flight at most, s")
    parser.add_argument("--out", type=Path, help="a new folder; runs/gallery if left out")
    arguments = parser.parse_args(argv)
    names, cards = arguments.names or library.scenario_names(), []
    try:
        for name in names:
            mission.load_scenario(name)
        out = run_folder.create(arguments.out, "gallery")
    except ValueError as error:
        parser.error(str(error))
    for name in names:
        try:
            card = gallery_flight.fly(name, arguments.duration, out)
        except ArithmeticError as error:
            print(f"{name}: {error}", file=sys.stderr)
            continue
        cards.append(card)
        print(f"{name}: {card.kept} of {card.claims} claims hold", flush=True)
    text = gallery_page.page(cards, "Gallery of flights")
    (out / "index.html").write_text(text, encoding="utf-8")
    print(f"written: {out / 'index.html'}")
    return 0 if len(cards) == len(names) else 3


if __name__ == "__main__":
    sys.exit(main())
