"""The command line. Heavy modules are imported by the command that needs them, so that help is quick."""

from __future__ import annotations

import errno
import signal
import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from harness.cli.documents import AllowCode, check_driver, persona_app, schema

_OF_THE_MACHINE = (
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.EMFILE,
    errno.ENOMEM,
    errno.EFBIG,
    errno.EIO,
)
GAMES_ERRORED, USERS_MISTAKE, INTERRUPTED = 1, 2, 130

app = typer.Typer(
    name="harness",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Test an automated vehicle against selfish human drivers in SUMO.

A campaign trains a naive ego, trains a person against it, retrains the ego against that person, and says with paired
statistics what changed:

`harness campaign campaigns/merge.toml --quick`
""",
    epilog="Exit codes: 0 done, 1 done but games or stages errored, 2 your mistake, 130 interrupted, 143 "
    "terminated (what was done is kept).",
)

CampaignFile = Annotated[Path, typer.Argument(metavar="FILE", help="The campaign's TOML document.", show_default=False)]
RunPath = Annotated[
    Path, typer.Argument(metavar="RUN", help="A run folder, such as reports/merge.", show_default=False)
]


@app.command()
def campaign(
    file: CampaignFile,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="The same stages with fewer training steps: about 3 minutes on two cores. Not for conclusions.",
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="The run folder.  [default: reports/NAME, or reports/NAME-quick]", show_default=False
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Stages carried out at once.  [default: one per core]", show_default=False
        ),
    ] = None,
    allow_code: AllowCode = False,
) -> None:
    """Train, assess, retrain, compare: run a campaign into its run folder.

    Run it again to go on where it stopped; finished stages are skipped. The run folder holds CSV tables, report.html,
    trained policies, traces, and replays that open in SUMO-GUI.
    """
    from rich.console import Console

    from harness.campaign.execution.run_campaign import run_campaign
    from harness.campaign.execution.worker_pool import cores
    from harness.campaign.preflight import open_campaign
    from harness.campaign.storage.run_folder import RunFolder

    opened = open_campaign(file, quick, allow_code)
    name = opened.document.name + ("-quick" if opened.quick else "")
    folder = RunFolder(out or Path("reports") / name)
    console = Console()
    if quick and not opened.quick:
        console.print("Nothing to shorten: the players were trained before. Every game is played.")
    _end_when_asked_to()
    try:
        outcome = run_campaign(opened, folder, jobs or cores(), console)
    except KeyboardInterrupt as interrupt:
        console.print("Interrupted. What was done is kept: run the same command again to go on.")
        raise typer.Exit(interrupt.code if isinstance(interrupt, _AskedToEnd) else INTERRUPTED) from None
    _show(outcome.verdicts, folder.path, console)
    if outcome.failed_stages:
        console.print(f"Not finished: {', '.join(outcome.failed_stages)}", style="red", highlight=False)
    if outcome.error_games:
        console.print(f"{outcome.error_games} games could not be played; their pairs are left out", style="red")
    if outcome.failed_stages or outcome.error_games:
        raise typer.Exit(GAMES_ERRORED)


@app.command()
def check(file: CampaignFile, allow_code: AllowCode = False) -> None:
    """Check a campaign and everything it names, and say what it would do; nothing is run or written."""
    from rich.console import Console

    from harness.campaign.plan.plan import plan
    from harness.campaign.plan.stages import AssessmentStage, TrainingStage
    from harness.campaign.preflight import open_campaign
    from harness.config.campaign import LEARNED
    from harness.errors import plain
    from harness.evaluation.strategies import BestResponse

    opened = open_campaign(file, allow_code=allow_code)
    stages = plan(opened.document, [persona.name for persona in opened.personas], opened.tunable)
    arms = sum(isinstance(stage, AssessmentStage) for stage in stages)
    trainings = sum(isinstance(stage, TrainingStage) for stage in stages)
    console = Console()

    def say(line: str) -> None:
        console.print(line, highlight=False, markup=False, soft_wrap=True)

    say(f"{file} is in order.")
    if opened.document.ego.driver != LEARNED:
        ego = opened.ego_driver.in_words if opened.ego_driver is not None else "SUMO's own models"
        round_2 = "There is nothing to train or to tune in it: rounds 0 and 1."
        if opened.ego_driver is not None and opened.tunable:
            search = opened.document.reconfiguration
            ranges = ", ".join(f"{key} from {low:g} to {high:g}" for key, low, high in opened.ego_driver.searched)
            round_2 = f"Round 2 searches it in {search.trials} trials of {search.games} games: {ranges}."
        say(plain(f"The ego: {ego}. {round_2}"))
    responses = sum(isinstance(stage, TrainingStage) and isinstance(stage.strategy, BestResponse) for stage in stages)
    how = f"{trainings - responses} trainings of up to {opened.document.training.steps:,} steps"
    if opened.policies is not None:
        how = f"Players trained before, read from {opened.policies}: nothing is trained"
    if opened.document.best_response is not None:
        how += f", {responses} trainings of best responses of up to {opened.document.best_response.steps:,} steps"
    say(f"{how}, {arms} arms of {opened.document.assessment.episodes} episodes:")
    for stage in stages:
        reads = () if isinstance(stage, TrainingStage) else stage.reads
        after = f"  after {', '.join(stage.needs)}" if stage.needs else ""
        say(f"  {stage.verb:6s} {stage.id}{after}" + (f"  with {', '.join(reads)}" if reads else ""))


@app.command()
def report(run: RunPath) -> None:
    """Write the tables, replays and report.html of a run anew, from its folder alone."""
    from rich.console import Console

    from harness.campaign.results.results import write_results
    from harness.campaign.storage.run_folder import RunFolder

    console, folder = Console(), RunFolder(run)
    folder.manifest()
    with folder.held():
        outcome = write_results(folder, console)
    _show(outcome.verdicts, run, console)


@app.command()
def replay(
    run: RunPath,
    arm: Annotated[
        str | None, typer.Argument(metavar="ARM", help="The arm, such as naive_vs_speedy.", show_default=False)
    ] = None,
    episode: Annotated[
        int | None, typer.Argument(metavar="EPISODE", help="The episode's number.", show_default=False)
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="The training seed.  [default: the campaign's first]", show_default=False)
    ] = None,
    list_games: Annotated[bool, typer.Option("--list", help="List the games there are, worst first.")] = False,
    film_file: Annotated[
        Path | None,
        typer.Option(
            "--film",
            metavar="FILE",
            help="Write the game as a film, .gif or .mp4, instead; needs no screen.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Watch a game in SUMO-GUI, exactly as it was played. Without ARM or EPISODE: list the games there are."""
    from rich.console import Console

    from harness.campaign.results.replay_game import film, found_game, game_table, watch
    from harness.errors import UsageError

    console = Console()
    if film_file is not None and (list_games or arm is None or episode is None):
        raise UsageError.of("--film", str(film_file), "is of one game", "name it: harness replay RUN ARM EPISODE")
    if list_games or arm is None or episode is None:
        console.print(game_table(run, arm))
        return
    with found_game(run, arm, episode, seed) as game:
        if film_file is None:
            watch(game, console)
        else:
            film(game, film_file, console)


app.command("check-driver")(check_driver)
app.add_typer(persona_app, name="persona")
app.command()(schema)


class _AskedToEnd(KeyboardInterrupt):
    """SIGTERM or SIGHUP: ends the command as Ctrl-C does, but for its exit code."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.code = 128 + number


def _end_when_asked_to() -> None:
    def ask(number: int, frame: object) -> NoReturn:
        raise _AskedToEnd(number)

    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is signal.SIG_DFL:  # not with nohup
            signal.signal(getattr(signal, name), ask)


def _show(verdicts: Any, run: Path, console: Any) -> None:
    styles = {"harm": "red", "mended": "green", "open": "yellow"}
    for persona, verdict in verdicts:
        label = f"{persona}, {verdict.question}: {verdict.label}"
        console.print(label, style=f"bold {styles[verdict.tone]}", highlight=False, markup=False)
        for sentence in (verdict.sentence, verdict.speed):
            if sentence:
                console.print(f"  {sentence}", highlight=False, markup=False)
    console.print(f"Report: {run / 'report.html'}", highlight=False, markup=False, soft_wrap=True)


def _fail(message: str, code: int) -> NoReturn:
    print(message, file=sys.stderr)
    raise SystemExit(code)


def main() -> None:
    """The `harness` command: the user's mistakes are printed without a traceback."""
    from harness.errors import HarnessError, UsageError, is_of_memory

    try:
        app()
    except UsageError as error:
        _fail("\n".join(str(problem) for problem in error.problems), USERS_MISTAKE)
    except HarnessError as error:
        _fail(f"{type(error).__name__}: {error}", GAMES_ERRORED)
    except Exception as error:
        if is_of_memory(error):
            _fail(f"the machine is short of memory: {error or 'none is left'}; what was done is kept", GAMES_ERRORED)
        if not isinstance(error, OSError) or error.errno not in _OF_THE_MACHINE:
            raise
        _fail(f"{error.filename or 'the run folder'}: {error.strerror}; what was done is kept", GAMES_ERRORED)


if __name__ == "__main__":
    main()
