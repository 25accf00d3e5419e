#include "tactus/window/seen_frames.h"

namespace tactus {
namespace {

template <class T>
std::size_t bytes_in(const std::vector<T>& all) {
  return all.size() * sizeof(T);
}

std::size_t bytes_in(const TriangleMesh& mesh) {
  return bytes_in(mesh.positions_m) + bytes_in(mesh.normals) + bytes_in(mesh.triangles);
}

SeenFrame frame_of(const RunPast<ViewedFrame>::Entry* entry) {
  return entry == nullptr ? SeenFrame{} : SeenFrame{entry->frame, entry->state};
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
  const std::size_t bytes = bytes_of(*seen.frame) + (seen.state ? seen.state->bytes.size() : 0);
  const int number = seen.frame->number;
  const std::lock_guard lock(mutex_);
  past_.add({std::move(seen.frame), std::move(seen.state), number, bytes});
}

void SeenFrames::clear() { forget_after(-1); }

void SeenFrames::forget_after(int number) {
  const std::lock_guard lock(mutex_);
  past_.forget_after(number);
}

SeenFrame SeenFrames::nearest(int number) const {
  const std::lock_guard lock(mutex_);
  return frame_of(past_.nearest(number));
}

SeenFrame SeenFrames::moved(int number, int steps) const {
  const std::lock_guard lock(mutex_);
  return frame_of(past_.moved(number, steps));
}

std::shared_ptr<const PastState> SeenFrames::state_at(int number) const {
  const std::lock_guard lock(mutex_);
  return past_.state_at(number);
}

SeenFrames::Range SeenFrames::range() const {
  const std::lock_guard lock(mutex_);
  return past_.last() == nullptr ? Range{} : Range{past_.first()->number, past_.last()->number};
}

std::size_t SeenFrames::bytes() const {
  const std::lock_guard lock(mutex_);
  return past_.bytes();
}

}  // namespace tactus
