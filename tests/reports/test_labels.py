"""The names in the player in a real browser: none is printed over another, at any time of a game."""

from __future__ import annotations

import pytest

from tests.support.pages import campaign
from tests.support.recorded import PREVENTED, STEP_S, STEPS
from tests.support.repository import REPOSITORY

JUDGED = f"naive_vs_speedy,1,{PREVENTED}"  # a collision that a reference driver prevents
NOTED = """(() => {
  const write = CanvasRenderingContext2D.prototype.fillText;
  window.written = new Map();
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const size = this.measureText(text), scale = this.getTransform().a / (window.devicePixelRatio || 1);
    const [left, right] = [x - size.actualBoundingBoxLeft, x + size.actualBoundingBoxRight];
    const [top, bottom] = [y - size.actualBoundingBoxAscent, y + size.actualBoundingBoxDescent];
    if (this.canvas.classList.contains('view')) {
      window.written.set([text, left, top].join(), [text, ...[left, top, right, bottom].map(each => each * scale)]);
    }
    return write.apply(this, arguments);
  };
})()"""
"""Notes the box of each text that is drawn on a road."""
AT = """time => {
  window.written.clear();
  const slider = document.querySelector('[data-is=time]');
  slider.value = time;
  slider.dispatchEvent(new Event('input', {bubbles: true}));
  return [...window.written.values()];
}"""
TOGETHER = """() => {
  const camera = { width: 340, height: 208, scale: 7, place: (x, y) => [170 + 7 * x, 104 - 7 * y] }, drawn = [];
  Object.assign(globalThis, { FONT: '11px sans-serif', palette: {} });
  const context = document.createElement('canvas').getContext('2d');
  context.fillText = (text, x, y) => drawn.push([text, x, y, context.measureText(text).width / 2]);
  const car = carBox(camera, { size: [4.6, 1.8] }, { x: 22, y: 13, heading: 0.3 });
  const names = ['ego', 'speedy', 'careful and competent driver', 'distracted', 'speedy', 'ego (naive)'];
  drawNames(context, camera, names.map(text => ({ text, colour: 'black', up: true, car })));
  return drawn.map(([text, x, y, half]) => [text, x - half, y - 8, x + half, y + 8]);
}"""
SETTINGS = [
    {"width": 1280, "height": 800},
    {"width": 1280, "height": 800, "color_scheme": "dark"},
    {"width": 390, "height": 800, "device_scale_factor": 2},
    {"width": 390, "height": 800, "color_scheme": "dark"},
]


@pytest.fixture(scope="module")
def report(write_report):
    return write_report(campaign(personas=["speedy"]))


@pytest.fixture
def player(opened):
    def open_player(fragment, **settings):
        page = opened(fragment="", **settings)
        page.add_init_script(NOTED)
        page.reload()
        page.evaluate("fragment => { location.hash = fragment; }", fragment)
        page.wait_for_selector(".player[data-ready]")
        game = fragment.removeprefix("#game=").partition("&")[0]
        page.wait_for_selector(f'.player[data-game="{game}"]')
        return page

    return open_player


def overprinted(texts):
    """The pairs of texts [text, left, top, right, bottom] that come closer to one another than two pixels."""
    return [
        (one[0], other[0])
        for place, one in enumerate(texts)
        for other in texts[place + 1 :]
        if one[1] < other[3] + 2 and other[1] < one[3] + 2 and one[2] < other[4] + 2 and other[2] < one[4] + 2
    ]


def cut_off(page, texts):
    box = page.locator(".view").first.bounding_box()
    return [text[0] for text in texts if min(text[1:3]) < 0 or text[3] > box["width"] or text[4] > box["height"]]


@pytest.mark.parametrize("whole_road", [False, True])
@pytest.mark.parametrize("settings", SETTINGS)
def test_names__with_the_reference_driver_are_apart_at_all_times(player, settings, whole_road):
    page = player(f"#game={JUDGED}", **settings)
    if whole_road:
        page.locator(".player").focus()
        page.keyboard.press("f")
    for step in range(0, STEPS, 3):
        texts = page.evaluate(AT, step * STEP_S)
        names = [text[0].partition(" ·")[0] for text in texts]
        assert {"ego", "speedy"} <= set(names), step
        assert ("careful and competent driver" in names) == (step >= 30), step  # it takes over after 3 s
        assert overprinted(texts) == [], step
        assert cut_off(page, texts) == [], step


def test_names__of_two_games_on_one_road_are_apart_at_all_times(player):
    game, other = "naive_vs_speedy,1,6", "retrained_vs_speedy,1,6"
    page = player(f"#game={game}&t=0&with={other}&road=one", width=390)
    for step in range(0, STEPS, 3):
        texts = page.evaluate(AT, step * STEP_S)
        names = [text[0].partition(" ·")[0] for text in texts]
        assert {"ego", "speedy", "ego (retrained)", "speedy (retrained)"} <= set(names), step
        assert overprinted(texts) == [], step
        assert cut_off(page, texts) == [], step


def test_names__of_cars_at_one_place_in_a_corner_are_apart(browser):
    page = browser.new_page()
    page.add_script_tag(path=REPOSITORY / "harness" / "reports" / "labels.js")
    texts = page.evaluate(TOGETHER)
    page.close()
    assert [text[0] for text in texts] == [
        *("ego", "speedy", "careful and competent driver", "distracted", "speedy", "ego (naive)")
    ]
    assert overprinted(texts) == []
    assert all(min(text[1:3]) >= 0 and text[3] <= 340 and text[4] <= 208 for text in texts)
