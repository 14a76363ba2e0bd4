// Bodies of the machine and fixtures: their forms, and where their links are at a time.

/** The bodies with their forms, and the links as quaternions and ways, one a sample. */
const bodiesOf = (data) => data.bodies.map((body) => ({ ...body, ...meshOf(body) }));
const linksOf = (data) => data.links.map((link) => ({
  turns: decode(link.turns, Float32Array),
  ways: decode(link.ways, Float32Array),
}));

/** Matrix of a link at a time: turned the shorter way between two samples. */
function linkPlace(link, { at, next, share }) {
  const quadruple = (i) => link.turns.subarray(4 * i, 4 * i + 4);
  const [a, b] = [quadruple(at), quadruple(next)];
  const along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -share : share;
  const mean = [0, 1, 2, 3].map((k) => a[k] * (1 - share) + b[k] * along);
  const size = Math.hypot(...mean) || 1;
  const [x, y, z, w] = mean.map((q) => q / size);
  return frame(
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
    mix(triple(link.ways, at), triple(link.ways, next), share),
  );
}

/** Distance from a point within which all bodies are at all times. */
function bodiesReach(bodies, links, centre) {
  const farthest = (points, from) => {
    let most = 0;
    for (let i = 0; 3 * i < points.length; i++) most = Math.max(most, length(sub(triple(points, i), from)));
    return most;
  };
  return bodies.reduce((most, body) => {
    if (body.link < 0) return Math.max(most, farthest(body.points, centre));
    return Math.max(most, farthest(body.points, [0, 0, 0]) + farthest(links[body.link].ways, centre));
  }, 0);
}
