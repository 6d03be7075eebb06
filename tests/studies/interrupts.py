"""Count what is left of a folder with a former fit when a signal meets the next one.

Run it as ``python tests/studies/interrupts.py [INTERRUPTIONS [KILLS [COMMANDS]]]``. Each run fits
configs/first_order.yaml, figures included, in a process of its own, into a copy of a folder that
holds another fit; SIGINT, SIGTERM or SIGKILL meets it at a random moment between its start and its
end. A quarter as many meet it in the few milliseconds in which it writes its numbers. Where SIGKILL
left temporary files, the next fit runs there to its end, and those that it leaves are counted.

Then as many signals as COMMANDS says, of each kind, meet each of some other commands: a fault is
an exit code that is none of such an end, a traceback, or a file too many or too few.

``--entries [SHARE [NAME,...]]`` instead interrupts every command, once and twice, where it enters a
module of exfit for the first time and for the last, and lists what is wrong and the longest times
that one went on, s of the processor and of the clock; of a SHARE of the entries, drawn.
"""

import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import injected
from ended_commands import ENDS, WITH_SIGNALS, contents, fault_of, undisturbed
from interrupted_runs import CASE, TEMPORARY, fit, fit_before, met_by, seconds_of_fit
from writers import FIT_BEFORE, INTERRUPTED, prepare, prepare_every

INTERRUPTIONS, KILLS, COMMANDS, SEED = 200, 100, 10, 2026
WRITING = 0.06  # s: about how long the numbers take
TIMED = 10  # runs until a fit is timed again: other work on the machine slows it down
SECOND = (1, 10, 40, 200)  # entries from one interruption to the next
LATE = 1.1  # of the time of a fit: some signals come too late


def study(number, count, while_writing, before, place):
    """Send a signal to so many fits and print what they left."""
    rng, counts = random.Random(f"{SEED} {number} {while_writing}"), Counter()
    for run in range(count):
        if run % TIMED == 0:
            seconds = seconds_of_fit(CASE, place / "timed")
        moment = rng.uniform(0.0, WRITING if while_writing else LATE * seconds)
        folder = place / f"{number}-{while_writing}-{run}"
        outcome = met_by(number, moment, before, folder, while_writing)
        counts[f"result {outcome.result}"] += 1
        counts[f"exit code {outcome.code}"] += 1
        counts["numbers of two runs"] += not outcome.together
        counts["with temporary files"] += outcome.temporary > 0
        counts["tracebacks"] += "Traceback" in outcome.errors
        if number == signal.SIGKILL and outcome.temporary:
            fit(CASE, folder).communicate()
            counts["with temporary files after the next fit"] += any(folder.glob(TEMPORARY))
    where = "while the numbers are written" if while_writing else "at any moment"
    print(f"{count} {signal.Signals(number).name} {where}")
    for text, times in sorted(counts.items()):
        print(f"  {times:4} {text}")
    sys.stdout.flush()


def study_commands(count, place):
    """Send signals of each kind to commands and print what was wrong after them."""
    prepare(place)
    subprocess.run(
        [sys.executable, "-m", "exfit", *FIT_BEFORE], cwd=place, stdout=subprocess.DEVNULL
    )
    for name in WITH_SIGNALS:
        seconds = undisturbed(name, place)
        for kind in ENDS:
            rng = random.Random(f"{SEED} {name} {kind}")
            moments = [rng.uniform(0.0, LATE * seconds) for _ in range(count)]
            faults = [*filter(None, (fault_of(name, kind, moment, place) for moment in moments))]
            print(f"{count} {kind} to {name}: {len(faults)} faults", *faults[:3], flush=True)


def study_entries(share, names):
    """Interrupt commands at entries into modules, and print what is wrong."""
    for name in names:
        entries, wrong, times = injected.entries(INTERRUPTED[name]), [], []
        whole, rng = {*contents(Path.cwd())}, random.Random(f"{SEED} {name}")
        drawn = rng.sample(entries, max(round(share * len(entries)), 1))
        for at in drawn:
            for gap in (0, rng.choice(SECOND)):
                ended = injected.interrupted(INTERRUPTED[name], at, gap, whole, Path.cwd())
                wrong += [(at, gap, fault) for fault in ended.faults]
                times.append((*ended.seconds, (*at, gap)))
        print(f"{name}: {2 * len(drawn)} interruptions at {len(drawn)} of {len(entries)} entries: ")
        processor, _, where = max(times)
        clock = max(time[1] for time in times)
        print(f"    {len(wrong)} faults, at most {processor:.2f} s of the processor, {where}, "
              f"{clock:.2f} s by the clock", flush=True)  # fmt: skip
        for fault in wrong[:3]:
            print("   ", *fault)


def main():
    """Print what is left after interruptions and kills."""
    if "--entries" in sys.argv:
        share, names = (*sys.argv[2:], *("1", ",".join(INTERRUPTED))[len(sys.argv) - 2 :])
        with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
            os.environ["EXFIT_CONFIG"] = str(Path(place).with_suffix(".configuration"))
            signal.signal(signal.SIGINT, signal.default_int_handler)
            prepare_every(Path(place), lambda *given: injected.run(given, injected.Injection()))
            study_entries(float(share), names.split(","))
        return
    given = [int(text) for text in sys.argv[1:]]
    interruptions, kills, commands = (*given, *(INTERRUPTIONS, KILLS, COMMANDS)[len(given) :])
    with tempfile.TemporaryDirectory() as place:
        before, seconds = fit_before(Path(place))
        print(f"a fit with figures takes {seconds:.2f} s", flush=True)
        counts = {signal.SIGINT: interruptions, signal.SIGTERM: kills, signal.SIGKILL: kills}
        for number, count in counts.items():
            for while_writing, runs in ((False, count), (True, count // 4)):
                study(number, runs, while_writing, before, Path(place))
        (Path(place) / "commands").mkdir()
        study_commands(commands, Path(place) / "commands")


if __name__ == "__main__":
    main()
