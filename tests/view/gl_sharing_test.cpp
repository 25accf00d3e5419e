// A hull drawn from the memory of the device that made it, beside the same drawn from copies on the host.
#include <gtest/gtest.h>

#include <iostream>
#include <memory>

#include "support/device_sets.h"
#include "tactus/reconstruct/texture/surface_texture.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/view/renderer.h"

namespace tactus {
namespace {

constexpr ViewCamera kViewer{.target_m = {0, 0.5F, 0}, .distance_m = 2, .azimuth_rad = 0.4F};

class GlSharing : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
    if (const std::string why = Renderer::why_unavailable(); !why.empty()) GTEST_SKIP() << why;
  }
};
TACTUS_INSTANTIATE_DEVICES(GlSharing);

/// The hull of a moving hand in the memory of a device, and its cameras' pictures there.
class HandOnDevice {
 public:
  explicit HandOnDevice(const std::string& devices)
      : devices_(devices, 7),
        source_({.figure = "hand-moving", .colors = true, .depth = false, .truth = false}),
        hull_(devices_, source_.rig().cameras, {.workspace_m = source_.rig().workspace_m, .resolution = 64}),
        normals_(devices_.device(0), hull_.mesh().positions_m.size()) {}

  ExecContext& ctx() { return devices_.context(0); }
  void next() {
    ASSERT_EQ(source_.next(frame_), NextFrame::success);
    hull_.upload(frame_.silhouettes);
    hull_.reconstruct();
    devices_.synchronize();
    report_ = hull_.report();
    normals_.compute(ctx(), hull_.mesh(), hull_.voxel_size_m());
    std::vector<Rgb8> pixels;
    for (const ColorImage& image : frame_.colors)
      pixels.insert(pixels.end(), image.pixels.begin(), image.pixels.end());
    photos_ = to_device(ctx(), pixels);
  }
  /// `host`: of copies.
  ViewScene scene(bool photographed, bool host) {
    const MeshView mesh = hull_.mesh();
    const auto normals = normals_.view().part(0, report_.vertices);
    const TriangleMesh copy = [&] {
      TriangleMesh m = hull_.download();
      m.normals = to_host(ctx(), normals);
      return m;
    }();
    ViewScene scene;
    ViewMesh view{.name = "hand", .material = clay_material()};
    if (photographed) {
      view.photos =
          std::make_shared<ViewPhotos>(ViewPhotos{.cameras = source_.rig().cameras,
                                                  .images = host ? frame_.colors : std::vector<ColorImage>{},
                                                  .k = 3,
                                                  .voxel_size_m = hull_.voxel_size_m(),
                                                  .center_m = source_.rig().workspace_m.center()});
    }
    if (host) {
      view.mesh = copy;
    } else {
      view.device = DeviceSurface{.ctx = &ctx(),
                                  .positions_m = mesh.positions_m.part(0, report_.vertices),
                                  .normals = normals,
                                  .triangles = mesh.triangles.part(0, report_.triangles),
                                  .box_m = bounds(copy),
                                  .photos = photographed ? photos_.const_view() : View<const Rgb8>{}};
    }
    scene.meshes.push_back(std::move(view));
    return scene;
  }
  std::string sharing() { return Renderer::sharing(devices_.device(0)); }

 private:
  DeviceSet devices_;
  SyntheticSource source_;
  VisualHull hull_;
  SurfaceNormals normals_;
  FrameSet frame_;
  HullReport report_;
  Buffer<Rgb8> photos_;
};

TEST_P(GlSharing, PicturesAreTheSameAsFromHostCopies) {
  HandOnDevice hand(GetParam());
  const RendererOptions options{.width_px = 480, .height_px = 360};
  Renderer from_device(options), from_host(options);
  std::cout << GetParam() << ": " << from_device.description() << "; " << hand.sharing() << "\n";
  RecordProperty("sharing", hand.sharing());
  for (int frame = 0; frame < 3; ++frame) {  // the second reuses what the first made, the mesh is another
    hand.next();
    for (const bool photographed : {true, false}) {
      const ColorImage expected = from_host.render(hand.scene(photographed, true), kViewer);
      const ColorImage image = from_device.render(hand.scene(photographed, false), kViewer);
      EXPECT_EQ(image.pixels, expected.pixels) << "frame " << frame << ", photographs " << photographed;
      const ColorImage empty = from_host.render({}, kViewer);
      std::size_t drawn = 0;
      for (std::size_t i = 0; i < empty.pixels.size(); ++i)
        drawn += expected.pixels[i] == empty.pixels[i] ? 0 : 1;
      EXPECT_GT(drawn, empty.pixels.size() / 50);  // the hand covers 4 % of the picture, and its shadow more
    }
  }
}

/// With NVIDIA's OpenGL on the GPU that computes, nothing goes through the host.
TEST_P(GlSharing, NothingIsCopiedWhereTheDriverShares) {
  DeviceSet devices(GetParam());
  const Renderer renderer;
  const std::string how = Renderer::sharing(devices.device(0));
  if (!devices.device(0).is_cuda()) {
    EXPECT_EQ(how, "read where it lies, in the host's memory");
    return;
  }
  if (renderer.description().find("NVIDIA") == std::string::npos ||
      how.find("another GPU") != std::string::npos)
    GTEST_SKIP() << how;
  EXPECT_NE(how.find("(shared with OpenGL)"), std::string::npos) << how;
}

}  // namespace
}  // namespace tactus
