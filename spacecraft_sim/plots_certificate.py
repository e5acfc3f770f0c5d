"""The picture of a certificate: bounds, exact worst case and measured peaks over the dwell."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from spacecraft_sim.certificate import AxisCertificate
from spacecraft_sim.certificate_curves import Curves
from spacecraft_sim.certificate_words import promise
from spacecraft_sim.plots import BAD, GOOD, INK, SOFT
from spacecraft_sim.plots_panel import DPI, panel

_WIDTH = 225  # letters of the result a line
PRINTED, ANY, EXACT = GOOD, "#c98a00", "#1f6fd6"


def write(
    path: Path,
    title: str,
    result: str,
    certificates: Sequence[AxisCertificate],
    measured: Sequence[Curves],
) -> None:
    """Draws a panel an axis, moments over dwells, both logarithmic.

    Args:
        path: The PNG file.
        title: One line over the page.
        result: The sentence below it.
        certificates: What is guaranteed about each axis.
        measured: The curves of each axis.
    """
    figure = Figure(figsize=(18.0, 7.0), dpi=DPI)
    FigureCanvasAgg(figure)
    figure.text(0.012, 0.965, title, size=15, weight="bold", color=INK, va="center")
    said = "\n".join(textwrap.wrap(result, _WIDTH))
    figure.text(0.012, 0.937, said, size=10.5, color=INK, va="top")
    grid = figure.add_gridspec(1, 3, left=0.05, right=0.985, top=0.79, bottom=0.17, wspace=0.2)
    key = {}
    for k, (certificate, curve) in enumerate(zip(certificates, measured, strict=True)):
        axes = figure.add_subplot(grid[0, k])
        words = promise(certificates, certificate)
        panel(axes, words, "least time between switchings, s", "moment of elastic parts, N m")
        if len(curve.worst):
            _axis(axes, certificate, curve)
            handles, labels = axes.get_legend_handles_labels()
            key |= dict(zip(labels, handles, strict=True))
        else:
            axes.set(xticks=[], yticks=[])
            axes.text(0.5, 0.5, "no elastic part is felt in small motion", color=SOFT, ha="center")
    figure.legend(
        key.values(), key.keys(), loc="lower center", ncols=len(key), fontsize=9.5, frameon=False
    )
    figure.savefig(path, pil_kwargs={"compress_level": 3})


def _axis(axes: Axes, certificate: AxisCertificate, curve: Curves) -> None:
    dwell = curve.bound[:, 0]
    finite = np.isfinite(curve.bound[:, 1])
    axes.loglog(*curve.bound[finite].T, color=PRINTED, linewidth=2.2, label="printed bound (27)")
    axes.plot(dwell, np.full(len(dwell), curve.l1), color=ANY, linewidth=1.8, linestyle="--",
              label="bound for any switching (L1)")  # fmt: skip
    axes.plot(*curve.worst.T, color=EXACT, linewidth=1.4, label="exact worst case")
    for small, fill, words in ((True, BAD, ""), (False, "white", ", beyond small, slow motion")):
        flown = [(x, y) for x, y, kept in curve.measured.tolist() if bool(kept) == small]
        if flown:
            axes.plot(*zip(*flown, strict=True), "o", color=BAD, markerfacecolor=fill,
                      markersize=6.5, label=f"worst case flown in MuJoCo{words}")  # fmt: skip
    room = certificate.torque * (1 - abs(certificate.bias))
    low, high = axes.get_ylim()
    top = max(high, 2.5 * room)
    axes.axhspan(room, top, color=BAD, alpha=0.06, linewidth=0,
                 label="says nothing of the attitude: above M0 - |M1|")  # fmt: skip
    axes.axvline(curve.dwell, color=SOFT, linewidth=1.2, linestyle=":", label="dwell")
    axes.set(ylim=(min(low, room / 2), top))
