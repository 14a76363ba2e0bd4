// The two shaders: surfaces (coloured by deviation, by strip, or plainly) and lines.

const SURFACE_VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
in vec3 measure;   // deviation, 1 where uncut, strip
uniform mat4 model, camera;
out vec3 v_normal, v_place;
out vec2 v_measure;
flat out float v_strip;
void main() {
  vec4 place = model * vec4(position, 1.0);
  v_place = place.xyz;
  v_normal = mat3(model) * normal;
  v_measure = measure.xy;
  v_strip = measure.z;
  gl_Position = camera * place;
}`;

const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 v_normal, v_place;
in vec2 v_measure;
flat in float v_strip;
uniform vec3 eye, up, right, plain;
uniform float opacity;
uniform int paint;             // 0 deviation, 1 strips, 2 plain
uniform bool twoSided;         // an open sheet: its back is drawn as the material's side
uniform vec4 bounds;           // overcut tolerance and end, undercut tolerance and end, mm
uniform vec3 overcut[8], undercut[8], uncut[2], strips[7];
out vec4 colour;

vec3 deviationColour() {
  float cut = 1.0 - v_measure.y;
  if (cut < 0.5) {
    float stripe = fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0);
    return mix(uncut[0], uncut[1], smoothstep(0.55, 0.65, stripe) * (1.0 - smoothstep(0.9, 1.0, stripe)));
  }
  float deviation = v_measure.x / cut;
  float size = abs(deviation);
  vec2 limit = deviation < 0.0 ? bounds.xy : bounds.zw;
  float share = size > limit.x ? 4.0 + min(3.999, 4.0 * (size - limit.x) / (limit.y - limit.x))
                               : 3.999 * size / max(limit.x, 1e-12);
  vec3 base = deviation < 0.0 ? overcut[int(share)] : undercut[int(share)];
  // A dark line where the deviation passes its tolerance.
  float edge = abs(size - limit.x) / max(fwidth(deviation), 1e-9);
  return mix(vec3(0.10, 0.12, 0.16), base, smoothstep(0.4, 1.1, edge));
}

void main() {
  vec3 normal = normalize(v_normal);
  vec3 toEye = normalize(eye - v_place);
  bool back = dot(normal, toEye) < 0.0;
  if (back) normal = -normal;
  vec3 base = plain;
  if (paint == 0) base = deviationColour();
  if (paint == 1) base = v_strip < 0.0 ? uncut[0] : strips[int(v_strip) % 7];
  if (back && twoSided) base = vec3(0.60, 0.63, 0.67);
  vec3 light = normalize(toEye + 0.55 * up - 0.35 * right);
  float diffuse = max(dot(normal, light), 0.0);
  // Measured colours must stay readable: shade them gently, plain surfaces fully.
  float depth = paint == 2 ? 0.52 : 0.24;
  vec3 lit = base * (1.0 - depth + depth * diffuse);
  if (paint == 2) lit += 0.16 * pow(max(dot(normal, normalize(light + toEye)), 0.0), 24.0);
  colour = vec4(lit, 1.0) * opacity;
}`;

const LINE_VERTEX = `#version 300 es
in vec3 position;
in vec3 tint;
uniform mat4 camera;
out vec3 v_tint;
void main() {
  v_tint = tint;
  gl_Position = camera * vec4(position, 1.0);
}`;

const LINE_FRAGMENT = `#version 300 es
precision mediump float;
in vec3 v_tint;
uniform float opacity;
out vec4 colour;
void main() { colour = vec4(v_tint, 1.0) * opacity; }`;

/** A linked program with the places of its uniforms; `attributes` take the places 0, 1, 2. */
function program(gl, vertex, fragment, attributes) {
  const linked = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(linked, shader);
  }
  attributes.forEach((name, i) => gl.bindAttribLocation(linked, i, name));
  gl.linkProgram(linked);
  if (!gl.getProgramParameter(linked, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(linked));
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(linked, gl.ACTIVE_UNIFORMS); i++) {
    const name = gl.getActiveUniform(linked, i).name;
    places[name.replace("[0]", "")] = gl.getUniformLocation(linked, name);
  }
  return { linked, places };
}

/** A vertex array of one list of triples an attribute, with an optional index list. */
function vertexArray(gl, lists, indices) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  lists.forEach((list, i) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, list, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
  });
  if (indices) {
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }
  gl.bindVertexArray(null);
  return { array, count: indices ? indices.length : lists[0].length / 3 };
}
