#include "tactus/reconstruct/texture/view_scores.h"

#include <algorithm>
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/reconstruct/hull_kernels.h"

namespace tactus {

ViewScores::ViewScores(ExecContext& ctx, std::span<const Camera> cameras, const ViewScoreOptions& options)
    : cameras_(cameras.begin(), cameras.end()), options_(options) {
  const Vec3f extent = options.workspace_m.extent();
  if (cameras.empty() || cameras.size() > kMaxCameras)
    throw Error("view scores: " + std::to_string(cameras.size()) + " cameras, expected 1 to " +
                std::to_string(kMaxCameras));
  if (!(extent.x > 0 && extent.y > 0 && extent.z > 0)) throw Error("view scores: the workspace is empty");
  if (options.samples < 8 || options.samples > 512)
    throw Error("view scores: samples is " + std::to_string(options.samples) + ", expected 8 to 512");
  spacing_m_ = max(extent.x, max(extent.y, extent.z)) / static_cast<float>(options.samples);
  const auto along = [&](float length_m) {
    return 4 * ceil_div(static_cast<Index>(length_m / spacing_m_ + 0.5F) + 1, 4);
  };
  samples_ = {along(extent.x), along(extent.y), along(extent.z)};
  Index words = 0;
  for (const Camera& camera : cameras) {
    check_camera(camera);
    ScoreCamera c{};
    set_projection(c, camera);
    c.begin = words;
    c.row_words = ceil_div(camera.width_px, 32);
    words += c.row_words * c.height_px;
    layout_.push_back(c);
  }
  Device& device = ctx.device();
  device_cameras_ = to_device(ctx, layout_);
  staging_ = HostBuffer<std::uint32_t>(device, words);
  masks_ = Buffer<std::uint32_t>(device, words);
  counts_ = Buffer<std::uint32_t>(device, static_cast<std::int64_t>(cameras.size()) + 1);
  blame_ = Buffer<std::int8_t>(device, std::int64_t{samples_.x} * samples_.y * samples_.z);
}

std::vector<ViewScore> ViewScores::measure(ExecContext& ctx, std::span<const BitMask> silhouettes) {
  if (silhouettes.size() != cameras_.size())
    throw Error("view scores: " + std::to_string(silhouettes.size()) + " silhouettes for " +
                std::to_string(cameras_.size()) + " cameras");
  ctx.synchronize();  // the staging memory may still be on its way
  for (std::size_t c = 0; c < silhouettes.size(); ++c) {
    const ScoreCamera& camera = layout_[c];
    const BitMask& mask = silhouettes[c];
    std::uint32_t* to = staging_.data() + camera.begin;
    if (mask.words.empty()) {
      std::fill_n(to, camera.row_words * camera.height_px, ~0U);
      continue;
    }
    if (mask.width_px != camera.width_px || mask.height_px != camera.height_px)
      throw Error("camera '" + cameras_[c].name + "': the silhouette has " + std::to_string(mask.width_px) +
                  "x" + std::to_string(mask.height_px) + " pixels, its calibration says " +
                  std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
    std::copy(mask.words.begin(), mask.words.end(), to);
  }
  ctx.upload(staging_.span(), masks_.view());
  ctx.fill_bytes(counts_.view(), 0);
  ctx.parallel_for("scores/blame", samples_.x * samples_.y * samples_.z / BlameSamples::kThreads,
                   BlameSamples{device_cameras_.const_view(), masks_.const_view(), samples_,
                                options_.workspace_m.min, spacing_m_, blame_.view()});
  ctx.parallel_for("scores/count", samples_.y * samples_.z,
                   CountBlame{blame_.const_view(), samples_, counts_.view()});
  const std::vector<std::uint32_t> counts = to_host(ctx, counts_.view());

  std::vector<ViewScore> scores(cameras_.size());
  std::vector<double> sorted;
  for (std::size_t c = 0; c < scores.size(); ++c) {
    scores[c].carved_alone =
        counts[c] == 0 ? 0.0 : static_cast<double>(counts[c]) / std::max(counts.back(), 1U);
    sorted.push_back(scores[c].carved_alone);
  }
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  for (ViewScore& s : scores)
    s.is_suspect = s.carved_alone > options_.least_share && s.carved_alone > options_.times_median * median;
  return scores;
}

std::vector<std::vector<Vec3f>> ViewScores::carved_alone_m(ExecContext& ctx, Index view) {
  const std::vector<std::int8_t> blame = to_host(ctx, blame_.const_view());
  std::vector<std::uint8_t> open(blame.size(), 0);  // counted, and in no group yet
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  const auto index = [this](Vec3i s) { return s.x + samples_.x * (s.y + samples_.y * s.z); };
  std::vector<Vec3i> counted;
  for (Index z = 1; z + 1 < samples_.z; ++z) {
    for (Index y = 1; y + 1 < samples_.y; ++y) {
      for (Index x = 1; x + 1 < samples_.x; ++x) {
        if (blamed_view(blame.data(), samples_, index({x, y, z})) != view) continue;
        open[at(index({x, y, z}))] = 1;
        counted.push_back({x, y, z});
      }
    }
  }
  std::vector<std::vector<Vec3f>> groups;
  std::vector<Vec3i> front;
  const auto visit = [&](Vec3i s) {  // counted samples have neighbours on all sides
    std::uint8_t& is_open = open[at(index(s))];
    if (is_open == 0) return;
    is_open = 0;
    groups.back().push_back(options_.workspace_m.min + spacing_m_ * vec_cast<float>(s));
    front.push_back(s);
  };
  for (const Vec3i first : counted) {
    if (open[at(index(first))] == 0) continue;
    groups.emplace_back();
    visit(first);
    while (!front.empty()) {
      const Vec3i s = front.back();
      front.pop_back();
      for (int k = 0; k < 27; ++k) visit(s + Vec3i{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1});
    }
  }
  return groups;
}

std::string suspect_views_text(std::span<const Camera> cameras, std::span<const ViewScore> scores) {
  std::string text;
  for (std::size_t c = 0; c < scores.size(); ++c) {
    if (!scores[c].is_suspect) continue;
    char share[32];
    std::snprintf(share, sizeof share, "%.1f", 100 * scores[c].carved_alone);
    text += (text.empty() ? "camera '" : "; camera '") + cameras[c].name + "' carves " + share +
            " % of the hull that all other views keep";
  }
  return text;
}

}  // namespace tactus
