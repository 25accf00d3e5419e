#include "tactus/run/wet_patch.h"

#include <gtest/gtest.h>

namespace tactus {
namespace {

/// A square of 1 m in two triangles; the film's edge lies across it at x = 0.25, and dry is what is beyond.
TEST(WetPatch, IsCutAlongTheFilmsEdge) {
  TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
                      {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
                      {{0, 1, 3}, {0, 3, 2}}};
  ViewFilm film;
  film.film_m = {0.002F, 0.002F, 0.002F, 0.002F};
  film.stain_m = {0, 0, 0, 0};
  film.edge_m = {0.25F, -0.75F, 0.25F, -0.75F};
  keep_wet(square, film);
  for (const std::vector<float>* m : {&film.film_m, &film.stain_m, &film.edge_m})
    EXPECT_EQ(m->size(), square.positions_m.size());
  EXPECT_EQ(square.normals.size(), square.positions_m.size());
  // Films are as thick as 2 mm within, 0 at the edge: its slope adds 2 mm^2 / 0.25 m to 0.25 m^2.
  EXPECT_NEAR(area_m2(square), 0.25, 1e-4);
  for (std::size_t v = 0; v < square.positions_m.size(); ++v) {
    EXPECT_LT(square.positions_m[v].x, 0.25F + 1e-5F);
    EXPECT_GT(square.positions_m[v].z, 0) << "above the square";
  }
}

TEST(WetPatch, KeepsStainsAndNothingThatIsDry) {
  TriangleMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, {{0, 1, 2}}};
  ViewFilm film;
  film.film_m = {0, 0, 0};
  film.stain_m = {1e-4F, 1e-4F, 1e-4F};
  film.edge_m = {-1, -1, -1};
  keep_wet(triangle, film);
  EXPECT_EQ(triangle.triangles.size(), 1U);
  film.stain_m = {0, 0, 0};
  keep_wet(triangle, film);
  EXPECT_TRUE(triangle.triangles.empty());
  EXPECT_TRUE(film.edge_m.empty());
}

}  // namespace
}  // namespace tactus
