#include "tactus/window/seen_frames.h"

#include <algorithm>

namespace tactus {
namespace {

template <class T>
std::size_t bytes_in(const std::vector<T>& all) {
  return all.size() * sizeof(T);
}

std::size_t bytes_in(const TriangleMesh& mesh) {
  return bytes_in(mesh.positions_m) + bytes_in(mesh.normals) + bytes_in(mesh.triangles);
}

std::size_t bytes_in(const FilmThickness& film) { return bytes_in(film.film_m) + bytes_in(film.stain_m); }

}  // namespace

std::size_t bytes_of(const ViewedFrame& frame) {
  std::size_t sum = sizeof frame + bytes_in(frame.contacts) + bytes_in(frame.stages) + bytes_in(frame.values);
  for (const ColorImage& photo : frame.photos) sum += bytes_in(photo.pixels);
  const FrameSnapshot& seen = *frame.snapshot;
  sum += bytes_in(seen.real) + bytes_in(seen.liquid_m);
  for (const auto* meshes : {&seen.bodies, &seen.obstacles, &seen.blades})
    for (const TriangleMesh& mesh : *meshes) sum += bytes_in(mesh);
  for (const FilmThickness& film : seen.films) sum += bytes_in(film);
  for (const WetObstacle& wet : seen.wet_obstacles) sum += bytes_in(wet.mesh) + bytes_in(wet.film);
  for (const CutWalls& walls : seen.cut_walls) sum += bytes_in(walls.is_wall) + bytes_in(walls.rest_m);
  return sum;
}

void SeenFrames::add(SeenFrame seen) {
  if (most_bytes_ == 0) return;
  Entry entry{std::move(seen), 0, 0};
  entry.number = entry.seen.frame->number;
  entry.bytes = bytes_of(*entry.seen.frame) + (entry.seen.state ? entry.seen.state->bytes.size() : 0);
  const std::lock_guard lock(mutex_);
  bytes_ += entry.bytes;
  entries_.push_back(std::move(entry));
  while (bytes_ > most_bytes_ && entries_.size() > 2) thin();
}

/// The frame goes whose neighbours are nearest to each other, measured by how long ago they are.
void SeenFrames::thin() {
  std::size_t goes = 1;
  double least = 1e300;
  const int last = entries_.back().number;
  for (std::size_t i = 1; i + 1 < entries_.size(); ++i) {
    const double gap = entries_[i + 1].number - entries_[i - 1].number, ago = 1 + last - entries_[i].number;
    if (gap / ago >= least) continue;
    least = gap / ago;
    goes = i;
  }
  bytes_ -= entries_[goes].bytes;
  entries_.erase(entries_.begin() + static_cast<std::ptrdiff_t>(goes));
}

void SeenFrames::clear() {
  const std::lock_guard lock(mutex_);
  entries_.clear();
  bytes_ = 0;
}

void SeenFrames::forget_after(int number) {
  const std::lock_guard lock(mutex_);
  for (; !entries_.empty() && entries_.back().number > number; entries_.pop_back())
    bytes_ -= entries_.back().bytes;
}

std::size_t SeenFrames::place_of(int number) const {
  const auto at = std::lower_bound(entries_.begin(), entries_.end(), number,
                                   [](const Entry& e, int n) { return e.number < n; });
  return static_cast<std::size_t>(at - entries_.begin());
}

SeenFrame SeenFrames::nearest(int number) const {
  const std::lock_guard lock(mutex_);
  if (entries_.empty()) return {};
  const std::size_t after = std::min(place_of(number), entries_.size() - 1);
  const bool is_before_nearer =
      after > 0 && number - entries_[after - 1].number < entries_[after].number - number;
  return entries_[is_before_nearer ? after - 1 : after].seen;
}

SeenFrame SeenFrames::moved(int number, int steps) const {
  const std::lock_guard lock(mutex_);
  if (entries_.empty()) return {};
  const auto last = static_cast<std::ptrdiff_t>(entries_.size()) - 1;
  std::ptrdiff_t at = static_cast<std::ptrdiff_t>(place_of(number)) + steps;
  // The frame itself may be gone: then the one after it is the first step.
  if (steps > 0 && !(place_of(number) < entries_.size() && entries_[place_of(number)].number == number)) --at;
  return entries_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(at, 0, last))].seen;
}

std::shared_ptr<const SavedState> SeenFrames::state_at(int number) const {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = place_of(number + 1); i > 0; --i)
    if (entries_[i - 1].seen.state) return entries_[i - 1].seen.state;
  return nullptr;
}

SeenFrames::Range SeenFrames::range() const {
  const std::lock_guard lock(mutex_);
  return entries_.empty() ? Range{} : Range{entries_.front().number, entries_.back().number};
}

std::size_t SeenFrames::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace tactus
