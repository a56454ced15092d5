"""An external driver: a TOML file with a `kind`, and the keys of that kind.

Paths in the document are relative to its folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, get_args

from pydantic import Field

from harness.config.campaign import DocumentPath
from harness.config.rule_driver import Rules
from harness.config.toml_reading import Document, Excerpt, nearest, one_of, read_document
from harness.config.tunable import Adjustable, ParameterName
from harness.errors import UsageError
from harness.game.observation_layout import LAYOUT

OUTPUTS = ("acceleration_mps2", "steering_rad")
"""The outputs of a driver that uses SI units."""

Argument = Annotated[str, Field(max_length=2000, pattern=r"^[^\x00]*$")]
KIND = Field(description="The kind of driver, which determines the other keys.")
VariableName = Annotated[str, Field(min_length=1, max_length=200)]
Entry = Annotated[str, one_of(LAYOUT, "the observation has no entry")]
Control = Annotated[str, one_of(OUTPUTS, "there is no control")]
PedalsAndWheel = Annotated[list[Annotated[float, Field(ge=-1.0, le=1.0)]], Field(min_length=2, max_length=2)]
DeadlineS = Annotated[float, Field(gt=0.0, le=600.0)]


class Sumo(Document):
    """SUMO's own models, as a vehicle type in the route file of the scene configures them."""

    kind: Literal["sumo"] = KIND
    vehicle_type: Annotated[str, Field(min_length=1, max_length=200)]
    """The id of a `vType`. The ego is a car of this type, with its size and top speed."""


class WithFiles(Document):
    """A document of a driver whose decisions depend on files."""

    keys_of_files: ClassVar[tuple[str, ...]] = ()
    """The keys that name one file each."""

    files: list[DocumentPath] = Field([], max_length=1000)
    """Further files that its decisions depend on, relative to this document's folder. When one of them changes, the
    games are played again."""

    @property
    def named_files(self) -> dict[str, str]:
        """The files that keys of the document name, by the key."""
        named = {key: getattr(self, key) for key in self.keys_of_files}
        return {key: file for key, file in named.items() if file is not None}


class Cartesian(Document):
    """The table that asks for the road and the road users in Cartesian coordinates (docs/egos-in-cartesian.md)."""

    history_s: float = Field(0.0, ge=0.0, le=10.0)
    """The length of the history that each view has."""


class Process(Adjustable, WithFiles):
    """A program in any language that answers observations with controls, by the protocol of
    docs/egos-by-programs.md."""

    parameter_table: ClassVar[str] = "parameters"

    kind: Literal["process"] = KIND
    command: list[Argument] = Field(min_length=1, max_length=100)
    """The program and its arguments. It runs in `folder`; a name without `/` is searched on PATH."""
    folder: DocumentPath = "."
    """The working folder of the program, relative to this document's folder. Arguments that are files are relative to
    it, and always among the files that its decisions depend on."""
    units: Literal["si", "scaled"] = "si"
    """`si`: observations in metres, seconds and radians; outputs acceleration_mps2 and steering_rad. `scaled`:
    observations and actions of learned policies, in -1 to 1."""
    deadline_s: DeadlineS = 10.0
    """Longest time of a decision. It only detects programs that hang: a busy machine must not change a game."""
    start_deadline_s: DeadlineS = 20.0
    """Longest time of the start."""
    parameters: dict[ParameterName, bool | int | float | str] = Field({}, max_length=1000)
    """Parameters that the program receives in the first message, under `parameters`."""
    cartesian: Cartesian | None = None
    """With this table, even an empty one, the program receives the road and the road users in Cartesian coordinates,
    beside the observations."""


class Fmu(Adjustable, WithFiles):
    """A digital twin: an FMI 2.0 or 3.0 co-simulation FMU, stepped once per decision."""

    keys_of_files: ClassVar[tuple[str, ...]] = ("file",)
    parameter_table: ClassVar[str] = "start"

    kind: Literal["fmu"] = KIND
    file: DocumentPath
    """The FMU, relative to this document's folder."""
    inputs: dict[VariableName, Entry] = Field({}, max_length=200)
    """The entry of the observation that each input of the FMU receives. An input that is not listed receives the entry
    of its name; without such an entry it keeps its start value."""
    outputs: dict[Control, VariableName] = Field({}, max_length=2)
    """The names of the FMU's outputs for `acceleration_mps2` and `steering_rad`, if they differ from these."""
    start: dict[VariableName, bool | int | float | str] = Field({}, max_length=1000)
    """Start values of parameters, and of inputs that receive no entry: numbers, texts, true or false; of an enumeration
    the name or the number of an item."""
    deadline_s: DeadlineS = 10.0
    """Longest time of a decision. It only detects programs that hang: a busy machine must not change a game."""
    start_deadline_s: DeadlineS = 60.0
    """Longest time of loading and initialisation."""


class StableBaselines3(WithFiles):
    """A policy saved by Stable-Baselines3 or sb3-contrib, trained on `harness/Ego-v0` or an environment with the same
    spaces."""

    keys_of_files: ClassVar[tuple[str, ...]] = ("file", "normalize")

    kind: Literal["stable_baselines3"] = KIND
    file: DocumentPath
    """The `.zip` file that the model's `save` wrote, relative to this document's folder."""
    algorithm: Literal["PPO", "A2C", "SAC", "TD3", "DDPG", "DQN", "TQC", "RecurrentPPO"]
    """The algorithm that saved it. A file that another one saved is refused."""
    normalize: DocumentPath | None = None
    """The file that `VecNormalize.save` wrote, relative to this document's folder; none: the policy sees observations
    as they are. It is needed if the policy was trained under VecNormalize with normalised observations."""
    actions: list[PedalsAndWheel] = Field([], max_length=10_000)
    """Of a policy with discrete actions, such as DQN: pedals and wheel, -1 to 1, of each action, in their order."""


class Network(WithFiles):
    """A network in a file: a function of the observation."""

    keys_of_files: ClassVar[tuple[str, ...]] = ("file",)

    file: DocumentPath
    """The file, relative to this document's folder."""
    units: Literal["scaled", "si"] = "scaled"
    """`scaled`: observations and actions in -1 to 1, as for learned policies. `si`: observations in metres, seconds and
    radians; outputs acceleration_mps2 and steering_rad."""
    actions: list[PedalsAndWheel] = Field([], max_length=10_000)
    """If the network decides the index of an action, or a score for each: pedals and wheel of each action."""


class Onnx(Network):
    """A network in the ONNX format, run by ONNX Runtime."""

    kind: Literal["onnx"] = KIND
    input: VariableName | None = None
    """The input that receives the observation; none: the only input that is not called `noise`."""
    output: VariableName | None = None
    """The output with the decision; none: the first."""
    deadline_s: DeadlineS = 10.0
    """Longest time of a decision. It only detects networks that hang: a busy machine must not change a game."""
    start_deadline_s: DeadlineS = 60.0
    """Longest time of loading."""


class TorchScript(Network):
    """A module that `torch.jit.save` wrote."""

    kind: Literal["torchscript"] = KIND


class Python(Adjustable, WithFiles):
    """An entry point of an installed Python package, in the group `harness.drivers`, with arguments."""

    parameter_table: ClassVar[str] = "parameters"

    kind: Literal["python"] = KIND
    entry_point: Annotated[str, Field(min_length=1, max_length=200)]
    """The name of the entry point, as the package declares it."""
    parameters: dict[str, Any] = Field({}, max_length=1000)
    """Keyword arguments of the entry point."""
    cartesian: Cartesian | None = None
    """With this table, even an empty one, `decide` receives the road and the road users in Cartesian coordinates, as a
    fourth argument."""


DriverDocument: TypeAlias = Sumo | Rules | Process | Fmu | StableBaselines3 | Onnx | TorchScript | Python

KINDS: dict[str, type[Document]] = {
    get_args(model.model_fields["kind"].annotation)[0]: model for model in get_args(DriverDocument)
}


class _Kind(Excerpt):
    kind: str


def read_driver(path: Path) -> DriverDocument:
    """Read a driver document. Raises UsageError with every problem found in it."""
    kind = read_document(path, _Kind).kind
    if kind not in KINDS:
        raise UsageError.of(path, "kind", f"there is no kind of driver {kind!r}", nearest(kind, KINDS))
    return read_document(path, KINDS[kind])  # type: ignore[return-value]
