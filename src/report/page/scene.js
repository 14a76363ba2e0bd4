// What is drawn: part, surroundings, bodies, rulings, tip path, and the tool as a surface of revolution.

/** Lists of a mesh of the data. */
const meshOf = (data) => ({
  points: decode(data.points, Float32Array),
  normals: decode(data.normals, Float32Array),
  triangles: decode(data.triangles, Uint32Array),
});

/** The part with its measures, `measure` as triples (deviation, 1 where uncut, strip). */
function partOf(data) {
  const part = meshOf(data);
  part.scale = data.scale;
  part.deviation = decode(data.deviation, Float32Array);
  part.uncut = decode(data.uncut, Float32Array);
  part.strip = decode(data.strip, Float32Array);
  part.measure = new Float32Array(part.points.length);
  for (let i = 0; i < part.deviation.length; i++) {
    part.measure.set([part.deviation[i], part.uncut[i], part.strip[i]], 3 * i);
  }
  return part;
}

/** Pairs of points: edges that belong to one triangle only. */
function border(mesh) {
  const seen = new Map();
  const count = mesh.points.length / 3;
  for (let i = 0; i < mesh.triangles.length; i++) {
    const a = mesh.triangles[i];
    const b = mesh.triangles[i % 3 === 2 ? i - 2 : i + 1];
    const key = Math.min(a, b) * count + Math.max(a, b);
    seen.set(key, (seen.get(key) || 0) + 1);
  }
  const ends = [];
  for (const [key, uses] of seen) {
    if (uses === 1) ends.push(...triple(mesh.points, Math.floor(key / count)), ...triple(mesh.points, key % count));
  }
  return new Float32Array(ends);
}

/** Surface of revolution of an outline of (height, radius) pairs; corners sharper than 20 degrees stay sharp. */
function revolve(outline) {
  const AROUND = 72;
  const rings = [];
  const count = outline.length / 2;
  const corner = (i) => [outline[2 * i], outline[2 * i + 1]];
  const normalOf = (i) => {
    const [[h, r], [k, s]] = [corner(i), corner(i + 1)];
    const size = Math.hypot(k - h, s - r) || 1;
    return [(r - s) / size, (k - h) / size];
  };
  for (let i = 0; i + 1 < count; i++) {
    const own = normalOf(i);
    const shared = (j) => {
      if (j < 0 || j + 1 >= count) return own;
      const other = normalOf(j);
      if (own[0] * other[0] + own[1] * other[1] < Math.cos(Math.PI / 9)) return own;
      return [own[0] + other[0], own[1] + other[1]];
    };
    rings.push([corner(i), shared(i - 1)], [corner(i + 1), shared(i + 1)]);
  }
  const points = [];
  const normals = [];
  const triangles = [];
  rings.forEach(([[height, radius], [axial, radial]], ring) => {
    for (let k = 0; k <= AROUND; k++) {
      const angle = (2 * Math.PI * k) / AROUND;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      points.push(radius * c, radius * s, height);
      normals.push(...unit([radial * c, radial * s, axial]));
      if (ring % 2 === 0 && k < AROUND) {
        const a = ring * (AROUND + 1) + k;
        const b = a + AROUND + 1;
        triangles.push(a, a + 1, b, b, a + 1, b + 1);
      }
    }
  });
  return { points: new Float32Array(points), normals: new Float32Array(normals), triangles: new Uint32Array(triangles) };
}

const TOOL_COLOURS = { flute: [0.86, 0.68, 0.30], shank: [0.70, 0.75, 0.80], holder: [0.36, 0.41, 0.48] };
const SURROUNDINGS_COLOUR = [0.74, 0.77, 0.81];
const FIXTURE_COLOUR = [0.47, 0.60, 0.66];
const MACHINE_COLOUR = [0.60, 0.62, 0.66];
const MACHINE_OPACITY = 0.28;

/** Everything on the graphics card, and how it is drawn. Throws where WebGL2 is missing. */
function makeScene(gl, data, part, motion, bodies, links) {
  const surface = program(gl, SURFACE_VERTEX, SURFACE_FRAGMENT, ["position", "normal", "measure"]);
  const line = program(gl, LINE_VERTEX, LINE_FRAGMENT, ["position", "tint"]);
  const flat = (list) => new Float32Array(list.length);
  const upload = (m) => vertexArray(gl, [m.points, m.normals, m.measure || flat(m.points)], m.triangles);
  const tinted = (ends, tint) => {
    const tints = new Float32Array(ends.length);
    for (let i = 0; i < ends.length / 3; i++) tints.set(tint(i), 3 * i);
    return vertexArray(gl, [ends, tints]);
  };
  const stripColours = data.colours.strips.map(rgb);
  const rulingStrips = decode(data.rulings.strips, Uint32Array);
  const dark = (i) => scale(stripColours[rulingStrips[i >> 1] % stripColours.length], 0.5);
  const model = {
    part: part && upload(part),
    border: part && tinted(border(part), () => [0.16, 0.2, 0.26]),
    bodies: bodies.map((body) => ({ fixture: body.fixture, link: body.link, ...upload(body) })),
    surroundings: data.surroundings.map((m) => upload(meshOf(m))),
    rulings: tinted(decode(data.rulings.ends, Float32Array), dark),
    path: tinted(motion.tips, () => [0.1, 0.25, 0.45]),
    tool: data.tool.map((s) => ({ colour: TOOL_COLOURS[s.section], ...upload(revolve(decode(s.outline, Float32Array))) })),
  };

  const flatten = (colours) => new Float32Array(colours.flatMap(rgb));
  gl.useProgram(surface.linked);
  for (const name of ["overcut", "undercut", "uncut", "strips"]) gl.uniform3fv(surface.places[name], flatten(data.colours[name]));
  if (part) {
    const s = part.scale;
    gl.uniform4f(surface.places.bounds, s.overcut_tolerance, s.overcut_end, s.undercut_tolerance, s.undercut_end);
  }
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.clearColor(0, 0, 0, 0);

  const drawSurface = (mesh, { paint = 2, colour = [1, 1, 1], place = IDENTITY, opacity = 1, twoSided = false }) => {
    gl.uniform1i(surface.places.paint, paint);
    gl.uniform3fv(surface.places.plain, colour);
    gl.uniformMatrix4fv(surface.places.model, false, place);
    gl.uniform1f(surface.places.opacity, opacity);
    gl.uniform1i(surface.places.twoSided, twoSided ? 1 : 0);
    gl.bindVertexArray(mesh.array);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
  };
  const drawLines = (lines, mode, opacity) => {
    gl.uniform1f(line.places.opacity, opacity);
    gl.bindVertexArray(lines.array);
    gl.drawArrays(mode, 0, lines.count);
  };

  /** Draws one picture: `look` says what is shown, `pose` where the tool stands. */
  return (camera, look, pose) => {
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(surface.linked);
    gl.uniformMatrix4fv(surface.places.camera, false, camera.matrix);
    for (const name of ["eye", "up", "right"]) gl.uniform3fv(surface.places[name], camera[name]);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    if (model.part) drawSurface(model.part, { paint: look.paint, colour: [0.80, 0.83, 0.86], twoSided: true });
    if (look.surroundings) model.surroundings.forEach((m) => drawSurface(m, { colour: SURROUNDINGS_COLOUR }));
    const drawBodies = (fixture, colour, opacity) => {
      for (const body of model.bodies.filter((body) => body.fixture === fixture)) {
        if (body.link >= 0 && !pose) continue;
        drawSurface(body, { colour, opacity, place: body.link < 0 ? IDENTITY : linkPlace(links[body.link], pose.sample) });
      }
    };
    if (look.fixtures) drawBodies(true, FIXTURE_COLOUR, 1);
    const tool = (opacity) => {
      const [x, y] = squareOn(pose.axis);
      const place = frame(x, y, pose.axis, pose.tip);
      model.tool.forEach((piece) => drawSurface(piece, { colour: piece.colour, place, opacity }));
    };
    if (pose && look.tool === "solid") tool(1);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.enable(gl.BLEND);
    gl.useProgram(line.linked);
    gl.uniformMatrix4fv(line.places.camera, false, camera.matrix);
    if (model.border) drawLines(model.border, gl.LINES, 0.8);
    if (look.rulings) drawLines(model.rulings, gl.LINES, 0.6);
    if (look.path) drawLines(model.path, gl.LINE_STRIP, 0.9);
    gl.useProgram(surface.linked);
    gl.enable(gl.CULL_FACE);
    if (pose && look.tool === "clear") tool(0.45);
    if (look.machine) {
      // Whatever of the machine stands behind something clear shows through it.
      gl.depthMask(false);
      drawBodies(false, MACHINE_COLOUR, MACHINE_OPACITY);
      gl.depthMask(true);
    }
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.BLEND);
  };
}
