#include "tactus/reconstruct/velocity.h"

#include <cmath>
#include <string>

#include "tactus/base/error.h"
#include "tactus/geom/cholesky.h"
#include "tactus/geom/point_tree.h"

namespace tactus {
namespace {

constexpr double kDamping = 1e-3;  // of directions that the shape says nothing about

/// exp of a twist: v and w times the time.
Rigidd pose_of(Vec3d v, Vec3d w) {
  const double angle = length(w);
  if (angle < 1e-12) return {Mat3d::identity(), v};
  const Vec3d axis = w / angle;
  const double half = angle / 2;
  const Vec3d s = std::sin(half) * axis;
  const Mat3d R = rotation_matrix(Quat<double>{std::cos(half), s.x, s.y, s.z});
  const Vec3d along = dot(axis, v) * axis, side = cross(axis, v);
  const Vec3d t = along + std::sin(angle) / angle * (v - along) + (1 - std::cos(angle)) / angle * side;
  return {R, t};
}

struct Twist {
  Vec3d v, w;
};
/// Its inverse, for turns below pi.
Twist twist_of(const Rigidd& T) {
  const Vec3d twice_sin{T.R(2, 1) - T.R(1, 2), T.R(0, 2) - T.R(2, 0), T.R(1, 0) - T.R(0, 1)};
  const double sine = length(twice_sin) / 2, angle = std::atan2(sine, (trace(T.R) - 1) / 2);
  if (sine < 1e-12) return {T.t, {}};
  const Vec3d axis = twice_sin / (2 * sine), along = dot(axis, T.t) * axis;
  const double half = angle / 2;
  // Solves the planar part of `pose_of` for v.
  const Vec3d v = along + half / std::tan(half) * (T.t - along) - half * cross(axis, T.t);
  return {v, angle * axis};
}

/// Normal equations of one step, and how good the pose was.
struct Sums {
  double a[6][6] = {}, b[6] = {}, squares = 0, arm2 = 0;
  int matched = 0;
};

struct Quality {
  double rms_m = 0, share = 0;
  /// Explains more than `simpler` does: noise alone can't halve the mean square.
  bool clearly_better_than(const Quality& simpler) const {
    return share > simpler.share + 0.05 ||
           (share >= simpler.share - 0.05 && rms_m * rms_m < 0.5 * simpler.rms_m * simpler.rms_m);
  }
};

}  // namespace

/// What is kept of one piece.
struct VelocityTracker::Surface {
  std::vector<Vec3d> points_m, normals;  ///< that are registered
  std::vector<Vec3d> target_m, target_normals;
  PointTree tree;
  Vec3d centroid_m;

  /// Sums over a's points, moved by T, against this surface's tangent planes.
  Sums against(const Surface& a, const Rigidd& T, double reach_m) const {
    Sums s;
    for (std::size_t i = 0; i < a.points_m.size(); ++i) {
      const Vec3d q = T * a.points_m[i];
      const Index near = tree.nearest(q, reach_m);
      if (near < 0) continue;
      const Vec3d n = target_normals[static_cast<std::size_t>(near)];
      if (dot(T.R * a.normals[i], n) < 0.5) continue;  // another side
      const double e = dot(q - target_m[static_cast<std::size_t>(near)], n);
      const double weight = 1 / (1 + 16 * e * e / (reach_m * reach_m));
      const Vec3d arm = q - centroid_m, r = cross(arm, n);
      const double row[6] = {r.x, r.y, r.z, n.x, n.y, n.z};
      for (int j = 0; j < 6; ++j) {
        for (int k = 0; k < 6; ++k) s.a[j][k] += weight * row[j] * row[k];
        s.b[j] -= weight * row[j] * e;
      }
      s.squares += e * e;
      s.arm2 += dot(arm, arm);
      ++s.matched;
    }
    return s;
  }
  Quality quality(const Surface& a, const Rigidd& T, double reach_m) const {
    const Sums s = against(a, T, reach_m);
    return {
        s.matched > 0 ? std::sqrt(s.squares / s.matched) : 0,
        static_cast<double>(s.matched) / static_cast<double>(std::max<std::size_t>(1, a.points_m.size()))};
  }
  /// Damped Gauss-Newton from a first guess: far first, then near.
  Rigidd refine(const Surface& a, Rigidd T, double voxel_m, int iterations) const {
    for (int i = 0; i < iterations; ++i) {
      Sums s = against(a, T, (3 * i < iterations ? 8 : 2) * voxel_m);
      if (s.matched < 12) break;
      const double move = kDamping * (s.a[3][3] + s.a[4][4] + s.a[5][5]);
      const double turn = move * s.arm2 / s.matched;
      for (int k = 0; k < 6; ++k) s.a[k][k] += k < 3 ? turn : move;
      solve_cholesky(s.a, s.b);  // positive definite through its damping
      const Vec3d w{s.b[0], s.b[1], s.b[2]}, t{s.b[3], s.b[4], s.b[5]};
      if (!(length(w) < 1)) break;
      const Mat3d R = pose_of({}, w).R;
      T = Rigidd{R, centroid_m - R * centroid_m + t} * T;
    }
    return T;
  }
};

const char* to_string(VelocitySource source) {
  switch (source) {
    case VelocitySource::rigid:
      return "rigid";
    case VelocitySource::centroid:
      return "centroid";
    case VelocitySource::borrowed:
      return "borrowed";
    default:
      return "still";
  }
}

VelocityTracker::VelocityTracker(const VelocityOptions& options) : options_(options) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0))
      throw Error(std::string("velocity: ") + name + " is " + std::to_string(value) + ", must be > 0");
  };
  positive("voxel_size_m", options.voxel_size_m);
  positive("points", options.points);
  positive("targets", options.targets);
  positive("iterations", options.iterations);
  positive("max_turn_rad", options.max_turn_rad);
}
VelocityTracker::~VelocityTracker() = default;
VelocityTracker::VelocityTracker(VelocityTracker&&) noexcept = default;

PieceMotion VelocityTracker::measure(const Surface& before, const Surface& now, const PieceMotion& last,
                                     double dt_s) const {
  const double voxel = options_.voxel_size_m, reach = 2 * voxel;
  const Rigidd shift{Mat3d::identity(), now.centroid_m - before.centroid_m};
  const Quality still = now.quality(before, {}, reach), shifted = now.quality(before, shift, reach);
  std::vector<Rigidd> guesses{shift};
  if (last.source == VelocitySource::rigid)
    guesses.push_back(pose_of(dt_s * last.velocity_m_s, dt_s * last.spin_rad_s));
  Rigidd T;
  Quality fit;
  for (std::size_t i = 0; i < guesses.size(); ++i) {
    const Rigidd refined = now.refine(before, guesses[i], voxel, options_.iterations);
    const Quality q = now.quality(before, refined, reach);
    if (i == 0 || q.share * (fit.rms_m + 1e-3 * voxel) > fit.share * (q.rms_m + 1e-3 * voxel)) {
      T = refined;
      fit = q;
    }
  }
  const Twist twist = twist_of(T);
  const bool good = fit.share >= 0.6 && fit.rms_m <= voxel && length(twist.w) <= options_.max_turn_rad;
  const bool moves = shifted.clearly_better_than(still) || still.share < 0.6 || still.rms_m > voxel;
  const Quality& simpler = moves ? shifted : still;
  if (good && fit.clearly_better_than(simpler))
    return {last.label, VelocitySource::rigid, 1 / dt_s * twist.v, 1 / dt_s * twist.w, fit.rms_m, fit.share};
  if (moves)
    return {last.label, VelocitySource::centroid, 1 / dt_s * shift.t, {}, simpler.rms_m, simpler.share};
  return {last.label, VelocitySource::still, {}, {}, simpler.rms_m, simpler.share};
}

PieceMotion VelocityTracker::smooth(const PieceMotion& measured, const MeshComponent& piece, double dt_s) {
  std::vector<PieceMotion>& last = known_[measured.label];
  const double size = length(piece.extent_m);
  const auto speed = [&](const Vec3d& v, const Vec3d& w) {
    return length(v + cross(w, piece.centroid_m)) + size * length(w);
  };
  if (!last.empty()) {
    const PieceMotion& newest = last.back();
    const double change =
        speed(measured.velocity_m_s - newest.velocity_m_s, measured.spin_rad_s - newest.spin_rad_s);
    const double agreed = 0.5 * speed(measured.velocity_m_s, measured.spin_rad_s) +
                          0.5 * options_.voxel_size_m / std::max(dt_s, 1e-9);
    if (measured.source != newest.source || measured.source == VelocitySource::still || change > agreed)
      last.clear();
  }
  last.push_back(measured);
  if (static_cast<int>(last.size()) > options_.smoothing_frames) last.erase(last.begin());
  PieceMotion mean = measured;
  mean.velocity_m_s = mean.spin_rad_s = {};
  const double share = 1.0 / static_cast<double>(last.size());
  for (const PieceMotion& m : last) {
    mean.velocity_m_s += share * m.velocity_m_s;
    mean.spin_rad_s += share * m.spin_rad_s;
  }
  return mean;
}

void VelocityTracker::borrow(const MeshComponents& components) {
  for (std::size_t i = 1; i < motions_.size(); ++i) {
    PieceMotion& motion = motions_[i];
    const double volume = std::abs(components.pieces[i].volume_m3);
    if (volume > options_.phantom_share * components.pieces.front().volume_m3) continue;
    const bool is_new = !previous_.contains(motion.label);
    if (is_new || motion.source == VelocitySource::centroid) {
      motion.velocity_m_s = motions_.front().velocity_m_s;
      motion.spin_rad_s = motions_.front().spin_rad_s;
      motion.source = VelocitySource::borrowed;
    }
  }
}

std::span<const PieceMotion> VelocityTracker::update(const TriangleMesh& mesh,
                                                     const MeshComponents& components, double dt_s) {
  if (mesh.normals.size() != mesh.positions_m.size() ||
      components.of_vertex.size() != mesh.positions_m.size())
    throw Error("velocity: " + std::to_string(mesh.positions_m.size()) + " vertices with " +
                std::to_string(mesh.normals.size()) + " normals and pieces of " +
                std::to_string(components.of_vertex.size()) + ", expected one each");
  std::vector<std::vector<std::size_t>> vertices(components.pieces.size());
  for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) {
    if (components.of_vertex[v] >= 0)
      vertices[static_cast<std::size_t>(components.of_vertex[v])].push_back(v);
  }
  std::map<int, Surface> current;
  motions_.clear();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const MeshComponent& piece = components.pieces[i];
    Surface& now = current[piece.label];
    now.centroid_m = piece.centroid_m;
    const auto pick = [&](int most, std::vector<Vec3d>& points, std::vector<Vec3d>& normals) {
      const std::size_t n = vertices[i].size(), kept = std::min(n, static_cast<std::size_t>(most));
      for (std::size_t k = 0; k < kept; ++k) {
        const std::size_t v = vertices[i][k * n / kept];
        points.push_back(vec_cast<double>(mesh.positions_m[v]));
        normals.push_back(vec_cast<double>(mesh.normals[v]));
      }
    };
    pick(options_.points, now.points_m, now.normals);
    pick(options_.targets, now.target_m, now.target_normals);
    now.tree = PointTree(now.target_m);
    PieceMotion motion{.label = piece.label};
    const auto before = previous_.find(piece.label);
    if (before != previous_.end() && dt_s > 0) {
      const std::vector<PieceMotion>& last = known_[piece.label];
      motion = smooth(measure(before->second, now, last.empty() ? motion : last.back(), dt_s), piece, dt_s);
    }
    motions_.push_back(motion);
  }
  if (dt_s > 0) borrow(components);
  previous_ = std::move(current);
  std::erase_if(known_, [this](const auto& known) { return !previous_.contains(known.first); });
  return motions_;
}

std::vector<Vec3f> vertex_velocities(const TriangleMesh& mesh, const MeshComponents& components,
                                     std::span<const PieceMotion> motions) {
  std::vector<Vec3f> velocities(mesh.positions_m.size());
  for (std::size_t v = 0; v < velocities.size(); ++v) {
    const Index piece = components.of_vertex[v];
    if (piece >= 0)
      velocities[v] =
          vec_cast<float>(motions[static_cast<std::size_t>(piece)].at(vec_cast<double>(mesh.positions_m[v])));
  }
  return velocities;
}

}  // namespace tactus
