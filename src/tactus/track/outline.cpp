#include "tactus/track/outline.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tactus/geom/mesh/mesh_defects.h"

namespace tactus {
namespace {

constexpr double kNearest_m = 0.02;       // to the camera
constexpr float kRounding_px = 1.F / 64;  // more than that of floats, over outlines of thousands of pixels

double cross2(Vec2d a, Vec2d b) { return a.x * b.y - a.y * b.x; }
double dot2(Vec2d a, Vec2d b) { return a.x * b.x + a.y * b.y; }

}  // namespace

OutlineMesh::OutlineMesh(const TriangleMesh& mesh, const char* what) {
  check_closed(mesh, what);
  for (const Vec3f p : mesh.positions_m) vertices_m.push_back(vec_cast<double>(p));
  std::map<std::pair<Index, Index>, std::vector<Index>> face_of;  // of each directed edge
  Vec3d moment{};
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t i) { return vertices_m[static_cast<std::size_t>(t[i])]; };
    const Vec3d a = at(0), b = at(1), c = at(2), n = cross(b - a, c - a);
    const double part = dot(a, cross(b, c));
    volume += part;
    moment += (part / 4) * (a + b + c);
    for (std::size_t i = 0; i < 3; ++i)
      face_of[{t[i], t[(i + 1) % 3]}].push_back(static_cast<Index>(triangles.size()));
    normals.push_back(n);
    offsets_m.push_back(dot(n, a));
    triangles.push_back(t);
  }
  center_m = moment / volume;
  Vec3d low_m = center_m, high_m = center_m;
  for (const Vec3d& p : vertices_m) {
    radius_m = std::max(radius_m, length(p - center_m));
    vertex_coordinates_m.push_back(p);
    low_m = min(low_m, p);
    high_m = max(high_m, p);
  }
  for (std::size_t k = 0; k < box_m.size(); ++k)
    box_m[k] = {(k & 1) != 0 ? high_m.x : low_m.x, (k & 2) != 0 ? high_m.y : low_m.y,
                (k & 4) != 0 ? high_m.z : low_m.z};
  for (const auto& [ends, left] : face_of) {
    if (ends.first > ends.second) continue;
    const std::vector<Index>& right = face_of[{ends.second, ends.first}];
    for (std::size_t k = 0; k < left.size(); ++k)
      edges.push_back({ends.first, ends.second, left[k], right[k]});
  }
}

bool OutlineFinder::find(const OutlineMesh& mesh, const Rigidd& T_world_model, const Camera& camera,
                         double spacing_px, double reach_px) {
  mesh_ = &mesh;
  T_world_model_ = T_world_model;
  reach_px_ = reach_px;
  segments_.clear();
  points_.clear();
  const Rigidd T_cam_model = camera.T_cam_world * T_world_model;
  if (transform_vertices(T_cam_model) < kNearest_m) return false;
  find_seen(inverse(T_cam_model).t);
  add_segments(camera);
  chain_segments();
  double left_px = 0.5 * spacing_px;
  for (std::size_t i = 0; i < segments_.size(); ++i) add_points(i, spacing_px, left_px);
  return true;
}

double OutlineFinder::transform_vertices(const Rigidd& T_cam_model) {
  const std::size_t count = mesh_->vertices_m.size();
  camera_m_.resize(count);
  const OutlineMesh::Vectors& from_m = mesh_->vertex_coordinates_m;
  const double *x = from_m.x.data(), *y = from_m.y.data(), *z = from_m.z.data();
  double *to_x = camera_m_.x.data(), *to_y = camera_m_.y.data(), *to_z = camera_m_.z.data();
  double nearest_m = 1e30;
#pragma omp simd reduction(min : nearest_m)
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d p = T_cam_model * Vec3d{x[i], y[i], z[i]};
    to_x[i] = p.x;
    to_y[i] = p.y;
    to_z[i] = p.z;
    nearest_m = std::min(nearest_m, p.z);
  }
  return nearest_m;
}

void OutlineFinder::find_seen(Vec3d eye_m) {
  const std::size_t count = mesh_->triangles.size();
  seen_.resize(count);
  const double *x = mesh_->normals.x.data(), *y = mesh_->normals.y.data(), *z = mesh_->normals.z.data(),
               *offset_m = mesh_->offsets_m.data();
  std::uint8_t* seen = seen_.data();
#pragma omp simd
  for (std::size_t f = 0; f < count; ++f)
    seen[f] = x[f] * eye_m.x + y[f] * eye_m.y + z[f] * eye_m.z > offset_m[f] ? 1 : 0;
}

void OutlineFinder::add_segments(const Camera& camera) {
  unchained_.clear();
  const auto pixel = [&](Index v) {
    const Vec3d p = camera_m_[v];
    return Vec2d{(camera.fx_px * p.x + camera.skew_px * p.y) / p.z + camera.cx_px,
                 camera.fy_px * p.y / p.z + camera.cy_px};
  };
  const std::uint8_t* seen = seen_.data();
  for (const OutlineMesh::Edge& e : mesh_->edges) {
    if (seen[e.left] == seen[e.right]) continue;
    const bool left = seen[e.left] != 0;
    const Index from = left ? e.from : e.to, to = left ? e.to : e.from;
    unchained_.push_back({pixel(from), pixel(to), from, to});
  }
}

/// In the order in which they follow each other.
void OutlineFinder::chain_segments() {
  first_from_.assign(mesh_->vertices_m.size(), -1);
  next_from_.assign(unchained_.size(), -1);
  for (std::size_t i = unchained_.size(); i-- > 0;) {
    Index& first = first_from_[static_cast<std::size_t>(unchained_[i].from)];
    next_from_[i] = first;
    first = static_cast<Index>(i);
  }
  const auto take = [&](Index vertex) {
    Index& first = first_from_[static_cast<std::size_t>(vertex)];
    const Index i = first;
    if (i >= 0) first = next_from_[static_cast<std::size_t>(i)];
    return i;
  };
  for (const Segment& start : unchained_) {
    for (Index vertex = start.from, i = take(vertex); i >= 0; i = take(vertex)) {
      segments_.push_back(unchained_[static_cast<std::size_t>(i)]);
      vertex = segments_.back().to;
    }
  }
  const std::size_t count = segments_.size();
  Middles& middles = middles_px_;
  for (auto* coordinate : {&middles.x, &middles.y, &middles.half_x, &middles.half_y})
    coordinate->resize(count);
  is_beside_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2d half_px = 0.5 * (segments_[i].to_px - segments_[i].from_px),
                middle_px = segments_[i].from_px + half_px - segments_[0].from_px;
    middles.x[i] = static_cast<float>(middle_px.x);
    middles.y[i] = static_cast<float>(middle_px.y);
    middles.half_x[i] = static_cast<float>(half_px.x);
    middles.half_y[i] = static_cast<float>(half_px.y);
  }
}

/// @param left_px way to the next point, from segment to segment: each pixel of the outline counts the same
void OutlineFinder::add_points(std::size_t own, double spacing_px, double& left_px) {
  const Segment& segment = segments_[own];
  const Vec2d along = segment.to_px - segment.from_px;
  const double length_px = std::sqrt(dot2(along, along));
  if (!(length_px > 0)) return;
  // Seen from outside, corners go round to the left, and y points down.
  const Vec2d normal = (1 / length_px) * Vec2d{-along.y, along.x};
  if (left_px < length_px) find_beside(own, normal);
  const Vec3d a = camera_m_[segment.from], b = camera_m_[segment.to];
  for (; left_px < length_px; left_px += spacing_px) {
    const double t = left_px / length_px;                      // in the picture
    const double share = t * a.z / (t * a.z + (1 - t) * b.z);  // in space
    const Vec3d from_m = mesh_->vertices_m[static_cast<std::size_t>(segment.from)],
                to_m = mesh_->vertices_m[static_cast<std::size_t>(segment.to)];
    measure({.at_m = T_world_model_ * (from_m + share * (to_m - from_m)),
             .px = segment.from_px + t * along,
             .normal = normal},
            reach_px_);
  }
  left_px -= length_px;
}

void OutlineFinder::find_beside(std::size_t own, Vec2d normal) {
  beside_.clear();
  const std::size_t count = segments_.size();
  const float *x = middles_px_.x.data(), *y = middles_px_.y.data(), *half_x = middles_px_.half_x.data(),
              *half_y = middles_px_.half_y.data();
  const auto normal_x = static_cast<float>(normal.x), normal_y = static_cast<float>(normal.y);
  const float middle = normal_x * y[own] - normal_y * x[own],
              reach = std::abs(normal_x * half_y[own] - normal_y * half_x[own]) + kRounding_px;
  std::int32_t* is_beside = is_beside_.data();
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const float away = normal_x * y[i] - normal_y * x[i] - middle,
                half = normal_x * half_y[i] - normal_y * half_x[i];
    is_beside[i] = std::abs(away) - std::abs(half) <= reach ? 1 : 0;
  }
  is_beside[own] = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (is_beside[i] == 0) continue;
    const Segment& s = segments_[i];
    beside_.push_back(
        {cross2(normal, s.from_px), dot2(normal, s.from_px), cross2(normal, s.to_px), dot2(normal, s.to_px)});
  }
}

/// How many layers of the model lie behind a point of the picture is how often all segments go round it. So
/// along the normal it changes by one where it crosses a segment.
void OutlineFinder::measure(OutlinePoint point, double reach_px) {
  crossings_.clear();
  int outside = 0;
  const double along = cross2(point.normal, point.px), out = dot2(point.normal, point.px);
  for (const Turned& s : beside_) {
    const double da = s.from_along - along, db = s.to_along - along;
    if ((da < 0) == (db < 0)) continue;
    const double at_px = (da * (s.to_out - out) - db * (s.from_out - out)) / (da - db);
    const int change = da < db ? -1 : 1;
    if (at_px > 0) outside += change;
    crossings_.push_back({at_px, change});
  }
  if (outside != 0) return;  // it lies before or behind other parts
  std::sort(crossings_.begin(), crossings_.end(),
            [](const Crossing& a, const Crossing& b) { return a.at_px > b.at_px; });
  double gap_px = 2 * reach_px;
  int layers = 1;
  point.thickness_px = 0;
  for (const Crossing& c : crossings_) {
    if (c.at_px > 0) {
      gap_px = std::min(gap_px, c.at_px);
      continue;
    }
    layers += c.change;
    if (layers > 0) continue;
    point.thickness_px = -c.at_px;
    break;
  }
  if (!(point.thickness_px > 0)) return;  // at a corner, to rounding
  point.inner_px = std::min(0.5 * point.thickness_px, reach_px);
  point.outer_px = std::min(0.5 * gap_px, reach_px);
  points_.push_back(point);
}

}  // namespace tactus
