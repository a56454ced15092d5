"""The player of the report in a real browser: it plays, steps, seeks, synchronises two games, and opens its links."""

from __future__ import annotations

import math
import re

import pytest

from harness.reports.embedding import key
from tests.support.chromium import ready_s, until
from tests.support.pages import blank_figures, campaign, recordings, rendered
from tests.support.recorded import PREVENTED, STEP_S, recorded
from tests.support.repository import REPOSITORY
from tests.support.work import assert_work

GAME, OTHER = "naive_vs_speedy,1,6", "retrained_vs_speedy,1,6"  # a collision, and the same episode after retraining

JUDGED = f"naive_vs_speedy,1,{PREVENTED}"  # a collision that a reference driver prevents


@pytest.fixture(scope="module")
def arguments():
    found = campaign(personas=["speedy"])
    return found | {"training": found["training"][:0]}


@pytest.fixture(scope="module")
def games(arguments):
    """The recorded games by their key."""
    return {key(game.arm, game.seed, game.episode): game for game in recorded(arguments["episodes"])}


@pytest.fixture(scope="module")
def report(arguments, write_report):
    return write_report(arguments)


@pytest.fixture
def player(opened):
    def open_player(fragment=f"#game={GAME}&t=2", **settings):
        page = opened(fragment=fragment, **settings)
        page.wait_for_selector(".player[data-ready]")
        return page

    return open_player


def time_of(page):
    return float(page.locator(".player").get_attribute("data-time"))


def press(page, *keys):
    page.locator(".player").focus()
    for each in keys:
        page.keyboard.press(each)


def scrub(page, time_s):
    page.locator("[data-is=time]").evaluate(
        "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input', {bubbles: true})); }",
        time_s,
    )


# --- the title ---


def test_title__says_why_the_ego_failed(player, games):
    page = player()
    assert games[GAME].outcome != "goal"
    heading = page.locator(".screen h3").first.inner_text()
    assert "1.2 s before the end; the ego: " in heading


# --- the clock ---


def test_player__plays_and_pauses_without_an_error_or_a_request(player):
    page = player()
    page.get_by_role("button", name="Play", exact=True).last.click()
    until(page, "() => Number(document.querySelector('.player').dataset.time) > 2.3")
    page.locator(".player [data-do=play]").click()
    stopped = time_of(page)
    page.wait_for_timeout(150)
    assert time_of(page) == stopped
    assert page.seen == []


def test_player__opens_a_game_without_contact_where_the_ego_is_nearest_to_another(player, games):
    name, game = next((name, game) for name, game in games.items() if game.outcome == "goal" and len(game.players) == 2)
    (ego, other), count = game.players, min(len(each.columns["x_m"]) for each in game.players)
    away = [
        math.hypot(*(ego.columns[axis][step] - other.columns[axis][step] for axis in ("x_m", "y_m")))
        for step in range(count)
    ]
    nearest = away.index(min(away))
    assert nearest < count - 1
    assert time_of(player(f"#game={name}")) == pytest.approx(nearest * STEP_S)


def test_player__stops_at_the_end_and_restarts(player, games):
    page = player(f"#game={GAME}&t={games[GAME].steps * STEP_S - 0.2}")
    press(page, "Space")
    until(page, "() => document.querySelector('[data-do=play]').textContent === 'Play'")
    assert time_of(page) == pytest.approx(games[GAME].steps * STEP_S)
    press(page, "Space")
    until(page, "() => (t => t > 0 && t < 2)(Number(document.querySelector('.player').dataset.time))")


SPEED_MEASURED = """async () => {
  const player = document.querySelector('.player');
  document.querySelector('[data-do=play]').click();
  await new Promise(done => setTimeout(done, 150));
  const [from, begun] = [Number(player.dataset.time), performance.now()];
  await new Promise(done => setTimeout(done, 900));
  return (Number(player.dataset.time) - from) / (performance.now() - begun) * 1000;
}"""


@pytest.mark.parametrize("speed", ["0.25", "4"])
def test_player__speed_is_the_speed_of_the_clock(player, speed):
    def measured():
        page = player("#game=retrained_vs_speedy,1,6&t=0")
        page.locator("[data-is=speed]").select_option(speed)
        return page.evaluate(SPEED_MEASURED)

    # frames that a busy machine leaves out slow the player down: one undisturbed second is enough
    assert any(measured() == pytest.approx(float(speed), rel=0.35) for _ in range(5))


def test_player__keys_step_one_frame_jump_a_second_and_go_to_the_ends(player, games):
    page = player()
    game = games[GAME]
    steps = [("Period", 2.1), ("Period", 2.2), ("Comma", 2.1), ("ArrowRight", 3.1), ("ArrowLeft", 2.1)]
    for pressed, expected in (*steps, ("End", game.steps * STEP_S), ("Home", 0), ("c", game.touches[0][0])):
        press(page, pressed)
        assert time_of(page) == pytest.approx(expected, abs=1e-6), pressed


# --- the road ---


PIXEL = """(canvas, [x, y]) => {
  const [left, top, scale] = canvas.dataset.camera.split(' ').map(Number);
  const ratio = canvas.width / canvas.getBoundingClientRect().width;
  const place = [(left + x * scale) * ratio, (top - y * scale) * ratio].map(Math.round);
  return [...canvas.getContext('2d').getImageData(...place, 1, 1).data].slice(0, 3);
}"""
COLOUR = """name => {
  const context = document.createElement('canvas').getContext('2d');
  context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  context.fillRect(0, 0, 1, 1);
  return [...context.getImageData(0, 0, 1, 1).data].slice(0, 3);
}"""


def pixel(page, screen, x_m, y_m):
    """Colour of the canvas at a place on the road."""
    return page.locator(".view").nth(screen).evaluate(PIXEL, [x_m, y_m])


def colour(page, name):
    """A colour of the page, as its canvas has it."""
    return page.evaluate(COLOUR, name)


@pytest.mark.parametrize("settings", [{}, {"color_scheme": "dark"}, {"width": 400, "device_scale_factor": 2}])
def test_road__cars_are_where_the_trace_has_them(player, games, settings):
    page = player(**settings)
    names = {"ego": "--ego", "non_ego": "--non-ego"}
    for step in (3, 27, 48, 60):
        scrub(page, step * STEP_S)
        for player in games[GAME].players:
            found = pixel(page, 0, player.columns["x_m"][step], player.columns["y_m"][step])
            assert found == colour(page, names[player.name]), (step, player.name)
        assert pixel(page, 0, games[GAME].players[0].columns["x_m"][step] + 5, -1.6) == colour(page, "--asphalt")


def test_road__between_two_steps_a_car_is_between_its_places(player, games):
    page = player()
    ego = games[GAME].players[0]
    scrub(page, 2.0)
    page.locator("[data-is=time]").evaluate("slider => { slider.step = 'any'; }")
    scrub(page, 2.05)
    ahead = (ego.columns["x_m"][20] + ego.columns["x_m"][21]) / 2 + 2.2
    assert pixel(page, 0, ahead + 0.25, ego.columns["y_m"][20]) == colour(page, "--asphalt")
    assert pixel(page, 0, ahead, ego.columns["y_m"][20]) != colour(page, "--asphalt")


def test_road__follows_the_players_or_shows_the_whole_road_and_zooms(player):
    page = player()

    def scale():
        return float(page.locator(".view").get_attribute("data-camera").split()[2])

    following = scale()
    press(page, "+")
    assert scale() == pytest.approx(following * 1.25, rel=1e-3)
    press(page, "f")
    assert scale() * 220 <= page.locator(".view").bounding_box()["width"]
    assert page.locator("[data-do=view]").get_attribute("aria-pressed") == "false"
    press(page, "f")
    assert scale() == pytest.approx(following, rel=1e-3)


# --- two games ---


def test_side_by_side__games_have_the_same_time(player, games):
    page = player()
    press(page, "b")
    page.wait_for_selector(".screens.two")
    assert [page.locator(".screen h3").nth(n).inner_text().split(",")[0] for n in (0, 1)] == [
        "naive_vs_speedy",
        "retrained_vs_speedy",
    ]
    for step in (12, 40):
        scrub(page, step * STEP_S)
        for screen, name in enumerate((GAME, OTHER)):
            ego = games[name].players[0]
            assert pixel(page, screen, ego.columns["x_m"][step], ego.columns["y_m"][step]) == colour(page, "--ego")
    press(page, "Space")
    until(page, "() => Number(document.querySelector('.player').dataset.time) > 4.5")
    press(page, "Space", "Period", "Comma")
    step = round(time_of(page) / STEP_S)
    for screen, name in enumerate((GAME, OTHER)):
        text = page.locator(".values").nth(screen).locator(".of-ego").inner_text()
        speed_mps = games[name].players[0].columns["speed_mps"][step]
        assert text.startswith(f"ego {speed_mps:.1f} m/s")
    press(page, "b")
    page.wait_for_selector(".screens:not(.two)")


def test_one_road__shows_the_other_game_as_ghosts(player, games):
    page = player(f"#game={GAME}&t=4&with={OTHER}")
    assert page.locator(".screen:visible").count() == 2
    page.locator("[data-do=road]").click()
    assert page.locator(".screen:visible").count() == 1
    ghost = games[OTHER].players[1]
    place = ghost.columns["x_m"][40] + 1.2, ghost.columns["y_m"][40] - 0.5
    assert pixel(page, 0, *place) not in (colour(page, "--asphalt"), colour(page, "--non-ego"))
    again = player(page.evaluate("location.hash"))
    assert again.locator(".screen:visible").count() == 1


# --- the reference driver ---


def test_reference__is_drawn_beyond_the_collision_until_it_is_switched_off(player, games):
    game = games[JUDGED]
    page = player(f"#game={JUDGED}&t={game.steps * STEP_S}")
    heading = page.locator(".screen h3").first.inner_text()
    assert "prevented by the careful and competent driver that takes over at 3.0 s" in heading
    car, person = game.reference.players
    step = game.steps + 8
    scrub(page, step * STEP_S)
    for track, name in ((car, "--mended"), (person, "--non-ego")):
        place = [float(track.columns[each][step - track.first_step]) for each in ("x_m", "y_m")]
        shades = pixel(page, 0, *place), colour(page, name), colour(page, "--asphalt")
        assert shades[0] not in shades[1:]  # a tint on the road
    switch = page.get_by_role("button", name="Reference driver")
    switch.click()
    assert switch.get_attribute("aria-pressed") == "false"
    assert time_of(page) == pytest.approx(game.steps * STEP_S)
    press(page, "r", "End")
    assert time_of(page) == pytest.approx((game.steps + 10) * STEP_S)
    assert player(f"#game={OTHER}").get_by_role("button", name="Reference driver").is_hidden()


# --- the list of games ---


def test_list__next_follows_its_order_and_its_filter(player, games):
    page = player()
    page.locator(".games-list summary").click()
    page.locator(".games-list [data-is=outcome]").select_option("rail contact")
    page.get_by_role("columnheader", name="least TTC").locator(".dt-column-order").click()
    listed = page.locator(".games-list tbody tr")
    keys = [listed.nth(place).get_attribute("data-key") for place in range(listed.count())]
    assert len(keys) > 2
    assert {games[each].outcome for each in keys} == {"rail"}
    page.locator(".games-list tbody a").first.click()
    for wanted in keys:
        until(page, "key => document.querySelector('.player').dataset.game === key", wanted)
        press(page, "n")


def test_list__begins_with_the_worst_game_of_an_arm_and_says_how_severe_and_why(player, games):
    page = player()
    page.locator(".games-list summary").click()
    listed = page.locator(".games-list tbody tr")
    keys = [listed.nth(place).get_attribute("data-key") for place in range(listed.count())]
    severities = [games[each].severity for each in keys]
    assert len(keys) > 2
    assert severities == sorted(severities, reverse=True)
    assert listed.first.locator("td").all_inner_texts()[:2] == ["collision", f"{games[keys[0]].delta_v_mps:.1f}"]
    assert "1.2 s before the end; the ego: " in listed.first.inner_text()
    assert "collision, delta-v 2.6 m/s" in page.locator(".screen h3").first.inner_text()  # game 6
    prevented = page.locator(f'.games-list tr[data-key="{JUDGED}"]')
    while prevented.count() == 0:
        page.locator(".games-list .dt-paging-button.next").click()
    assert "prevented by the careful and competent driver" in prevented.inner_text()


def test_strips__time_to_collision_is_on_the_first_screen_and_none_is_empty(player):
    page = player()
    names = [each.partition(" (")[0] for each in page.locator(".curves .strip span").all_inner_texts()]
    assert names == ["speed", "time to collision", "gap ahead", "acceleration", "steering"]
    bottom = page.locator(".curves .strip").nth(1).bounding_box()["y"] + 60  # pixels: its heading and its plot
    assert bottom - page.locator(".player").bounding_box()["y"] < 800
    alone = player("#game=naive_alone,1,20")
    names = [each.partition(" (")[0] for each in alone.locator(".curves .strip span").all_inner_texts()]
    assert names == ["speed", "acceleration", "steering"]


# --- figures ---


def test_figure__a_dot_names_its_game_and_opens_it(player):
    page = player("")
    page.locator("#figures > details > summary").click()
    dot = page.locator(f'#figures svg a[href="#game={OTHER}"]').first
    assert dot.get_attribute("aria-label").startswith("retrained_vs_speedy, game 6: ")
    dot.evaluate("link => link.dispatchEvent(new MouseEvent('click', {bubbles: true, cancelable: true}))")
    until(page, "key => document.querySelector('.player').dataset.game === key", OTHER)
    assert page.seen == []


# --- addresses ---


def test_link__reopens_the_games_at_the_moment(player):
    page = player()
    press(page, "b")
    page.wait_for_selector(".screens.two")
    scrub(page, 3.2)
    page.locator("[data-do=link]").click()
    until(page, "() => document.querySelector('[data-is=status]').textContent.includes('link to this moment')")
    fragment = page.evaluate("location.hash")
    assert fragment == f"#game={GAME}&t=3.2&with={OTHER}"
    again = player(fragment)
    assert time_of(again) == pytest.approx(3.2)
    assert again.locator(".screen").count() == 2
    assert again.locator(".player").get_attribute("data-game") == GAME
    assert again.locator("[data-is=with]").input_value() == OTHER
    box = again.locator(".player").bounding_box()
    assert -5 < box["y"] < 200


@pytest.mark.parametrize(
    "fragment",
    ["#game=naive_vs_nobody,1,3&t=2", "#game=", "#game=%E0%A4%A,1,1", "#figures", "#game=a,b,c&t=x&with=%"],
)
def test_link__to_a_missing_game_is_harmless(player, fragment):
    page = player(fragment)
    if "nobody" in fragment:
        until(page, "() => document.querySelector('[data-is=status]').textContent.includes('does not contain that')")
    assert page.locator(".screen").count() == 1
    assert page.seen == []


def test_marks__a_manoeuvre_seeks_to_its_time(player):
    page = player()
    page.get_by_role("button", name="4.0 s speedy: cut-in").click()
    assert time_of(page) == pytest.approx(4.0)


# --- the cards' animations ---


def test_clip__plays_by_itself_and_opens_in_the_player(player):
    page = player("")
    clip = page.locator(".clip").first
    until(page, "() => Number(document.querySelector('.clip').dataset.time) > 0.3")
    clip.get_by_role("link").click()
    key_of_clip = clip.get_attribute("data-game")
    until(page, "key => document.querySelector('.player').dataset.game === key", key_of_clip)
    until(page, "() => Number(document.querySelector('.player').dataset.time) > 0.2")


def test_clip__does_not_move_with_reduced_motion(player):
    page = player("", reduced_motion="reduce")
    page.wait_for_selector(".clip[data-time]")
    before = page.locator(".clip").first.get_attribute("data-time")
    page.wait_for_timeout(250)
    assert page.locator(".clip").first.get_attribute("data-time") == before
    page.locator(".clip-play").first.click()
    until(page, "before => document.querySelector('.clip').dataset.time !== before", before)


# --- the page it is in ---


def test_page__of_a_campaign_weighs_little_and_is_soon_interactive(opened, write_report):
    arguments = campaign(games=100)
    path = write_report(arguments, **recordings(arguments, background=6))
    assert path.stat().st_size <= 2e6
    page = opened(path)
    assert_work(ready_s(page), 2.0)
    until(page, "() => document.querySelector('[data-is=place]').textContent !== ''")
    assert page.locator("[data-is=arm] option").count() == 1 + arguments["episodes"]["arm"].nunique()


def test_page__games_that_do_not_fit_stay_in_the_run_folder(arguments, monkeypatch):
    monkeypatch.setattr("harness.reports.page.GAMES_BYTES", 50_000)
    with blank_figures():
        html = rendered(**arguments, **recordings(arguments))
    shown = len(re.findall(r'"packed"', html))
    (games,) = re.findall(r'id="recorded">(.*?)</script>', html, flags=re.DOTALL)
    assert 25_000 < len(games) < 60_000
    assert 0 < shown < len(arguments["episodes"])
    assert f"{shown} recorded games" in html
    assert f"{len(arguments['episodes']) - shown} more games do not fit into the page" in html


def test_hidden__is_the_area_between_the_lines_of_sight_past_a_box(browser):
    page = browser.new_page()
    page.add_script_tag(path=REPOSITORY / "harness" / "reports" / "sight.js")
    box = [[10.0, 1.0], [10.0, -1.0], [12.0, -1.0], [12.0, 1.0]]
    shadow = page.evaluate(
        """box => {
          const points = [], add = (x, y) => points.push([x, y]);
          addShadow({ moveTo: add, lineTo: add, closePath() {} }, { x: 0, y: 0 }, box);
          return points;
        }""",
        box,
    )
    page.close()
    far_m = 120.0 / 101.0**0.5  # the game's sight, along a line of sqrt(10^2 + 1^2) m
    expected = [[10.0, -1.0], [10.0 * far_m, -far_m], [10.0 * far_m, far_m], [10.0, 1.0]]
    assert shadow == [pytest.approx(corner) for corner in expected]
