#include "tactus/rig/background/background_exposure.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/math.h"

namespace tactus {
namespace {

/// Rows and columns between samples leave about so many.
constexpr double kSamples = 6000;
/// The sensor clips darker and brighter pixels [grey levels].
constexpr int kDarkest = 4, kBrightest = 250;
constexpr double kLeastGain = 0.25, kMostGain = 4, kMostOffset = 80;
/// Bins of the logarithm of gains, to base 2.
constexpr int kBinsPerOctave = 24, kOctaves = 4;
/// Grey levels of a sensor's noise: residuals below are not told from it.
constexpr double kLeastScale = 2;
constexpr double kTukey = 4.685, kOfNormal = 1.4826;
/// A room of one brightness does not tell gain and offset apart: the offset then stays near 0.
constexpr double kRidge = 2e-3;
/// Part of the pixels that must agree.
constexpr double kLeastAgreeing = 0.3;
/// Largest change that is none [grey levels]: within the distance that is background anyway.
constexpr double kNoChange = 4;

}  // namespace

ExposureFit::ExposureFit(Index width_px, Index height_px)
    : width_px_(width_px),
      height_px_(height_px),
      step_px_(std::max<Index>(
          1, static_cast<Index>(std::sqrt(static_cast<double>(width_px) * height_px / kSamples)))) {
  const std::size_t most = static_cast<std::size_t>(ceil_div(width_px, step_px_)) *
                           static_cast<std::size_t>(ceil_div(height_px, step_px_));
  samples_.reserve(most);
  residuals_.reserve(most);
}

void ExposureFit::collect(const std::uint8_t* bgr, const std::uint8_t* const (&room)[3],
                          const BitMask* subject) {
  samples_.clear();
  for (Index y = step_px_ / 2; y < height_px_; y += step_px_) {
    for (Index x = step_px_ / 2; x < width_px_; x += step_px_) {
      if (subject != nullptr && (*subject)(x, y)) continue;
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(x);
      Sample s{};
      bool cut = false;
      for (std::size_t c = 0; c < 3; ++c) {
        const int p = bgr[3 * i + c], r = room[c][i];
        cut = cut || p < kDarkest || p > kBrightest || r < kDarkest || r > kBrightest;
        s.room[c] = static_cast<float>(r);
        s.photo[c] = static_cast<float>(p);
      }
      if (!cut) samples_.push_back(s);
    }
  }
}

/// The most frequent ratio of brightness, photo to room. Each bin of the histogram is smoothed by its
/// neighbours.
double ExposureFit::mode_of_gain() const {
  constexpr int kBins = kBinsPerOctave * kOctaves;
  std::array<int, kBins + 2> bins{};
  for (const Sample& s : samples_) {
    const double ratio = (s.photo[0] + s.photo[1] + s.photo[2]) / (s.room[0] + s.room[1] + s.room[2]);
    const int bin = static_cast<int>(std::floor(kBinsPerOctave * (std::log2(ratio) + 0.5 * kOctaves)));
    if (bin >= 0 && bin < kBins) ++bins[static_cast<std::size_t>(bin) + 1];
  }
  std::size_t best = 1;
  int most = -1;
  for (std::size_t b = 1; b <= kBins; ++b) {
    const int count = bins[b - 1] + 2 * bins[b] + bins[b + 1];
    if (count > most) {
      most = count;
      best = b;
    }
  }
  return std::exp2((static_cast<double>(best) - 0.5) / kBinsPerOctave - 0.5 * kOctaves);
}

bool ExposureFit::fit_channel(std::size_t channel, double gain, ColorExposure& result) {
  ColorExposure e{gain, 0};
  double agreeing = 0;
  for (int iteration = 0; iteration < 8; ++iteration) {
    residuals_.clear();
    for (const Sample& s : samples_)
      residuals_.push_back(static_cast<float>(std::abs(s.photo[channel] - e.shown(s.room[channel]))));
    const auto middle = residuals_.begin() + static_cast<std::ptrdiff_t>(residuals_.size() / 2);
    std::nth_element(residuals_.begin(), middle, residuals_.end());
    // The first guess is one of the ratio's bins, so its residuals are wider.
    const double scale = std::max(kOfNormal * double{*middle}, kLeastScale);
    const double reach2 = sqr(kTukey * std::min(scale, iteration == 0 ? 10.0 : 6.0));
    double w = 0, wr = 0, wp = 0, wrr = 0, wrp = 0;
    for (const Sample& s : samples_) {
      const double r = s.room[channel], p = s.photo[channel], off2 = sqr(p - e.shown(r)) / reach2;
      if (off2 >= 1) continue;
      const double weight = sqr(1 - off2);
      w += weight;
      wr += weight * r;
      wp += weight * p;
      wrr += weight * r * r;
      wrp += weight * r * p;
    }
    agreeing = w;
    const double below = w * (1 + kRidge), determinant = wrr * below - wr * wr;
    if (!(determinant > 0)) return false;
    e = {(wrp * below - wr * wp) / determinant, (wrr * wp - wr * wrp) / determinant};
  }
  if (agreeing < kLeastAgreeing * static_cast<double>(samples_.size())) return false;
  if (!(e.gain >= kLeastGain && e.gain <= kMostGain && std::abs(e.offset) <= kMostOffset)) return false;
  result = e;
  return true;
}

const Exposure& ExposureFit::fit(const std::uint8_t* bgr, const std::uint8_t* const (&room)[3],
                                 const BitMask& subject) {
  const std::size_t all = samples_.capacity();
  const bool has_subject = subject.width_px == width_px_ && subject.height_px == height_px_;
  collect(bgr, room, has_subject ? &subject : nullptr);
  if (has_subject && samples_.size() < all / 3) collect(bgr, room, nullptr);
  if (samples_.size() < 100) return exposure_;
  const double gain = mode_of_gain();
  Exposure found;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!fit_channel(c, gain, found[c])) return exposure_;
  }
  double change = 0;
  for (const ColorExposure& e : found)
    change = std::max({change, std::abs(e.offset), std::abs(e.shown(255) - 255)});
  exposure_ = change < kNoChange ? Exposure{} : found;
  return exposure_;
}

}  // namespace tactus
