// Eight GenICam cameras of Aravis's own making, an address each, in a network of this process alone.
#include <arpa/inet.h>
#include <arv.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <opencv2/core.hpp>
#include <thread>

#include "support/message_of.h"
#include "tactus/base/timing.h"
#include "tactus/rig/client_camera.h"
#include "tactus/rig/live.h"
#include "tactus/rig/picture_reader.h"

namespace tactus {
namespace {

constexpr int kCameras = 8;
constexpr Vec2i kSize{160, 120};

std::string address_of(int camera) { return "127.0.0." + std::to_string(camera + 1); }

/// A network namespace whose loopback has eight addresses. @returns why there is none, or "".
std::string enter_network() {
  if (::unshare(CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0)
    return std::string("no network namespace: ") + std::strerror(errno);
  const int fd = ::socket(AF_INET, SOCK_DGRAM, 0);
  bool ok = fd >= 0;
  for (int c = 0; ok && c < kCameras; ++c) {
    ifreq request{};
    std::strncpy(request.ifr_name, c == 0 ? "lo" : ("lo:" + std::to_string(c)).c_str(), IFNAMSIZ - 1);
    if (c > 0) {
      auto* to = reinterpret_cast<sockaddr_in*>(&request.ifr_addr);
      to->sin_family = AF_INET;
      ok = ::inet_pton(AF_INET, address_of(c).c_str(), &to->sin_addr) == 1 &&
           ::ioctl(fd, SIOCSIFADDR, &request) == 0;
    }
    request.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK;
    ok = ok && ::ioctl(fd, SIOCSIFFLAGS, &request) == 0;
  }
  ::close(fd);
  return ok ? "" : std::string("no addresses on the loopback: ") + std::strerror(errno);
}

/// Every camera has grey pictures of its own.
void fill(ArvBuffer* buffer, void* camera, guint32, guint32, ArvPixelFormat) {
  std::size_t unused = 0;
  void* data = const_cast<void*>(arv_buffer_get_data(buffer, &unused));
  const auto pixels = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                      static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
  const int grey = 40 + *static_cast<int*>(camera);
  if (arv_buffer_get_image_pixel_format(buffer) == ARV_PIXEL_FORMAT_MONO_16)
    std::fill_n(static_cast<std::uint16_t*>(data), pixels, static_cast<std::uint16_t>(100 * grey));
  else
    std::memset(data, grey, pixels);
}

class Genicam : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    why_not_ = enter_network();
    if (!why_not_.empty()) return;
    for (int c = 0; c < kCameras; ++c) {
      numbers_[c] = c;
      cameras_[c] =
          arv_gv_fake_camera_new_full(address_of(c).c_str(), ("T" + std::to_string(c)).c_str(), nullptr);
      arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(cameras_[c]), fill, &numbers_[c]);
    }
  }
  static void TearDownTestSuite() {
    for (ArvGvFakeCamera* camera : cameras_) g_clear_object(&camera);
  }
  void SetUp() override {
    if (!why_not_.empty()) GTEST_SKIP() << why_not_;
  }
  static std::unique_ptr<PictureReader> open(int camera, PictureTrigger trigger) {
    return open_genicam(address_of(camera), {kSize.x, kSize.y, 30, trigger});
  }
  static inline std::string why_not_;
  static inline ArvGvFakeCamera* cameras_[kCameras] = {};
  static inline int numbers_[kCameras] = {};
};

TEST_F(Genicam, RunsFree) {
  const auto reader = open(3, PictureTrigger::none);
  EXPECT_TRUE(reader->is_device());
  cv::Mat picture;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(reader->read(picture));
    EXPECT_EQ(picture.cols, kSize.x);
    EXPECT_EQ(picture.at<cv::Vec3b>(7, 9), cv::Vec3b(43, 43, 43));
  }
}

/// 4200 units of 0.1 mm along the rays, through a lens that bends nothing.
TEST_F(Genicam, MeasuresDistances) {
  RigFile file;
  DepthRecording tof{
      {look_at({0, 0, 2}, {}, {0, 1, 0}, kSize.x, kSize.y, 100), {}}, "", "aravis:" + address_of(2), {}};
  tof.calibrated.camera.name = "tof";
  tof.encoding = {.unit_m = 1e-4, .is_radial = true};
  file.depths = {tof};
  const auto camera = open_client_camera(file, "rig.yaml", "tof", {});
  CameraImages images;
  ASSERT_EQ(camera->grab(0, images), "");
  ASSERT_EQ(images.depth_m.width_px, kSize.x);
  EXPECT_FLOAT_EQ(images.depth_m(30, 40), 0.42F);
  EXPECT_NE(
      test::message_of([] { open_pictures("/dev/video9", {.is_depth = true}); }).find("gives no distances"),
      std::string::npos);
}

TEST_F(Genicam, ACameraThatIsNotThereHasOneMessage) {
  EXPECT_NE(test::message_of([] {
              open_genicam("127.0.0.99", {kSize.x, kSize.y, 30, PictureTrigger::none});
            }).find("GenICam camera '127.0.0.99'"),
            std::string::npos);
}

/// The server's triggers, to the cameras and back as sets.
TEST_F(Genicam, EveryTriggerOfTheServerBecomesAWholeSet) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  const int triggers = is_long ? 300 : 25;
  LiveSettings settings;
  settings.address = "tcp://127.0.0.1:*";
  settings.sync = LiveSync::software;
  settings.fps = 5;  // these cameras look for triggers every 40 ms
  settings.deadline_s = 0.9 / settings.fps;
  std::vector<LiveCamera> cameras;
  for (int c = 0; c < kCameras; ++c) cameras.push_back({"cam" + std::to_string(c), kSize, 1, false});
  std::vector<std::unique_ptr<PictureReader>> readers;
  for (int c = 0; c < kCameras; ++c) readers.push_back(open(c, PictureTrigger::software));
  RigServer server(cameras, settings, std::nullopt);
  std::atomic<bool> stops = false;
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (std::size_t c = 0; c < kCameras; ++c) {
    threads.emplace_back([&, c] {
      RigClient client(cameras[c], server.address(), std::nullopt);
      cv::Mat picture;
      CameraImages images;
      while (!stops) {
        const auto trigger = client.wait_trigger(now_s() + 0.1);
        if (!trigger) continue;
        const double captured_s = now_s();
        if (!readers[c]->read(picture) || picture.at<cv::Vec3b>(5, 5)[0] != 40 + c) {
          ++wrong;
          continue;
        }
        images.mask = BitMask(kSize.x, kSize.y);
        images.mask.words[0] = static_cast<std::uint32_t>(c);
        client.put(images, *trigger, captured_s);
      }
    });
  }
  LiveSet set;
  int sets = 0, complete = 0;
  std::int64_t first = -1, last = -1;
  for (const double end_s = now_s() + 200; sets < triggers && now_s() < end_s;) {
    if (!server.wait(set, now_s() + 0.5)) continue;
    if (first < 0 && !set.is_complete) continue;  // until all are connected
    if (first < 0) first = set.tick;
    last = set.tick;
    ++sets;
    complete += set.is_complete ? 1 : 0;
  }
  stops = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sets, triggers);
  EXPECT_EQ(last - first + 1, triggers);
  EXPECT_GE(complete, is_long ? triggers : triggers * 8 / 10);  // a busy machine is late now and then
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace tactus
