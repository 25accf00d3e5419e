#include "tactus/multi_device/halo.h"

#include <gtest/gtest.h>

#include <cmath>

#include "multi_device/halo_test_kernels.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/multi_device/device_replay.h"

namespace tactus {
namespace {

using test::message_of;

constexpr Index kNodes = 60;
constexpr int kSteps = 12;

/// What a step leaves out: a mistake that must show.
enum class Forgotten : std::uint8_t { nothing, update, finish, await };

/// Heat along a rod that is cut into one piece a part, with one copy at each cut. Copies stand at the left
/// and right of own nodes, or, with lists, in two places behind them.
class Rod {
 public:
  Rod(DeviceSet& devices, bool with_lists) : devices_(devices) {
    const int parts = devices.count();
    for (int p = 0; p < parts; ++p) {
      pieces_.push_back({kNodes * p / parts, kNodes * (p + 1) / parts});
      const bool left = p > 0, right = p + 1 < parts;
      std::vector<float> a;
      for (Index i = own(p).begin - (left ? 1 : 0); i < own(p).end + (right ? 1 : 0); ++i)
        a.push_back(start(i));
      a_[0].push_back(to_device(devices.context(p), a));
      a_[1].push_back(to_device(devices.context(p), a));
    }
    std::vector<HaloLink> links;
    for (int p = 0; p + 1 < parts; ++p) {
      const Index first_of_right = 1, last_of_left = first_own(p) + own(p).count() - 1;
      HaloLink up{.holder = p,
                  .owner = p + 1,
                  .count = 1,
                  .first_there = first_of_right,
                  .first_here = last_of_left + 1};
      HaloLink down{.holder = p + 1, .owner = p, .count = 1, .first_there = last_of_left, .first_here = 0};
      if (with_lists) {
        for (HaloLink* link : {&up, &down})
          link->there = {link->first_there}, link->here = {link->first_here};
      }
      links.push_back(up);
      links.push_back(down);
    }
    halo_.emplace(devices, "rod", links);
  }
  static float start(Index i) { return i % 7 == 0 ? 10.F : static_cast<float>(i % 3); }

  /// Two steps: a to b and back, so that they can be recorded.
  void steps(Forgotten forgotten = Forgotten::nothing) {
    for (int k = 0; k < 2; ++k) {
      const auto fields = [&](int p) { return std::array{a_[k % 2][static_cast<std::size_t>(p)].view()}; };
      const auto next = [&](int p) { return std::array{a_[1 - k % 2][static_cast<std::size_t>(p)].view()}; };
      const bool updates = forgotten != Forgotten::update;
      if (k == 0 && (updates || !has_begun_)) {  // a recording can't wait for what came before it
        devices_.for_each_part([&](ExecContext&, int p) { halo_->begin(p, fields); });
        halo_->finish(fields);
        has_begun_ = true;
      }
      devices_.for_each_part([&](ExecContext& ctx, int p) {
        if (forgotten != Forgotten::await) halo_->await_readers(p, next);
        const Index last = p + 1 == devices_.count() ? first_own(p) + own(p).count() - 1 : -1;
        ctx.parallel_for("test/diffuse", own(p).count(),
                         test::Diffuse{fields(p)[0], next(p)[0], first_own(p), last, p == 0});
        if (updates) halo_->begin(p, next);
      });
      if (updates && forgotten != Forgotten::finish) halo_->finish(next);
    }
  }
  std::vector<float> download() {
    std::vector<float> all;
    devices_.for_each_part([&](ExecContext& ctx, int p) {
      const std::vector<float> some =
          to_host(ctx, a_[0][static_cast<std::size_t>(p)].view().part(first_own(p), own(p).count()));
      all.insert(all.end(), some.begin(), some.end());
    });
    return all;
  }

 private:
  Slab own(int p) const { return pieces_[static_cast<std::size_t>(p)]; }
  Index first_own(int p) const { return p > 0 ? 1 : 0; }

  DeviceSet& devices_;
  std::vector<Slab> pieces_;
  std::array<std::vector<Buffer<float>>, 2> a_;
  std::optional<Halo<float>> halo_;
  bool has_begun_ = false;
};

std::vector<float> expected() {
  std::vector<float> a, b(kNodes);
  for (Index i = 0; i < kNodes; ++i) a.push_back(Rod::start(i));
  for (int k = 0; k < kSteps; ++k) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const float left = i == 0 ? a[i] : a[i - 1], right = i + 1 == a.size() ? a[i] : a[i + 1];
      b[i] = a[i] + 0.25F * (left - 2.F * a[i] + right);
    }
    a.swap(b);
  }
  return a;
}

std::vector<float> run(DeviceSet& devices, bool with_lists, Forgotten forgotten = Forgotten::nothing) {
  Rod rod(devices, with_lists);
  DeviceReplay replay;
  for (int k = 0; k < kSteps / 2; ++k) replay.run(devices, [&] { rod.steps(forgotten); });
  return rod.download();
}

class HaloOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(HaloOn);

TEST_P(HaloOn, ACutRodIsOneRod) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (const PeerAccess access : {PeerAccess::automatic, PeerAccess::staged}) {
      DeviceSet devices(GetParam(), seed, access);
      for (const bool with_lists : {false, true}) {
        EXPECT_EQ(run(devices, with_lists), expected()) << "seed " << seed;
      }
    }
    if (GetParam().starts_with("cuda")) break;  // seeds order the queues of virtual devices
  }
}

/// What is forgotten must show with every seed, not by luck.
TEST(HaloForgotten, UpdateGivesNaN) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    DeviceSet devices("cpu:3", seed);
    for (const Forgotten what : {Forgotten::update, Forgotten::finish}) {
      int bad = 0;
      for (const float v : run(devices, seed % 2 == 0, what)) bad += std::isnan(v) ? 1 : 0;
      EXPECT_GT(bad, 0) << "seed " << seed;
    }
  }
}

TEST(HaloForgotten, BeginIsNamed) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    DeviceSet devices("cpu:2", seed);
    Buffer<float> a(devices.device(0), 2), b(devices.device(1), 2);
    Halo<float> halo(devices, "rod", {{.holder = 0, .owner = 1, .count = 1, .first_here = 1}});
    const auto fields = [&](int p) { return std::array{p == 0 ? a.view() : b.view()}; };
    halo.begin(0, fields);
    const std::string message = message_of([&] { halo.finish(fields); });
    EXPECT_NE(message.find("halo 'rod': finish, but part 1 has not begun"), std::string::npos) << message;
  }
}

/// Copies of both neighbours are added to each node at a cut, whatever order queues run in.
TEST_P(HaloOn, SumsOverCuts) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (const PeerAccess access : {PeerAccess::automatic, PeerAccess::staged}) {
      DeviceSet devices(GetParam(), seed, access);
      const int parts = devices.count();
      // Elements are cut; the node at a cut is owned by the part above it, the one below has a copy at its
      // end.
      std::vector<Buffer<Index>> sum;
      std::vector<HaloLink> links;
      const auto first = [&](int p) { return kNodes * p / parts; };
      for (int p = 0; p < parts; ++p) {
        const Index nodes = first(p + 1) - first(p) + (p + 1 < parts ? 1 : 0);
        sum.emplace_back(devices.device(p), nodes);
        if (p + 1 < parts)
          links.push_back({.holder = p, .owner = p + 1, .count = 1, .first_here = nodes - 1});
        if (p % 2 == 1 && p + 1 < parts) links.back().there = {0}, links.back().here = {nodes - 1};
      }
      Halo<Index> halo(devices, "sums", links, HaloOp::accumulate);
      const auto fields = [&](int p) { return std::array{sum[static_cast<std::size_t>(p)].view()}; };
      for (int k = 0; k < 3; ++k) {
        devices.for_each_part([&](ExecContext& ctx, int p) {
          halo.await_readers(p, fields);
          ctx.parallel_for("test/clear", fields(p)[0].size(), test::Clear{fields(p)[0]});
          for (const Index parity : {0, 1})
            ctx.parallel_for("test/add", kNodes, test::AddElements{fields(p)[0], first(p), parity});
          halo.begin(p, fields);
        });
        halo.finish(fields);
      }
      devices.for_each_part([&](ExecContext& ctx, int p) {
        const std::vector<Index> sums = to_host(ctx, fields(p)[0]);
        for (Index i = 0; i < first(p + 1) - first(p); ++i) {
          const Index node = first(p) + i;
          const Index both = (node > 0 ? node - 1 : 0) + (node + 1 < kNodes ? node : 0);
          EXPECT_EQ(sums[static_cast<std::size_t>(i)], both) << "node " << node << ", seed " << seed;
        }
      });
    }
    if (GetParam().starts_with("cuda")) break;
  }
}

TEST(HaloErrors, NameTheLink) {
  DeviceSet devices("cpu:2");
  const auto message = [&](const HaloLink& link) -> std::string {
    return message_of([&] { Halo<float> halo(devices, "rod", {link}); });
  };
  EXPECT_NE(
      message({.holder = 0, .owner = 2, .count = 1}).find("elements of part 2, expected two of 2 parts"),
      std::string::npos);
  EXPECT_NE(
      message({.holder = 0, .owner = 1, .count = 2, .there = {1}, .here = {1}}).find("lists have 1 and 1"),
      std::string::npos);
}

}  // namespace
}  // namespace tactus
