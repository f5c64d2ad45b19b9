"""Names of columns: the unit in them, and what they hold, in the words that loggers use (English, German, French)."""

import re

BRACKET = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]")
UNITS = {
    "s": "s", "sec": "s", "secs": "s", "seconds": "s", "sek": "s", "ms": "ms", "msec": "ms", "millis": "ms", "milliseconds": "ms",
    "us": "us", "µs": "us", "μs": "us", "micros": "us", "microseconds": "us", "ns": "ns",
    "nanoseconds": "ns", "min": "min", "minutes": "min", "h": "h", "hours": "h",
    "ppm": "ppm", "ppb": "ppb", "%vol": "%vol", "vol%": "%vol", "ug/m3": "ug/m3", "µg/m3": "ug/m3", "µg/m³": "ug/m3", "mg/m3": "mg/m3",
    "mg/m³": "mg/m3", "μg/m³": "ug/m3", "μg/m3": "ug/m3", "vol.-%": "%vol", "vol.%": "%vol", "vol-%": "%vol", "ω": "ohm", "kω": "kohm",
    "adc": "counts", "counts": "counts", "raw": "counts", "ticks": "counts", "v": "V", "volt": "V", "mv": "mV", "ohm": "ohm",
    "kohm": "kohm", "c": "degC", "°c": "degC", "degc": "degC", "celsius": "degC", "f": "degF", "°f": "degF", "k": "K",
    "%": "%", "pct": "%", "%rh": "%",
    "percent": "%", "deg": "deg", "°": "deg", "degrees": "deg", "rad": "rad", "m": "m", "mm": "mm", "cm": "cm",
}  # fmt: skip
INSIDE = ("ppm", "ppb", "adc", "counts", "ms", "degc", "pct")  # units that are told anywhere in a name: co2_ppm_b
ALONE = ("millis", "micros", "ms", "us", "msec", "milliseconds", "microseconds", "seconds", "secs", "ppm", "ppb")  # units that are names
PLAIN = ("data", "value")  # fields of messages that hold one number
KEPT = ("adc", "raw")  # words that also tell what it is
GAS_UNITS = ("ppm", "ppb", "%vol", "ug/m3", "mg/m3", "counts", "V", "mV", "ohm", "kohm")
WORDS = {
    "time": r"t|time|times?tamp|date|date[ _/]?time|created_at|updated_at|last_changed|last_updated|epoch_?utc|utc|"
    r"millis|micros|ms|us|msec|milliseconds|microseconds|seconds|secs|ts|"
    r"localtime|local time|epoch|unix( ?time)?|uptime|elapsed|"
    r"zeit|uhrzeit|zeitstempel|datum|heure|temps|device|board|mcu|arduino|"
    r"(device|host|pc|board|mcu|utc|sensor|arduino|log)[ _]?(time|clock|millis|ts|stamp)",
    "temperature": r"temp|temperature|temperatur|température|t[ _]?amb|t[ _]air|temp[ _]?\w{1,4}",
    "humidity": r"hum|humidity|rh|rel\.?[ _]*hum(idity)?\.?|relative[ _]humidity|feuchte|luftfeuchte|humidité|r\.?h\.?",
    "gas": r"(e?co2|co2eq|co|no2?|nh3|h2s?|ch4|o3|so2|c2h5oh|etoh|ethanol|alcohol|acetone|methane|propane|butane|lpg|benzene|"
    r"t?voc|mq[- ]?\d+|mics\d*|mox\w*|gas|nose|sensor|element|adc|"
    r"concentration|conc|kohlendioxid|rs)([ _]?(\d+|[ab]|raw|adc|left|right|at \w+))?",
    "joint": r"(joint|j|q|servo|theta|axis)[ _]?\d+|(shoulder_pan|shoulder_lift|elbow_flex|wrist_flex|wrist_roll)([ ._]pos)?",
    "nose": r"((nose|tip|pos|p|ee|tool)[ _])?[xyz]",
}
PATTERNS = {role: re.compile(words, re.IGNORECASE) for role, words in WORDS.items()}


def squeezed(word: str) -> str:
    """A unit's word without blanks and capitals, as UNITS has it."""
    return word.lower().replace(" ", "")


def unit_of(name: str) -> str | None:
    """Return the unit that a column's name says, in brackets or as its last word; None if it says none."""
    bracket = BRACKET.search(name)
    if bracket:
        return UNITS.get(squeezed(bracket[1]))
    words = re.split(r"[ _./]", name.strip().lower())
    if len(words) == 1:
        return UNITS.get(words[0]) if words[0] in ALONE else None
    return UNITS.get(words[-1]) or next((UNITS[word] for word in words if word in INSIDE), None)


def bare(name: str) -> str:
    """Return a column's name without its unit and its number among equals; of a path (/air/co2.data) the part that says most."""
    if name.startswith("/"):
        topic, _, field = name.rpartition(".")
        name = topic.rpartition("/")[2] if field in PLAIN else field
    without = BRACKET.sub("", re.sub(r" #\d+$", "", name)).strip(" _")
    words = re.split(r"[ _]", without)
    kept = [word for i, word in enumerate(words) if word.lower() not in (UNITS if i == len(words) - 1 else INSIDE) or word.lower() in KEPT]
    return "_".join(kept) if len(words) > 1 and kept else without


def role_of(name: str) -> str | None:
    """Return what a column holds by its name: time, temperature, humidity, gas, joint or nose; None if it does not say."""
    word = bare(name)
    for role, pattern in PATTERNS.items():
        if role == "time" and (word == "T" or name.startswith("/")):  # T alone is a temperature; a log's messages have one clock
            continue
        if pattern.fullmatch(word):
            return role
    if word == "T":
        return "temperature"
    return "gas" if unit_of(name) in GAS_UNITS[:5] else None
