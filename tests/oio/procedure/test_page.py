"""The page of a protocol: steps and stages in the order of a run, blanks for answers, places in mm; one file, well formed."""

from html.parser import HTMLParser

import pytest

from oio.cli.protocol_page import described, main
from oio.procedure.html_page import html
from oio.procedure.markdown import markdown
from oio.procedure.page import Item, Page

QUICK = ("protocol=emulated", "sensor=ndir", "stage=[warm_up,baseline]")
VOID = {"meta", "br"}


class Document(HTMLParser):
    """The tags that are open, all texts, and everything that another file would be asked for."""

    def __init__(self, text):
        super().__init__()
        self.open, self.texts, self.asked = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.asked += [value for key, value in attributes if key in ("src", "href")]
        self.open += [] if tag in VOID else [tag]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def test_steps_and_stages_stand_in_the_order_of_a_run():
    made = described(QUICK)
    titles = [item.title for item in made.items]
    assert titles == [
        "operator", "sensor_serial", "gas_closed", "air_clears", "stage warm_up", "stage baseline", "room_degc", "undisturbed",
    ]  # fmt: skip
    blanks = {item.title: item.blank for item in made.items}
    assert (
        blanks["room_degc"].endswith("(a number from 0 to 50 degC)")
        and blanks["gas_closed"] == "done [ ]"
        and blanks["stage baseline"] == ""
    )
    keys = dict(next(item.keys for item in made.items if item.title == "stage warm_up"))
    assert keys["stage.warm_up.window_s"] == "10" and keys["stage.warm_up.max_s"] == "120"
    assert "stage.warm_up.sensor" not in keys  # the sensor is no key of it


def test_places_are_in_mm_and_follow_the_words_of_the_run():
    made = described(["protocol=bench", "beacon.position=[0.3,0.05,0.2]", "source.position=[0.25,-0.1,0.15]"])
    assert dict(made.places) == {"beacon": "x 300 mm, y 50 mm, z 200 mm", "source": "x 250 mm, y -100 mm, z 150 mm"}
    assert any(item.text.endswith("x 300 mm, y 50 mm, z 200 mm") for item in made.items)
    assert dict(described(["protocol=bench"]).places)["source"] == "not told to the run"


def test_a_page_of_a_bench_needs_no_ports():
    assert ("backend", "serial") in described(["protocol=bench", "backend=serial"]).choices


@pytest.mark.parametrize("name", ["bench", "emulated"])
def test_the_html_is_one_well_formed_file_with_all_that_the_markdown_has(name):
    made = described([f"protocol={name}"])
    document = Document(html(made))
    assert document.open == [] and document.asked == []
    text, marks = " ".join(document.texts), markdown(made)
    for item in made.items:
        assert item.title in text and item.text in text and f"**{item.title}**" in marks and item.text in marks
    for number in range(1, len(made.items) + 1):
        assert f"\n{number}. **" in marks


def test_what_stands_in_a_protocol_is_text_and_nothing_else():
    wild = "<script>alert(1)</script> & | \"'"
    made = Page(wild, ((wild, wild),), (), (Item(wild, wild, wild),), ())
    assert "<script>" not in html(made) and Document(html(made)).open == []
    assert "<script>" not in markdown(made) and "& \\| " in markdown(made)


def test_the_command_prints_and_writes(tmp_path, capsys):
    assert main(["emulated", *QUICK[1:]]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("# First readings of a nose\n") and "/gas/ndir/sample" in printed
    for option, name in (("--markdown", "page.md"), ("--html", "page.html")):
        assert main(["emulated", *QUICK[1:], option, str(tmp_path / name)]) == 0
        assert capsys.readouterr().out == f"{tmp_path / name}\n"
    assert (tmp_path / "page.md").read_text() == printed
    assert (tmp_path / "page.html").read_text().startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["nonesuch"], "protocol=nonesuch was given, but protocol can be bench, emulated"),
        (["null"], "null was given where a choice is a word"),
        (["bench", "stage=[warm_up]"], "protocol=bench has the step room_degc after the stage baseline"),
        (["bench", "sensor=x"], "sensor=x was given, but sensor can be"),
        (["bench", "--html", "/nowhere/page.html"], "/nowhere/page.html cannot be written"),
    ],
)
def test_mistakes_are_refused_in_one_paragraph(words, says, capsys):
    assert main(words) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1
