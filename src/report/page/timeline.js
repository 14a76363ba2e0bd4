// Time: the motion between samples, slider and play button, the NC block, the cursors of the plots.

/** The motion of the data: times, tips, axes and program lines, one a sample. */
const motionOf = (data) => ({
  times: decode(data.time, Float32Array),
  tips: decode(data.tip, Float32Array),
  axes: decode(data.axis, Float32Array),
  lines: decode(data.line, Uint32Array),
});

/** Last sample at or before a time, and the share of the way to the next one. */
function locate(times, time) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  const next = Math.min(low + 1, times.length - 1);
  const span = times[next] - times[low];
  return { at: low, next, share: span > 0 ? clamp((time - times[low]) / span, 0, 1) : 0 };
}

/** Tip and axis at a time, and between which samples it lies. */
function poseAt(motion, time) {
  const sample = locate(motion.times, time);
  const { at, next, share } = sample;
  return {
    sample,
    tip: mix(triple(motion.tips, at), triple(motion.tips, next), share),
    axis: unit(mix(triple(motion.axes, at), triple(motion.axes, next), share)),
  };
}

/** The time at which the axis, up to a height, comes nearest to a point. */
function nearestTime(motion, height, point) {
  let best = [Infinity, 0];
  for (let i = 0; i < motion.times.length; i++) {
    const axis = triple(motion.axes, i);
    const off = sub(point, triple(motion.tips, i));
    const apart = length(sub(off, scale(axis, clamp(dot(off, axis), 0, height))));
    if (apart < best[0]) best = [apart, motion.times[i]];
  }
  return best[1];
}

const LISTED = 13;

/** Slider, play button, block list, plot cursors and finding buttons; calls `moved` after each change of time. */
function makeTimeline(data, motion, moved) {
  const [slider, play, clock, pace] = ["time", "play", "clock", "pace"].map(byId);
  const [start, end] = [motion.times[0], motion.times[motion.times.length - 1]];
  const program = data.program.split(/\r?\n/);
  const rows = Array.from({ length: LISTED }, () => {
    const row = document.createElement("li");
    row.append(document.createElement("i"), document.createTextNode(""));
    byId("listing").append(row);
    return row;
  });
  const tracks = [...document.querySelectorAll(".axis")].map((element, i) => ({
    lists: { position: decode(data.axes[i].position, Float32Array), speed: decode(data.axes[i].speed, Float32Array) },
    outputs: [...element.querySelectorAll("output")],
  }));
  const cursors = [...document.querySelectorAll(".cursor")];
  const timeline = { time: start };
  let playing = false;
  let shownLine = -1;

  const showLine = (line) => {
    if (line === shownLine) return;
    shownLine = line;
    byId("block-line").textContent = `line ${line} of ${program.length}`;
    const first = clamp(line - 1 - (LISTED >> 1), 0, Math.max(0, program.length - LISTED));
    rows.forEach((row, i) => {
      row.className = first + i === line - 1 ? "now" : "";
      row.firstChild.textContent = first + i < program.length ? first + i + 1 : "";
      row.lastChild.textContent = program[first + i] ?? "";
    });
  };

  timeline.set = (time) => {
    timeline.time = clamp(time, start, end);
    slider.value = timeline.time;
    clock.textContent = `${timeline.time.toFixed(2)} / ${end.toFixed(2)} s`;
    const { at, next, share } = locate(motion.times, timeline.time);
    // A block is shown from its first instant on: between samples the later one's block is running.
    showLine(motion.lines[share > 0 ? next : at]);
    for (const track of tracks) {
      for (const output of track.outputs) {
        const list = track.lists[output.dataset.value];
        const digits = output.dataset.value === "speed" ? 0 : 3;
        output.textContent = written((1 - share) * list[at] + share * list[next], digits);
      }
    }
    const part = end > start ? (timeline.time - start) / (end - start) : 0;
    for (const cursor of cursors) {
      cursor.setAttribute("transform", `translate(${part * (cursor.dataset.right - cursor.dataset.left)})`);
    }
    moved();
  };
  timeline.toLine = (line) => {
    const at = motion.lines.indexOf(line);
    const after = at >= 0 ? at : motion.lines.findIndex((l) => l > line);
    timeline.set(motion.times[after >= 0 ? after : motion.times.length - 1]);
    showLine(line);
  };
  timeline.toggle = () => {
    playing = !playing;
    play.setAttribute("aria-label", playing ? "Pause" : "Play");
    play.querySelector("path").setAttribute("d", playing ? "M4 3h3v10H4zM9 3h3v10H9z" : "M4 2.5v11l9-5.5z");
    if (!playing) return;
    if (timeline.time >= end) timeline.time = start;
    let last = performance.now();
    const step = (now) => {
      if (!playing) return;
      const rate = Number(pace.value) || (end - start) / 20;
      const next = timeline.time + ((now - last) / 1000) * rate;
      last = now;
      timeline.set(next);
      if (next >= end) timeline.toggle();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  };

  slider.min = start;
  slider.max = end;
  slider.addEventListener("input", () => timeline.set(Number(slider.value)));
  slider.addEventListener("keydown", (event) => {
    // The browser's own step is a hundredth of the range; a block at a time is what one wants here.
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const { at, share } = locate(motion.times, timeline.time);
    const to = way > 0 ? at + 1 : share > 0 ? at : at - 1;
    timeline.set(motion.times[clamp(to, 0, motion.times.length - 1)]);
  });
  play.addEventListener("click", timeline.toggle);
  for (const plot of document.querySelectorAll(".axis svg")) {
    const drag = (event) => {
      if (event.type === "pointermove" && !event.buttons) return;
      const box = plot.getBoundingClientRect();
      const { left, right } = plot.querySelector(".cursor").dataset;
      const x = ((event.clientX - box.left) / box.width) * plot.viewBox.baseVal.width;
      timeline.set(start + ((x - left) / (right - left)) * (end - start));
    };
    plot.addEventListener("pointerdown", drag);
    plot.addEventListener("pointermove", drag);
  }
  for (const button of document.querySelectorAll("[data-line]")) {
    button.addEventListener("click", () => timeline.toLine(Number(button.dataset.line)));
  }
  for (const id of ["transport", "block-card"]) byId(id).hidden = false;
  return timeline;
}
