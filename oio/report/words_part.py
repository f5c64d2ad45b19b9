"""The words of the page, for a reader who has not met them."""

from oio.report.page import Part, escaped

WORDS = {
    "beacon": "the source of gas at a known place, with which the sensor is calibrated",
    "bout": "a rise of the signal that the bout rule takes for gas: the nose comes nearer",
    "DoF": "degrees of freedom: how many joints of the arm move",
    "element": "one of the gas sensors of a pair that are read in turn",
    "cold start": "the same filter without calibration: it takes the numbers of the data sheet and usual air for exact; "
    "open: it starts as unsure of them as the calibration did",
    "encoders alone": "where the nose would be if the joint angles were exact; they drift",
    "range law": "how the mean concentration falls with distance from a source, and how wind bends it",
    "thinning": "faster fall with distance of a plume that is young, or is lost to the room",
    "gamma, eddy": "relative strength of the gas's fluctuation, and how long it lasts",
    "sway": "how much the plume as a whole leans to one side or another, for seconds, over its mean",
    "innovation": "a reading minus what the filter expected; NIS is its square over its variance, 1 on average if the filter is right",
    "NEES": "squared error over its variance: about 3 for a place if the covariance is right, above 7.8 in one run of twenty",
    "Q and R": "how much the filter lets its state wander, and how much noise it expects of a reading",
    "residuals": "what the last map leaves unexplained of the readings, in units of the expected noise",
    "u, and \N{PLUS-MINUS SIGN}": "standard uncertainty: one standard deviation; of a place, of all three axes together",
    "Cramer-Rao bound": "the error that no method can beat on average with these readings",
}


def words_part() -> Part:
    """Return the list of words."""
    items = "".join(f"<dt>{escaped(word)}</dt><dd>{escaped(meaning)}</dd>" for word, meaning in WORDS.items())
    return Part("words", "Words", f"<dl>{items}</dl>")
