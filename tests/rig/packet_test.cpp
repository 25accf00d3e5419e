// Packets of images: what was sent comes back, and what was not sent is refused.
#include "tactus/rig/wire/packet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <regex>

#include "tactus/base/read_file.h"
#include "tactus/geom/camera/camera.h"
#include "tactus/rig/wire/photo_coder.h"

namespace tactus {
namespace {

constexpr Vec2i kSize{70, 41};  // rows of masks have padding

BitMask disc(double radius_px) {
  BitMask mask(kSize.x, kSize.y);
  for (Index y = 0; y < kSize.y; ++y) {
    for (Index x = 0; x < kSize.x; ++x) {
      if (std::hypot(x - 40, y - 20) < radius_px) mask.set(x, y);
    }
  }
  return mask;
}

PacketHead head() {
  PacketHead h;
  h.camera = "cam3";
  h.calibration = 0x123456789abcdef0;
  h.boot = 77;
  h.sequence = 1'000'000'000'001;
  h.trigger = 12345;
  h.captured_s = 17.25;
  h.sent_s = 17.26;
  h.replaced = 9;
  return h;
}

std::string packet(const CameraImages& images) {
  PacketHead h = head();
  std::string bytes;
  PacketCoder().pack(h, images, bytes);
  return bytes;
}

TEST(Packet, GivesWhatWasSent) {
  CameraImages images;
  images.mask = disc(12);
  images.alpha = AlphaImage(kSize.x, kSize.y, 3);
  images.alpha(5, 6) = 200;
  images.photo_box = {28, 8, 25, 25};
  images.photo_jpeg = "not looked at here";
  PacketHead h = head();
  std::string bytes;
  PacketCoder coder;
  coder.pack(h, images, bytes);
  PacketHead got;
  ASSERT_EQ(parse_packet_head(bytes, got), Refusal::none);
  EXPECT_EQ(got.camera, "cam3");
  EXPECT_EQ(got.contents, PacketHead::kMask | PacketHead::kAlpha | PacketHead::kPhoto);
  EXPECT_EQ(got.calibration, h.calibration);
  EXPECT_EQ(got.boot, h.boot);
  EXPECT_EQ(got.sequence, h.sequence);
  EXPECT_EQ(got.trigger, h.trigger);
  EXPECT_EQ(got.captured_s, h.captured_s);
  EXPECT_EQ(got.sent_s, h.sent_s);
  EXPECT_EQ(got.size_px, kSize);
  EXPECT_EQ(got.replaced, 9U);
  CameraImages back;
  ASSERT_TRUE(coder.unpack(bytes, got, back));
  EXPECT_EQ(back.mask, images.mask);
  EXPECT_EQ(back.alpha.pixels, images.alpha.pixels);
  EXPECT_EQ(back.photo_box, images.photo_box);
  EXPECT_EQ(back.photo_jpeg, images.photo_jpeg);
}

TEST(Packet, GivesDistancesToTheBit) {
  CameraImages images;
  images.depth_m = DepthImage(kSize.x, kSize.y);
  std::mt19937 random(1);
  for (float& d : images.depth_m.pixels) d = std::uniform_real_distribution<float>(0.5F, 2)(random);
  images.depth_m(0, 0) = std::nanf("7");
  const std::string bytes = packet(images);
  EXPECT_LE(bytes.size(), packet_limit(kSize));  // noise does not get smaller
  PacketHead got;
  ASSERT_EQ(parse_packet_head(bytes, got), Refusal::none);
  CameraImages back;
  ASSERT_TRUE(PacketCoder().unpack(bytes, got, back));
  EXPECT_EQ(
      std::memcmp(back.depth_m.pixels.data(), images.depth_m.pixels.data(), images.depth_m.pixels.size() * 4),
      0);
}

/// A silhouette of 640x480 pixels, 38,400 bytes, of a disc: two words change from row to row.
TEST(Packet, OfASilhouetteIsSmall) {
  if (!ImageCoder::missing().empty()) GTEST_SKIP() << ImageCoder::missing();
  CameraImages images;
  images.mask = BitMask(640, 480);
  for (Index y = 0; y < 480; ++y) {
    for (Index x = 0; x < 640; ++x) {
      if (std::hypot(x - 300, y - 250) < 100) images.mask.set(x, y);
    }
  }
  EXPECT_LT(packet(images).size(), 2500U);
}

TEST(Packet, CutAnywhereIsRefused) {
  CameraImages images;
  images.mask = disc(12);
  const std::string bytes = packet(images);
  PacketHead got;
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_EQ(parse_packet_head(bytes.substr(0, n), got), Refusal::too_short) << n;
  EXPECT_EQ(parse_packet_head(bytes + "x", got), Refusal::too_long);
}

TEST(Packet, WrongHeadsAreRefused) {
  CameraImages images;
  images.mask = disc(12);
  const std::string good = packet(images);
  const auto with = [&](std::size_t at, auto value) {
    std::string bytes = good;
    set_bytes(bytes, at, value);
    PacketHead got;
    return parse_packet_head(bytes, got);
  };
  EXPECT_EQ(with(0, 'x'), Refusal::not_a_packet);
  EXPECT_EQ(with(4, std::uint16_t{2}), Refusal::version);
  EXPECT_EQ(with(6, std::uint16_t{100}), Refusal::version);
  EXPECT_EQ(with(8, std::uint8_t{0}), Refusal::head);          // no contents
  EXPECT_EQ(with(8, std::uint8_t{5}), Refusal::head);          // a mask and distances
  EXPECT_EQ(with(8, std::uint8_t{128}), Refusal::head);        // unknown ones
  EXPECT_EQ(with(16, '\0'), Refusal::head);                    // no name
  EXPECT_EQ(with(16 + 31, 'x'), Refusal::head);                // a name without an end
  EXPECT_EQ(with(16 + 20, 'x'), Refusal::head);                // more after it
  EXPECT_EQ(with(72, std::int64_t{-2}), Refusal::head);        // trigger
  EXPECT_EQ(with(80, std::nan("")), Refusal::head);            // captured
  EXPECT_EQ(with(88, HUGE_VAL), Refusal::head);                // sent
  EXPECT_EQ(with(96, std::int32_t{0}), Refusal::head);         // width
  EXPECT_EQ(with(100, std::int32_t{1 << 20}), Refusal::head);  // height
  EXPECT_EQ(with(104, std::uint16_t{1}), Refusal::head);       // a box without a photograph
}

/// Whatever is changed: refused, or unpacked to a mask that is one. Memory is of the head's size.
TEST(Packet, ChangedPayloadsDoNoHarm) {
  CameraImages images;
  images.mask = disc(12);
  images.alpha = AlphaImage(kSize.x, kSize.y, 3);
  const std::string good = packet(images);
  std::mt19937 random(2);
  PacketCoder coder;
  CameraImages back;
  for (int trial = 0; trial < 20000; ++trial) {
    std::string bytes = good;
    const std::size_t at = PacketHead::kBytes + random() % (bytes.size() - PacketHead::kBytes);
    bytes[at] = static_cast<char>(random());
    PacketHead got;
    ASSERT_EQ(parse_packet_head(bytes, got), Refusal::none);
    if (!coder.unpack(bytes, got, back)) continue;
    ASSERT_EQ(back.mask.words.size(), images.mask.words.size());
    for (Index y = 0; y < kSize.y; ++y)
      ASSERT_EQ(back.mask.words[static_cast<std::size_t>(y * 3 + 2)] >> 6, 0U);
  }
}

/// docs/wire.md has the number of each reason, and when it is given.
TEST(Packet, ReasonsAreOnThePage) {
  const std::string page = read_file(TACTUS_SOURCE_DIR "/docs/wire.md", 1 << 20);
  const std::string table = page.substr(page.find("## What is refused"));
  for (int k = 1; k < static_cast<int>(Refusal::count); ++k) {
    const std::string text = std::string("`") + refusal_text(static_cast<Refusal>(k)) + "`";
    const std::regex numbered("[ \n]" + std::to_string(k) + "[ \n]" + text);
    EXPECT_TRUE(std::regex_search(page, numbered)) << k << ' ' << text;
    EXPECT_NE(table.find(text), std::string::npos) << text;
  }
}

/// Two cameras that undistort differently have different hashes.
TEST(Packet, CalibrationsHaveHashes) {
  const Camera camera = look_at({0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 640, 480, 600);
  Camera other = camera;
  EXPECT_EQ(calibration_hash(camera), calibration_hash(other));
  other.fx_px += 1e-9;
  EXPECT_NE(calibration_hash(camera), calibration_hash(other));
  const std::vector<double> k{0.1, 0};
  EXPECT_NE(calibration_hash(camera), calibration_hash(camera, make_lens(LensModel::brown, k)));
}

TEST(PhotoCoder, SendsTheBoxOfTheSilhouette) {
  if (!PhotoCoder::missing().empty()) GTEST_SKIP() << PhotoCoder::missing();
  const BitMask mask = disc(10);
  EXPECT_EQ(silhouette_box(mask), (PixelBox{31, 11, 19, 19}));
  EXPECT_EQ(silhouette_box(BitMask(70, 41)), PixelBox{});
  ColorImage photo(kSize.x, kSize.y);
  for (Index y = 0; y < kSize.y; ++y) {
    for (Index x = 0; x < kSize.x; ++x)
      photo(x, y) = {static_cast<std::uint8_t>(60 + 2 * x), static_cast<std::uint8_t>(100 + y), 120};
  }
  PhotoCoder coder;
  CameraImages images;
  ASSERT_TRUE(coder.pack(photo, mask, 90, images));
  ColorImage back;
  ASSERT_TRUE(coder.unpack(images, kSize, back));
  EXPECT_EQ(back(0, 0), Rgb8{});
  double worst = 0;
  for (Index y = 11; y < 30; ++y) {
    for (Index x = 31; x < 50; ++x)
      worst = std::max({worst, std::abs(back(x, y).r - 60. - 2 * x), std::abs(back(x, y).g - 100. - y)});
  }
  EXPECT_LT(worst, 8);  // grey levels: quality 90 rounds coefficients to multiples of 2 to 20
  images.photo_box.width_px += 1;
  EXPECT_FALSE(coder.unpack(images, kSize, back));  // another size than the JPEG's
  images.photo_box.width_px -= 1;
  images.photo_jpeg.resize(40);
  EXPECT_FALSE(coder.unpack(images, kSize, back));
}

}  // namespace
}  // namespace tactus
