#include "tactus/geom/lattice/mass_points.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <vector>

#include "tactus/base/at.h"

namespace tactus {
namespace {

/// First moments of all cubes, in spacings times kg.
class MassPoints {
 public:
  explicit MassPoints(const CubeLattice& lattice)
      : lattice_(lattice),
        count_(lattice.regular_cubes()),
        dims_(lattice.node_dims),
        id_(at(std::int64_t{dims_.x} * dims_.y * dims_.z), -1),
        own_(at(count_)),
        inwards_(at(count_)),
        first_(at(count_)),
        is_changed_(at(count_)) {
    for (Index c = 0; c < count_; ++c) id_[at(cell(lattice.cubes[at(c)]))] = c;
    double mass_of_all = 0;
    Vec3d excess{}, center{}, square{};
    for (Index c = 0; c < count_; ++c) {
      mass_of_all += mass(c);
      excess += mass(c) / 6 * Vec3d{1, 1, 1};
      pair_with_neighbours(c);
    }
    for (const CubeLattice::OffCentre& of : lattice.off_centre) {
      own_[at(of.cube)] = mass(of.cube) * vec_cast<double>(of.first);
      excess += mass(of.cube) * vec_cast<double>(of.excess);
    }
    for (Index c = 0; c < count_; ++c) {
      const Vec3d x = vec_cast<double>(lattice.cubes[at(c)]);
      center += mass(c) * x + own_[at(c)];
      for (int a = 0; a < 3; ++a) square[a] += mass(c) * (sqr(x[a]) + 0.25) + 2 * x[a] * own_[at(c)][a];
    }
    for (Index c = 0; c < count_; ++c)
      if (own_[at(c)] != Vec3d{} || inwards_[at(c)] != Vec3d{}) add_changed(c);
    for (int a = 0; a < 3; ++a) body_[a] = square[a] - excess[a] - sqr(center[a]) / mass_of_all;
    for (int a = 0; a < 3; ++a)
      if (effect_[a] > 0) k_[a] = excess[a] / effect_[a];
    wanted_ = weighted(own_) - excess;
  }

  /// Moments that are limited don't have all of their effect, so the rest is asked for again.
  /// @returns by which part inertia is off, apart from axes along which nothing can be moved
  double find(double most_uneven) {
    constexpr int kRounds = 6;
    constexpr double kMost = 10, kEnough = 1e-5;
    most_uneven_ = most_uneven;
    Vec3d k = k_;
    for (int round = 0; round < kRounds; ++round) {
      for (const Index c : changed_)
        for (int a = 0; a < 3; ++a) first_[at(c)][a] = own_[at(c)][a] + k[a] * inwards_[at(c)][a];
      limit_all();
      lacks_ = weighted(first_) - wanted_;
      bool done = true;
      for (int a = 0; a < 3; ++a) {
        if (effect_[a] > 0)
          k[a] = std::clamp(k[a] + lacks_[a] / effect_[a], 0.0, kMost);
        else
          lacks_[a] = 0;
        done = done && std::abs(lacks_[a]) <= kEnough * body_[a];
      }
      if (done) break;
    }
    double error = 0;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      error = std::max(error, std::abs(lacks_[a] + lacks_[b]) / (body_[a] + body_[b]));
    }
    return error;
  }
  Vec3d half_spacings(Index c) const { return mass(c) > 0 ? 2 / mass(c) * first_[at(c)] : Vec3d{}; }
  double most_uneven() const {
    double most = 1;
    for (const Index c : changed_) most = std::max(most, uneven(half_spacings(c)));
    return most;
  }

 private:
  double mass(Index c) const { return double{lattice_.cube_mass_kg[at(c)]}; }
  std::int64_t cell(Vec3i p) const { return (std::int64_t{p.z} * dims_.y + p.y) * dims_.x + p.x; }
  /// Nodes go one step further than cubes, so a cube's neighbours are in the box; -1: none.
  Index neighbour(Index c, int axis, Index step) const {
    Vec3i p = lattice_.cubes[at(c)];
    p[axis] += step;
    return p[axis] < 0 ? -1 : id_[at(cell(p))];
  }
  void pair_with_neighbours(Index c) {
    for (int a = 0; a < 3; ++a) {
      const Index next = neighbour(c, a, 1);
      if (next < 0) continue;
      const double least = std::min(mass(c), mass(next)) / 12;
      inwards_[at(c)][a] += least;
      inwards_[at(next)][a] -= least;
      effect_[a] += 2 * least;
    }
  }
  /// The second moments that first ones add.
  Vec3d weighted(const std::vector<Vec3d>& first) const {
    Vec3d sum{};
    for (const Index c : changed_) {
      const Vec3d x = vec_cast<double>(lattice_.cubes[at(c)]);
      for (int a = 0; a < 3; ++a) sum[a] += 2 * x[a] * first[at(c)][a];
    }
    return sum;
  }
  /// For masses that are shared trilinearly from t.
  static double uneven(Vec3d t) { return 1 / ((1 - sqr(t.x)) * (1 - sqr(t.y)) * (1 - sqr(t.z))); }
  /// The part of a cube's moment that it may keep.
  Vec3d allowed(Index c) const {
    const Vec3d t = half_spacings(c);
    const auto fits = [&](double part) {
      const Vec3d less = part * t;
      return std::max({std::abs(less.x), std::abs(less.y), std::abs(less.z)}) < 1 &&
             uneven(less) <= most_uneven_;
    };
    if (fits(1)) return first_[at(c)];
    double low = 0, high = 1;
    for (int k = 0; k < 24; ++k) (fits(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    return low * first_[at(c)];
  }
  void add_changed(Index c) {
    if (is_changed_[at(c)] != 0) return;
    is_changed_[at(c)] = 1;
    changed_.push_back(c);
  }
  /// The rest that neighbours can't take in a few rounds goes to all that aren't in the middle.
  void limit_all() {
    constexpr int kSweeps = 8;
    bool changes = true;
    for (int sweep = 0; sweep < kSweeps && changes; ++sweep) {
      changes = false;
      for (std::size_t k = 0; k < changed_.size(); ++k) changes = hand_on(changed_[k]) || changes;
    }
    Vec3d rest{};
    double taking = 0;
    for (const Index c : changed_) {
      taking += mass(c);
      const Vec3d kept = allowed(c);
      rest += first_[at(c)] - kept;
      first_[at(c)] = kept;
    }
    if (rest == Vec3d{}) return;
    for (const Index c : changed_) first_[at(c)] += mass(c) / taking * rest;
  }
  bool hand_on(Index c) {
    bool changes = false;
    const Vec3d kept = allowed(c);
    for (int a = 0; a < 3; ++a) {
      double& own = first_[at(c)][a];
      const double rest = own - kept[a];
      if (rest == 0) continue;
      const Index step = rest < 0 ? -1 : 1;
      Index next = neighbour(c, a, step);
      if (next < 0) next = neighbour(c, a, -step);
      if (next < 0) continue;
      own -= rest;
      first_[at(next)][a] += rest;
      add_changed(next);
      changes = true;
    }
    return changes;
  }

  const CubeLattice& lattice_;
  Index count_;
  Vec3i dims_;
  std::vector<Index> id_;                     ///< of cubes, over nodes of the box; -1: none
  std::vector<Vec3d> own_, inwards_, first_;  ///< that the surface leaves; to add k times; all
  std::vector<std::uint8_t> is_changed_;
  std::vector<Index> changed_;  ///< those with moments
  double most_uneven_ = 1;
  Vec3d body_{};          ///< second moments about the centre of mass
  Vec3d effect_{}, k_{};  ///< the part that inwards_ takes from them; how much of it
  Vec3d wanted_{}, lacks_{};
};

}  // namespace

void place_masses(CubeLattice& lattice) {
  lattice.mass_at.clear();
  lattice.uneven = 1;
  const Vec3i cubes = lattice.node_dims - Vec3i{1, 1, 1};
  if ((cubes.x == 1 ? 1 : 0) + (cubes.y == 1 ? 1 : 0) + (cubes.z == 1 ? 1 : 0) < 2) {
    MassPoints points(lattice);
    const double best = std::max(kInertiaBar, 1.25 * points.find(*std::rbegin(kMostUneven)));
    for (const double most : kMostUneven)
      if (points.find(most) <= best) break;
    lattice.uneven = static_cast<float>(points.most_uneven());
    lattice.mass_at.resize(at(lattice.regular_cubes()));
    for (Index c = 0; c < lattice.regular_cubes(); ++c)
      lattice.mass_at[at(c)] = vec_cast<float>(points.half_spacings(c));
  }
  lattice.share_masses();
}

}  // namespace tactus
