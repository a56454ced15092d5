"""The traits of persons: complete, compared and exchanged."""

from __future__ import annotations

from collections import Counter

import pytest

from harness.config.persona import Perception, Persona
from harness.config.toml_reading import read_document
from harness.config.traits import NO_TRAIT, PAYOFF, TRAITS, differing_traits, traits_of, with_trait_of
from tests.support.repository import REPOSITORY
from tests.support.tiny import CAREFUL, SPEEDY, TEXTING

TWO_KEYS_AT_ONCE = ("perception",)
"""Tables of which each key is in a trait by itself."""


def person(name: str) -> Persona:
    return read_document(REPOSITORY / "personas" / f"{name}.toml", Persona)


def test_traits__each_key_of_a_persona_is_in_one_trait_or_in_none_on_purpose() -> None:
    of_tables = {f"perception.{name}" for name in Perception.model_fields}
    keys = ({*Persona.model_fields} - {*TWO_KEYS_AT_ONCE}) | of_tables
    counts = Counter([*NO_TRAIT, *(key for trait in TRAITS.values() for key in trait.keys)])
    assert counts == dict.fromkeys(keys, 1)


@pytest.mark.parametrize(
    ("name", "traits"),
    [
        ("careful", ()),
        ("speedy", ("payoff", "shoulder_glance")),
        ("paper_speedy", ("payoff", "decisions", "shoulder_glance")),
        ("texting", ("payoff", "attention")),
    ],
)
def test_differing__are_the_traits_with_another_value(name: str, traits: tuple[str, ...]) -> None:
    assert differing_traits(person(name), person("careful")) == traits


def test_differing__every_shipped_persona_differs_in_the_traits_that_its_document_names() -> None:
    careful = person("careful")
    impaired = differing_traits(person("impaired"), careful)
    assert {"attention", "reaction", "noticing", "estimation"} <= set(impaired)


def test_exchange__changes_the_keys_of_the_trait_and_no_other() -> None:
    careful = person("careful")
    for name in ("speedy", "texting", "impaired"):
        persona = person(name)
        for trait in TRAITS:
            changed = with_trait_of(persona, trait, careful)
            assert differing_traits(changed, persona) == tuple({trait} & {*differing_traits(persona, careful)})
            assert trait not in differing_traits(changed, careful)
            assert [getattr(changed, key) for key in NO_TRAIT] == [getattr(persona, key) for key in NO_TRAIT]
            assert Persona.from_record(changed.record()) == changed


def test_exchange__of_all_traits_makes_the_other_person() -> None:
    persona, careful = person("impaired"), person("careful")
    for trait in differing_traits(persona, careful):
        persona = with_trait_of(persona, trait, careful)
    assert differing_traits(persona, careful) == ()
    assert persona.payoff == careful.payoff
    assert persona.human_factors == careful.human_factors


def test_exchange__with_nobody_takes_a_trait_away() -> None:
    texting = person("texting")
    assert texting.attention is not None
    assert with_trait_of(texting, "attention", None) == texting.model_copy(update={"attention": None})


def test_traits_of__names_who_lapses_and_what_differs() -> None:
    people = [read_document(file, Persona) for file in (SPEEDY, TEXTING, CAREFUL)]
    without, found = traits_of(people, None), traits_of(people, people[2])
    assert (without.lapsing, without.baseline, without.differing) == (("texting",), "", {})
    assert (found.lapsing, found.baseline) == (("texting",), "careful")
    assert list(found.differing) == ["speedy", "texting"]
    assert all(PAYOFF in traits for traits in found.differing.values())
