"""The tab "Plots" of one visitor: one chart of the last half minute, of his choice.

Nothing is drawn, and nothing sent, while none is chosen.
"""

from __future__ import annotations

import viser
from viser import uplot

from rhot.files.config import RigConfig
from services.viewer.plots.charts import COLORS, Chart, charts
from services.viewer.plots.history import SPAN_S, History
from services.viewer.visits.section import Seen

_NONE = "none"
_HEIGHT_PX = 260
_HINT = (
    '<div style="font-size:0.8em;padding:0 0.6em">Choose what to draw: how far joints bend, how '
    "late poses are, how many come a second. The last half minute is shown.</div>"
)


class PlotsSection:
    """Live charts."""

    title = "Plots"

    def __init__(self, config: RigConfig, history: History) -> None:
        self._charts, self._history = charts(config), history

    def open(self, client: viser.ClientHandle, tab: viser.GuiTabHandle) -> PlotsTab:
        """Fill one visitor's tab."""
        return PlotsTab(client, tab, self._charts, self._history)


class PlotsTab:
    """The chart of one visitor."""

    def __init__(
        self,
        client: viser.ClientHandle,
        tab: viser.GuiTabHandle,
        known: dict[str, Chart],
        history: History,
    ) -> None:
        self._gui, self._tab, self._charts, self._history = client.gui, tab, known, history
        self._choice = client.gui.add_dropdown(
            "plot", (_NONE, *known), hint="the last half minute, drawn while it is chosen"
        )
        self._hint = client.gui.add_html(_HINT)
        self._drawn = _NONE
        self._plot: viser.GuiUplotHandle | None = None

    def update(self, seen: Seen) -> None:
        """Draw the chart that is chosen."""
        choice = str(self._choice.value)
        chart = self._charts.get(choice)
        if choice != self._drawn:
            self._drawn = choice
            if self._plot is not None:
                self._plot.remove()
                self._plot = None
        self._hint.visible = chart is None
        if chart is None:
            return
        data = tuple(self._history.rows([name for name, _ in chart.series], seen.now_s))
        if self._plot is not None:
            self._plot.data = data
            return
        with self._tab:
            self._plot = self._gui.add_uplot(
                data,
                (uplot.Series(label="seconds"), *_lines(chart)),
                title=f"{chart.title}, {chart.unit}",
                scales={
                    "x": uplot.Scale(time=False, auto=False, range=(-SPAN_S, 0.0)),
                    "y": uplot.Scale(auto=True)
                    if chart.scale is None
                    else uplot.Scale(auto=False, range=chart.scale),
                },
                height=_HEIGHT_PX,
            )

    def close(self) -> None:
        """The visitor has gone, and his chart with him."""


def _lines(chart: Chart) -> list[uplot.Series]:
    return [
        uplot.Series(label=words, stroke=color, width=2)
        for (_, words), color in zip(chart.series, COLORS * len(chart.series), strict=False)
    ]
