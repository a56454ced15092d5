"""A persona's portrait says what its document means, reckoned by the code that the game plays by."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.chromium import launched, opener
from rich.console import Console
from tests.game.test_bicycle import advance, state_of
from tests.support.tiny import CAREFUL, DISTRACTED, SPEEDY, harness

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.errors import UsageError
from harness.game.attention import Attention, draw_lapses
from harness.game.payoff import GROUPS, TERMS
from harness.reports.persona.drives import DRIFT_SPEED_MPS, drift_m, free_share, lapsed_share, lapses_per_minute
from harness.reports.persona.page import render_profile, write_profile
from harness.reports.persona.plotting import area, axis, curve, stretches, ticks
from harness.reports.persona.profile import (
    SHOWN,
    PersonaProfile,
    attends,
    body,
    decides,
    function_in_words,
    persona_profile,
    sees,
    wants,
)
from harness.reports.persona.terminal import show
from harness.reports.persona.worth import EXAMPLES, LIMITED

TEXTING = Attention(mean_attentive_s=4.0, lapse_s=(4.0, 6.0), crown_rad=0.005, bumps_rad=0.001)


def portrait(file: Path) -> PersonaProfile:
    return persona_profile(read_document(file, Persona))


def made(**changes: Any) -> PersonaProfile:
    """The portrait of somebody made up."""
    document = {
        "name": "anna",
        "description": "<script>alert('anna')</script> [red]drives[/red]",
        "sources": [{"statistic": "one of <b>two</b> people", "citation": "nobody, [nowhere]"}],
        "operational": {"terms": {"goal": 2.0}},
        **changes,
    }
    return persona_profile(Persona.model_validate(document, strict=False))


def drawn(of: PersonaProfile, width: int, encoding: str = "utf-8") -> str:
    """What the terminal shows, without colour, as where it is not a terminal."""
    file = io.TextIOWrapper(io.BytesIO(), encoding=encoding, newline="")
    show(of, Console(file=file, width=width, color_system=None, legacy_windows=False))
    file.flush()
    return file.buffer.getvalue().decode(encoding)  # type: ignore[attr-defined]


# --- what it is worth ---


def test_portrait__shows_every_key_of_a_persona() -> None:
    assert set(SHOWN) == set(Persona.model_fields)


def test_portrait__has_a_moment_for_every_term() -> None:
    assert {*EXAMPLES, *LIMITED} == set(TERMS)
    terms = {group: {} for group in GROUPS}
    for name, term in TERMS.items():
        terms[term.group][name] = {"weight": 2.0, term.parameter: 1.0} if term.parameter else 2.0
    found = made(**{group: {"weight": 0.5, "terms": each} for group, each in terms.items()})
    worth = {each.name: (each.worth, each.moment) for each in found.terms}
    assert worth == {  # alpha 0.5, weight 2: the term's own value
        "collision": (-1.0, "once"),
        "rail": (-1.0, "once"),
        "clearance": (-0.5, "per second at 0.5 m"),
        "vehicle_clearance": (-0.5, "per second at 0.5 m"),
        "time_gap": (-0.5, "per second at 0.5 s"),
        "time_to_collision": (-0.5, "per second at 0.5 s"),
        "speed_over_limit": (-0.1, "per second at 10 % over"),
        "goal": (1.0, "once"),
        "timeout": (-1.0, "once"),
        "progress": (1.0, "for 100 m"),
        "speed_under_limit": (-0.1, "per second at 10 % under"),
        "lane_offset": (-1.0, "per second at 1 m"),
        "acceleration": (-0.25, "per second at 5 m/s²"),
        "lateral_acceleration": (pytest.approx(-0.09), "per second at 3 m/s²"),
        "time_pressure": (-1.0, "per second always"),
    }


def test_function__is_drawn_as_the_game_reckons_it() -> None:
    (speeding,) = portrait(SPEEDY).functions
    # by hand: half-way between `within` (0) and `over` (1.5), and half-way between `over` and `reckless` (-2)
    assert np.interp([0.075, 0.2, 0.325, 0.45], speeding.inputs, speeding.worth) == pytest.approx(
        [0.75, 1.5, -0.25, -2]
    )
    assert function_in_words(speeding) == (
        "Worth most from 0.15 to 0.25: +1.5 per second. Worth least from 0.4 on: −2 per second."
    )
    assert [(name, value) for name, value, _ in speeding.sets] == [("within", 0.0), ("over", 1.5), ("reckless", -2.0)]


def test_function__of_a_distance_is_not_drawn_below_zero_and_a_level_one_is_said_to_be() -> None:
    sets = [{"name": "all", "points": [[3.0, 1.0]], "value": 2.0}]
    (level,) = made(human={"weight": 0.5, "fuzzy": [{"name": "calm", "quantity": "goal_m", "sets": sets}]}).functions
    assert function_in_words(level) == "Worth +1 per second everywhere."
    sets = [{"name": "near", "points": [[0.0, 1.0], [5.0, 0.0]], "value": -2.0}]
    (near,) = made(human={"fuzzy": [{"name": "near", "quantity": "clearance_m", "sets": sets}]}).functions
    assert near.inputs[0] == 0.0


def test_wants__weighs_a_collision_against_progress() -> None:
    assert list(wants(portrait(SPEEDY))) == ["A collision costs as much as 125 m of progress are worth."]
    assert list(wants(made())) == ["A collision costs nothing of itself."]
    of = made(human={"weight": 0.0, "terms": {"time_pressure": 1.0}}, safety={"terms": {"collision": 5.0}})
    assert list(wants(of)) == [
        "A collision costs as much as 2.5 times the goal is worth.",
        "The human terms count nothing: their alpha is 0.",
    ]


# --- how it attends ---


def test_lapses__shares_and_rates_are_those_of_drawn_ones() -> None:
    # by hand: 5 s of every 9 s, a lapse in 9 s
    assert lapsed_share(TEXTING) == pytest.approx(5.0 / 9.0)
    assert lapses_per_minute(TEXTING) == pytest.approx(60.0 / 9.0)
    lapses = [draw_lapses(TEXTING, 100, 0.1, np.random.default_rng(seed)).lapsed for seed in range(2000)]
    # a glance of a step parts lapses that follow one another at once, so a little less is drawn
    assert np.mean(lapses) == pytest.approx(lapsed_share(TEXTING), abs=0.03)
    free = np.mean([not each.any() for each in lapses])  # standard error sqrt(0.036 * 0.964 / 2000) = 0.0042
    assert free == pytest.approx(free_share(TEXTING, 10.0), abs=4 * 0.0042)


def test_drift__is_that_of_the_games_car() -> None:
    assert drift_m(0.0, 5.0) == 0.0
    for steering_rad in (0.005, -0.01):
        state = state_of(DRIFT_SPEED_MPS)
        for _ in range(50):
            advance(state, 0.0, steering_rad)
        assert drift_m(steering_rad, 5.0) == pytest.approx(state.y_m[0, 0], rel=0.02)


def test_attends__in_words() -> None:
    said = " ".join(attends(portrait(DISTRACTED)))
    assert "Eyes off the road 56 % of the time" in said
    assert "lapses of 4 to 6 s, between them 4 s of attention on average; 6.7 lapses a minute" in said
    assert "Of drives of 60 s, under 1 % are without a lapse" in said
    assert "after 5 s, 5.1 m to the right (standard deviation 0.93 m)" in said
    assert list(attends(portrait(CAREFUL))) == ["Attention never lapses."]
    straight = made(attention={"mean_attentive_s": 55.0, "lapse_s": [5.0, 5.0]})
    said = " ".join(attends(straight))
    assert "Eyes off the road 8 % of the time, in the long run: lapses of 5 s, between them 55 s" in said
    assert "The wheel then stands straight." in said


def test_sees__in_words() -> None:
    of = portrait(SPEEDY)
    count = sum(each.overlooks for each in of.drives)
    assert next(sees(of)).startswith("In 85 % of the drives, others whose centre is not at least 4 m ahead of its own")
    assert f"in {count} of the 8 drawn here" in next(sees(of))
    behind = made(perception={"no_blind_spot_check_share": 1.0, "unseen_behind_m": -5.0})
    assert "others whose centre is more than 5 m behind its own are not seen: in 8 of the 8" in next(sees(behind))
    assert list(sees(portrait(CAREFUL))) == ["Nobody is overlooked."]


def test_body__in_words() -> None:
    assert list(body(portrait(CAREFUL))) == []
    of = made(
        perception={
            "looked_but_failed_to_see_share": 0.3, "noticed_within_m": 8.0, "range_m": 60.0,
            "distance_error": 0.1, "closing_error_per_s": 0.02,
        },
        reaction={"delay_s": [0.2, 0.6]},
        actuators={"throttle_share": 0.5, "steering_share": 0.8},
        attention={"mean_attentive_s": 5.0, "lapse_s": [1.0, 2.0]},
    )  # fmt: skip
    assert list(body(of)) == [
        "In 30 % of the drives it looks and fails to see: others are noticed within 8 m only.",
        "Others more than 60 m away are never seen.",
        "Two thirds of the time, 10 m to another are taken for 9.05 to 11.1 m.",  # 10 exp(-0.1) to 10 exp(0.1)
        "At 20 m, closing speeds are off by 0.4 m/s (standard deviation).",
        "What is misjudged stays so for 20 s or so.",
        "Decisions count 0.2 to 0.6 s later: at 50 km/h after up to 8.3 m.",
        "After a lapse the car is let go for as long again.",
        "Of what the car can do it uses 50 % of its acceleration, 80 % of its steering.",
        "While the person itself is trained, nobody is overlooked or missed; all else is as in driving.",
    ]


def test_decides__in_words() -> None:
    assert decides(portrait(SPEEDY)).startswith("Varies")
    assert decides(portrait(CAREFUL)).startswith("Always takes")


def test_drives__are_the_same_each_time_and_have_lapses_of_the_documents_length() -> None:
    first, second = portrait(DISTRACTED).drives, portrait(DISTRACTED).drives
    assert first == second
    whole = [end - begin for each in first for begin, end in each.lapses if begin > 0.0 and end < 60.0 - 1e-9]
    assert len(whole) > 20
    assert min(whole) > 4.0 - 0.11
    assert max(whole) < 6.0 + 0.11


# --- in characters ---


def test_curve__rises_from_foot_to_top_without_a_gap() -> None:
    x = np.array([0.0, 1.0])
    plain = curve(x, x, 4, 4, 0.0, 1.0, plain=True)
    assert plain == ["   *", "  * ", " *  ", "*   "]
    steep = curve(np.array([0.0, 0.5, 0.51, 1.0]), np.array([0.0, 0.0, 1.0, 1.0]), 3, 5, 0.0, 1.0, plain=True)
    assert all("*" in row for row in steep)
    assert curve(x, x, 1, 1, 0.0, 1.0, plain=False) == ["⡸"]


def test_area_stretches_and_axis() -> None:
    assert area(np.array([0.0, 1.0]), 3, 1, plain=False) == [" ▄█"]
    assert area(np.array([0.0, 1.0]), 3, 2, plain=True) == ["  #", " ##"]
    assert stretches([(1.0, 3.0)], 4.0, 4, plain=False) == "·██·"
    assert stretches([], 4.0, 4, plain=True) == "...."
    assert axis([(0.0, "0"), (0.5, "30"), (1.0, "60")], 9) == "0  30  60"
    assert ticks(0.0, 60.0) == [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    assert ticks(-0.06, 0.46) == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])


@pytest.mark.parametrize("width", [40, 80, 120])
@pytest.mark.parametrize("file", [SPEEDY, DISTRACTED], ids=["speedy", "distracted"])
def test_terminal__fits_and_says_it_all(file: Path, width: int) -> None:
    text = drawn(portrait(file), width)
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= width
    for words in ("collision", "What this person wants", "How this person attends", "How this person decides"):
        assert words in text
    if file == DISTRACTED:
        assert text.count("█·") > 8
        assert "60 s" in text
    else:
        assert re.search("[\u2801-\u28ff]", text), "the curve"
        assert "over (+1.5)" in text
        assert "speed_over_limit" in text


def test_terminal__of_ascii_alone_is_readable() -> None:
    text = drawn(portrait(SPEEDY), 80, "ascii")
    assert "alpha x weight" in text
    assert "-5 once" in text
    assert "***" in text
    assert "?" not in text


def test_terminal__takes_what_a_document_says_as_it_is() -> None:
    text = drawn(made(), 120)
    assert "<script>alert('anna')</script> [red]drives[/red]" in text
    assert "one of <b>two</b> people [nobody, [nowhere]]" in text


# --- as a page ---


def test_page__escapes_what_a_document_says() -> None:
    page = render_profile(made())
    assert "<script" not in page
    assert "&lt;script&gt;alert(&#39;anna&#39;)&lt;/script&gt;" in page
    assert "one of &lt;b&gt;two&lt;/b&gt; people" in page


def test_page__of_equal_portraits_is_equal() -> None:
    assert render_profile(portrait(SPEEDY)) == render_profile(portrait(SPEEDY))


def test_page__is_not_written_over_a_document(tmp_path: Path) -> None:
    file = tmp_path / "anna.toml"
    file.write_text("mine")
    with pytest.raises(UsageError, match=r"has to end with \.html"):
        write_profile(made(), file)
    assert file.read_text() == "mine"
    with pytest.raises(UsageError, match="there is no folder"):
        write_profile(made(), tmp_path / "no" / "anna.html")


def test_page__opens_in_dark_and_light_asks_for_nothing_and_never_scrolls_sideways(tmp_path: Path) -> None:
    file = tmp_path / "portrait.html"
    fuzzy = read_document(SPEEDY, Persona).model_dump(exclude_none=True)["human"]
    write_profile(made(human=fuzzy, attention={"mean_attentive_s": 5.0, "lapse_s": [4.0, 6.0]}), file)
    with launched() as browser, opener(browser, file) as open_page:
        for scheme in ("light", "dark"):
            page = open_page(color_scheme=scheme)
            assert page.title() == "anna: persona"
            assert page.locator("figure svg").count() == 2
            assert page.seen == []
        page = open_page(width=320)
        assert page.evaluate("document.documentElement.scrollWidth") == 320


def test_show__a_mistake_in_the_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "anna.toml"
    file.write_text(CAREFUL.read_text(encoding="utf-8").replace("progress", "progres"), encoding="utf-8")
    said = harness("persona", "show", file)
    assert said.returncode == 2
    assert "operational.terms.progres" in said.stderr
    assert "'progress'" in said.stderr
