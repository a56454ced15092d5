"""What a node of a Ray cluster answers when it is checked, and what it is refused for. No Ray is needed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from harness.campaign.execution.ray_nodes import Node, NodeAnswer, answer_of_node, problem_of, token_file
from harness.campaign.execution.run_context import RunContext
from harness.campaign.storage.run_folder import RunFolder
from harness.files import make_folder
from tests.support.plans import empty_context

NODE = Node(id="7f", name="10.0.0.7", cpus=4)
TOKEN = "4711 1"


@pytest.fixture
def context(tmp_path: Path) -> RunContext:
    """The context of a run whose command has written its token."""
    folder = RunFolder(tmp_path / "run")
    folder.claim("checked")
    make_folder(token_file(folder.path).parent)
    token_file(folder.path).write_text(TOKEN)
    return empty_context(folder.path)


def answer(context: RunContext, *files: Path) -> NodeAnswer:
    """The answer of a node that is this process, while the command is running."""
    with RunFolder(context.folder).held():
        make_folder(token_file(context.folder).parent)
        token_file(context.folder).write_text(TOKEN)
        return answer_of_node(context.folder, files)


def refusal(answer: NodeAnswer, context: RunContext) -> str:
    problem = problem_of(NODE, answer, context, TOKEN)
    assert problem is not None
    return str(problem)


def test_node__that_sees_the_run_folder_and_has_the_versions_fits(context: RunContext) -> None:
    assert problem_of(NODE, answer(context, context.folder), context, TOKEN) is None


def test_node__with_another_folder_under_the_path_is_refused(context: RunContext, tmp_path: Path) -> None:
    """An empty folder, as an unmounted one is; and one with the token of another run."""
    expected = f"--ray: node 10.0.0.7: does not see the run folder {context.folder} (use a folder that all nodes share "
    elsewhere = replace(answer(context), token=answer_of_node(tmp_path / "empty", ()).token)
    assert refusal(elsewhere, context).startswith(expected)
    assert refusal(replace(answer(context), token="4711 2"), context).startswith(expected)


def test_node__without_a_file_of_the_campaign_is_refused(context: RunContext) -> None:
    assert "does not see /policies/merge (" in refusal(answer(context, Path("/policies/merge")), context)


def test_node__that_finds_the_lock_free_is_refused(context: RunContext) -> None:
    """As on a file system whose locks hold on one machine only: the command is running, and the lock is not held."""
    free = answer_of_node(context.folder, ())
    assert free.token == TOKEN
    assert f"the lock of the run folder {context.folder} does not hold there (mount " in refusal(free, context)


def test_node__with_other_versions_is_refused_with_each_of_them(context: RunContext) -> None:
    here = answer(context)
    other = replace(here, versions={**here.versions, "torch": "1.0", "libsumo": "1.27.0"})
    text = refusal(other, context)
    assert f"libsumo 1.27.0, here {here.versions['libsumo']}; torch 1.0, here {here.versions['torch']}" in text
    assert "numpy" not in text
