"""Nothing in exfit needs one system: what only some have stands behind a question which it is."""

import ast
import os
import re
import subprocess
import sys

import pytest
from places import ROOT
from sources import nodes_of, trees

# modules and names of the standard library that Windows, or macOS, does not have
MODULES = {
    "fcntl", "grp", "msvcrt", "nis", "ossaudiodev", "posix", "pty", "pwd", "readline", "resource",
    "spwd", "syslog", "termios", "tty", "winreg", "winsound", "_winapi",
}  # fmt: skip
NAMES = {
    "os": {
        "chown", "chroot", "ctermid", "eventfd", "fchdir", "fchmod", "fchown", "fork", "forkpty",
        "getegid", "geteuid", "getgid", "getgroups", "getloadavg", "getpgid", "getpgrp",
        "getpriority", "getresuid", "getsid", "getuid", "initgroups", "killpg", "lchown", "lockf",
        "memfd_create", "mkfifo", "mknod", "nice", "openpty", "pathconf", "pidfd_open", "pipe2",
        "posix_fadvise", "posix_fallocate", "posix_spawn", "pread", "pwrite", "sched_getaffinity",
        "sched_setaffinity", "sendfile", "setgid", "setpgid", "setpriority", "setsid", "setuid",
        "splice", "startfile", "statvfs", "sync", "sysconf", "tcgetpgrp", "ttyname", "uname",
        "wait", "wait3", "wait4", "waitid", "O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK",
    },
    "signal": {
        "CTRL_BREAK_EVENT", "CTRL_C_EVENT", "SIGALRM", "SIGBREAK", "SIGCHLD", "SIGHUP", "SIGKILL",
        "SIGPIPE", "SIGQUIT", "SIGSTOP", "SIGTSTP", "SIGUSR1", "SIGUSR2", "SIGWINCH", "SIGXFSZ",
        "alarm", "pause", "pthread_kill", "pthread_sigmask", "setitimer", "siginterrupt", "sigwait",
    },
    "select": {"epoll", "kqueue", "poll"},
    "socket": {"AF_UNIX", "socketpair"},
    "sys": {"getwindowsversion", "setdlopenflags"},
    "time": {"clock_settime", "pthread_getcpuclockid", "tzset"},
}  # fmt: skip
# that mean something else on another system, or need a right there
OTHERWISE = {
    "os": {"chmod", "kill", "link", "readlink", "rename", "symlink", "umask"},
    "Path": {"chmod", "hardlink_to", "lchmod", "rename", "symlink_to"},
}
GUARD = re.compile(r"os\.name|sys\.platform|hasattr\(|getattr\(")
PLACES = re.compile(r"^/(proc|sys|dev|tmp|etc|home|usr|var)(/|$)")
OF_A_SYSTEM = re.compile(r"%[-#][a-zA-Z]|%[esPGgVuDhnrRtT]")  # of strftime


def unguarded(tree):
    """Return the nodes that only some systems run, but for those that a question stands around.

    That is a condition, or a function, in which the name of the system is asked for.
    """
    nodes = [*of_some_systems(tree)]
    if not nodes:
        return []
    inside = set()
    for node in ast.walk(tree):
        around = isinstance(node, ast.FunctionDef | ast.If | ast.IfExp)
        if around and GUARD.search(ast.unparse(node)):
            inside |= {id(part) for part in ast.walk(node)}
    return [node for node in nodes if id(node) not in inside]


def of_some_systems(tree):
    """Yield the nodes that only some systems can run, or run in another way."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            module = getattr(node, "module", None)
            if MODULES & {module, *names} or NAMES.get(module, set()) & set(names):
                yield node
        elif isinstance(node, ast.Attribute):
            owner = node.value.id if isinstance(node.value, ast.Name) else ""
            names = NAMES.get(owner, set()) | OTHERWISE.get(owner, set())
            is_path = owner not in NAMES and node.attr in OTHERWISE["Path"]
            if node.attr in names or (is_path and isinstance(node.ctx, ast.Load)):
                yield node
        elif isinstance(node, ast.Constant) and PLACES.match(str(node.value)):
            yield node


def without_encoding(tree):
    """Yield calls that read or write text in an encoding, or with ends of lines, of the system."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        owner, _, name = ast.unparse(node.func).rpartition(".")
        named = any(word.arg == "encoding" for word in node.keywords)
        if name in ("read_text", "write_text") and owner:
            faulty = name == "write_text" or not named
        else:
            faulty = name == "open" and owner != "os" and not named and _opens_text(node, owner)
        if faulty:
            yield node


def _opens_text(call, owner):
    """Return whether a call opens a file as text: an archive is given a name, a path a mode."""
    modes = call.args[0 if owner else 1 :]
    constants = [str(mode.value) for mode in modes if isinstance(mode, ast.Constant)]
    return not modes or any("b" not in mode for mode in constants)


def listed(faults):
    return sorted(f"{name}:{node.lineno}: {ast.unparse(node)}" for name, node in faults)


def test_what_only_some_systems_have_stands_behind_a_question():
    faults = [(name, node) for name, tree in trees() for node in unguarded(tree)]
    assert listed(faults) == []


def test_text_is_read_in_an_encoding_that_is_named_and_written_as_bytes():
    faults = [(name, node) for name, tree in trees() for node in without_encoding(tree)]
    assert listed(faults) == []


def test_dates_are_written_by_letters_that_all_systems_know():
    texts = [
        (name, node)
        for name, _ in trees()
        for node in nodes_of(name)
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "strftime"
        for argument in node.args
        if OF_A_SYSTEM.search(ast.unparse(argument))
    ]
    assert listed(texts) == []


@pytest.mark.parametrize(
    "code",
    [
        "import fcntl",
        "from os import fork",
        "import os\nos.sched_getaffinity(0)",
        "import signal\nsignal.SIGKILL",
        "import os\nos.kill(1, 0)",
        "path.rename(other)",
        "path.chmod(0o700)",
        "open('/proc/meminfo', encoding='utf-8')",
    ],
)
def test_the_test_finds_what_it_looks_for_but_not_behind_a_question(code):
    assert len(unguarded(ast.parse(code))) == 1
    body = "\n    ".join(code.splitlines())
    assert unguarded(ast.parse(f"if os.name == 'posix':\n    {body}")) == []


@pytest.mark.parametrize(
    "code",
    [
        "open(path)",
        "open(path, 'w')",
        "path.open()",
        "path.open('r')",
        "p.read_text()",
        "p.write_text(t)",
    ],
)
def test_the_test_finds_what_names_no_encoding(code):
    assert len([*without_encoding(ast.parse(code))]) == 1


@pytest.mark.long
def test_no_file_is_read_in_the_encoding_of_the_system(tmp_path):
    """Python itself warns where exfit, or what it calls, does not name one; the locale is C."""
    options = ["-X", "warn_default_encoding", "-W", "always::EncodingWarning"]
    environment = {**os.environ, "PYTHONUTF8": "0", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"}
    case = ROOT / "configs" / "first_order.yaml"
    for arguments in (
        ("fit", str(case), "--search", "local", "--no-plots", "-o", "out"),
        ("report", "out"),
        ("models", "AC1A"),
    ):
        ran = subprocess.run(
            [sys.executable, *options, "-m", "exfit", *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            check=False,
        )
        assert ran.returncode == 0, ran.stderr
        assert not re.search(rb"exfit\S+: EncodingWarning", ran.stderr), ran.stderr
    page = (tmp_path / "out" / "report.html").read_bytes()
    assert b"\r" not in page
    assert "²".encode() in page
