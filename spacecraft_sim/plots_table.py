"""The table of verdicts on a flight's page."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.plots_film import INK, SHADE, SOFT

GOOD, BAD = "#1f8f4d", "#c62828"
ROW = 0.3  # height of a row, inches
_COLUMNS = {"claim": 0.035, "predicted": 0.575, "measured": 0.675, "bound": 0.775}
_COLUMNS |= {"unit": 0.79, "margin": 0.93, "worst at": 0.995}
_SIZES = (9.5, 8.5, 7.5)  # of the letters of a claim, points: the largest that fits


def table(axes: Axes, verdicts: Sequence[Verdict]) -> None:
    """Draws a row a claim.

    Args:
        axes: Where.
        verdicts: What became of the claims.
    """
    axes.set_axis_off()
    box = axes.get_window_extent()
    axes.set(xlim=(0, 1), ylim=(box.height / axes.figure.dpi / ROW, 0))
    axes.plot([0, 1], [0.95, 0.95], color=INK, linewidth=1)
    for head, x in _COLUMNS.items():
        side = "left" if head in ("claim", "unit") else "right"
        axes.text(x, 0.5, head, ha=side, va="center", size=9, color=SOFT, weight="bold")
        for k, v in enumerate(verdicts, start=1):
            color = INK if head != "margin" else GOOD if v.holds else BAD
            style: dict[str, Any] = {"ha": side, "va": "center", "color": color}
            drawn = axes.text(x, k + 0.5, _cell(v, head), size=_SIZES[0], **style)
            if head == "claim":
                fit(drawn, 0.46 * box.width)
    for k, v in enumerate(verdicts, start=1):
        color, mark = (GOOD, "✔") if v.holds else (BAD, "✘")
        axes.add_patch(Rectangle((0, k + 0.1), 0.006, 0.8, color=color, linewidth=0))
        axes.text(0.02, k + 0.5, mark, color=color, ha="center", va="center", size=11)
        if k % 2 == 0:
            axes.add_patch(Rectangle((0, k), 1, 1, color=SHADE, linewidth=0, zorder=0))


def _cell(v: Verdict, head: str) -> str:
    if head == "claim":
        return v.claim if v.outcome in ("holds", "FAILS") else f"{v.outcome}: {v.claim}"
    if head in ("measured", "margin") and v.outcome == "not judged":
        return ""
    if head == "predicted":
        return "" if v.predicted is None else f"{v.predicted:.4g}"
    if head == "worst at":
        return "" if v.t_worst is None else f"{v.t_worst:.1f} s"
    bound = f"{'±' if v.kind == 'within' else '≤ '}{v.bound:.3g}"
    margin = f"{100 * v.margin:.1f} %" if v.margin > -10 else f"{100 * v.margin:.2g} %"
    return {"measured": f"{v.measured:.4g}", "bound": bound, "unit": v.unit, "margin": margin}[head]


def fit(drawn: Text, width: float, sizes: Sequence[float] = _SIZES) -> None:
    """Makes a text small enough, and short if that is not enough.

    Args:
        drawn: The text.
        width: How wide it may be, pixels.
        sizes: Of its letters, points: the first that fits, or the last.
    """
    have = drawn.get_window_extent().width
    for size in sizes:
        drawn.set_fontsize(size)
        have = drawn.get_window_extent().width
        if have <= width:
            return
    words = drawn.get_text()
    drawn.set_text(f"{words[: int(len(words) * width / have) - 1]}…")
