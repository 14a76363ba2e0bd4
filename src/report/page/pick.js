// Where a ray meets the part, and what was measured there.

/** The nearest hit of a ray with the part, or nothing: point, deviation (null where uncut), strip. */
function pick(part, eye, ray) {
  let best = null;
  let nearest = Infinity;
  const { points, triangles } = part;
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i];
    const b = 3 * triangles[i + 1];
    const c = 3 * triangles[i + 2];
    // Moeller and Trumbore 1997, written out: this runs over all triangles at each move of the pointer.
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
    const px = ray[1] * vz - ray[2] * vy, py = ray[2] * vx - ray[0] * vz, pz = ray[0] * vy - ray[1] * vx;
    const det = ux * px + uy * py + uz * pz;
    if (det === 0) continue;
    const tx = eye[0] - points[a], ty = eye[1] - points[a + 1], tz = eye[2] - points[a + 2];
    const s = (tx * px + ty * py + tz * pz) / det;
    if (s < 0 || s > 1) continue;
    const qx = ty * uz - tz * uy, qy = tz * ux - tx * uz, qz = tx * uy - ty * ux;
    const t = (ray[0] * qx + ray[1] * qy + ray[2] * qz) / det;
    if (t < 0 || s + t > 1) continue;
    const far = (vx * qx + vy * qy + vz * qz) / det;
    if (far > 0 && far < nearest) {
      nearest = far;
      best = [i, s, t];
    }
  }
  if (!best) return null;
  const [i, s, t] = best;
  const corners = [triangles[i], triangles[i + 1], triangles[i + 2]];
  const weights = [1 - s - t, s, t];
  const blend = (list) => corners.reduce((sum, corner, k) => sum + weights[k] * list[corner], 0);
  const uncut = blend(part.uncut);
  const closest = corners[weights.indexOf(Math.max(...weights))];
  return {
    point: add(eye, scale(ray, nearest)),
    deviation: uncut > 0.5 ? null : blend(part.deviation) / (1 - uncut),
    strip: part.strip[closest],
  };
}

/** Share of the colour bar at a deviation, -1 to 1: half way at the tolerances. */
function barShare(s, deviation) {
  const size = Math.abs(deviation);
  const [tolerance, end] = deviation < 0 ? [s.overcut_tolerance, s.overcut_end] : [s.undercut_tolerance, s.undercut_end];
  const share = size > tolerance ? 0.5 + 0.5 * Math.min(1, (size - tolerance) / (end - tolerance))
    : tolerance > 0 ? (0.5 * size) / tolerance : 0;
  return deviation < 0 ? -share : share;
}

/** What is said about a place on the part. */
function describe(hit, scaleOf) {
  const tolerance = hit.deviation < 0 ? scaleOf.overcut_tolerance : scaleOf.undercut_tolerance;
  const judged = Math.abs(hit.deviation) > tolerance ? "out of tolerance" : "in tolerance";
  const first = hit.deviation === null ? "not cut" : `${signed(hit.deviation, 4)} mm  ${judged}`;
  const strip = hit.strip < 0 ? "" : `   strip ${hit.strip + 1}`;
  return `${first}\n${["x", "y", "z"].map((axis, k) => `${axis} ${written(hit.point[k], 3)}`).join("  ")}${strip}`;
}
