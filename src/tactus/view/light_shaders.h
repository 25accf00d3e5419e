#pragma once
/// Shaders of the maps that hold a picture's light (GLSL 4.50). Internal to view/. Light on the ground is
/// worked out a texel, not a pixel: that leaves time for shadows that widen with the distance from their
/// casters. Heights are metres above `floor_m`.

namespace tactus::shaders {

inline constexpr const char* kDepthFragment = "void main() {}\n";

/// The highest and, negative, the lowest point of all surfaces above a texel (blended by GL_MAX). Where
/// nothing is, the highest is the floor and the lowest beyond 1e8. Surfaces below the floor hide nothing of
/// it.
inline constexpr const char* kBandFragment = R"(
in vec3 p;
uniform float floor_m;
layout(location = 0) out vec4 color;
void main() {
  if (p.y < floor_m) discard;
  float height = p.y - floor_m;
  color = vec4(height, -height, 0, 0);
}
)";

/// Means of 4 x 4 texels of the bands: the covered share, and that times the lowest and the highest point.
inline constexpr const char* kReduceFragment = R"(
layout(binding = 6) uniform sampler2D bands;
layout(location = 0) out vec4 color;
void main() {
  ivec2 at = 4 * ivec2(gl_FragCoord.xy);
  vec3 sum = vec3(0);
  for (int i = 0; i < 16; ++i) {
    vec2 band = texelFetch(bands, at + ivec2(i & 3, i >> 2), 0).rg;
    sum += band.g > -1e8 ? vec3(1, -band.g, band.r) : vec3(0);
  }
  color = vec4(sum / 16.0, 0);
}
)";

/// For surfaces: heights averaged over a small and a large disc, and that of the lowest points in the large
/// one.
inline constexpr const char* kHeightFragment = R"(
uniform vec2 disc_step;  // of the small disc, in texture coordinates
uniform float map_px;
layout(binding = 6) uniform sampler2D bands;
layout(binding = 7) uniform sampler2D reduced;
layout(location = 0) out vec4 color;
void main() {
  vec2 q = gl_FragCoord.xy / map_px;
  vec2 sum = vec2(0);
  for (int i = 0; i < 24; ++i) {  // Vogel's spiral
    float angle = 2.39996 * float(i), r = sqrt((float(i) + 0.5) / 24.0);
    vec2 to = r * disc_step * vec2(cos(angle), sin(angle));
    sum += vec2(textureLod(bands, q + to, 0.0).r, textureLod(bands, q + 2.5 * to, 0.0).r);
  }
  vec2 texels = 5.0 * disc_step * vec2(textureSize(reduced, 0));
  vec2 low = textureLod(reduced, q, max(log2(max(texels.x, texels.y)) - 1.0, 0.0)).rg;
  color = vec4(sum / 24.0, low.g / max(low.r, 1e-4), 0);
}
)";

/// The share of the sky that is hidden from a place on the ground. In each of twelve directions, a surface
/// that stands or hangs there hides elevations from its lowest to its highest point; of a sky that shines on
/// a plane evenly, that is the difference of the squares of their sines. Samples are as wide as they are
/// apart.
inline constexpr const char* kFloorSkyFragment = R"(
uniform vec2 lit_low, lit_size;  // [m], of the ground
uniform mat4 sky_matrix;
uniform float map_px;
uniform float first_m;  // radius
uniform float growth;
uniform float texel_m;  // of the finest level
layout(binding = 6) uniform sampler2D reduced;
layout(location = 0) out vec4 color;
void main() {
  vec2 at = lit_low + lit_size * gl_FragCoord.xy / map_px;
  float hidden = 0.0;
  for (int k = 0; k < 12; ++k) {
    float angle = 0.523599 * (float(k) + 0.5), r = first_m, lowest = 1.0, highest = 0.0, covered = 0.0;
    vec2 way = vec2(cos(angle), sin(angle));
    for (int j = 0; j < 8; ++j) {
      vec2 to = at + r * way;
      vec2 q = (sky_matrix * vec4(to.x, 0, to.y, 1)).xy;
      vec3 band = textureLod(reduced, q, max(log2(0.5 * r / texel_m), 0.0)).rgb;
      vec2 height = band.gb / max(band.r, 1e-4), squared = height * height;
      vec2 sine2 = squared / (squared + r * r);
      float there = smoothstep(0.0, 0.25, band.r);
      lowest = min(lowest, mix(1.0, sine2.x, there));
      highest = max(highest, there * sine2.y);
      covered = max(covered, band.r);
      r *= growth;
    }
    hidden += covered * max(highest - lowest, 0.0);
  }
  color = vec4(hidden / 12.0, 0, 0, 0);
}
)";

/// Red: how much of the key light a place on the ground gets. The light is a disc, so a shadow is the
/// blurrier the farther away its caster is (percentage closer soft shadows, Fernando 2005). Green: how much
/// of the sky.
inline constexpr const char* kFloorLightFragment = R"(
uniform vec2 lit_low, lit_size;
uniform float floor_y_m;
uniform mat4 sun_matrix;
uniform vec2 sun_map_m;  // sides
uniform float sun_range_m;
uniform float sun_tangent;  // of the key light's radius
uniform float map_px;
uniform bool shadows;
uniform bool occlusion;
layout(binding = 0) uniform sampler2DShadow sun_map;
layout(binding = 6) uniform sampler2D sun_depths;
layout(binding = 7) uniform sampler2D floor_sky;
layout(location = 0) out vec4 color;

vec2 spiral(int i, float count) {
  float angle = 2.39996 * float(i), r = sqrt((float(i) + 0.5) / count);
  return r * vec2(cos(angle), sin(angle));
}

float sun_share(vec2 at) {
  vec3 q = (sun_matrix * vec4(at.x, floor_y_m, at.y, 1)).xyz;
  float farthest_m = shadows ? sun_tangent * max(q.z, 0.0) * sun_range_m : 0.0;
  vec2 reach = farthest_m / sun_map_m;
  bool outside = any(greaterThan(abs(q.xy - 0.5), 0.5 + reach));
  int searched = shadows && !outside ? 24 : 0;
  vec2 found = vec2(0);
  for (int i = 0; i < searched; ++i) {
    float z = textureLod(sun_depths, q.xy + reach * spiral(i, 24.0), 0.0).r;
    found += z < min(q.z, 0.9999) ? vec2(1, q.z - z) : vec2(0);
  }
  float blur_m = sun_tangent * found.y / max(found.x, 1.0) * sun_range_m;
  vec2 radius = max(blur_m, 1.3 * max(lit_size.x, lit_size.y) / map_px) / sun_map_m;
  int taps = found.x > 0.0 ? 48 : 0;
  float lit = 0.0;
  for (int i = 0; i < taps; ++i)
    lit += textureLod(sun_map, vec3(q.xy + radius * spiral(i, 48.0), min(q.z, 0.9999)), 0.0);
  return taps > 0 ? lit / float(taps) : 1.0;
}

// A cubic B-spline: four filtered reads.
float hidden_sky(vec2 uv) {
  vec2 size = vec2(textureSize(floor_sky, 0)), x = uv * size - 0.5, f = fract(x), base = floor(x);
  vec2 f2 = f * f, f3 = f2 * f;
  vec2 w0 = (1.0 - f) * (1.0 - f) * (1.0 - f) / 6.0, w1 = (4.0 - 6.0 * f2 + 3.0 * f3) / 6.0, w3 = f3 / 6.0;
  vec2 g0 = w0 + w1, g1 = 1.0 - g0;
  vec2 a = (base - 0.5 + w1 / g0) / size, b = (base + 1.5 + w3 / g1) / size;
  return g0.y * (g0.x * textureLod(floor_sky, a, 0.0).r + g1.x * textureLod(floor_sky, vec2(b.x, a.y), 0.0).r) +
         g1.y * (g0.x * textureLod(floor_sky, vec2(a.x, b.y), 0.0).r + g1.x * textureLod(floor_sky, b, 0.0).r);
}

void main() {
  vec2 uv = gl_FragCoord.xy / map_px;
  float open = occlusion ? 1.0 - 0.75 * hidden_sky(uv) : 1.0;
  color = vec4(sun_share(lit_low + lit_size * uv), open, 0, 0);
}
)";

}  // namespace tactus::shaders
