#include "tactus/tissue/cut/blade_trail.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/at.h"
#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/flsm/region_rotation.h"

namespace tactus::cut {
namespace {

/// Nodes whose sums are one.
constexpr std::size_t kBlock = 1024;
/// Fewer nodes than these give no rotation.
constexpr double kLeastNodes = 8;

bool holds(const Box3f& box, Vec3f p) {
  return box.min.x <= p.x && p.x <= box.max.x && box.min.y <= p.y && p.y <= box.max.y && box.min.z <= p.z &&
         p.z <= box.max.z;
}

/// Sums over nodes in a box: places in the world, at rest, and products of both.
struct FitSums {
  double count = 0;
  Vec3d x_m{}, rest{};
  Mat3d product{};
  void add(const FitSums& b) {
    count += b.count;
    x_m += b.x_m;
    rest += b.rest;
    for (int i = 0; i < 3; ++i) product.row[i] += b.product.row[i];
  }
  void add(Vec3d p_m, Vec3d at_rest) {
    ++count;
    x_m += p_m;
    rest += at_rest;
    for (int i = 0; i < 3; ++i) product.row[i] += p_m[i] * at_rest;
  }
};

/// Pairs of places of nodes in a box.
struct Pairs {
  std::span<const Vec3f> before, x_m;
  const std::function<bool(std::size_t)>& counts;
  /// About a point near them, so sums of products lose nothing. In blocks, added in their order.
  FitSums sums_in(const Box3f& box_m, Vec3d about_m) const {
    std::vector<FitSums> blocks((x_m.size() + kBlock - 1) / kBlock);
    cpu_for(blocks.size(), 4, [&](std::size_t b) {
      for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, x_m.size()); ++i)
        if (holds(box_m, x_m[i]) && counts(i))
          blocks[b].add(vec_cast<double>(x_m[i]) - about_m, vec_cast<double>(before[i]));
    });
    FitSums sum;
    for (const FitSums& block : blocks) sum.add(block);
    return sum;
  }
};

/// To a whole multiple of 2^-14, for numbers up to 2^37: the last bit of the sum counts as much.
float snapped(double v) {
  constexpr double kBig = 1.5 * 0x1p38;
  return static_cast<float>((v + kBig) - kBig);
}
static_assert(0x1p38 == 0x1p52 * 0x1p-14);

}  // namespace

RestFrame RestFrame::fit(std::span<const Vec3f> before, std::span<const Vec3f> x_m, float spacing_m,
                         const std::function<bool(std::size_t)>& counts, const Box3f& box_m,
                         const Quatf& guess) {
  const Vec3d about_m = vec_cast<double>(box_m.center());
  const Pairs pairs{before, x_m, counts};
  FitSums sum = pairs.sums_in(box_m, about_m);
  constexpr float kFar = 1e30F;
  if (sum.count < kLeastNodes) sum = pairs.sums_in({{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}}, about_m);
  RestFrame frame;
  frame.spacing_m = spacing_m;
  frame.turn = guess;
  if (!(sum.count > 0)) return frame;
  const Vec3d middle_m = sum.x_m / sum.count;
  frame.middle_m = about_m + middle_m;
  frame.middle = sum.rest / sum.count;
  Mat3d A = sum.product;
  double square = 0;
  for (int i = 0; i < 3; ++i) {
    A.row[i] -= middle_m[i] * sum.rest;
    square += dot(A.row[i], A.row[i]);
  }
  if (!(square > 0)) return frame;
  const double scale = 1 / std::sqrt(square);
  const Columns columns{vec_cast<float>(scale * A.column(0)), vec_cast<float>(scale * A.column(1)),
                        vec_cast<float>(scale * A.column(2))};
  for (int k = 0; k < 20; ++k) frame.turn = improve_rotation(frame.turn, columns);
  return frame;
}

void RestFrame::to_rest(std::span<const Vec3f> points_m, std::span<Vec3f> rest) const {
  const double per_m = 1 / double{spacing_m};
  const Mat3<float> to_world = rotation_matrix(turn);
  Vec3d column[3];
  for (int a = 0; a < 3; ++a) column[a] = per_m * vec_cast<double>(to_world.column(a));
  cpu_for((points_m.size() + kBlock - 1) / kBlock, 4, [&](std::size_t b) {
    for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, points_m.size()); ++i) {
      const Vec3d d = vec_cast<double>(points_m[i]) - middle_m;
      rest[i] = {snapped(middle.x + dot(column[0], d)), snapped(middle.y + dot(column[1], d)),
                 snapped(middle.z + dot(column[2], d))};
    }
  });
}

void BladeTrail::begin(std::span<const Vec3f> edge_m, float spacing_m) {
  *this = {};
  for (std::size_t i = 1; i < edge_m.size(); ++i)
    parts.push_back(std::clamp(static_cast<int>(2 * length(edge_m[i] - edge_m[i - 1]) / spacing_m), 1, 200));
}

void BladeTrail::follow(const TopologyChange& change) {
  if (nodes.empty()) return;
  for (const TopologyChange::Node& node : change.nodes) {
    if (node.from < 0) continue;
    nodes[at(node.node)] = nodes[at(node.from)];
    names[at(node.node)] = names[at(node.from)];
  }
}

std::vector<Vec3f> BladeTrail::points_of(std::span<const Vec3f> edge_m) const {
  std::vector<Vec3f> points_m{edge_m.front()};
  for (std::size_t i = 1; i < edge_m.size(); ++i)
    for (int k = 1; k <= parts[i - 1]; ++k)
      points_m.push_back(edge_m[i - 1] + static_cast<float>(k) / static_cast<float>(parts[i - 1]) *
                                             (edge_m[i] - edge_m[i - 1]));
  return points_m;
}

}  // namespace tactus::cut
