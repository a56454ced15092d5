"""The people of a scene with several, as a stage needs them: who drives in each place, and where a person learns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from harness.campaign.plan.planned_drivers import Crowd, PlannedDriver, SumoDriven, persona_of
from harness.campaign.plan.stages import TrainingStage
from harness.drivers.mixture import Mixture, mixture_of
from harness.game.roles import EGO

if TYPE_CHECKING:
    from harness.campaign.execution.player_factory import PlayerFactory
    from harness.training.training_games import LearningPlace


def people_of(planned: PlannedDriver | None, players: PlayerFactory, people: int) -> tuple[Mixture | None, ...]:
    """Each person's drivers: its member of a crowd; any other driver drives in every place, each time made anew.

    Raises as `PlayerFactory.player` does.
    """
    members = planned.members if isinstance(planned, Crowd) else (planned,) * people
    return tuple(_mixture(each, players) for each in members)


def learning_places(stage: TrainingStage, players: PlayerFactory, people: int) -> tuple[LearningPlace, ...]:
    """Where the learner of a training drives. An ego has one place. A person learns in every place in turn: the others
    are driven by SUMO, which no persona has trained.

    Raises as `PlayerFactory.player` does.
    """
    from harness.training.training_games import LearningPlace

    if stage.learner == EGO:
        return (LearningPlace(learner=EGO, drivers=(None, *people_of(stage.opponent, players, people))),)
    places = []
    for learner in range(1, 1 + people):
        ego = _mixture(stage.opponent, players)
        others = people_of(SumoDriven(), players, people)
        drivers = [ego, *others]
        drivers[learner] = None
        places.append(LearningPlace(learner=learner, drivers=tuple(drivers)))
    return tuple(places)


def _mixture(planned: PlannedDriver | None, players: PlayerFactory) -> Mixture | None:
    player = players.player(planned)
    if player is None or planned is None:
        return None
    return mixture_of(player, players.context.persona(persona_of(planned)))
