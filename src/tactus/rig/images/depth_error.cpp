#include "tactus/rig/images/depth_error.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibration_files/data_node.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus {

DepthErrorTable::DepthErrorTable(Vec2i size_px, Vec3i nodes, double least_m, double most_m)
    : size_px_(size_px), nodes_(nodes), least_m_(least_m), most_m_(most_m) {
  error_m_.resize(static_cast<std::size_t>(nodes.x) * static_cast<std::size_t>(nodes.y) *
                  static_cast<std::size_t>(nodes.z));
}

DepthErrorTable::Corners DepthErrorTable::corners(double u_px, double v_px, double measured_m) const {
  const double at[3] = {u_px / (size_px_.x - 1) * (nodes_.x - 1), v_px / (size_px_.y - 1) * (nodes_.y - 1),
                        (measured_m - least_m_) / (most_m_ - least_m_) * (nodes_.z - 1)};
  std::size_t low[3];
  double t[3];
  for (int i = 0; i < 3; ++i) {
    const double clamped = std::clamp(at[i], 0.0, static_cast<double>(nodes_[i] - 1));
    low[i] = std::min(static_cast<std::size_t>(clamped), static_cast<std::size_t>(nodes_[i] - 2));
    t[i] = clamped - static_cast<double>(low[i]);
  }
  Corners c{};
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t d[3] = {k & 1, k >> 1 & 1, k >> 2};
    c.index[k] = ((low[2] + d[2]) * static_cast<std::size_t>(nodes_.y) + low[1] + d[1]) *
                     static_cast<std::size_t>(nodes_.x) +
                 low[0] + d[0];
    c.weight[k] =
        (d[0] != 0 ? t[0] : 1 - t[0]) * (d[1] != 0 ? t[1] : 1 - t[1]) * (d[2] != 0 ? t[2] : 1 - t[2]);
  }
  return c;
}

double DepthErrorTable::error_m(double u_px, double v_px, double measured_m) const {
  const Corners c = corners(u_px, v_px, measured_m);
  double sum = 0;
  for (std::size_t k = 0; k < 8; ++k) sum += c.weight[k] * error_m_[c.index[k]];
  return sum;
}

namespace {

/// The normal equations, (A^T A + smoothness D^T D) x. A sample joins nodes of one cell, so a row of A^T A
/// has 27 places: those of a node and the nodes around it.
class NormalEquations {
 public:
  NormalEquations(const DepthErrorTable& table, std::span<const DepthSample> samples, double smoothness)
      : nodes_(table.nodes()),
        smoothness_(smoothness * static_cast<double>(samples.size()) /
                    static_cast<double>(table.values().size())) {
    const std::size_t unknowns = table.values().size();
    right_side_.resize(unknowns);
    rows_.resize(unknowns);
    for (const DepthSample& s : samples) {
      const DepthErrorTable::Corners c = table.corners(s.u_px, s.v_px, s.measured_m);
      for (std::size_t k = 0; k < 8; ++k) {
        right_side_[c.index[k]] += c.weight[k] * (s.measured_m - s.true_m);
        for (std::size_t l = 0; l < 8; ++l) rows_[c.index[k]][place(k, l)] += c.weight[k] * c.weight[l];
      }
    }
  }
  const std::vector<double>& right_side() const { return right_side_; }
  void apply(const std::vector<double>& x, std::vector<double>& out) const {
    for (std::size_t i = 0; i < x.size(); ++i) {
      double sum = 0;
      for (int k = 0; k < 27; ++k) {
        if (rows_[i][static_cast<std::size_t>(k)] == 0) continue;  // beyond the border, too
        const int step = ((k / 9 - 1) * nodes_.y + k / 3 % 3 - 1) * nodes_.x + k % 3 - 1;
        sum += rows_[i][static_cast<std::size_t>(k)] *
               x[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + step)];
      }
      out[i] = sum;
    }
    const auto nx = static_cast<std::size_t>(nodes_.x), ny = static_cast<std::size_t>(nodes_.y);
    const std::size_t strides[3] = {1, nx, nx * ny};
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t at[3] = {i % nx, i / nx % ny, i / (nx * ny)};
      for (int axis = 0; axis < 3; ++axis) {
        if (at[axis] == 0 || at[axis] + 1 >= static_cast<std::size_t>(nodes_[axis])) continue;
        const std::size_t stride = strides[axis];
        // Across the image the error is a smooth bowl; along the distance it wiggles.
        const double weight = smoothness_ * (axis == 2 ? 0.01 : 1);
        const double bend = weight * (x[i - stride] - 2 * x[i] + x[i + stride]);
        out[i - stride] += bend;
        out[i] -= 2 * bend;
        out[i + stride] += bend;
      }
    }
    // Nodes that nothing speaks of stay 0.
    for (std::size_t i = 0; i < x.size(); ++i) out[i] += 1e-9 * x[i];
  }

 private:
  /// Where corner l of a cell is in the row of corner k.
  static std::size_t place(std::size_t k, std::size_t l) {
    return 9 * ((l >> 2) + 1 - (k >> 2)) + 3 * ((l >> 1 & 1) + 1 - (k >> 1 & 1)) + (l & 1) + 1 - (k & 1);
  }
  Vec3i nodes_;
  double smoothness_;
  std::vector<double> right_side_;
  std::vector<std::array<double, 27>> rows_;
};

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

DepthErrorTable fit_depth_error(std::span<const DepthSample> samples, Vec2i size_px,
                                const DepthErrorOptions& options) {
  if (samples.size() < 1000)
    throw Error("depth calibration: " + std::to_string(samples.size()) +
                " measurements of the target, expected at least 1000");
  double least = 1e300, most = -1e300;
  for (const DepthSample& s : samples) {
    if (!std::isfinite(s.measured_m + s.true_m + s.u_px + s.v_px))
      throw Error("depth calibration: a measurement is not finite");
    least = std::min(least, s.measured_m);
    most = std::max(most, s.measured_m);
  }
  DepthErrorTable table(size_px, options.nodes, least, std::max(most, least + 1e-3));
  const NormalEquations equations(table, samples, options.smoothness);
  // Conjugate gradients.
  std::vector<double>& x = table.values();
  std::vector<double> r = equations.right_side(), p = r, Ap(x.size());
  double rr = dot(r, r);
  const double enough = 1e-16 * rr;
  for (int i = 0; i < 2000 && rr > enough; ++i) {
    equations.apply(p, Ap);
    const double a = rr / dot(p, Ap);
    for (std::size_t k = 0; k < x.size(); ++k) {
      x[k] += a * p[k];
      r[k] -= a * Ap[k];
    }
    const double next = dot(r, r);
    for (std::size_t k = 0; k < x.size(); ++k) p[k] = r[k] + next / rr * p[k];
    rr = next;
  }
  return table;
}

void write_depth_error(const std::string& file, const DepthErrorTable& t) {
  std::string text =
      "{\n  \"about\": \"error of measured radial distance [m]: values[E][v][u], trilinear over pixels and "
      "distance\",\n  \"image_size_px\": [" +
      std::to_string(t.size_px().x) + ", " + std::to_string(t.size_px().y) + "],\n  \"nodes\": [" +
      std::to_string(t.nodes().x) + ", " + std::to_string(t.nodes().y) + ", " + std::to_string(t.nodes().z) +
      "],\n  \"distance_m\": " + calibration::exact_list(std::vector{t.least_m(), t.most_m()}) +
      ",\n  \"values_m\": " + calibration::exact_list(t.values()) + "\n}\n";
  calibration::write_text(file, text);
}

DepthErrorTable read_depth_error(const std::string& file) {
  const DataNode root = parse_json_data(read_text(file, kMaxCalibrationBytes, ReadFrom::regular_file), file);
  const std::vector<double> size = root.at("image_size_px").numbers(2), nodes = root.at("nodes").numbers(3),
                            range = root.at("distance_m").numbers(2);
  for (const double n : nodes) {
    if (!(n >= 2 && n <= 1000 && n == std::floor(n)))
      root.at("nodes").fail("expected three whole numbers, 2 to 1000");
  }
  for (const double n : size) {
    if (!(n >= 2 && n <= 32768)) root.at("image_size_px").fail("expected 2 to 32768");
  }
  if (!(range[1] > range[0])) root.at("distance_m").fail("expected two growing distances");
  if (nodes[0] * nodes[1] * nodes[2] > 1e7) root.at("nodes").fail("more than 10 million nodes");
  const auto whole = [](double v) { return static_cast<Index>(v); };
  DepthErrorTable table({whole(size[0]), whole(size[1])}, {whole(nodes[0]), whole(nodes[1]), whole(nodes[2])},
                        range[0], range[1]);
  table.values() = root.at("values_m").numbers(table.values().size());
  return table;
}

}  // namespace tactus
