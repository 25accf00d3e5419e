#include "tactus/track/outline.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tactus/geom/mesh_defects.h"

namespace tactus {
namespace {

constexpr double kNearest_m = 0.02;  // to the camera

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
    faces.x.push_back(n.x);
    faces.y.push_back(n.y);
    faces.z.push_back(n.z);
    faces.offset_m.push_back(dot(n, a));
    triangles.push_back(t);
  }
  center_m = moment / volume;
  Vec3d low_m = center_m, high_m = center_m;
  for (const Vec3d& p : vertices_m) {
    radius_m = std::max(radius_m, length(p - center_m));
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
  camera_m_.resize(mesh.vertices_m.size());
  for (std::size_t i = 0; i < camera_m_.size(); ++i) {
    camera_m_[i] = T_cam_model * mesh.vertices_m[i];
    if (camera_m_[i].z < kNearest_m) return false;
  }
  find_seen(inverse(T_cam_model).t);
  add_segments(camera);
  chain_segments();
  double left_px = 0.5 * spacing_px;
  for (std::size_t i = 0; i < segments_.size(); ++i) add_points(i, spacing_px, left_px);
  return true;
}

void OutlineFinder::find_seen(Vec3d eye_m) {
  const std::size_t count = mesh_->triangles.size();
  seen_.resize(count);
  const double *x = mesh_->faces.x.data(), *y = mesh_->faces.y.data(), *z = mesh_->faces.z.data(),
               *offset_m = mesh_->faces.offset_m.data();
  std::uint8_t* seen = seen_.data();
#pragma omp simd
  for (std::size_t f = 0; f < count; ++f)
    seen[f] = x[f] * eye_m.x + y[f] * eye_m.y + z[f] * eye_m.z > offset_m[f] ? 1 : 0;
}

void OutlineFinder::add_segments(const Camera& camera) {
  unchained_.clear();
  const auto pixel = [&](Index v) {
    const Vec3d p = camera_m_[static_cast<std::size_t>(v)];
    return Vec2d{(camera.fx_px * p.x + camera.skew_px * p.y) / p.z + camera.cx_px,
                 camera.fy_px * p.y / p.z + camera.cy_px};
  };
  for (const OutlineMesh::Edge& e : mesh_->edges) {
    const bool left = seen_[static_cast<std::size_t>(e.left)] != 0,
               right = seen_[static_cast<std::size_t>(e.right)] != 0;
    if (left == right) continue;
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
  for (auto* coordinate :
       {&ends_px_.from_x, &ends_px_.from_y, &ends_px_.to_x, &ends_px_.to_y, &from_along_, &to_along_})
    coordinate->resize(count);
  is_beside_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    ends_px_.from_x[i] = segments_[i].from_px.x;
    ends_px_.from_y[i] = segments_[i].from_px.y;
    ends_px_.to_x[i] = segments_[i].to_px.x;
    ends_px_.to_y[i] = segments_[i].to_px.y;
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
  const Vec3d a = camera_m_[static_cast<std::size_t>(segment.from)],
              b = camera_m_[static_cast<std::size_t>(segment.to)];
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
  const double begin = cross2(normal, segments_[own].from_px), end = cross2(normal, segments_[own].to_px),
               low = std::min(begin, end), high = std::max(begin, end);
  const std::size_t count = segments_.size();
  const double *from_x = ends_px_.from_x.data(), *from_y = ends_px_.from_y.data(),
               *to_x = ends_px_.to_x.data(), *to_y = ends_px_.to_y.data();
  double *from_along = from_along_.data(), *to_along = to_along_.data();
  std::uint8_t* is_beside = is_beside_.data();
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double from = normal.x * from_y[i] - normal.y * from_x[i],
                 to = normal.x * to_y[i] - normal.y * to_x[i];
    from_along[i] = from;
    to_along[i] = to;
    is_beside[i] = ((from >= low) | (to >= low)) & ((from <= high) | (to <= high));
  }
  is_beside[own] = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (is_beside[i] == 0) continue;
    beside_.push_back(
        {from_along[i], dot2(normal, segments_[i].from_px), to_along[i], dot2(normal, segments_[i].to_px)});
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
