#pragma once
/// The renderer's shaders (GLSL 4.50). Internal to view/. Light is linear; `encode` makes sRGB of it
/// (an sRGB frame buffer costs the software driver several times the shading itself).
/// Loops whose length depends on the pixel, not branches, skip work: the software driver runs both sides of a
/// branch.

namespace tactus::shaders {

inline constexpr const char* kVersion = "#version 450 core\n";

/// Before a surface's shaders: with film and flesh, which others needn't carry to their fragments.
inline constexpr const char* kTissue = "#define TISSUE\n";

/// Light of surfaces. `sun_map` holds depths from the sun, `sky_map` heights seen from above, blurred: the
/// first casts the shadow, the second tells how much of the sky neighbouring surfaces hide.
inline constexpr const char* kLight = R"(
uniform vec3 eye;
uniform vec3 sun;
uniform mat4 sun_matrix;
uniform mat4 sky_matrix;
uniform float reach_m;
uniform vec2 shadow_step;
uniform vec3 sun_map_m;  // sides of its box
uniform float floor_m;
uniform float shadow_bias_m;
uniform bool shadows;
uniform bool occlusion;
uniform vec2 picture_px;
layout(binding = 0) uniform sampler2DShadow sun_map;
layout(binding = 1) uniform sampler2D sky_map;

const vec3 key_light = vec3(2.30, 2.15, 1.95);
const vec3 fill_light = vec3(0.34, 0.40, 0.50);
const vec3 sky_light = vec3(0.74, 0.80, 0.88);
const vec3 ground_light = vec3(0.42, 0.38, 0.35);

// A disc of nine taps, each filtered 2x2 by the hardware. Where the middle and the rim agree, the rest is
// left out.
const vec2 disc[9] = vec2[](vec2(0, 0), vec2(0.45, 1.6), vec2(-1.6, 0.45), vec2(-0.45, -1.6), vec2(1.6, -0.45),
                            vec2(0.9, 0.35), vec2(-0.35, 0.9), vec2(-0.9, -0.35), vec2(0.35, -0.9));

float sun_visibility(vec3 p, vec3 n) {
  vec3 q = (sun_matrix * vec4(p + shadow_bias_m * n, 1)).xyz;
  bool inside = shadows && all(lessThan(abs(q.xy - 0.5), vec2(0.5)));
  // Taps lie in the surface's own plane, so that it doesn't shade itself.
  vec3 m = mat3(sun_matrix) * n * sun_map_m * sun_map_m;
  vec2 slope = m.xy / max(-m.z, 0.1 * length(m));
  int taps = inside ? 5 : 0;
  float hidden = 0;
  for (int i = 0; i < taps; ++i) {
    vec2 to = shadow_step * disc[i];
    // Beyond the map, everything in it lies towards the sun.
    hidden += 1.0 - textureLod(sun_map, vec3(q.xy + to, min(q.z + dot(slope, to), 0.9999)), 0.0);
  }
  int all = hidden > 0.0 && hidden < 5.0 ? 9 : 5;
  for (int i = 5; i < all; ++i) {
    vec2 to = shadow_step * disc[i];
    hidden += 1.0 - textureLod(sun_map, vec3(q.xy + to, min(q.z + dot(slope, to), 0.9999)), 0.0);
  }
  return 1.0 - hidden / float(all);
}

float sky_visibility(vec3 p) {
  vec2 q = (sky_matrix * vec4(p, 1)).xy;
  bool inside = occlusion && all(lessThan(abs(q - 0.5), vec2(0.5)));
  vec2 hidden = vec2(0);
  for (int i = 0; i < (inside ? 1 : 0); ++i) {
    vec3 heights = textureLod(sky_map, q, 0.0).rgb - (p.y - floor_m);
    float gap = max(heights.z, 0.0) / (2.0 * reach_m);  // what hangs high hides little
    hidden = (1.0 - exp(-max(heights.xy, vec2(0)) / (1.5 * reach_m))) / (1.0 + gap * gap);
  }
  return (1.0 - 0.45 * hidden.x) * (1.0 - 0.45 * hidden.y);
}

vec3 background() {
  vec2 at = gl_FragCoord.xy / picture_px;
  vec2 from_light = (at - vec2(0.5, 0.62)) * vec2(1.0, 0.9);
  float vignette = smoothstep(0.15, 0.85, length(from_light));
  return mix(vec3(0.86, 0.875, 0.89), vec3(0.52, 0.55, 0.59), vignette);
}

// Reinhard with white at 3: highlights roll off, mid tones keep their hue.
vec3 tone(vec3 c) { return c * (1.0 + c / 9.0) / (1.0 + c); }

vec3 encode(vec3 c) {
  vec3 curve = 1.055 * pow(max(c, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055;
  return mix(12.92 * c, curve, step(vec3(0.0031308), c));
}
)";

inline constexpr const char* kSurfaceVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 photographed;
#ifdef TISSUE
layout(location = 3) in vec3 film_stain_edge;
layout(location = 4) in vec4 rest_and_depth;
layout(location = 5) in vec3 lip_normal;
out vec3 film_m;
out vec4 rest;
out vec3 lip;
#endif
uniform mat4 view_proj;
uniform mat3 turn;
out vec3 p;
out vec3 n;
out vec3 photo_color;
invariant gl_Position;
void main() {
  p = turn * position;
  n = turn * normal;
  photo_color = photographed;
#ifdef TISSUE
  film_m = film_stain_edge;
  rest = rest_and_depth;
  lip = turn * lip_normal;
#endif
  gl_Position = view_proj * vec4(p, 1);
}
)";

inline constexpr const char* kSurfaceFragment = R"(
in vec3 p;
in vec3 n;
in vec3 photo_color;
uniform bool is_photographed;
uniform vec3 dry_albedo;
uniform float dry_roughness;
uniform float dry_specular;
uniform float softness;
uniform float opacity;
uniform bool flat_shaded;
layout(location = 0) out vec4 color;

vec3 albedo;
float roughness, specular;

float inner = 0.0;  // on a wall of a cut
float shade;        // of the wound there

#ifdef TISSUE
in vec3 film_m;  // of film, of stain, to the film's edge
in vec4 rest;    // at rest; to the rim of a cut, > 0 on its walls
in vec3 lip;
uniform vec3 film_scattered;
uniform vec3 film_absorption_1_m;
uniform float grain_m;
uniform float lip_m;
layout(binding = 8) uniform sampler3D grain;

// The way on the surface along which a value grows (Mikkelsen 2010).
vec3 slope_of(float value, vec3 N) {
  vec3 px = dFdx(p), py = dFdy(p), rx = cross(py, N), ry = cross(N, px);
  float area = dot(px, rx);
  return sign(area) * (rx * dFdx(value) + ry * dFdy(value)) / max(abs(area), 1e-20);
}

// Walls of cuts: fibres that lie still in the flesh, wet, and less light the deeper. The rim is round.
vec3 flesh(vec3 N) {
  float depth = rest.w, px_m = length(fwidth(rest.xyz));
  inner = smoothstep(0.0, lip_m, depth);
  vec3 q = rest.xyz / (32.0 * grain_m);
  float fibre = 0.5, fine = 0.5;
  for (int i = 0; i < (inner > 0.0 ? 1 : 0); ++i) {
    fibre = textureLod(grain, q * vec3(0.16, 1.0, 1.0), 0.0).r;
    fine = textureLod(grain, q * vec3(0.7, 2.3, 2.3), 0.0).g;
  }
  float seen = 1.0 - smoothstep(0.4, 2.0, px_m / grain_m);
  float pattern = seen * (0.65 * (fibre - 0.5) + 0.35 * (fine - 0.5));
  vec3 meat = albedo * vec3(0.95, 0.62, 0.60) + vec3(0.045, 0.0, 0.0);
  meat *= 1.0 + 1.1 * pattern;
  albedo = mix(albedo, meat, inner);
  roughness = mix(roughness, 0.3 - 0.12 * pattern, inner);
  shade = mix(1.0, exp(-max(depth, 0.0) / (8.0 * lip_m)), inner);
  N = normalize(N - inner * seen * 0.3 * grain_m * slope_of(pattern, N));
  float rounded = depth < 0.0 ? 0.0 : 1.0 - smoothstep(0.0, lip_m, depth);
  return normalize(mix(N, lip, 0.9 * rounded));
}

// Light goes through a film to the surface and back (Beer-Lambert), and deep film scatters it. What dried is
// denser, and lets less red through.
vec3 wet(vec3 N, vec3 uphill, float px_m) {
  vec3 stained = exp(-2.0 * (3.0 * film_absorption_1_m + vec3(900.0)) * film_m.y);
  // The edge is a bead: steep where it meets what is dry, as the contact angle asks for, and level within.
  float full_m = max(film_m.x, 0.0), bead_m = max(3.0 * full_m, 4e-4);
  float in_bead = clamp(film_m.z / max(bead_m, px_m) + 0.25, 0.0, 1.0);
  float thick_m = full_m * in_bead * (2.0 - in_bead);
  vec3 through = exp(-2.0 * film_absorption_1_m * thick_m);
  albedo = albedo * stained * through + film_scattered * (1.0 - through);
  float is_wet = smoothstep(1e-5, 6e-5, thick_m);
  roughness = mix(roughness, 0.12, is_wet);
  specular = mix(specular, 0.02, is_wet);
  float tilt = is_wet * full_m / bead_m * 2.0 * (1.0 - in_bead);
  return normalize(N - tilt * uphill / max(length(uphill), 1e-12));
}
#endif

float highlight(vec3 N, vec3 V, vec3 L) {  // GGX (Walter et al. 2007), visibility after Karis
  vec3 H = normalize(V + L);
  float a = roughness * roughness, a2 = a * a;
  float nh = max(dot(N, H), 0.0), nl = max(dot(N, L), 0.0), nv = max(dot(N, V), 1e-3);
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float k = 0.5 * a;
  float visibility = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
  float h = 1.0 - max(dot(V, H), 0.0);
  float fresnel = specular + (1.0 - specular) * h * h * h * h * h;
  return fresnel * visibility * nl * a2 / (3.14159 * d * d);
}

// Light that enters and leaves elsewhere: wraps around the terminator, first where the surface absorbs least.
vec3 diffuse(float cosine) {
  vec3 wrap = softness * mix(vec3(0.25), vec3(0.75), albedo);
  return clamp((cosine + wrap) / (1.0 + wrap), 0.0, 1.0);
}

void main() {
  if (is_photographed) {
    color = vec4(photo_color, opacity);
    return;
  }
  albedo = dry_albedo;
  roughness = dry_roughness;
  specular = dry_specular;
  shade = 1.0;
  vec3 V = normalize(eye - p);
  vec3 N = flat_shaded ? normalize(cross(dFdx(p), dFdy(p))) : normalize(n);
  if (flat_shaded ? dot(N, V) < 0.0 : !gl_FrontFacing) N = -N;
#ifdef TISSUE
  N = flesh(N);
  vec3 uphill = slope_of(film_m.z, N);
  float px_m = fwidth(film_m.z);
  int is_wet = film_m.y > 0.0 || film_m.z > -max(film_m.x, max(px_m, 4e-4)) ? 1 : 0;
  for (int i = 0; i < is_wet; ++i) N = wet(N, uphill, px_m);
#endif
  float lit = sun_visibility(p, N);
  float sky = sky_visibility(p), open = sky * shade;
  vec3 side = normalize(vec3(V.x - 0.9 * sun.x, 0.35, V.z - 0.9 * sun.z) + 0.05 * V);
  vec3 c = key_light * diffuse(dot(N, sun)) * mix(lit, 1.0, 0.12 * softness);
  c += fill_light * diffuse(dot(N, side)) * mix(open, 1.0, 0.4);
  c += mix(ground_light, sky_light, 0.5 + 0.5 * N.y) * 0.42 * mix(sky * vec3(0.5, 0.2, 0.2), vec3(sky), shade);  // flesh lights flesh
  float metal = smoothstep(0.3, 0.6, dry_specular);
  c *= albedo * (1.0 - 0.75 * metal);
  float facing = max(dot(N, V), 0.0);
  float edge = pow(1.0 - facing, 4.0);
  vec3 mirrored = reflect(-V, N);
  float bright = smoothstep(-0.3, 0.9, mirrored.y);
#ifdef TISSUE
  open *= mix(1.0, smoothstep(0.1, 0.7, dot(mirrored, lip)), inner);  // the other wall hides the rest
#endif
  // Metal mirrors a room: light above, dark at eye level, a floor.
  float floor_part = smoothstep(0.05, -0.5, mirrored.y), lamp = smoothstep(0.15, 0.8, mirrored.y);
  vec3 room = mix(mix(vec3(0.16, 0.17, 0.19), 0.8 * ground_light, floor_part), 1.9 * sky_light, lamp);
  vec3 around = mix(mix(ground_light, sky_light, bright), room, metal);
  c += (specular + (1.0 - roughness) * 0.35 * edge) * around * open;
  c += softness * edge * 0.35 * albedo * sky_light * shade;
  c += key_light * highlight(N, V, sun) * lit + fill_light * highlight(N, V, side) * open;
  color = vec4(encode(tone(c)), mix(opacity, 1.0, 0.6 * edge));
}
)";

inline constexpr const char* kGroundVertex = R"(
uniform mat4 view_proj;
uniform vec3 ground_center;
uniform float ground_radius_m;
out vec3 p;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  p = ground_center + ground_radius_m * vec3(corner.x, 0, -corner.y);
  gl_Position = view_proj * vec4(p, 1);
}
)";

inline constexpr const char* kGroundFragment = R"(
in vec3 p;
uniform vec3 ground_center;
uniform float ground_radius_m;
uniform float tile_m;
uniform vec2 lit_low, lit_size;
layout(binding = 5) uniform sampler2D floor_light;
layout(location = 0) out vec4 color;
void main() {
  float away = length(p.xz - ground_center.xz) / ground_radius_m;
  float there = 1.0 - smoothstep(0.25, 0.95, away);
  vec2 tile = p.xz / tile_m;
  vec2 width = fwidth(tile);
  float fine = 1.0 - smoothstep(0.15, 0.6, max(width.x, width.y));
  vec2 to_line = abs(fract(tile + 0.5) - 0.5);
  vec2 line = 1.0 - smoothstep(0.5 * width, 1.5 * width + 0.008, to_line);
  vec2 odd = step(0.5, fract(0.5 * tile));
  float pattern = 1.0 + fine * (0.035 * (abs(odd.x - odd.y) - 0.5) - 0.09 * max(line.x, line.y));
  vec2 q = (p.xz - lit_low) / lit_size, border = min(q, 1.0 - q);
  float known = there * smoothstep(0.0, 0.05, min(border.x, border.y));
  vec2 light = mix(vec2(1), textureLod(floor_light, q, 0.0).rg, known);
  vec3 shade = vec3(0.30, 0.33, 0.38) * light.y + vec3(0.70, 0.67, 0.62) * light.x * mix(light.y, 1.0, 0.7);
  color = vec4(encode(mix(background(), vec3(0.74, 0.735, 0.72) * pattern * shade, there)), 1);
}
)";

/// One triangle that covers the picture, at the far plane.
inline constexpr const char* kBackgroundVertex = R"(
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 1, 1);
}
)";
inline constexpr const char* kBackgroundFragment = R"(
layout(location = 0) out vec4 color;
void main() { color = vec4(encode(background()), 1); }
)";

/// One instance a line: a quad along it, so that width does not depend on the driver.
inline constexpr const char* kLineVertex = R"(
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 color_width;
uniform mat4 view_proj;
uniform vec2 picture_px;
uniform float near_m;
uniform float nearer;  // added to z of the clip space: lines on a surface are drawn whole
out vec3 line_color;
void main() {
  vec4 a = view_proj * vec4(from, 1), b = view_proj * vec4(to, 1);
  if (a.w < near_m && b.w < near_m) { gl_Position = vec4(0, 0, 2, 1); return; }
  if (a.w < near_m) a = mix(a, b, (near_m - a.w) / (b.w - a.w));
  if (b.w < near_m) b = mix(b, a, (near_m - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * picture_px;
  vec2 across = length(along) > 1e-6 ? normalize(vec2(-along.y, along.x)) : vec2(1, 0);
  vec4 end = (gl_VertexID & 1) == 0 ? a : b;
  float side = (gl_VertexID >> 1) == 0 ? -1.0 : 1.0;
  gl_Position = end + vec4(side * color_width.w * across / picture_px * end.w, nearer, 0);
  line_color = color_width.rgb;
}
)";
inline constexpr const char* kLineFragment = R"(
in vec3 line_color;
layout(location = 0) out vec4 color;
void main() { color = vec4(line_color, 0.85); }
)";

/// Edges of the triangles over a surface.
inline constexpr const char* kWireFragment = R"(
uniform float strength;
layout(location = 0) out vec4 color;
void main() { color = vec4(0.02, 0.02, 0.03, strength); }
)";

}  // namespace tactus::shaders
