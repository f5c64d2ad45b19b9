"""The report in a browser, from disk: no error, the scene turns, links work, it fits narrow and wide screens, and it is accessible."""

import shutil
from pathlib import Path

import pytest

from oio.report.__main__ import main as report

playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="no chromium here: apt-get install chromium")]
DRAWN = "document.getElementById('space').dataset.drawn"


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def opened(browser, made):
    """The report at a width, or another page, with whatever the console said; requests to anywhere else are refused."""
    pages = []

    def at(width, file=None):
        page = browser.new_page(viewport={"width": width, "height": 900})
        pages.append(page)
        said = []
        page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: said.append(request.url) if not request.url.startswith(("file:", "data:", "blob:")) else None)
        page.goto(Path(file or made[0] / "report.html").as_uri())
        if file is None:
            page.wait_for_function(DRAWN, timeout=60_000)
        return page, said

    yield at
    for page in pages:
        page.close()


@pytest.mark.parametrize("width", [400, 1600])
def test_it_opens_without_an_error_and_fits(opened, width):
    page, said = opened(width)
    assert said == [] and page.evaluate(DRAWN) == "yes"
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator(".lead").bounding_box()["y"] < 500


def test_the_scene_turns(opened):
    page, said = opened(1000)
    eye = "JSON.stringify(document.getElementById('space')._fullLayout.scene._scene.getCamera().eye)"
    before = page.evaluate(eye)
    page.evaluate("document.getElementById('space').scrollIntoView({block: 'center'})")
    box = page.locator("#space").bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 3)
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 120, middle[1] + 40, steps=8)
    page.mouse.up()
    page.wait_for_function(f"{eye} !== {before!r}", timeout=20_000)
    assert said == []


def test_every_link_leads_to_a_part(opened):
    page, _ = opened(1000)
    for link in page.locator("nav a").all():
        link.click()
        assert page.evaluate("document.querySelector(':target') !== null")


def test_it_is_accessible(opened):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page, _ = opened(1000)
    found = axe.Axe().run(page).response["violations"]
    assert [(v["id"], [node["html"][:120] for node in v["nodes"]][:3]) for v in found] == []


def test_the_page_of_a_sweep_opens_fits_leads_to_its_runs_and_is_accessible(opened, swept, tmp_path):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    assert report([str(swept), "--out", str(swept / "sweep.html")]) == 0
    for width in (400, 1600):
        page, said = opened(width, swept / "sweep.html")
        assert said == [] and page.evaluate("document.documentElement.scrollWidth") <= width
    assert axe.Axe().run(page).response["violations"] == []
    links = [link.get_attribute("href") for link in page.locator("a").all()]
    assert links and all((swept / link).exists() for link in links if not link.startswith("#"))
    assert all(page.locator(link).count() for link in links if link.startswith("#"))
