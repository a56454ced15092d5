"""A persona's profile states the meaning of its document, computed by the code of the game."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.errors import UsageError
from harness.game.lapses import Attention, draw_lapses
from harness.game.payoff_terms import GROUPS, TERMS
from harness.reports.page_template import write_page
from harness.reports.persona.drives import DRIFT_SPEED_MPS, drift_m, free_share, lapsed_share, lapses_per_minute
from harness.reports.persona.persona_page import render_profile
from harness.reports.persona.persona_terminal import show
from harness.reports.persona.profile import (
    AFTER_A_LAPSE,
    ALWAYS_GLANCES,
    ATTENDS,
    COLLISION_IS_FREE,
    DECIDES,
    IN_A_LAPSE,
    NO_LAPSES,
    UNIMPAIRED_IN_TRAINING,
    WANTS,
    PersonaProfile,
    function_in_words,
    persona_profile,
)
from tests.support.bicycle import advance, state_of
from tests.support.chromium import opener
from tests.support.tiny import CAREFUL, PAPER_DISTRACTED, PAPER_SPEEDY

TEXTING = Attention(mean_attentive_s=4.0, lapse_s=(4.0, 6.0), bump_steering_sd_rad=0.001)


def profile_of(file: Path) -> PersonaProfile:
    return persona_profile(read_document(file, Persona))


def invented(**changes: Any) -> PersonaProfile:
    document = {
        "name": "anna",
        "description": "<script>alert('anna')</script> [red]drives[/red]",
        "sources": [{"statistic": "one of <b>two</b> people", "citation": "nobody, [nowhere]"}],
        "operational": {"terms": {"goal": 2.0}},
        **changes,
    }
    return persona_profile(Persona.model_validate(document, strict=False))


def drawn(of: PersonaProfile, width: int, encoding: str = "utf-8") -> str:
    """The output of the terminal without colour, as in a file."""
    file = io.TextIOWrapper(io.BytesIO(), encoding=encoding, newline="")
    show(of, Console(file=file, width=width, color_system=None, legacy_windows=False))
    file.flush()
    return file.buffer.getvalue().decode(encoding)  # type: ignore[attr-defined]


# --- payoffs ---


def test_profile__has_a_moment_for_every_term() -> None:
    terms = {group: {} for group in GROUPS}
    for name, term in TERMS.items():
        terms[term.group][name] = {"weight": 2.0, term.parameter: 1.0} if term.parameter else 2.0
    found = invented(**{group: {"weight": 0.5, "terms": each} for group, each in terms.items()})
    worth = {each.name: (each.worth, each.moment) for each in found.terms}
    assert not any(np.isnan(value) for value, _ in worth.values()), "a term without parameter has an example"
    by_hand = {  # alpha 0.5, weight 2: the term's own value
        "collision": (-1.0, "once"),
        "clearance": (-0.5, "per second at 0.5 m"),
        "speed_over_limit": (-0.1, "per second at 10 % over"),
        "red_light": (-1.0, "at 1 s"),
        "waiting": (-1.0, "per second standing"),
        "goal": (1.0, "once"),
        "progress": (1.0, "for 100 m"),
        "speed_under_limit": (-0.1, "per second at 10 % under"),
        "lateral_acceleration": (pytest.approx(-0.09), "per second at 3 m/s²"),
        "time_pressure": (-1.0, "per second always"),
    }
    assert {name: worth[name] for name in by_hand} == by_hand


def test_function__is_that_of_the_game() -> None:
    (speeding,) = profile_of(PAPER_SPEEDY).functions
    # by hand: half-way between `within` (0) and `over` (1.5), and half-way between `over` and `reckless` (-2)
    assert np.interp([0.075, 0.2, 0.325, 0.45], speeding.inputs, speeding.worth) == pytest.approx(
        [0.75, 1.5, -0.25, -2]
    )
    assert function_in_words(speeding) == (
        "Greatest payoff from 0.15 to 0.25: +1.5 per second. Least payoff from 0.4 on: −2 per second."
    )
    assert [(name, value) for name, value, _ in speeding.sets] == [("within", 0.0), ("over", 1.5), ("reckless", -2.0)]


def test_wants__compares_a_collision_with_progress() -> None:
    assert profile_of(PAPER_SPEEDY).wants == ["A collision costs as much as 125 m of progress earn."]
    assert invented().wants == [COLLISION_IS_FREE]
    of = invented(human={"weight": 0.0, "terms": {"time_pressure": 1.0}}, safety={"terms": {"collision": 5.0}})
    assert of.wants == [
        "A collision costs 2.5 times the payoff of the goal.",
        "The human terms have no effect: their alpha is 0.",
    ]


# --- human factors ---


def test_lapses__shares_and_rates_are_those_of_drawn_lapses() -> None:
    # by hand: 5 s of every 9 s, a lapse in 9 s
    assert lapsed_share(TEXTING) == pytest.approx(5.0 / 9.0)
    assert lapses_per_minute(TEXTING) == pytest.approx(60.0 / 9.0)
    lapses = [draw_lapses(TEXTING, 100, 0.1, np.random.default_rng(seed)).lapsed for seed in range(2000)]
    # a step of attention separates consecutive lapses, so the drawn share is slightly smaller
    assert np.mean(lapses) == pytest.approx(lapsed_share(TEXTING), abs=0.03)
    rare = Attention(mean_attentive_s=55.0, lapse_s=(5.0, 5.0))
    drives = [draw_lapses(rare, 600, 0.1, np.random.default_rng(seed)).lapsed for seed in range(2000)]
    free = np.mean([not each.any() for each in drives])  # standard error sqrt(0.31 * 0.69 / 2000) = 0.0103
    assert free == pytest.approx(free_share(rare), abs=4 * 0.0103)


def test_drift__is_that_of_the_games_car() -> None:
    assert drift_m(0.0, 5.0) == 0.0
    for steering_rad in (0.005, -0.01):
        state = state_of(DRIFT_SPEED_MPS)
        for _ in range(50):
            advance(state, 0.0, steering_rad)
        assert drift_m(steering_rad, 5.0) == pytest.approx(state.y_m[0, 0], rel=0.02)


def test_attends__in_words() -> None:
    text = " ".join(profile_of(PAPER_DISTRACTED).attends)
    assert "Eyes off the road 56 % of the time" in text
    assert "lapses of 4 to 6 s, with 4 s of attention between them on average; 6.7 lapses per minute" in text
    assert "Of drives of 60 s, under 1 % have no lapse" in text
    assert "wheelbase drifts in 5 s by 0.46 m (standard deviation)" in text
    assert profile_of(CAREFUL).attends[:2] == [NO_LAPSES, ALWAYS_GLANCES]
    straight = invented(attention={"mean_attentive_s": 55.0, "lapse_s": [5.0, 5.0]})
    text = " ".join(straight.attends)
    assert "Eyes off the road 8 % of the time, in the long run: lapses of 5 s, with 55 s" in text
    assert "drifts" not in text
    assert IN_A_LAPSE["released"] in text
    glances = {"mean_attentive_s": 1.5, "lapse_s": [0.42, 4.0], "lapse_distribution": "lognormal", "controls": "held"}
    text = " ".join(invented(attention=glances).attends)
    assert "Eyes off the road 52 % of the time" in text
    assert "lapses of 1.6 s on average, 0.42 to 4 s in the middle 90 %" in text
    assert IN_A_LAPSE["held"] in text


def test_body__in_words() -> None:
    of = invented(
        perception={
            "looked_but_failed_to_see_share": 0.3, "noticed_within_m": 8.0, "range_m": 60.0,
            "distance_error": 0.1, "closing_error_per_s": 0.02,
        },
        reaction={"delay_s": [0.2, 0.6]},
        actuators={"throttle_share": 0.5, "steering_share": 0.8},
        attention={"mean_attentive_s": 5.0, "lapse_s": [1.0, 2.0]},
    )  # fmt: skip
    assert of.attends[-10:] == [
        "In 30 % of the drives the person looks but fails to see: a vehicle is noticed within 8 m only.",
        "The field of view is 180 degrees; mirrors show what is behind it.",
        "Vehicles more than 60 m away are never seen.",
        "Two thirds of the time, a distance of 10 m is perceived as 9.05 to 11.1 m.",  # 10 exp(-0.1) to 10 exp(0.1)
        "At 20 m, the error of closing speeds is 0.4 m/s (standard deviation).",
        "An error of perception lasts for about 20 s.",
        "What others do is known 0.2 to 0.6 s later: at 50 km/h after up to 8.3 m.",
        AFTER_A_LAPSE,
        "The person uses 50 % of the acceleration, 80 % of the steering of the car.",
        UNIMPAIRED_IN_TRAINING,
    ]


def test_drives__are_reproducible_and_have_lapses_of_the_documents_length() -> None:
    first, second = profile_of(PAPER_DISTRACTED).drives, profile_of(PAPER_DISTRACTED).drives
    assert first == second
    whole = [end - begin for each in first for begin, end in each.lapses if begin > 0.0 and end < 60.0 - 1e-9]
    assert len(whole) > 20
    assert min(whole) > 4.0 - 0.11
    assert max(whole) < 6.0 + 0.11


# --- in the terminal ---


@pytest.mark.parametrize("width", [40, 80, 120])
@pytest.mark.parametrize("file", [PAPER_SPEEDY, PAPER_DISTRACTED], ids=["speedy", "distracted"])
def test_terminal__fits_the_width_and_has_every_part(file: Path, width: int) -> None:
    text = drawn(profile_of(file), width)
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= width
    for words in ("collision", WANTS, ATTENDS, DECIDES):
        assert words in text
    if width == 120:
        expected = (
            ("drive of 60 s", "0 to 1.6") if file == PAPER_DISTRACTED else ("over (+1.5)", "speed_over_limit", "+0.7")
        )
        assert [words for words in expected if words not in text] == []


def test_terminal__is_legible_in_ascii_and_prints_the_text_of_a_document_unchanged() -> None:
    text = drawn(profile_of(PAPER_SPEEDY), 80, "ascii")
    assert [words for words in ("alpha x weight", "-5 once") if words not in text] == []
    assert "?" not in text
    text = drawn(invented(), 120)
    assert "<script>alert('anna')</script> [red]drives[/red]" in text
    assert "one of <b>two</b> people [nobody, [nowhere]]" in text


# --- as a page ---


def test_page__escapes_the_text_of_a_document() -> None:
    page = render_profile(invented())
    assert "<script" not in page
    assert "&lt;script&gt;alert(&#39;anna&#39;)&lt;/script&gt;" in page
    assert "one of &lt;b&gt;two&lt;/b&gt; people" in page


def test_page__is_not_written_over_a_document(tmp_path: Path) -> None:
    file = tmp_path / "anna.toml"
    file.write_text("mine")
    with pytest.raises(UsageError, match=r"must end with \.html"):
        write_page(file, render_profile(invented()))
    assert file.read_text() == "mine"
    with pytest.raises(UsageError, match="there is no folder"):
        write_page(tmp_path / "no" / "anna.html", render_profile(invented()))


def test_page__opens_in_dark_and_light_loads_nothing_and_does_not_scroll_sideways(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "profile.html"
    fuzzy = read_document(PAPER_SPEEDY, Persona).model_dump(exclude_none=True)["human"]
    anna = invented(human=fuzzy, attention={"mean_attentive_s": 5.0, "lapse_s": [4.0, 6.0]})
    write_page(file, render_profile(anna))
    with opener(browser, file) as open_page:
        for scheme in ("light", "dark"):
            page = open_page(color_scheme=scheme)
            assert page.title() == "anna: persona"
            assert page.locator("figure svg").count() == 2
            assert page.seen == []
        page = open_page(width=320)
        assert page.evaluate("document.documentElement.scrollWidth") == 320
