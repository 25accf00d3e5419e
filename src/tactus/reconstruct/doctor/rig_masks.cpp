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

/// Whose mask each view takes.
using Order = std::vector<std::size_t>;

Order same_order(std::size_t views) {
  Order same(views);
  std::iota(same.begin(), same.end(), 0U);
  return same;
}

/// All take that of the next one, of the second next..., or the last comes first.
std::vector<Order> shifts_of(std::size_t views) {
  std::vector<Order> orders;
  const Order same = same_order(views);
  for (std::size_t step = 1; step < views; ++step) {
    orders.push_back(same);
    std::rotate(orders.back().begin(), orders.back().begin() + static_cast<std::ptrdiff_t>(step),
                orders.back().end());
  }
  orders.emplace_back(same.rbegin(), same.rend());
  return orders;
}

/// Those with two more views that have each other's.
std::vector<Order> swaps_in(const std::vector<Order>& orders) {
  std::vector<Order> swapped;
  for (const Order& order : orders)
    for (std::size_t a = 0; a < order.size(); ++a)
      for (std::size_t b = a + 1; b < order.size(); ++b) {
        swapped.push_back(order);
        std::swap(swapped.back()[a], swapped.back()[b]);
      }
  return swapped;
}

}  // namespace

bool Examination::looks_inverted(std::size_t camera) const {
  constexpr double kRim = 0.8;  // objects may touch it
  const BitMask& mask = diagnosis_.masks[camera];
  return share_of_rim(mask.width_px, mask.height_px, [&](Index x, Index y) { return mask(x, y); }) >= kRim;
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

/// How well views agree in each order of their masks; finely where they might.
std::vector<Agreement> Examination::agreements(const std::vector<std::vector<std::size_t>>& orders) const {
  const std::vector<SeenView> all = views();
  std::vector<Agreement> found(orders.size());
  tbb::parallel_for(std::size_t{0}, orders.size(), [&](std::size_t i) {
    std::vector<SeenView> ordered = all;
    for (std::size_t v = 0; v < all.size(); ++v) ordered[v].mask = all[orders[i][v]].mask;
    found[i] = agreement(ordered, kScreen);
    if (found[i].is_consistent(limits_)) found[i] = agreement(ordered, kFine);
  });
  return found;
}

/// Masks, or calibrations, that were numbered otherwise: each camera has that of another. Two pairs that were
/// swapped are found one after the other: the right first swap is among the best.
bool Examination::cure_order() {
  constexpr std::ptrdiff_t kKept = 4;
  const std::vector<SeenView> all = views();
  if (all.size() < 4) return false;
  for (const SeenView& view : all)
    if (view.mask->width_px != all[0].mask->width_px || view.mask->height_px != all[0].mask->height_px)
      return false;
  std::vector<Order> orders = shifts_of(all.size());
  for (int attempt = 0; attempt < 3; ++attempt) {
    const std::vector<Agreement> found = agreements(orders);
    Order best = same_order(orders.size());
    std::stable_sort(best.begin(), best.end(),
                     [&](std::size_t a, std::size_t b) { return found[a].mean > found[b].mean; });
    const auto right = std::find_if(best.begin(), best.end(),
                                    [&](std::size_t i) { return found[i].is_consistent(limits_); });
    if (right != best.end()) {
      take_order(orders[*right]);
      return true;
    }
    std::vector<Order> kept;
    for (std::ptrdiff_t i = 0; attempt > 0 && i < std::min(kKept, std::ssize(best)); ++i)
      kept.push_back(orders[best[static_cast<std::size_t>(i)]]);
    if (attempt == 0) kept.push_back(same_order(all.size()));
    orders = swaps_in(kept);
  }
  return false;
}

void Examination::take_order(const std::vector<std::size_t>& order) {
  const std::vector<BitMask> given = diagnosis_.masks;
  std::string cure;
  for (std::size_t v = 0; v < order.size(); ++v) {
    if (order[v] == v) continue;
    const std::size_t c = used_[v], from = used_[order[v]];
    diagnosis_.masks[c] = given[from];
    cure += (cure.empty() ? "give camera '" : ", '") + input_.cameras[c].name + "' the mask of '" +
            input_.cameras[from].name + "'";
  }
  note({-1, -1, "masks of other cameras", cure, 0, 0});
}

/// A camera that contradicts the others and has the mask, or the calibration, of one of them.
bool Examination::name_copy(std::size_t view) {
  const std::size_t c = used_[view];
  const Camera& camera = diagnosis_.cameras[c];
  for (const std::size_t other : used_) {
    if (other == c) continue;
    const Camera& theirs = diagnosis_.cameras[other];
    const bool same_mask = diagnosis_.masks[c] == diagnosis_.masks[other],
               same_place = length(camera.center_world() - theirs.center_world()) <= 1e-9 &&
                            length(camera.T_cam_world.R.row[2] - theirs.T_cam_world.R.row[2]) <= 1e-9;
    if (!same_mask && !same_place) continue;
    const std::string of = same_mask ? "mask" : "calibration";
    note({static_cast<int>(c), -1, "the " + of + " of another camera",
          "camera '" + camera.name + "' has the " + of + " of '" + theirs.name + "': give it its own", 0, 0});
    diagnosis_.masks[c] = {};
    return true;
  }
  return false;
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
