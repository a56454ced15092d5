"""A driver that somebody brings: a TOML file with its `kind`, and what that kind needs to know.

Paths in it are relative to the document's own folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, get_args

from pydantic import ConfigDict, Field, field_validator

from harness.config.campaign import DocumentPath
from harness.config.rule_driver import Rules
from harness.config.toml_reading import Document, nearest, read_document
from harness.config.tunable import Adjustable, ParameterName
from harness.errors import UsageError
from harness.game.observation import LAYOUT

OUTPUTS = ("acceleration_mps2", "steering_rad")
"""What a driver that thinks in units asks of its car."""

Argument = Annotated[str, Field(max_length=2000, pattern=r"^[^\x00]*$")]
VariableName = Annotated[str, Field(min_length=1, max_length=200)]
DeadlineS = Annotated[float, Field(gt=0.0, le=600.0)]


class Sumo(Document):
    """SUMO's own models, as a vehicle type of the scene's route file sets them."""

    kind: Literal["sumo"]
    """Which kind of driver this is: what the other keys are goes by it."""
    vehicle_type: Annotated[str, Field(min_length=1, max_length=200)]
    """The id of a `vType`: the ego is a car of this type, its size and top speed included."""


class Process(Adjustable):
    """A program in any language, which answers observations with controls: docs/egos.md has the protocol."""

    parameter_table: ClassVar[str] = "parameters"

    kind: Literal["process"]
    """Which kind of driver this is: what the other keys are goes by it."""
    command: list[Argument] = Field(min_length=1, max_length=100)
    """The program and its arguments. It is run in `folder`; a name without `/` is looked for on PATH."""
    folder: DocumentPath = "."
    """Where the program is run, from this document's folder; the paths of its files are from there, too."""
    files: list[DocumentPath] = Field([], max_length=1000)
    """Further files its decisions depend on: when one changes, the games are played again. Arguments that are files
    count anyway."""
    units: Literal["si", "scaled"] = "si"
    """`si`: it sees metres, seconds and radians, and asks for acceleration_mps2 and steering_rad. `scaled`: it sees
    and acts as learned policies do, in -1 to 1."""
    deadline_s: DeadlineS = 10.0
    """How long a decision may take. Not how quick it has to be: a busy machine must not change what comes of a game."""
    start_deadline_s: DeadlineS = 20.0
    """How long it may take to start."""
    parameters: dict[ParameterName, bool | int | float | str] = Field({}, max_length=1000)
    """What the program is told under `parameters` when it is greeted."""


class Fmu(Adjustable):
    """A digital twin: an FMI 2.0 or 3.0 co-simulation FMU, stepped once per decision."""

    parameter_table: ClassVar[str] = "start"

    kind: Literal["fmu"]
    """Which kind of driver this is: what the other keys are goes by it."""
    file: DocumentPath
    """The FMU, from this document's folder."""
    inputs: dict[VariableName, str] = Field({}, max_length=200)
    """What each input of the FMU is given: an entry of the observation. An input that is not here has to be called
    like an entry."""
    outputs: dict[str, VariableName] = Field({}, max_length=2)
    """Which output of the FMU is `acceleration_mps2` and which `steering_rad`, where they are called otherwise."""
    start: dict[VariableName, float] = Field({}, max_length=1000)
    """Start values: of parameters, and of inputs that nothing is given to."""
    deadline_s: DeadlineS = 10.0
    """How long a decision may take. Not how quick it has to be: a busy machine must not change what comes of a game."""
    start_deadline_s: DeadlineS = 60.0
    """How long it may take to load and to initialise."""

    @field_validator("inputs")
    @classmethod
    def _entries(cls, inputs: dict[str, str]) -> dict[str, str]:
        for entry in inputs.values():
            if entry not in LAYOUT:
                raise ValueError(f"there is no entry {entry!r} in what a driver sees: {nearest(entry, LAYOUT)}")
        return inputs

    @field_validator("outputs")
    @classmethod
    def _asked(cls, outputs: dict[str, str]) -> dict[str, str]:
        for name in outputs:
            if name not in OUTPUTS:
                raise ValueError(f"there is no control {name!r}: {nearest(name, OUTPUTS)}")
        return outputs


class StableBaselines3(Document):
    """A policy that Stable-Baselines3 saved, trained on `harness/Ego-v0` or an environment with its spaces."""

    kind: Literal["stable_baselines3"]
    """Which kind of driver this is: what the other keys are goes by it."""
    file: DocumentPath
    """The `.zip` that Stable-Baselines3 saved, from this document's folder."""
    algorithm: Literal["PPO", "A2C", "SAC", "TD3"]
    """Which of its algorithms saved it."""


class Python(Adjustable):
    """An installed Python package's entry point of the group `harness.drivers`, with arguments."""

    parameter_table: ClassVar[str] = "parameters"

    kind: Literal["python"]
    """Which kind of driver this is: what the other keys are goes by it."""
    entry_point: Annotated[str, Field(min_length=1, max_length=200)]
    """The entry point's name, as the package declares it."""
    parameters: dict[str, Any] = Field({}, max_length=1000)
    """Keyword arguments of the entry point."""


DriverDocument: TypeAlias = Sumo | Rules | Process | Fmu | StableBaselines3 | Python

KINDS: dict[str, type[Document]] = {
    get_args(model.model_fields["kind"].annotation)[0]: model for model in get_args(DriverDocument)
}


class _Kind(Document):
    model_config = ConfigDict(extra="ignore")
    kind: str


def read_driver(path: Path) -> DriverDocument:
    """Read a driver document. Raises UsageError with every problem found in it."""
    kind = read_document(path, _Kind).kind
    if kind not in KINDS:
        raise UsageError.of(path, "kind", f"there is no kind of driver {kind!r}", nearest(kind, KINDS))
    return read_document(path, KINDS[kind])  # type: ignore[return-value]
