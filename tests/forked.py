"""`petcontact` as a program of tests whose processes are forked from one that has imported it: .02
s of start-up, not .6 s.

`program()` is the path of an executable that takes words, folder, environment, streams and signals
as `petcontact` does, and ends with its status; after `-c` it takes a program, as `python` does. It
is a client: behind it stands a server that has imported petcontact, but has started neither PETSc
nor MPI, which do not survive a fork. Whatever an interpreter reads when it starts (encodings,
threads of BLAS, ranks of a launcher, streams that are closed) makes the client start `python -m
petcontact` instead. Limits of resources are the server's: tests of those start the real one, as do
some others.
"""

import os
import sys

AT_THE_START = (
    "LANG",
    "LC_",
    "LD_",
    "OMP_",
    "OPENBLAS_",
    "PETCONTACT_NATIVE",
    "PMI_",
    "PYTHON",
    "SLURM_",
)
"""Beginnings of variables that are read once, or that name a stream of the client, as those of
MPICH's launcher do; Open MPI's ranks are told an address."""
DEFAULTS = {"OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}
"""Of the server, whatever the tests have: threads do not survive a fork either. Who asks for more
threads gets a process of its own."""
SIGNALS = (1, 2, 15, 24)  # SIGHUP, SIGINT, SIGTERM, SIGXCPU: what is passed on


def starting(environment):
    """The part of an environment that a process cannot change once it runs."""
    return {
        key: value
        for key, value in environment.items()
        if key.startswith(AT_THE_START) and key != "PYTHONPATH"
    }


# --- the client: modules of Python that are loaded anyway, and sockets


def call(address: str, words: list[str]) -> int:
    """Have the server do it; the exit status."""
    import marshal
    import signal
    import socket

    start = [sys.executable, *([] if words[:1] == ["-c"] else ["-m", "petcontact"]), *words]
    try:
        for stream in (0, 1, 2):
            os.fstat(stream)
    except OSError:
        os.execv(sys.executable, start)
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(address)
        request = marshal.dumps((words, os.getcwd(), dict(os.environ)))
        socket.send_fds(server, [len(request).to_bytes(8, "big")], [0, 1, 2])
        server.sendall(request)
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, lambda number, frame: server.send(bytes([number])))
        answer = int.from_bytes(server.recv(4), "big", signed=True)
    if answer == ELSEWHERE:
        os.execv(sys.executable, start)
    if answer < 0:
        if -answer != signal.SIGKILL:
            signal.signal(-answer, signal.SIG_DFL)
        os.kill(os.getpid(), -answer)
    return answer


ELSEWHERE = 1000
"""Not a status: the client is to start a process of its own."""

# --- the server


def warm_up() -> None:
    """Import what commands use, but for PETSc and MPI; the libraries of those are mapped, not
    started."""
    import ctypes
    import gc
    import importlib.util
    import pkgutil
    import threading
    from pathlib import Path

    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # as in `commands.main.entry`
    import petcontact
    from petcontact.model.case import load

    for module in pkgutil.walk_packages(petcontact.__path__, "petcontact."):
        if not module.name.endswith(("__main__", "_kernels")):
            importlib.import_module(module.name)
    importlib.import_module("matplotlib.backends.backend_agg")
    load(
        Path(petcontact.__file__).parents[1] / "configs" / "example1.toml"
    )  # the first use builds validators
    for place in (importlib.util.find_spec("petsc4py") or ()).submodule_search_locations or ():
        for library in Path(place).glob("lib/**/PETSc.*.so"):
            ctypes.CDLL(str(library))
    started = {name for name in ("petsc4py.PETSc", "mpi4py.MPI") if name in sys.modules}
    assert not started and threading.active_count() == 1 == len(os.listdir("/proc/self/task")), (
        started
    )
    gc.collect()
    gc.freeze()


def serve(address: str) -> None:
    """A child for each client, until standard input ends, which is when the tests do."""
    import selectors
    import socket

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(address)
        listener.listen(64)
        warm_up()
        print("ready", flush=True)
        with selectors.DefaultSelector() as ready:
            ready.register(listener, selectors.EVENT_READ)
            ready.register(0, selectors.EVENT_READ)
            while all(key.fd != 0 for key, _ in ready.select()):
                client, _ = listener.accept()
                if os.fork() == 0:
                    listener.close()
                    keep(client)
                client.close()
                os.waitid(
                    os.P_ALL, 0, os.WEXITED | os.WNOHANG
                )  # one each time: zombies do not become many


def keep(client) -> None:
    """Fork the command and wait for it: signals in, the status out. A client that is killed takes
    it along."""
    import marshal
    import select
    import signal
    import socket

    head, streams, *_ = socket.recv_fds(client, 8, 3)
    request = b""
    while len(request) < int.from_bytes(head, "big"):
        request += client.recv(1 << 20)
    words, folder, environment = marshal.loads(request)
    if starting(DEFAULTS | environment) != starting(os.environ):
        status = ELSEWHERE
    else:
        command = os.fork()
        if command == 0:
            client.close()
            become(words, folder, environment, streams)
        ended = os.pidfd_open(command)
        while ended not in (ready := select.select([ended, client], [], [])[0]):
            numbers = client.recv(16) if client in ready else b""
            for number in numbers or [signal.SIGKILL]:
                os.kill(command, number)
            if not numbers:
                break
        status = os.waitstatus_to_exitcode(os.waitpid(command, 0)[1])
    try:
        client.sendall(status.to_bytes(4, "big", signed=True))
    finally:
        os._exit(0)


def become(words, folder, environment, streams) -> None:
    """Be `petcontact WORDS` in a process that was forked; does not return."""
    import atexit
    import signal
    import traceback

    status = 70
    try:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_DFL)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        for name, number, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
            old = getattr(sys, name)
            buffering = 1 if number == 2 or os.isatty(number) else -1
            stream = open(number, mode, buffering, old.encoding, old.errors, closefd=False)  # noqa: SIM115
            setattr(sys, name, stream)
            setattr(sys, f"__{name}__", stream)  # petsc4py writes in C where the two are one
        sys.argv = ["petcontact", *words]
        sys.path[0:1] = filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))
        from petcontact.commands.main import entry

        try:
            if words[:1] == ["-c"]:
                status = 1
                sys.argv = words[:1] + words[2:]
                exec(words[1], {"__name__": "__main__"})
                status = 0
            else:
                entry()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
        except Exception:
            traceback.print_exc()
        # the end of an interpreter, without the rubbish of one that has imported everything
        atexit._run_exitfuncs()
        if "petsc4py.PETSc" in sys.modules:
            sys.modules["petsc4py.PETSc"]._finalize()
        if "mpi4py.MPI" in sys.modules and not sys.modules["mpi4py.MPI"].Is_finalized():
            sys.modules["mpi4py.MPI"].Finalize()
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(status)


# --- the tests


_servers: list = []


def program() -> str:
    """Path of the executable; the server starts with the first call and ends with this process."""
    if not _servers:
        import atexit
        import shlex
        import subprocess
        import tempfile
        from pathlib import Path

        folder = tempfile.TemporaryDirectory(prefix="petcontact-")
        address, here = f"{folder.name}/socket", Path(__file__).resolve()
        environment = os.environ | DEFAULTS
        environment["PYTHONPATH"] = os.pathsep.join(
            [str(here.parents[1]), environment.get("PYTHONPATH", "")]
        )
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        words = [sys.executable, str(here), "serve", address]
        server = subprocess.Popen(
            words, env=environment, start_new_session=True, cwd=folder.name, **pipes
        )
        assert server.stdout is not None and server.stdout.readline() == b"ready\n"
        client = Path(folder.name, "petcontact")
        words = " ".join(map(shlex.quote, [sys.executable, "-IS", str(here), "call", address]))
        client.write_text(f'#!/bin/sh\nexec {words} "$@"\n')
        client.chmod(0o755)
        _servers.extend([str(client), server, folder])
        atexit.register(server.communicate)
    return _servers[0]


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(sys.argv[2])
    else:
        sys.exit(call(sys.argv[2], sys.argv[3:]))
