#include "tactus/geom/search/neighbour_lists.h"

namespace tactus {
namespace {
Index checked(Index number, const char* name) {
  if (number <= 0)
    throw Error("neighbour lists: " + std::string(name) + " is " + std::to_string(number) + ", must be > 0");
  return number;
}
}  // namespace

NeighbourLists::NeighbourLists(Device& device, Index max_particles, Index max_neighbours)
    : begin_(device, checked(max_particles, "max_particles") + 1),
      neighbours_(device, checked(max_neighbours, "max_neighbours")),
      wanted_(device, 1),
      scan_(device, max_particles) {}

void NeighbourLists::build(ExecContext& ctx, const NeighbourSearch& of, const NeighbourSearch& among) {
  if (of.max_particles() >= begin_.size()) {
    throw Error("neighbour lists: a search of up to " + std::to_string(of.max_particles()) +
                " particles, but capacity for " + std::to_string(begin_.size() - 1));
  }
  const Index self = &of == &among ? 1 : 0;
  of.visit(ctx, "search/count_neighbours", among, CountNeighbours{self, begin_.view()});
  scan_.run(ctx, "search/scan_lists", of.placed(), begin_.view(), wanted_.view());
  of.visit(ctx, "search/write_neighbours", among,
           WriteNeighbours{self, begin_.const_view(), neighbours_.view()});
}

}  // namespace tactus
