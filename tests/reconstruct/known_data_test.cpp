// The hull of real photographs and videos whose answers are known.
#include <gtest/gtest.h>

#include "support/data_folder.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {
namespace {

class KnownData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (data_folder().empty()) GTEST_SKIP() << without_data("middlebury_dino and utrecht_horseman");
  }
};

struct Result {
  TriangleMesh mesh;
  double iou_mean = 0, recall = 0;
};

Result hull_of_first_frame(FrameSource& source, Index resolution) {
  FrameSet frame;
  EXPECT_EQ(source.next(frame), NextFrame::success);
  const Rig& rig = source.rig();
  DeviceSet devices("cpu");
  VisualHull hull(devices, rig.cameras,
                  {.workspace_m = rig.workspace_m, .resolution = resolution, .slack_px = rig.slack_px});
  hull.upload(frame.silhouettes);
  hull.reconstruct();
  Result result{hull.download()};
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const BitMask seen = render_silhouette(result.mesh, rig.cameras[c]);
    result.iou_mean += iou(seen, frame.silhouettes[c]) / static_cast<double>(rig.cameras.size());
    result.recall += recall(seen, frame.silhouettes[c]) / static_cast<double>(rig.cameras.size());
  }
  return result;
}

/// A naive voxel hull of the 15 good photographs has a mean IoU of 0.972 at 128 and 0.9805 at 256 voxels;
/// ours must be better and cover the silhouettes.
TEST_F(KnownData, DinoCoversItsSilhouettes) {
  for (const auto& [resolution, least_iou] : {std::pair{128, 0.975}, std::pair{256, 0.985}}) {
    const auto source = open_middlebury(data_folder() + "/middlebury_dino");
    const Result result = hull_of_first_frame(*source, resolution);
    EXPECT_GE(result.iou_mean, least_iou) << resolution;
    EXPECT_GE(result.recall, 0.995) << resolution;
    EXPECT_EQ(topology(result.mesh).nonmanifold_edges, 0) << resolution;
    EXPECT_EQ(topology(result.mesh).boundary_edges, 0) << resolution;
  }
}

/// Hulls of independent programs from the hand-painted masks hold 0.19 to 0.215 m^3, by resolution and rule.
TEST_F(KnownData, HorsemanHasItsVolume) {
  const auto source = open_masks(source_path("rigs/horseman-masks.yaml"));
  const double volume = volume_m3(hull_of_first_frame(*source, 200).mesh);
  EXPECT_GE(volume, 0.19);
  EXPECT_LE(volume, 0.215);
}

}  // namespace
}  // namespace tactus
