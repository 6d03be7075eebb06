"""Names of a case that become files: what some system cannot hold, and what is exfit's own."""

from collections.abc import Iterator, Sequence
from unicodedata import normalize

from exfit.util.vocabulary import PHASES

# cf. Microsoft, "Naming Files, Paths, and Namespaces": reserved with any ending, also these digits
PORTS = [f"{port}{digit}" for port in ("com", "lpt") for digit in "0123456789\u00b9\u00b2\u00b3"]
DEVICES = frozenset(("con", "prn", "aux", "nul", "conin$", "conout$", *PORTS))
FORBIDDEN = '<>:"/\\|?*'  # by Windows
LONGEST_NAME = 100  # characters: a name of any system has 255 bytes, and what is added takes some

WHOLE_FIT, WHOLE_PROGRAMME, VALIDATION = "result.json", "programme.json", "validation.json"
PARAMETERS, HISTORY, RESPONSE = "parameters.yaml", "history.csv", "response.csv"
ITERATIONS, SENSITIVITIES = "iterations.csv", "sensitivities.csv"

# of what exfit itself writes into the folder of a run, and of the folder of all bump tests
OWN_NAMES = (
    "compare",
    "compare-record",
    "convergence",
    "correlation",
    "designed_test",
    "fit",
    "fits",
    "history",
    "identify",
    "inspect",
    "iterations",
    "overlay",
    *(f"overlay_{phase}" for phase in PHASES),
    "parameters",
    *(f"parameters_{phase}" for phase in PHASES),
    "profile",
    "programme",
    "rank",
    "report",
    "response",
    "result",
    "sensitivities",
    "sensitivity",
    "starts",
    "summary",
    "test_section",
    "test_sheet",
    "trajectories",
    "translation",
    "validation",
)
ENDINGS = (".csv", ".png", "-iterations.csv", *(f"-{phase}.png" for phase in PHASES))


def files_named_after(name: str) -> tuple[str, ...]:
    """Return the names of the files that are named after a record."""
    return tuple(name + ending for ending in ENDINGS)


def unusable(name: str) -> str | None:
    """Find the fault of a file's name, which is not empty, on any system; None for none."""
    if folded(name.partition(".")[0].rstrip()) in DEVICES:
        return "is a device of Windows, where no file can have this name"
    if name[-1] in ". ":
        return "ends with a dot or a space, which Windows leaves out"
    if len(name) > LONGEST_NAME:
        return f"is longer than {LONGEST_NAME} characters"
    wrong = next((letter for letter in name if letter in FORBIDDEN or not letter.isprintable()), "")
    return f"has {wrong!r}, which a name of Windows cannot have" if wrong else None


def folded(name: str) -> str:
    """Reduce a name to its part that every system tells apart, whatever its case and accents."""
    return normalize("NFC", normalize("NFC", name).casefold())


def taken_names(names: Sequence[str | None]) -> Iterator[tuple[int, str]]:
    """Yield the index of each name that cannot be used beside those before it, and the reason.

    None is a name that is missing.
    """
    own = {folded(name) for name in OWN_NAMES}
    files: dict[str, str] = {}
    for index, name in enumerate(names):
        if not name:
            continue
        after = [folded(file) for file in files_named_after(name)]
        taken = next((file for file in after if file in files), None)
        if (why := unusable(name)) is not None:
            yield index, why
        elif own & {folded(name), folded(name.partition(".")[0])}:
            yield index, "is taken by a file of every run: files are named after it"
        elif taken is not None:
            yield index, f"is taken by {files[taken]!r}: the file {taken} would be of both"
        for file in after:
            files.setdefault(file, name)
