/// Masks that are right but for black and white, or that other cameras have.
#include <tbb/parallel_for.h>

#include "tactus/geom/image/mask_rim.h"
#include "tactus/reconstruct/doctor/rig_examination.h"

namespace tactus {
namespace {

BitMask inverted(const BitMask& mask) {
  BitMask result(mask.width_px, mask.height_px);
  for (Index y = 0; y < mask.height_px; ++y)
    for (Index x = 0; x < mask.width_px; ++x)
      if (!mask(x, y)) result.set(x, y);
  return result;
}

/// Whose mask each view takes: all of the next one, of the second next..., the other way round, and two pairs
/// that have each other's.
std::vector<std::vector<std::size_t>> orders_of(std::size_t views) {
  constexpr std::size_t kMostOfPairs = 10;  // of whom there are 630
  std::vector<std::vector<std::size_t>> orders;
  std::vector<std::size_t> same(views);
  std::iota(same.begin(), same.end(), 0U);
  for (std::size_t step = 1; step < views; ++step) {
    orders.push_back(same);
    std::rotate(orders.back().begin(), orders.back().begin() + static_cast<std::ptrdiff_t>(step),
                orders.back().end());
  }
  orders.emplace_back(same.rbegin(), same.rend());
  if (views > kMostOfPairs) return orders;
  for (std::size_t a = 0; a < views; ++a)
    for (std::size_t b = a + 1; b < views; ++b)
      for (std::size_t c = a + 1; c < views; ++c)
        for (std::size_t d = c + 1; d < views; ++d) {
          if (c == b || d == b) continue;
          orders.push_back(same);
          std::swap(orders.back()[a], orders.back()[b]);
          std::swap(orders.back()[c], orders.back()[d]);
        }
  return orders;
}

}  // namespace

bool Examination::looks_inverted(std::size_t camera) const {
  const BitMask& mask = diagnosis_.masks[camera];
  return tactus::looks_inverted(mask.width_px, mask.height_px, mask.area_px(),
                                [&](Index x, Index y) { return mask(x, y); });
}

/// An object may cover the rim of a picture: views have to agree better with its mask turned round.
bool Examination::turn_inverted_masks() {
  std::vector<std::size_t> turned;
  std::vector<BitMask> masks = diagnosis_.masks;
  for (const std::size_t c : used_) {
    if (!looks_inverted(c)) continue;
    turned.push_back(c);
    masks[c] = inverted(masks[c]);
  }
  if (turned.empty() ||
      agreement(views_of(diagnosis_.cameras, masks), kCoarse).mean <= agreement(views(), kCoarse).mean)
    return false;
  diagnosis_.masks = std::move(masks);
  for (const std::size_t c : turned)
    note({static_cast<int>(c), -1, "inverted mask",
          "the object is black in it: make it white, and the rest black", 0, 0});
  return true;
}

/// Masks, or calibrations, that were numbered otherwise: each camera has that of another.
bool Examination::cure_order() {
  const std::vector<SeenView> all = views();
  if (all.size() < 4) return false;
  for (const SeenView& view : all)
    if (view.mask->width_px != all[0].mask->width_px || view.mask->height_px != all[0].mask->height_px)
      return false;
  const std::vector<std::vector<std::size_t>> orders = orders_of(all.size());
  std::vector<Agreement> found(orders.size());
  tbb::parallel_for(std::size_t{0}, orders.size(), [&](std::size_t i) {
    std::vector<SeenView> ordered = all;
    for (std::size_t v = 0; v < all.size(); ++v) ordered[v].mask = all[orders[i][v]].mask;
    found[i] = agreement(ordered, kScreen);
    if (found[i].is_consistent(limits_)) found[i] = agreement(ordered, kFine);
  });
  std::size_t best = orders.size();
  for (std::size_t i = 0; i < orders.size(); ++i)
    if (found[i].is_consistent(limits_) && (best == orders.size() || found[i].mean > found[best].mean))
      best = i;
  if (best == orders.size()) return false;
  const std::vector<BitMask> given = diagnosis_.masks;
  std::string cure;
  for (std::size_t v = 0; v < all.size(); ++v) {
    const std::size_t from = orders[best][v];
    if (from == v) continue;
    diagnosis_.masks[used_[v]] = given[used_[from]];
    cure += (cure.empty() ? "give camera '" : ", '") + input_.cameras[used_[v]].name + "' the mask of '" +
            input_.cameras[used_[from]].name + "'";
  }
  note({-1, -1, "masks of other cameras", cure, 0, 0});
  return true;
}

/// Masks that are odd say nothing of a calibration.
std::string Examination::advice() const {
  std::string odd;
  const auto add = [&](std::size_t c) { odd += (odd.empty() ? "'" : ", '") + input_.cameras[c].name + "'"; };
  for (const std::size_t c : dead_) add(c);
  for (const std::size_t c : used_)
    if (looks_inverted(c)) add(c);
  return odd.empty() ? "no single slip explains it: calibrate the rig again"
                     : "mend the masks of " + odd + " first: with them the calibration can't be judged";
}

}  // namespace tactus
