"""`teach` and `play`: an arm is shown something, from the terminal or by hand, and does it again."""

from __future__ import annotations

import os
import sys
from contextlib import aclosing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dobot_async.arms.registry import REGISTERED
from dobot_async.cli.arms import FAMILIES
from dobot_async.cli.failures import StepRefused, WrongFile
from dobot_async.cli.params import ABOVE_ZERO, DURATION
from dobot_async.cli.session import CommandSession, run

if TYPE_CHECKING:
    from dobot_async.arms.base import Arm

__all__ = ["play_recording", "teach"]

FILE = click.Path(dir_okay=False, path_type=Path)
PLAYBACK = ".playback"


@click.command("teach")
@click.argument("file", type=FILE)
@click.option("--hand", is_flag=True, help="Lead the arm by hand, in place of jogging it with keys.")
@click.option("--rate", type=ABOVE_ZERO, default=20.0, show_default=True, help="Samples/s of an arm that is led.")
@click.option("--seconds", type=DURATION, help="End the leading after so long.")
@click.option("--count", type=click.IntRange(1), help="End after so many points of a magician's key.")
@click.option("--speed", type=ABOVE_ZERO, default=20.0, show_default=True, help="Percent, of jogs and of p.")
@click.option("--tool", default="", help="What is on the arm, in your words.")
@click.option("--yes", is_flag=True, help="Release the joints of an arm for --hand without asking.")
@click.pass_obj
def teach(session: CommandSession, /, file: Path, speed: float, tool: str, **options: Any) -> None:
    """Teach the arm, and keep that in a file.

    FILE is JSON, or a file for DobotStudio if its name ends with .playback; one that is there is gone on with. The
    arrow keys jog the arm while they are held, space takes a point, and ? tells the other keys. With --hand a point is
    taken each time that the key on a magician's forearm is released; other arms are released, and what they are led
    through is recorded in time. The file is written when it ends, by Ctrl-C too.
    """
    from dobot_async.teaching import Recording

    if speed > 100:
        raise click.UsageError("--speed is at most 100 percent")

    if file.suffix.lower() == PLAYBACK and session.arm != "magician":
        raise click.UsageError(f"a {PLAYBACK} file is for --arm magician alone")

    if not os.access(file.parent, os.W_OK):
        raise click.UsageError(f"{file}: nothing can be written there")

    before = read(file) if file.exists() else None
    check_options(session, before, **options)
    session.target()
    kept: list[tuple[Path, Recording]] = []
    try:
        run(taught_by(session, file, before, kept, speed=speed, tool=tool, **options))
    except click.UsageError:
        raise
    except BaseException:
        with suppress(OSError):  # a terminal that was closed hears nothing
            session.output.say(words(file, kept))

        raise

    written, recording = kept[-1] if kept else (file, Recording(session.arm))
    counts = {"steps": len(recording.steps), "samples": len(recording.path), "seconds": recording.duration}
    session.output.answer({"file": str(written), **counts}, words(file, kept))


def check_options(
    session: CommandSession,
    before: Any,
    *,
    hand: bool,
    rate: float,
    seconds: float | None,
    count: int | None,
    yes: bool,
) -> None:
    """Raise UsageError for options that do not fit each other, or the arm."""
    terminal = sys.stdin is not None and sys.stdin.isatty() and sys.platform != "win32"
    wrong: dict[str, Any] = {
        "--rate is at most 1000 samples/s": rate > 1000,
        "--seconds, --count and --yes are for --hand": not hand and (seconds is not None or count is not None or yes),
        "the keys of a terminal jog the arm, and standard input is none; lead it by --hand": not hand and not terminal,
        "--seconds and --yes are for arms that are released": hand and (seconds is not None or yes),
    }
    if hand and session.arm != "magician":
        wrong |= {
            "--seconds and --yes are for arms that are released": False,
            "--count is for a magician's key": count,
            "what an arm is led through needs a file of its own, and this one is there already": before,
            "the arm falls when its joints are released, unless somebody holds it: say --yes": not yes and not terminal,
        }

    for words, applies in wrong.items():
        if applies:
            raise click.UsageError(words)

    if hand and session.arm != "magician" and not yes:
        click.confirm("The joints are released now: hold the arm. Go on?", abort=True, err=True)


async def taught_by(
    session: CommandSession,
    file: Path,
    before: Any,
    kept: list[Any],
    *,
    hand: bool,
    rate: float,
    seconds: float | None,
    count: int | None,
    speed: float,
    tool: str,
    yes: bool,  # noqa: ARG001 - was looked at
) -> None:
    """Teach, and write the file, whatever ends it."""
    from dobot_async.teaching import Recorder

    async with session.connect() as arm:
        try:
            recorder = Recorder(arm, tool=tool, recording=before)
        except ValueError as error:
            raise StepRefused(str(error)) from None

        try:
            if not hand:
                await by_keys(session, recorder, speed)
            elif session.arm == "magician":
                await by_key(session, recorder, count)
            else:
                await by_hand(session, recorder, rate, seconds)
        finally:
            recording = recorder.recording
            if recording != before and (recording.steps or len({each.joints for each in recording.path}) > 1):
                kept.append((keep(recording, file), recording))


def keep(recording: Any, file: Path) -> Path:
    """Write a recording, as JSON if the file cannot hold it; return where."""
    from dobot_async.teaching import RecordingUnfit, save_recording

    try:
        save_recording(recording, file)
    except RecordingUnfit as error:
        click.echo(f"warning: {file.name} cannot hold it: {error}", err=True)
        file = file.with_suffix(".json")
        while file.exists():
            file = file.with_stem(f"{file.stem}-new")

        save_recording(recording, file)

    return file


async def by_keys(session: CommandSession, recorder: Any, speed: float) -> None:
    """Let the keys of the terminal jog."""
    from dobot_async.cli.keys import keys_of
    from dobot_async.cli.pendant import Pendant
    from dobot_async.teaching.registry import taught

    player = taught(recorder.arm)
    with keys_of() as keys:
        async with player.jogs(speed):
            await Pendant(recorder, player, keys, session.output.say, speed).run()


async def by_key(session: CommandSession, recorder: Any, count: int | None) -> None:
    """Take a point each time that the key on the forearm is released."""
    from dobot_async.cli.keys import until_a_key

    session.output.say("hold the key on the forearm, lead the arm, and let it go where a point is to be")
    async with until_a_key(), aclosing(recorder.from_key()) as steps:
        number = 0
        async for step in steps:
            number += 1
            session.output.say(
                f"point {len(recorder.recording.steps)}: {'  '.join(f'{each:.1f}' for each in step.pose)}"
            )
            if number == count:
                break


async def by_hand(session: CommandSession, recorder: Any, rate: float, seconds: float | None) -> None:
    """Record what a released arm is led through."""
    from dobot_async.cli.keys import until_a_key
    from dobot_async.teaching import released

    async with released(recorder.arm):
        session.output.say("the arm is released: lead it")
        async with until_a_key(), aclosing(recorder.samples(rate, seconds=seconds)) as samples:
            async for _ in samples:
                pass


def read(file: Path) -> Any:
    """Read a recording, and tell what there is to be said of it; raises WrongFile, or UsageError."""
    from dobot_async.teaching import RecordingFileError, load_recording

    try:
        recording = load_recording(file)
    except RecordingFileError as error:
        raise WrongFile(f"{error}; nothing was sent") from None
    except OSError as error:
        raise click.UsageError(f"{file}: {error.strerror or error}") from None

    for remark in recording.remarks:
        click.echo(f"warning: {file.name}: {remark}", err=True)

    return recording


def words(file: Path, kept: list[Any]) -> str:
    """What was kept."""
    if not kept:
        return f"{file}: nothing new, and not written"

    file, recording = kept[-1]
    if recording.path:
        return f"{file}: {len(recording.path)} samples in {recording.duration:.1f} s"

    return f"{file}: {len(recording.steps)} points"


@click.command("play")
@click.argument("file", type=FILE)
@click.option("--speed", type=ABOVE_ZERO, help="Percent of the arm's speed; of a path, of that at which it was shown.")
@click.option("--loop", type=click.IntRange(0), default=1, show_default=True, help="How often; 0: until Ctrl-C.")
@click.option("--reverse", is_flag=True, help="From the end to the beginning; what was taken is put down.")
@click.option("--dry-run", is_flag=True, help="Only check it: no arm is needed, and nothing is sent.")
@click.pass_obj
def play_recording(
    session: CommandSession, file: Path, speed: float | None, loop: int, reverse: bool, dry_run: bool
) -> None:
    """Play what an arm was taught.

    FILE is what `teach` has written, or a .playback file of DobotStudio. All of it is checked before anything moves:
    the family, the model, the limits and the reach. Without --arm it is the arm that is in the file. Ctrl-C stops
    it.
    """
    from dobot_async.teaching import RecordingUnfit, check_recording, play

    recording = read(file)
    choose_arm(session, file, recording)
    most = 1000 if recording.path else 100
    if speed is not None and speed > most:
        raise click.UsageError(f"--speed is at most {most} percent")

    if not (recording.steps or recording.path):
        raise WrongFile(f"{file.name}: there is nothing in it; nothing was sent")

    try:
        check_recording(recording.reversed() if reverse else recording)
    except RecordingUnfit as error:
        raise WrongFile(f"{file.name}: {error}; nothing was sent") from None

    async def question(arm: Arm) -> None:
        try:
            await play(arm, recording, speed=speed, loops=loop or None, reverse=reverse, progress=report)
        except RecordingUnfit as error:
            raise StepRefused(str(error)) from None

    answer = {"file": str(file), "steps": len(recording.steps), "samples": len(recording.path)}
    if dry_run:
        session.output.answer({**answer, "sent": False}, f"{file.name}: would play")
        return

    session.target()
    with session.output.counting(file.name, len(recording.steps or recording.thinned().path)) as told:

        def report(done: int, _: int) -> None:
            told(done)

        session.ask(question)

    session.output.answer(answer, f"{file.name}: played")


def choose_arm(session: CommandSession, file: Path, recording: Any) -> None:
    """Take the arm that is in a file, unless one was given; raises WrongFile if that is of another family."""
    recorded = recording.model or recording.family
    if recorded not in FAMILIES:
        raise WrongFile(f"{file.name}: no arm {recorded!r}; there are: {', '.join(FAMILIES)}; nothing was sent")

    if "arm" not in session.given:
        session.arm = recorded
    elif (session.arm if session.arm in REGISTERED else "mycobot") != recording.family:
        raise WrongFile(f"{file.name}: it was recorded from a {recorded}, and --arm is {session.arm}; nothing was sent")
