// Vectors as arrays of three, matrices as column-major arrays of sixteen, and lists out of base64.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => scale(a, 1 / (length(a) || 1));
const mix = (a, b, s) => add(scale(a, 1 - s), scale(b, s));
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
const triple = (list, i) => [list[3 * i], list[3 * i + 1], list[3 * i + 2]];

/** Two unit vectors that stand square on a unit vector. */
function squareOn(axis) {
  const first = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  return [first, cross(axis, first)];
}

/** Product of two matrices. */
function product(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return out;
}

/** Matrix whose columns are three axes and an origin. */
const frame = (x, y, z, origin) => new Float32Array([...x, 0, ...y, 0, ...z, 0, ...origin, 1]);

const IDENTITY = frame([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]);

/** Red, green, blue in 0..1 of 0xrrggbb. */
const rgb = (colour) => [(colour >> 16) / 255, ((colour >> 8) & 255) / 255, (colour & 255) / 255];

/** Bytes of base64, read as little-endian numbers of the given array type. */
function decode(text, Type) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Type(bytes.buffer);
}

/** A number with a true minus sign, and one with its plus sign shown too, for deviations. */
const written = (x, digits) => x.toFixed(digits).replace(/^-(?=.*[1-9])/, "\u2212").replace("-", "");
const signed = (x, digits) => (x > 0 ? "+" : "") + written(x, digits);
