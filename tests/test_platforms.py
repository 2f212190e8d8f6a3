"""What only some systems have is used only where the system has been asked for; so all modules can be
imported on Linux, macOS and Windows alike."""

import ast
from collections.abc import Iterator

import pytest

from tests.conftest import REPO

PRODUCT = ("capture_app", "ingest", "omomo_core", "render")
MODULES = {
    *("fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"),
    *("msvcrt", "nt", "winreg", "OpenGL.EGL", "multiprocessing.forkserver"),
}
MEMBERS = {
    "os": {
        *("chown", "chroot", "fchmod", "fchown", "fork", "forkpty", "fsync", "getegid", "geteuid"),
        *("getgid", "getloadavg", "getpgid", "getuid", "killpg", "lchown", "mkfifo", "nice"),
        *("open", "posix_spawn", "sched_getaffinity", "sched_setaffinity", "setsid", "setuid"),
        *("statvfs", "sysconf", "uname", "wait", "waitpid", "O_DIRECTORY", "O_NOFOLLOW"),
    },
    "signal": {
        *("SIGALRM", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGSTOP", "SIGUSR1"),
        *("SIGUSR2", "SIGWINCH", "alarm", "pause", "pthread_kill", "pthread_sigmask"),
        *("set_wakeup_fd", "setitimer", "sigwait"),
    },
    "socket": {"AF_UNIX", "SO_REUSEADDR", "SO_REUSEPORT", "socketpair"},
    "ctypes": {"CDLL"},
}
WORDS = ("/proc/", "/sys/", "/dev/", "/tmp", "egl", "forkserver", "fork")
"""Constants that are, or begin like, one of these."""
NEED_NO_QUESTION = {
    # What was appended is flushed through the file that is open for writing: every system can.
    ("omomo_core/learning/evaluation/evaluation_runner.py", "os.fsync"),
    ("capture_app/web/site.py", "os.fsync"),
    ("ingest/scan/scan_work.py", "os.fsync"),
    # It asks inside, once for both kinds of system.
    ("omomo_core/system.py", "os.open"),
    ("omomo_core/system.py", "os.fsync"),
}


def unguarded(source: str) -> list[str]:
    """What a module uses that some systems lack, without having asked for the system."""
    return sorted(set(_in_block(ast.parse(source).body)))


def _in_block(body: list[ast.stmt]) -> Iterator[str]:
    for statement in body:
        if isinstance(statement, ast.If) and _asks(statement.test):
            if isinstance(statement.body[-1], ast.Return | ast.Raise):
                return  # what follows is for the other systems
            continue
        yield from _in_node(statement)


def _in_node(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.IfExp) and _asks(node.test):
        return
    yield from _uses(node)
    for _, value in ast.iter_fields(node):
        if isinstance(value, list) and value and isinstance(value[0], ast.stmt):
            yield from _in_block(value)
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _in_node(child)


def _asks(test: ast.expr) -> bool:
    return any(ast.unparse(n) in ("sys.platform", "os.name") for n in ast.walk(test))


def _uses(node: ast.AST) -> Iterator[str]:
    match node:
        case ast.Import():
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        case ast.ImportFrom(module=str(module)):
            names = {module, *(f"{module}.{alias.name}" for alias in node.names)}
            members = {f"{module}.{name}" for name in MEMBERS.get(module, ())}
            yield from names & (MODULES | members)
        case ast.Attribute(value=ast.Name(id=owner)) if node.attr in MEMBERS.get(owner, ()):
            yield f"{owner}.{node.attr}"
        case ast.Constant(value=str(text)) if text in WORDS or text.startswith(WORDS[:4]):
            yield text
        case ast.keyword(arg="preexec_fn"):
            yield "preexec_fn"
        case ast.Call(func=ast.Attribute(attr="read_text" | "write_text" as name)):
            named = any(word.arg == "encoding" for word in node.keywords)
            if not named and len(node.args) <= (name == "write_text"):
                yield "the encoding of the system"
        case _:
            pass


def test_the_product_asks_before_it_uses_what_a_system_may_lack():
    found = {
        (file, use)
        for part in PRODUCT
        for path in sorted((REPO / part).rglob("*.py"))
        for file in [str(path.relative_to(REPO))]
        for use in unguarded(path.read_text(encoding="utf-8"))
    }
    assert found == NEED_NO_QUESTION


@pytest.mark.parametrize(
    ("source", "use"),
    [
        ("import fcntl", "fcntl"),
        ("def f():\n    import resource", "resource"),
        ("from multiprocessing import forkserver", "multiprocessing.forkserver"),
        ("from os import fork", "os.fork"),
        ("with a:\n    os.sched_getaffinity(0)", "os.sched_getaffinity"),
        ("os.kill(pid, signal.SIGKILL)", "signal.SIGKILL"),
        ("try:\n    pass\nexcept OSError:\n    open('/proc/meminfo')", "/proc/meminfo"),
        ("Popen(a, preexec_fn=b)", "preexec_fn"),
        ("path.read_text()", "the encoding of the system"),
        ("if sys.platform == 'linux':\n    pass\nimport fcntl", "fcntl"),
    ],
)
def test_a_use_without_a_question_is_found(source: str, use: str):
    assert unguarded(source) == [use]


@pytest.mark.parametrize(
    "source",
    [
        "if sys.platform == 'linux':\n    import fcntl\nelse:\n    import msvcrt",
        "def f():\n    if sys.platform == 'win32':\n        return\n    import resource",
        "n = len(os.sched_getaffinity(0)) if sys.platform == 'linux' else 1",
        "path.read_text(encoding='utf-8')",
        "signal.SIGTERM, os.cpu_count(), 'process'",
    ],
)
def test_a_use_after_the_question_is_none(source: str):
    assert unguarded(source) == []
