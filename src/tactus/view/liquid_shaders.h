#pragma once
/// Shaders that draw a liquid from its particles, in screen space (GLSL 4.50). Internal to view/.
/// Maps hold 1 / z, with z the distance from the eye along its axis [m]: on the picture of a plane that is
/// linear, so a filter leaves planes as they are.

namespace tactus::shaders {

/// A quad that covers the image of a ball that is stretched along an axis, one instance a particle.
inline constexpr const char* kBallVertex = R"(
layout(location = 0) in vec4 center_radius;
layout(location = 1) in vec4 axis_stretch;
uniform mat4 eye_world;  // world to eye
uniform mat4 clip_eye;
uniform float spacing_m;
uniform float near_m;
out vec3 on_quad;
flat out vec3 middle;
flat out vec4 axis_more;  // 1 / length along it - 1 / length across it
// 1 / length across the axis; the particle's share of the volume; the shortest ray that counts
flat out vec3 across_share;
void main() {
  middle = (eye_world * vec4(center_radius.xyz, 1)).xyz;
  float r = center_radius.w, along_m = r * axis_stretch.w, across_m = r * inversesqrt(axis_stretch.w);
  float radius_m = max(along_m, across_m), far = length(middle);
  // What holds the eye, lies behind it, or is nowhere is not drawn.
  if (!(far > 1.01 * radius_m) || !(-middle.z > near_m + radius_m)) { gl_Position = vec4(0, 0, 2, 1); return; }
  axis_more = vec4(mat3(eye_world) * axis_stretch.xyz, 1.0 / along_m - 1.0 / across_m);
  float of_spacing = spacing_m / r;
  across_share = vec3(1.0 / across_m, 0.238732 * of_spacing * of_spacing * of_spacing, 0);
  // In a crowd, rims of balls would be scallops where the liquid ends: short rays don't count. Those that do
  // count 2.16 times, so that the volume stays that of the particle.
  float crowd = axis_stretch.w == 1.0 ? clamp((r / spacing_m - 0.62) / 0.18, 0.0, 1.0) : 0.0;
  across_share.y *= 1.0 + 1.16 * crowd;
  across_share.z = 0.6 * crowd * spacing_m;
  vec3 back = -middle / far;
  vec3 right = normalize(cross(vec3(0, 1, 0), back) + vec3(1e-9, 0, 0)), up = cross(back, right);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  float half_size = radius_m * far / sqrt(far * far - radius_m * radius_m);
  on_quad = middle + half_size * (corner.x * right + corner.y * up);
  gl_Position = clip_eye * vec4(on_quad, 1);
}
)";

/// 1 / z of the ball's front, and the length of the ray in it, as far as nothing solid is before it.
inline constexpr const char* kBallFragment = R"(
in vec3 on_quad;
flat in vec3 middle;
flat in vec4 axis_more;
flat in vec3 across_share;
uniform vec2 of_depth;  // z of the eye's space is x / (depth of the clip space + y)
layout(binding = 2) uniform sampler2D solid;
layout(location = 0) out float front;
layout(location = 1) out float chord;
vec3 unit(vec3 v) { return across_share.x * v + axis_more.w * dot(axis_more.xyz, v) * axis_more.xyz; }
void main() {
  vec3 ray = normalize(on_quad);
  vec3 way = unit(ray), center = unit(middle);
  float per_way = 1.0 / dot(way, way), along = dot(way, center) * per_way;
  vec3 off = center - along * way;
  float half2 = (1.0 - dot(off, off)) * per_way;
  if (half2 <= 0.0) discard;
  float half_chord = sqrt(half2);
  float depth = 2.0 * texelFetch(solid, ivec2(gl_FragCoord.xy), 0).r - 1.0;
  float behind = min(along + half_chord, of_depth.x / (depth + of_depth.y) / -ray.z);
  chord = across_share.y * (behind - along + half_chord - across_share.z);
  if (chord <= 0.0) discard;
  front = -1.0 / (ray.z * (along - half_chord));
}
)";

/// A square of the picture that has liquid, one instance a square.
inline constexpr const char* kTileVertex = R"(
layout(location = 0) in vec2 tile;
uniform vec2 of_tile;  // its side, over the picture's sides
void main() {
  vec2 corner = tile + vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(2.0 * of_tile * corner - 1.0, 1, 1);
}
)";

/// One of the two passes of a narrow-range filter (after Truong & Yuksel 2018), along `step_px`. A depth much
/// nearer or farther than the pixel's own belongs to another surface.
inline constexpr const char* kLiquidSmoothFragment = R"(
uniform ivec2 step_px;
uniform float spacing_m;
uniform float px_at_1m;  // pixels of a metre, a metre away
uniform bool blurs;  // plainly: the map is a thickness
layout(binding = 2) uniform sampler2D front;
layout(location = 0) out float value;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), size = textureSize(front, 0);
  if (blurs) {
    float sum = 0.0, weights = 0.0;
    for (int k = -4; k <= 4; ++k) {
      float g = exp(-0.15 * float(k * k));
      sum += g * texelFetch(front, clamp(at + k * step_px, ivec2(0), size - 1), 0).r;
      weights += g;
    }
    value = sum / weights;
    return;
  }
  float w = texelFetch(front, at, 0).r;
  if (w <= 0.0) { value = 0.0; return; }
  float sigma = clamp(0.8 * spacing_m * px_at_1m * w, 0.5, 16.0);
  int reach = int(ceil(2.5 * sigma));
  float bump = 1.5 * spacing_m * w * w;
  float sum = w, weights = 1.0;
  for (int k = 1; k <= reach; ++k) {
    float g = exp(-0.5 * float(k * k) / (sigma * sigma));
    ivec2 a = at + k * step_px, b = at - k * step_px;
    float wa = all(lessThan(a, size)) ? texelFetch(front, a, 0).r : 0.0;
    float wb = all(greaterThanEqual(b, ivec2(0))) ? texelFetch(front, b, 0).r : 0.0;
    // In pairs: where one is beside the surface, or on another, neither pulls; and a plane stays one.
    float off = 0.5 * (wa + wb) - w;
    if (wa <= 0.0 || wb <= 0.0 || abs(off) > bump) continue;
    sum += 2.0 * g * (w + off);
    weights += 2.0 * g;
  }
  value = sum / weights;
}
)";

/// Light that the liquid reflects, scatters and lets through.
inline constexpr const char* kLiquidFragment = R"(
uniform mat4 world_eye;
uniform mat4 clip_eye;
uniform vec2 eye_of_px;  // tangents of half the picture's angles
uniform vec2 middle;     // tangents of the ray through the picture's middle
uniform float spacing_m;
uniform float lift_m;  // that balls of a crowd stick out of the liquid
uniform vec3 scattered;
uniform vec3 absorption_1_m;
layout(binding = 2) uniform sampler2D front;
layout(binding = 3) uniform sampler2D thickness;
layout(binding = 4) uniform sampler2D behind;
layout(location = 0) out vec4 color;

vec3 ray_at(ivec2 at) {
  vec2 ndc = (vec2(at) + 0.5) / picture_px * 2.0 - 1.0;
  return vec3(middle + ndc * eye_of_px, -1);
}
vec3 eye_at(ivec2 at, float w) { return ray_at(at) / w; }

// The side on which the surface goes on: the one with the smaller step.
vec3 slope(ivec2 at, ivec2 step_px, float w, vec3 p) {
  float wa = texelFetch(front, at + step_px, 0).r, wb = texelFetch(front, at - step_px, 0).r;
  bool ahead = wa > 0.0 && (wb <= 0.0 || abs(wa - w) < abs(wb - w));
  if (wa <= 0.0 && wb <= 0.0) return vec3(step_px, 0) * 1e-6;
  return ahead ? eye_at(at + step_px, wa) - p : p - eye_at(at - step_px, wb);
}

vec3 decode(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c)); }

float highlight(vec3 N, vec3 V, vec3 L) {
  const float a2 = 0.0025;  // wet: GGX of roughness 0.22
  vec3 H = normalize(V + L);
  float nh = max(dot(N, H), 0.0), d = nh * nh * (a2 - 1.0) + 1.0;
  float h = 1.0 - max(dot(V, H), 0.0);
  return (0.03 + 0.97 * h * h * h * h * h) * max(dot(N, L), 0.0) * a2 / (3.14159 * d * d);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  float w = texelFetch(front, at, 0).r;
  if (w <= 0.0) discard;
  vec3 p = eye_at(at, w);
  vec3 n = normalize(cross(slope(at, ivec2(1, 0), w, p), slope(at, ivec2(0, 1), w, p)));
  vec3 ray = ray_at(at);
  float deep_m = texelFetch(thickness, at, 0).r, layers = deep_m / spacing_m;
  // Thin liquid is balls of the particles' volume, or caps.
  float facing_m = max(-dot(n, normalize(ray)), 0.3);
  float z = 1.0 / w + smoothstep(0.8, 2.0, layers) * lift_m / facing_m / length(ray);
  p = ray * z;
  vec4 clip = clip_eye * vec4(p, 1);
  gl_FragDepth = 0.5 + 0.5 * clip.z / clip.w;
  float there = smoothstep(0.08, 0.4, layers);
  if (there <= 0.0) discard;
  vec3 P = (world_eye * vec4(p, 1)).xyz, N = mat3(world_eye) * n, V = normalize(eye - P);
  // Rays bend towards the normal as they enter (1.34): what is behind appears shifted.
  vec2 shift = -0.25 * n.xy * min(deep_m, 10.0 * spacing_m) * w / eye_of_px * 0.5 * picture_px;
  ivec2 from = clamp(at + ivec2(shift), ivec2(0), ivec2(picture_px) - 1);
  // Light goes through it and back, as through a film.
  vec3 through = exp(-2.0 * absorption_1_m * deep_m);
  float lit = sun_visibility(P, N), open = sky_visibility(P);
  float wrap = clamp((dot(N, sun) + 0.4) / 1.4, 0.0, 1.0);
  vec3 light = key_light * wrap * lit + mix(ground_light, sky_light, 0.5 + 0.5 * N.y) * 0.6 * open;
  vec3 mirrored = reflect(-V, N);
  float facing = 1.0 - max(dot(N, V), 0.0), fresnel = 0.02 + 0.98 * pow(facing, 5.0);
  vec3 sky = mix(ground_light, sky_light, smoothstep(-0.3, 0.9, mirrored.y)) * open;
  vec3 c = tone(scattered * light * (1.0 - through) + there * (fresnel * sky + key_light * highlight(N, V, sun) * lit));
  c += (1.0 - there * fresnel) * through * decode(texelFetch(behind, from, 0).rgb);
  color = vec4(encode(c), 1);
}
)";

}  // namespace tactus::shaders
