"""A persona's profile as one HTML file: opens offline, loads nothing."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from harness.reports.figures import GRID, INK, SERIES, figure_of, svg
from harness.reports.page_template import page_of
from harness.reports.persona.drives import DRIVE_S, SampleDrive
from harness.reports.persona.profile import (
    ATTENDS,
    DECIDES,
    FORMULA,
    NO_GLANCE_MARK,
    WANTS,
    PersonaProfile,
    function_in_words,
    number,
)
from harness.reports.persona.worth import PayoffFunction

_COLOURS = [SERIES[name] for name in ("alone", "persona", "retrained", "sumo")]
_LINES = ("-", "--", ":", "-.")


def render_profile(profile: PersonaProfile) -> str:
    """The page as text. Equal profiles give equal pages."""
    functions = []
    for k, each in enumerate(profile.functions, 1):
        words = function_in_words(each)
        functions.append((each, words, _function_figure(each, f"function{k}", f"{each.name}: {words}")))
    lapses = None
    if profile.persona.human_factors.attention is not None:
        alternative = f"Lapses of attention in {len(profile.drives)} drives of {DRIVE_S:g} s"
        lapses = _drives_figure(profile.drives, alternative)
    return page_of(
        "profile",
        profile=profile,
        persona=profile.persona,
        headings={"wants": WANTS, "attends": ATTENDS, "decides": DECIDES},
        formula=FORMULA,
        functions=functions,
        drives_figure=lapses,
    )


def _function_figure(function: PayoffFunction, name: str, alternative: str) -> Markup:
    """The memberships of a function's sets above, the payoff over the quantity below."""
    with figure_of(6.4, 4.6) as figure:
        memberships, worth = figure.subplots(2, 1, sharex=True, height_ratios=(2, 3))
        for place, (label, value, membership) in enumerate(function.sets):
            memberships.plot(
                function.inputs, membership, linewidth=1.8, label=f"{label} ({number(value)})",
                color=_COLOURS[place % len(_COLOURS)], linestyle=_LINES[place // len(_COLOURS) % len(_LINES)],
            )  # fmt: skip
        memberships.set_ylim(0, 1.05)
        memberships.set_ylabel("membership")
        memberships.legend(frameon=False, fontsize=9, ncols=3, loc="lower left", bbox_to_anchor=(0, 1.0), borderpad=0)
        worth.axhline(0, color=INK, linewidth=0.8)
        worth.plot(function.inputs, function.worth, color=SERIES["persona"], linewidth=2.2)
        worth.set_ylabel("payoff per second")
        worth.yaxis.set_major_formatter(lambda value, _: number(value))
        worth.set_xlim(function.inputs[0], function.inputs[-1])
        worth.set_xlabel(function.quantity + (f" ({function.unit})" if function.unit else ""))
        return svg(figure, name, alternative)


def _drives_figure(drives: Sequence[SampleDrive], alternative: str) -> Markup:
    """A row for each drive, with its lapses as bars over time."""
    with figure_of(9.6, 0.9 + 0.34 * len(drives)) as figure:
        axes = figure.subplots()
        for row, drive in enumerate(drives):
            axes.barh(row, DRIVE_S, 0.12, color=GRID, linewidth=0)
            for begin, end in drive.lapses:
                axes.barh(row, end - begin, 0.6, left=begin, color=SERIES["persona"], linewidth=0)
        names = [f"drive {k}" + ("" if each.shoulder_glance else NO_GLANCE_MARK) for k, each in enumerate(drives, 1)]
        axes.set_yticks(range(len(drives)), names, fontsize=9)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.grid(visible=True, axis="x")
        axes.invert_yaxis()
        axes.set_xlim(0, DRIVE_S)
        axes.set_xlabel("time (s)")
        return svg(figure, "drives", alternative)
