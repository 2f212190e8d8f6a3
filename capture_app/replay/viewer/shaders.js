// GLSL. Light: one sun and the glow of the sky, the formula of render/shaders/mesh.frag.

const LIGHT = `
uniform vec3 toSun;
uniform float sun, sky, ground;
uniform highp sampler2DShadow shadowMap;
uniform mat4 lightMatrix;
uniform float blur, shadows;
const int FEW = 5;
const int TAPS = 12;
const vec2 DISC[TAPS] = vec2[](
  vec2(0.0), vec2(0.92, 0.38), vec2(-0.38, 0.92), vec2(-0.92, -0.38), vec2(0.38, -0.92),
  vec2(-0.26, 0.24), vec2(0.04, -0.46), vec2(0.33, 0.43), vec2(-0.61, -0.11), vec2(0.56, -0.37),
  vec2(-0.19, 0.72), vec2(-0.34, -0.71));

float tap(vec3 s) { return texture(shadowMap, vec3(s.xy, min(s.z, 0.9999))); }

float sunlit(vec3 position, vec3 n) {
  vec3 t = normalize(cross(n, abs(n.x) < 0.7 ? vec3(1, 0, 0) : vec3(0, 1, 0)));
  vec3 b = cross(n, t);
  vec3 s = (lightMatrix * vec4(position + 0.006 * n, 1.0)).xyz * 0.5 + 0.5;
  vec2 rim = smoothstep(0.44, 0.49, abs(s.xy - 0.5));
  if (max(rim.x, rim.y) >= 1.0) return 1.0;
  mat2x3 disc = mat2x3(mat3(lightMatrix) * t, mat3(lightMatrix) * b) * (0.5 * blur);
  float lit = 0.0;
  for (int i = 0; i < FEW; i++) lit += tap(s + disc * DISC[i]);
  float share = lit / float(FEW);
  if (share > 0.0 && share < 1.0) {  // an edge is near
    for (int i = FEW; i < TAPS; i++) lit += tap(s + disc * DISC[i]);
    share = lit / float(TAPS);
  }
  return mix(1.0, share, shadows * (1.0 - max(rim.x, rim.y)));
}

float light(vec3 position, vec3 n) {
  float facing = max(dot(n, toSun), 0.0);
  float ambient = mix(ground, sky, 0.5 + 0.5 * n.z);
  return ambient + (facing > 0.0 ? sun * facing * sunlit(position, n) : 0.0);
}`;

const HEAD = "#version 300 es\nprecision highp float;\n";

const SKIN = `
layout(location = 2) in vec4 joints;
layout(location = 3) in vec4 weights;
layout(location = 4) in vec2 uv;
uniform highp sampler2D bones; // a row for each: the three rows of its matrix
mat4 model() {
  vec4 rows[3] = vec4[](vec4(0), vec4(0), vec4(0));
  for (int k = 0; k < 4; k++) {
    for (int r = 0; r < 3; r++) rows[r] += weights[k] * texelFetch(bones, ivec2(r, int(joints[k])), 0);
  }
  return transpose(mat4(rows[0], rows[1], rows[2], vec4(0, 0, 0, dot(weights, vec4(1.0)))));
}`;

const RIGID = `
layout(location = 2) in vec2 uv;
uniform mat4 place;
mat4 model() { return place; }`;

/** @param {string} model */
const meshVertex = (model) => `${HEAD}
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
${model}
uniform mat4 viewProjection;
out vec3 at;
out vec3 up;
out vec2 spot;
void main() {
  spot = uv;
  mat4 m = model();
  vec4 world = m * vec4(position, 1.0);
  at = world.xyz / world.w;
  up = mat3(m) * normal;
  gl_Position = viewProjection * vec4(at, 1.0);
}`;

export const SKINNED_VERTEX = meshVertex(SKIN);
export const RIGID_VERTEX = meshVertex(RIGID);

export const MESH_FRAGMENT = `${HEAD}
in vec3 at;
in vec3 up;
in vec2 spot;
uniform vec3 color, eye;
uniform float sheen, painted, cutoff;
uniform sampler2D picture;
${LIGHT}
out vec4 pixel;
void main() {
  vec3 n = normalize(up);
  vec3 back = normalize(eye - at);
  if (dot(n, back) < 0.0 && !gl_FrontFacing) n = -n;
  float rim = pow(1.0 - max(dot(n, back), 0.0), 3.0);
  vec4 paint = texture(picture, spot);
  if (painted * (cutoff - paint.a) > 0.0) discard;
  vec3 own = mix(color, paint.rgb, painted);
  pixel = vec4(own * light(at, n) + sheen * rim * (0.4 + 0.6 * n.z), 1.0);
}`;

export const DEPTH_FRAGMENT = `${HEAD}
void main() {}`;

export const FLOOR_VERTEX = `${HEAD}
layout(location = 0) in vec3 position;
uniform mat4 viewProjection;
uniform vec3 centre;
uniform float reach;
out vec3 at;
void main() {
  at = vec3(centre.xy + reach * position.xy, 0.0);
  gl_Position = viewProjection * vec4(at, 1.0);
}`;

export const FLOOR_FRAGMENT = `${HEAD}
in vec3 at;
uniform vec3 centre, tile, background;
uniform float reach, grid, line;
${LIGHT}
out vec4 pixel;
void main() {
  vec2 size = fwidth(at.xy);
  vec2 away = abs(fract(at.xy - 0.5) - 0.5);
  vec2 near = 1.0 - smoothstep(vec2(0.009), vec2(0.009) + 1.3 * size, away);
  near *= clamp(0.05 / size, 0.0, 1.0);
  float odd = mod(floor(at.x) + floor(at.y), 2.0) - 0.5;
  vec3 color = tile + grid * (line * max(near.x, near.y) + 0.18 * abs(line) * odd);
  float far = length(at.xy - centre.xy) / reach;
  float fade = smoothstep(0.3, 0.95, far);
  pixel = vec4(mix(color * light(at, vec3(0, 0, 1)), background, fade), 1.0);
}`;

// A line of a width in pixels: one instance a piece, its four corners by their number.
export const LINE_VERTEX = `${HEAD}
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 tint;
uniform mat4 viewProjection;
uniform vec2 pane;
uniform float width;
out vec4 color;
void main() {
  vec4 a = viewProjection * vec4(from, 1.0), b = viewProjection * vec4(to, 1.0);
  if (a.w < 0.01 && b.w < 0.01) { gl_Position = vec4(2, 2, 2, 1); return; }
  if (a.w < 0.01) a = mix(b, a, (b.w - 0.01) / (b.w - a.w));
  if (b.w < 0.01) b = mix(a, b, (a.w - 0.01) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * pane;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1, 0);
  vec2 aside = vec2(-along.y, along.x);
  bool end = gl_VertexID >= 2;
  vec4 p = end ? b : a;
  vec2 shift = aside * (gl_VertexID % 2 == 0 ? -1.0 : 1.0) + along * (end ? 0.5 : -0.5);
  p.xy += shift * width / pane * p.w;
  p.z -= 0.0004 * p.w;
  gl_Position = p;
  color = tint;
}`;

export const LINE_FRAGMENT = `${HEAD}
in vec4 color;
out vec4 pixel;
void main() { pixel = vec4(color.rgb * color.a, color.a); }`;
