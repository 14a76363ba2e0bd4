#!/usr/bin/python3
"""Runs NC programs on a headless LinuxCNC. Needs the package linuxcnc-uspace, a C compiler, and root.

    rig.py accept [options] PROGRAM         the interpreter alone: its canonical calls on stdout, its complaint on stderr
    rig.py play [options] PROGRAM CSV       the whole controller: what it samples in every cycle of 1 ms goes to CSV

`play` prints {"status": ..., "messages": [...]}: status "ok" when the program ended as it should, "error" when the
controller complained, "endless" when it took too long, "broken" when the controller did not come up or samples were lost.
Exit status 0 when the program was accepted or played to its end, 1 otherwise, 2 for wrong arguments.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machines import MACHINES, altered, columns, files

HERE = Path(__file__).resolve().parent
NOBODY = 65534

# Pid, ipc, network and mounts of its own: runs do not meet, nothing else on this computer is touched, and every process
# of a run ends with it. Interpreter and launcher keep shared memory and a lock in /dev/shm and /tmp. The dynamic loader
# ignores LD_PRELOAD for a setuid program, so a plain copy of the realtime part takes its place; it refuses to run as root.
ISOLATED = "unshare --ipc --pid --net --mount --fork --kill-child --mount-proc bash -c".split() + ["""
mount --bind "$0" /mnt && mount -t tmpfs -o mode=1777 none /tmp && mount -t tmpfs -o mode=1777 none /dev/shm &&
cp /usr/bin/rtapi_app /tmp/rtapi_app && chmod 755 /tmp/rtapi_app && mount --bind /tmp/rtapi_app /usr/bin/rtapi_app &&
cd /mnt &&
exec setpriv --reuid=65534 --regid=65534 --clear-groups env -i PATH=/usr/bin:/bin HOME=/mnt LANG=C "$@"
"""]


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("action", choices=["accept", "play"])
    parser.add_argument("program", type=Path)
    parser.add_argument("csv", type=Path, nargs="?")
    parser.add_argument("--machine", choices=MACHINES, required=True)
    parser.add_argument("--tool", type=int, default=1, help="tool number")
    parser.add_argument("--length", type=float, default=100.0, help="tool length, mm")
    parser.add_argument("--system", type=int, default=1, help="coordinate system that has the offset: 1 is G54")
    parser.add_argument("--offset", type=float, nargs=3, default=[0.0, 0.0, 0.0], help="work offset, mm")
    parser.add_argument("--geometry", action="append", default=[], metavar="NAME=VALUE", help="mm: pivot, or a module's pin")
    parser.add_argument("--identity-first", action="store_true", help="kinematics 0 is identity, 1 is TCP")
    parser.add_argument("--m428-type", type=int, choices=[0, 1], default=0, help="kinematics that M428 selects")
    parser.add_argument("--speed", type=float, default=10.0, help="controller seconds in a second")
    parser.add_argument("--limit", type=float, default=600.0, help="controller seconds the program may take")
    given = parser.parse_args()
    if (given.action == "play") != (given.csv is not None):
        parser.error("play takes PROGRAM and CSV, accept takes PROGRAM")
    return given


def fill(folder, given):
    """Puts everything that a run needs into its folder."""
    machine = altered(MACHINES[given.machine], dict(pair.split("=") for pair in given.geometry))
    job = {name: value for name, value in vars(given).items() if not isinstance(value, Path)}
    for name, text in files(machine, job).items():
        (folder / name).write_text(text)
    names, _, kinds = zip(*columns(machine))
    job["columns"] = [names, "".join(kinds)]
    (folder / "job.json").write_text(json.dumps(job))
    shutil.copy(given.program, folder / "program.ngc")
    for script in ("display.py", "sampler.py"):
        shutil.copy(HERE / script, folder / script)
        (folder / script).chmod(0o755)


def isolated(folder, command, **options):
    """Runs a command in a run's folder, which it sees as /mnt."""
    for path in (folder, *folder.iterdir()):
        os.chown(path, NOBODY, NOBODY)
    return subprocess.run([*ISOLATED, folder, *command], stdin=subprocess.DEVNULL, check=False, **options)


def accept(folder):
    command = "rs274 -g -n 2 -i machine.ini -t tool.tbl -v machine.var program.ngc".split()
    run = isolated(folder, command, capture_output=True, text=True, timeout=120)
    sys.stdout.write(run.stdout)
    sys.stderr.write(run.stderr.replace("executing\n", ""))
    return run.returncode


def play(folder, given):
    clock = folder / "clock.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", clock, HERE / "clock.c"], check=True)
    environment = {
        "LD_PRELOAD": "/mnt/clock.so",
        "RIG_SPEED": given.speed,
        "RIG_REALTIME_NS": time.time_ns(),
        "RIG_MONOTONIC_NS": time.monotonic_ns(),
    }
    command = [f"{name}={value}" for name, value in environment.items()] + ["linuxcnc", "-r", "machine.ini"]
    log = folder / "log"
    limit = given.limit / given.speed + 200
    with log.open("w") as out:
        try:
            isolated(folder, command, stdout=out, stderr=out, timeout=limit)
        except subprocess.TimeoutExpired:
            out.write("the controller did not end\n")
    result = folder / "result.json"
    if result.exists():
        text = result.read_text()
    else:
        text = json.dumps({"status": "broken", "messages": log.read_text(errors="replace").splitlines()})
    samples = folder / "samples.csv"
    if samples.exists():
        shutil.copyfile(samples, given.csv)
    print(text)
    return 0 if json.loads(text)["status"] == "ok" else 1


def main():
    given = arguments()
    with tempfile.TemporaryDirectory(prefix="rig-") as name:
        folder = Path(name)
        fill(folder, given)
        return accept(folder) if given.action == "accept" else play(folder, given)


if __name__ == "__main__":
    sys.exit(main())
