"""The script behind the table of docs/roads.md: its campaigns, and its table of a small league."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.config.campaign import Campaign
from harness.config.toml_reading import read_document
from harness.evaluation.tables import read_csv, table_of, write_csv
from tests.support.repository import REPOSITORY
from tests.support.scripts import script

roads = script("roads/held_out.py")

ROW = read_csv(REPOSITORY / "reports" / "roads" / "merge-learned-on-one-road" / "league.csv").to_dict("records")[0]
"""A row of a league: what the table does not show stays as it is."""


@pytest.mark.parametrize("words", roads.LEARNS_ON)
def test_campaigns__are_of_an_ego_that_learns_alone_on_one_road_or_nine(words: str, tmp_path: Path) -> None:
    file = tmp_path / "campaign.toml"
    file.write_text(roads.campaign_of("merge", words), encoding="utf-8")
    campaign = read_document(file, Campaign)
    assert (campaign.name, campaign.personas, campaign.seeds) == (f"merge-{words}", [], [roads.SEED])
    learned = [f"learned/merge_road{seed}" for seed in roads.LEARNED]
    assert [str(each) for each in campaign.roads] == (learned if words == "nine-roads" else [])


def test_rows__beside_others_are_of_the_roads_that_the_ego_drives_alone(tmp_path: Path) -> None:
    """The ego fails on the second of three roads alone, and on the third beside SUMO's driver."""
    rates = {"nobody": (0.0, 0.25, 0.0), "sumo": (0.0, 1.0, 0.05)}
    rows = [
        ROW | {"scene": f"merge_road{number}", "person": person, "episodes": 20, "failure_rate": rate}
        for person, of_person in rates.items()
        for number, rate in enumerate(of_person)
    ]
    folder = tmp_path / "merge-learned-on-one-road"
    folder.mkdir()
    write_csv(table_of("league", rows), folder / "league.csv")
    alone, beside = roads.rows_of(tmp_path, "merge", "one-road")
    assert alone == ["merge", "one-road", "nobody", "3", "60", "8.3% (2.8% to 18.4%)", "1", "5 of 20"]
    assert beside == ["merge", "one-road", "sumo", "2", "40", "2.5% (0.1% to 13.2%)", "1", "1 of 20"]
