#include <cstdio>

#include "tactus/base/byte_io.h"
#include "tactus/world/world_impl.h"

namespace tactus {

std::string state_hash(const World& with) {
  World::Impl& world = with.impl();
  std::uint64_t hash = fnv1a("");
  const auto add = [&hash](const std::vector<Vec3f>& values) {
    hash = fnv1a({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Vec3f)}, hash);
  };
  for (const auto& body : world.bodies()) {
    add(body->positions_m(world.context()));
    add(body->velocities_m_s(world.context()));
  }
  const FrameSnapshot snapshot = world.snapshot();
  add(snapshot.real.positions_m);
  if (world.liquid() != nullptr) add(snapshot.liquid_m);
  const auto add_film = [&hash](const FilmThickness& film) {
    for (const std::vector<float>* m : {&film.film_m, &film.stain_m})
      hash = fnv1a({reinterpret_cast<const char*>(m->data()), m->size() * sizeof(float)}, hash);
  };
  for (const FilmThickness& film : snapshot.films) add_film(film);
  for (const WetObstacle& wet : snapshot.wet_obstacles) add_film(wet.film);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

}  // namespace tactus
