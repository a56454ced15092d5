"""The shipped people of a scene: the policies in `policies/<scene>/` of players other than the ego, one for each person
or one of several persons (`drivers.policy_of_many`). Their personas are the shipped ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from harness.campaign.trained_policies import learned_by_another
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import Member
from harness.drivers.policy_file import LearnedDriver, Policy, policy_files, read_card, read_policy
from harness.drivers.policy_of_many import as_persona, personas_in, read_policy_of_many
from harness.errors import UsageError
from harness.evaluation.strategies import name_and_seed
from harness.game.roles import EGO, ROLES
from harness.shipped_documents import shipped


@dataclass(frozen=True, kw_only=True)
class People:
    """Persons of a scene who learned with the same training seeds."""

    personas: list[str]
    seeds: list[int]
    together: bool
    """Whether there is one policy of all of them for each seed."""


def people_of(scene: Path) -> list[People]:
    seeds: dict[tuple[str, bool], list[int]] = {}
    for person, together, seed, _ in _policies(scene):
        seeds.setdefault((person, together), []).append(seed)
    groups: dict[tuple[tuple[int, ...], bool], list[str]] = {}
    for (person, together), of_person in seeds.items():
        groups.setdefault((tuple(sorted(of_person)), together), []).append(person)
    return [
        People(personas=personas, seeds=list(own), together=together) for (own, together), personas in groups.items()
    ]


def _policies(scene: Path) -> Iterator[tuple[str, bool, int, Path]]:
    """Each person of each policy of a scene: its name, whether it learned together with others, the seed, the folder of
    the policy."""
    folder = shipped("policies") / scene.name
    if scene != shipped("networks").resolve() / scene.name or not folder.is_dir():
        return
    for policy in sorted(folder.iterdir()):
        name, seed = name_and_seed(policy.name)
        if seed is not None and policy.is_dir():
            card = read_card(policy)
            several = personas_in(card)
            for person in several or ([name] if card.get("player") != ROLES[EGO] else []):
                yield person, bool(several), seed, policy


@dataclass(frozen=True, kw_only=True)
class ShippedPerson:
    """A person of a scene, who learned in one or more trainings."""

    persona: Persona
    file: Path
    """The persona's document."""
    folders: tuple[Path, ...]
    """The folder of a policy for each training."""

    @property
    def files(self) -> tuple[Path, ...]:
        """What its driving depends on."""
        return self.file, *(file for folder in self.folders for file in policy_files(folder))

    def without(self, number: int) -> tuple[Path, ...]:
        """The folders but for that of one training, counted from 0 and from the first again; of one training, this."""
        left_out = number % len(self.folders)
        return tuple(each for k, each in enumerate(self.folders) if k != left_out) or self.folders

    def members(self, without: int, share: float) -> list[Member]:
        """The person as members of a mixture, one for each training that is not left out (`without`), which have this
        share of the games together. Raises UsageError as `policy`."""
        folders, sampled = self.without(without), self.persona.decisions == "sampled"
        return [
            Member(driver=LearnedDriver(self.policy(each), sampled), persona=self.persona, share=share / len(folders))
            for each in folders
        ]

    def policy(self, folder: Path) -> Policy:
        """The policy in one of the folders. Raises UsageError if it can't be read, or learned as another persona."""
        name = self.persona.name
        several = personas_in(read_card(folder))
        policy = as_persona(read_policy_of_many(folder), name) if several else read_policy(folder)
        sha256 = several[name] if several else policy.card.get("persona_sha256")
        if message := learned_by_another(name, sha256, self.persona, "the shipped"):
            raise UsageError.of(folder, "persona_sha256", message, "train it again")
        return policy


def shipped_people(scene: Path) -> tuple[ShippedPerson, ...]:
    """The shipped people of a scene with their personas. Raises UsageError if a document or policy is missing or
    wrong."""
    folders: dict[str, list[Path]] = {}
    for name, _, _, folder in sorted(_policies(scene)):
        folders.setdefault(name, []).append(folder)
    people = []
    for name, own in folders.items():
        file = shipped("personas").resolve() / f"{name}.toml"
        person = ShippedPerson(persona=read_document(file, Persona), file=file, folders=tuple(own))
        for folder in own:
            person.policy(folder)
        people.append(person)
    return tuple(people)
