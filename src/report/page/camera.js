// The camera: turns about a target, moves, zooms; by mouse, touch and keyboard.

const FIELD_OF_VIEW = Math.PI / 7;

/**
 * A camera that looks at a ball of the given centre and radius, first from `from` with `upward` upward.
 * `covered` says how many pixels at the right edge something else covers: the picture is centred beside them. What is
 * farther from the ball's centre than `reach` is not drawn.
 */
function makeCamera(canvas, ball, reach, from, upward, covered, changed) {
  const camera = {};
  const shift = () => -covered() / Math.max(1, canvas.clientWidth);
  const look = (back, up) => {
    camera.back = unit(back);
    camera.right = unit(cross(up, camera.back));
    if (length(camera.right) < 0.5) camera.right = squareOn(camera.back)[0];
    camera.up = cross(camera.back, camera.right);
  };

  /** Shows the whole ball from a direction. */
  camera.fit = (back, up) => {
    look(back, up);
    camera.target = ball.centre;
    // Parts seldom fill their ball upward, often sideways.
    const wide = (canvas.clientWidth - covered()) / Math.max(1, canvas.clientHeight);
    camera.distance = (Math.max(0.9, 1.05 / wide) * ball.radius) / Math.sin(FIELD_OF_VIEW / 2);
    changed();
  };
  /** Stands back from where it looks until everything within `reach` is in the picture. */
  camera.fitAll = () => {
    camera.target = ball.centre;
    camera.distance = (0.9 * reach) / Math.sin(FIELD_OF_VIEW / 2);
    changed();
  };
  camera.reset = () => camera.fit(from, upward);
  camera.turn = (dx, dy) => {
    const back = add(add(camera.back, scale(camera.right, -dx)), scale(camera.up, dy));
    look(back, camera.up);
    changed();
  };
  camera.move = (dx, dy) => {
    const step = (2 * camera.distance * Math.tan(FIELD_OF_VIEW / 2)) / canvas.clientHeight;
    camera.target = add(camera.target, add(scale(camera.right, -dx * step), scale(camera.up, dy * step)));
    changed();
  };
  /** Zooms by a factor, keeping the place at a canvas position (in -1..1) where it is. */
  camera.zoom = (factor, x = 0, y = 0) => {
    const next = clamp(camera.distance * factor, 0.01 * ball.radius, Math.max(20 * ball.radius, 6 * reach));
    const half = (camera.distance - next) * Math.tan(FIELD_OF_VIEW / 2);
    const wide = canvas.clientWidth / canvas.clientHeight;
    camera.target = add(camera.target, add(scale(camera.right, (x - shift()) * half * wide), scale(camera.up, y * half)));
    camera.distance = next;
    changed();
  };
  /** Renews eye and matrix for the canvas size. */
  camera.update = () => {
    camera.eye = add(camera.target, scale(camera.back, camera.distance));
    const apart = length(sub(camera.target, ball.centre)) + reach;
    const far = camera.distance + apart;
    const near = Math.max(camera.distance - apart, far / 2000);
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const wide = canvas.clientWidth / Math.max(1, canvas.clientHeight);
    const { right, up, back, eye } = camera;
    const view = frame([right[0], up[0], back[0]], [right[1], up[1], back[1]], [right[2], up[2], back[2]],
      [-dot(right, eye), -dot(up, eye), -dot(back, eye)]);
    const lens = new Float32Array([f / wide, 0, 0, 0, 0, f, 0, 0, -shift(), 0, (far + near) / (near - far), -1,
      0, 0, (2 * far * near) / (near - far), 0]);
    camera.matrix = product(lens, view);
  };
  /** Ray direction through a canvas position in -1..1. */
  camera.ray = (x, y) => {
    const t = Math.tan(FIELD_OF_VIEW / 2);
    const wide = canvas.clientWidth / canvas.clientHeight;
    return unit(add(add(scale(camera.right, (x - shift()) * t * wide), scale(camera.up, y * t)), scale(camera.back, -1)));
  };
  /** Pixel of a point in space, or nothing behind the eye. */
  camera.pixel = (p) => {
    const m = camera.matrix;
    const row = (k) => m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k];
    const w = row(3);
    if (w <= 0) return null;
    return [(0.5 + 0.5 * row(0) / w) * canvas.clientWidth, (0.5 - 0.5 * row(1) / w) * canvas.clientHeight];
  };
  listen(canvas, camera);
  camera.reset();
  return camera;
}

/** Position of an event on the canvas in -1..1, y upward. */
function canvasPosition(canvas, event) {
  const box = canvas.getBoundingClientRect();
  return [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
}

function listen(canvas, camera) {
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  const lift = (event) => fingers.delete(event.pointerId);
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (other) {
      const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]) || 1;
      camera.zoom(apart(last) / apart([event.clientX, event.clientY]));
      camera.move(dx / 2, dy / 2);
    } else if (event.buttons & 6 || event.shiftKey) {
      camera.move(dx, dy);
    } else {
      camera.turn(dx * 0.008, dy * 0.008);
    }
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(clamp(event.deltaY, -200, 200) * 0.0016), ...canvasPosition(canvas, event));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (arrow && event.shiftKey) camera.move(-arrow[0] * 30, -arrow[1] * 30);
    else if (arrow) camera.turn(arrow[0] * 0.1, arrow[1] * 0.1);
    else if (event.key === "+" || event.key === "=") camera.zoom(0.85);
    else if (event.key === "-") camera.zoom(1 / 0.85);
    else if (event.key === "0") camera.reset();
    else return;
    event.preventDefault();
  });
}
