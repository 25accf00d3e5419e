#pragma once
/// Shaders that colour a surface from photographs (GLSL 4.50): the same steps and numbers as the compute pass
/// (PhotoChoice, reconstruct/texture/texture_kernels.h), for fragments instead of vertices. Internal to
/// view/.

namespace tactus::shaders {

/// World to the texels of a camera's map.
inline constexpr const char* kPhotoMapVertex = R"(
layout(location = 0) in vec3 position;
uniform vec4 row_u, row_v, row_z;
uniform mat3 turn;
uniform float texels_per_px;
uniform vec2 map_size;
void main() {
  vec4 q = vec4(turn * position, 1);
  vec3 h = vec3(dot(row_u, q), dot(row_v, q), dot(row_z, q));
  gl_Position = vec4(2.0 * (texels_per_px * h.xy + 0.5 * h.z) / map_size - h.z, 0, h.z);
}
)";
/// 1/z; the surface nearest to the camera remains (blended by GL_MAX).
inline constexpr const char* kPhotoMapFragment = R"(
layout(location = 0) out vec4 inverse_z;
void main() { inverse_z = vec4(gl_FragCoord.w); }
)";

/// 1/z of a texel of the map that a pass reads; beyond the map's rim, of the nearest in it.
inline constexpr const char* kPhotoMapTexel = R"(
uniform ivec2 last_texel;
uniform int layer;
layout(binding = 3) uniform sampler2DArray map;
float texel_at(ivec2 at) { return texelFetch(map, ivec3(clamp(at, ivec2(0), last_texel), layer), 0).r; }
)";
/// Widens the surfaces in a map by a texel on every side.
inline constexpr const char* kPhotoWidenFragment = R"(
layout(location = 0) out vec4 inverse_z;
void main() {
  float nearest = 0;
  for (int i = 0; i < 9; ++i)
    nearest = max(nearest, texel_at(ivec2(gl_FragCoord.xy) + ivec2(i % 3 - 1, i / 3 - 1)));
  inverse_z = vec4(nearest);
}
)";
/// Keeps the map's value and adds a second one: 1 where the outline of the body is more than about a texel
/// away, else 0.
inline constexpr const char* kPhotoOutlineFragment = R"(
layout(location = 0) out vec4 texel;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  float least = 1;
  for (int i = 0; i < 25; ++i) least = min(least, texel_at(at + ivec2(i % 5 - 2, i / 5 - 2)));
  texel = vec4(texel_at(at), least > 0.0 ? 1.0 : 0.0, 0, 0);
}
)";

/// The colour of a fragment from its best k cameras; where no camera sees it, that of its vertices.
inline constexpr const char* kPhotoFragment = R"(
in vec3 p;
in vec3 n;
in vec3 photo_color;
struct PhotoCamera {
  vec4 row_u, row_v, row_z;
  vec4 eye;   // w: 1 when there is a photo of this tick
  vec4 axis;  // w: texels of the map per pixel
  vec4 size;  // of the photo [px] and of the map [texels]
};
layout(std140, binding = 0) uniform PhotoCameras { PhotoCamera cameras[kMaxCameras]; };
layout(binding = 2) uniform sampler2DArray photos;
layout(binding = 3) uniform sampler2DArray maps;
uniform int camera_count;
uniform int best_k;
uniform vec3 eye;
uniform float bias_m;
uniform float opacity;
layout(location = 0) out vec4 color;

vec3 project(PhotoCamera c) {
  vec4 q = vec4(p, 1);
  return vec3(dot(c.row_u, q), dot(c.row_v, q), dot(c.row_z, q));
}

// 1 where the camera sees the point, 0 from about a texel before what hides it, almost 0 near the outline.
float visibility(PhotoCamera c, int layer, vec2 px, float z_m) {
  vec2 at = clamp(px * c.axis.w, vec2(0), c.size.zw - 2.0);
  ivec2 base = ivec2(at);
  vec2 f = at - vec2(base);
  float hidden_from = 1.0 / max(z_m - bias_m, 1e-3);
  vec2 texel[4];
  for (int i = 0; i < 4; ++i) {
    vec2 t = texelFetch(maps, ivec3(base + ivec2(i & 1, i >> 1), layer), 0).rg;
    texel[i] = vec2(t.r <= hidden_from ? 1.0 : 0.0, t.g);
  }
  vec2 mean = mix(mix(texel[0], texel[1], f.x), mix(texel[2], texel[3], f.x), f.y);
  return clamp(3.0 * mean.x - 2.0, 0.0, 1.0) * max(clamp(2.0 * mean.y - 1.0, 0.0, 1.0), kOutlineWeight);
}

float score(PhotoCamera c, int layer, vec3 normal, vec3 look) {
  vec3 h = project(c), to_camera = c.eye.xyz - p;
  if (c.eye.w == 0.0 || h.z <= 1e-3) return 0.0;
  vec2 px = h.xy / h.z, end = c.size.xy - 1.0;
  vec2 inside = min(px, end - px);
  float framed = clamp(min(inside.x, inside.y) / kBorderPx, 0.0, 1.0);
  float cosine = dot(normal, normalize(to_camera));
  float facing = clamp((cosine - kLeastCosine) / (kFullCosine - kLeastCosine), 0.0, 1.0);
  float f = framed * facing;
  if (f <= 0.0) return 0.0;
  float seen = visibility(c, layer, px, h.z);
  f *= seen;
  if (best_k == 1 && f > 0.0) f = seen > kOutlineWeight ? 1.0 : kOutlineWeight;
  return f / max(1.0 - dot(c.axis.xyz, look) + kEpsilon, kEpsilon);
}

vec3 photo_at(PhotoCamera c, int layer) {
  vec3 h = project(c);
  vec2 px = clamp(h.xy / h.z, vec2(0), c.size.xy - 1.0);
  return textureLod(photos, vec3((px + 0.5) / vec2(textureSize(photos, 0).xy), layer), 0.0).rgb;
}

void main() {
  vec3 normal = normalize(n), look = normalize(p - eye);
  float scores[kMaxCameras];
  for (int c = 0; c < camera_count; ++c) scores[c] = score(cameras[c], c, normal, look);
  // The best first; the first of equals wins. What comes after the k-th is taken from all weights.
  int chosen[kMostBlended];
  float weight[kMostBlended];
  int found = 0;
  float next = 0;
  for (int rank = 0; rank <= best_k; ++rank) {
    int best = 0;
    for (int c = 1; c < camera_count; ++c) best = scores[c] > scores[best] ? c : best;
    float s = scores[best];
    if (s <= 0.0) break;
    if (rank == best_k) { next = s; break; }
    chosen[found] = best;
    weight[found++] = s;
    scores[best] = 0.0;
  }
  if (best_k == 1) next = 0.0;
  vec3 sum = vec3(0);
  float total = 0;
  for (int rank = 0; rank < found; ++rank) {
    float w = max(weight[rank] - next, 1e-6 * weight[rank]);
    sum += w * photo_at(cameras[chosen[rank]], chosen[rank]);
    total += w;
  }
  // What no photo shows, without colours of its own: plain grey would look like a shadow on what is behind.
  vec3 unseen = photo_color.r < 0.0 ? vec3(0.62) * (0.35 + 0.65 * abs(dot(normal, look))) : photo_color;
  color = vec4(total > 0.0 ? sum / total : unseen, opacity);
}
)";

}  // namespace tactus::shaders
