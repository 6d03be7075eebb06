"""A program that simulates in place of exfit: SEXS on a machine of one axis, in plain Python.

``python outside_program.py [FAULT]`` reads lines of JSON. With a FAULT each third run fails so:
"error", "die", "hang", "nonsense", "short", "nan", "id"; "start" fails the first run once.
"""

import json
import os
import sys
import time
from pathlib import Path

SUBSTEP = 2e-3


def response(values, steps, times):
    """Return vt at times: SEXS (TATB, TB, K, TE) and a machine of one axis on open circuit."""
    K, TE, TB = values["K_A"], values["TE"], values["TB"]
    TA, T, vt0 = values["TATB"] * TB, values["machine.Tpd0"], values["vt0"]
    vt, efd, lead = vt0, vt0, vt0 / K
    vref, now, samples = vt0 + vt0 / K, min(times[0], 0.0), []

    def slopes(vt, efd, lead, error):
        out = lead + TA / TB * (error - lead)
        return (efd - vt) / T, (K * out - efd) / TE, (error - lead) / TB

    def error_at(at, vt):
        made = sum(step["step"] for step in steps if step["signal"] == "vref" and step["at"] <= at)
        return vref + made - vt

    for at in times:
        while now < at - 1e-12:
            # no step of the integration crosses a step of the test
            ends = [step["at"] for step in steps if now + 1e-12 < step["at"] < at]
            h = min([at, now + SUBSTEP, *ends]) - now
            held = error_at(now + 1e-12, 0.0)
            state = (vt, efd, lead)
            k1 = slopes(*state, held - state[0])
            two = [x + 0.5 * h * k for x, k in zip(state, k1, strict=True)]
            k2 = slopes(*two, held - two[0])
            three = [x + 0.5 * h * k for x, k in zip(state, k2, strict=True)]
            k3 = slopes(*three, held - three[0])
            four = [x + h * k for x, k in zip(state, k3, strict=True)]
            k4 = slopes(*four, held - four[0])
            vt, efd, lead = (
                x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
                for x, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)
            )
            now += h
        samples.append(vt)
    return samples


def answer(request, fault):
    """Return the line that answers a request, with a fault where one is given."""
    number, times = request["id"], request["times"]
    if fault == "error":
        return {"id": number, "error": "the integration has failed"}
    if fault == "die":
        print("the licence has expired", file=sys.stderr, flush=True)
        os._exit(3)
    if fault == "hang":
        time.sleep(600.0)
    vt = response(request["values"], request["steps"], times)
    if fault == "nan":
        vt[1] = float("nan")
    short = 1 if fault == "short" else 0
    wrong = 1 if fault == "id" else 0
    return {"id": number + wrong, "signals": {"vt": vt[: len(vt) - short]}}


def main():
    """Answer each line of the standard input."""
    fault = sys.argv[1] if len(sys.argv) > 1 else ""
    counter = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    for number, line in enumerate(sys.stdin, 1):
        if counter is not None:  # it counts the runs of all processes
            with counter.open("a") as file:
                file.write(".")
            number = counter.stat().st_size
        fails = number == 1 if fault == "start" else number % 3 == 0
        now = ("error" if fault == "start" else fault) if fails else ""
        print("hello" if now == "nonsense" else json.dumps(answer(json.loads(line), now)))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
