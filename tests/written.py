"""The summary of a flight, what is written in a figure, and whether it can be read."""

import pytest
from matplotlib.figure import Figure

from spacecraft_sim import plots, plots_law, plots_smooth
from spacecraft_sim.chart import charts_of, vectors
from spacecraft_sim.families import is_quasi_rigid


def summary_of(flight, path):
    """Draws the summary of a flight; returns the figure."""
    charts = charts_of(flight.mission.controller)
    kept, save = [], Figure.savefig
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda f, *a, **k: (kept.append(f), save(f, *a, **k)))
        plots.summary(
            path,
            measured=flight.measured,
            predicted=flight.predicted,
            drawing=flight.drawing,
            verdicts=flight.comparison.verdicts,
            title="A flight",
            bands=flight.mission.bands,
            histories=None
            if is_quasi_rigid(flight.predicted)
            else plots_smooth.panels(flight.measured, vectors(charts, flight.measured)),
            law=plots_law.panels(charts, flight.measured),
        )
    return kept[0]


def texts(figure):
    """All that is written on a page, with the boxes that it takes."""
    found = [*figure.texts]
    for axes in figure.axes:
        found += [axes.title, axes._left_title, axes._right_title, *axes.texts]
        found += axes.get_legend().get_texts() if axes.get_legend() else []
        for axis in (a for a in (axes.xaxis, axes.yaxis) if axes.axison and a.get_visible()):
            low, high = sorted(axis.get_view_interval())
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            inside = [tick for tick in ticks if low <= tick.get_loc() <= high]
            labels = [label for tick in inside for label in (tick.label1, tick.label2)]
            found += [label for label in labels if label.get_visible()]
            found.append(axis.get_offset_text())
    return [(x.get_text(), box) for x in found if (box := x.get_window_extent()).width > 0]


def faults(figure):
    """Words that leave the page, and words that cover each other."""
    found = texts(figure)
    page = figure.bbox
    outside = [
        words
        for words, box in found
        if box.x0 < 0 or box.x1 > page.x1 or box.y0 < 0 or box.y1 > page.y1
    ]
    return outside + [
        (words, others)
        for k, (words, box) in enumerate(found)
        for others, other in found[k + 1 :]
        if box.overlaps(other)
    ]
