#include "tactus/geom/search/neighbour_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>

#include "geom/neighbour_test_kernels.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/geom/search/neighbour_lists.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

using test::message_of;

class NeighbourSearchOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(NeighbourSearchOn);

constexpr float kReach = 0.1F;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Particles in the order in which they are given, with ids that have nothing to do with it.
struct Cloud {
  std::vector<Vec3f> x_m;
  std::vector<Index> id;
  Index size() const { return static_cast<Index>(x_m.size()); }
};

Cloud random_cloud(Index n, Vec3f extent_m, unsigned seed, Vec3f center_m = {}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(-1, 1);
  Cloud cloud;
  for (Index i = 0; i < n; ++i) {
    const Vec3f r{u(random), u(random), u(random)};
    cloud.x_m.push_back(center_m + Vec3f{r.x * extent_m.x, r.y * extent_m.y, r.z * extent_m.z});
  }
  cloud.id.resize(cloud.x_m.size());
  std::iota(cloud.id.begin(), cloud.id.end(), 0);
  std::shuffle(cloud.id.begin(), cloud.id.end(), random);
  return cloud;
}
Cloud jittered_cloud(Index edge, float spacing_m, unsigned seed) {
  Cloud cloud = random_cloud(edge * edge * edge, Vec3f{0.4F, 0.4F, 0.4F} * spacing_m, seed);
  for (Index i = 0; i < cloud.size(); ++i)
    cloud.x_m[static_cast<std::size_t>(i)] +=
        spacing_m * vec_cast<float>(Vec3i{i % edge, i / edge % edge, i / (edge * edge)});
  return cloud;
}
Cloud shuffled(const Cloud& cloud, unsigned seed) {
  std::vector<std::size_t> order(cloud.x_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  Cloud other;
  for (const std::size_t i : order) other.x_m.push_back(cloud.x_m[i]), other.id.push_back(cloud.id[i]);
  return other;
}

/// The order of the visit, from its definition: cells by z, y, x, then by x and id. Cells as the search's,
/// whose edge is 1025/1024 of the reach. @returns numbers in `among`
std::vector<std::size_t> brute_force(const Cloud& among, Vec3f p) {
  const float inverse = 1.F / ((1.F + 1.F / 1024) * kReach);
  std::vector<std::pair<std::tuple<Index, Index, Index, float, Index>, std::size_t>> near;
  for (std::size_t j = 0; j < among.x_m.size(); ++j) {
    const Vec3f x = among.x_m[j], d = x - p;
    if (!(dot(d, d) <= kReach * kReach)) continue;
    const auto cell = [&](float v) { return floor_to_int(v * inverse); };
    near.push_back({{cell(x.z), cell(x.y), cell(x.x), x.x, among.id[j]}, j});
  }
  std::sort(near.begin(), near.end());
  std::vector<std::size_t> numbers;
  for (const auto& n : near) numbers.push_back(n.second);
  return numbers;
}
std::vector<Index> ids_of(const Cloud& cloud, const std::vector<std::size_t>& numbers) {
  std::vector<Index> ids;
  for (const std::size_t j : numbers) ids.push_back(cloud.id[j]);
  return ids;
}
/// As OrderedSum.
float ordered_sum(const Cloud& among, const std::vector<std::size_t>& near, Vec3f p) {
  float sum = 0;
  for (const std::size_t j : near)
    sum = 0.5F * sum +
          (static_cast<float>(among.id[j]) +
           (among.x_m[j].x - p.x + test::OrderedSum::weight(dot(among.x_m[j] - p, among.x_m[j] - p), true)));
  return sum;
}

struct Visited {
  std::vector<float> sum;    ///< by id
  std::vector<Index> count;  ///< by id
  std::vector<Index> listed;
  Index placed = 0, wanted = 0;
  friend bool operator==(const Visited&, const Visited&) = default;
};

/// A visit that lists what is near, and one that goes through those lists, against one that does neither.
/// Weights are kept for half of the particles; the others' are worked out again.
void expect_same_listed(ExecContext& ctx, const NeighbourSearch& search, View<const float> sum,
                        View<const Index> count) {
  const View<const SearchParticle> particles = search.cells().particles;
  Buffer<Index> list_count(ctx.device(), search.max_particles()),
      near(ctx.device(), NearLists::size(search.max_particles()));
  Buffer<float> weight(ctx.device(), NearLists::weights(max(search.max_particles() / 2, Index{1})));
  const NearLists lists{list_count.view(), near.view(), weight.view()};
  const std::vector<float> sums = to_host(ctx, sum);
  const std::vector<Index> counts = to_host(ctx, count);
  for (const bool read : {false, true}) {
    Buffer<float> again = to_device(ctx, std::vector<float>(sums.size(), -1));
    Buffer<Index> counted = to_device(ctx, std::vector<Index>(counts.size(), -1));
    const test::OrderedSum pair{particles, particles, again.view(), counted.view()};
    if (read)
      search.visit_listed(ctx, "test/listed", pair, lists);
    else
      search.visit_listing(ctx, "test/listing", pair, lists);
    EXPECT_EQ(to_host(ctx, again.view()), sums) << (read ? "listed" : "listing");
    EXPECT_EQ(to_host(ctx, counted.view()), counts) << (read ? "listed" : "listing");
  }
}

/// @param capacity capacity behind the particles, with positions that must not be found
Visited visit(ExecContext& ctx, const Cloud& cloud, CellIds ids, const Cloud* among_cloud = nullptr) {
  constexpr Index kSpare = 100, kListed = 64;
  const auto padded = [&](const Cloud& c) {
    Cloud p = c;
    p.x_m.resize(p.x_m.size() + kSpare, c.x_m.empty() ? Vec3f{} : c.x_m.front());
    p.id.resize(p.id.size() + kSpare, -1);
    return p;
  };
  const auto search_of = [&](const Cloud& c) {
    const Cloud p = padded(c);
    const Buffer<Vec3f> x = to_device(ctx, p.x_m);
    const Buffer<Index> id = to_device(ctx, p.id), count = to_device(ctx, std::vector<Index>{c.size()});
    NeighbourSearch search(ctx.device(), {.max_particles = x.size(), .reach_m = kReach, .ids = ids});
    search.build(ctx, x.view(), id.view(), Count(count.view(), x.size()));
    ctx.synchronize();
    return search;
  };
  const NeighbourSearch of = search_of(cloud), among = search_of(among_cloud ? *among_cloud : cloud);
  const NeighbourSearch& visited = among_cloud ? among : of;
  const auto n = static_cast<std::size_t>(cloud.size());
  Buffer<float> sum = to_device(ctx, std::vector<float>(n, -1));
  Buffer<Index> count = to_device(ctx, std::vector<Index>(n, -1));
  of.visit(ctx, "test/visit", visited,
           test::OrderedSum{of.cells().particles, visited.cells().particles, sum.view(), count.view()});
  if (among_cloud == nullptr) expect_same_listed(ctx, of, sum.view(), count.view());
  NeighbourLists lists(ctx.device(), of.max_particles(), max(cloud.size() * kListed, Index(1)));
  lists.build(ctx, of, visited);
  Buffer<Index> found = to_device(ctx, std::vector<Index>(n * kListed, -1)),
                listed = to_device(ctx, std::vector<Index>(n, -1));
  const NeighbourListView view = lists.view();
  ctx.parallel_for("test/lists", of.placed(),
                   test::CollectLists{view.begin, view.neighbours, of.cells().particles,
                                      visited.cells().particles, kListed, found.view(), listed.view()});
  Visited result{to_host(ctx, sum.view()), to_host(ctx, count.view()), to_host(ctx, found.view()),
                 to_host(ctx, of.cells().placed)[0], to_host(ctx, lists.wanted())[0]};
  const std::vector<Index> lengths = to_host(ctx, listed.view());
  result.listed.insert(result.listed.end(), lengths.begin(), lengths.end());
  return result;
}

/// Counts of all particles, and order of the visit and list of every `every`-th, against brute force.
void expect_brute_force(const Visited& got, const Cloud& cloud, const Cloud& among, bool one,
                        std::size_t every) {
  const std::size_t n = cloud.x_m.size(), capacity = n == 0 ? 0 : (got.listed.size() - n) / n;
  for (std::size_t i = 0; i < n; i += every) {
    const std::vector<std::size_t> near = brute_force(among, cloud.x_m[i]);
    std::vector<Index> expected = ids_of(among, near);
    const auto id = static_cast<std::size_t>(cloud.id[i]);
    if (!std::isfinite(dot(cloud.x_m[i], cloud.x_m[i]))) {
      EXPECT_EQ(got.count[id], -1) << "id " << id << " has no slot";
      continue;
    }
    ASSERT_EQ(got.count[id], static_cast<Index>(expected.size())) << "id " << id;
    EXPECT_EQ(got.sum[id], ordered_sum(among, near, cloud.x_m[i])) << "id " << id;
    if (one) std::erase(expected, cloud.id[i]);
    if (expected.size() > capacity) continue;
    const auto first = got.listed.begin() + static_cast<std::ptrdiff_t>(id * capacity);
    EXPECT_EQ(std::vector<Index>(first, first + got.listed[n * capacity + id]), expected) << "id " << id;
  }
}

/// Against brute force on the CPU, and everywhere like there, whatever order particles come in.
void check_everywhere(const std::string& devices, const Cloud& cloud, const Cloud* among = nullptr,
                      std::size_t every = 101) {
  for (const CellIds ids : {CellIds::linear, CellIds::morton}) {
    DeviceSet reference("cpu"), set(devices, 3);
    const Visited expected = visit(reference.context(0), cloud, ids, among);
    expect_brute_force(expected, cloud, among ? *among : cloud, among == nullptr, every);
    const Cloud other = shuffled(cloud, 11);
    set.for_each_part([&](ExecContext& ctx, int) {
      EXPECT_EQ(visit(ctx, cloud, ids, among), expected);
      EXPECT_EQ(visit(ctx, other, ids, among), expected) << "another order";
    });
  }
}

TEST_P(NeighbourSearchOn, Jittered) { check_everywhere(GetParam(), jittered_cloud(22, 0.05F, 1)); }

TEST_P(NeighbourSearchOn, Clustered) {
  Cloud cloud = random_cloud(9000, {3, 3, 3}, 2);
  for (std::size_t i = 0; i < 1000; ++i) cloud.x_m[9 * i] = 0.03F * cloud.x_m[9 * i];
  check_everywhere(GetParam(), cloud, nullptr, 9);
}

TEST_P(NeighbourSearchOn, OneParticleAndNone) {
  check_everywhere(GetParam(), random_cloud(1, {1, 1, 1}, 3));
  check_everywhere(GetParam(), Cloud{});
}

TEST_P(NeighbourSearchOn, AllInOneCell) {
  check_everywhere(GetParam(), random_cloud(5000, {0.04F, 0.04F, 0.04F}, 4, {0.05F, 0.05F, 0.05F}), nullptr,
                   997);
}

TEST_P(NeighbourSearchOn, SpaceWithoutBounds) {
  // Boxes of every shape, many times larger than the table, far from the origin, and single ones farther
  // still (4000 cells: there, floats of neighbours are 2^-12 of a cell apart).
  for (const Vec3f extent_m : {Vec3f{20, 20, 0.1F}, {0.1F, 20, 20}, {200, 0.1F, 0.2F}, {0.2F, 0.1F, 200}}) {
    Cloud cloud = random_cloud(10000, extent_m, 5, {-40, 50, -60});
    for (std::size_t i = 0; i < 2000; ++i)
      cloud.x_m[5 * i] = cloud.x_m[5 * i + 1] + Vec3f{0.05F, 0.02F, 0.01F};
    cloud.x_m[7] = {400, -400, 400};
    cloud.x_m[8] = {400.05F, -400, 400};
    check_everywhere(GetParam(), cloud);
  }
}

TEST_P(NeighbourSearchOn, PositionsThatAreNone) {
  Cloud cloud = random_cloud(2000, {0.4F, 0.4F, 0.4F}, 6);
  for (std::size_t i = 0; i < 300; ++i) {
    constexpr float kInf = std::numeric_limits<float>::infinity();
    cloud.x_m[5 * i][static_cast<int>(i % 3)] = i % 2 == 0 ? kNaN : (i % 4 == 1 ? kInf : -1e30F);
  }
  check_everywhere(GetParam(), cloud, nullptr, 1);
  DeviceSet set(GetParam(), 3);
  EXPECT_EQ(visit(set.context(0), cloud, CellIds::linear).placed, 1700);
  std::fill(cloud.x_m.begin(), cloud.x_m.end(), Vec3f{kNaN, 0, 0});
  const Visited none = visit(set.context(0), cloud, CellIds::linear);
  EXPECT_EQ(none.placed, 0);
  EXPECT_EQ(none.wanted, 0);
}

TEST_P(NeighbourSearchOn, OneSetAmongAnother) {
  const Cloud fluid = jittered_cloud(14, 0.05F, 7), boundary = random_cloud(5000, {0.8F, 0.8F, 0.01F}, 8);
  check_everywhere(GetParam(), fluid, &boundary);
  check_everywhere(GetParam(), boundary, &fluid);
}

TEST_P(NeighbourSearchOn, PointsAnywhere) {
  const Cloud cloud = jittered_cloud(12, 0.05F, 9);
  std::vector<Vec3f> points = random_cloud(300, {0.7F, 0.7F, 0.7F}, 10).x_m;
  points[0].y = kNaN;
  constexpr Index kCapacity = 128;
  DeviceSet set(GetParam(), 3);
  set.for_each_part([&](ExecContext& ctx, int) {
    const Buffer<Vec3f> x = to_device(ctx, cloud.x_m), p = to_device(ctx, points);
    const Buffer<Index> id = to_device(ctx, cloud.id);
    NeighbourSearch search(ctx.device(), {.max_particles = x.size(), .reach_m = kReach});
    search.build(ctx, x.view(), id.view(), x.size());
    Buffer<Index> found(ctx.device(), p.size() * kCapacity), count(ctx.device(), p.size());
    ctx.parallel_for(
        "test/collect", p.size(),
        test::CollectNear{search.cells(), p.view(), kReach, kCapacity, found.view(), count.view()});
    const std::vector<Index> ids = to_host(ctx, found.view()), counts = to_host(ctx, count.view());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto first = ids.begin() + static_cast<std::ptrdiff_t>(i * kCapacity);
      EXPECT_EQ(std::vector<Index>(first, first + counts[i]), ids_of(cloud, brute_force(cloud, points[i])))
          << "point " << i;
    }
  });
}

TEST_P(NeighbourSearchOn, FieldsFollowTheOrder) {
  const Cloud cloud = random_cloud(3000, {0.4F, 0.4F, 0.4F}, 12);
  DeviceSet set(GetParam(), 3);
  set.for_each_part([&](ExecContext& ctx, int) {
    const Buffer<Vec3f> x = to_device(ctx, cloud.x_m);
    const Buffer<Index> id = to_device(ctx, cloud.id);
    Buffer<Vec3f> moved_x(ctx.device(), x.size());
    Buffer<Index> moved_id(ctx.device(), x.size());
    NeighbourSearch search(ctx.device(), {.max_particles = x.size(), .reach_m = kReach});
    search.build(ctx, x.view(), id.view(), x.size());
    search.reorder(ctx, {{x.view(), moved_x.view()}, {id.view(), moved_id.view()}});
    const std::vector<SearchParticle> particles = to_host(ctx, search.cells().particles);
    const std::vector<Vec3f> xs = to_host(ctx, moved_x.view());
    const std::vector<Index> ids = to_host(ctx, moved_id.view());
    for (std::size_t slot = 0; slot < particles.size(); ++slot) {
      EXPECT_EQ(particles[slot].x_m, xs[slot]);
      EXPECT_EQ(particles[slot].id, ids[slot]);
    }
    std::vector<Index> sorted = ids;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], static_cast<Index>(i));
  });
}

/// Recorded once, replayed with other positions and another count, also a much smaller one.
TEST_P(NeighbourSearchOn, RecordedOnce) {
  DeviceSet set(GetParam(), 3);
  set.for_each_part([&](ExecContext& ctx, int) {
    constexpr Index kCapacity = 20000;
    Buffer<Vec3f> x(ctx.device(), kCapacity);
    Buffer<Index> id(ctx.device(), kCapacity), count(ctx.device(), 1), found(ctx.device(), kCapacity);
    Buffer<float> sum(ctx.device(), kCapacity);
    NeighbourSearch search(ctx.device(), {.max_particles = kCapacity, .reach_m = kReach});
    const auto step = [&] {
      search.build(ctx, x.view(), id.view(), Count(count.view(), kCapacity));
      const View<const SearchParticle> particles = search.cells().particles;
      search.visit(ctx, "test/visit", test::OrderedSum{particles, particles, sum.view(), found.view()});
    };
    Graph graph;
    for (const Index n : {15000, 20000, 300, 1, 0, 9000}) {
      const Cloud cloud = random_cloud(n, {0.7F, 0.7F, 0.7F}, static_cast<unsigned>(n));
      ctx.upload(cloud.x_m, x.view().part(0, n));
      ctx.upload(cloud.id, id.view().part(0, n));
      const std::vector<Index> counted{n};
      ctx.upload(counted, count.view());
      ctx.synchronize();
      if (n == 15000) {
        step();
        graph = ctx.capture(step);
      }
      ctx.launch(graph);
      ctx.synchronize();
      const std::vector<Index> counts = to_host(ctx, found.view());
      for (std::size_t i = 0; i < cloud.x_m.size(); i += 101) {
        const std::vector<std::size_t> expected = brute_force(cloud, cloud.x_m[i]);
        EXPECT_EQ(counts[static_cast<std::size_t>(cloud.id[i])], static_cast<Index>(expected.size()));
      }
    }
  });
}

TEST_P(NeighbourSearchOn, ListsThatDoNotFit) {
  const Cloud cloud = jittered_cloud(10, 0.05F, 13);
  DeviceSet set(GetParam(), 3);
  ExecContext& ctx = set.context(0);
  const Buffer<Vec3f> x = to_device(ctx, cloud.x_m);
  NeighbourSearch search(ctx.device(), {.max_particles = x.size(), .reach_m = kReach});
  search.build(ctx, x.view(), {}, x.size());
  NeighbourLists all(ctx.device(), x.size(), 64 * x.size()), few(ctx.device(), x.size(), 1000);
  all.build(ctx, search);
  few.build(ctx, search);
  EXPECT_EQ(to_host(ctx, few.wanted()), to_host(ctx, all.wanted()));
  const std::vector<Index> a = to_host(ctx, all.view().neighbours), f = to_host(ctx, few.view().neighbours);
  EXPECT_TRUE(std::equal(f.begin(), f.end(), a.begin()));
}

TEST(CellHash, CellsSideBySideDoNotShareANumber) {
  for (const CellIds ids : {CellIds::linear, CellIds::morton}) {
    const CellHash hash{1, ids};
    for (int bits = CellHash::kLeastBits; bits <= 24; ++bits) {
      for (const Vec3i c : {Vec3i{0, 0, 0}, {1, 2, 3}, {-5, 7, 1000}, {3, 3, 3}, {1 << 20, -(1 << 21), 3}}) {
        std::vector<std::uint32_t> numbers;
        for (Index i = 0; i < 27; ++i)
          numbers.push_back(hash.number(c + Vec3i{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1}, Index(1) << bits));
        std::sort(numbers.begin(), numbers.end());
        EXPECT_EQ(std::adjacent_find(numbers.begin(), numbers.end()), numbers.end()) << bits << " bits";
      }
    }
  }
}

/// One number in eight is taken: were numbers random, a cell would share its with 1/8 of another one on
/// average. Along axes a table that wraps around a cube (64 x 64 x 128 cells) has 600 cells of a column in
/// each.
TEST(CellHash, ShapesSpreadOverTheTable) {
  constexpr Index kSize = 1 << 19;
  const CellHash hash;
  for (const Vec3i shape : {Vec3i{40, 40, 40},
                            {180, 180, 2},
                            {2, 180, 180},
                            {180, 2, 180},
                            {16000, 2, 2},
                            {2, 16000, 2},
                            {2, 2, 16000},
                            {600, 10, 10},
                            {10, 600, 10},
                            {10, 10, 600}}) {
    std::vector<Index> taken(kSize);
    for (Index z = 0; z < shape.z; ++z)
      for (Index y = 0; y < shape.y; ++y)
        for (Index x = 0; x < shape.x; ++x) ++taken[hash.number({x, y, z}, kSize)];
    double cells = 0, shared = 0;
    for (const Index n : taken) cells += n, shared += static_cast<double>(n) * (n - 1);
    EXPECT_LE(shared / cells, 0.25) << shape.x << " x " << shape.y << " x " << shape.z;
  }
}

TEST(NeighbourSearchErrors, NameTheValue) {
  DeviceSet cpu("cpu");
  Device& device = cpu.device(0);
  const auto message = [&](Index n, float reach) -> std::string {
    return message_of([&] { NeighbourSearch s(device, {.max_particles = n, .reach_m = reach}); });
  };
  EXPECT_NE(message(0, 1).find("max_particles is 0"), std::string::npos);
  EXPECT_NE(message(1, -1).find("reach_m is -1"), std::string::npos);
  EXPECT_NE(message(1, kNaN).find("reach_m is nan"), std::string::npos);
  NeighbourSearch search(device, {.max_particles = 10, .reach_m = 1});
  const Buffer<Vec3f> x(device, 11);
  EXPECT_NE(message_of([&] { search.build(cpu.context(0), x.view(), {}, 11); }).find("11 particles"),
            std::string::npos);
  EXPECT_NE(message_of([&] { NeighbourLists lists(device, 1, 0); }).find("max_neighbours is 0"),
            std::string::npos);
}

}  // namespace
}  // namespace tactus
