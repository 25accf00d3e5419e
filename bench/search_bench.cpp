#include <algorithm>
#include <numeric>
#include <random>

#include "bandwidth.h"
#include "bench.h"
#include "search_kernels.h"
#include "tactus/geom/search/neighbour_lists.h"
#include "tactus/multi_device/device_set.h"

namespace tactus::bench {
namespace {

constexpr float kSpacing_m = 0.005F, kReach_m = 2 * kSpacing_m;  ///< about 30 neighbours

/// Milliseconds of Table 4 of Shao et al. 2019.
struct PaperRow {
  Index particles;
  double goswami_ms, shao2015_ms, paper_ms;
};
constexpr PaperRow kTable4[] = {
    {300000, 2.9, 3.8, 2.4}, {400000, 4.2, 5.3, 3.5}, {500000, 5.5, 6.4, 4.2}, {600000, 6.4, 7.2, 4.7}};

/// Bytes a particle that no method can avoid: position and id read and written, in order.
constexpr double kBuildBytes = 32;
/// Of a pass: position read, density written.
constexpr double kPassBytes = 20;

/// A cube of particles in a jittered lattice.
std::vector<Vec3f> cube_m(Index n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> u(-0.2F, 0.2F);
  Index edge = 1;
  while (edge * edge * edge < n) ++edge;
  std::vector<Vec3f> x;
  for (Index i = 0; i < n; ++i) {
    const Vec3f node = vec_cast<float>(Vec3i{i % edge, i / edge % edge, i / (edge * edge)});
    x.push_back(kSpacing_m * (node + Vec3f{u(random), u(random), u(random)}));
  }
  return x;
}

/// Particles as a frame finds them: in the order of the frame before, moved by up to a fiftieth of the reach
/// since.
class SearchCase {
 public:
  SearchCase(DeviceSet& devices, Index n)
      : ctx_(devices.context(0)), name_(devices.name()), n_(n), density_(ctx_.device(), n) {
    std::vector<Vec3f> x = cube_m(n);
    std::mt19937 random(2);
    std::shuffle(x.begin(), x.end(), random);
    shuffled_m_ = to_device(ctx_, x);
    id_ = Buffer<Index>(ctx_.device(), n);
    std::vector<Index> id(x.size());
    std::iota(id.begin(), id.end(), 0);
    ctx_.upload(id, id_.view());
    NeighbourSearch first = search(CellIds::linear);
    first.build(ctx_, shuffled_m_.view(), id_.view(), n);
    std::vector<SearchParticle> sorted = to_host(ctx_, first.cells().particles);
    std::uniform_real_distribution<float> u(-0.02F, 0.02F);
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = sorted[i].x_m + kReach_m * Vec3f{u(random), u(random), u(random)};
      id[i] = sorted[i].id;
    }
    x_m_ = to_device(ctx_, x);
    sorted_id_ = to_device(ctx_, id);
  }

  NeighbourSearch search(CellIds ids) const {
    return {ctx_.device(), {.max_particles = n_, .reach_m = kReach_m, .ids = ids}};
  }
  void build(NeighbourSearch& search) { search.build(ctx_, x_m_.view(), sorted_id_.view(), n_); }
  void build_shuffled(NeighbourSearch& search) { search.build(ctx_, shuffled_m_.view(), id_.view(), n_); }
  void pass(const NeighbourSearch& search) {
    search.visit(ctx_, "search/density", DensityPass{kReach_m * kReach_m, density_.view()});
  }
  ExecContext& ctx() { return ctx_; }
  Index size() const { return n_; }
  View<const Vec3f> x_m() const { return x_m_.view(); }
  View<const Index> id() const { return sorted_id_.view(); }

  /// On a GPU, of one run among several that are recorded as one graph, as substeps are.
  std::vector<double> timed_ms(const std::function<void()>& body) {
    const int batch = ctx_.device().is_cuda() ? 20 : 1;
    Replay replay;
    std::vector<double> ms = time_ms([&] {
      replay.run(ctx_, [&] {
        for (int i = 0; i < batch; ++i) body();
      });
      ctx_.synchronize();
    });
    for (double& m : ms) m /= batch;
    return ms;
  }
  nlohmann::json row(const std::string& name, const std::string& form, double floor_ms,
                     const std::function<void()>& body) {
    const std::vector<double> ms = timed_ms(body);
    nlohmann::json row{{"name", name},       {"case", form},         {"size", n_},
                       {"devices", name_},   {"ms_p50", p(ms, 50)},  {"ms_p99", p(ms, 99)},
                       {"ms_min", p(ms, 0)}, {"floor_ms", floor_ms}, {"reference", nlohmann::json::object()}};
    row["kernels_ms_p50"] = kernels_ms(ctx_, [&] {
      for (int i = 0; i < 5; ++i) body();
    });
    for (const PaperRow& paper : kTable4) {
      if (paper.particles == n_)
        row["reference"] = {{"paper", paper.paper_ms},
                            {"paper_goswami", paper.goswami_ms},
                            {"paper_shao2015", paper.shao2015_ms}};
    }
    return row;
  }

 private:
  ExecContext& ctx_;
  std::string name_;
  Index n_;
  Buffer<Vec3f> shuffled_m_, x_m_;
  Buffer<Index> id_, sorted_id_;
  Buffer<float> density_;
};

/// Sorts all particles along the Z-order curve: keys, radix sort, gather.
nlohmann::json goswami_row(SearchCase& c, double floor_ms) {
  ExecContext& ctx = c.ctx();
  Index edge = 1;
  int bits = 1;
  while (edge * edge * edge < c.size()) ++edge;
  while ((1 << bits) * kReach_m < (static_cast<float>(edge) + 1) * kSpacing_m) ++bits;
  const Index n = c.size(), cells = 1 << (3 * bits);
  Buffer<std::uint32_t> key(ctx.device(), n), key_scratch(ctx.device(), n);
  Buffer<Index> order(ctx.device(), n), order_scratch(ctx.device(), n), begin(ctx.device(), cells),
      end(ctx.device(), cells);
  Buffer<SearchParticle> particles(ctx.device(), n);
  return c.row("goswami", "moved", floor_ms, [&] {
    const float corner = -0.5F * kSpacing_m;
    ctx.parallel_for("goswami/keys", n,
                     ZIndex{c.x_m(), {corner, corner, corner}, 1.F / kReach_m, key.view(), order.view()});
    ctx.sort_pairs("goswami/sort", key.view(), order.view(), key_scratch.view(), order_scratch.view(),
                   3 * bits);
    ctx.fill_bytes(begin.view(), 0);
    ctx.fill_bytes(end.view(), 0);
    ctx.parallel_for("goswami/gather", n,
                     GatherSorted{c.x_m(), c.id(), order.const_view(), key.const_view(), particles.view(),
                                  begin.view(), end.view()});
  });
}

void add_rows(Rows& rows, DeviceSet& devices, Index n, double bandwidth_B_s) {
  SearchCase c(devices, n);
  const auto floor_ms = [&](double bytes) { return bytes * n / bandwidth_B_s * 1e3; };
  NeighbourSearch linear = c.search(CellIds::linear), morton = c.search(CellIds::morton);
  NeighbourLists lists(devices.device(0), n, 40 * n);
  rows.push_back(c.row("search build", "moved", floor_ms(kBuildBytes), [&] { c.build(linear); }));
  rows.push_back(c.row("search build", "shuffled", floor_ms(kBuildBytes), [&] { c.build_shuffled(linear); }));
  // Build included, as with others' figures.
  rows.push_back(c.row("search visit", "moved", floor_ms(kBuildBytes + kPassBytes), [&] {
    c.build(linear);
    c.pass(linear);
  }));
  const double listed = 4.0 * to_host(c.ctx(), [&] {
                          c.build(linear);
                          lists.build(c.ctx(), linear);
                          return lists.wanted();
                        }())[0];
  rows.push_back(c.row("search lists", "moved", floor_ms(kBuildBytes + kPassBytes + listed / n), [&] {
    c.build(linear);
    lists.build(c.ctx(), linear);
  }));
  rows.back()["neighbours"] = listed / 4 / n;
  rows.push_back(goswami_row(c, floor_ms(kBuildBytes)));
  for (auto [name, search] : {std::pair{"linear ids", &linear}, {"morton ids", &morton}}) {
    rows.push_back(c.row(name, "moved", floor_ms(kBuildBytes), [&, s = search] { c.build(*s); }));
    rows.back()["pass_ms_p50"] = p(c.timed_ms([&, s = search] { c.pass(*s); }), 50);
  }
}

}  // namespace

/// Table 4 of Shao et al. 2019: neighbour search of particles with about 30 neighbours each, on one device.
Rows run_table4(const std::string& device_text) {
  return collect([&](Rows& rows) {
    for (const std::string& set : single_devices(device_text)) {
      DeviceSet devices(set);
      const double bandwidth = measure_bandwidth_B_s(devices.context(0));
      add_rows(rows, devices, 40000, bandwidth);
      for (const PaperRow& paper : kTable4) add_rows(rows, devices, paper.particles, bandwidth);
      if (!devices.is_cuda()) continue;
      for (const Index n : {2000000, 8000000}) add_rows(rows, devices, n, bandwidth);
    }
  });
}

}  // namespace tactus::bench
