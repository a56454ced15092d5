"""`harness persona check`: a source that is no evidence is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.cli.persona_check import check_persona
from harness.cli.persona_template import create_persona
from harness.config.toml_reading import tomllib
from harness.errors import UsageError
from tests.support.repository import REPOSITORY


def refusal(file: Path) -> str:
    with pytest.raises(UsageError) as caught:
        check_persona(file)
    return str(caught.value)


@pytest.mark.parametrize("file", sorted((REPOSITORY / "personas").glob("*.toml")), ids=lambda file: file.stem)
def test_check__every_shipped_persona_has_evidence(file: Path) -> None:
    assert check_persona(file).name == file.stem


def test_check__the_template_is_refused_until_it_is_filled_in(tmp_path: Path) -> None:
    file = create_persona("late", tmp_path / "late.toml")
    assert [line.split(": ")[1:3] for line in sorted(refusal(file).splitlines())] == [
        ["description", "is the text of the template (describe this driver)"],
        ["sources[0].citation", "is a placeholder (name author, publication and year)"],
        [
            "sources[0].statistic",
            "is a placeholder (say what was counted or measured of such drivers, with the figure)",
        ],
    ]


@pytest.mark.parametrize(
    ("statistic", "citation", "message"),
    [
        ("TODO: find a figure", "Author (2020): Title", "sources[0].statistic: is a placeholder"),
        ("12 % of them are late.", "TBD ...", "sources[0].citation: is a placeholder"),
    ],
)
def test_check__a_source_that_is_no_evidence_is_refused(
    statistic: str, citation: str, message: str, tmp_path: Path
) -> None:
    text = create_persona("late", tmp_path / "late.toml").read_text()
    source = tomllib.loads(text)["sources"][0]
    written = text.replace(source["statistic"], statistic).replace(source["citation"], citation)
    (tmp_path / "late.toml").write_text(written)
    assert message in refusal(tmp_path / "late.toml")
