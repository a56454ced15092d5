"""Model cards: a README.md beside each policy of a run that describes the policy, its training and its results.

A card contains data of the run's manifest, its summary, its figures of people and the policy's JSON only, without
timings: the same campaign gives the same card.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from harness.campaign.plan.planned_drivers import Trained
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.manifest import campaign_in, planned
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import NaiveEgo, RobustEgo, against_persona, persona_alone, strategy_name
from harness.files import write_atomically
from harness.game.payoff_terms import GROUPS, TERMS
from harness.game.roles import NON_EGO, ROLES
from harness.reports.human_ranges import crashes_alone
from harness.reports.learning import stopped
from harness.reports.numbers import MISSING, interval, number, percent
from harness.reports.page_template import environment_of
from harness.reports.persona.profile import PersonaProfile, persona_profile

CARD = "README.md"
_PROGRAMS = ("python", "eclipse-sumo", "torch", "stable-baselines3", "numpy")


def write_model_cards(
    folder: RunFolder,
    manifest: Mapping[str, Any],
    policies: Mapping[str, Mapping[str, Any]],
    summary: pd.DataFrame,
    realism: pd.DataFrame,
) -> None:
    """Write the card of every policy of `policies`, the policy.json of each stage that made one. One that was learned
    in another run has none. `summary` and `realism` are the run's tables of these names."""
    for stage, policy in policies.items():
        if manifest["stages"][policy.get("selected") or stage].get("steps") is None:
            continue
        if "personas" in policy:
            card = card_of_many(stage, manifest, summary, policy)
        else:
            card = model_card(stage, manifest, summary, realism, policy)
        write_atomically(folder.policy(stage) / CARD, card.encode())


def card_of_many(stage: str, manifest: Mapping[str, Any], summary: pd.DataFrame, policy: Mapping[str, Any]) -> str:
    """The card of the network of several personas; the arguments are those of `model_card`. Each persona's own policy,
    which is derived from it, has a card of its own."""
    entry = manifest["stages"][stage]
    rows = {row["arm"]: row for row in summary[summary["seed"] == entry["seed"]].to_dict("records")}
    personas = list(policy["personas"])
    figures = []
    for persona in personas:
        alone, naive = rows.get(persona_alone(persona).name), rows.get(against_persona(NaiveEgo(), persona).name)
        goals = [_cells(row, is_ego=False)[1] if row else "" for row in (alone, naive)]
        figures.append((persona, [*goals, _cells(naive, is_ego=True)[1] if naive else ""]))
    facts = _training_facts(entry, manifest, policy)
    return _rendered("card_of_many", stage, manifest, entry, policy, facts=list(facts), figures=figures)


def model_card(
    stage: str, manifest: Mapping[str, Any], summary: pd.DataFrame, realism: pd.DataFrame, policy: Mapping[str, Any]
) -> str:
    """The card of the policy that a training made or a selection chose; `policy` is the content of its policy.json."""
    entry = manifest["stages"][policy.get("selected") or stage]
    is_ego = policy["player"] != ROLES[NON_EGO]
    document = manifest["ego_persona"] if is_ego else manifest["persona_documents"][entry["persona"]]
    persona = Persona.from_record(document)
    profile = persona_profile(persona)
    return _rendered(
        "model_card",
        stage,
        manifest,
        entry,
        policy,
        is_ego=is_ego,
        robust=strategy_name(RobustEgo()),
        facts=list(_facts(entry, manifest, policy, persona)),
        persona=persona,
        alpha=" + ".join(f"{getattr(persona, group).weight:g} × {group}" for group in GROUPS),
        terms=list(_terms(profile)),
        attends=[*profile.attends, profile.decides],
        sources=persona.sources,
        figures=list(_figures(stage, manifest, summary, is_ego)),
        crashes="" if is_ego else crashes_alone(realism, entry["name"], entry["seed"]),
    )


def _rendered(
    template: str,
    stage: str,
    manifest: Mapping[str, Any],
    entry: Mapping[str, Any],
    policy: Mapping[str, Any],
    **own: object,
) -> str:
    """The text of a card, from what all cards have and what this one has."""
    environment = environment_of("campaign/results", autoescape=False)
    environment.filters["one_line"] = _one_line
    versions = manifest["versions"]
    text = environment.get_template(f"{template}.md.jinja").render(
        stage=stage,
        entry=entry,
        policy=policy,
        campaign=manifest["name"],
        version=versions["harness"],
        quick=manifest["quick"],
        not_learned=stopped(entry) if entry["stopped"] == DID_NOT_LEARN else "",
        settings=[(name, _shown(value)) for name, value in policy["training"].items()],
        versions=", ".join(f"{name} {versions[name]}" for name in _PROGRAMS if name in versions),
        **own,
    )
    return text.strip() + "\n"


def _one_line(text: str) -> str:
    """A text of a document as one line of plain text, without Markdown headings, tables or HTML elements."""
    return " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace("|", "\\|")


def _facts(
    entry: Mapping[str, Any], manifest: Mapping[str, Any], policy: Mapping[str, Any], persona: Persona
) -> Iterator[tuple[str, str]]:
    yield "player", policy["player"]
    if policy.get("selected"):
        yield "the same policy as", f"`{policy['selected']}`, chosen by a selection (`selections.csv`)"
    yield "persona", f"`{persona.name}`"
    if policy.get("learned_in"):
        personas = ", ".join(f"`{each}`" for each in policy["learned_with"])
        yield "learned in", f"`{policy['learned_in']}`, one network of {personas}"
    yield from _training_facts(entry, manifest, policy)
    if persona.attention is not None and policy.get("attentive_share"):  # an older card does not say it
        yield "no lapses in", f"the first {percent(policy['attentive_share'])} of the budget"


def _training_facts(
    entry: Mapping[str, Any], manifest: Mapping[str, Any], policy: Mapping[str, Any]
) -> Iterator[tuple[str, str]]:
    campaign = campaign_in(manifest)
    against = policy["against"]
    yield "scene", f"`{policy['scene']}`"
    if roads := policy.get("roads"):
        yield "and in equal parts on the roads", ", ".join(f"`{each}`" for each in roads)
    partner = {None: "no other player", "sumo": "SUMO's own driver", "given": _given(manifest, campaign)}
    yield "against", partner.get(against, f"`{against}`")
    if isinstance(people := policy.get("people"), int) and against is not None:
        yield "people in a game", str(people)
    if against is not None and policy.get("alone_share") is not None:
        yield "games without the other player", percent(policy["alone_share"])
    yield "initial policy", f"`{policy['began_from']}`" if policy["began_from"] else _beginning(policy["training"])
    reason = {"converged": "stopped by convergence", "budget": "the whole budget"}.get(entry["stopped"], "")
    reason = stopped(entry) if entry["stopped"] == DID_NOT_LEARN else reason
    yield "trained for", f"{entry['steps']:,} of at most {entry['budget_steps']:,} steps: {reason}"
    if entry.get("rule"):
        yield "convergence", entry["rule"]
    yield "training seed", str(entry["seed"])


def _beginning(settings: Mapping[str, Any]) -> str:
    shown = settings["demonstration_steps"]
    return f"none; it imitated a rule-based driver, shown in {shown:,} steps" if shown else "none"


def _given(manifest: Mapping[str, Any], campaign: Campaign) -> str:
    recorded = manifest.get("ego_driver")
    return str(recorded["in_words"]) if recorded else f"the policy `{campaign.ego.driver}`"


def _terms(profile: PersonaProfile) -> Iterator[Mapping[str, str]]:
    for each in profile.terms:
        counts = "per second" if TERMS[each.name].per_second else "per event"
        meaning = ", ".join(filter(None, (each.meaning, each.limit)))
        row = {"group": each.group, "name": each.name, "counts": counts, "meaning": meaning}
        yield {**row, "weight": f"{each.weight:g}"}
    for fuzzy in profile.persona.human.fuzzy:
        sets = "; ".join(
            f"{one.name} ({', '.join(f'{x:g}: {y:g}' for x, y in one.points)}) has the value {one.value:g}"
            for one in fuzzy.sets
        )
        meaning = f"fuzzy, of `{fuzzy.quantity}`: {sets}"
        row = {"group": "human", "name": fuzzy.name, "counts": "per second", "meaning": meaning}
        yield {**row, "weight": f"{fuzzy.weight:g}"}


def _figures(
    stage: str, manifest: Mapping[str, Any], summary: pd.DataFrame, is_ego: bool
) -> Iterator[tuple[str, Sequence[str]]]:
    seed = manifest["stages"][stage]["seed"]
    rows = {row["arm"]: row for row in summary[summary["seed"] == seed].to_dict("records")}
    for arm in planned(manifest):
        if not isinstance(arm, AssessmentStage) or arm.seed != seed or arm.name not in rows:
            continue
        side = arm.ego if is_ego else arm.non_ego
        if [each.stage for each in side if isinstance(each, Trained)] == [stage]:
            yield arm.name, _cells(rows[arm.name], is_ego)


def _cells(row: Mapping[Any, Any], is_ego: bool) -> Sequence[str]:
    rate, speed = ("failure_rate", "mean_speed") if is_ego else ("non_ego_goal_rate", "non_ego_mean_speed")
    low, high = (number(row.get(f"{speed}_{end}_mps", math.nan), 2) for end in ("low", "high"))
    return (
        str(row["episodes"] - row["errors"]),
        _with(percent(row[rate]), interval(row[f"{rate}_low"], row[f"{rate}_high"])),
        _with(number(row[f"{speed}_mps"], 2), MISSING if low == MISSING else f"{low}–{high}"),
    )


def _with(value: str, span: str) -> str:
    """A value with its interval; empty where it can't be measured."""
    if value == MISSING:
        return ""
    return value if span == MISSING else f"{value} ({span})"


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return f"{value:,}" if isinstance(value, int) else str(value)
