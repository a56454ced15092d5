"""The picture of all failing paths over one another."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from harness.reports.failing_paths import FailingPath, paths_figures, worst_figures
from tests.support.pages import drawn_with
from tests.support.recorded import SCENE

LABELS = {"naive_vs_speedy": "naive ego, against speedy", "retrained_vs_speedy": "retrained ego, against speedy"}


def path(arm="naive_vs_speedy", contact_m=(20.0, 0.0)):
    players = {"ego": np.array([[0.0, 0.0], [20.0, 0.0]]), "non_ego": np.array([[0.0, 3.0], [20.0, 1.0]])}
    return FailingPath(arm=arm, persona="speedy", players=players, contact_m=contact_m)


def pictures(paths, **failures):
    return list(paths_figures(paths, SCENE, LABELS, dict.fromkeys(LABELS, 0) | failures, "paths"))


def test_picture__has_each_path_and_contact_on_the_road_in_the_colours_of_the_page():
    ((title, picture),) = pictures([path(), path(), path(contact_m=None)], naive_vs_speedy=3)
    assert title == "The naive ego, against speedy: all 3 failures"
    for colour in ("asphalt", "ego", "non-ego", "contact"):
        assert f"var(--{colour})" in picture
    assert drawn_with("stroke:var(--ego)", picture) == 3
    assert len(re.findall(r"<use [^>]*", picture)) == 2  # a contact each, but of the one that touches nothing
    assert "#0101" not in picture  # no stand-in is left


def test_picture__says_how_many_of_the_failures_it_has():
    (naive, retrained) = pictures([path(), path("retrained_vs_speedy")], naive_vs_speedy=70, retrained_vs_speedy=1)
    assert naive[0] == "The naive ego, against speedy: 1 of 70 failures"
    assert retrained[0] == "The retrained ego, against speedy: the only failure"


def test_worst__are_a_picture_each_with_the_cause():
    paths = [replace(path(), episode=episode, seed=2) for episode in (5, 3, 8, 1)]
    found = list(worst_figures(paths, SCENE, {"naive_vs_speedy,2,5": "cuts in"}, several_seeds=True))
    assert [title for title, _ in found] == [
        "naive_vs_speedy, seed 2, game 5: cuts in",
        "naive_vs_speedy, seed 2, game 3",
        "naive_vs_speedy, seed 2, game 8",
    ]
    assert all("var(--ego)" in picture for _, picture in found)


def test_picture__an_arm_without_a_failure_has_none():
    assert pictures([]) == []
