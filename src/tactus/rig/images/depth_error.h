#pragma once
/// Systematic error of a time-of-flight camera's distance: offset, wiggling and radial terms as one table
/// over pixel and measured distance. E = E_raw - error(u, v, E_raw), trilinear. [method.md 1]
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/image/image.h"

namespace tactus {

class DepthErrorTable {
 public:
  DepthErrorTable() = default;
  /// All zero, over images of this size and distances from `least_m` to `most_m`.
  DepthErrorTable(Vec2i size_px, Vec3i nodes, double least_m, double most_m);

  bool empty() const { return error_m_.empty(); }
  Vec2i size_px() const { return size_px_; }
  Vec3i nodes() const { return nodes_; }
  /// Error of a measured radial distance [m]; beyond the table that of its border.
  double error_m(double u_px, double v_px, double measured_m) const;
  std::vector<double>& values() { return error_m_; }
  const std::vector<double>& values() const { return error_m_; }
  double least_m() const { return least_m_; }
  double most_m() const { return most_m_; }

  /// The eight nodes around a measurement and their weights.
  struct Corners {
    std::size_t index[8];
    double weight[8];
  };
  Corners corners(double u_px, double v_px, double measured_m) const;

 private:
  Vec2i size_px_{};
  Vec3i nodes_{};  ///< along u, v, E
  double least_m_ = 0, most_m_ = 0;
  std::vector<double> error_m_;
};

/// A measurement whose true distance is known.
struct DepthSample {
  double u_px = 0, v_px = 0, measured_m = 0, true_m = 0;
};
struct DepthErrorOptions {
  Vec3i nodes{7, 6, 33};     ///< along u, v and distance
  double smoothness = 0.03;  ///< weight of second differences against a sample
};
/// Least squares with smoothness where samples are few: || table(samples) - error ||^2 + smoothness ||second
/// differences||^2.
/// @throws Error for fewer than 1000 samples or a sample that is not finite.
DepthErrorTable fit_depth_error(std::span<const DepthSample> samples, Vec2i size_px,
                                const DepthErrorOptions& options = {});

/// JSON. @throws Error naming the file and key.
void write_depth_error(const std::string& file, const DepthErrorTable& table);
DepthErrorTable read_depth_error(const std::string& file);

}  // namespace tactus
