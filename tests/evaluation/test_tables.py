from __future__ import annotations

import gzip
import json
import math

import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy import stats

from harness.errors import UsageError
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.tables import joined, read_csv, rows_in_json, table_of, typed, write_csv

WHOLE = st.integers(-(2**62), 2**62)
CELLS = {
    "object": st.text('a",\r\n', max_size=4)
    | st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=8),
    "int64": WHOLE,
    "Int64": WHOLE | st.none(),
    "float64": st.floats(),
    "bool": st.booleans(),
}


def game(arm="naive_alone", episode=0, **cells):
    """One row of episodes.csv; what is not named can't be measured."""
    row = {"arm": arm, "persona": "", "seed": 1, "episode": episode, "ego_outcome": "goal", "ego_failed": 0}
    row |= {"non_ego_outcome": "", "error": ""}
    return row | cells


def episodes_of(*games):
    return table_of("episodes", games)


@st.composite
def tables(draw):
    columns = draw(st.sampled_from(list(TABLES.values())))
    count = draw(st.integers(0, 4))
    return typed(
        pd.DataFrame(
            {
                name: pd.Series(draw(st.lists(CELLS[column.dtype], min_size=count, max_size=count)), dtype=object)
                for name, column in columns.items()
            }
        )
    )


def test_summarise__agrees_with_the_arithmetic_on_paper():
    (row,) = summarise(
        episodes_of(
            game(episode=0, ego_mean_speed_mps=20.0, ego_min_ttc_s=3.0, ego_payoff=1.0),
            game(episode=1, ego_mean_speed_mps=22.0, ego_min_ttc_s=5.0, ego_payoff=2.0),
            game(episode=2, ego_outcome="collision", ego_failed=1, ego_mean_speed_mps=15.0, ego_payoff=-6.0),
            game(episode=3, ego_outcome="error", ego_failed=None, error="the simulator died", ego_payoff=99.0),
        )
    ).to_dict("records")
    assert (row["episodes"], row["errors"]) == (4, 1)
    assert row["failure_rate"] == 1 / 3
    # Clopper-Pearson for 1 of 3: low solves P(X >= 1) = 1 - (1 - p)**3 = 0.025;
    # high solves P(X <= 1) = (1 - p)**2 * (1 + 2 p) = 0.025
    assert row["failure_rate_low"] == pytest.approx(1 - 0.975 ** (1 / 3))
    high = row["failure_rate_high"]
    assert (1 - high) ** 2 * (1 + 2 * high) == pytest.approx(0.025)
    assert (row["collisions"], row["rails"], row["timeouts"]) == (1, 0, 0)
    # speeds 20, 22, 15: mean 19, variance (1 + 9 + 16) / 2 = 13; t quantile for 2 degrees of freedom 4.302653
    assert row["mean_speed_mps"] == 19
    assert row["mean_speed_low_mps"] == pytest.approx(19 - 4.302653 * math.sqrt(13 / 3), abs=1e-5)
    assert row["mean_speed_high_mps"] == pytest.approx(19 + 4.302653 * math.sqrt(13 / 3), abs=1e-5)
    assert row["min_ttc_s"] == 4  # of the two games in which there was one
    assert row["ego_payoff"] == -1  # the errored game's number is not in it
    assert math.isnan(row["trailing_distance_m"])


def test_summarise__near_misses_are_a_share_of_the_games_in_which_they_could_be_measured():
    marks = (1, 0, None, 1, 0)
    near = [{f"near_miss{end}": mark for end in ("", "_ttc")} for mark in marks]
    row = summarise(episodes_of(*(game(episode=k, **cells) for k, cells in enumerate(near)))).iloc[0]
    assert row["near_misses_by_ttc"] == 2
    assert pd.isna(row["near_misses_by_pet"])
    assert row["near_miss_rate"] == 0.5
    # Clopper-Pearson for 2 of 4, symmetric about a half
    assert row["near_miss_rate_low"] == pytest.approx(1 - row["near_miss_rate_high"])
    assert row["near_miss_rate_high"] == pytest.approx(stats.beta.ppf(0.975, 3, 2))


def test_summarise__arms_are_in_order_of_first_appearance_with_their_seeds():
    table = summarise(
        episodes_of(*(game(arm, seed=seed) for seed in (1, 2) for arm in ("naive_vs_sumo", "naive_alone")))
    )
    found = [f"{row.arm} {row.seed}" for row in table.itertuples()]
    assert found == ["naive_vs_sumo 1", "naive_vs_sumo 2", "naive_alone 1", "naive_alone 2"]


def test_summarise__an_arm_without_ego_has_empty_ego_cells_not_zeros():
    alone = {"persona": "speedy", "ego_outcome": "", "ego_failed": None, "non_ego_outcome": "goal"}
    row = summarise(episodes_of(*(game("speedy_alone", k, **alone) for k in range(2)))).iloc[0]
    assert (row["episodes"], row["errors"], row["non_ego_goal_rate"]) == (2, 0, 1)
    error = {"ego_outcome": "error", "ego_failed": None, "error": "lost"}
    (errored,) = summarise(episodes_of(game(**error))).to_dict("records")
    assert (errored["episodes"], errored["errors"]) == (1, 1)
    for column in ("failure_rate", "failure_rate_high", "collisions", "rails", "timeouts", "mean_speed_mps"):
        assert pd.isna(row[column])
        assert pd.isna(errored[column])


def test_write_csv__writes_exactly_these_bytes(tmp_path):
    path = tmp_path / "episodes.csv"
    rows = (
        game(ego_mean_speed_mps=0.1 + 0.2, duration_s=12.0),
        game(episode=1, ego_outcome="error", ego_failed=None, error='no "lane",\nat all', ego_payoff=-1e-17),
    )
    write_csv(episodes_of(*rows), path)
    shown = {"arm": "naive_alone", "seed": "1", "episode": "0", "ego_outcome": "goal", "ego_failed": "0"}
    shown |= {"ego_mean_speed_mps": "0.30000000000000004", "duration_s": "12.0"}
    error = {"arm": "naive_alone", "seed": "1", "episode": "1", "ego_outcome": "error", "ego_payoff": "-1e-17"}
    error |= {"error": '"no ""lane"",\nat all"'}
    names = [name for name, column in TABLES["episodes"].items() if not column.optional]
    lines = [",".join(row.get(name, "") for name in names) for row in (shown, error)]
    assert path.read_bytes().decode() == "\n".join([",".join(names), *lines, ""])


def test_table__has_an_optional_column_only_where_a_cell_of_it_is_known(tmp_path):
    without, shielded = episodes_of(game()), episodes_of(game("shielded_naive_alone", ego_shielded_share=0.25))
    assert "ego_shielded_share" not in without
    both = joined("episodes", [without, shielded])
    assert both["ego_shielded_share"].isna().tolist() == [True, False]
    assert "ego_shield_interventions_per_km" not in both
    write_csv(both, tmp_path / "episodes.csv")
    assert read_csv(tmp_path / "episodes.csv").equals(both)


def test_training__has_a_column_of_regret_only_where_starts_are_replayed():
    row = {
        "stage": "naive",
        "persona": "",
        "seed": 1,
        "steps": 512,
        "mean_payoff": 1.5,
        "failure_rate": 0.5,
        "games": 2,
        "mean_duration_s": 3.0,
        "stopped": "",
        "mean_regret": None,
    }
    uniform, by_regret = table_of("training", [row]), table_of("training", [row, {**row, "mean_regret": 0.25}])
    assert list(uniform.columns) == [name for name in row if name not in ("mean_regret", "stopped")] + ["stopped"]
    assert by_regret["mean_regret"].isna().tolist() == [True, False]
    assert joined("training", [uniform, by_regret])["mean_regret"].notna().tolist() == [False, False, True]


def test_write_csv__truth_values_are_true_and_false(tmp_path):
    path = tmp_path / "comparisons.csv"
    row = {"question": "RQ1", "persona": "x", "seed": 1, "metric": "failure", "pairs": 2, "pairs_left_out": 0}
    write_csv(table_of("comparisons", [row | {"mean_difference": 0.0, "rejects_h0": False}]), path)
    assert path.read_text().splitlines()[1] == "RQ1,x,1,failure,2,0,0.0,,,,,,,,,false,,,"


def test_write_csv__puts_columns_in_the_order_of_the_table(tmp_path):
    table = episodes_of(game())
    write_csv(table, tmp_path / "one.csv")
    write_csv(table[table.columns[::-1]], tmp_path / "other.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "other.csv").read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": 1.5}, "seed"),
        ({"seed": None}, "seed"),
        ({"arm": 3}, "arm"),
        ({"ego_payoff": "much"}, "ego_payoff"),
        ({"ego_pay_off": 1.0}, r"nearest is episodes: missing \[\], unknown \['ego_pay_off'\]"),
    ],
)
def test_write_csv__refuses_wrong_cells_and_keeps_the_old_file(tmp_path, change, message):
    path = tmp_path / "episodes.csv"
    write_csv(episodes_of(game()), path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=message):
        write_csv(episodes_of(game()).assign(**change), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_write_csv__accepts_a_message_that_is_not_unicode(tmp_path):
    path = tmp_path / "episodes.csv"
    write_csv(episodes_of(game(error="file \udcff")), path)
    assert read_csv(path)["error"].tolist() == ["file \\udcff"]


@given(table=tables())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_read_csv__returns_the_written_table(tmp_path, table):
    path = tmp_path / "table.csv"
    write_csv(table, path)
    again = read_csv(path)
    pd.testing.assert_frame_equal(again, table, check_exact=True)
    first = path.read_bytes()
    write_csv(again, path)
    assert path.read_bytes() == first


def test_read_csv__reads_the_compressed_file_where_the_other_is_missing(tmp_path, monkeypatch):
    rows = table_of("training", [{"stage": "naive", "seed": 1, "steps": 10, "games": 2}] * 100)
    path = tmp_path / "training.csv"
    write_csv(rows, path)
    content = path.read_bytes()
    path.unlink()
    packed = tmp_path / "training.csv.gz"
    packed.write_bytes(gzip.compress(content))
    assert read_csv(path).equals(rows)
    packed.write_bytes(gzip.compress(content)[:-9])
    with pytest.raises(UsageError, match="is not a table of this harness"):
        read_csv(path)
    packed.write_bytes(gzip.compress(content))
    monkeypatch.setattr("harness.evaluation.tables._MOST_BYTES", len(content) - 1)
    with pytest.raises(UsageError, match="it has more than"):
        read_csv(path)


@pytest.mark.parametrize(
    "text", [None, "", "arm,persona\n", "half\n", ",".join(TABLES["training"]) + "\nnaive,,1,100\n"]
)
def test_read_csv__another_file_is_a_usage_error_that_names_it(tmp_path, text):
    path = tmp_path / "training.csv"
    if text is not None:
        path.write_text(text)
    with pytest.raises(UsageError, match=r"training\.csv"):
        read_csv(path)


def test_rows_in_json__empty_and_infinite_cells_are_null() -> None:
    table = pd.DataFrame({"arm": ["a", ""], "games": [3, 4], "rate": [0.1, math.nan], "worst": [-math.inf, 1.0]})
    table["left"] = pd.array([None, 2], dtype="Int64")
    first, second = json.loads(json.dumps(rows_in_json(table), allow_nan=False))
    assert first == {"arm": "a", "games": 3, "rate": 0.1, "worst": None, "left": None}
    assert second == {"arm": "", "games": 4, "rate": None, "worst": 1.0, "left": 2}
