#include <memory>

#include "bandwidth.h"
#include "bench.h"
#include "tactus/fluid/film/film_exchange.h"
#include "tactus/fluid/liquid.h"
#include "tactus/multi_device/device_replay.h"

namespace tactus::bench {
namespace {

constexpr float kSpacing_m = 0.002F, kFrame_s = 1.F / 60;
constexpr Index kColumns = 160, kRows = 125;
/// Bytes that no method can avoid in a pass: of a vertex, volume and height read and written, of a triangle,
/// its corners and shape read.
constexpr double kVertexBytes = 24, kTriangleBytes = 60;

/// A wall of 20,000 vertices, 60 degrees steep, of which a film of 0.4 mm with waves wets a part. It may also
/// exchange with a liquid, of which it takes nothing.
class WetWall {
 public:
  enum class Exchange : std::uint8_t { none, moving, still };
  WetWall(DeviceSet& devices, double wet, Exchange exchange)
      : devices_(devices), film_(devices.context(0), {}, kVertices, kTriangles, 3 * kTriangles) {
    ExecContext& ctx = devices.context(0);
    std::vector<Vec3f> x_m;
    std::vector<std::int64_t> volume;
    const float row_m = kSpacing_m * std::sqrt(0.75F);
    for (Index j = 0; j < kRows; ++j)
      for (Index i = 0; i < kColumns; ++i) {
        x_m.push_back({kSpacing_m * (static_cast<float>(i) + 0.5F * static_cast<float>(j % 2)),
                       row_m * static_cast<float>(j), 0});
        const float height_m =
            4e-4F * (1 + 0.3F * std::sin(300 * x_m.back().x) * std::sin(200 * x_m.back().y));
        volume.push_back(i < wet * kColumns ? std::llround(height_m * kSpacing_m * row_m * kFilmUnits_1_m3)
                                            : 0);
      }
    std::vector<Index> corners;
    for (Index j = 0; j + 1 < kRows; ++j)
      for (Index i = 0; i + 1 < kColumns; ++i) {
        const Index a = j * kColumns + i, b = a + 1, c = a + kColumns, d = c + 1;
        const std::array<Index, 6> two =
            j % 2 == 0 ? std::array{a, b, c, b, d, c} : std::array{a, b, d, a, d, c};
        corners.insert(corners.end(), two.begin(), two.end());
      }
    std::vector<std::vector<Index>> of(kVertices);
    for (std::size_t k = 0; k < corners.size(); ++k)
      of[static_cast<std::size_t>(corners[k])].push_back(static_cast<Index>(k / 3));
    lists_ = IndexLists(ctx, of, 0);
    x_ = to_device(ctx, x_m);
    corners_ = to_device(ctx, corners);
    frame_ = to_device(ctx, std::vector<FrameParams>{
                                {.dt_s = kFrame_s, .gravity_m_s2 = {8.496F, 0, -4.905F}, .substeps = 1}});
    film_.set_volumes(ctx, volume);
    if (exchange != Exchange::none) add_exchange(exchange == Exchange::still);
  }
  void frame() {
    replay_.run(devices_, [&] { step(); });
    devices_.synchronize();
  }
  void step() {
    ExecContext& ctx = devices_.context(0);
    film_.step(ctx, surface(), frame_.const_view());
    if (!exchange_) return;
    const FilmSkin skin = exchange_->skin(surface(), normals_.const_view(), frame_.const_view());
    exchange_->find_touching(ctx, skin, liquid_->search(), liquid_->arrivals());
    exchange_->find_givers(ctx, film_, skin, liquid_->search(), liquid_->arrivals());
    exchange_->run(ctx, film_, skin, liquid_->search(), liquid_->arrivals());
  }
  Index passes() { return to_host(devices_.context(0), film_.passes())[0].passes; }
  static constexpr Index kVertices = kColumns * kRows, kTriangles = 2 * (kColumns - 1) * (kRows - 1);

 private:
  FilmSurface surface() const {
    return {kVertices, kTriangles, x_.const_view(), corners_.const_view(), lists_.ranges(), lists_.values()};
  }
  void add_exchange(bool is_still) {
    constexpr float kParticle_m = 0.0025F;
    constexpr Index kRoom = 1024;
    ExecContext& ctx = devices_.context(0);
    liquid_ = std::make_unique<Liquid>(devices_, LiquidSettings{.spacing_m = kParticle_m,
                                                                .box_m = {{0, 0, 0}, {0.4F, 0.4F, 0.4F}},
                                                                .max_particles = kRoom,
                                                                .least_particles = kRoom});
    liquid_->place(std::vector<LiquidParticle>{{{0.1F, 0.1F, 0.3F}, {}, 0}});
    liquid_->step({.dt_s = 1e-5F, .gravity_m_s2 = {}});
    normals_ = to_device(ctx, std::vector<Vec3f>(kVertices, Vec3f{0, 0, 1}));
    exchange_ = std::make_unique<FilmExchange>(
        ctx,
        FilmExchangeSettings{
            .spacing_m = kParticle_m, .reach_m = 0.004F, .max_particles = kRoom, .is_still = is_still},
        film_);
    exchange_->start(ctx, surface());
    devices_.synchronize();
  }

  DeviceSet& devices_;
  Film film_;
  std::unique_ptr<Liquid> liquid_;
  std::unique_ptr<FilmExchange> exchange_;
  Buffer<Vec3f> normals_;
  Buffer<Vec3f> x_;
  Buffer<Index> corners_;
  IndexLists lists_;
  Buffer<FrameParams> frame_;
  DeviceReplay replay_;
};

nlohmann::json film_row(DeviceSet& devices, double wet, WetWall::Exchange exchange, double bandwidth_B_s) {
  WetWall wall(devices, wet, exchange);
  for (int k = 0; k < 5; ++k) wall.frame();
  const std::vector<double> ms = time_ms([&] { wall.frame(); });
  const Index passes = wall.passes();
  const double bytes =
      passes * wet * (WetWall::kVertices * kVertexBytes + WetWall::kTriangles * kTriangleBytes);
  return {{"name", "film"},
          {"case", std::string(wet == 0  ? "dry"
                               : wet < 1 ? "a tenth wet"
                                         : "wet") +
                       (exchange == WetWall::Exchange::none     ? ""
                        : exchange == WetWall::Exchange::moving ? ", exchange"
                                                                : ", still, exchange")},
          {"size", WetWall::kVertices},
          {"devices", devices.name()},
          {"ms_p50", p(ms, 50)},
          {"ms_p99", p(ms, 99)},
          {"ms_min", p(ms, 0)},
          {"passes", passes},
          {"ms_per_pass", passes > 0 ? p(ms, 50) / passes : 0.0},
          {"floor_ms", 1e3 * bytes / bandwidth_B_s},
          {"kernels_ms_p50", kernels_ms(devices.context(0),
                                        [&] {
                                          wall.step();
                                          devices.synchronize();
                                        })},
          {"reference", nlohmann::json::object()}};
}

}  // namespace

/// Frames of a film on a wall: all of it wet, a tenth, nothing; then with an exchange, where the wall may
/// move and where it stands still.
Rows run_film(const std::string& device_text) {
  return collect([&](Rows& rows) {
    for (const std::string& set : single_devices(device_text)) {
      DeviceSet devices(set);
      const double bandwidth = measure_bandwidth_B_s(devices.context(0));
      for (const auto exchange :
           {WetWall::Exchange::none, WetWall::Exchange::moving, WetWall::Exchange::still})
        for (const double wet : {1.0, 0.1, 0.0}) rows.push_back(film_row(devices, wet, exchange, bandwidth));
    }
  });
}

}  // namespace tactus::bench
