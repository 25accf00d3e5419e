#include "tactus/world/weight_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {
namespace {

/// Pressure at the foot over Young's modulus that is borne. Blocks of 0.1 to 0.5 m that fell by 5 cm: those
/// of matched cubes were crushed from 0.39 on, not up to 0.33; those of elements stood at 1.
constexpr double kMatched = 0.3, kElements = 1;
/// A column of height H, cross-section A and second moment I that stands free buckles under its own weight
/// where w H^3 > 7.84 E I, with its weight per length w (Greenhill 1881).
constexpr double kGreenhill = 7.84;
/// Stacks of 2 to 5 matched cubes fell over up to 1.25 times the modulus of that, and stood at 1.5.
constexpr double kSlender = 1.3;
/// The modulus that is advised, over the one that would just do.
constexpr double kSafety = 1.25;

/// A body as a column: its extent along `up`, and its box across.
struct Column {
  double low_m = 1e30, high_m = -1e30;
  double min_m[2] = {1e30, 1e30}, max_m[2] = {-1e30, -1e30};
  double weight_N = 0, area_m2 = 0;  ///< the mean cross-section
  bool is_free = false;              ///< nothing holds it

  double height_m() const { return high_m - low_m; }
  double width_m() const { return std::min(max_m[0] - min_m[0], max_m[1] - min_m[1]); }
  /// A body that fills less of its box across is tilted, and lies down: a ball fills 0.52, a cube that is
  /// turned by 45 degrees 0.5, a rod of 0.5 m and 2 cm that is tilted by 3 degrees 0.43.
  bool stands() const {
    constexpr double kFills = 0.48;
    return area_m2 > kFills * (max_m[0] - min_m[0]) * (max_m[1] - min_m[1]);
  }
  double overlap_m2(const Column& other) const {
    double shared_m2 = 1;
    for (int a = 0; a < 2; ++a)
      shared_m2 *= std::max(0.0, std::min(max_m[a], other.max_m[a]) - std::max(min_m[a], other.min_m[a]));
    return shared_m2;
  }
};

Column column_of(const SoftBody& body, Vec3d gravity_m_s2) {
  const Vec3d up = (-1 / length(gravity_m_s2)) * gravity_m_s2;
  const Vec3d side = normalized(cross(up, std::abs(up.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 0, 1}));
  const Vec3d across[2] = {side, cross(up, side)};
  Column column;
  for (const Vec3f vertex : body.shape().surface_m.positions_m) {
    const auto p = vec_cast<double>(vertex);
    column.low_m = std::min(column.low_m, dot(p, up));
    column.high_m = std::max(column.high_m, dot(p, up));
    for (int a = 0; a < 2; ++a) {
      column.min_m[a] = std::min(column.min_m[a], dot(p, across[a]));
      column.max_m[a] = std::max(column.max_m[a], dot(p, across[a]));
    }
  }
  const CubeLattice& lattice = body.shape().lattice;
  column.weight_N = lattice.mass_kg() * length(gravity_m_s2);
  column.area_m2 = volume_m3(body.shape().surface_m) / column.height_m();
  column.is_free = body.description().contact && body.shape().motions.empty() &&
                   std::all_of(lattice.fixed.begin(), lattice.fixed.end(),
                               [](const HeldAxes& held) { return held == HeldAxes{}; });
  return column;
}

/// Weights and tops of bodies with all that rests on them. One that rests on several shares its weight by
/// area.
class Pile {
 public:
  Pile(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies) : bodies_(bodies) {
    for (const auto& body : bodies) columns_.push_back(column_of(*body, scene.gravity_m_s2));
    for (std::size_t b = 0; b < columns_.size(); ++b) order_.push_back(b);
    std::sort(order_.begin(), order_.end(),
              [&](std::size_t a, std::size_t b) { return columns_[a].low_m > columns_[b].low_m; });
    borne_N_.assign(columns_.size(), 0);
    top_m_.resize(columns_.size());
    above_.resize(columns_.size());
    is_leg_.resize(columns_.size());
    for (std::size_t b = 0; b < columns_.size(); ++b) top_m_[b] = columns_[b].high_m;
    for (const std::size_t b : order_)
      if (scene.contact.bodies && columns_[b].is_free) lay(b);
  }
  /// From the lowest to the highest.
  std::vector<std::size_t> upwards() const { return {order_.rbegin(), order_.rend()}; }
  const Column& column(std::size_t b) const { return columns_[b]; }
  double weight_N(std::size_t b) const { return columns_[b].weight_N + borne_N_[b]; }
  double height_m(std::size_t b) const { return top_m_[b] - columns_[b].low_m; }
  /// Nothing keeps it from leaning over: legs of one table keep one another.
  bool may_buckle(std::size_t b) const { return columns_[b].stands() && is_leg_[b] == 0; }
  /// All bodies on it, those upon them, too.
  const std::set<std::size_t>& above(std::size_t b) const { return above_[b]; }

 private:
  double gap_m(std::size_t under, std::size_t b) const { return columns_[b].low_m - columns_[under].high_m; }
  /// The bodies that a body stands on: the nearest of those right under it, and others as near.
  std::vector<std::size_t> supports_of(std::size_t b) const {
    std::vector<std::size_t> supports;
    double least_m = 1e30;
    for (std::size_t u = 0; u < columns_.size(); ++u) {
      const BodyDescription& under = bodies_[u]->description();
      if (u == b || !under.contact || std::abs(gap_m(u, b)) > 2 * under.spacing_m ||
          !(columns_[u].overlap_m2(columns_[b]) > 0))
        continue;
      supports.push_back(u);
      least_m = std::min(least_m, gap_m(u, b));
    }
    std::erase_if(supports, [&](std::size_t u) {
      return gap_m(u, b) > least_m + 0.5 * bodies_[u]->description().spacing_m;
    });
    return supports;
  }
  /// Puts a body, with all that rests on it, on those under it.
  void lay(std::size_t b) {
    const std::vector<std::size_t> supports = supports_of(b);
    double all_m2 = 0;
    for (const std::size_t u : supports) all_m2 += columns_[u].overlap_m2(columns_[b]);
    for (const std::size_t u : supports) {
      is_leg_[u] = is_leg_[u] != 0 || supports.size() > 1 ? 1 : 0;
      borne_N_[u] += columns_[u].overlap_m2(columns_[b]) / all_m2 * weight_N(b);
      top_m_[u] = std::max(top_m_[u], top_m_[b]);
      above_[u].insert(b);
      above_[u].insert(above_[b].begin(), above_[b].end());
    }
  }

  std::span<const std::unique_ptr<SoftBody>> bodies_;
  std::vector<Column> columns_;
  std::vector<std::size_t> order_;  ///< from the highest to the lowest
  std::vector<double> borne_N_, top_m_;
  std::vector<std::set<std::size_t>> above_;
  std::vector<std::uint8_t> is_leg_;  ///< one of several that bear the same body
};

/// Two digits, upwards.
double rounded_up(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return unit * std::ceil(value / unit - 1e-9);
}

std::string metres(double value_m) { return number_text(std::round(1e3 * value_m) / 1e3) + " m"; }

/// A foot that bears too much, and the modulus that would do; none: it bears that.
std::optional<Notice> burden(const Pile& pile, std::size_t b, const BodyDescription& body) {
  const Column& column = pile.column(b);
  if (!column.is_free || !(column.area_m2 > 0)) return {};
  const MaterialDescription& material = body.material;
  const double pressure_Pa = pile.weight_N(b) / column.area_m2, young_Pa = material.young_modulus_pa,
               share = material.model == TissueModel::tled ? kElements : kMatched;
  // I = width^2 A / 12: a rectangle's.
  const double slender_Pa = pile.may_buckle(b) ? kSlender * 12 * pile.weight_N(b) * sqr(pile.height_m(b)) /
                                                     (kGreenhill * sqr(column.width_m()) * column.area_m2)
                                               : 0;
  const bool is_squashed = pressure_Pa > share * young_Pa, buckles = slender_Pa > young_Pa;
  if (!is_squashed && !buckles) return {};
  const std::size_t above = pile.above(b).size();
  const std::string with = above == 0   ? ""
                           : above == 1 ? "and the body on it "
                                        : "and the " + std::to_string(above) + " bodies on it ",
                    modulus = "its 'young_modulus_pa' of " + number_text(young_Pa);
  std::string text = "body '" + body.name + "' " + with;
  if (is_squashed)
    text += "weigh" + std::string(above == 0 ? "s " : " ") + number_text(std::round(pressure_Pa)) +
            " Pa at its foot, " + number_text(std::round(100 * pressure_Pa / young_Pa)) + " % of " + modulus +
            ": it will be squashed";
  else
    text += std::string(above == 0 ? "is" : "are") + " a column " + metres(pile.height_m(b)) + " high and " +
            metres(column.width_m()) + " wide: with " + modulus + " it gives way under its weight, and falls";
  return Notice{"body.heavy", Severity::warning, text,
                "take a 'young_modulus_pa' of at least " +
                    number_text(rounded_up(kSafety * std::max(pressure_Pa / share, slender_Pa)))};
}

}  // namespace

std::vector<Notice> heavy_bodies(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies) {
  std::vector<Notice> notices;
  if (scene.fluid || scene.obstacles.empty() || !(length(scene.gravity_m_s2) > 0)) return notices;
  const Pile pile(scene, bodies);
  std::set<std::size_t> told;
  for (const std::size_t b : pile.upwards()) {
    if (told.contains(b)) continue;
    const std::optional<Notice> notice = burden(pile, b, scene.bodies[b]);
    if (!notice) continue;
    notices.push_back(*notice);
    told.insert(pile.above(b).begin(), pile.above(b).end());
  }
  return notices;
}

}  // namespace tactus
