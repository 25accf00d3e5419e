#include "tactus/run/skin_look.h"

namespace tactus {
namespace {

constexpr int kPasses = 4;
constexpr float kIn = 0.5F, kOut = -0.52F;  // waves longer than some ten edges pass

}  // namespace

void smooth_skin(TriangleMesh& surface, const std::vector<std::uint8_t>& may_move) {
  std::vector<Vec3f>& x_m = surface.positions_m;
  std::vector<Vec3f> sums(x_m.size());
  std::vector<float> counts(x_m.size());
  for (int pass = 0; pass < 2 * kPasses; ++pass) {
    sums.assign(x_m.size(), {});
    counts.assign(x_m.size(), 0);
    for (const auto& t : surface.triangles)
      for (std::size_t k = 0; k < 3; ++k) {  // either end of an inner edge meets it twice
        const auto a = static_cast<std::size_t>(t.at(k)), b = static_cast<std::size_t>(t.at((k + 1) % 3));
        sums[a] += x_m[b], sums[b] += x_m[a];
        counts[a] += 1, counts[b] += 1;
      }
    const float share = pass % 2 == 0 ? kIn : kOut;
    for (std::size_t v = 0; v < x_m.size(); ++v)
      if (may_move[v] != 0 && counts[v] > 0) x_m[v] += share * ((1 / counts[v]) * sums[v] - x_m[v]);
  }
  compute_normals(surface);
}

}  // namespace tactus
