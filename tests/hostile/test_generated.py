"""Documents that Hypothesis made of good ones: in order or refused, never a traceback, never anything else."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.scene import Scene
from harness.config.toml_reading import Document, read_document, tomllib
from harness.drivers.policy_file import read_policy, write_policy
from harness.errors import UsageError
from harness.road.net.tiles import Copies, tiles_of
from harness.road.scene.open_scene import open_scene
from tests.hostile.inputs import CAMPAIGN_TEXT, NET, PERSONA_TEXT, ROUTES, SCENE, write_project
from tests.support.policies import some_policy
from tests.support.repository import REPOSITORY

SCENE_TEXT = (REPOSITORY / "tests" / "data" / "merge" / "scene.toml").read_text(encoding="utf-8")
TEXTS = {Campaign: CAMPAIGN_TEXT, Persona: PERSONA_TEXT, Scene: SCENE_TEXT}

same_again = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck), database=None
)
odd_numbers = st.one_of(st.integers(), st.floats(), st.integers(10**300, 10**310), st.sampled_from([1e308, -1e-308]))
odd_values = st.recursive(
    st.one_of(st.none(), st.booleans(), odd_numbers, st.text(max_size=20)),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=8), inner, max_size=3)),
    max_leaves=5,
)


def places(value: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The ways to everything in a document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    found = [place for key, each in inner for place in places(each, (*above, key))]
    return [above, *found] if above else found


def replaced(document: Any, place: tuple[Any, ...], value: Any) -> None:
    for key in place[:-1]:
        document = document[key]
    document[place[-1]] = value


def written(value: Any) -> str:
    """A value as TOML, as far as it can be; what can't be is written all the same."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {written(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)


def in_order_or_refused(action: Any, *names: str) -> None:
    """Whatever else an action raises fails the test."""
    try:
        action()
    except UsageError as error:
        for problem in error.problems:
            assert any(name in problem.file for name in names), problem
            assert problem.message
            assert str(problem).isprintable()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_project(tmp_path_factory.mktemp("generated"))


@pytest.mark.parametrize("model", TEXTS)
@same_again
@given(data=st.data())
def test_document__with_an_odd_value_somewhere(model: type[Document], folder: Path, data: st.DataObject) -> None:
    document = tomllib.loads(TEXTS[model])
    replaced(document, data.draw(st.sampled_from(places(document))), data.draw(odd_values))
    file = folder / "odd.toml"
    file.write_text("\n".join(f"{json.dumps(k)} = {written(v)}" for k, v in document.items()), "utf-8", "replace")
    in_order_or_refused(lambda: read_document(file, model), "odd.toml")


@pytest.mark.parametrize("model", TEXTS)
@same_again
@given(data=st.data())
def test_document__with_odd_bytes_somewhere(model: type[Document], folder: Path, data: st.DataObject) -> None:
    file = folder / "odd.toml"
    file.write_bytes(_damaged(TEXTS[model].encode(), data))
    in_order_or_refused(lambda: read_document(file, model), "odd.toml")


@pytest.mark.parametrize("name", [SCENE, NET, ROUTES])
@same_again
@given(data=st.data())
def test_scene__with_odd_bytes_somewhere(name: str, folder: Path, data: st.DataObject) -> None:
    sound = (REPOSITORY / "tests" / "data" / "merge" / Path(name).name).read_bytes()
    scene = (folder / name).parent
    (folder / name).write_bytes(_damaged(sound, data))
    try:
        in_order_or_refused(lambda: tiles_of([Copies(open_scene(scene).net_file, 2)]), "networks/road")
    finally:
        (folder / name).write_bytes(sound)


@same_again
@given(data=st.data())
def test_scene__with_an_odd_attribute_somewhere(folder: Path, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from([NET, ROUTES]))
    sound = (folder / name).read_text(encoding="utf-8")
    body = sound.index("<net" if name == NET else "<routes")
    pieces = sound[body:].split('"')
    k = 2 * data.draw(st.integers(0, len(pieces) // 2 - 1)) + 1
    other = 2 * data.draw(st.integers(0, len(pieces) // 2 - 1)) + 1
    odd = st.one_of(st.just(pieces[other]), odd_numbers.map(str), st.text("abc019.-:_ ,\u00e9\u202e", max_size=12))
    pieces[k] = data.draw(odd)
    (folder / name).write_text(sound[:body] + '"'.join(pieces), encoding="utf-8")
    try:
        in_order_or_refused(lambda: open_scene((folder / name).parent), "networks/road")
    finally:
        (folder / name).write_text(sound, encoding="utf-8")


@same_again
@given(data=st.data())
def test_policy__with_odd_bytes_somewhere(folder: Path, data: st.DataObject) -> None:
    policy = folder / "policies" / "odd"
    write_policy(some_policy(), policy)
    file = policy / data.draw(st.sampled_from(["policy.json", "policy.safetensors"]))
    file.write_bytes(_damaged(file.read_bytes(), data))
    in_order_or_refused(lambda: read_policy(policy), "policies/odd")


@same_again
@given(data=st.data())
def test_manifest__with_an_odd_value_somewhere(folder: Path, data: st.DataObject) -> None:
    manifest = json.loads((REPOSITORY / "reports" / "merge" / "manifest.json").read_text(encoding="utf-8"))
    replaced(manifest, data.draw(st.sampled_from(places(manifest))), data.draw(odd_values))
    run = folder / "run"
    shutil.rmtree(run, ignore_errors=True)
    (run / ".stages" / "naive-seed1").mkdir(parents=True)
    RunFolder(run).write_manifest(manifest)
    files = ("run/manifest.json", "done.json")  # the stages have no files here: those that are done are named
    in_order_or_refused(lambda: RunFolder(run).check_whole(RunFolder(run).manifest()), *files)


def _damaged(sound: bytes, data: st.DataObject) -> bytes:
    """Bytes of which some are cut out, doubled or replaced."""
    first = data.draw(st.integers(0, len(sound)))
    last = data.draw(st.integers(first, min(first + 40, len(sound))))
    odd = st.one_of(
        st.binary(max_size=8), st.just(sound[first:last] * 2), st.sampled_from([b"", b"<", b"&", b'"', b"\0"])
    )
    return sound[:first] + data.draw(odd) + sound[last:]
