"""Captions of the figures: what is drawn, what the colours mean, and what a good one looks like."""

CAPTIONS = {
    "scene": (
        "The search in 3-D, from one side: the arm at the end, the nose by the calibrated filter with its 95 % regions, the ranges that "
        "calibration took from its readings, and the places left for the source."
    ),
    "search": (
        "The search from above: where the nose was, where the filters and the encoders had it, and the source by each filter. "
        "Where the region of the source is small, an inset magnifies it; ellipses hold 95 % of a belief."
    ),
    "source_error": (
        "Distance of the believed source from the true one, which a bench does not know. Dotted, in the same colour: what 95 % of "
        "the errors should be below by that filter's own belief (shaded: calibrated). A line above its dots is a filter that is too "
        "sure of itself."
    ),
    "error_over_bound": (
        "The same errors over the Cramer-Rao bound: what no unbiased estimator with this calibration can beat on average from the "
        "readings up to then. About 1 is as good as can be; a lucky search has less, and a prior helps where readings are few."
    ),
    "readings": "Readings of each element in ppm, and the stages of the run. Triangles are bouts of the calibration.",
    "allan": "Allan deviation of the readings in clean air, with 95 % intervals; dashed: the fitted white noise N.",
    "step": (
        "Response of the sensor to a step of gas by the calibrated lag, from readings and data sheet together (the criterion "
        "steps tells what the readings say alone); bands are two standard uncertainties, points mark 90 % of the step."
    ),
    "nis": (
        "Squared innovations over their variance: 1 on average if Q and R are right. Above it the filter is too sure of itself, "
        "below too unsure."
    ),
    "residuals": (
        "Innovations in their own standard deviations (sigma); 99.7 % lie within three, and the histogram has the normal shape, "
        "if the filter is right."
    ),
    "nose": (
        "Error of the nose before and after calibration. Top: its length, on a logarithmic scale; dotted: what 95 % should be "
        "below. Below: along each axis with 95 % bands, of the encoders alone, the open cold start and the calibrated filter. The"
        " encoders state no bound."
    ),
    "nose_without_truth": (
        "The nose before and after calibration. There is no truth in this log: shown is how far each is from the calibrated "
        "filter. Top: the distance, on a logarithmic scale. Below: along each axis with 95 % bands. The encoders state no bound."
    ),
}
