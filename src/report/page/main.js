// Starts the page: reads the data, joins scene, camera, picking and time. Whatever fails leaves the static page whole.

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const motion = motionOf(data);
const part = data.part ? partOf(data.part) : null;
const canvas = byId("canvas");
const legend = document.querySelector(".legend");
const [bodies, links] = [bodiesOf(data), linksOf(data)];
const look = { paint: part ? 0 : 2, tool: "solid", rulings: true, path: false, surroundings: true, fixtures: true, machine: true };
let redraw = () => {};
const timeline = motion.times.length > 0 ? makeTimeline(data, motion, () => redraw()) : null;

/** Ball around the part, or around the tip path where there is no part. */
function surroundingBall() {
  const points = part ? part.points : motion.tips;
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; i++) {
    low[i % 3] = Math.min(low[i % 3], points[i]);
    high[i % 3] = Math.max(high[i % 3], points[i]);
  }
  if (!(low[0] <= high[0])) return { centre: [0, 0, 0], radius: 50 };
  return { centre: mix(low, high, 0.5), radius: Math.max(length(sub(high, low)) / 2, 1) };
}

/** From where to look first: at the cut side of the part, tool axes roughly upward. */
function firstView() {
  const sum = (list) => {
    let total = [0, 0, 0];
    for (let i = 0; 3 * i < list.length; i++) total = add(total, triple(list, i));
    return unit(total);
  };
  const up = motion.axes.length ? sum(motion.axes) : [0, 0, 1];
  const out = part ? sum(part.normals) : [0, 0, 0];
  const side = cross(up, out);
  if (length(side) < 0.2) return [[0.5, -1, 0.7], [0, 0, 1]];
  return [add(add(out, scale(unit(side), 0.55)), scale(up, 0.4)), up];
}

function drawTriad(camera) {
  const axes = [["X", [1, 0, 0], "#c63a22"], ["Y", [0, 1, 0], "#1a7f5a"], ["Z", [0, 0, 1], "#1d64a8"]];
  const shown = axes.map(([name, axis, colour]) => {
    const [x, y] = [dot(axis, camera.right) * 21, -dot(axis, camera.up) * 21];
    return [dot(axis, camera.back), `<path d="M0 0L${x} ${y}" stroke="${colour}" stroke-width="2.2" stroke-linecap="round"/>` +
      `<text x="${x * 1.32}" y="${y * 1.32 + 3.5}" fill="${colour}" class="mid">${name}</text>`];
  });
  byId("triad").innerHTML = shown.sort((a, b) => a[0] - b[0]).map((s) => s[1]).join("");
}

/** Marks that stay on their points in space: findings, and the pinned deviation. */
function makeMarks(camera) {
  const marks = [];
  const place = (mark, point, text) => {
    mark.element.className = mark.finding ? "mark finding" : "mark";
    mark.element.replaceChildren();
    if (text) mark.element.append(Object.assign(document.createElement("span"), { textContent: text }));
    mark.point = point;
  };
  const make = (finding) => {
    const mark = { element: document.createElement(finding ? "button" : "div"), finding, point: null };
    byId("marks").append(mark.element);
    marks.push(mark);
    return mark;
  };
  for (const finding of data.findings) {
    const mark = make(true);
    place(mark, finding.point, "");
    mark.element.title = finding.text;
    mark.element.addEventListener("click", () => timeline && finding.line && timeline.toLine(finding.line));
  }
  const pinned = make(false);
  return {
    pin: (hit) => place(pinned, hit && hit.point, hit && describe(hit, part.scale)),
    draw: () => {
      for (const { element, point } of marks) {
        const pixel = point && camera.pixel(point);
        element.hidden = !pixel;
        if (pixel) Object.assign(element.style, { left: `${pixel[0]}px`, top: `${pixel[1]}px` });
      }
    },
  };
}

function listenToPart(camera, marks) {
  const [readout, needle] = [byId("readout"), byId("needle")];
  const hitAt = (event) => pick(part, camera.eye, camera.ray(...canvasPosition(canvas, event)));
  let waiting = null;
  let pressed = [0, 0];
  const hover = () => {
    const event = waiting;
    waiting = null;
    const hit = event && hitAt(event);
    readout.hidden = !hit;
    needle.setAttribute("visibility", hit && hit.deviation !== null ? "visible" : "hidden");
    if (!hit) return;
    readout.textContent = describe(hit, part.scale);
    const box = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    readout.style.left = `${Math.min(x + 16, box.width - readout.offsetWidth - 8)}px`;
    readout.style.top = `${y > 70 ? y - 58 : y + 18}px`;
    if (hit.deviation !== null) needle.setAttribute("transform", `translate(2 ${154 - 136 * barShare(part.scale, hit.deviation)})`);
  };
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) {
      readout.hidden = true;
      return;
    }
    if (!waiting) requestAnimationFrame(hover);
    waiting = event;
  });
  canvas.addEventListener("pointerleave", () => {
    readout.hidden = true;
    needle.setAttribute("visibility", "hidden");
  });
  canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  canvas.addEventListener("click", (event) => {
    if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
    marks.pin(hitAt(event));
    redraw();
  });
  canvas.addEventListener("dblclick", (event) => {
    const hit = hitAt(event);
    const flute = data.tool.filter((s) => s.section === "flute").map((s) => decode(s.outline, Float32Array)).pop();
    if (hit && timeline && flute) timeline.set(nearestTime(motion, flute[flute.length - 2], hit.point));
  });
}

function listenToTools(camera) {
  const tools = byId("tools");
  tools.addEventListener("change", ({ target }) => {
    if (target.type === "checkbox") look[target.id] = target.checked;
    else look[target.name] = target.name === "paint" ? Number(target.value) : target.value;
    if (legend) legend.style.visibility = look.paint === 0 ? "visible" : "hidden";
    redraw();
  });
  const views = { x: [[1, 0, 0], [0, 0, 1]], y: [[0, -1, 0], [0, 0, 1]], z: [[0, 0, 1], [0, 1, 0]] };
  for (const button of tools.querySelectorAll("[data-view]")) {
    const view = views[button.dataset.view];
    const all = button.dataset.view === "all";
    button.addEventListener("click", () => (view ? camera.fit(...view) : all ? camera.fitAll() : camera.reset()));
  }
  canvas.addEventListener("keydown", (event) => {
    if (event.key !== " " || !timeline) return;
    event.preventDefault();
    timeline.toggle();
  });
}

function startView() {
  // Kept for printing: a picture that the printer asks for later.
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser offers no WebGL2");
  const draw = makeScene(gl, data, part, motion, bodies, links);
  let pending = false;
  let marks = null;
  // On a narrow screen the legend may lie over the part.
  const covered = () => (canvas.clientWidth > 640 && look.paint === 0 && part ? legend.offsetWidth + 14 : 0);
  document.body.dataset.view = "shown";
  const ball = surroundingBall();
  const reach = Math.max(4 * ball.radius, 1.01 * bodiesReach(bodies, links, ball.centre));
  const camera = makeCamera(canvas, ball, reach, ...firstView(), covered, () => redraw());
  const paintNow = () => {
    pending = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [wide, high] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    camera.update();
    draw(camera, look, timeline && poseAt(motion, timeline.time));
    drawTriad(camera);
    marks.draw();
  };
  redraw = () => {
    if (!pending) requestAnimationFrame(paintNow);
    pending = true;
  };
  camera.update();
  marks = makeMarks(camera);
  if (part) listenToPart(camera, marks);
  listenToTools(camera);
  new ResizeObserver(paintNow).observe(canvas);
  for (const id of ["tools", "hint"]) byId(id).hidden = false;
}

try {
  startView();
} catch (error) {
  byId("notice").textContent = `No 3D view: ${error.message}. Figures, plots and findings are complete without it.`;
}
// The first picture shows the tool at work, not at its start beside the part.
if (timeline) timeline.set(mix([motion.times[0], 0, 0], [motion.times[motion.times.length - 1], 0, 0], 0.35)[0]);
document.body.dataset.state = "ready";
