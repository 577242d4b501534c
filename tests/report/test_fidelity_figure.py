import numpy as np

from blesim.fidelity.comparison import Comparison, Panel, distribution
from blesim.fidelity.scorecard import Statistic, scorecard
from blesim.report.fidelity_figure import draw_comparison


def test_every_panel_shows_both_sides_with_labels():
    rng = np.random.default_rng(1)
    lags_s = np.arange(5.0)
    curve = Panel(
        title="Standing",
        x_label="lag [s]",
        y_label="autocorrelation [-]",
        kind="curve",
        real=np.array([lags_s, 0.8**lags_s]),
        simulated=np.array([lags_s, 0.7**lags_s]),
    )
    samples = distribution("All", "RSSI [dBm]", rng.normal(-70, 5, 500), rng.normal(-71, 5, 500))
    statistic = [Statistic(name="a", unit="dB", values=np.arange(9.0))]
    comparison = Comparison(
        title="hall", scores=scorecard(statistic, statistic), panels=(samples, curve)
    )
    figure = draw_comparison(comparison)
    drawn = [axes for axes in figure.axes if axes.axison]
    assert [axes.get_title(loc="left") for axes in drawn] == ["All", "Standing"]
    assert [axes.get_xlabel() for axes in drawn] == ["RSSI [dBm]", "lag [s]"]
    for axes in drawn:
        assert {"recorded", "simulated"} <= {line.get_label() for line in axes.lines}
    assert "1 of 1 statistics inside" in figure.get_suptitle()


def test_a_side_without_samples_is_left_empty():
    panel = distribution("All", "RSSI [dBm]", [-70.0, np.nan, -71.0], [])
    comparison = Comparison(title="hall", scores=(), panels=(panel,))
    assert [line.get_label() for line in draw_comparison(comparison).axes[0].lines] == ["recorded"]
