#!/usr/bin/python3
"""Writes what the controller samples in every cycle to samples.csv, at full double precision.

Runs beside display.py inside a run's folder. Standing still before the first motion is left out but for its last ten
cycles. Ends when the file `stop` appears and the buffer is empty.
"""

import collections
import json
import os
import time

import hal

POSITIONS = 10
BEFORE = 10

with open("job.json") as file:
    names, kinds = json.load(file)["columns"]
component = hal.component("rig")
stream = hal.stream(component, hal.sampler_base, kinds)
component.ready()
standing = collections.deque(maxlen=BEFORE)
moved = False
with open("samples.csv", "w") as out:
    out.write(",".join(names) + "\n")
    open("sampler.ready", "w").close()
    while True:
        last = os.path.exists("stop")
        while stream.readable:
            row = stream.read()
            if not moved:
                moved = bool(standing) and row[:POSITIONS] != standing[-1][:POSITIONS]
                standing.append(row)
                if not moved:
                    continue
                rows = standing
            else:
                rows = (row,)
            out.writelines(",".join(map(repr, row)) + "\n" for row in rows)
        if last:
            break
        time.sleep(0.01)
with open("sampler.json", "w") as out:
    json.dump({"lost": stream.num_overruns, "moved": moved}, out)
component.exit()
