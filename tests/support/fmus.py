"""FMUs that the tests build from C: SEXS on a machine of one axis, for each version of FMI."""

import platform
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

SOURCE = Path(__file__).with_name("fmu_unit.c")
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
CAPABLE = sys.platform == "linux" and platform.machine() == "x86_64" and COMPILER is not None
EVENT = "avr.over"  # its sign changes where the limit begins and ends
# name, causality, variability, start, state of which it is the derivative; in the order of the C
VARIABLES = (
    ("vref", "input", "continuous", "0", ""),
    ("gen.V", "output", "continuous", "", ""),
    ("efd", "output", "continuous", "", ""),
    ("avr.lead", "local", "continuous", "", ""),
    ("der(gen.V)", "local", "continuous", "", "gen.V"),
    ("der(efd)", "local", "continuous", "", "efd"),
    ("der(avr.lead)", "local", "continuous", "", "avr.lead"),
    ("avr.K", "parameter", "fixed", "100", ""),
    ("TATB", "parameter", "fixed", "0.1", ""),
    ("TB", "parameter", "tunable", "10", ""),
    ("TE", "parameter", "fixed", "0.05", ""),
    ("machine.Tpd0", "parameter", "fixed", "6", ""),
    ("vt0", "parameter", "fixed", "1", ""),
    ("EMAX", "parameter", "fixed", "100", ""),
    (EVENT, "local", "continuous", "", ""),
)
NAMES = {"K": "avr.K"}
OUTPUTS = {"vt": "gen.V"}


def needs_fmus():
    """Skip a test where no FMU can be built, or run."""
    pytest.importorskip("fmpy", reason="FMPy runs the FMUs")
    if not CAPABLE:
        pytest.skip("the FMUs of the tests are built with a compiler of C, on Linux, x86-64")


def built_fmu(folder, version=2, fixed_step=False, shortest=0.0):
    """Return a new FMU with both interfaces, whose process ends where TE is below ``shortest``."""
    library = folder / f"unit{version}.so"
    flags = ["-shared", "-fPIC", "-O2", f"-DFMI={version}", f"-DSHORTEST={shortest}"]
    subprocess.run([COMPILER, *flags, str(SOURCE), "-o", str(library), "-lm"], check=True)
    fmu = folder / f"unit{version}.fmu"
    place = "linux64" if version == 2 else "x86_64-linux"
    with ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", _description(version, fixed_step))
        archive.write(library, f"binaries/{place}/unit.so")
    return fmu


def _description(version, fixed_step):
    events = ' numberOfEventIndicators="1"' if version == 2 else ""
    variable_step = "false" if fixed_step else "true"
    token = "guid" if version == 2 else "instantiationToken"
    interfaces = (
        f'<CoSimulation modelIdentifier="unit" '
        f'canHandleVariableCommunicationStepSize="{variable_step}"/>'
    )
    exchange = '<ModelExchange modelIdentifier="unit"/>'
    interfaces = exchange + interfaces
    variables = "".join(
        _variable(version, reference, *row) for reference, row in enumerate(VARIABLES)
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="{version}.0" '
        f'modelName="unit" {token}="unit"{events}>{interfaces}'
        f'<DefaultExperiment stepSize="0.001"/><ModelVariables>{variables}</ModelVariables>'
        f"<ModelStructure>{_structure(version)}</ModelStructure></fmiModelDescription>"
    )


def _variable(version, reference, name, causality, variability, start, state):
    index = [row[0] for row in VARIABLES].index(state) if state else None
    begins = f' start="{start}"' if start else ""
    common = f'name="{name}" valueReference="{reference}" causality="{causality}"'
    if version == 2:
        derivative = "" if index is None else f' derivative="{index + 1}"'
        value = f"<Real{begins}{derivative}/>"
        return f'<ScalarVariable {common} variability="{variability}">{value}</ScalarVariable>'
    derivative = "" if index is None else f' derivative="{index}"'
    return f'<Float64 {common} variability="{variability}"{begins}{derivative}/>'


def _structure(version):
    outputs = [at for at, row in enumerate(VARIABLES) if row[1] == "output"]
    derivatives = [at for at, row in enumerate(VARIABLES) if row[4]]
    if version == 2:
        groups = (("Outputs", outputs), ("Derivatives", derivatives))
        return "".join(
            f"<{group}>" + "".join(f'<Unknown index="{at + 1}"/>' for at in rows) + f"</{group}>"
            for group, rows in groups
        )
    return "".join(
        f'<{kind} valueReference="{at}"/>'
        for kind, rows in (
            ("Output", outputs),
            ("ContinuousStateDerivative", derivatives),
            ("EventIndicator", [[row[0] for row in VARIABLES].index(EVENT)]),
        )
        for at in rows
    )
