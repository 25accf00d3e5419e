#pragma once
/// Equations for a model's pose from its outline in one picture, where errors of neighbours are alike.
#include <span>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/track/dense_matrix.h"

namespace tactus {

/// By how much contours are off, in a picture.
struct ContourNoise {
  double contour_px = 0.5;    ///< 1 sigma of a field that moves contours in and out
  double correlation_px = 8;  ///< the field's correlation is exp(-(distance / this)^2)
  double white_px2 = 0.02;    ///< variance that each point has of its own: pixels
};

/// A point of an outline, compared with a picture.
struct ContourPoint {
  Vec2d px;
  double j[6];            ///< of the outline along its normal, per motion of the model [px]
  Vec2d normal;           ///< the same, per shift of the picture
  double gain;            ///< the same, per motion of the contour
  double off_px;          ///< by which the picture reaches farther than the model
  double weight = 1;      ///< 0: it is something else's
  bool follows;           ///< the point before, on the outline
  bool at_break = false;  ///< something else begins beside it
};

/// Least squares with the covariance of the noise: residual = j · twist + normal · shift + noise.
class ContourEquations {
 public:
  static constexpr int kUnknowns = 8;  ///< twist, and the shift of the picture [px]
  /// @param shift_px that the picture is believed to have
  /// @param spacing_px of the points
  void assemble(std::span<const ContourPoint> points, double spacing_px, Vec2d shift_px,
                const ContourNoise& noise);

  double information[kUnknowns][kUnknowns];  ///< inverse covariance of the unknowns
  double right[kUnknowns];                   ///< information times the step to take

  /// Sums over bins, for the noise's size.
  struct Moments {
    double squares = 0, square_gains = 0, shares = 0;  ///< of residuals; gain²; white variance in them
    double products = 0, product_gains = 0;            ///< of neighbours; gains times correlation
    double length_px = 0;
    double surprise = 0;  ///< -2 log likelihood, but for a constant
    int bins = 0;
  };
  const Moments& moments() const { return moments_; }

 private:
  /// Points next to each other, averaged.
  struct Bin {
    Vec2d px{}, normal{};
    double j[6]{}, gain = 0, off_px = 0, weight = 0;
    double stepped_px = 0;  ///< 1 sigma by which rounding moves a contour along pixels
    bool follows = false;
  };
  void fill_bins(std::span<const ContourPoint> points, Vec2d shift_px, double length_px);
  void add_moments(const ContourNoise& noise);

  std::vector<Bin> bins_;
  DenseMatrix covariance_, rows_;
  Moments moments_;
};

}  // namespace tactus
