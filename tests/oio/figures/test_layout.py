"""Nothing that is drawn hides what is to be read: names of stages apart, legends above the data, the source magnified where it is small."""

import itertools
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from oio.core.records import SECOND_NS, Array, GasReading, Innovation
from oio.figures.consistency import nis_strip, residual_histogram, residual_strip
from oio.figures.error_timelines import nose_error, source_error
from oio.figures.gas_timeline import gas
from oio.figures.nose_tracks import nose_tracks
from oio.figures.run_history import RunHistory
from oio.figures.search_map import search_map
from oio.figures.style import RC, VARIANTS
from oio.figures.track import Estimates, Span, TrackOverTime

STAGES = ("warm_up", "baseline", "calibrate_bouts", "map_beliefs", "assemble_qr", "navigate")
INNOVATIONS = [Innovation(i * SECOND_NS, np.array([np.sin(i) * (5.0 if i == 9 else 1.0)]), np.eye(1), False) for i in range(60)]


def track(p_m: Array, sd_m: float) -> TrackOverTime:
    return TrackOverTime(np.arange(float(len(p_m))), p_m, np.tile(sd_m**2 * np.eye(3), (len(p_m), 1, 1)))


def story(ends_s: tuple[float, ...] = (10.0, 11.0, 12.0, 13.0, 13.0, 60.0), sd_m: float = 0.005, truth: bool = True) -> RunHistory:
    """A nose that goes about an arm a metre wide, and a source at (0.3, 0.1, 0.2) m, 5 mm off."""
    turn = np.linspace(-1.0, 1.0, 60)
    true = np.stack([0.4 * np.cos(turn), 0.4 * np.sin(turn), 0.2 + 0 * turn], axis=1)
    source = np.array([0.3, 0.1, 0.2])
    spans = tuple(itertools.starmap(Span, zip(STAGES, (0.0, *ends_s[:-1]), ends_s, strict=True)))
    readings = tuple(GasReading(i * SECOND_NS, i % 2, 5.0 + np.sin(i), 0.1) for i in range(60))
    nothing = track(np.zeros((0, 3)), 0.0)
    others = {name: Estimates(track(true + 0.03, 0.01), track(np.tile(source + 0.01, (60, 1)), 2 * sd_m)) for name in VARIANTS}
    return RunHistory(
        {"dof": "5"}, spans, Span("navigate", 0.0, 60.0), readings, track(true, 0.0) if truth else nothing, track(true + 0.005, 0.004),
        track(true - 0.05, 0.0), track(np.tile(source + 0.003, (60, 1)), sd_m), np.zeros(3), np.zeros((0, 3)),
        {"source": source, "beacon": np.array([0.3, -0.1, 0.2])} if truth else {}, (), others,
    )  # fmt: skip


def drawn(draw, size=(5.6, 3.4), layout="constrained", dpi=150):
    with mpl.rc_context(RC):
        figure = Figure(figsize=size, dpi=dpi, layout=layout)
        FigureCanvasAgg(figure)
        draw(figure)
        figure.canvas.draw()
    return figure


@pytest.mark.parametrize("dpi", [72, 150])
@pytest.mark.parametrize("ends_s", [(10.0, 11.0, 12.0, 13.0, 13.0, 60.0), (20.0, 40.0, 57.0, 58.0, 59.0, 60.0)])
def test_names_of_stages_do_not_overlap_and_lie_within(ends_s, dpi):
    axes = drawn(lambda f: gas(f.subplots(), story(ends_s)), dpi=dpi).axes[0]
    boxes = [text.get_window_extent() for text in axes.texts]
    panel = axes.get_window_extent()
    assert len(boxes) == sum(b > a for a, b in itertools.pairwise((0.0, *ends_s)))
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    assert all(box.x0 >= panel.x0 and box.x1 <= panel.x1 + 1.0 for box in boxes)


@pytest.mark.parametrize(
    "draw",
    [
        lambda axes: gas(axes, story()),
        lambda axes: source_error(axes, story()),
        lambda axes: nose_error(axes, story(), {"cold": {"nose_error_m": 0.05}, "calibrated": {"nose_error_m": 0.01}}),
        lambda axes: nose_error(axes, story(truth=False), {}),
        lambda axes: search_map(axes, story()),
        lambda axes: nis_strip(axes, INNOVATIONS),
        lambda axes: residual_strip(axes, INNOVATIONS),
        lambda axes: residual_histogram(axes, INNOVATIONS),
    ],
)
def test_a_legend_is_above_the_data_below_the_title_and_whole(draw):
    figure = drawn(lambda f: draw(f.subplots()))
    axes = figure.axes[0]
    legend, panel, title = axes.get_legend().get_window_extent(), axes.get_window_extent(), axes._left_title.get_window_extent()
    assert legend.y0 >= panel.y1 - 1.0 and legend.y1 <= title.y0 + 2.0
    assert legend.x1 <= figure.bbox.x1 and title.x1 <= figure.bbox.x1


def test_every_filter_and_the_encoders_have_their_errors_and_bounds():
    axes = drawn(lambda f: nose_error(f.subplots(), story(), {})).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    assert {"encoders alone", "cold start", "cold start, open", "calibrated"} <= set(lines)
    np.testing.assert_allclose(lines["cold start"].get_ydata(), 30.0 * np.sqrt(3.0))
    dotted = [line for line in axes.lines if line.get_linestyle() == ":" and len(line.get_xdata())]
    assert len(dotted) == 3  # of the filters; the encoders state none
    np.testing.assert_allclose(dotted[0].get_ydata(), 10.0 * np.sqrt(7.815), rtol=0.01)


def test_without_a_truth_the_distance_from_the_calibrated_filter_is_drawn():
    figure = drawn(lambda f: nose_tracks(f, story(truth=False), {}), (5.6, 6.4))
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert "calibrated" not in lines
    np.testing.assert_allclose(lines["cold start"].get_ydata(), 25.0 * np.sqrt(3.0))
    assert len(figure.axes) == 4 and figure.axes[0].get_title(loc="left").startswith("Nose, distance from")


def test_a_cold_start_far_off_is_left_out_of_the_magnified_region_which_is_shown():
    """In the default run it was 102 mm off, and took the whole inset with it."""
    told = story(sd_m=0.008)
    far = {name: replace(one, source=track(one.source.p_m + 0.1, 0.01)) for name, one in told.others.items()}
    axes = drawn(lambda f: search_map(f.subplots(), replace(told, others=far)), (5.6, 5.6)).axes[0]
    assert len(axes.child_axes) == 1


@pytest.mark.parametrize(("sd_m", "magnified"), [(0.005, 1), (0.1, 0)])
def test_the_region_of_the_source_is_magnified_where_it_is_small(sd_m, magnified):
    axes = drawn(lambda f: search_map(f.subplots(), story(sd_m=sd_m)), (5.6, 5.6)).axes[0]
    assert len(axes.child_axes) == magnified
    for inset in axes.child_axes:
        (left, right), (bottom, top) = inset.get_xlim(), inset.get_ylim()
        assert left < 300.0 < right and bottom < 100.0 < top  # the true source, in mm
        assert right - left < 150.0 and right - left == pytest.approx(top - bottom)
        marks = [line.get_xydata()[0] for line in inset.lines if len(line.get_xdata()) == 1]
        assert len(marks) == 4  # true, calibrated, both cold starts


@pytest.mark.parametrize("layout", ["constrained", None])
def test_scales_are_equal_and_the_magnified_region_covers_nothing(layout):
    axes = drawn(lambda f: search_map(f.subplots(), story()), (5.6, 5.6), layout).axes[0]
    one_mm = axes.transData.transform([(1.0, 1.0)]) - axes.transData.transform([(0.0, 0.0)])
    assert one_mm[0, 0] == pytest.approx(one_mm[0, 1], rel=0.02)
    box = axes.child_axes[0].get_window_extent()
    for line in axes.lines:
        points = axes.transData.transform(line.get_xydata())
        assert not np.any(np.all((points > [box.x0, box.y0]) & (points < [box.x1, box.y1]), axis=1))
