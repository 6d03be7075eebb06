"""What a user meets first, with nothing but an installed exfit: no tools of the tests, no checkout.

    VENV/bin/python tests/support/smoke.py

works in a new folder outside the checkout, runs the commands as programs, and ends with exit code 1
at the first that does not do what it should. It needs Python's own library only.
"""

import json
import os
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

MODEL = "SEXS"
TRUTH = """\
model: SEXS
plant: {{type: open-circuit, machine: GENROU}}
test: {{vt0: 1.0, duration: 10.0, vref: [{{at: 1.0, step: {step}}}]}}
parameters: {{fixed: {{K: {gain}}}}}
"""
STEP, GAIN = 0.05, 120.0
CLOSENESS = 0.02  # of a fitted gain to the simulated one: the record is without noise
EXTRAS = {  # a file that each extra reads, and the package that it brings
    "excel": ("record.xlsx", "python_calamine"),
    "parquet": ("record.parquet", "pyarrow"),
    "comtrade": ("record.cfg", "comtrade"),
}


class Unexpected(Exception):
    """A command that did not do what it should."""


def exfit(*arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Run a command of the installed program; raises Unexpected for another exit code."""
    name = "exfit.exe" if os.name == "nt" else "exfit"
    program = Path(sys.executable).parent / name
    ran = subprocess.run(
        [str(program), *arguments],
        capture_output=True,
        encoding="utf-8",
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        check=False,
    )
    words = f"exfit {' '.join(arguments)}"
    if ran.returncode != code or "Traceback" in ran.stderr:
        raise Unexpected(f"{words}: exit code {ran.returncode}\n{ran.stdout}{ran.stderr}")
    print(words, flush=True)
    return ran


def expect(holds: bool, text: str) -> None:
    """Raise Unexpected with a text unless something holds."""
    if not holds:
        raise Unexpected(text)


def installed() -> None:
    """Check that exfit is imported from where it is installed, with what belongs to it."""
    code = "import exfit; print(exfit.__file__)"
    place = Path(subprocess.check_output([sys.executable, "-c", code], text=True).strip())
    expect(place.is_relative_to(sys.prefix), f"{place}: not installed in {sys.prefix}")
    expect((place.parent / "py.typed").is_file(), "py.typed is missing")


def record(name: str, step: float) -> Path:
    """Return a record of a bump test, which exfit itself simulates."""
    Path(f"{name}.yaml").write_text(TRUTH.format(step=step, gain=GAIN), encoding="utf-8")
    exfit("simulate", f"{name}.yaml", "--no-plots", "-o", name)
    return Path(name, "response.csv")


def from_record_to_export() -> None:
    """Fit a case that is made from a record, and use its result."""
    up, down = record("up", STEP), record("down", -STEP)
    exfit("inspect", str(up))
    exfit("new", "--model", MODEL, "--record", str(up), "--step", str(STEP), "-o", "unit.yaml")
    exfit("check", "unit.yaml")
    exfit("fit", "unit.yaml", "--search", "local", "-o", "fit")
    fitted = json.loads(Path("fit", "result.json").read_text(encoding="utf-8"))
    gain = fitted["parameters"]["K"]["value"]
    expect(abs(gain / GAIN - 1.0) < CLOSENESS, f"K: fitted {gain}, simulated {GAIN}")
    expect(Path("fit", "overlay.png").stat().st_size > 0, "fit/overlay.png is empty")
    exfit("validate", "unit.yaml", "--record", str(down), "--parameters", "fit/parameters.yaml")
    exfit("report", "fit")
    expect("<script>" in Path("fit", "report.html").read_text(encoding="utf-8"), "no scripts")
    exfit("export", "fit", "--bus", "101", "--id", "1", "-o", "unit.dyr")
    exfit("import", "unit.dyr", "-o", "again.yaml")
    exfit("simulate", "again.yaml", "--no-plots")
    exfit("batch", "unit.yaml", "--workers", "1", "--search", "local", "-o", "fleet")
    expect(Path("fleet", "fleet.html").is_file(), "fleet/fleet.html is missing")


def extras() -> None:
    """Check that each extra that is missing is named, with how to install it."""
    Path("record.dat").write_bytes(b"any")
    for extra, (file, package) in EXTRAS.items():
        Path(file).write_bytes(b"any")
        if find_spec(package) is None:
            ran = exfit("inspect", file, code=1)
            expect(f"exfit[{extra}]" in ran.stderr, f"{file}: {ran.stderr}")
    if find_spec("distributed") is None:
        ran = exfit("batch", "unit.yaml", "--scheduler", "tcp://127.0.0.1:1", code=1)
        expect("exfit[cluster]" in ran.stderr, ran.stderr)
    if find_spec("fmpy") is None:
        text = TRUTH.format(step=STEP, gain=GAIN)
        fmu = text.replace("type: open-circuit", "type: fmu, file: unit.fmu, twin: open-circuit")
        Path("fmu.yaml").write_text(fmu, encoding="utf-8")
        ran = exfit("simulate", "fmu.yaml", code=1)
        expect("exfit[fmu]" in ran.stderr, ran.stderr)
    if find_spec("weasyprint") is None:
        ran = exfit("report", "fit", "--pdf", code=1)
        expect("exfit[pdf]" in ran.stderr, ran.stderr)


def main() -> None:
    """Run all in a folder of its own; raises SystemExit at what is not as it should be."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["EXFIT_CACHE"] = str(Path(folder, "cache"))
        os.chdir(folder)
        try:
            installed()
            exfit("--version")
            exfit("models", MODEL)
            from_record_to_export()
            extras()
        except Unexpected as fault:
            raise SystemExit(f"smoke test: {fault}") from None
        finally:
            os.chdir(Path(sys.prefix))


if __name__ == "__main__":
    main()
