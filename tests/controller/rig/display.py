#!/usr/bin/python3
"""The controller's user interface in a run: homes, plays the program once, has it sampled, and reports.

The launcher starts it in the run's folder, where it reads job.json and writes samples.csv and result.json; when it ends,
the controller is shut down. Its clock may run fast, see clock.c: seconds are the controller's.
"""

import json
import os
import subprocess
import sys
import time

import linuxcnc

with open("job.json") as file:
    JOB = json.load(file)
SPEED = JOB["speed"]
# A busy computer needs a real minute.
PATIENCE = 60.0 * SPEED
# Blocks that the controller reads ahead before it starts to move.
READ_AHEAD = 1000
ERRORS = (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR)
messages = []


def finish(status):
    with open("result.part", "w") as out:
        json.dump({"status": status, "messages": messages}, out)
    os.rename("result.part", "result.json")
    sys.exit()


def wait(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            messages.append("waited in vain: " + what)
            finish("broken")
        time.sleep(0.01)


def polled(condition):
    def check():
        status.poll()
        return condition()

    return check


def connected():
    try:
        linuxcnc.stat().poll()
        return True
    except linuxcnc.error:
        return False


def setp(pin, value):
    subprocess.run(["halcmd", "-s", "setp", pin, str(value)], check=True)


def complaints():
    """Takes over what the controller says; whether it complains."""
    complained = False
    while message := errors.poll():
        messages.append(message[1])
        complained |= message[0] in ERRORS
    return complained


def get_ready():
    command.state(linuxcnc.STATE_ESTOP_RESET)
    wait(polled(lambda: status.task_state != linuxcnc.STATE_ESTOP), "emergency stop reset")
    command.state(linuxcnc.STATE_ON)
    wait(polled(lambda: status.task_state == linuxcnc.STATE_ON), "machine on")
    command.mode(linuxcnc.MODE_MANUAL)
    wait(polled(lambda: status.task_mode == linuxcnc.MODE_MANUAL), "manual mode")
    command.home(-1)
    wait(polled(lambda: all(status.homed[: status.joints])), "homing")
    command.mode(linuxcnc.MODE_AUTO)
    wait(polled(lambda: status.task_mode == linuxcnc.MODE_AUTO), "automatic mode")
    program = os.path.abspath("program.ngc")
    command.program_open(program)
    wait(polled(lambda: status.file == program), "the program")


def play():
    """Plays the program. The feed is held until blocks are read ahead, so that motion does not depend on the computer."""
    setp("motion.feed-hold", 1)
    command.auto(linuxcnc.AUTO_RUN, 0)
    start = grown = time.monotonic()
    held, deepest, running = True, 0, False
    while time.monotonic() < start + JOB["limit"]:
        status.poll()
        if complaints():
            command.abort()
            return "error"
        now = time.monotonic()
        if status.queue > deepest:
            deepest, grown = status.queue, now
        if held and (deepest >= READ_AHEAD or now > grown + 0.3 * SPEED):
            setp("motion.feed-hold", 0)
            held = False
        idle = status.interp_state == linuxcnc.INTERP_IDLE
        running |= not idle
        if running and idle and status.exec_state == linuxcnc.EXEC_DONE and status.inpos and status.queue == 0:
            return "ok"
        time.sleep(0.01)
    command.abort()
    return "endless"


wait(connected, "the controller")
status, command, errors = linuxcnc.stat(), linuxcnc.command(), linuxcnc.error_channel()
get_ready()
reader = subprocess.Popen(["./sampler.py"])
wait(lambda: os.path.exists("sampler.ready") or reader.poll() is not None, "the sampler")
setp("sampler.0.enable", 1)
outcome = play()
time.sleep(0.1)
status.poll()
if outcome == "ok" and (complaints() or status.task_state != linuxcnc.STATE_ON):
    outcome = "error"
setp("sampler.0.enable", 0)
open("stop", "w").close()
reader.wait()
with open("sampler.json") as file:
    sampled = json.load(file)
if sampled["lost"] or not sampled["moved"]:
    messages.append("samples were lost" if sampled["lost"] else "nothing moved")
    outcome = "broken"
finish(outcome)
