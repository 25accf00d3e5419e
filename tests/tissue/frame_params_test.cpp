// Steps whose length, gravity and number lie on the device give the bits of steps that the host calls.
#include "tactus/frame/frame_on_devices.h"

#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 30000, .poisson = 0.45F};
const TledOptions kRelaxing{
    .relaxation = {{{.share = 0.4F, .time_s = 0.01F}, {.share = 0.2F, .time_s = 0.1F}}}};

CubeLattice block() {
  const auto distance_m = [](Vec3f p) {
    return std::max({std::abs(p.x) - 0.03F, std::abs(p.y) - 0.03F, std::abs(p.z) - 0.1F});
  };
  CubeLattice lattice =
      lattice_from_sdf(distance_m, {{-0.04F, -0.04F, -0.11F}, {0.04F, 0.04F, 0.11F}}, {.spacing_m = 0.01F});
  lattice.fix_half_space({0, -0.025F, 0}, {0, 1, 0});
  return lattice;
}

struct FrameOfTest {
  float dt_s;
  int substeps;
  Vec3f gravity_m_s2;
};
/// Odd and even numbers of substeps, other steps and another gravity.
constexpr FrameOfTest kFrames[] = {{1e-4F, 6, {0, -9.81F, 0}},
                                   {1.3e-4F, 4, {0, -9.81F, 0}},
                                   {0.7e-4F, 10, {3, 0, 1}},
                                   {1.1e-4F, 2, {0, 5, 0}},
                                   {0.9e-4F, 8, {0, -2, 0}}};

BodySolver make_body(DeviceSet& devices, const ElementMask& elements) {
  const CubeLattice lattice = block();
  return {devices,
          {.lattice = lattice,
           .elements = elements,
           .materials = {&kMaterial, 1},
           .tled = kRelaxing,
           .flsm = {.young_Pa = 30000, .half_width = 1}},
          {.least_elements = 0}};
}

std::vector<Vec3f> stepped_by_host(const ElementMask& elements, int matching_every, int odd) {
  DeviceSet cpu("cpu");
  BodySolver body = make_body(cpu, elements);
  for (const FrameOfTest& f : kFrames) {
    body.begin_frame();
    body.step({.dt_s = f.dt_s, .gravity_m_s2 = f.gravity_m_s2, .matching_every = matching_every},
              f.substeps + odd);
    body.end_frame(f.substeps + odd);
  }
  return body.positions_m();
}

/// Blocks of two substeps and of one, recorded once where the device records.
std::vector<Vec3f> stepped_by_device(DeviceSet& devices, const ElementMask& elements, int matching_every,
                                     int odd) {
  BodySolver body = make_body(devices, elements);
  FrameOnDevices frame(devices);
  body.follow(frame);
  DeviceReplay begin, pair, single, end;
  const auto block_of = [&](int count) {
    for (int k = 0; k < count; ++k) {
      body.substep({.matching_every = matching_every}, k, count);
      body.check_nodes(k, count);
    }
    frame.end_block(count);
  };
  for (const FrameOfTest& f : kFrames) {
    const int substeps = f.substeps + odd;
    frame.begin({.dt_s = f.dt_s, .gravity_m_s2 = f.gravity_m_s2, .substeps = substeps});
    begin.run(devices, [&] {
      body.begin_frame();
      body.begin_substeps();
    });
    for (int k = 0; k + 1 < substeps; k += 2) pair.run(devices, [&] { block_of(2); });
    if (odd != 0) single.run(devices, [&] { block_of(1); });
    end.run(devices, [&] {
      body.end_substeps(0);
      body.end_frame(0);
    });
  }
  devices.synchronize();  // a body of few slabs leaves devices on which only the frame counts on
  EXPECT_EQ(body.node_check().bad_substep, -1);
  return body.positions_m();
}

class FrameParamsDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FrameParamsDevices);

TEST_P(FrameParamsDevices, ElementsThatRelaxStepAsTheHostCalls) {
  DeviceSet devices(GetParam());
  for (const int odd : {0, 1})
    EXPECT_EQ(stepped_by_device(devices, {}, 1, odd), stepped_by_host({}, 1, odd)) << odd;
}

TEST_P(FrameParamsDevices, HybridBodiesStepAsTheHostCalls) {
  DeviceSet devices(GetParam());
  const ElementMask half = split_by_ratio(block(), 2, 1, 1);
  EXPECT_EQ(stepped_by_device(devices, half, 1, 1), stepped_by_host(half, 1, 1));
  EXPECT_EQ(stepped_by_device(devices, half, 2, 0), stepped_by_host(half, 2, 0));
}

}  // namespace
}  // namespace tactus
